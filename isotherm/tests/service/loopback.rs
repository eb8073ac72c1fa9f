//! The service in this process, a raw producer and a consumer on sessions of their own.

use std::time::Duration;

use isotherm_bus::{Consumer, Producer, ProducerOptions, SessionOptions, close, locators, open, presence};
use isotherm_correction::sample::{AccelTick, GyroTick, OutputKind, TickFlags};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec::{decode, encode};
use isotherm_protocol::corrected::{CorrectedBatch, are_same};
use isotherm_protocol::key::{self, RawStream, UnitId};
use isotherm_protocol::raw::GyroBatch;
use isotherm_protocol::status::{Output, Status};
use isotherm_service::{RunningService, Settings, start};
use zenoh::Session;
use zenoh::qos::CongestionControl;

const LIMIT: Duration = Duration::from_secs(30);

fn unit(serial: &str) -> UnitId {
    UnitId::new(serial).unwrap()
}

async fn service(settings: Settings) -> (RunningService, Vec<String>) {
    let session = open(&settings.zenoh.session).await.unwrap();
    let locators = locators(&session);
    (start(settings, session).await.unwrap(), locators)
}

async fn connected(locators: &[String]) -> Session {
    open(&SessionOptions { connect: locators.to_vec(), ..SessionOptions::default() }).await.unwrap()
}

/// Three of each sensor, ticks of 5 ms.
fn tick(sequence: u64) -> (AccelTick, GyroTick) {
    let end_time = Timestamp::from_ns(i64::try_from(sequence + 1).unwrap() * 5_000_000);
    let duration = Span::from_ms(5);
    let readings = [1.0, -2.0, 3.0].into_iter().collect();
    let accel = AccelTick { sequence, end_time, duration, readings };
    let readings = [4.0, 5.0, -6.0].into_iter().collect();
    (accel, GyroTick { sequence, end_time, duration, readings, ..GyroTick::default() })
}

async fn produce(producer: &mut Producer, sequences: impl Iterator<Item = u64>) {
    for sequence in sequences {
        let (accel, gyro) = tick(sequence);
        producer.accel(OutputKind::Counts, accel).await.unwrap();
        producer.gyro(OutputKind::Counts, gyro).await.unwrap();
    }
    producer.flush().await.unwrap();
}

async fn next(consumer: &mut Consumer) -> CorrectedBatch {
    tokio::time::timeout(LIMIT, consumer.next()).await.expect("in time").expect("session open")
}

/// A consumer of everything, of which the service knows.
async fn watch(session: &Session) -> Consumer {
    let consumer = Consumer::declare(session, None).await.unwrap();
    presence::wait_for_service(session, LIMIT).await.unwrap();
    consumer
}

#[tokio::test(flavor = "multi_thread")]
async fn no_tick_of_a_unit_that_appears_is_lost_for_a_subscriber_that_was_there() {
    // The first tick leaves the unit when its pairing window has passed: the shortest one, so that the first output is
    // made by the first messages.
    let mut settings = Settings::default();
    settings.unit.pairing_window = Span::from_ms(1);
    let (service, locators) = service(settings).await;
    let source = connected(&locators).await;
    let sink = connected(&locators).await;
    let mut consumer = watch(&sink).await;
    for round in 0..60 {
        let unit = unit(&format!("FIRST-{round}"));
        let mut producer = Producer::declare(&source, &unit, ProducerOptions::default()).await.unwrap();
        produce(&mut producer, 100..110).await;
        let mut sequences = Vec::new();
        while sequences.len() < 10 {
            let batch = next(&mut consumer).await;
            assert_eq!(batch.unit, unit.as_str(), "round {round}");
            sequences.extend(batch.ticks.iter().map(|tick| tick.sequence));
        }
        assert_eq!(sequences, (100..110).collect::<Vec<_>>(), "round {round}");
        let account = consumer.continuity(&unit);
        assert!(account.is_whole() && account.announced_missing == 0, "round {round}: {account:?}");
    }
    let totals = service.stop().await;
    assert!(!totals.lost(), "{totals:?}");
    assert_eq!(totals.units.len(), 60);
}

#[tokio::test(flavor = "multi_thread")]
async fn calibrated_units_run_and_others_pass_through() {
    let folder = tempfile::tempdir().unwrap();
    let text = include_str!("../../../config/calibration/example-full.toml");
    let parsed = isotherm_protocol::document::Document::parse(text, None).unwrap();
    std::fs::write(folder.path().join("any-name.toml"), text).unwrap();
    std::fs::write(folder.path().join("bad.toml"), "schema = 1").unwrap();
    let settings = Settings { calibrations: Some(folder.path().to_owned()), ..Settings::default() };
    let (service, locators) = service(settings).await;
    let session = connected(&locators).await;
    let mut consumer = watch(&session).await;

    let calibrated = unit(&parsed.document.unit);
    let strange = unit("STRANGE");
    let sensors = (parsed.calibration.gyro_count(), parsed.calibration.accel_count());
    for unit in [&calibrated, &strange] {
        let mut producer = Producer::declare(&session, unit, ProducerOptions::default()).await.unwrap();
        for sequence in 0..40 {
            let (mut accel, mut gyro) = tick(sequence);
            accel.readings = std::iter::repeat_n(1.0, sensors.1).collect();
            gyro.readings = std::iter::repeat_n(1.0, sensors.0).collect();
            producer.accel(parsed.calibration.accel_output(), accel).await.unwrap();
            producer.gyro(parsed.calibration.gyro_output(), gyro).await.unwrap();
        }
        // The last ticks may wait inside for later ones; the clock releases them.
        while consumer.continuity(unit).ticks < 40 {
            let batch = next(&mut consumer).await;
            let expected = u64::from(*unit == calibrated);
            assert_eq!(batch.revision.counter, expected);
            let uncalibrated = batch.ticks[0].flags.contains(TickFlags::UNCALIBRATED);
            assert_eq!(uncalibrated, *unit == strange);
        }
    }
    let status = service.status(&calibrated).unwrap();
    assert_eq!((status.output, status.revision().digest), (Output::Calibrated, parsed.digest.head()));
    assert_eq!(service.status(&strange).unwrap().output, Output::PassThrough);
    assert!(!service.stop().await.lost());
}

#[tokio::test(flavor = "multi_thread")]
async fn rubbish_of_every_kind_leaves_another_units_output_untouched() {
    let settings = Settings { max_units: 3, congestion: CongestionControl::Block, ..Settings::default() };
    let (service, locators) = service(settings).await;
    let session = connected(&locators).await;
    let vandal = connected(&locators).await;
    let mut consumer = watch(&session).await;
    let (clean, dirty) = (unit("CLEAN"), unit("DIRTY"));
    let mut clean_producer = Producer::declare(&session, &clean, ProducerOptions::default()).await.unwrap();
    let mut dirty_producer = Producer::declare(&session, &dirty, ProducerOptions::default()).await.unwrap();
    // Both units are there before the rubbish comes, and one place is left.
    produce(&mut clean_producer, 0..1).await;
    produce(&mut dirty_producer, 0..1).await;
    presence::wait_for_service(&session, LIMIT).await.unwrap();

    let good = encode(&GyroBatch { output: OutputKind::Counts, ticks: vec![tick(0).1] }).unwrap();
    let mut version = good.clone();
    version[1] = 99;
    let mut flipped = good.clone();
    flipped[7] ^= 0x10;
    let (raw_gyro, raw_accel) = (key::raw(&dirty, RawStream::Gyro), key::raw(&dirty, RawStream::Accel));
    for sequence in 1..200 {
        produce(&mut clean_producer, sequence..=sequence).await;
        produce(&mut dirty_producer, sequence..=sequence).await;
        for (key, payload) in [
            (raw_gyro.as_str(), &[][..]),
            (&raw_gyro, &[0xff; 64]),
            (&raw_gyro, &version),
            (&raw_gyro, &flipped),
            (&raw_accel, &good),
            ("imu/DIRTY/raw/mag", &good),
            ("imu/bad serial/raw/gyro", &good),
            ("imu/RUBBISH/raw/gyro", &[1, 2, 3]),
        ] {
            vandal.put(key, payload).congestion_control(CongestionControl::Block).await.unwrap();
        }
        let extra = format!("imu/EXTRA-{sequence}/raw/gyro");
        vandal.put(extra, &*good).congestion_control(CongestionControl::Block).await.unwrap();
        vandal.delete(raw_gyro.as_str()).congestion_control(CongestionControl::Block).await.unwrap();
    }
    // A query travels behind what was sent before it.
    presence::wait_for_service(&vandal, LIMIT).await.unwrap();
    let mut outputs: std::collections::BTreeMap<String, Vec<_>> = std::collections::BTreeMap::new();
    while consumer.continuity(&clean).ticks < 200 || consumer.continuity(&dirty).ticks < 200 {
        let batch = next(&mut consumer).await;
        outputs.entry(batch.unit).or_default().extend(batch.ticks);
    }
    let (first, second) = (&outputs["CLEAN"], &outputs["DIRTY"]);
    assert_eq!((first.len(), second.len()), (200, 200));
    let same = first.iter().zip(second).all(|(clean, dirty)| are_same(clean, dirty));
    assert!(same, "the unit that got the rubbish is no worse off");

    let totals = service.stop().await;
    assert!(!totals.lost(), "{totals:?}");
    assert_eq!((totals.unit(&clean).bad, totals.unit(&dirty).bad), (0, 5 * 199));
    assert!(totals.units.len() <= 3, "{:?}", totals.units.keys());
    for (kind, at_least) in [
        ("unknown_stream", 199),
        ("bad_serial", 199),
        ("bad_frames_length", 199),
        ("units_refused", 198),
        ("deletions", 199),
    ] {
        assert!(
            totals.refused.get(kind).is_some_and(|count| *count >= at_least),
            "{kind}: {:?}",
            totals.refused
        );
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn status_is_published_answered_and_says_what_happened() {
    let (service, locators) = service(Settings::default()).await;
    let session = connected(&locators).await;
    let (sender, mut statuses) = tokio::sync::mpsc::unbounded_channel();
    let _subscriber = session
        .declare_subscriber(key::ALL_STATUS)
        .callback(move |sample| sender.send(decode::<Status>(&sample.payload().to_bytes()).unwrap()).unwrap())
        .await
        .unwrap();
    let mut consumer = watch(&session).await;
    let unit = unit("STATUS");
    let mut producer = Producer::declare(&session, &unit, ProducerOptions::default()).await.unwrap();
    produce(&mut producer, 0..30).await;
    while consumer.continuity(&unit).ticks < 30 {
        next(&mut consumer).await;
    }
    // Until the interval has passed once more, so that the counters are those after the last tick.
    let published = loop {
        let status = tokio::time::timeout(LIMIT, statuses.recv()).await.expect("in time").unwrap();
        if status.last_tick.is_some_and(|tick| tick.sequence == 29) {
            break status;
        }
    };
    assert_eq!((published.unit.as_str(), published.output), ("STATUS", Output::PassThrough));
    assert!(published.latency.p50_ns > 0 && published.latency.p99_ns >= published.latency.p50_ns);

    let late = connected(&locators).await;
    presence::wait_for_service(&late, LIMIT).await.unwrap();
    let replies = late.get(key::ALL_STATUS).await.unwrap();
    let reply = tokio::time::timeout(LIMIT, replies.recv_async()).await.expect("in time").unwrap();
    let sample = reply.into_result().unwrap();
    assert_eq!(sample.key_expr().as_str(), "imu/STATUS/status");
    let asked: Status = decode(&sample.payload().to_bytes()).unwrap();
    let counter = asked.counters.iter().find(|counter| counter.name == "gyro_ticks_in").unwrap();
    assert_eq!(counter.value, 30);
    assert!(!service.stop().await.lost());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_stop_flushes_what_was_received_and_closes_in_time() {
    let settings = Settings { tail_flush: Duration::from_secs(60), ..Settings::default() };
    let (service, locators) = service(settings).await;
    let session = connected(&locators).await;
    let mut consumer = watch(&session).await;
    let unit = unit("STOP");
    let mut producer = Producer::declare(&session, &unit, ProducerOptions::default()).await.unwrap();
    // Fewer than the pairing window holds: nothing goes out by itself.
    produce(&mut producer, 0..5).await;
    while service.totals().unit(&unit).ticks_in < 5 {
        tokio::task::yield_now().await;
    }
    let totals = service.stop().await;
    assert!(totals.stopped_in_time);
    assert_eq!((totals.unit(&unit).ticks_in, totals.unit(&unit).ticks_out), (5, 5));
    while consumer.continuity(&unit).ticks < 5 {
        next(&mut consumer).await;
    }
    assert!(consumer.continuity(&unit).is_whole());
    close(session, LIMIT).await.unwrap();
}
