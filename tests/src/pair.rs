//! Two services for one stream, in processes of their own, with producers and a subscriber that are connected to both.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use isotherm_bus::inquiry::ask_all;
use isotherm_bus::outlet::{GyroTicks, new_series};
use isotherm_bus::{FirstWins, Outlet, OutletOptions, SessionOptions, open};
use isotherm_correction::unit::{At, Change, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_protocol::codec;
use isotherm_protocol::corrected::{CorrectedBatch, CorrectedTick, Revision, are_same};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::Document;
use isotherm_protocol::key::{self, Input, RawStream, UnitId};
use isotherm_protocol::pair::{PairReport, Role};
use isotherm_protocol::raw::Batcher;
use isotherm_protocol::stream::{Label, UnitStream};
use isotherm_simulator::{Scenario, Simulation, Step};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

use crate::bench::LIMIT;
use crate::process::Service;
use crate::proxy::{Fault, Proxy, Switch};

/// What is appended to an endpoint, so that a service that was restarted is found again at once.
const AGAIN: &str = "#retry_period_init_ms=50;retry_period_max_ms=100";

/// Names of the two.
pub const NAMES: [&str; 2] = ["first", "second"];

/// The two instances; each is started anew at its own address.
#[derive(Debug)]
pub struct Pair {
    folder: PathBuf,
    /// `None` where it is dead.
    pub services: [Option<Service>; 2],
    addresses: [String; 2],
    extra: String,
    /// In front of the first, for the second alone, and in front of the second for everybody else.
    proxies: [Proxy; 2],
    switch: Switch,
}

impl Pair {
    /// Starts both, the second a standby; `extra` stands in both configurations.
    ///
    /// # Panics
    /// Where one does not start.
    #[must_use]
    pub fn start(folder: &Path, documents: &[(String, String)], extra: &str) -> Self {
        std::fs::create_dir_all(folder.join("documents")).expect("a folder");
        for (unit, text) in documents {
            std::fs::write(folder.join("documents").join(format!("{unit}.toml")), text).expect("written");
        }
        let free = || {
            let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
            format!("tcp/{}", listener.local_addr().expect("an address"))
        };
        let (addresses, switch) = ([free(), free()], Switch::default());
        let proxies = [0, 1].map(|index: usize| Proxy::start(&addresses[index], &switch));
        let (folder, extra) = (folder.to_owned(), extra.to_owned());
        let mut pair = Self { folder, services: [None, None], addresses, extra, proxies, switch };
        pair.restart(0);
        pair.restart(1);
        pair
    }

    /// Folder of an instance's state.
    #[must_use]
    pub fn state(&self, index: usize) -> PathBuf {
        self.folder.join(format!("state-{index}"))
    }

    /// Starts an instance that is dead.
    ///
    /// # Panics
    /// Where it does not start.
    pub fn restart(&mut self, index: usize) {
        let (own, other) = (&self.addresses[index], &self.proxies[1 - index].endpoint);
        let file = self.folder.join(format!("service-{index}.toml"));
        let zenoh = self.folder.join(format!("peer-{index}.json5"));
        let config = format!(
            "{{mode: 'peer', listen: {{endpoints: ['{own}']}}, connect: {{endpoints: ['{other}{AGAIN}'], timeout_ms: -1, \
             exit_on_failure: false}}, scouting: {{multicast: {{enabled: false}}, gossip: {{enabled: false}}}}, transport: \
             {{link: {{tx: {{queue: {{batching: {{time_limit: 0}}, size: {{real_time: 16}}}}}}}}}}}}"
        );
        std::fs::write(&zenoh, config).expect("written");
        let extra =
            self.extra.replace("[pair]", &format!("[pair]\nlease_ms = 500\nname = \"{}\"", NAMES[index]));
        let text = format!(
            "calibrations = \"documents\"\nstate = \"state-{index}\"\n{extra}\n[zenoh]\nconfig = \"peer-{index}.json5\"\n"
        );
        std::fs::write(&file, text).expect("written");
        let level = std::env::var("ISOTHERM_PAIR_LOG").unwrap_or_else(|_| "error".to_owned());
        let file = file.to_str().expect("a path");
        self.services[index] = Some(Service::start_as_configured(&["--log-level", &level, "--config", file]));
    }

    /// Ends an instance as a crash would.
    pub fn kill(&mut self, index: usize) {
        drop(self.services[index].take());
    }

    /// Sends a signal to an instance that is alive.
    ///
    /// # Panics
    /// Where it is not.
    pub fn signal(&self, index: usize, signal: &str) {
        self.services[index].as_ref().expect("it is alive").signal(signal);
    }

    /// Does something to all connections of the second instance.
    pub fn trouble(&self, fault: Fault) {
        self.switch.set(fault);
    }

    /// A session that is connected to both.
    ///
    /// # Panics
    /// Where it cannot be opened.
    pub async fn session(&self) -> Session {
        self.session_with(None).await
    }

    /// The same with a lease of its own.
    ///
    /// # Panics
    /// Where it cannot be opened.
    pub async fn session_with(&self, lease: Option<Duration>) -> Session {
        let addresses = [&self.addresses[0], &self.proxies[1].endpoint];
        let connect = addresses.iter().map(|address| format!("{address}{AGAIN}")).collect();
        let session =
            open(&SessionOptions { connect, lease, ..SessionOptions::default() }).await.expect("a session");
        let deadline = Instant::now() + LIMIT;
        while session.info().peers_zid().await.count() < 2 {
            assert!(Instant::now() < deadline, "connected to both");
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        session
    }
}

/// What every instance that answers says of itself.
///
/// # Panics
/// Where the question cannot be asked.
pub async fn reports(session: &Session) -> Vec<PairReport> {
    let (replies, _) = ask_all(session, key::ALL_PAIRS, Duration::from_secs(1)).await.expect("asked");
    let samples = replies.into_iter().filter_map(|reply| reply.into_result().ok());
    samples.filter_map(|sample| serde_json::from_slice(&sample.payload().to_bytes()).ok()).collect()
}

/// Waits until of two instances one speaks for every unit and the other stands by.
///
/// # Panics
/// Where that does not come.
pub async fn until_paired(session: &Session, units: usize) {
    let is_pair = |reports: &[PairReport]| {
        let count =
            |role| reports.iter().flat_map(|report| &report.units).filter(|unit| unit.role == role).count();
        reports.len() == 2 && count(Role::Speaking) == units && count(Role::Standby) == units
    };
    until(session, is_pair).await;
}

/// Waits until an instance speaks for every unit.
///
/// # Panics
/// Where that does not come.
pub async fn until_speaks(session: &Session, index: usize, units: usize) {
    let speaks = |report: &PairReport| {
        let speaking = report.units.iter().filter(|unit| unit.role == Role::Speaking);
        report.member.name == NAMES[index] && speaking.count() == units
    };
    until(session, |reports| reports.iter().any(speaks)).await;
}

/// Waits until the instance that stands by has compared so many ticks of every unit.
///
/// # Panics
/// Where that does not come.
pub async fn until_compared(session: &Session, units: usize, ticks: u64) {
    let has = |reports: &[PairReport]| {
        let all = reports.iter().flat_map(|report| &report.units);
        all.filter(|unit| unit.role == Role::Standby && unit.ticks_compared >= ticks).count() == units
    };
    until(session, has).await;
}

/// Waits until what the instances say of themselves is as it should be.
///
/// # Panics
/// Where that does not come.
pub async fn until(session: &Session, is: impl Fn(&[PairReport]) -> bool) {
    let deadline = Instant::now() + LIMIT;
    loop {
        let reports = reports(session).await;
        if is(&reports) {
            return;
        }
        assert!(Instant::now() < deadline, "{reports:#?}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

/// Index of the instance that speaks for the first unit, by its name.
///
/// # Panics
/// Where none does.
pub async fn speaker(session: &Session) -> usize {
    let reports = reports(session).await;
    let speaks = |report: &&PairReport| report.units.iter().any(|unit| unit.role == Role::Speaking);
    let speaking = reports.iter().find(speaks).unwrap_or_else(|| panic!("{reports:#?}"));
    NAMES.iter().position(|name| *name == speaking.member.name).expect("a name of the pair")
}

/// One unit that is produced and corrected beside the services.
#[derive(Debug)]
pub struct Made {
    simulation: Simulation,
    scenario: Scenario,
    batcher: Batcher,
    outlet: Outlet,
    reference: UnitStream,
    series: u64,
    /// Sequence number of the last tick sent.
    pub last: u64,
    /// What is to be published, in its order.
    pub expected: Vec<(Revision, CorrectedTick)>,
}

impl Made {
    /// Declares the raw topics of the scenario's unit.
    ///
    /// # Panics
    /// Where nobody subscribes to them.
    pub async fn declare(session: &Session, scenario: Scenario, document: &str) -> Self {
        let unit = UnitId::new(&scenario.unit).expect("a serial");
        let options = OutletOptions { max_in_flight: None, match_timeout: LIMIT, acknowledge_timeout: LIMIT };
        let mut outlet = Outlet::declare(session, &unit, options).await.expect("declared");
        for stream in [RawStream::Temperature, RawStream::Accel, RawStream::Gyro] {
            outlet.open(Input::Raw(stream)).await.expect("the services subscribe");
        }
        let mut made = Self {
            simulation: Simulation::new(&scenario).expect("a sound scenario"),
            scenario,
            batcher: Batcher::new(1),
            outlet,
            reference: UnitStream::new(unit, UnitSettings::default()),
            series: new_series(),
            last: 0,
            expected: Vec::new(),
        };
        made.swap(document, 1, At::NextTick);
        made
    }

    /// Has what is expected be corrected with another document.
    ///
    /// # Panics
    /// Where it is none.
    pub fn swap(&mut self, document: &str, revision: u64, at: At) {
        let parsed = Document::parse(document, None).expect("a document");
        let label = Label::of(&parsed.document, Digest(parsed.digest), "");
        let calibration = Arc::new(parsed.calibration);
        self.reference.schedule(Change { calibration, revision, at, slew: Span::ZERO }, label);
    }

    /// Sends the next tick.
    ///
    /// # Panics
    /// At the scenario's end, or where it cannot be sent.
    pub async fn tick(&mut self) {
        let Step { mut gyro, accel, temperatures, .. } = self.simulation.next().expect("long enough");
        let instrument = &self.scenario.instrument;
        for reading in &temperatures {
            self.batcher.temperature(*reading).expect("taken");
        }
        if let (Some(output), Some(tick)) = (instrument.accel_output_kind(), accel) {
            self.batcher.accel(output, tick).expect("taken");
        }
        (gyro.series, self.last) = (self.series, gyro.sequence);
        self.batcher.gyro(instrument.gyros.output_kind(), gyro).expect("taken");
        while let Some(raw) = self.batcher.next_frame() {
            self.reference.receive(raw.stream, &raw.frame).expect("a good frame");
            if raw.stream == RawStream::Gyro {
                let ticks = GyroTicks { series: self.series, first: raw.first_sequence, count: raw.ticks };
                self.outlet.publish_gyro(raw.frame, ticks).await.expect("sent");
            } else {
                self.outlet.publish(Input::Raw(raw.stream), raw.frame).await.expect("sent");
            }
        }
        let mut frame = Vec::new();
        while self.reference.next_frame(&mut frame) {
            let batch: CorrectedBatch = codec::decode(&frame).expect("a frame");
            let revision = batch.revision;
            self.expected.extend(batch.ticks.into_iter().map(|tick| (revision, tick)));
        }
        while self.reference.take_in_force().is_some() {}
    }

    /// The unit.
    #[must_use]
    pub fn unit(&self) -> &str {
        &self.scenario.unit
    }
}

/// A corrected tick as it came.
#[derive(Debug, Clone)]
pub struct Came {
    /// When.
    pub at: Instant,
    /// Revision of its batch.
    pub revision: Revision,
    /// The tick.
    pub tick: CorrectedTick,
}

/// Everything that a subscriber of both services hears.
#[derive(Debug)]
pub struct Ears {
    came: Arc<Mutex<BTreeMap<String, Vec<Came>>>>,
    _subscriber: Subscriber<()>,
}

/// What came of it.
#[derive(Debug, Default)]
pub struct Account {
    /// Ticks used.
    pub used: u64,
    /// Ticks that came and had been used.
    pub doubled: u64,
    /// Ticks that were expected up to the last one and did not come.
    pub lost: u64,
    /// Ticks, used or not, with other bits than one service would have given, or another revision.
    pub wrong: u64,
    /// The first of them, in words.
    pub first_wrong: Option<String>,
}

impl Ears {
    /// Subscribes.
    ///
    /// # Panics
    /// Where that cannot be declared.
    pub async fn declare(session: &Session) -> Self {
        let came: Arc<Mutex<BTreeMap<String, Vec<Came>>>> = Arc::default();
        let told = Arc::clone(&came);
        let subscriber = session.declare_subscriber(key::ALL_CORRECTED).callback(move |sample| {
            let at = Instant::now();
            let batch: CorrectedBatch = codec::decode(&sample.payload().to_bytes()).expect("a good frame");
            let ticks = batch.ticks.into_iter().map(|tick| Came { at, revision: batch.revision, tick });
            let mut came = told.lock().unwrap_or_else(PoisonError::into_inner);
            came.entry(batch.unit).or_default().extend(ticks);
        });
        Self { came, _subscriber: subscriber.await.expect("declared") }
    }

    /// What came of a unit, in its order.
    #[must_use]
    pub fn of(&self, unit: &str) -> Vec<Came> {
        self.came.lock().unwrap_or_else(PoisonError::into_inner).get(unit).cloned().unwrap_or_default()
    }

    /// Compares what came of a unit with what is expected.
    #[must_use]
    pub fn account(&self, made: &Made) -> Account {
        let (mut account, mut arbiter) = (Account::default(), FirstWins::new());
        let expected: BTreeMap<_, _> =
            made.expected.iter().map(|(revision, tick)| (tick.sequence, (revision, tick))).collect();
        let mut used = BTreeSet::new();
        for Came { revision, tick, .. } in self.of(made.unit()) {
            let right = expected
                .get(&tick.sequence)
                .is_some_and(|(wanted, expected)| **wanted == revision && are_same(&tick, expected));
            if !right {
                account.wrong += 1;
                let wanted =
                    expected.get(&tick.sequence).map(|(wanted, expected)| (wanted.counter, expected.flags));
                account.first_wrong.get_or_insert_with(|| {
                    let Revision { counter, .. } = revision;
                    format!(
                        "sequence {}, revision {counter}, {:?}; expected {wanted:?}",
                        tick.sequence, tick.flags
                    )
                });
            }
            if arbiter.wins(&tick) {
                account.used += 1;
                used.insert(tick.sequence);
            }
        }
        account.doubled = arbiter.dropped();
        let last = used.last().copied().unwrap_or(0);
        account.lost =
            expected.keys().filter(|sequence| **sequence <= last && !used.contains(sequence)).count() as u64;
        account
    }

    /// The longest time without a fresh tick of a unit, between two moments.
    #[must_use]
    pub fn longest_pause(&self, unit: &str, from: Instant, to: Instant) -> Duration {
        let mut arbiter = FirstWins::new();
        let fresh = self.of(unit).into_iter().filter(|came| arbiter.wins(&came.tick)).map(|came| came.at);
        let times: Vec<_> = fresh.collect();
        let pairs = times.windows(2).filter(|pair| pair[1] >= from && pair[0] <= to);
        pairs.map(|pair| pair[1] - pair[0]).max().unwrap_or_default()
    }
}
