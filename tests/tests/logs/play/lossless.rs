//! Playing as fast as the service keeps up loses nothing, whoever stalls.

use std::process::Child;
use std::time::Duration;

use isotherm_bus::{Consumer, SessionOptions, close, open, presence};
use isotherm_protocol::key::{self, UnitId};
use isotherm_tests::bench::LIMIT;
use isotherm_tests::process::{Service, send_signal};
use tokio::time::timeout;

use super::{begin, in_time, service, simulated, summary};

const UNIT: &str = "ZLG-0001";
/// Ticks in a second of the log.
const RATE: u32 = 200;
/// How long somebody stalls.
const STALL: Duration = Duration::from_secs(2);

/// Begins to play a log as fast as it goes.
fn play(service: &Service, [log, mapping]: &[String; 2], batch: &str) -> Child {
    let play = ["--mapping", mapping, log, "--unit", UNIT, "--connect", &service.locator];
    begin(&[&play[..], &["--speed", "max", "--batch", batch, "--json"]].concat())
}

/// Waits for its end: every tick was sent and came back.
async fn whole(player: Child, ticks: u64) -> f64 {
    let output = in_time(4 * LIMIT, move || player.wait_with_output().unwrap()).await;
    let summary = summary(&output, 0);
    for figure in ["ticks_sent", "ticks_acknowledged"] {
        assert_eq!(summary[figure], ticks, "{summary}");
    }
    for figure in
        ["ticks_lost", "ticks_late", "ticks_not_sent", "ticks_announced_missing", "ticks_duplicated"]
    {
        assert_eq!(summary[figure], 0, "{figure}: {summary}");
    }
    summary["elapsed_s"].as_f64().unwrap()
}

/// Plays a log several times, and says how long each took.
async fn nothing_is_lost(seconds: u32, runs: u32, batches: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let log = simulated(folder.path(), "zeeman-rest", seconds);
    let service = service();
    for (run, batch) in (1..=runs).zip(batches.iter().cycle()) {
        let took = whole(play(&service, &log, batch), u64::from(seconds * RATE)).await;
        println!("run {run}, batches of {batch}: {} ticks in {took:.2} s, 0 lost", seconds * RATE);
    }
}

/// A consumer stops taking, a subscriber blocks its own session, and the player itself is stopped, each for 2 s.
async fn nothing_is_lost_while_somebody_stalls(seconds: u32, batch: &str) {
    let ticks = u64::from(seconds * RATE);
    let folder = tempfile::tempdir().unwrap();
    let log = simulated(folder.path(), "zeeman-rest", seconds);
    let service = service();
    let options = SessionOptions { connect: vec![service.locator.clone()], ..SessionOptions::default() };
    let [consuming, blocked] = [open(&options).await.unwrap(), open(&options).await.unwrap()];
    let unit = UnitId::new(UNIT).unwrap();
    let mut consumer = Consumer::declare(&consuming, Some(&unit)).await.unwrap();
    let (sender, stalled) = tokio::sync::oneshot::channel();
    let sender = std::sync::Mutex::new(Some(sender));
    let _blocked = blocked
        .declare_subscriber(key::corrected(&unit))
        .callback(move |_| {
            let first = sender.lock().unwrap().take();
            if let Some(sender) = first {
                std::thread::sleep(STALL);
                let _ = sender.send(());
            }
        })
        .await
        .unwrap();
    presence::wait_for_service(&consuming, LIMIT).await.unwrap();
    presence::wait_for_service(&blocked, LIMIT).await.unwrap();

    let player = play(&service, &log, batch);
    // In the middle of it.
    while consumer.continuity(&unit).ticks < ticks / 10 {
        timeout(LIMIT, consumer.next()).await.expect("in time").expect("the session is open");
    }
    send_signal(&player, "STOP");
    tokio::time::sleep(STALL).await;
    send_signal(&player, "CONT");
    // The consumer takes nothing any more until all has been played.
    let took = whole(player, ticks).await;
    while consumer.continuity(&unit).ticks < ticks {
        timeout(LIMIT, consumer.next()).await.expect("in time").expect("the session is open");
    }
    let account = consumer.continuity(&unit);
    assert!(account.is_whole() && account.announced_missing == 0, "{account:?}");
    assert_eq!(consumer.rejected(), 0);
    timeout(LIMIT, stalled).await.expect("in time").expect("it was blocked and went on");
    println!("somebody stalled, batches of {batch}: {ticks} ticks in {took:.2} s, 0 lost");
    close(consuming, LIMIT).await.unwrap();
    close(blocked, LIMIT).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn unlimited_speed_loses_nothing_in_three_runs() {
    nothing_is_lost(1000, 3, &["10", "64", "4"]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn unlimited_speed_loses_nothing_while_somebody_stalls() {
    nothing_is_lost_while_somebody_stalls(1000, "10").await;
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "takes minutes"]
async fn two_million_ticks_at_unlimited_speed_lose_nothing_in_twenty_runs() {
    nothing_is_lost(10_000, 20, &["10"]).await;
    nothing_is_lost_while_somebody_stalls(10_000, "10").await;
}
