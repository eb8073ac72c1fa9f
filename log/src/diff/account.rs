//! What the comparison of one unit came to.

use std::collections::VecDeque;

use isotherm_correction::sample::TickFlags;
use isotherm_correction::units::{AngularRate, SpecificForce, Timestamp};
use serde::Serialize;

use super::align::{Aligner, Row};
use super::tick::{FieldDifference, LogTick, Tolerance, differences, identical, mode, words};

/// How two logs are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiffOptions {
    /// What still counts as equal.
    pub tolerance: Tolerance,
    /// How many ticks are kept before and behind the first difference.
    pub around: usize,
}

impl Default for DiffOptions {
    fn default() -> Self {
        Self { tolerance: Tolerance::default(), around: 3 }
    }
}

/// One of two logs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The first.
    A,
    /// The second.
    B,
}

/// Ticks that only one log has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Only {
    /// Before the first tick that both have.
    pub before: u64,
    /// Between ticks that both have.
    pub between: u64,
    /// Behind the last tick that both have.
    pub behind: u64,
}

impl Only {
    /// All of them.
    #[must_use]
    pub fn all(&self) -> u64 {
        self.before + self.between + self.behind
    }
}

/// The largest difference on one axis.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Largest {
    /// Its size (rad, or m/s).
    pub increment: f64,
    /// As a rate (°/h), or specific force (mg).
    pub equivalent: f64,
    /// Sequence number of the tick where it is.
    pub sequence: u64,
}

/// The first tick that is not the same in both logs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FirstDifference {
    /// Its sequence number.
    pub sequence: u64,
    /// Its end (ns on the producer's clock).
    pub end_time_ns: i64,
    /// The fields that differ; empty where one log does not have the tick.
    pub fields: Vec<FieldDifference>,
    /// The log that alone has it, "a" or "b", where one does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub only_in: Option<&'static str>,
    /// What happened last up to it in the first log.
    pub event_a: Happened,
    /// In the second log.
    pub event_b: Happened,
    /// The ticks around it.
    #[serde(skip)]
    pub around: Vec<Row>,
    /// Which of these it is.
    #[serde(skip)]
    pub at: usize,
}

/// What happened last in a log.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Happened {
    /// The last entry of the journal, where the log has one.
    pub journal: Option<String>,
    /// What the ticks say: another revision, mode or flag, a gap, a restart.
    pub tick: Option<String>,
}

/// What the comparison of one unit's ticks came to.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Account {
    /// Ticks that both logs have.
    pub ticks: u64,
    /// Of these, how many differ by more than is allowed.
    pub different: u64,
    /// Of these, how many differ by no more than is allowed.
    pub within_tolerance: u64,
    /// Ticks of both that were made by different documents, whether they differ or not; where both logs say by which.
    pub other_document: u64,
    /// Ticks of the first log alone.
    pub only_a: Only,
    /// Ticks of the second log alone.
    pub only_b: Only,
    /// Of [`Only::behind`] in the second log, those of which a recording that was cut short has no raw ticks any more.
    pub unfinished: u64,
    /// The first that differs or is missing.
    pub first: Option<FirstDifference>,
    /// Largest difference of the angle increments, by axis, whatever is allowed.
    pub angle: [Largest; 3],
    /// Likewise of the velocity increments.
    pub velocity: [Largest; 3],
}

impl Account {
    /// Whether both logs have the same ticks, as far as the tolerance tells.
    #[must_use]
    pub fn is_identical(&self) -> bool {
        self.different + self.only_a.all() + self.only_b.all() == 0
    }

    /// Whether the first log, made of a recording, agrees with the second, of the same recording: that may begin earlier, with
    /// what the recorder did not hear the readings of, and end earlier, as the recorder did not wait for the last ticks.
    #[must_use]
    pub fn agrees(&self) -> bool {
        let nothing_common = self.ticks == 0 && self.only_a.all() > 0 && self.only_b.all() > 0;
        self.different + self.missing() == 0 && !nothing_common
    }

    /// Ticks that only one of such logs has and the other should have.
    #[must_use]
    pub fn missing(&self) -> u64 {
        let in_a = self.only_b.between + self.only_b.behind.saturating_sub(self.unfinished);
        in_a + self.only_a.before + self.only_a.between
    }

    /// Ticks that only the recorder missed: nothing else is other, and they lie between ticks that both have, which would announce
    /// a gap if the service had not published them.
    #[must_use]
    pub fn unrecorded(&self) -> u64 {
        let missed = self.only_a.between;
        if self.different == 0 && self.missing() == missed { missed } else { 0 }
    }
}

/// Compares the ticks of one unit, as they come.
#[derive(Debug, Default)]
pub struct Comparison {
    options: DiffOptions,
    /// Whether ticks before and behind those that both have are differences: not where one log is a part of the other.
    whole: bool,
    aligner: Aligner,
    account: Account,
    /// Ticks of one log alone since the last that both have.
    since: (u64, u64),
    /// The end of the first of these that the second log has.
    alone_in_b: Option<Timestamp>,
    /// The first tick of one log alone, with the ticks around it, where nothing differed before.
    suspect: Option<FirstDifference>,
    recent: VecDeque<Row>,
    /// Rows that are still to be kept behind the first difference.
    behind: usize,
    happened: (Happened, Happened),
    before: (Option<Known>, Option<Known>),
}

/// What is remembered of the last tick of a log, to see what happens.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Known {
    revision: u64,
    mode: Option<isotherm_correction::sample::LasingMode>,
    flags: TickFlags,
}

impl Comparison {
    /// Of two whole logs; or (`whole` false) of what was made of a recording and what that has: see [`Account::agrees`].
    #[must_use]
    pub fn new(options: DiffOptions, whole: bool) -> Self {
        Self { options, whole, ..Self::default() }
    }

    /// Takes a tick of one log.
    pub fn push(&mut self, side: Side, tick: LogTick) {
        self.aligner.push(side, tick);
    }

    /// Ticks that wait for the other log: of the first and of the second.
    #[must_use]
    pub fn waiting(&self) -> (usize, usize) {
        self.aligner.waiting()
    }

    /// Compares what can be compared.
    pub fn advance(&mut self) {
        while let Some(row) = self.aligner.next_row() {
            self.row(row);
        }
    }

    /// Nothing more comes.
    #[must_use]
    pub fn finish(self) -> Account {
        self.finish_with(|_| true)
    }

    /// Nothing more comes. Of the ticks behind the last that both have, the second log's are unfinished where `recorded` says of the end
    /// of their first that the first log could not have it.
    #[must_use]
    pub(crate) fn finish_with(mut self, recorded: impl Fn(Timestamp) -> bool) -> Account {
        self.aligner.finish();
        self.advance();
        self.account.only_a.behind += self.since.0;
        self.account.only_b.behind += self.since.1;
        if self.account.ticks > 0 && self.alone_in_b.is_some_and(|end_time| !recorded(end_time)) {
            self.account.unfinished = self.since.1;
        }
        if self.account.first.is_none() {
            let finished = self.account.unfinished == 0;
            self.account.first =
                self.suspect.filter(|suspect| self.whole || (finished && suspect.only_in == Some("b")));
        }
        self.account
    }

    fn row(&mut self, row: Row) {
        for (tick, before, event) in [
            (&row.a, &mut self.before.0, &mut self.happened.0),
            (&row.b, &mut self.before.1, &mut self.happened.1),
        ] {
            if let Some(tick) = tick {
                event.journal = tick.event.as_deref().map(str::to_owned).or(event.journal.take());
                happened(tick, before, &mut event.tick);
            }
        }
        match (&row.a, &row.b) {
            (Some(a), Some(b)) => {
                self.settle_only();
                self.account.ticks += 1;
                let other = a.digest.zip(b.digest).is_some_and(|(a, b)| a != b);
                self.account.other_document += u64::from(other);
                if !identical(a, b) && self.different(a, b, &row) {
                    return;
                }
            }
            (only, None) | (None, only) => {
                let in_a = row.a.is_some();
                let count = if in_a { &mut self.since.0 } else { &mut self.since.1 };
                *count += 1;
                if let Some(tick) = &row.b {
                    self.alone_in_b.get_or_insert(tick.tick.end_time);
                }
                if let Some(tick) =
                    only.as_ref().filter(|_| self.account.first.is_none() && self.suspect.is_none())
                {
                    let mut first = self.first(tick, Vec::new(), &row);
                    first.only_in = Some(if in_a { "a" } else { "b" });
                    self.suspect = Some(first);
                    return;
                }
            }
        }
        if self.behind > 0 {
            self.behind -= 1;
            if let Some(first) = self.account.first.as_mut().or(self.suspect.as_mut()) {
                first.around.push(row.clone());
            }
        }
        self.remember(row);
    }

    /// A tick that both have: those of one alone before it were before the first such, or between two.
    fn settle_only(&mut self) {
        let (a, b) = std::mem::take(&mut self.since);
        self.alone_in_b = None;
        let first = self.account.ticks == 0;
        for (only, count) in [(&mut self.account.only_a, a), (&mut self.account.only_b, b)] {
            *(if first { &mut only.before } else { &mut only.between }) += count;
        }
        if let Some(suspect) = self.suspect.take() {
            let counts = self.whole || !first || suspect.only_in == Some("a");
            if self.account.first.is_none() && counts {
                self.account.first = Some(suspect);
            } else {
                self.behind = 0;
            }
        }
    }

    /// Enters two ticks that are not the same; whether they are the first such.
    fn different(&mut self, a: &LogTick, b: &LogTick, row: &Row) -> bool {
        let seconds = a.tick.duration.as_s();
        let deg_per_h = |angle: f64| AngularRate::from_rad_per_s(angle / seconds).as_deg_per_h();
        let milli_g = |velocity: f64| SpecificForce::from_m_per_s2(velocity / seconds).as_g() * 1e3;
        let pairs = |a: [f64; 3], b: [f64; 3]| a.into_iter().zip(b);
        let sequence = a.tick.sequence;
        let angles = self.account.angle.iter_mut().zip(pairs(a.tick.delta_angle, b.tick.delta_angle));
        angles.for_each(|(largest, pair)| largest.note(pair, sequence, &deg_per_h));
        let velocities =
            self.account.velocity.iter_mut().zip(pairs(a.tick.delta_velocity, b.tick.delta_velocity));
        velocities.for_each(|(largest, pair)| largest.note(pair, sequence, &milli_g));
        let fields = differences(a, b, &self.options.tolerance);
        if fields.is_empty() {
            self.account.within_tolerance += 1;
            return false;
        }
        self.account.different += 1;
        let is_first = self.account.first.is_none();
        if is_first {
            self.account.first = Some(self.first(a, fields, row));
        }
        is_first
    }

    fn first(&mut self, tick: &LogTick, fields: Vec<FieldDifference>, row: &Row) -> FirstDifference {
        let mut around: Vec<_> = self.recent.drain(..).collect();
        let at = around.len();
        around.push(row.clone());
        self.behind = self.options.around;
        FirstDifference {
            sequence: tick.tick.sequence,
            end_time_ns: tick.tick.end_time.as_ns(),
            fields,
            only_in: None,
            event_a: self.happened.0.clone(),
            event_b: self.happened.1.clone(),
            around,
            at,
        }
    }

    fn remember(&mut self, row: Row) {
        if self.account.first.is_some() || self.options.around == 0 {
            return;
        }
        if self.recent.len() == self.options.around {
            self.recent.pop_front();
        }
        self.recent.push_back(row);
    }
}

impl Largest {
    fn note(&mut self, (a, b): (f64, f64), sequence: u64, equivalent: &dyn Fn(f64) -> f64) {
        let increment = (b - a).abs();
        if increment > self.increment {
            *self = Self { increment, equivalent: equivalent(increment), sequence };
        }
    }
}

/// Looks at what a tick says of what happened, beside the journal.
fn happened(tick: &LogTick, before: &mut Option<Known>, event: &mut Option<String>) {
    /// Flags of which each tick that has one is an event of its own.
    const EACH: TickFlags = TickFlags::GAP.union(TickFlags::RESTART).union(TickFlags::ANGLE_RESTORED);
    let tick = &tick.tick;
    let now = Known { revision: tick.revision, mode: tick.mode, flags: tick.flags };
    let last = before.replace(now);
    if last == Some(now) && !now.flags.intersects(EACH) {
        return;
    }
    let sequence = tick.sequence;
    let mut what = Vec::new();
    if now.flags.contains(TickFlags::RESTART) {
        what.push("the producer restarted".to_owned());
    } else if now.flags.contains(TickFlags::GAP) {
        what.push(format!("a gap of {} ticks", tick.missed));
    }
    match last {
        None => what.push(format!("the log's first tick, revision {}", now.revision)),
        Some(last) => {
            if last.revision != now.revision {
                what.push(format!("revision {} came into force after {}", now.revision, last.revision));
            }
            if last.mode != now.mode {
                what.push(format!("the mode went from {} to {}", mode(last.mode), mode(now.mode)));
            }
            let of = |flags: TickFlags| (!flags.is_empty()).then(|| words(flags.iter_names()));
            let announced = TickFlags::GAP | TickFlags::RESTART;
            what.extend(of(now.flags - last.flags - announced).map(|names| format!("{names} set")));
            what.extend(of(last.flags - now.flags - announced - EACH).map(|names| format!("{names} ended")));
        }
    }
    if now.flags.contains(TickFlags::ANGLE_RESTORED) && last.is_some_and(|last| last.flags == now.flags) {
        what.push("the angle of a mode switch was restored".to_owned());
    }
    if !what.is_empty() {
        *event = Some(format!("tick {sequence}: {}", what.join(", ")));
    }
}
