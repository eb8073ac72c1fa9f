//! I8: on SIGINT or SIGTERM what was received is corrected, published and flushed, then the sessions close within a
//! bounded time. What a slow subscriber has to do with it stands in `receipts.rs`.

use isotherm_bus::{Consumer, SessionOptions, close, open, presence};
use isotherm_correction::sample::TickFlags;
use isotherm_protocol::key::UnitId;
use isotherm_tests::bench::{Bench, LIMIT};
use isotherm_tests::calibrations::{compile, identity};
use isotherm_tests::process::Service;
use isotherm_tests::streams::send_waiting_ticks;

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
    assert!(ticks.iter().all(|tick| tick.flags.contains(TickFlags::ACCELEROMETER_MISSING)));
    assert_eq!(totals.unit(&unit).ticks_out, 100);
    close(session, LIMIT).await.unwrap();
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
