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
        let half = Span::from_ns(gyro.duration.as_ns() / 2);
        self.tick.end_time < gyro.end_time + half && !self.ends_before(gyro)
    }

    /// Whether it ends earlier than that.
    #[inline]
    fn ends_before(&self, gyro: &GyroTick) -> bool {
        self.tick.end_time + Span::from_ns(gyro.duration.as_ns() / 2) <= gyro.end_time
    }
}

/// Memory of the accelerometer stream.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct AccelIntake {
    pending: VecDeque<PendingAccel>,
    /// Ticks that came after their time, since the last gyro tick: where the next one starts a new series, they are
    /// the first of it.
    behind: VecDeque<PendingAccel>,
    /// Messages of gyro ticks that started no new series.
    gyro_messages: u64,
    /// End of the last gyro tick that was released in this series.
    released: Option<Timestamp>,
}

impl AccelIntake {
    /// Takes one tick.
    #[inline]
    pub(super) fn admit(&mut self, tick: &AccelTick, output: OutputKind, counters: &mut Counters) {
        if !is_possible(tick.duration) {
            counters.bad_duration += 1;
            return;
        }
        // Made where it is put: a copy costs as much as all that is asked of it.
        let after = self.gyro_messages;
        let pending = || PendingAccel { tick: tick.clone(), output, after };
        if self.released.is_some_and(|released| tick.end_time <= released) {
            self.note_late(pending(), counters);
        } else if self.follows(tick.end_time) {
            self.pending.push_back(pending());
        } else {
            self.insert_between(pending(), counters);
        }
    }

    /// Whether a tick that ends at `time` goes behind all that wait.
    #[inline]
    fn follows(&self, time: Timestamp) -> bool {
        self.pending.back().is_none_or(|last| last.tick.end_time < time) && self.pending.len() < MAX_PENDING
    }

    /// Sets a tick apart whose gyro tick has gone.
    #[cold]
    fn note_late(&mut self, late: PendingAccel, counters: &mut Counters) {
        counters.accel_late += 1;
        if self.behind.len() < MAX_PENDING {
            self.behind.push_back(late);
        }
    }

    /// Puts a tick in its place in time.
    #[cold]
    fn insert_between(&mut self, pending: PendingAccel, counters: &mut Counters) {
        let time = pending.tick.end_time;
        let place = self.pending.iter().rposition(|p| p.tick.end_time < time).map_or(0, |i| i + 1);
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
        for _ in 0..met {
            self.pending.pop_front();
        }
    }

    /// Notes that gyro ticks came which start no new series.
    #[inline]
    pub(super) fn goes_on(&mut self) {
        self.behind.clear();
        self.gyro_messages += 1;
        if self.pending.is_empty() && self.pending.capacity() > LONGEST_KEPT {
            self.pending = VecDeque::new();
        }
    }

    /// Notes that gyro ticks came which start a new series: what came since the last message of the old one is set
    /// apart, so that ticks of the old one that still wait do not take it.
    pub(super) fn sets_apart(&mut self) {
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
        self.pending.retain(near);
        counters.accel_unpaired += before.abs_diff(self.pending.len()) as u64;
        while let Some(tick) = self.behind.pop_front() {
            self.insert_between(tick, counters);
        }
    }
}
