//! Connections that are late, slow, silent, open by half, or cut; a router that is killed and comes back.

use std::time::Duration;

use isotherm_bus::{SessionOptions, close, open_config, session::set};
use isotherm_tests::bench::LIMIT;
use isotherm_tests::proxy::{Fault, Proxy, Switch};
use zenoh::Session;

use crate::line::{Books, Folders, LEASE, Line, Side};

/// What is to be lost: nothing, some ticks, or either, as the queues of the moment have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Lost {
    Nothing,
    Some,
    Maybe,
}

impl Lost {
    fn is(self, ticks: u64) -> bool {
        match self {
            Self::Nothing => ticks == 0,
            Self::Some => ticks > 0,
            Self::Maybe => true,
        }
    }
}

/// A fault of the links, for how long, and what is to be lost on the way in and out where it is of that side.
const CASES: [(Fault, Duration, [Lost; 2]); 7] = [
    (Fault::Delay, Duration::from_millis(600), [Lost::Nothing; 2]),
    (Fault::Throttle, Duration::from_millis(600), [Lost::Maybe; 2]),
    // Shorter than the lease: what was held comes.
    (Fault::Stall, Duration::from_millis(250), [Lost::Nothing; 2]),
    (Fault::Stall, Duration::from_millis(1500), [Lost::Some; 2]),
    (Fault::HalfOpen, Duration::from_millis(1500), [Lost::Some; 2]),
    (Fault::Deaf, Duration::from_millis(1500), [Lost::Some; 2]),
    (Fault::Cut, Duration::from_millis(300), [Lost::Some; 2]),
];

#[tokio::test(flavor = "multi_thread")]
async fn every_tick_is_accounted_for_whatever_a_link_does() {
    let mut line = Line::start(4).await;
    for (fault, time, lost) in CASES {
        for (side, lost) in [Side::In, Side::Out].into_iter().zip(lost) {
            line.play(Duration::from_millis(100)).await;
            line.trouble(side, fault);
            line.play(time).await;
            let books = line.settled().await;
            say(&format!("{fault:?} {} ms {side:?}", time.as_millis()), books);
            let [own, other] = match side {
                Side::In => [books.announced, books.lost],
                Side::Out => [books.lost, books.announced],
            };
            assert!(lost.is(own) && other == 0, "{fault:?} {side:?}: {lost:?} was to be lost: {books:?}");
        }
    }
    line.end().await;
}

/// A line of the table that `--nocapture` shows.
pub(crate) fn say(what: &str, books: Books) {
    let Books { sent, received, announced, lost } = books;
    println!(
        "{what:<24} sent {sent:6}  received {received:6}  announced {announced:5}  lost behind {lost:5}"
    );
}

/// A router; its connections go through a proxy.
async fn router(endpoint: &str) -> Session {
    let options =
        SessionOptions { listen: vec![endpoint.to_owned()], lease: Some(LEASE), ..SessionOptions::default() };
    let mut config = options.to_config().unwrap();
    set(&mut config, "mode", "router").unwrap();
    open_config(config).await.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_router_that_is_killed_and_comes_back_costs_the_ticks_of_its_absence_alone() {
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let endpoint = format!("tcp/{}", free.local_addr().unwrap());
    drop(free);
    let mut alive = router(&endpoint).await;
    let switch = Switch::default();
    let proxy = Proxy::start(&endpoint, &switch);
    let folders = Folders::new(2);
    let client = folders.whole.path().join("client.json5");
    let text = format!(
        "{{mode: 'client', connect: {{endpoints: ['{}#retry_period_init_ms=50;retry_period_max_ms=100']}}, \
         scouting: {{multicast: {{enabled: false}}}}}}",
        proxy.endpoint
    );
    std::fs::write(&client, text).unwrap();
    let options = ["--zenoh-config", client.to_str().unwrap()];
    let mut line = Line::start_in(folders, &options, Some(&proxy.endpoint), &[]).await;
    for absence in [100, 1200] {
        line.play(Duration::from_millis(200)).await;
        // As a crash: what is connected finds the connections gone.
        switch.set(Fault::Cut);
        close(alive, LIMIT).await.unwrap();
        line.play(Duration::from_millis(absence)).await;
        alive = router(&endpoint).await;
        switch.set(Fault::None);
        let books = line.settled().await;
        say(&format!("router gone {absence} ms"), books);
        assert!(books.announced > 0, "{books:?}");
    }
    line.end().await;
    close(alive, LIMIT).await.unwrap();
}
