//! Who stops waits until slow subscribers have taken everything, or says that they have not (I8).
//!
//! In a process of its own: a callback that blocks holds up one of the two threads that receive for all sessions of a process.

#![expect(clippy::unwrap_used, reason = "a test may panic, its helpers included")]

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use isotherm_bus::receipt::{Receipt, all_taken};
use isotherm_bus::{BusError, SessionOptions, close, locators, open, presence};
use isotherm_protocol::codec;
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_service::Settings;
use isotherm_tests::bench::{Bench, LIMIT};
use isotherm_tests::calibrations::{compile, identity};
use isotherm_tests::process::run_well;
use isotherm_tests::streams::send_waiting_ticks;
use serde_json::Value;
use tokio::sync::{Mutex as AsyncMutex, MutexGuard as AsyncMutexGuard};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::qos::{CongestionControl, Priority};

/// One listener at a time: two that block would hold up all that the process receives.
static TURN: AsyncMutex<()> = AsyncMutex::const_new(());

/// A subscriber that gives receipts, and whose callback takes its time.
struct Listener {
    session: Session,
    receipt: Receipt,
    subscriber: Subscriber<()>,
    taken: Arc<AtomicU64>,
    // Goes after the callback that may block.
    _turn: AsyncMutexGuard<'static, ()>,
}

impl Listener {
    async fn new(session: Session, keys: &str, dawdle: impl Fn() + Send + Sync + 'static) -> Self {
        let turn = TURN.lock().await;
        let receipt = Receipt::declare(&session).await.unwrap();
        let taken = Arc::new(AtomicU64::new(0));
        let counter = Arc::clone(&taken);
        let subscriber = session.declare_subscriber(keys).callback(move |sample| {
            dawdle();
            let batch = codec::decode::<CorrectedBatch>(&sample.payload().to_bytes());
            counter.fetch_add(batch.map_or(1, |batch| batch.ticks.len() as u64), Ordering::SeqCst);
        });
        let subscriber = subscriber.await.unwrap();
        Self { session, receipt, subscriber, taken, _turn: turn }
    }

    /// Corrected ticks, or other messages, whose callback has ended.
    fn taken(&self) -> u64 {
        self.taken.load(Ordering::SeqCst)
    }

    async fn end(self) {
        let Self { session, receipt, subscriber, .. } = self;
        drop((receipt, subscriber));
        close(session, LIMIT).await.unwrap();
    }
}

/// A service with one unit, and a listener to it.
async fn service(stop_timeout: Duration, dawdle: impl Fn() + Send + Sync + 'static) -> (Bench, Listener) {
    let settings = Settings { stop_timeout, ..Settings::default() };
    let bench = Bench::start_with(settings, &[("UNIT", compile(&identity()))]).await;
    let session = open(&bench.options).await.unwrap();
    let listener = Listener::new(session, key::ALL_CORRECTED, dawdle).await;
    presence::wait_for_service(&listener.session, LIMIT).await.unwrap();
    (bench, listener)
}

/// Sends ticks to it and waits until they have come out.
async fn corrected(bench: &mut Bench, ticks: u64) {
    let session = open(&bench.options).await.unwrap();
    send_waiting_ticks(&session, &UnitId::new("UNIT").unwrap(), ticks).await;
    bench.receive("UNIT", ticks).await;
    close(session, LIMIT).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_stops_waits_for_a_subscriber_that_is_behind() {
    let (mut bench, slow) = service(LIMIT, || std::thread::sleep(Duration::from_millis(5))).await;
    // The quick consumer has everything long before the slow one, which takes 5 ms for ten ticks.
    corrected(&mut bench, 1000).await;
    let (totals, _) = bench.stop().await;
    assert!(totals.stopped_in_time);
    assert_eq!(slow.taken(), 1000);
    slow.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_subscriber_that_hangs_is_told_and_does_not_hold_the_stop_up() {
    let (let_go, held) = std::sync::mpsc::channel::<()>();
    let held = Mutex::new(held);
    // Ends where the other end is dropped.
    let hang = move || held.lock().unwrap().recv().unwrap_or(());
    let (mut bench, hanging) = service(Duration::from_secs(1), hang).await;
    corrected(&mut bench, 10).await;
    let (totals, _) = bench.stop().await;
    assert!(!totals.stopped_in_time && totals.lost(), "a loss is told: {totals:?}");
    drop(let_go);
    hanging.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_subscriber_that_is_behind_is_named_in_the_status_of_the_service() {
    let (let_go, held) = std::sync::mpsc::channel::<()>();
    let held = Mutex::new(held);
    let (mut bench, hanging) = service(LIMIT, move || held.lock().unwrap().recv().unwrap_or(())).await;
    // The bench's own consumer takes all of it at once, and is never named.
    corrected(&mut bench, 10).await;
    let session = open(&bench.options).await.unwrap();
    let fault = loop {
        let replies = session.get(key::ALL_SERVICE_STATUS).timeout(LIMIT).await.unwrap();
        let sample = replies.recv_async().await.unwrap().into_result().unwrap();
        let status: ServiceStatus = codec::decode(&sample.payload().to_bytes()).unwrap();
        if let Some(fault) = status.faults.into_iter().find(|fault| fault.kind == "subscriber_behind") {
            break fault;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    };
    let name = hanging.session.zid().to_string();
    assert!(fault.first.contains(&name) && fault.first.contains("tcp/127.0.0.1:"), "{fault:?}");
    drop(let_go);
    close(session, LIMIT).await.unwrap();
    let (totals, _) = bench.stop().await;
    assert!(totals.stopped_in_time, "{totals:?}");
    hanging.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_that_is_closed_behind_the_receipts_loses_nothing() {
    const COUNT: u64 = 2000;
    let source = open(&SessionOptions::default()).await.unwrap();
    // Where it is answered, a declaration has arrived.
    let status = source.declare_queryable(key::ALL_STATUS).callback(drop).await.unwrap();
    let options = SessionOptions { connect: locators(&source), ..SessionOptions::default() };
    let session = open(&options).await.unwrap();
    // As slow as a slow link: what is on its way fills the buffers of both ends.
    let slow = Listener::new(session, "slow", || std::thread::sleep(Duration::from_micros(200))).await;
    presence::wait_for_service(&slow.session, LIMIT).await.unwrap();
    let publisher = source.declare_publisher("slow");
    let publisher = publisher.congestion_control(CongestionControl::Block).priority(Priority::RealTime);
    let publisher = publisher.await.unwrap();
    for _ in 0..COUNT {
        publisher.put(vec![0; 20_000]).await.unwrap();
    }
    let error = all_taken(&source, Duration::from_millis(1)).await.unwrap_err();
    assert!(matches!(error, BusError::NotTaken { .. }), "{error}");
    all_taken(&source, LIMIT).await.unwrap();
    assert_eq!(slow.taken(), COUNT);
    slow.end().await;
    // Nobody is there who could answer: nothing is waited for.
    all_taken(&source, LIMIT).await.unwrap();
    drop((publisher, status));
    close(source, LIMIT).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_player_that_waits_for_nothing_to_come_back_ends_behind_a_slow_listener() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log.csv").to_str().unwrap().to_owned();
    let mapping = log.replace(".csv", ".mapping.toml");
    run_well("isotherm-replay", &["simulate", "--preset", "zeeman-rest", "--duration", "20", "--out", &log]);
    let session = open(&SessionOptions::default()).await.unwrap();
    let locator = locators(&session).remove(0);
    let slow = Listener::new(session, "imu/**", || std::thread::sleep(Duration::from_micros(300))).await;
    let played = tokio::task::spawn_blocking(move || {
        let play = ["play", "-m", &mapping, &log, "-u", "UNIT", "--connect", &locator, "--speed", "max"];
        run_well("isotherm-replay", &[&play[..], &["--no-acknowledge", "--json"]].concat())
    });
    let summary: Value = serde_json::from_str(&played.await.unwrap()).unwrap();
    let sent = summary["messages_sent"].as_u64().unwrap();
    assert!(sent > 1000, "{summary}");
    assert_eq!(slow.taken(), sent);
    slow.end().await;
}
