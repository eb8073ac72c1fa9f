//! A producer, a service in a process of its own, and a subscriber; proxies stand between the three.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use isotherm_bus::{Consumer, Continuity, SessionOptions, close, open};
use isotherm_correction::unit::At;
use isotherm_protocol::control::SwapOptions;
use isotherm_protocol::control::{Schedule, SwapOutcome, SwapReply};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::status::Status;
use isotherm_simulator::Scenario;
use isotherm_simulator::presets::zeeman_rest;
use isotherm_tests::bench::LIMIT;
use isotherm_tests::judged::{Sink, Source};
use isotherm_tests::operator::Operator;
use isotherm_tests::process::Service;
use isotherm_tests::proxy::{Fault, Proxy, Switch};
use tempfile::TempDir;
use tokio::sync::Mutex;
use tokio::task::JoinHandle;
use zenoh::Session;

/// Document of the simulated unit.
pub(crate) const DOCUMENT: &str = include_str!("../../../config/calibration/ZLG-0001.toml");
/// How long a connection may say nothing.
pub(crate) const LEASE: Duration = Duration::from_millis(500);
const TICK: Duration = Duration::from_millis(5);
/// Ticks that come through before a fault counts as over.
const AFTER: u64 = 50;
/// How far ahead a swap is scheduled, in ticks, where the disk is not slow.
pub(crate) const AHEAD: u64 = 100;

/// Where somebody connects to.
#[derive(Debug)]
struct Link {
    switch: Switch,
    proxy: Proxy,
}

impl Link {
    fn to(locator: &str) -> Self {
        let switch = Switch::default();
        let proxy = Proxy::start(locator, &switch);
        Self { switch, proxy }
    }

    async fn session(&self) -> Session {
        let connect =
            vec![format!("{}#retry_period_init_ms=50;retry_period_max_ms=100", self.proxy.endpoint)];
        let options = SessionOptions { connect, lease: Some(LEASE), ..SessionOptions::default() };
        open(&options).await.unwrap()
    }
}

/// Which connections suffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// From the producer to the service.
    In,
    /// From the service to the subscriber.
    Out,
}

/// What became of all ticks, by counters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Books {
    /// Sent by the producers.
    pub(crate) sent: u64,
    /// Received by the subscriber.
    pub(crate) received: u64,
    /// Announced as missing by the service: lost on the way in.
    pub(crate) announced: u64,
    /// Lost on the way out, as the subscriber's account finds them.
    pub(crate) lost: u64,
}

impl Books {
    fn since(self, before: Self) -> Self {
        Self {
            sent: self.sent - before.sent,
            received: self.received - before.received,
            announced: self.announced - before.announced,
            lost: self.lost - before.lost,
        }
    }
}

/// The three, and what is produced.
pub(crate) struct Line {
    pub(crate) service: Service,
    pub(crate) operator: Operator,
    pub(crate) sink: Sink,
    pub(crate) folder: TempDir,
    consumer: Consumer,
    links: [Link; 2],
    sessions: [Session; 2],
    sources: Arc<Mutex<Vec<Source>>>,
    paused: Arc<AtomicBool>,
    playing: JoinHandle<()>,
    before: Books,
    revision: u64,
}

fn serial(index: usize) -> String {
    format!("ZLG-{index:02}")
}

/// The document for a unit, with another constant bias of its first gyro.
pub(crate) fn document(unit: &str, bias: f64) -> String {
    let text = DOCUMENT.replace("unit = \"ZLG-0001\"", &format!("unit = \"{unit}\""));
    text.replacen("[0.41, ", &format!("[{bias:?}, "), 1)
}

/// Folders of a service: its documents, its state, its configuration.
pub(crate) struct Folders {
    pub(crate) whole: TempDir,
    units: usize,
}

impl Folders {
    pub(crate) fn new(units: usize) -> Self {
        let whole = tempfile::tempdir().unwrap();
        std::fs::create_dir(whole.path().join("units")).unwrap();
        for unit in (0..units).map(serial) {
            let path = whole.path().join("units").join(format!("{unit}.toml"));
            std::fs::write(path, document(&unit, 0.41)).unwrap();
        }
        let text = "calibrations = \"units\"\nstate = \"state\"\n[pair]\nlease_ms = 500\n[metrics]\nlisten = \"127.0.0.1:0\"\n";
        std::fs::write(whole.path().join("service.toml"), text).unwrap();
        Self { whole, units }
    }

    pub(crate) fn state(&self) -> PathBuf {
        self.whole.path().join("state")
    }
}

impl Line {
    /// With so many units, 200 ticks a second of each.
    pub(crate) async fn start(units: usize) -> Self {
        Self::start_in(Folders::new(units), &["--listen", "tcp/127.0.0.1:0"], None, &[]).await
    }

    /// The same in these folders, with these options and variables; producers and subscriber reach the service at `at`, where that is
    /// not where it listens.
    pub(crate) async fn start_in(
        folders: Folders,
        options: &[&str],
        at: Option<&str>,
        variables: &[(&str, &Path)],
    ) -> Self {
        let Folders { whole: folder, units } = folders;
        let service = tokio::task::block_in_place(|| {
            let options = [&["--config", "service.toml", "--log-level", "error"], options].concat();
            Service::start_among(folder.path(), &options, variables)
        });
        let links = [0, 1].map(|_| Link::to(at.unwrap_or(&service.locator)));
        let sessions = [links[0].session().await, links[1].session().await];
        let direct = at.unwrap_or(&service.locator).to_owned();
        let direct = SessionOptions { connect: vec![direct], ..SessionOptions::default() };
        let operator = Operator::new(open(&direct).await.unwrap());
        let sink = Sink::declare(&sessions[1]).await;
        let consumer = Consumer::declare(&sessions[1], None).await.unwrap();
        isotherm_bus::presence::wait_for_service(&sessions[1], LIMIT).await.unwrap();
        let mut sources = Vec::new();
        for (seed, unit) in (1..).zip((0..units).map(serial)) {
            let long = Scenario { duration_s: 100_000.0, ..zeeman_rest(seed) };
            let scenario = Scenario { unit: unit.clone(), tick_ns: 5_000_000, ..long };
            sources.push(Source::declare(&sessions[0], scenario, &document(&unit, 0.41), &sink).await);
        }
        let (sources, paused) = (Arc::new(Mutex::new(sources)), Arc::new(AtomicBool::new(true)));
        let playing = tokio::spawn(play(Arc::clone(&sources), Arc::clone(&paused)));
        let mut line = Self {
            service,
            operator,
            sink,
            folder,
            consumer,
            links,
            sessions,
            sources,
            paused,
            playing,
            before: Books::default(),
            revision: 1,
        };
        line.settled().await;
        line
    }

    /// Does something to the connections of one side, or of both where it is a router's.
    pub(crate) fn trouble(&self, side: Side, fault: Fault) {
        self.links[usize::from(side == Side::Out)].switch.set(fault);
    }

    /// Has ticks be sent for a while.
    pub(crate) async fn play(&self, time: Duration) {
        self.paused.store(false, Ordering::SeqCst);
        tokio::time::sleep(time).await;
    }

    /// Has all ticks that are sent come through again, then sends no more: what became of those since this was last asked.
    pub(crate) async fn settled(&mut self) -> Books {
        for side in [Side::In, Side::Out] {
            self.trouble(side, Fault::None);
        }
        self.paused.store(false, Ordering::SeqCst);
        let from = self.last().await;
        self.until_received(|last, index| last >= from[index] + AFTER).await;
        self.paused.store(true, Ordering::SeqCst);
        let last = self.last().await;
        self.until_received(|received, index| received >= last[index]).await;
        let now = self.books().await;
        now.since(std::mem::replace(&mut self.before, now))
    }

    /// Sequence numbers of the last ticks sent.
    async fn last(&self) -> Vec<u64> {
        self.sources.lock().await.iter().map(|source| source.last).collect()
    }

    async fn until_received(&mut self, is: impl Fn(u64, usize) -> bool) {
        let deadline = Instant::now() + LIMIT;
        let units: Vec<_> = self.sources.lock().await.iter().map(|it| id(it.unit())).collect();
        loop {
            while self.consumer.try_next().is_some() {}
            let last = |unit| self.consumer.continuity(unit).last_sequence().unwrap_or(0);
            let lacking = units.iter().enumerate().find(|(index, unit)| !is(last(unit), *index));
            let Some((_, unit)) = lacking else { return };
            assert!(Instant::now() < deadline, "{unit}: {:?}", self.consumer.continuity(unit));
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }

    /// What became of every tick so far; each unit's account is to add up by itself.
    async fn books(&mut self) -> Books {
        let sent: Vec<_> =
            self.sources.lock().await.iter().map(|it| (it.unit().to_owned(), it.sent)).collect();
        let mut books = Books::default();
        for (unit, sent) in sent {
            let account = self.consumer.continuity(&id(&unit));
            // Counters are published with the status that is made next.
            let whole = |status: &Status| {
                (status.counter("ticks_out") + missing(status) >= sent).then(|| status.clone())
            };
            let status = self.operator.until(&unit, whole).await;
            check(&unit, sent, &status, &account);
            books.sent += sent;
            books.received += account.ticks;
            books.announced += status.counter("ticks_missed");
            books.lost += account.lost;
        }
        books
    }

    /// Puts another document in force for every unit, from a tick on that is so many ahead; the last answer.
    pub(crate) async fn swap(&mut self, bias: f64, ahead: u64) -> SwapReply {
        self.revision += 1;
        let units = self.sources.lock().await.len();
        let mut last = None;
        for index in 0..units {
            let mut sources = self.sources.lock().await;
            let source = &mut sources[index];
            let (unit, at) = (source.unit().to_owned(), source.last + ahead);
            let text = document(&unit, bias);
            source.swap(&text, self.revision, At::Sequence(at));
            drop(sources);
            let options = SwapOptions { schedule: Schedule::Sequence(at), ..SwapOptions::default() };
            let reply = self.operator.swap(&unit, text.as_bytes(), &options).await.unwrap();
            assert_eq!((reply.outcome, reply.revision), (SwapOutcome::Accepted, self.revision), "{reply:?}");
            last = Some(reply);
        }
        last.expect("a unit")
    }

    /// A swap that is to be refused, of the first unit.
    pub(crate) async fn refused(&self) -> String {
        let text = document(&serial(0), 0.9);
        let reply = self.operator.swap(&serial(0), text.as_bytes(), &SwapOptions::default()).await.unwrap();
        assert_eq!(reply.outcome, SwapOutcome::Refused, "{reply:?}");
        format!("{:?}", reply.problems)
    }

    /// That every tick so far has come, with the bits that one service alone would have given.
    pub(crate) async fn all_bits_are_right(&self) {
        for unit in self.sources.lock().await.iter().map(Source::unit) {
            let account = self.sink.account(unit);
            let bad = (account.lost, account.wrong, account.doubled, account.unexpected);
            assert_eq!(bad, (0, 0, 0, 0), "{unit}: {account:?}");
        }
    }

    /// Ends it.
    pub(crate) async fn end(self) {
        self.paused.store(true, Ordering::SeqCst);
        self.playing.abort();
        let _ = self.playing.await;
        drop((self.consumer, self.sink));
        for session in self.sessions.into_iter().chain([self.operator.session().clone()]) {
            let _ = close(session, LIMIT).await;
        }
        let (status, totals) = tokio::task::block_in_place(|| self.service.stop());
        assert!(status.code().is_some(), "{totals}");
    }
}

fn id(unit: &str) -> UnitId {
    UnitId::new(unit).unwrap()
}

/// Ticks that were not corrected.
fn missing(status: &Status) -> u64 {
    status.counter("ticks_missed")
}

/// That every tick of a unit is accounted for, on both ways.
fn check(unit: &str, sent: u64, status: &Status, account: &Continuity) {
    let count = |name: &str| status.counter(name);
    let twice = ["gyro_duplicates", "gyro_late", "gyro_implausible", "ticks_held"].map(count);
    let told = || format!("{unit}: sent {sent}, {:?}, {account:?}", status.counters);
    assert_eq!(twice, [0; 4], "{}", told());
    // On the way in: what came, and what was announced as missing.
    assert_eq!(sent, count("gyro_ticks_in") + count("ticks_missed"), "{}", told());
    assert_eq!(count("gyro_ticks_in"), count("ticks_out"), "{}", told());
    // On the way out: what came, what was announced here too, and what the account finds lost.
    assert_eq!(sent, account.ticks + account.announced_missing + account.lost, "{}", told());
    assert_eq!(account.duplicated, 0, "{}", told());
    assert_eq!(account.restarts, 0, "{}", told());
}

/// Sends a tick of every unit each 5 ms, unless it is paused.
async fn play(sources: Arc<Mutex<Vec<Source>>>, paused: Arc<AtomicBool>) {
    let mut times = tokio::time::interval(TICK);
    times.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        times.tick().await;
        if !paused.load(Ordering::SeqCst) {
            for source in sources.lock().await.iter_mut() {
                source.tick().await;
            }
        }
    }
}
