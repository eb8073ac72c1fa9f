//! For half an hour a pair with everything that happens to one, and a day of event time at full speed: nothing grows.

use std::time::{Duration, Instant};

use isotherm_bus::{ProducerOptions, SessionOptions, close, open};
use isotherm_simulator::Scenario;
use isotherm_simulator::presets::zeeman_sine;
use isotherm_tests::bench::LIMIT;
use isotherm_tests::operator::Operator;
use isotherm_tests::pair::until_compared;
use isotherm_tests::player::Player;
use isotherm_tests::process::{Resources, Service, resources, run};
use isotherm_tests::proxy::Fault;
use isotherm_tests::slope::Series;
use isotherm_tests::yardstick::Yardstick;
use serde_json::json;

use super::stand::{Mishap, Stand, TICK, configuration};
use crate::documents::{BASE_UNIT, base};

/// How often is measured.
const INTERVAL: Duration = Duration::from_secs(5);

/// How long the pair is watched, with how many units, and the time from one failover to the next: `ISOTHERM_SOAK=MINUTES[,UNITS,SECONDS]`.
fn size() -> (Duration, usize, Duration) {
    let given = std::env::var("ISOTHERM_SOAK").unwrap_or_default();
    let mut given = given.split(',').filter(|it| !it.is_empty()).map(|it| it.parse().expect("a number"));
    let mut next = |default: u32| given.next().unwrap_or(default);
    let (minutes, units, seconds) = (next(30), next(20), next(30));
    (Duration::from_secs(60 * u64::from(minutes)), units as usize, Duration::from_secs(seconds.into()))
}

/// What is measured of a process, over the time of the test.
#[derive(Default)]
struct Watched {
    resident_kb: Series,
    threads: Series,
    descriptors: Series,
}

impl Watched {
    fn look(&mut self, hours: f64, id: u32) {
        let Resources { resident_kb, threads, descriptors, .. } = resources(id);
        let number = |value: u64| f64::from(u32::try_from(value).expect("a small number"));
        self.resident_kb.push(hours, number(resident_kb));
        self.threads.push(hours, number(threads));
        self.descriptors.push(hours, number(descriptors as u64));
    }

    /// Prints the lines; whether one of them rises by more than a tenth of its mean within the whole time, beyond its error.
    fn rises(&self, name: &str, from: f64, to: f64) -> bool {
        let all = [
            ("memory kB", &self.resident_kb),
            ("threads", &self.threads),
            ("descriptors", &self.descriptors),
        ];
        all.map(|(what, series)| rises(&format!("{name}: {what}"), series, from, to)).contains(&true)
    }
}

fn rises(what: &str, series: &Series, from: f64, to: f64) -> bool {
    let Some(line) = series.slope(from) else {
        println!("{what}: too few values");
        return true;
    };
    println!("{what}: {:.1}, slope {:+.2} ± {:.2} an hour", line.mean, line.slope, line.sigma);
    (line.slope - 3.0 * line.sigma) * (to - from) > line.mean / 10.0
}

/// The value below which that share of sorted ones is (µs).
fn share(sorted: &[Duration], percent: usize) -> Option<f64> {
    sorted
        .get((sorted.len() * percent / 100).min(sorted.len().saturating_sub(1)))
        .map(|it| it.as_secs_f64() * 1e6)
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "takes half an hour: just soak"]
async fn a_pair_that_is_never_left_alone_does_not_grow() {
    let (whole, units, failover) = size();
    let mut stand = Stand::start(units, &configuration("")).await;
    // The last unit is given commands, and its ticks are not judged.
    stand.judged = stand.units() - 1;
    until_compared(&stand.session, stand.units(), 50).await;
    let ids: Vec<u32> = stand.pair.services.iter().flatten().map(Service::id).collect();
    let mut watched = [(); 3].map(|()| Watched::default());
    // By themselves, and in units of what a message takes without a service: the machine is not always as fast.
    let [mut p50, mut p99, mut p50_ratio, mut p99_ratio] = [(); 4].map(|()| Series::default());
    let yardstick = Yardstick::start(TICK).await;
    let begin = Instant::now();
    let hours = |at: Instant| (at - begin).as_secs_f64() / 3600.0;
    let watchers = watchers(&stand).await;
    let (mut failovers, mut swaps, mut commands, mut next) = (0_u64, 0_u64, 0_u64, begin + failover);
    let mut pauses = Vec::new();
    while begin.elapsed() < whole {
        // Undisturbed but for swaps, commands and those who watch.
        drop((stand.sink.take_latencies(), yardstick.take_latencies()));
        let until = Instant::now() + INTERVAL;
        while Instant::now() < until {
            let index = usize::try_from(swaps).unwrap() % stand.judged;
            stand.swap(index).await;
            let order = ["standby", "run"][usize::try_from(commands % 2).unwrap()];
            let unit = format!("PAIR-{:02}", stand.judged);
            let reply = stand.operator.command(&unit, json!({"command": order})).await.unwrap();
            assert!(reply.accepted, "{reply:?}");
            (swaps, commands) = (swaps + 1, commands + 1);
            tokio::time::sleep(Duration::from_secs(1)).await;
        }
        let (latencies, bare) = (stand.sink.take_latencies(), yardstick.take_latencies());
        let now = hours(Instant::now());
        for (percent, own, ratio) in [(50, &mut p50, &mut p50_ratio), (99, &mut p99, &mut p99_ratio)] {
            if let Some((latency, bare)) = share(&latencies, percent).zip(share(&bare, percent)) {
                own.push(now, latency);
                ratio.push(now, latency / bare);
            }
        }
        for (watched, id) in watched.iter_mut().zip(ids.iter().copied().chain([std::process::id()])) {
            watched.look(now, id);
        }
        if Instant::now() >= next {
            // The processes stay the same, so that what grows is seen: kills are for `just pair`.
            let mishap = if failovers % 2 == 0 { Mishap::Stopped } else { Mishap::Link(Fault::Cut) };
            pauses.push(stand.suffer(mishap).await);
            (failovers, next) = (failovers + 1, Instant::now() + failover);
        }
    }
    watchers.iter().for_each(tokio::task::JoinHandle::abort);
    for watcher in watchers {
        assert!(watcher.await.is_err_and(|ended| ended.is_cancelled()), "a watcher ended by itself");
    }
    pauses.sort_unstable();
    println!(
        "{:.1} minutes: {swaps} swaps, {commands} commands, {failovers} failovers",
        whole.as_secs_f64() / 60.0
    );
    println!("pauses: p50 {:?} µs, longest {:?}", share(&pauses, 50), pauses.last());
    let (from, to) = (hours(begin + whole / 10), hours(Instant::now()));
    let names = ["first service", "second service", "this test"];
    let mut rising: Vec<_> = names
        .into_iter()
        .zip(&watched)
        .filter(|(name, it)| it.rises(name, from, to))
        .map(|(name, _)| name)
        .collect();
    for (name, series) in [("latency p50, µs", &p50), ("latency p99, µs", &p99)] {
        // Told, and not judged.
        let _ = rises(name, series, from, to);
    }
    for (name, series) in [("latency p50 / bare", &p50_ratio), ("latency p99 / bare", &p99_ratio)] {
        if rises(name, series, from, to) {
            rising.push(name);
        }
    }
    println!("doubled {}", stand.end().await);
    assert!(rising.is_empty(), "these rise: {rising:?}");
}

/// Those who look all the time: programs that ask both services for their status, and a session that asks for every unit's.
async fn watchers(stand: &Stand) -> Vec<tokio::task::JoinHandle<()>> {
    let connect: Vec<_> =
        stand.pair.endpoints().iter().flat_map(|it| ["--connect".to_owned(), it.clone()]).collect();
    let program = tokio::spawn(async move {
        loop {
            let connect = connect.clone();
            let looked = tokio::task::spawn_blocking(move || {
                let arguments: Vec<_> =
                    ["status", "--json"].into_iter().chain(connect.iter().map(String::as_str)).collect();
                run("isotherm", &arguments)
            });
            assert!(!looked.await.unwrap().stdout.is_empty(), "a status");
            tokio::time::sleep(Duration::from_secs(2)).await;
        }
    });
    let session = stand.pair.session().await;
    let asking = tokio::spawn(async move {
        let operator = Operator::new(session);
        loop {
            let _ = isotherm_tests::pair::reports(operator.session()).await;
            let replies = operator.session().get(isotherm_protocol::key::ALL_STATUS).await.unwrap();
            while replies.recv_async().await.is_ok() {}
            tokio::time::sleep(Duration::from_millis(500)).await;
        }
    });
    vec![program, asking]
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "takes minutes: just soak"]
async fn a_day_of_ticks_at_full_speed_leaves_nothing_behind() {
    let day: u64 = 24 * 3600 * 200;
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("units")).unwrap();
    std::fs::write(folder.path().join("units/unit.toml"), base(BASE_UNIT)).unwrap();
    let at = folder.path().to_owned();
    let text = "calibrations = \"units\"\nstate = \"state\"\ncongestion = \"block\"\n";
    std::fs::write(folder.path().join("service.toml"), text).unwrap();
    let service = tokio::task::spawn_blocking(move || {
        Service::start_in(&at, &["--config", "service.toml", "--listen", "tcp/127.0.0.1:0"])
    });
    let service = service.await.unwrap();
    let options = SessionOptions { connect: vec![service.locator.clone()], ..SessionOptions::default() };
    let session = open(&options).await.unwrap();
    let long = Scenario { duration_s: 100_000.0, ..zeeman_sine(24) };
    let scenario = Scenario { unit: BASE_UNIT.to_owned(), tick_ns: 5_000_000, ..long };
    let options =
        ProducerOptions { batch_ticks: 32, max_in_flight: Some(20_000), ..ProducerOptions::default() };
    let mut player = Player::declare(&session, &scenario, options).await;
    let (begin, part) = (Instant::now(), day / 200);
    let (mut watched, mut seconds) = (Watched::default(), Series::default());
    for number in 0..200_u32 {
        let at = Instant::now();
        player.play(part).await;
        let hours = f64::from(number) * 24.0 / 200.0;
        watched.look(hours, service.id());
        seconds.push(hours, at.elapsed().as_secs_f64());
    }
    player.flush().await;
    player.drain().await;
    println!("{day} ticks in {:?}", begin.elapsed());
    let operator = Operator::new(session.clone());
    let whole = |status: &isotherm_protocol::status::Status| {
        let count = |name: &str| status.counter(name);
        (count("ticks_out") >= day)
            .then(|| [count("gyro_ticks_in"), count("ticks_out"), count("ticks_missed")])
    };
    assert_eq!(operator.until(BASE_UNIT, whole).await, [day, day, 0]);
    let rising = watched.rises("a day at full speed", 2.4, 24.0);
    let slower = rises("seconds for 86 400 ticks", &seconds, 2.4, 24.0);
    assert!(!rising && !slower);
    close(session, LIMIT).await.unwrap();
    assert!(service.stop().0.success());
}
