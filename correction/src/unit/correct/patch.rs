//! Sensors that cannot be taken as they stand in a tick, put right on their lanes.

use crate::lanes::Lanes;
use crate::orientation::SensorMask;
use crate::sample::{MAX_SENSORS, SensorFlags};
use crate::unit::counters::Counters;
use crate::unit::footing::Footing;
use crate::units::Timestamp;

/// A reading that does not count as it stands.
const UNSOUND: SensorFlags =
    SensorFlags::OVERRANGE.union(SensorFlags::NOT_FINITE).union(SensorFlags::EXCLUDED);

/// Flags of the sensors in a tick with nothing to say of any.
pub(super) const SOUND: [SensorFlags; MAX_SENSORS] = [SensorFlags::VALID; MAX_SENSORS];

/// Whether every reading is a number below its sensor's limit.
#[inline]
pub(super) fn within<const N: usize>(readings: &[f64; N], limits: &[f64; N]) -> bool {
    readings.iter().zip(limits).fold(true, |sound, (reading, limit)| sound & (reading.abs() < *limit))
}

/// What is to be patched, of the first `count` lanes.
pub(super) struct Patch<'a> {
    pub(super) count: usize,
    pub(super) readings: &'a [f64],
    pub(super) limits: &'a Lanes,
    pub(super) footing: &'a Footing,
    pub(super) time: Timestamp,
}

impl Patch<'_> {
    /// Flags of each sensor by its reading and its temperatures; takes those whose reading does not count out of `usable`.
    ///
    /// `patch` puts a lane right: it gets the reading at the limit that it is beyond, or `None` where it is no number.
    pub(super) fn apply(
        &self,
        usable: &mut SensorMask,
        counters: &mut Counters,
        mut patch: impl FnMut(usize, Option<f64>),
    ) -> [SensorFlags; MAX_SENSORS] {
        let mut all = self.footing_flags();
        let readings = self.readings.iter().zip(self.limits).take(self.count);
        for (lane, ((reading, limit), flags)) in readings.zip(&mut all).enumerate() {
            if !reading.is_finite() {
                *flags |= SensorFlags::NOT_FINITE;
                counters.not_finite_readings += 1;
                patch(lane, None);
            } else if reading.abs() >= *limit {
                *flags |= SensorFlags::OVERRANGE;
                counters.overrange_readings += 1;
                // Beyond its limit a reading says no more than the limit, and stays finite whatever it is.
                patch(lane, Some(reading.clamp(-limit, *limit)));
            }
            if flags.intersects(SensorFlags::OVERRANGE | SensorFlags::NOT_FINITE) {
                *usable = usable.without(lane);
            }
            if flags.intersects(UNSOUND) {
                *flags -= SensorFlags::VALID;
            }
        }
        all
    }

    /// Flags of each sensor in a tick whose readings are nothing to go by.
    pub(super) fn lost(&self) -> [SensorFlags; MAX_SENSORS] {
        self.footing_flags().map(|flags| flags - SensorFlags::VALID)
    }

    fn footing_flags(&self) -> [SensorFlags; MAX_SENSORS] {
        core::array::from_fn(|lane| self.footing.flags(lane, self.time))
    }
}
