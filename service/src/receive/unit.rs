//! One unit's part of the service: its stream, its calibration, its faults and its outlet.

mod account;
mod arrivals;
mod journal_writer;
mod notices;
mod present;
mod speech;
mod unknown_channels;

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use isotherm_correction::observation::Observation;
use isotherm_correction::operation::{Command, Refusal, State};
use isotherm_correction::unit::{self, Applied, UnitSettings};
use isotherm_protocol::control::Schedule;
use isotherm_protocol::journal::JournalEvent;
use isotherm_protocol::key::{Input, RawStream, UnitId};
use isotherm_protocol::status::{Counter, Output};
use isotherm_protocol::stream::UnitStream;

use crate::control::change::Change;
use crate::control::revision::Plan;
use crate::control::{Inbox, Notice};
use crate::receive::fault::{FaultKind, FaultLog, Telling};
use crate::receive::latency::Histogram;
use arrivals::Arrivals;
use journal_writer::JournalWriter;
use notices::NoticeCollector;
use speech::Speech;

pub(crate) use account::SwapAccount;
pub use journal_writer::{Journal, JournalOutlet};
pub(crate) use present::{Present, StartsAnew};
pub(crate) use speech::{Footing, Standing, Wants};
use unknown_channels::UnknownChannels;

/// Where corrected frames go; `Err` is an output that could not be published.
pub type Outlet = Box<dyn FnMut(Vec<u8>) -> Result<(), zenoh::Error> + Send>;

/// Counters of gyro ticks that were refused, duplicates excepted. Those of the kind and number of sensors count
/// accelerometer ticks too.
const REFUSALS: [&str; 5] =
    ["gyro_late", "gyro_implausible", "wrong_sensor_count", "wrong_output_kind", "bad_duration"];
/// How long a self-test may take by the clock: one that gets no ticks ends with what it has seen.
const LONGEST_SELF_TEST: Duration = Duration::from_secs(14);
/// How long a unit may be silent before it counts as one that sends no more; a pre-launch calibration ends then.
const LONGEST_SILENCE: Duration = Duration::from_secs(10);

/// One unit: frames in, frames out, everything counted. Knows nothing of sessions and threads.
pub struct UnitActor {
    stream: UnitStream,
    plan: Plan,
    outlet: Outlet,
    faults: FaultLog,
    latency: Histogram,
    arrivals: Arrivals,
    unknown_channels: UnknownChannels,
    notices: NoticeCollector,
    journal_writer: JournalWriter,
    speech: Speech,
    account: SwapAccount,
    /// When a frame last came that was one.
    heard: Instant,
    /// When a self-test began by the clock.
    self_test_since: Option<Instant>,
    /// Counters of streams that were given up after an alarm.
    before_reset: Vec<Counter>,
    status_due: bool,
}

impl std::fmt::Debug for UnitActor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("UnitActor")
            .field("unit", self.stream.id())
            .field("revision", &self.stream.revision())
            .finish_non_exhaustive()
    }
}

impl UnitActor {
    /// A unit that has seen nothing and has no calibration.
    #[must_use]
    pub fn new(id: UnitId, settings: UnitSettings, tail_flush: Duration, outlet: Outlet) -> Self {
        Self {
            stream: UnitStream::new(id, settings),
            plan: Plan::default(),
            outlet,
            faults: FaultLog::default(),
            latency: Histogram::default(),
            arrivals: Arrivals::new(tail_flush, pairing_window(&settings), Instant::now()),
            unknown_channels: UnknownChannels::default(),
            notices: NoticeCollector::default(),
            journal_writer: JournalWriter::default(),
            speech: Speech::default(),
            account: SwapAccount::default(),
            heard: Instant::now(),
            self_test_since: None,
            before_reset: Vec::new(),
            status_due: true,
        }
    }

    /// To whom the unit tells what only the swap manager can write down.
    pub(crate) fn report_to(&mut self, inbox: Inbox) {
        self.notices.inbox = Some(inbox);
    }

    /// Has a calibration take effect at its tick: the only way by which a unit ever gets one. Gives the revision counter of
    /// a change that was waiting and is replaced. A revision that the unit was given already is passed over.
    pub fn change(&mut self, change: Change) -> Option<u64> {
        if change.next.number.counter < self.stream.next_counter() {
            return None;
        }
        let replaced = self.give(&change);
        self.plan.change(change);
        self.status_due = true;
        // It may have given up what went on.
        self.look();
        replaced
    }

    /// Hands a change to the stream.
    fn give(&mut self, change: &Change) -> Option<u64> {
        let Change { next, at, slew } = change;
        let label = next.label();
        let (calibration, revision) = (Arc::clone(&next.document.calibration), next.number);
        let replaced = if label.digest.is_none() {
            self.stream.install_as(calibration, revision, label);
            None
        } else {
            let revision = revision.counter;
            self.stream.schedule(unit::Change { calibration, revision, at: *at, slew: *slew }, label)
        };
        self.journal_order(|_| journal_writer::changed(change));
        replaced
    }

    /// Carries a command out before the next tick; the state that it leads to.
    ///
    /// # Errors
    /// [`Refusal`]: the state is as before.
    pub fn command(&mut self, command: &Command) -> Result<State, Refusal> {
        let done = self.stream.command(command);
        self.journal_order(|_| journal_writer::commanded(command, &done));
        // A self-test without a calibration changes no state, and yet has a report.
        self.status_due |= done.is_ok();
        self.look();
        done
    }

    /// Takes one frame that arrived at `arrival`, and publishes what it releases; whether subscribers of the status should hear of it at
    /// once.
    pub fn receive(&mut self, input: impl Into<Input>, frame: &[u8], arrival: Instant) -> bool {
        let input = input.into();
        let is_gyro = input == Input::Raw(RawStream::Gyro);
        if is_gyro && self.speech.uncertain {
            self.hear_again(frame, arrival);
        }
        self.note_frame(input, frame, arrival);
        let repeat = (is_gyro && self.arrivals.is_repeat(frame)).then(|| self.contradicting());
        let received = self.stream.receive(input, frame);
        if let Some(before) = repeat {
            self.arrivals.repeated += self.contradicting() - before;
        }
        let series = (is_gyro && received.is_ok()).then(|| self.stream.incoming_series());
        self.arrivals.note(input, series, arrival);
        if input == Input::Raw(RawStream::Temperature) {
            self.unknown_channels.heard(self.stream.unit(), frame, arrival);
        }
        if let Err(error) = received {
            self.fault(FaultKind::from(&error), 1, || format!("{}: {error}", input.topic()));
            return self.status_due;
        }
        self.heard = arrival;
        if self.publish() {
            self.status_due |=
                self.latency.record(u64::try_from(arrival.elapsed().as_nanos()).unwrap_or(u64::MAX));
        }
        self.look();
        self.status_due
    }

    /// Gyro ticks of the stream that contradict others.
    fn contradicting(&self) -> u64 {
        let counters = self.stream.unit().counters();
        counters.gyro_late + counters.gyro_implausible + counters.gyro_duplicates
    }

    /// Looks for what has changed with the last event.
    fn look(&mut self) {
        if self.plan.pending.is_some() && self.stream.unit().pending().is_none() {
            self.plan.settle();
        }
        if self.notices.look(&mut self.stream) {
            self.status_due = true;
            self.self_test_since = (self.stream.unit().state() == State::SelfTest).then(Instant::now);
        }
    }

    /// Does what only a clock can: releases what waits in a stream that has stopped, ends what gets no more ticks.
    pub fn tend(&mut self, now: Instant) {
        if !self.speaks() {
            // What the clock does to the stream, the journal of the instance that speaks says.
            self.notices.tell(&self.stream);
            return;
        }
        if self.stream.is_waiting() && self.arrivals.is_over(now) {
            self.flush();
        }
        if self.self_test_since.is_some_and(|since| now.saturating_duration_since(since) > LONGEST_SELF_TEST)
        {
            self.stream.expire_self_test();
            self.journal(|_| JournalEvent::SelfTestExpired);
            self.look();
        }
        if self.stream.unit().state() == State::PreLaunchCalibration
            && self.arrivals.is_silent_for(now, LONGEST_SILENCE)
        {
            self.stream.end_pre_launch();
            self.journal(|_| JournalEvent::PreLaunchEnded);
            self.look();
        }
        self.notices.tell(&self.stream);
    }

    /// Releases and publishes what waits inside.
    pub fn flush(&mut self) {
        let waited = self.stream.is_waiting();
        self.stream.flush();
        if waited {
            self.journal(|_| JournalEvent::Flushed);
        }
        self.publish();
        self.look();
    }

    /// Publishes every corrected tick that is ready; whether there was one.
    fn publish(&mut self) -> bool {
        let (mut published, mut frame) = (false, Vec::new());
        while let Some(ticks) = self.stream.next_frame(&mut frame) {
            // It goes away: nothing is given back for it.
            match self.let_out(std::mem::take(&mut frame)) {
                Ok(()) => published = true,
                Err(error) => self.note_unpublished(ticks as u64, &error),
            }
        }
        published
    }

    /// Counts a fault, and logs the first of its kind; of those that follow, their number once a minute.
    fn note_unpublished(&mut self, count: u64, error: &zenoh::Error) {
        self.fault(FaultKind::Unpublished, count, || format!("corrected: {}", isotherm_bus::words(error)));
    }

    fn fault(&mut self, kind: FaultKind, count: u64, words: impl FnOnce() -> String) {
        let Some(telling) = self.faults.note(kind, count, words) else { return };
        self.status_due |= matches!(telling, Telling::First(_));
        tracing::warn!(unit = %self.stream.id(), kind = kind.name(), "{telling}");
    }

    /// Gives the unit's memory up after an event thought impossible: counted as an alarm, always logged.
    ///
    /// Calibration, revision and state stay; a self-test or pre-launch calibration is given up.
    pub fn reset(&mut self, cause: &str) {
        let id = self.stream.id().clone();
        tracing::error!(unit = %id, "alarm: {cause}; the unit is restarted");
        self.before_reset = self.counters();
        let state = self.stream.unit().state();
        self.stream.begin_anew(*self.stream.unit().settings(), 0);
        self.lose_step();
        self.journal(journal_writer::began);
        let plan = self.plan.clone();
        for change in plan.changes() {
            self.give(&change);
        }
        let back = match state {
            _ if self.stream.unit().state() == state => None,
            State::RunningWithReversal => Some(Command::Run { reversal: Some(true) }),
            State::RunningWithoutReversal => Some(Command::Run { reversal: Some(false) }),
            State::Standby | State::SelfTest | State::PreLaunchCalibration => Some(Command::Standby),
        };
        let given = back.map(|command| {
            let done = self.stream.command(&command);
            self.journal(|_| journal_writer::commanded(&command, &done));
            done
        });
        if let Some(Err(refusal)) = given {
            tracing::error!(unit = %self.stream.id(), "the state is no longer {state}: {refusal}");
        }
        let words = format!("alarm: {cause}");
        self.faults.note(FaultKind::Alarm, 1, || words);
        self.status_due = true;
        self.look();
    }

    /// What is left to tell when the swap manager ends.
    pub(crate) fn take_untold(&mut self) -> VecDeque<Notice> {
        std::mem::take(&mut self.notices.untold)
    }

    /// What the unit is like at this moment.
    pub(crate) fn present(&self) -> Present {
        Present::of(self.stream.unit())
    }

    /// The last tick that was corrected, and what was subtracted from it; `None` before the first, and without a calibration.
    pub(crate) fn tick_seen(&self) -> Option<(Observation, Applied)> {
        let unit = self.stream.unit();
        Some((unit.observation()?.clone(), unit.applied()?))
    }

    /// The change that waits for its tick: its revision counter, and when it takes effect.
    #[must_use]
    pub fn waiting(&self) -> Option<(u64, Schedule)> {
        self.plan.waiting()
    }

    /// Sequence number of the last tick that was corrected under the calibration in force.
    pub(crate) fn last_sequence(&self) -> Option<u64> {
        self.stream.unit().observation().map(|seen| seen.sequence)
    }

    /// Whether something happened that subscribers of the status should hear of at once; asking settles it.
    pub fn take_status_due(&mut self) -> bool {
        std::mem::take(&mut self.status_due)
    }

    /// What the unit is doing, and what becomes of its ticks.
    pub(crate) fn doing(&self) -> (State, Output) {
        (self.stream.unit().state(), self.stream.output())
    }

    /// How long no good frame has come.
    pub(crate) fn silence(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.heard)
    }

    /// Whether frames come.
    pub(crate) fn is_heard(&self, now: Instant) -> bool {
        self.silence(now) < LONGEST_SILENCE
    }

    /// Whether something goes on whose progress should be seen more often than once a status interval.
    pub(crate) fn is_in_progress(&self) -> bool {
        matches!(self.stream.unit().state(), State::SelfTest | State::PreLaunchCalibration)
    }

    /// Serial of the unit.
    pub(crate) fn id(&self) -> &UnitId {
        self.stream.id()
    }
}

/// How long a unit's gyro tick waits for its accelerometer tick.
pub(crate) fn pairing_window(settings: &UnitSettings) -> Duration {
    Duration::from_nanos(settings.pairing_window.as_ns().unsigned_abs())
}

#[cfg(test)]
mod tests;
