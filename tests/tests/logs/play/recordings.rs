//! Recordings are played message by message, in their order and their batches.

use std::path::Path;
use std::time::Instant;

use isotherm_correction::sample::{AccelTick, ChannelName, GyroTick, OutputKind};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_log::message::{Message, Topic};
use isotherm_log::recording::{RecordingOptions, RecordingWriter};
use isotherm_protocol::codec;
use isotherm_protocol::key::{Input, RawStream, UnitId, input, parse_input};
use isotherm_protocol::raw::{AccelBatch, GyroBatch, HealthBatch, HealthReading, HealthTick};
use isotherm_protocol::reference::Reference;
use serde_json::Value;

use super::{Listener, begin, in_time, service, summary};
use isotherm_tests::bench::LIMIT;

const GYRO: Input = Input::Raw(RawStream::Gyro);

/// A gyro batch of three counters.
fn gyro(series: u64, first: u64, count: u64, clock_ns: i64) -> Vec<u8> {
    let ticks: Vec<_> = (first..first + count)
        .map(|sequence| GyroTick {
            sequence,
            end_time: Timestamp::from_ns(clock_ns + i64::try_from(sequence).unwrap() * 10_000_000),
            duration: Span::from_ms(10),
            readings: [1.0, -2.0, 3.0].into_iter().collect(),
            series,
            ..GyroTick::default()
        })
        .collect();
    codec::encode(&GyroBatch { output: OutputKind::Counts, ticks }).unwrap()
}

fn accel(sequence: u64, clock_ns: i64) -> Vec<u8> {
    let tick = AccelTick {
        sequence,
        end_time: Timestamp::from_ns(clock_ns + i64::try_from(sequence).unwrap() * 10_000_000),
        duration: Span::from_ms(10),
        readings: [0.0, 0.0, 9.81].into_iter().collect(),
    };
    codec::encode(&AccelBatch { output: OutputKind::Mean, ticks: vec![tick] }).unwrap()
}

/// Two units, batches of 1 to 7 ticks every 10 ms of reception; the producer of A restarts in the middle, with another
/// series, sequence and clock. Beside them what a recorder hears besides: corrected increments, statuses, nonsense.
fn messages() -> Vec<Message> {
    let unit = |name: &str| UnitId::new(name).unwrap();
    let mut messages = Vec::new();
    let mut add = |received_ms: u64, key: String, frame: Vec<u8>| {
        messages.push(Message {
            topic: Topic::of(&key),
            received_ns: 1_700_000_000_000_000_000 + received_ms * 1_000_000,
            frame,
        });
    };
    let mut next = [0, 500];
    for step in 0..100u64 {
        let count = 1 + step % 7;
        let series = if step < 50 { 11 } else { 12 };
        if step == 50 {
            next[0] = 0;
        }
        let a = unit("A");
        add(10 * step, input(&a, Input::Raw(RawStream::Accel)), accel(next[0], 0));
        add(10 * step, input(&a, GYRO), gyro(series, next[0], count, 0));
        add(10 * step + 4, input(&unit("B"), GYRO), gyro(0, next[1], 1, -9_000_000_000));
        next[0] += count;
        next[1] += 1;
        if step % 10 == 3 {
            let reading = HealthReading { name: ChannelName::from("volt").unwrap(), value: 5.0 };
            let tick = HealthTick { time_ns: 5, readings: vec![reading] };
            let health = codec::encode(&HealthBatch { ticks: vec![tick] }).unwrap();
            add(10 * step + 5, input(&a, Input::Raw(RawStream::Health)), health);
            let reference =
                Reference { start_ns: 1, end_ns: 2, angular_rate_rad_per_s: [0.0; 3], sigma_rad_per_s: 0.0 };
            add(10 * step + 5, input(&a, Input::Reference), codec::encode(&reference).unwrap());
            add(10 * step + 6, "imu/A/corrected".into(), vec![1, 2, 3]);
            add(10 * step + 6, "imu/A/status".into(), vec![4]);
            add(10 * step + 6, "imu/A/raw/temp".into(), b"no frame".to_vec());
        }
    }
    messages
}

fn record(path: &Path, messages: &[Message]) {
    let mut writer = RecordingWriter::create(path, RecordingOptions::default()).unwrap();
    for message in messages {
        writer.write(message).unwrap();
    }
    writer.finish().unwrap();
}

/// Sequence of the series numbers, each by the order in which they appear, and the frames without them.
fn without_series(heard: &[(String, Vec<u8>)]) -> (Vec<usize>, Vec<(String, Vec<u8>)>) {
    let (mut known, mut order, mut frames) = (Vec::new(), Vec::new(), Vec::new());
    for (key, frame) in heard {
        let mut frame = frame.clone();
        if let Some((unit, GYRO)) = parse_input(key) {
            let mut batch: GyroBatch = codec::decode(&frame).unwrap();
            let series = (unit.to_owned(), std::mem::take(&mut batch.ticks[0].series));
            let place = known.iter().position(|other| *other == series).unwrap_or(known.len());
            if place == known.len() {
                known.push(series);
            }
            order.push(place);
            frame = codec::encode(&batch).unwrap();
        }
        frames.push((key.clone(), frame));
    }
    (order, frames)
}

#[tokio::test(flavor = "multi_thread")]
async fn a_recording_is_played_as_it_was_received() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let messages = messages();
    record(&path, &messages);
    let log = path.to_str().unwrap();
    let recorded: Vec<_> =
        messages.iter().map(|message| (message.topic.key(), message.frame.clone())).collect();
    let played = |key: &str| !key.ends_with("corrected") && !key.ends_with("status");
    let expected: Vec<_> = recorded.iter().filter(|(key, _)| played(key)).cloned().collect();

    let (summary, heard) = Listener::new().await.play(&[log, "--speed", "max"]).await;
    assert_eq!(without_series(&heard), without_series(&expected));
    assert_eq!(summary["units"][0]["messages_unreadable"], 10);
    assert_eq!(summary["units"][0]["references_sent"], 10);
    assert_eq!(summary["units"][1]["ticks_sent"], 100);
    let series = |heard: &[(String, Vec<u8>)]| {
        let batches = heard.iter().filter(|(key, _)| key.ends_with("gyro"));
        batches.map(|(_, frame)| codec::decode::<GyroBatch>(frame).unwrap().ticks[0].series).max().unwrap()
    };

    // Twice over, one unit under another name: the second pass is of series that none had before.
    let arguments =
        [log, "--speed", "max", "--loop=2", "--unit", "A", "--remap", "A=Z-9", "--topic", "imu/*/raw/*"];
    let (again, heard_twice) = Listener::new().await.play(&arguments).await;
    assert_eq!((&again["passes"], &again["units"][0]["unit"]), (&Value::from(2), &Value::from("Z-9")));
    let renamed = |(key, frame): &(String, Vec<u8>)| {
        (key.starts_with("imu/A/raw")).then(|| (key.replace("/A/", "/Z-9/"), frame.clone()))
    };
    let once: Vec<_> = expected.iter().filter_map(renamed).collect();
    let (order, frames) = without_series(&heard_twice);
    let (_, once) = without_series(&once);
    assert_eq!(frames, [once.clone(), once].concat());
    assert_eq!(order, [[0; 50], [1; 50], [2; 50], [3; 50]].concat());
    assert!(series(&heard_twice) > series(&heard));
}

#[test]
fn another_serial_for_a_unit_that_is_not_played_is_refused_before_anything_is_sent() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    record(&path, &messages());
    let log = path.to_str().unwrap();
    let refused = |more: &[&str]| {
        let output = begin(&[&[log, "--remap", "C=Z-9"], more].concat()).wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap()
    };
    insta::assert_snapshot!(refused(&["--remap", "A=Z-8"]) + &refused(&["--unit", "B"]));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_part_of_a_recording_keeps_its_time_by_either_clock() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    record(&path, &messages());
    let log = path.to_str().unwrap();
    // From 0.2 s to 0.45 s of reception.
    let part = [log, "--start", "0.2", "--end", "0.45", "--topic", "imu/B/**"];
    for clock in ["receive", "event"] {
        let begun = Instant::now();
        let arguments = [&part[..], &["--speed", "0.5", "--clock", clock]].concat();
        let (summary, heard) = Listener::new().await.play(&arguments).await;
        assert!(begun.elapsed().as_secs_f64() > 0.48, "{:?}", begun.elapsed());
        assert_eq!(heard.len(), 25);
        let first: GyroBatch = codec::decode(&heard[0].1).unwrap();
        assert_eq!(first.ticks[0].sequence, 520);
        let log_s = summary["log_s"].as_f64().unwrap();
        assert!((log_s - 0.24).abs() < 1e-6, "{summary}");
        assert_eq!(summary["lateness"]["messages"], 24);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_tick_of_a_recording_comes_back_restart_or_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    record(&path, &messages());
    let log = path.to_str().unwrap().to_owned();
    let service = service();
    let locator = service.locator.clone();
    let output = in_time(LIMIT, move || {
        begin(&["--speed", "max", "--loop=2", "--connect", &locator, "--json", &log])
            .wait_with_output()
            .unwrap()
    });
    let summary = summary(&output.await, 0);
    let ticks: u64 = (0..100).map(|step| 1 + step % 7).sum();
    let units = summary["units"].as_array().unwrap();
    for (unit, ticks, runs) in [(&units[0], 2 * ticks, 4), (&units[1], 200, 2)] {
        assert_eq!((&unit["ticks_sent"], &unit["ticks_acknowledged"]), (&ticks.into(), &ticks.into()));
        assert_eq!((&unit["runs"], &unit["ticks_lost"]), (&runs.into(), &0.into()), "{unit}");
        assert_eq!(unit["restarts"], runs - 1);
    }
}
