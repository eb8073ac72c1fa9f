//! A subscriber that stands still beside one that does not.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use isotherm_tests::bench::LIMIT;
use isotherm_tests::process::{program, send_signal};

use crate::line::Line;
use crate::links::say;

#[tokio::test(flavor = "multi_thread")]
async fn a_subscriber_that_stands_still_costs_nobody_else_a_tick() {
    let mut line = Line::start(10).await;
    let out = line.folder.path().join("recording");
    let recorder = tokio::task::block_in_place(|| program("isotherm-replay"));
    let mut recorder = Command::new(recorder)
        .args(["record", "--no-service", "--connect", &line.service.locator, "--out"])
        .arg(&out)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let (begin, exists) = (Instant::now(), || out.exists() || out.with_extension("mcap").exists());
    while !exists() {
        assert!(begin.elapsed() < LIMIT, "{} does not appear", out.display());
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    line.play(Duration::from_millis(500)).await;
    let quiet = line.sink.take_latencies();
    send_signal(&recorder, "STOP");
    // For longer than the queues between the two last, and than the lease.
    line.play(Duration::from_secs(3)).await;
    let disturbed = line.sink.take_latencies();
    let books = line.settled().await;
    say("a subscriber stopped", books);
    assert_eq!((books.announced, books.lost), (0, 0), "{books:?}");
    line.all_bits_are_right().await;
    let p99 = |sorted: &[Duration]| sorted.get(sorted.len() * 99 / 100).copied().unwrap_or_default();
    println!("p99 {:?} beside {:?}", p99(&disturbed), p99(&quiet));
    assert!(disturbed.len() > 1000, "{}", disturbed.len());
    send_signal(&recorder, "CONT");
    line.play(Duration::from_millis(200)).await;
    line.settled().await;
    send_signal(&recorder, "INT");
    recorder.wait().unwrap();
    line.end().await;
}
