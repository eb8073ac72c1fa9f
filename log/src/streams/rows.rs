//! The raw streams of a unit, put in order of time and joined to rows.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::mem;

use isotherm_correction::sample::{AccelTick, ChannelName, GyroTick, OutputKind, TemperatureReading};

use super::contents::UnitContents;
use super::decoded::Decoded;
use crate::text::LogEvent;

/// How long a row waits for what comes late, by the time of later ticks of every stream (ns).
const WAIT_NS: i64 = 5_000_000_000;
/// Most rows that wait: four of the longest batches.
const MOST_ROWS: usize = 1 << 14;
/// Most items that wait for the gyro tick that shows whether a new run began.
const MOST_EARLY: usize = 1 << 13;
/// Most series that are told apart.
const MOST_RUNS: usize = 1 << 12;

/// Everything of a unit that has one time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Row {
    /// The time (ns on the producer's clock).
    pub time_ns: i64,
    /// Temperature readings, one per channel.
    pub temperatures: Vec<TemperatureReading>,
    /// The accelerometer tick that ends then.
    pub accel: Option<(OutputKind, AccelTick)>,
    /// The gyro tick that ends then.
    pub gyro: Option<(OutputKind, GyroTick)>,
}

/// What comes next.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// A row, later than the one before it.
    Row(Box<Row>),
    /// The producer began anew: sequence and time do not continue what came before.
    NewRun,
}

/// What became of ticks and readings that are in no row of their own.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// The same again: nothing is lost.
    pub duplicates: u64,
    /// Came after its place had been passed.
    pub late: u64,
    /// Another one of the same kind has the same time.
    pub conflicts: u64,
}

/// What comes in an order of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Source {
    Gyro,
    Accel,
    Channel(ChannelName),
}

fn source(event: &LogEvent) -> Source {
    match event {
        LogEvent::Temperature(reading) => Source::Channel(reading.channel),
        LogEvent::Accel { .. } => Source::Accel,
        LogEvent::Gyro { .. } => Source::Gyro,
    }
}

/// Puts the ticks and readings of one unit in order of time, however they came.
///
/// A row waits until every stream and channel is five seconds of the log's time further, or thousands of rows wait: one may
/// come in long batches, or have ended. Where the producer's series changes, or a producer
/// without series goes back in time, a new run begins, and the order begins anew. A series whose time goes on while its numbers begin
/// anew is told by these alone.
#[derive(Debug, Default)]
pub struct Rows {
    waiting: BTreeMap<i64, Row>,
    /// Latest time of each source; `None` for one that is still to come.
    newest_ns: BTreeMap<Source, Option<i64>>,
    /// Time of the last row given.
    given_ns: Option<i64>,
    series: Option<u64>,
    known_series: BTreeSet<u64>,
    /// Time and number of the newest gyro tick of the run.
    newest_gyro: Option<(i64, u64)>,
    /// Items without a series that are before everything given: late, or of a run whose first gyro tick is still to come.
    early: Vec<LogEvent>,
    ready: VecDeque<Step>,
    tally: Tally,
}

impl Rows {
    /// For what a log holds of a unit.
    #[must_use]
    pub fn of(contents: &UnitContents) -> Self {
        let gyro = (!contents.gyro.is_empty()).then_some(Source::Gyro);
        let accel = (!contents.accel.is_empty()).then_some(Source::Accel);
        let channels = contents.channels.iter().copied().map(Source::Channel);
        let sources = gyro.into_iter().chain(accel).chain(channels);
        Self { newest_ns: sources.map(|source| (source, None)).collect(), ..Self::default() }
    }

    /// Takes the ticks or readings of a raw message; everything else is passed over.
    pub fn take(&mut self, decoded: &Decoded) {
        match decoded {
            Decoded::Gyro(batch) => {
                batch.ticks.iter().for_each(|tick| self.gyro(batch.output, tick.clone()));
            }
            Decoded::Accel(batch) => {
                let event = |tick: &AccelTick| LogEvent::Accel { output: batch.output, tick: tick.clone() };
                batch.ticks.iter().for_each(|tick| self.other(event(tick)));
            }
            Decoded::Temperature(batch) => {
                batch.readings.iter().for_each(|reading| self.other(LogEvent::Temperature(*reading)));
            }
            _ => {}
        }
    }

    fn gyro(&mut self, output: OutputKind, tick: GyroTick) {
        let time_ns = tick.end_time.as_ns();
        let passed = self.is_passed(time_ns);
        let newest_ns = self.newest_ns.get(&Source::Gyro).copied().flatten();
        let back = passed || newest_ns.is_some_and(|newest| newest.saturating_sub(time_ns) > WAIT_NS);
        let first = self.series.is_none();
        if first || self.series == Some(tick.series) {
            if passed && first || back && tick.series == 0 {
                self.new_run(&tick);
            } else if passed {
                self.tally.late += 1;
                return;
            }
        } else {
            let is_known = self.known_series.contains(&tick.series);
            let number = |(newest_ns, sequence)| time_ns > newest_ns && tick.sequence <= sequence;
            let told_by_number = !passed && self.newest_gyro.is_some_and(number);
            let is_many = self.known_series.len() >= MOST_RUNS;
            if is_known || (is_many && !told_by_number) {
                // Of a run that is over, or one of very many.
                self.tally.late += 1;
                return;
            }
            if !told_by_number {
                self.new_run(&tick);
            }
        }
        self.series = Some(tick.series);
        if self.known_series.len() < MOST_RUNS {
            self.known_series.insert(tick.series);
        }
        self.newest_gyro = self.newest_gyro.max(Some((time_ns, tick.sequence)));
        self.insert(LogEvent::Gyro { output, tick });
    }

    /// The next step that is ready.
    pub fn next_step(&mut self) -> Option<Step> {
        self.ready.pop_front()
    }

    /// Makes everything ready: nothing comes any more.
    pub fn finish(&mut self) {
        // No new run began: what waited for one is late.
        self.tally.late += mem::take(&mut self.early).len() as u64;
        self.release(|_| true);
    }

    /// What is in no row.
    #[must_use]
    pub fn tally(&self) -> Tally {
        self.tally
    }

    fn is_passed(&self, time_ns: i64) -> bool {
        self.given_ns.is_some_and(|given| time_ns <= given)
    }

    /// Takes what has no series.
    fn other(&mut self, item: LogEvent) {
        if !self.is_passed(item.time().as_ns()) {
            self.insert(item);
        } else if self.early.len() < MOST_EARLY {
            self.early.push(item);
        } else {
            self.tally.late += 1;
        }
    }

    /// Begins a run whose first gyro tick this is.
    fn new_run(&mut self, first: &GyroTick) {
        let began_ns = (first.end_time - first.duration).as_ns();
        let from = began_ns.saturating_sub(WAIT_NS);
        let mut gyros = self.waiting.values().filter(|row| row.gyro.is_some()).map(|row| row.time_ns);
        let (first_gyro, last_gyro) = (gyros.next(), gyros.next_back());
        let last = last_gyro.or(first_gyro).max(self.given_ns);
        // What has no gyro tick belongs to the new run where it is later than its beginning and time goes on; and where
        // time goes back, if it is around its beginning and before the old run.
        let belongs = |time_ns: i64| match last {
            Some(last) if last > began_ns => {
                time_ns >= from && first_gyro.is_some_and(|first_gyro| time_ns < first_gyro)
            }
            _ => time_ns > began_ns,
        };
        let mut kept = Vec::new();
        self.waiting.retain(|time_ns, row| {
            let moves = row.gyro.is_none() && belongs(*time_ns);
            if moves {
                kept.extend(row.temperatures.drain(..).map(LogEvent::Temperature));
                kept.extend(row.accel.take().map(|(output, tick)| LogEvent::Accel { output, tick }));
            }
            !moves
        });
        self.release(|_| true);
        let (early, late): (Vec<_>, Vec<_>) =
            mem::take(&mut self.early).into_iter().partition(|item| item.time().as_ns() >= from);
        self.tally.late += late.len() as u64;
        if self.given_ns.is_some() {
            self.ready.push_back(Step::NewRun);
        }
        self.given_ns = None;
        self.newest_gyro = None;
        self.newest_ns.values_mut().for_each(|newest| *newest = None);
        early.into_iter().chain(kept).for_each(|item| self.insert(item));
    }

    /// Puts an item into its row, and gives what has waited long enough.
    fn insert(&mut self, item: LogEvent) {
        let (source, time_ns) = (source(&item), item.time().as_ns());
        let row = self.waiting.entry(time_ns).or_insert_with(|| Row { time_ns, ..Row::default() });
        let tally = &mut self.tally;
        match item {
            LogEvent::Temperature(reading) => {
                let known = row.temperatures.iter().find(|known| known.channel == reading.channel);
                match known {
                    Some(known) => tally.again(known.raw.to_bits() == reading.raw.to_bits()),
                    None => row.temperatures.push(reading),
                }
            }
            LogEvent::Accel { output, tick } => place(&mut row.accel, (output, tick), tally),
            LogEvent::Gyro { output, tick } => place(&mut row.gyro, (output, tick), tally),
        }
        let newest = self.newest_ns.entry(source).or_default();
        *newest = (*newest).max(Some(time_ns));
        // While a source is still to come, its place is the earliest of all: `None`.
        if let Some(Some(slowest)) = self.newest_ns.values().min() {
            let before = slowest.saturating_sub(WAIT_NS);
            self.release(|row| row.time_ns < before);
        }
        while self.waiting.len() > MOST_ROWS {
            self.release_first();
        }
    }

    /// Gives rows from the front while they may be given.
    fn release(&mut self, may: impl Fn(&Row) -> bool) {
        while self.waiting.first_key_value().is_some_and(|(_, row)| may(row)) {
            self.release_first();
        }
    }

    fn release_first(&mut self) {
        if let Some((time_ns, row)) = self.waiting.pop_first() {
            self.given_ns = Some(time_ns);
            self.ready.push_back(Step::Row(Box::new(row)));
        }
    }
}

impl Tally {
    /// Counts what is there already.
    fn again(&mut self, same: bool) {
        if same {
            self.duplicates += 1;
        } else {
            self.conflicts += 1;
        }
    }
}

/// Puts a tick where there is none.
fn place<T: PartialEq + std::fmt::Debug>(place: &mut Option<T>, tick: T, tally: &mut Tally) {
    match place {
        // Their words are compared: a reading that is no number equals itself there.
        Some(known) => tally.again(*known == tick || format!("{known:?}") == format!("{tick:?}")),
        None => *place = Some(tick),
    }
}

#[cfg(test)]
mod tests;
