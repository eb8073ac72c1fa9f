//! I7 over real sessions: broken input of every kind leaves the other units' output bit-identical, and the unit that it
//! was meant for goes on.

use isotherm_bus::{Producer, ProducerOptions, close, open, presence};
use isotherm_correction::sample::OutputKind;
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec::encode;
use isotherm_protocol::corrected::{CorrectedTick, are_same};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::raw::{AccelBatch, GyroBatch};
use isotherm_tests::bench::{Bench, LIMIT};
use isotherm_tests::calibrations::{Feature, PutTerms, compile, identity, polynomial};
use isotherm_tests::streams::{accel, gyro, temperature};
use zenoh::Session;
use zenoh::qos::CongestionControl;

const TICKS: u64 = 1000;
const VICTIM: &str = "VICTIM";

/// A gyro batch of one tick, changed, and the accelerometer batch that belongs to it.
fn tick(k: u64, change: impl Fn(&mut GyroBatch)) -> Vec<(&'static str, Vec<u8>)> {
    let mut batch = GyroBatch { output: OutputKind::Mean, ticks: vec![gyro(k, &[0.1, 0.2, 0.3])] };
    change(&mut batch);
    let accels = AccelBatch { output: OutputKind::Mean, ticks: vec![accel(k, &[0.0, 0.0, 9.8])] };
    vec![("imu/VICTIM/raw/accel", encode(&accels).unwrap()), ("imu/VICTIM/raw/gyro", encode(&batch).unwrap())]
}

fn mean(batch: &mut GyroBatch, readings: &[f64]) {
    batch.ticks[0].readings = readings.iter().copied().collect();
}

/// Everything that I7 lists, and then some.
fn broken() -> Vec<(&'static str, Vec<u8>)> {
    let good = |k| tick(k, |_| {});
    let frame = good(5)[1].1.clone();
    let mut broken = vec![
        ("imu/VICTIM/raw/gyro", Vec::new()),
        ("imu/VICTIM/raw/gyro", vec![0; 3]),
        ("imu/VICTIM/raw/gyro", vec![0xff; 5000]),
        ("imu/VICTIM/raw/gyro", vec![0; 2 << 20]),
        ("imu/VICTIM/raw/accel", frame.clone()),
        ("imu/VICTIM/raw/temp", b"hello".to_vec()),
        ("imu/VICTIM/raw/magnetometer", frame.clone()),
        ("imu/UNKNOWN-UNIT/raw/gyro", frame.clone()),
        ("imu/not a serial/raw/gyro", frame.clone()),
    ];
    for position in [0, 1, 7, frame.len() - 1] {
        let mut flipped = frame.clone();
        flipped[position] ^= 0x10;
        broken.push(("imu/VICTIM/raw/gyro", flipped));
    }
    broken.extend(tick(10, |b| mean(b, &[f64::NAN, 0.0, f64::INFINITY])));
    broken.extend(tick(11, |b| mean(b, &[f64::MAX, f64::MIN, 0.0])));
    broken.extend(tick(12, |b| mean(b, &[0.0; 8])));
    broken.extend(tick(13, |b| mean(b, &[0.0])));
    broken.extend(tick(14, |b| {
        mean(b, &[1.0, 2.0, 3.0]);
        b.output = OutputKind::Counts;
    }));
    broken.extend(tick(15, |b| b.ticks[0].duration = Span::ZERO));
    broken.extend(tick(16, |b| b.ticks[0].duration = Span::from_ns(i64::MAX)));
    broken.extend(tick(17, |b| {
        b.ticks[0].end_time = Timestamp::from_ns(b.ticks[0].end_time.as_ns() - 3_000_000_000);
    }));
    broken.extend(tick(18, |b| b.ticks[0].end_time = Timestamp::from_ns(i64::MAX)));
    broken.extend(tick(19, |b| b.ticks[0].sequence = u64::MAX));
    broken.extend(good(1_000_030));
    broken
}

/// Feeds two healthy units, and between their ticks whatever `garbage` holds; what the two gave out.
async fn run(garbage: &[(&'static str, Vec<u8>)]) -> [Vec<CorrectedTick>; 2] {
    let mut parts = identity();
    parts.gyros[0].terms.curve(Feature::One, polynomial(&[1e-4, 1e-6]));
    let calibration = compile(&parts);
    let names = ["HEALTHY-1", "HEALTHY-2"];
    let set = [names[0], names[1], VICTIM].map(|name| (name, calibration.clone()));
    let mut bench = Bench::start(&set).await;
    let session = open(&bench.options).await.unwrap();

    let mut producers = Vec::new();
    for name in names {
        let options = ProducerOptions { batch_ticks: 5, max_in_flight: None, ..ProducerOptions::default() };
        producers.push(Producer::declare(&session, &UnitId::new(name).unwrap(), options).await.unwrap());
    }
    let mut garbage = garbage.iter();
    for k in 0..TICKS {
        for producer in &mut producers {
            let wave = f64::from(u8::try_from(k % 13).unwrap()) * 1e-3;
            if k % 200 == 0 {
                producer.temperatures(&[temperature(k, 20.0 + wave)]).await.unwrap();
            }
            producer.accel(OutputKind::Mean, accel(k, &[wave, 0.0, 9.8])).await.unwrap();
            producer.gyro(OutputKind::Mean, gyro(k, &[wave, 0.1, -wave])).await.unwrap();
        }
        if k % 20 == 0 {
            for (key, frame) in garbage.by_ref().take(2) {
                put(&session, key, frame).await;
            }
        }
    }
    for (key, frame) in garbage {
        put(&session, key, frame).await;
    }
    for producer in &mut producers {
        producer.flush().await.unwrap();
    }
    let mut outputs = [Vec::new(), Vec::new()];
    while outputs.iter().any(|ticks| (ticks.len() as u64) < TICKS) {
        let batch = tokio::time::timeout(LIMIT, bench.consumer.next()).await.expect("in time").expect("open");
        if let Some(i) = names.iter().position(|name| *name == batch.unit) {
            outputs[i].extend(batch.ticks);
        }
    }
    close(session, LIMIT).await.unwrap();
    bench.stop().await;
    outputs
}

async fn put(session: &Session, key: &str, frame: &[u8]) {
    // A key that Zenoh itself refuses never gets as far as the service.
    if zenoh::key_expr::KeyExpr::try_from(key).is_ok() {
        session.put(key, frame).congestion_control(CongestionControl::Block).await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn i7_broken_input_leaves_the_other_units_bit_identical() {
    let alone = run(&[]).await;
    let disturbed = run(&broken()).await;
    for (alone, disturbed) in alone.iter().zip(&disturbed) {
        assert_eq!(alone.len() as u64, TICKS);
        let same = alone.iter().zip(disturbed).all(|(one, other)| are_same(one, other));
        assert!(same && alone.len() == disturbed.len(), "a healthy unit's output changed");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn i7_the_unit_itself_goes_on() {
    let mut bench = Bench::start(&[(VICTIM, compile(&identity()))]).await;
    let session = open(&bench.options).await.unwrap();
    presence::wait_for_service(&session, LIMIT).await.unwrap();
    // Without the jump of a million ticks: what comes after that is late by rule.
    let garbage: Vec<_> = broken();
    let garbage = &garbage[..garbage.len() - 2];
    // Good ticks and garbage at one priority, so that they arrive in the order in which they are sent.
    let good = |ticks: std::ops::Range<u64>| ticks.flat_map(|k| tick(k, |_| {})).collect::<Vec<_>>();
    for (key, frame) in good(0..20).iter().chain(garbage).chain(&good(20..200)) {
        put(&session, key, frame).await;
    }
    let ticks = bench.receive(VICTIM, 200).await;
    assert!(ticks.iter().zip(0..).all(|(tick, k)| tick.sequence == k), "each tick once, in order");
    assert!(ticks[30..].iter().all(|tick| (tick.delta_angle[0] - 0.1 * 0.005).abs() < 1e-15));
    close(session, LIMIT).await.unwrap();
    let (totals, _) = bench.stop().await;
    let unit = totals.unit(&UnitId::new(VICTIM).unwrap());
    assert!(unit.bad > 0 && unit.alarms == 0, "{unit:?}");
    assert!(!totals.refused.is_empty(), "broken keys are counted: {totals:?}");
}
