//! I8: on SIGINT or SIGTERM what was received is corrected, published and flushed, then the sessions close within a
//! bounded time.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use isotherm_bus::receipt::Receipt;
use isotherm_bus::{Consumer, Producer, ProducerOptions, SessionOptions, close, open, presence};
use isotherm_correction::sample::{OutputKind, TickFlags};
use isotherm_protocol::codec;
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::key::{self, UnitId};
use isotherm_service::Settings;
use isotherm_tests::bench::{Bench, LIMIT};
use isotherm_tests::calibrations::{compile, identity};
use isotherm_tests::process::Service;
use isotherm_tests::streams::gyro;
use zenoh::pubsub::Subscriber;

/// Sends gyro ticks that all wait for accelerometer ticks which never come.
async fn send_waiting_ticks(session: &zenoh::Session, unit: &UnitId, count: u64) {
    let options = ProducerOptions { batch_ticks: 10, max_in_flight: None, ..ProducerOptions::default() };
    let mut producer = Producer::declare(session, unit, options).await.unwrap();
    for k in 0..count {
        producer.gyro(OutputKind::Mean, gyro(k, &[0.1, 0.2, 0.3])).await.unwrap();
    }
    producer.flush().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn i8_what_waits_inside_is_published_on_stop() {
    let bench = Bench::start(&[("UNIT", compile(&identity()))]).await;
    let unit = UnitId::new("UNIT").unwrap();
    let session = open(&bench.options).await.unwrap();
    send_waiting_ticks(&session, &unit, 100).await;
    // A query travels behind the ticks: once it is answered, the service has all of them.
    presence::wait_for_service(&session, LIMIT).await.unwrap();
    let (totals, ticks) = bench.stop().await;
    assert!(totals.stopped_in_time);
    let ticks: Vec<_> = ticks.into_iter().map(|(_, tick)| tick).collect();
    assert_eq!(ticks.len(), 100, "{totals:?}");
    assert!(ticks.iter().zip(0..).all(|(tick, k)| tick.sequence == k), "each once, in order");
    let missing = TickFlags::ACCELEROMETER_MISSING.bits();
    assert!(ticks.iter().all(|tick| tick.flags & missing != 0));
    assert_eq!(totals.unit(&unit).ticks_out, 100);
    close(session, LIMIT).await.unwrap();
}

/// A subscriber whose callback does something with every message; the ticks that it has taken.
async fn subscriber(
    session: &zenoh::Session,
    work: impl Fn() + Send + Sync + 'static,
) -> (Arc<AtomicU64>, Subscriber<()>, Receipt) {
    let taken = Arc::new(AtomicU64::new(0));
    let counter = Arc::clone(&taken);
    let subscriber = session.declare_subscriber(key::ALL_CORRECTED).callback(move |sample| {
        work();
        let batch = codec::decode::<CorrectedBatch>(&sample.payload().to_bytes()).unwrap();
        counter.fetch_add(batch.ticks.len() as u64, Ordering::SeqCst);
    });
    let subscriber = subscriber.await.unwrap();
    let receipt = Receipt::declare(session).await.unwrap();
    presence::wait_for_service(session, LIMIT).await.unwrap();
    (taken, subscriber, receipt)
}

#[tokio::test(flavor = "multi_thread")]
async fn i8_a_stop_waits_for_a_subscriber_that_is_behind() {
    let settings = Settings { stop_timeout: LIMIT, ..Settings::default() };
    let mut bench = Bench::start_with(settings, &[("UNIT", compile(&identity()))]).await;
    let slow = open(&bench.options).await.unwrap();
    let (taken, subscriber, receipt) =
        subscriber(&slow, || std::thread::sleep(Duration::from_millis(5))).await;
    let session = open(&bench.options).await.unwrap();
    let unit = UnitId::new("UNIT").unwrap();
    send_waiting_ticks(&session, &unit, 1000).await;
    // The quick consumer has everything long before the slow one, which takes 5 ms for ten ticks.
    bench.receive("UNIT", 1000).await;
    let (totals, _) = bench.stop().await;
    assert!(totals.stopped_in_time);
    assert_eq!(taken.load(Ordering::SeqCst), 1000, "the stop ends behind the slowest");
    drop((subscriber, receipt));
    for session in [session, slow] {
        close(session, LIMIT).await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn i8_a_subscriber_that_hangs_is_told_and_does_not_hold_the_stop_up() {
    let settings = Settings { stop_timeout: Duration::from_secs(1), ..Settings::default() };
    let mut bench = Bench::start_with(settings, &[("UNIT", compile(&identity()))]).await;
    let hanging = open(&bench.options).await.unwrap();
    let (let_go, held) = std::sync::mpsc::channel::<()>();
    let held = Mutex::new(held);
    let (_, subscriber, receipt) = subscriber(&hanging, move || {
        // Ends where the other end is dropped.
        let _ = held.lock().unwrap().recv();
    })
    .await;
    let session = open(&bench.options).await.unwrap();
    send_waiting_ticks(&session, &UnitId::new("UNIT").unwrap(), 10).await;
    bench.receive("UNIT", 10).await;
    let (totals, _) = bench.stop().await;
    assert!(!totals.stopped_in_time && totals.lost(), "a loss is told: {totals:?}");
    drop(let_go);
    drop((subscriber, receipt));
    for session in [session, hanging] {
        close(session, LIMIT).await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn i8_sigterm_ends_the_process_well() {
    let service = Service::start(&["--calibrations", "config/calibration"]);
    let options = SessionOptions { connect: vec![service.locator.clone()], ..SessionOptions::default() };
    let session = open(&options).await.unwrap();
    let unit = UnitId::new("SIGTERM-TEST").unwrap();
    let mut consumer = Consumer::declare(&session, Some(&unit)).await.unwrap();
    presence::wait_for_service(&session, LIMIT).await.unwrap();
    send_waiting_ticks(&session, &unit, 50).await;
    let mut ticks = 0;
    // Uncalibrated ticks wait for their accelerometer ticks too; the tail comes when the service flushes it.
    while ticks < 50 {
        let batch = tokio::time::timeout(LIMIT, consumer.next()).await.expect("in time").expect("open");
        ticks += batch.ticks.len();
    }
    let (status, totals) = tokio::task::spawn_blocking(move || service.stop()).await.unwrap();
    assert_eq!(status.code(), Some(0), "{totals}");
    let totals: serde_json::Value = serde_json::from_str(&totals).expect("totals are JSON");
    assert_eq!(totals["units"]["SIGTERM-TEST"]["ticks_out"], 50);
    close(session, LIMIT).await.unwrap();
}
