//! Accelerometer ticks that wait for the gyro tick that ends with them.

use alloc::collections::VecDeque;

use super::counters::Counters;
use super::gyro_intake::MAX_DURATION;
use crate::sample::{AccelTick, GyroTick};
use crate::units::{Span, Timestamp};

/// Most accelerometer ticks that wait.
const MAX_PENDING: usize = 8192;

/// What the accelerometer stream has for a gyro tick.
#[derive(Debug)]
pub(super) enum Match {
    /// The tick that ends with it.
    Found(AccelTick),
    /// None yet: it may still come.
    NotYet,
}

/// Memory of the accelerometer stream.
#[derive(Debug, Default)]
pub(super) struct AccelIntake {
    pending: VecDeque<AccelTick>,
    /// Ticks that came after their time, since the last gyro tick: where that next one starts a new series, they
    /// are the first of it.
    behind: VecDeque<AccelTick>,
    /// End of the last gyro tick that was released.
    released: Option<Timestamp>,
}

impl AccelIntake {
    /// Takes one tick.
    pub(super) fn admit(&mut self, tick: &AccelTick, counters: &mut Counters) {
        if tick.duration == Span::ZERO || tick.duration > MAX_DURATION {
            counters.bad_duration += 1;
            return;
        }
        if self.released.is_some_and(|released| tick.end_time <= released) {
            counters.accel_late += 1;
            if self.behind.len() < MAX_PENDING {
                self.behind.push_back(tick.clone());
            }
            return;
        }
        self.insert(tick.clone(), counters);
    }

    /// Puts a tick in its place in time.
    fn insert(&mut self, tick: AccelTick, counters: &mut Counters) {
        let place = self.pending.iter().rposition(|p| p.end_time < tick.end_time).map_or(0, |i| i + 1);
        if self.pending.get(place).is_some_and(|p| p.end_time == tick.end_time) {
            counters.accel_duplicates += 1;
            return;
        }
        self.pending.insert(place, tick);
        if self.pending.len() > MAX_PENDING {
            // The one furthest in the future: a broken time stamp would otherwise stay for ever.
            self.pending.pop_back();
            counters.accel_unpaired += 1;
        }
    }

    /// Looks for the tick that ends with `gyro`, nearer than half the gyro tick's duration.
    pub(super) fn take(&mut self, gyro: &GyroTick, counters: &mut Counters) -> Match {
        let half = Span::from_ns(gyro.duration.as_ns() / 2);
        while let Some(front) = self.pending.front() {
            if front.end_time + half <= gyro.end_time {
                self.pending.pop_front();
                counters.accel_unpaired += 1;
            } else if front.end_time < gyro.end_time + half {
                return self.pending.pop_front().map_or(Match::NotYet, Match::Found);
            } else {
                break;
            }
        }
        Match::NotYet
    }

    /// Remembers that the gyro tick which ends at `end_time` has gone.
    pub(super) fn gyro_released(&mut self, end_time: Timestamp) {
        self.released = Some(end_time);
    }

    /// Notes that gyro ticks came which start no new series.
    pub(super) fn goes_on(&mut self) {
        self.behind.clear();
    }

    /// Starts a new series whose first gyro tick ends at `end_time`; ticks of the old one are dropped.
    pub(super) fn starts_anew(&mut self, end_time: Timestamp, counters: &mut Counters) {
        self.released = None;
        let near = |tick: &AccelTick| {
            tick.end_time + MAX_DURATION > end_time && tick.end_time < end_time + MAX_DURATION
        };
        let before = self.pending.len();
        self.pending.retain(near);
        counters.accel_unpaired += before.abs_diff(self.pending.len()) as u64;
        while let Some(tick) = self.behind.pop_front() {
            self.insert(tick, counters);
        }
    }
}
