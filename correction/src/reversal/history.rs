//! The last good readings, as rates against their mid-tick times.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use crate::lanes::Lanes;
use crate::sample::MAX_SENSORS;
use crate::units::{Span, Timestamp};

/// Readings kept: eight on either side of a switch.
const KEPT: usize = 2 * super::MAX_FIT_READINGS as usize;

/// Middle of a tick, from `origin` (s).
pub(super) fn mid_time_s(end_time: Timestamp, duration: Span, origin: Timestamp) -> f64 {
    end_time.seconds_from(origin) - duration.as_s() / 2.0
}

/// One good tick of all sensors.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Reading {
    end_time: Timestamp,
    /// Measured duration, above zero.
    pub(super) duration: Span,
    /// Mean rate per sensor (rad/s); NaN where there is no sensor or no number.
    rates: Lanes,
}

impl Reading {
    const NONE: Self =
        Self { end_time: Timestamp::from_ns(0), duration: Span::ZERO, rates: [f64::NAN; MAX_SENSORS] };

    /// The rates of a tick; `None` where it has no duration, so that there are none.
    #[inline]
    pub(super) fn of(end_time: Timestamp, duration: Span, rates: Lanes) -> Option<Self> {
        (duration != Span::ZERO).then_some(Self { end_time, duration, rates })
    }

    /// Middle of the tick, from `origin` (s).
    pub(super) fn mid_time_s(&self, origin: Timestamp) -> f64 {
        mid_time_s(self.end_time, self.duration, origin)
    }

    /// When it began and ended.
    pub(super) fn ends(&self) -> (Timestamp, Timestamp) {
        (self.end_time - self.duration, self.end_time)
    }

    /// [abscissa, rate] of one sensor, where it has a finite rate.
    pub(super) fn point(&self, at: f64, sensor: usize) -> Option<[f64; 2]> {
        let rate = self.rates.get(sensor).copied().filter(|rate| rate.is_finite());
        rate.map(|rate| [at, rate])
    }
}

/// A ring of the newest readings; its room is made with the first of them, for most units never see a switch.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct History {
    /// Nothing, or [`KEPT`] readings.
    #[serde(with = "written")]
    ring: Vec<Reading>,
    /// Where the next reading goes, below [`KEPT`].
    next: usize,
    /// Readings held, at most [`KEPT`].
    held: usize,
}

impl History {
    /// Adds the newest reading; the oldest gives way.
    #[expect(clippy::inline_always, reason = "once per tick: the reading is made where it is put")]
    #[inline(always)]
    pub(super) fn push(&mut self, reading: Reading) {
        if self.ring.is_empty() {
            self.make_room();
        }
        if let Some(slot) = self.ring.get_mut(self.next) {
            *slot = reading;
        }
        self.next = (self.next + 1) % KEPT;
        self.held = (self.held + 1).min(KEPT);
    }

    #[cold]
    fn make_room(&mut self) {
        self.ring = alloc::vec![Reading::NONE; KEPT];
    }

    /// The readings from the newest to the oldest.
    pub(super) fn newest_first(&self) -> impl Iterator<Item = &Reading> {
        (1..=self.held).filter_map(|age| self.ring.get((self.next + KEPT - age) % KEPT))
    }

    /// The newest reading.
    pub(super) fn newest(&self) -> Option<&Reading> {
        self.newest_first().next()
    }
}

/// Written down with all its room, whether it is there or not.
mod written {
    use alloc::vec::Vec;

    use serde::{Deserializer, Serializer};

    use super::{KEPT, Reading};
    use crate::written::array;

    pub(super) fn serialize<S: Serializer>(ring: &[Reading], serializer: S) -> Result<S::Ok, S::Error> {
        let mut all = [Reading::NONE; KEPT];
        all.iter_mut().zip(ring).for_each(|(all, reading)| *all = *reading);
        array::serialize(&all, serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Reading>, D::Error> {
        array::deserialize::<D, Reading, KEPT>(deserializer).map(Vec::from)
    }
}
