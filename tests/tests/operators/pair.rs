//! Two services for one stream: one is killed, or stands still, and no tick is lost, changed or late for long.

mod alarms;
mod soak;
mod stand;

use std::time::{Duration, Instant};

use isotherm_bus::close;
use isotherm_protocol::history::AuditEvent;
use isotherm_tests::bench::LIMIT;
use isotherm_tests::operator::audit;
use isotherm_tests::pair::{until_compared, until_paired, until_speaks};
use isotherm_tests::proxy::Fault;
use zenoh::qos::CongestionControl;

use stand::{LEASE, Mishap, Stand, configuration};

#[tokio::test(flavor = "multi_thread")]
async fn a_killed_a_stopped_and_a_starved_service_are_not_missed() {
    let mut stand = Stand::start(2, &configuration("")).await;
    until_compared(&stand.session, 2, 50).await;
    stand.swap(0).await;
    for mishap in [Mishap::Killed, Mishap::Stopped, Mishap::Starved] {
        let pause = stand.suffer(mishap).await;
        println!("{mishap:?}: longest pause {pause:?}");
        assert!(pause < Duration::from_secs(1), "{pause:?}");
    }
    until_compared(&stand.session, 2, 50).await;
    // What was done is in both state folders, whoever did it.
    let deadline = Instant::now() + LIMIT;
    loop {
        let histories = [0, 1].map(|index| accepted(&stand, index));
        let whole = histories[0].len() as u64 == stand.revisions.iter().sum::<u64>();
        if whole && histories[0] == histories[1] {
            break;
        }
        assert!(Instant::now() < deadline, "{histories:#?}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    println!("doubled {}", stand.end().await);
}

/// What the audit file of an instance says was accepted: unit, revision, digest.
fn accepted(stand: &Stand, index: usize) -> std::collections::BTreeSet<(Option<String>, u64, String)> {
    let entries = audit(&stand.pair.state(index)).into_iter();
    let accepted = entries.filter_map(|entry| match entry.event {
        AuditEvent::Accepted(accepted) => Some((entry.unit, accepted.revision, accepted.digest.to_string())),
        _ => None,
    });
    accepted.collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cut_link_loses_nothing() {
    let mut stand = Stand::start(1, &configuration("")).await;
    stand.second_speaks().await;
    for fault in faults() {
        let pause = stand.suffer(Mishap::Link(fault)).await;
        println!("{fault:?} of the speaking instance's connections: longest pause {pause:?}");
        let pause = stand.suffer(Mishap::Link(fault)).await;
        println!("{fault:?} of the standby's connections: longest pause {pause:?}");
        stand.second_speaks().await;
    }
    println!("doubled {}", stand.end().await);
}

/// `ISOTHERM_PAIR` asks for all of them.
fn faults() -> Vec<Fault> {
    let all = [Fault::Cut, Fault::Stall, Fault::HalfOpen, Fault::Throttle];
    if std::env::var_os("ISOTHERM_PAIR").is_some() { all.into() } else { vec![Fault::Cut] }
}

#[tokio::test(flavor = "multi_thread")]
async fn of_two_active_services_either_may_be_killed_without_a_pause() {
    let mut stand = Stand::start(1, &configuration("mode = \"active\"")).await;
    until_compared(&stand.session, 1, 50).await;
    let pause = stand.suffer(Mishap::Killed).await;
    println!("active, killed: longest pause {pause:?}");
    until_compared(&stand.session, 1, 50).await;
    // Both publish: a subscriber that takes the first of each tick drops the others, and counts them.
    let doubled = stand.end().await;
    assert!(doubled > 100, "{doubled}");
}

/// Of a unit that sends nothing no tick is late: that nobody publishes it must be found without one.
#[tokio::test(flavor = "multi_thread")]
async fn a_unit_that_sends_nothing_is_published_after_its_instance_stood_still() {
    let mut stand = Stand::start(1, &configuration("")).await;
    until_compared(&stand.session, 1, 150).await;
    stand.judge().await;
    for _ in 0..2 {
        let speaking = stand.speaker().await;
        stand.pair.signal(speaking, "STOP");
        // For so long that the other may have taken over, and too short for the lease.
        tokio::time::sleep(LEASE * 4 / 5).await;
        stand.pair.signal(speaking, "CONT");
        until_speaks(&stand.session, 1 - speaking, 1).await;
        until_paired(&stand.session, 1).await;
    }
    close(stand.session, LIMIT).await.unwrap();
}

/// A source that publishes with `Block` is held by a stopped service no longer than by the lease of both.
#[tokio::test(flavor = "multi_thread")]
async fn a_stopped_service_holds_no_source_for_longer_than_its_lease() {
    let stand = Stand::start(1, &configuration("")).await;
    let stopped = 1 - stand.speaker().await;
    let source = stand.pair.session_with(Some(LEASE)).await;
    let publisher =
        source.declare_publisher("imu/PAIR-00/raw/health").congestion_control(CongestionControl::Block);
    let publisher = publisher.await.unwrap();
    stand.pair.signal(stopped, "STOP");
    let (begin, mut longest) = (Instant::now(), Duration::ZERO);
    while begin.elapsed() < Duration::from_secs(2) {
        let at = Instant::now();
        // No health reading: refused and counted, but it fills what is between the two.
        publisher.put(vec![0_u8; 60_000]).await.unwrap();
        longest = longest.max(at.elapsed());
    }
    println!("longest put {longest:?}");
    assert!(longest > Duration::from_millis(100), "the source was not held at all: {longest:?}");
    assert!(longest < Duration::from_millis(1500), "{longest:?}");
    stand.pair.signal(stopped, "CONT");
    until_paired(&stand.session, 1).await;
    close(source, LIMIT).await.unwrap();
}

/// `ISOTHERM_PAIR=UNITS,KILLS,STOPS,CUTS` makes it shorter.
#[tokio::test(flavor = "multi_thread")]
#[ignore = "takes ten minutes: just pair"]
async fn a_hundred_kills_fifty_stops_and_fifty_cuts_lose_nothing() {
    let sizes = std::env::var("ISOTHERM_PAIR").unwrap_or_else(|_| "20,100,50,50".to_owned());
    let sizes: Vec<usize> = sizes.split(',').map(|size| size.parse().expect("a number")).collect();
    let [units, kills, stops, cuts] = sizes[..] else { panic!("ISOTHERM_PAIR=UNITS,KILLS,STOPS,CUTS") };
    let mut stand = Stand::start(units, &configuration("")).await;
    until_compared(&stand.session, units, 50).await;
    for (mishap, count) in
        [(Mishap::Killed, kills), (Mishap::Stopped, stops), (Mishap::Link(Fault::Cut), cuts)]
    {
        let mut pauses = Vec::new();
        for _ in 0..count {
            let moment = stand.dice.below(1000);
            tokio::time::sleep(Duration::from_millis(moment)).await;
            pauses.push(stand.suffer(mishap).await);
        }
        pauses.sort_unstable();
        let share =
            |share: usize| pauses.get((pauses.len() * share / 100).min(pauses.len().saturating_sub(1)));
        println!(
            "{mishap:?} {count}: pauses p50 {:?}, p99 {:?}, longest {:?}",
            share(50),
            share(99),
            pauses.last()
        );
    }
    println!("doubled {}", stand.end().await);
}
