//! Units that are produced here, corrected here as one service would do it, and judged by what comes back: bit by bit, tick by tick,
//! in bounded memory however long it lasts.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use isotherm_bus::outlet::{GyroTicks, new_series};
use isotherm_bus::{FirstWins, Outlet, OutletOptions};
use isotherm_correction::unit::{At, Change, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_protocol::codec;
use isotherm_protocol::corrected::{CorrectedBatch, CorrectedTick, Revision, are_same};
use isotherm_protocol::document::Document;
use isotherm_protocol::key::{self, Input, RawStream, UnitId};
use isotherm_protocol::raw::Batcher;
use isotherm_protocol::stream::{Label, UnitStream};
use isotherm_simulator::{Scenario, Simulation, Step};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

use crate::bench::LIMIT;

/// Ticks that are remembered, so that one which comes twice is known: a minute at 200 Hz.
const REMEMBERED: usize = 12_000;

/// One unit that is produced and corrected beside the services.
#[derive(Debug)]
pub struct Source {
    simulation: Simulation,
    scenario: Scenario,
    batcher: Batcher,
    outlet: Outlet,
    reference: UnitStream,
    series: u64,
    judged: Judged,
    /// Sequence number of the last tick sent.
    pub last: u64,
    /// Ticks sent.
    pub sent: u64,
}

impl Source {
    /// Declares the raw topics of the scenario's unit; what comes back is judged by `sink`.
    ///
    /// # Panics
    /// Where nobody subscribes to them.
    pub async fn declare(session: &Session, scenario: Scenario, document: &str, sink: &Sink) -> Self {
        let unit = UnitId::new(&scenario.unit).expect("a serial");
        let options = OutletOptions { max_in_flight: None, match_timeout: LIMIT, acknowledge_timeout: LIMIT };
        let mut outlet = Outlet::declare(session, &unit, options).await.expect("declared");
        for stream in [RawStream::Temperature, RawStream::Accel, RawStream::Gyro] {
            outlet.open(Input::Raw(stream)).await.expect("the services subscribe");
        }
        let mut source = Self {
            simulation: Simulation::new(&scenario).expect("a sound scenario"),
            scenario,
            batcher: Batcher::new(1),
            outlet,
            reference: UnitStream::new(unit, UnitSettings::default()),
            series: new_series(),
            judged: Arc::clone(&sink.judged),
            last: 0,
            sent: 0,
        };
        source.swap(document, 1, At::NextTick);
        source
    }

    /// Has so many ticks go in one message.
    #[must_use]
    pub fn in_batches_of(self, ticks: usize) -> Self {
        Self { batcher: Batcher::new(ticks), ..self }
    }

    /// Has what is expected be corrected with another document.
    ///
    /// # Panics
    /// Where it is none.
    pub fn swap(&mut self, document: &str, revision: u64, at: At) {
        let parsed = Document::parse(document, None).expect("a document");
        let label = Label::of(&parsed.document, parsed.digest, "");
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
            self.batcher.temperature(*reading);
        }
        if let (Some(output), Some(tick)) = (instrument.accel_output_kind(), accel) {
            self.batcher.accel(output, tick);
        }
        (gyro.series, self.last) = (self.series, gyro.sequence);
        let sequence = gyro.sequence;
        self.batcher.gyro(instrument.gyros.output_kind(), gyro);
        let at = Instant::now();
        while let Some(raw) = self.batcher.next_frame().transpose().expect("good ticks") {
            self.reference.receive(raw.stream, &raw.frame).expect("a good frame");
            if raw.stream == RawStream::Gyro {
                let ticks = GyroTicks { series: self.series, first: raw.first_sequence, count: raw.ticks };
                self.sent += ticks.count;
                self.outlet.publish_gyro(raw.frame, ticks).await.expect("sent");
            } else {
                self.outlet.publish(Input::Raw(raw.stream), raw.frame).await.expect("sent");
            }
        }
        let (mut frame, mut expected) = (Vec::new(), Vec::new());
        while self.reference.next_frame(&mut frame).is_some() {
            let batch: CorrectedBatch = codec::decode(&frame).expect("a frame");
            let revision = batch.revision;
            expected.extend(batch.ticks.into_iter().map(|tick| (revision, tick)));
        }
        while self.reference.take_in_force().is_some() {}
        lock(&self.judged).entry(self.scenario.unit.clone()).or_default().expect(sequence, at, expected);
    }

    /// The unit.
    #[must_use]
    pub fn unit(&self) -> &str {
        &self.scenario.unit
    }
}

/// A corrected tick as it came.
#[derive(Debug)]
struct Came {
    at: Instant,
    revision: Revision,
    tick: CorrectedTick,
}

/// One that is to come.
#[derive(Debug)]
struct Expected {
    revision: Revision,
    tick: CorrectedTick,
    used: bool,
}

/// What came of a unit's ticks.
#[derive(Debug, Clone, Default)]
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
    /// Ticks that nobody has produced yet.
    pub unexpected: u64,
}

/// One unit: what is to come, what came, and what became of it.
#[derive(Debug, Default)]
struct Ledger {
    expected: BTreeMap<u64, Expected>,
    /// Came before it was known what was to come.
    waiting: VecDeque<Came>,
    arbiter: FirstWins,
    account: Account,
    last_used: u64,
    /// When fresh ticks came.
    fresh: VecDeque<Instant>,
    /// When ticks were produced.
    produced: VecDeque<(u64, Instant)>,
    /// From producing a tick to its correction, since they were last taken.
    latencies: Vec<Duration>,
}

type Judged = Arc<Mutex<BTreeMap<String, Ledger>>>;

fn lock(judged: &Judged) -> MutexGuard<'_, BTreeMap<String, Ledger>> {
    judged.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Ledger {
    /// A tick was produced, from which these are to come.
    fn expect(&mut self, sequence: u64, at: Instant, ticks: Vec<(Revision, CorrectedTick)>) {
        self.produced.push_back((sequence, at));
        for (revision, tick) in ticks {
            self.expected.insert(tick.sequence, Expected { revision, tick, used: false });
        }
        self.judge_waiting();
        while self.expected.len() > REMEMBERED {
            let Some((_, forgotten)) = self.expected.pop_first() else { break };
            self.account.lost += u64::from(!forgotten.used);
        }
        self.fresh.drain(..self.fresh.len().saturating_sub(REMEMBERED));
        self.produced.drain(..self.produced.len().saturating_sub(REMEMBERED));
        self.latencies.drain(..self.latencies.len().saturating_sub(REMEMBERED));
    }

    /// Judges what came, as far as it is known what was to come.
    fn judge_waiting(&mut self) {
        let last = self.expected.last_key_value().map_or(0, |(sequence, _)| *sequence);
        while self.waiting.front().is_some_and(|came| came.tick.sequence <= last) {
            let Some(came) = self.waiting.pop_front() else { break };
            self.judge(&came);
        }
    }

    fn judge(&mut self, came: &Came) {
        let Came { at, revision, tick } = came;
        let wanted = self.expected.get_mut(&tick.sequence);
        let right = wanted.as_ref().is_some_and(|it| it.revision == *revision && are_same(tick, &it.tick));
        if !right {
            self.account.wrong += 1;
            let expected = wanted.as_ref().map(|it| (it.revision.counter, it.tick.flags, it.tick.missed));
            let got = (revision.counter, tick.flags, tick.missed);
            let words = || format!("sequence {}: {got:?} where {expected:?} was expected", tick.sequence);
            self.account.first_wrong.get_or_insert_with(words);
        }
        if !self.arbiter.wins(tick) {
            self.account.doubled += 1;
            return;
        }
        self.account.used += 1;
        self.last_used = tick.sequence;
        self.fresh.push_back(*at);
        if let Some(wanted) = wanted {
            wanted.used = true;
        }
        let produced = self.produced.binary_search_by_key(&tick.sequence, |(sequence, _)| *sequence);
        if let Some((_, produced)) = produced.ok().and_then(|index| self.produced.get(index)) {
            self.latencies.push(at.saturating_duration_since(*produced));
        }
    }

    fn account(&mut self) -> Account {
        self.judge_waiting();
        let open = self.expected.range(..=self.last_used).filter(|(_, it)| !it.used).count() as u64;
        let unexpected = self.waiting.len() as u64;
        Account { lost: self.account.lost + open, unexpected, ..self.account.clone() }
    }
}

/// Takes every corrected tick that comes on a session, of whichever service, and judges it.
#[derive(Debug)]
pub struct Sink {
    judged: Judged,
    _subscriber: Subscriber<()>,
}

impl Sink {
    /// Subscribes.
    ///
    /// # Panics
    /// Where that cannot be declared.
    pub async fn declare(session: &Session) -> Self {
        let judged = Judged::default();
        let told = Arc::clone(&judged);
        let subscriber = session.declare_subscriber(key::ALL_CORRECTED).callback(move |sample| {
            let at = Instant::now();
            let batch: CorrectedBatch = codec::decode(&sample.payload().to_bytes()).expect("a good frame");
            let (unit, revision) = (batch.unit, batch.revision);
            let came = batch.ticks.into_iter().map(|tick| Came { at, revision, tick });
            lock(&told).entry(unit).or_default().waiting.extend(came);
        });
        Self { judged, _subscriber: subscriber.await.expect("declared") }
    }

    /// What came of a unit's ticks.
    #[must_use]
    pub fn account(&self, unit: &str) -> Account {
        lock(&self.judged).get_mut(unit).map(Ledger::account).unwrap_or_default()
    }

    /// The longest time without a fresh tick of any unit since a moment, within the last minute.
    #[must_use]
    pub fn longest_pause(&self, from: Instant) -> Duration {
        let judged = lock(&self.judged);
        let pauses = judged.values().flat_map(|ledger| {
            let times = ledger.fresh.iter().zip(ledger.fresh.iter().skip(1));
            times.filter(|(_, next)| **next >= from).map(|(one, next)| *next - *one)
        });
        pauses.max().unwrap_or_default()
    }

    /// From producing a tick to its correction, of all units since this was last asked, in ascending order.
    #[must_use]
    pub fn take_latencies(&self) -> Vec<Duration> {
        let mut judged = lock(&self.judged);
        let mut all: Vec<_> =
            judged.values_mut().flat_map(|ledger| std::mem::take(&mut ledger.latencies)).collect();
        all.sort_unstable();
        all
    }
}
