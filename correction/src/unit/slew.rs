//! A swap that is made over a stated time: away from the terms that were in use, which stand still, to the new ones.

use serde::{Deserialize, Serialize};

use super::correct::MotionInUse;
use crate::lanes::{Lanes, narrow};
use crate::orientation::{Inverse, SensorMask};
use crate::units::{Span, Timestamp};

/// What was in use when the swap took effect.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Slew {
    /// End of the last tick under the old calibration.
    pub(super) start: Timestamp,
    /// Time over which the change is made.
    pub(super) over: Span,
    /// Terms of the gyros, the trend in the bias.
    pub(super) gyros: [Lanes; 4],
    /// Terms of the accelerometers, and of their boards.
    pub(super) accels: [Lanes; 2],
    pub(super) boards: [Lanes; 1],
    /// What followed motion; `None` where nothing did.
    pub(super) motion: Option<MotionInUse>,
    /// Sensors and inverse that gave case axes from the gyros.
    pub(super) gyro_axes: Option<(SensorMask, Inverse)>,
    /// Likewise from the accelerometers.
    pub(super) accel_axes: Option<(SensorMask, Inverse)>,
}

/// A swap on its way, at one tick.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slewing<'a> {
    pub(super) from: &'a Slew,
    /// Share of what was before the swap, above 0.
    pub(super) share: f64,
}

impl Slew {
    /// Share of the old terms at `time`: 1 at the start, 0 from the end on.
    pub(super) fn share(&self, time: Timestamp) -> f64 {
        if self.over == Span::ZERO {
            return 0.0;
        }
        1.0 - (time.seconds_from(self.start) / self.over.as_s()).clamp(0.0, 1.0)
    }
}

impl Slewing<'_> {
    /// Terms on their way from the old ones.
    pub(super) fn terms<const N: usize, const T: usize>(&self, new: &mut [[f64; N]; T], old: &[Lanes; T]) {
        for (new, old) in new.iter_mut().zip(old) {
            new.iter_mut()
                .zip(narrow::<N>(old))
                .for_each(|(new, old)| *new = between(*new, *old, self.share));
        }
    }

    /// Case axes on their way from what the old inverse of the same sensors gives; where the sensors differ, there is no way.
    pub(super) fn axes(
        &self,
        new: [f64; 3],
        old: Option<&(SensorMask, Inverse)>,
        mask: SensorMask,
        readings: &[f64],
    ) -> [f64; 3] {
        let mut axes = new;
        if let Some((_, inverse)) = old.filter(|(old_mask, _)| *old_mask == mask) {
            let old = inverse.apply(readings);
            axes.iter_mut().zip(old).for_each(|(axis, old)| *axis = between(*axis, old, self.share));
        }
        axes
    }
}

/// `new` where `share` of the old is 0, `old` where it is 1.
pub(super) fn between(new: f64, old: f64, share: f64) -> f64 {
    new + (old - new) * share
}
