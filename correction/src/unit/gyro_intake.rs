//! Order and plausibility of the raw gyro stream.
//!
//! Ticks leave here in sequence, each exactly once. A tick that is missing is waited for as long as the pairing
//! window (in event time) allows; then the ticks behind it go on and the gap is announced.

use alloc::collections::VecDeque;
use core::cmp::Ordering;

use serde::{Deserialize, Serialize};

use super::counters::Counters;
use crate::sample::{GyroTick, OutputKind};
use crate::units::{Span, Timestamp};

/// Most gyro ticks that wait for an accelerometer tick or a missing neighbour.
const MAX_PENDING: usize = 8192;
/// Longest queue whose room is kept once it is empty, in ticks: what a burst has needed beyond it goes.
pub(super) const LONGEST_KEPT: usize = 256;
/// Longest tick (10 s).
pub const MAX_TICK_DURATION: Span = Span::from_ns(10_000_000_000);
/// A step of time larger than this, and than twice the ticks it claims to span, is not believed at once (1 h).
const MAX_STEP: Span = Span::HOUR;
/// So many consistent ticks in a row make a jump of sequence or time believed.
const BELIEVED_AFTER: u32 = 8;
/// The same where sequence and time both lie in the past: that is how a producer that was switched off and on looks,
/// but also a stretch of old ticks that is sent again.
const OLD_BELIEVED_AFTER: u32 = 256;

/// A tick that waits for its release.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Pending {
    tick: GyroTick,
    output: OutputKind,
    /// End of the last tick that was admitted with it from one batch, once that is known. The window counts from
    /// here, so that the size of a batch does not eat into it.
    batch_end: Option<Timestamp>,
    restart: bool,
    refused_before: u64,
}

/// The tick that is to leave next.
#[derive(Debug)]
pub(super) struct Front<'a> {
    pub(super) tick: &'a GyroTick,
    /// Its window has passed: it waits for nothing any more.
    pub(super) expired: bool,
    /// It starts a new series.
    pub(super) restart: bool,
}

/// A tick that has left.
#[derive(Debug)]
pub(super) struct Left {
    pub(super) tick: GyroTick,
    pub(super) output: OutputKind,
    pub(super) before: Break,
}

/// What lies between two ticks: nothing, mostly.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Break {
    /// Ticks that are missing.
    pub(super) missed: u64,
    /// The producer restarted, or its clock stepped: a new series begins.
    pub(super) restart: bool,
}

impl Break {
    /// With what lay before an earlier tick that was left out since.
    pub(super) fn after(self, earlier: Self) -> Self {
        Self { missed: self.missed.saturating_add(earlier.missed), restart: self.restart | earlier.restart }
    }

    /// With a tick more that is left out.
    pub(super) fn and_a_tick(self) -> Self {
        Self { missed: self.missed.saturating_add(1), ..self }
    }
}

/// A jump of sequence or time that is not believed yet.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Jump {
    newest: Newest,
    consistent: u32,
    refused: u64,
}

/// The newest tick that was admitted.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Newest {
    sequence: u64,
    end_time: Timestamp,
}

/// Memory of the gyro stream.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct GyroIntake {
    pending: VecDeque<Pending>,
    /// The first batch, which waits out its window, has left, and the room it took is given back: most units need none again.
    #[serde(skip)]
    began: bool,
    /// Ticks admitted from the present batch.
    batch: usize,
    /// Ticks among the pending ones at which a restart was followed.
    restarts_pending: usize,
    newest: Option<Newest>,
    jump: Option<Jump>,
    /// Ticks refused unseen since the last one that was admitted: for their duration, or by the calibration. Where no restart
    /// follows, the sequence tells that they are missing.
    unseen: u64,
    /// The producer's run in force, and the one that it took over from, whose ticks are late until they are many.
    series: Option<u64>,
    superseded: Option<u64>,
    /// Sequence number that was released last; `None` until the first tick has left. That one waits out its window
    /// like a tick behind a gap: the stream may have begun with an earlier one that is still on its way.
    last: Option<u64>,
    /// Bit i: the tick `last − i` was released.
    released: u128,
}

impl Newest {
    fn of(tick: &GyroTick) -> Self {
        Self { sequence: tick.sequence, end_time: tick.end_time }
    }
}

/// A tick that was admitted, by default as the next of its series.
#[derive(Default)]
struct Admitted {
    restart: bool,
    refused_before: u64,
}

impl GyroIntake {
    /// How many of these ticks go on where the last one left off, with nothing waiting: they need not wait either. `fits` says of a
    /// tick, and its place among them, whether all that belongs to it is at hand.
    #[inline]
    pub(super) fn run(&self, ticks: &[GyroTick], fits: impl Fn(usize, &GyroTick) -> bool) -> usize {
        let (Some(newest), Some(mut last), Some(series)) = (self.newest, self.last, self.series) else {
            return 0;
        };
        if newest.sequence != last || !self.pending.is_empty() {
            return 0;
        }
        let mut last_end = newest.end_time;
        let goes_on = |(index, tick): &(usize, &GyroTick)| {
            let (is_later, step) = (tick.end_time > last_end, tick.end_time.since(last_end));
            (last, last_end) = (last.wrapping_add(1), tick.end_time);
            tick.sequence == last
                && last > 0
                && tick.series == series
                && is_possible(tick.duration)
                && is_later
                && step <= MAX_STEP
                && step >= tick.duration.half()
                && fits(*index, tick)
        };
        ticks.iter().enumerate().take_while(goes_on).count()
    }

    /// Sequence number and end of the newest tick that was admitted.
    pub(super) fn newest(&self) -> Option<(u64, Timestamp)> {
        self.newest.map(|newest| (newest.sequence, newest.end_time))
    }

    /// Remembers a [run](Self::run), which did not wait.
    #[inline]
    pub(super) fn passed(&mut self, run: &[GyroTick]) {
        let Some(last) = run.last() else { return };
        self.jump = None;
        self.unseen = 0;
        self.newest = Some(Newest::of(last));
        let count = u32::try_from(run.len()).unwrap_or(u32::MAX);
        // So many ones behind what there was.
        self.released = self.released.wrapping_add(1).checked_shl(count).unwrap_or(0).wrapping_sub(1);
        self.last = Some(last.sequence);
    }

    /// Remembers that a tick has left, with so many missing before it.
    #[inline]
    fn leave(&mut self, sequence: u64, missed: u64, restart: bool) {
        let moved = u32::try_from(missed.saturating_add(1)).ok().filter(|_| !restart);
        self.released = moved.and_then(|moved| self.released.checked_shl(moved)).unwrap_or(0) | 1;
        self.last = Some(sequence);
    }

    /// Notes a tick that the calibration cannot take.
    pub(super) fn refuse(&mut self) {
        self.unseen += 1;
    }

    /// Takes one tick of a batch; whether it starts a new series.
    pub(super) fn admit(&mut self, tick: &GyroTick, output: OutputKind, counters: &mut Counters) -> bool {
        if !is_possible(tick.duration) {
            counters.bad_duration += 1;
            self.refuse();
            return false;
        }
        let Some(Admitted { restart, refused_before }) = self.judge(tick, counters) else {
            return false;
        };
        let refused_before = refused_before + core::mem::take(&mut self.unseen);
        let pending = Pending { tick: tick.clone(), output, batch_end: None, restart, refused_before };
        if restart || self.newest.is_none_or(|newest| tick.sequence > newest.sequence) {
            self.newest = Some(Newest::of(tick));
            self.restarts_pending += usize::from(restart);
            self.pending.push_back(pending);
            self.batch += 1;
            counters.pending_overflow += u64::from(self.pending.len() > MAX_PENDING);
        } else {
            self.insert_between(pending, counters);
        }
        restart
    }

    /// Ends a batch: call it behind the last tick of each. Only what was admitted counts; a refused tick's broken
    /// time would keep the others waiting for ever.
    #[inline]
    pub(super) fn end_batch(&mut self) {
        if !self.pending.is_empty() {
            self.end_waiting_batch();
        } else if !self.began || self.pending.capacity() > LONGEST_KEPT {
            self.pending = VecDeque::new();
            self.began = true;
        }
    }

    fn end_waiting_batch(&mut self) {
        let mut end = None;
        for pending in self.pending.iter_mut().rev() {
            if self.batch == 0 {
                break;
            }
            if pending.batch_end.is_none() {
                pending.batch_end = Some(*end.get_or_insert(pending.tick.end_time));
                self.batch -= 1;
            }
            // What came before a restart lives in another time.
            if pending.restart {
                end = None;
            }
        }
    }

    /// Compares sequence and time with what came before.
    fn judge(&mut self, tick: &GyroTick, counters: &mut Counters) -> Option<Admitted> {
        let series = *self.series.get_or_insert(tick.series);
        let Some(newest) = self.newest else { return Some(Admitted::default()) };
        if tick.series != series {
            if self.superseded == Some(tick.series) {
                // Stragglers end; a run that goes on was interrupted by a stray tick of another, and takes over again.
                let admission = self.follow_jump(tick, OLD_BELIEVED_AFTER, counters, |to| &mut to.gyro_late);
                if admission.is_some() {
                    self.superseded = self.series.replace(tick.series);
                }
                return admission;
            }
            self.superseded = Some(series);
            self.series = Some(tick.series);
            counters.restarts += 1;
            let refused_before = self.jump.take().map_or(0, |jump| jump.refused);
            return Some(Admitted { restart: true, refused_before });
        }
        if tick.sequence > newest.sequence && plausible_step(newest, tick) {
            self.jump = None;
            return Some(Admitted::default());
        }
        if tick.sequence <= newest.sequence && tick.end_time <= newest.end_time {
            return self.judge_old(tick, counters);
        }
        self.follow_jump(tick, BELIEVED_AFTER, counters, |to| &mut to.gyro_implausible)
    }

    /// A tick from before the newest one: late, doubled, filling a hole, or the sign of a restart.
    fn judge_old(&mut self, tick: &GyroTick, counters: &mut Counters) -> Option<Admitted> {
        if self.restarts_pending > 0
            && let Some(first) = self.pending.iter().rfind(|pending| pending.restart)
        {
            // What was released is of another series; behind the first tick of this one all may still be joined.
            return match tick.sequence.cmp(&first.tick.sequence) {
                Ordering::Greater => Some(Admitted::default()),
                Ordering::Equal => {
                    counters.gyro_duplicates += 1;
                    None
                }
                Ordering::Less => {
                    self.follow_jump(tick, OLD_BELIEVED_AFTER, counters, |to| &mut to.gyro_implausible)
                }
            };
        }
        let Some(age) = self.last.and_then(|last| last.checked_sub(tick.sequence)) else {
            return Some(Admitted::default());
        };
        let known = u32::try_from(age)
            .ok()
            .and_then(|age| self.released.checked_shr(age))
            .is_some_and(|bits| bits & 1 == 1);
        if known {
            counters.gyro_duplicates += 1;
            return None;
        }
        // Too far back to tell late from anew: a producer that was switched off and on begins like this.
        if age >= u64::from(u128::BITS) {
            return self.follow_jump(tick, OLD_BELIEVED_AFTER, counters, |to| &mut to.gyro_implausible);
        }
        counters.gyro_late += 1;
        None
    }

    /// Refuses a jump until enough ticks agree with it, then follows it; `refused` counts those before.
    fn follow_jump(
        &mut self,
        tick: &GyroTick,
        believed_after: u32,
        counters: &mut Counters,
        refused: fn(&mut Counters) -> &mut u64,
    ) -> Option<Admitted> {
        let goes_on = |jump: &Jump| tick.sequence > jump.newest.sequence && plausible_step(jump.newest, tick);
        let before = self.jump.filter(goes_on);
        let refused_before = self.jump.map_or(0, |jump| jump.refused);
        let consistent = before.map_or(1, |jump| jump.consistent + 1);
        if consistent <= believed_after {
            *refused(counters) += 1;
            self.jump = Some(Jump { newest: Newest::of(tick), consistent, refused: refused_before + 1 });
            return None;
        }
        self.jump = None;
        counters.restarts += 1;
        Some(Admitted { restart: true, refused_before })
    }

    /// Puts a tick that came out of order in its place among those that wait.
    fn insert_between(&mut self, pending: Pending, counters: &mut Counters) {
        // Only ticks behind the last restart can still be joined.
        let from = self.pending.iter().rposition(|p| p.restart).map_or(0, |i| i + 1);
        let behind = self.pending.iter().skip(from);
        let place = from + behind.take_while(|p| p.tick.sequence < pending.tick.sequence).count();
        let neighbour = self.pending.get(place);
        if neighbour.is_some_and(|p| p.tick.sequence == pending.tick.sequence) {
            counters.gyro_duplicates += 1;
            return;
        }
        let time = pending.tick.end_time;
        let earlier = place.checked_sub(1).and_then(|i| self.pending.get(i));
        if neighbour.is_some_and(|p| p.tick.end_time <= time)
            || earlier.is_some_and(|p| p.tick.end_time >= time)
        {
            counters.gyro_implausible += 1;
            return;
        }
        self.pending.insert(place, pending);
        self.batch += 1;
    }

    /// The tick that is to leave next; `None` while it must wait for a missing neighbour.
    pub(super) fn front(&self, window: Span, flushing: bool) -> Option<Front<'_>> {
        let front = self.pending.front()?;
        // What waits before a restart lives in another time: the newest tick says nothing of its window.
        let restarted_behind = self.restarts_pending > usize::from(front.restart);
        let batch_end = front.batch_end.unwrap_or(front.tick.end_time);
        let passed = self
            .newest
            .is_some_and(|newest| newest.end_time > batch_end && newest.end_time >= batch_end + window);
        let expired = flushing || restarted_behind || passed || self.pending.len() > MAX_PENDING;
        let in_sequence = front.restart || self.distance(&front.tick) == Some(1);
        (in_sequence || expired).then_some(Front { tick: &front.tick, expired, restart: front.restart })
    }

    /// How far a tick lies ahead of the last one that was released; `None` before the first.
    fn distance(&self, tick: &GyroTick) -> Option<u64> {
        self.last.map(|last| tick.sequence.saturating_sub(last))
    }

    /// Releases the front tick.
    pub(super) fn release(&mut self) -> Option<Left> {
        let Pending { tick, output, restart, refused_before, .. } = self.pending.pop_front()?;
        self.restarts_pending -= usize::from(restart);
        let missed = match self.distance(&tick) {
            Some(distance) if !restart => distance.saturating_sub(1),
            _ => refused_before,
        };
        self.leave(tick.sequence, missed, restart);
        Some(Left { tick, output, before: Break { missed, restart } })
    }

    /// How many ticks wait.
    pub(super) fn len(&self) -> usize {
        self.pending.len()
    }

    /// Whether any tick waits.
    pub(super) fn is_empty(&self) -> bool {
        self.pending.is_empty()
    }
}

/// Whether a tick can have lasted so long.
#[inline]
pub(super) fn is_possible(duration: Span) -> bool {
    (1..=MAX_TICK_DURATION.as_ns()).contains(&duration.as_ns())
}

/// Whether a later sequence number and its time fit the newest tick.
fn plausible_step(newest: Newest, tick: &GyroTick) -> bool {
    if tick.end_time <= newest.end_time {
        return false;
    }
    let step_ns = i128::from(tick.end_time.as_ns()) - i128::from(newest.end_time.as_ns());
    let claimed_ns = i128::from(tick.sequence - newest.sequence) * i128::from(tick.duration.as_ns());
    // Half and twice: durations vary, and a producer may idle between ticks for up to MAX_STEP.
    step_ns >= claimed_ns / 2 && step_ns <= (2 * claimed_ns).max(i128::from(MAX_STEP.as_ns()))
}
