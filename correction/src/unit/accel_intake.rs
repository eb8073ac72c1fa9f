//! Accelerometer ticks that wait for the gyro tick that ends with them.

use alloc::collections::VecDeque;

use serde::{Deserialize, Serialize};

use super::counters::Counters;
use super::gyro_intake::{LONGEST_KEPT, MAX_TICK_DURATION, is_possible};
use crate::sample::{AccelTick, GyroTick, OutputKind};
use crate::units::{Span, Timestamp};

/// Most accelerometer ticks that wait.
const MAX_PENDING: usize = 8192;

/// A tick that waits for its gyro tick, or has met it.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct PendingAccel {
    pub(super) tick: AccelTick,
    /// What its readings stand for.
    pub(super) output: OutputKind,
    /// Messages of gyro ticks that had come before it.
    after: u64,
}

impl PendingAccel {
    /// Whether it ends with a gyro tick, nearer than half the gyro tick's duration.
    #[inline]
    pub(super) fn ends_with(&self, gyro: &GyroTick) -> bool {
        let (end_time, half) = (self.tick.end_time, half_or_more(gyro.duration));
        end_time < gyro.end_time + half && end_time + half > gyro.end_time
    }

    /// Whether it ends earlier than that.
    fn ends_before(&self, gyro: &GyroTick) -> bool {
        self.tick.end_time + half_or_more(gyro.duration) <= gyro.end_time
    }
}

/// Half a duration in whole nanoseconds, rounded up: what is nearer is nearer than half.
#[inline]
fn half_or_more(duration: Span) -> Span {
    Span::from_ns(duration.as_ns() - duration.half().as_ns())
}

/// Memory of the accelerometer stream.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct AccelIntake {
    pending: VecDeque<PendingAccel>,
    /// Ticks that came after their time or with those of another run, since the last gyro tick: where the next one starts a
    /// new series, they are the first of it.
    behind: VecDeque<PendingAccel>,
    /// Since the last gyro tick one came whose number contradicts its time: it and all that come behind it are of another
    /// run, and those that wait are not.
    apart: bool,
    /// What does go behind all has at least this number: none, while others are set apart.
    next_sequence: u64,
    /// Messages of gyro ticks that started no new series.
    gyro_messages: u64,
    /// End of the last gyro tick that was released in this series.
    released: Option<Timestamp>,
    /// No tick that waits ends later, nor has such a gyro tick been released: what does goes behind all.
    newest: Option<Timestamp>,
}

impl AccelIntake {
    /// Takes one tick.
    #[inline]
    pub(super) fn admit(&mut self, tick: &AccelTick, output: OutputKind, counters: &mut Counters) {
        if !is_possible(tick.duration) {
            counters.bad_duration += 1;
            return;
        }
        if self.newest.is_none_or(|newest| newest < tick.end_time)
            && tick.sequence >= self.next_sequence
            && self.pending.len() < MAX_PENDING
        {
            self.newest = Some(tick.end_time);
            self.next_sequence = tick.sequence.wrapping_add(1);
            let after = self.gyro_messages;
            self.pending.push_back(PendingAccel { tick: tick.clone(), output, after });
        } else {
            self.admit_between(tick, output, counters);
        }
    }

    /// Takes a tick that does not go behind all others; one whose gyro tick has gone, or that is of another run, is set apart.
    #[cold]
    fn admit_between(&mut self, tick: &AccelTick, output: OutputKind, counters: &mut Counters) {
        let late = PendingAccel { tick: tick.clone(), output, after: self.gyro_messages };
        let is_in_time = self.is_in_time(tick);
        if is_in_time && !self.apart && self.contradicts(tick) {
            (self.apart, self.next_sequence) = (true, u64::MAX);
        }
        if is_in_time && !self.apart {
            self.insert_between(late, counters);
            return;
        }
        if self.behind.len() < MAX_PENDING {
            self.behind.push_back(late);
        } else {
            counters.accel_late += 1;
        }
    }

    /// Whether its gyro tick may still be to come.
    fn is_in_time(&self, tick: &AccelTick) -> bool {
        self.released.is_none_or(|released| tick.end_time > released)
    }

    /// How many of those that wait end before `time`.
    fn place(&self, time: Timestamp) -> usize {
        self.pending.iter().rposition(|p| p.tick.end_time < time).map_or(0, |i| i + 1)
    }

    /// Whether it has another place by its number than by its time: it is not one out of order.
    fn contradicts(&self, tick: &AccelTick) -> bool {
        let place = self.place(tick.end_time);
        let Some(behind) = self.pending.get(place) else { return tick.sequence < self.next_sequence };
        let before = place.checked_sub(1).and_then(|i| self.pending.get(i));
        tick.sequence >= behind.tick.sequence || before.is_some_and(|it| tick.sequence <= it.tick.sequence)
    }

    /// Puts a tick in its place in time.
    #[cold]
    fn insert_between(&mut self, pending: PendingAccel, counters: &mut Counters) {
        let time = pending.tick.end_time;
        let place = self.place(time);
        if self.pending.get(place).is_some_and(|p| p.tick.end_time == time) {
            counters.accel_duplicates += 1;
            return;
        }
        self.pending.insert(place, pending);
        if self.pending.len() > MAX_PENDING {
            // The one furthest in the future: a broken time stamp would otherwise stay for ever.
            self.pending.pop_back();
            counters.accel_unpaired += 1;
        }
        self.look_for_newest();
    }

    fn look_for_newest(&mut self) {
        let last = self.pending.back().map(|last| &last.tick);
        self.newest = last.map(|last| last.end_time).max(self.released);
        self.next_sequence = last.map_or(0, |last| last.sequence.wrapping_add(1));
    }

    /// Puts those that were set apart among the others; what is late is counted.
    #[cold]
    fn joins(&mut self, counters: &mut Counters) {
        if core::mem::take(&mut self.apart) {
            self.look_for_newest();
        }
        while let Some(pending) = self.behind.pop_front() {
            if self.is_in_time(&pending.tick) {
                self.insert_between(pending, counters);
            } else {
                counters.accel_late += 1;
            }
        }
    }

    /// The ticks that wait, the oldest first, as far as they lie in one piece.
    #[inline]
    pub(super) fn waiting(&self) -> &[PendingAccel] {
        self.pending.as_slices().0
    }

    /// The tick that [ends with](PendingAccel::ends_with) `gyro`: the oldest that waits, once those are dropped whose gyro tick never
    /// came. One that is not there may still come.
    pub(super) fn partner(&mut self, gyro: &GyroTick, counters: &mut Counters) -> Option<&PendingAccel> {
        while self.pending.front().is_some_and(|front| front.ends_before(gyro)) {
            self.pending.pop_front();
            counters.accel_unpaired += 1;
        }
        self.pending.front().filter(|front| front.ends_with(gyro))
    }

    /// Remembers that gyro ticks have gone, the last of which ends at `end_time`, and that so many ticks went with them.
    #[inline]
    pub(super) fn gyros_released(&mut self, end_time: Timestamp, met: usize) {
        self.released = Some(end_time);
        self.newest = self.newest.max(self.released);
        for _ in 0..met {
            self.pending.pop_front();
        }
    }

    /// Notes that gyro ticks came which start no new series.
    #[inline]
    pub(super) fn goes_on(&mut self, counters: &mut Counters) {
        if !self.behind.is_empty() {
            self.joins(counters);
        }
        self.gyro_messages += 1;
        if self.pending.is_empty() && self.pending.capacity() > LONGEST_KEPT {
            self.pending = VecDeque::new();
        }
    }

    /// Notes that gyro ticks came which start a new series: what came since the last message of the old one is set
    /// apart, so that ticks of the old one that still wait do not take it.
    pub(super) fn sets_apart(&mut self) {
        if self.apart {
            return;
        }
        for _ in 0..self.pending.len() {
            let Some(pending) = self.pending.pop_front() else { return };
            let side = if pending.after == self.gyro_messages { &mut self.behind } else { &mut self.pending };
            side.push_back(pending);
        }
    }

    /// Starts a new series whose first gyro tick ends at `end_time`; ticks of the old one are dropped. May be called
    /// again until that gyro tick has been released.
    pub(super) fn starts_anew(&mut self, end_time: Timestamp, counters: &mut Counters) {
        if self.released.take().is_none() {
            return;
        }
        let near = |PendingAccel { tick, .. }: &PendingAccel| {
            tick.end_time + MAX_TICK_DURATION > end_time && tick.end_time < end_time + MAX_TICK_DURATION
        };
        let before = self.pending.len();
        let old = self.apart;
        self.pending.retain(|pending| !old && near(pending));
        self.look_for_newest();
        counters.accel_unpaired += before.abs_diff(self.pending.len()) as u64;
        self.joins(counters);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearer_than_half_a_duration_is_so_to_the_nanosecond() {
        for (duration, furthest) in [(1, 0), (2, 0), (3, 1), (10, 4), (11, 5)] {
            let gyro = GyroTick { duration: Span::from_ns(duration), ..GyroTick::default() };
            for off in -6_i64..=6 {
                let tick = AccelTick { end_time: Timestamp::from_ns(off), ..AccelTick::default() };
                let pending = PendingAccel { tick, output: OutputKind::Mean, after: 0 };
                let [meets, early] = [pending.ends_with(&gyro), pending.ends_before(&gyro)];
                assert_eq!(
                    (meets, early),
                    (off.abs() <= furthest, off < -furthest),
                    "{duration} ns, {off} ns"
                );
            }
        }
    }

    #[test]
    fn a_tick_after_its_time_is_late_unless_a_new_series_begins_with_it() {
        let late = |starts_anew: bool| {
            let (mut intake, mut counters) = (AccelIntake::default(), Counters::default());
            let tick = |ms: i64| AccelTick {
                sequence: ms.unsigned_abs() / 10,
                end_time: Timestamp::from_ns(ms * 1_000_000),
                duration: Span::from_ms(10),
                readings: [0.0; 3].into_iter().collect(),
            };
            intake.admit(&tick(500), OutputKind::Mean, &mut counters);
            intake.gyros_released(Timestamp::from_ns(500_000_000), 1);
            intake.admit(&tick(10), OutputKind::Mean, &mut counters);
            if starts_anew {
                intake.sets_apart();
                intake.starts_anew(Timestamp::from_ns(10_000_000), &mut counters);
            } else {
                intake.goes_on(&mut counters);
            }
            (counters.accel_late, intake.waiting().len())
        };
        assert_eq!((late(false), late(true)), ((1, 0), (0, 1)));
    }
}
