//! A clock that steps, a disk that is slow, full or cannot be written, descriptors that are used up.

use std::time::{Duration, Instant};

use isotherm_bus::{SessionOptions, close, open};
use isotherm_tests::bench::LIMIT;
use isotherm_tests::process::{next_descriptor, resources};

use crate::disturb::{Disturb, EIO, ENOSPC, EROFS, Trouble};
use crate::line::{AHEAD, Folders, Line};
use crate::links::say;

/// A line whose service can be disturbed.
async fn disturbed(units: usize) -> (Line, Disturb) {
    let folders = Folders::new(units);
    let disturb = Disturb::new(folders.whole.path(), &folders.state());
    let variables = disturb.variables();
    let line = Line::start_in(folders, &["--listen", "tcp/127.0.0.1:0"], None, &variables).await;
    (line, disturb)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_clock_that_steps_reaches_no_tick() {
    let (mut line, disturb) = disturbed(2).await;
    for clock_s in [0, 86_400, -86_400, 3, -3, 0] {
        disturb.set(Trouble { clock_s, ..Trouble::default() });
        line.play(Duration::from_millis(300)).await;
        let swap = line.swap(0.4 + f64::from(i32::try_from(clock_s % 7).unwrap()) / 100.0, AHEAD);
        tokio::time::timeout(LIMIT, swap).await.expect("a swap does not wait for the clock");
        line.play(Duration::from_millis(700)).await;
        let books = line.settled().await;
        say(&format!("clock {clock_s:+} s"), books);
        assert_eq!((books.announced, books.lost), (0, 0), "{books:?}");
    }
    line.all_bits_are_right().await;
    line.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_disk_that_is_slow_full_or_broken_reaches_no_tick() {
    let (mut line, disturb) = disturbed(2).await;
    line.swap(0.42, AHEAD).await;
    line.play(Duration::from_millis(700)).await;

    disturb.set(Trouble { slow: Duration::from_millis(200), ..Trouble::default() });
    line.play(Duration::ZERO).await;
    let begin = Instant::now();
    line.swap(0.43, AHEAD * 6).await;
    let took = begin.elapsed();
    line.play(Duration::from_millis(3500)).await;
    let books = line.settled().await;
    say("disk slow", books);
    println!("two swaps took {took:?}");
    assert!(took > Duration::from_millis(400), "the disk was not slow at all: {took:?}");
    assert_eq!((books.announced, books.lost), (0, 0), "{books:?}");
    let pause = line.sink.longest_pause(begin);
    assert!(pause < took, "the stream waited for the disk: {pause:?}");

    for (name, disk_errno, words, bias) in [
        ("full", ENOSPC, "No space left on device", 0.44),
        ("read-only", EROFS, "Read-only file system", 0.45),
        ("broken", EIO, "Input/output error", 0.46),
    ] {
        disturb.set(Trouble { disk_errno, ..Trouble::default() });
        line.play(Duration::from_millis(100)).await;
        let told = line.refused().await;
        assert!(told.contains(words), "{told}");
        line.play(Duration::from_millis(200)).await;
        let books = line.settled().await;
        say(&format!("disk {name}"), books);
        assert_eq!((books.announced, books.lost), (0, 0), "{books:?}");
        disturb.set(Trouble::default());
        line.play(Duration::ZERO).await;
        line.swap(bias, AHEAD).await;
        line.play(Duration::from_millis(700)).await;
        line.settled().await;
    }
    line.all_bits_are_right().await;
    line.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn descriptors_that_are_used_up_reach_no_tick() {
    let mut line = Line::start(2).await;
    line.service.limit(&format!("--nofile={}:", next_descriptor(line.service.id())));
    line.play(Duration::from_millis(100)).await;
    let told = line.refused().await;
    assert!(told.contains("os error 24"), "{told}");
    // Who comes now finds no place, and takes none from those that are there.
    let options = SessionOptions { connect: vec![line.service.locator.clone()], ..SessionOptions::default() };
    let late = tokio::spawn(async move { open(&options).await });
    let cpu = || resources(line.service.id()).cpu;
    let before = cpu();
    line.play(Duration::from_secs(1)).await;
    let busy = cpu().saturating_sub(before);
    assert!(busy < Duration::from_millis(500), "it is busy with what it cannot do: {busy:?} of a second");
    let books = line.settled().await;
    say("descriptors used up", books);
    assert_eq!((books.announced, books.lost), (0, 0), "{books:?}");

    line.service.limit("--nofile=1024:");
    let late = tokio::time::timeout(LIMIT, late).await.expect("there is a place again").unwrap();
    line.play(Duration::ZERO).await;
    line.swap(0.44, AHEAD).await;
    line.play(Duration::from_millis(700)).await;
    line.settled().await;
    line.all_bits_are_right().await;
    close(late.unwrap(), LIMIT).await.unwrap();
    line.end().await;
}
