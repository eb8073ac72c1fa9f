//! A swap that is made over a stated time: away from the terms that were in use, which stand still, to the new ones.

use serde::{Deserialize, Serialize};

use crate::orientation::{Inverse, SensorMask};
use crate::sample::Sensors;
use crate::thermal::{AccelTerms, GyroTerms};
use crate::units::{Span, Timestamp};

/// What was in use when the swap took effect.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Slew {
    /// End of the last tick under the old calibration.
    pub(super) start: Timestamp,
    /// Time over which the change is made.
    pub(super) over: Span,
    /// Terms of each gyro, its trend in the bias.
    pub(super) gyros: Sensors<GyroTerms>,
    /// Terms of each accelerometer.
    pub(super) accels: Sensors<AccelTerms>,
    /// Sensors and inverse that gave case axes from the gyros.
    pub(super) gyro_axes: Option<(SensorMask, Inverse)>,
    /// Likewise from the accelerometers.
    pub(super) accel_axes: Option<(SensorMask, Inverse)>,
}

impl Slew {
    /// Share of the old terms at `time`: 1 at the start, 0 from the end on.
    pub(super) fn share(&self, time: Timestamp) -> f64 {
        if self.over == Span::ZERO {
            return 0.0;
        }
        1.0 - (time.seconds_from(self.start) / self.over.as_s()).clamp(0.0, 1.0)
    }

    /// The terms of a gyro, on their way to `new`.
    pub(super) fn gyro(&self, index: usize, new: GyroTerms, share: f64) -> GyroTerms {
        let Some(old) = self.gyros.get(index) else { return new };
        GyroTerms {
            increment_weight: between(new.increment_weight, old.increment_weight, share),
            bias: between(new.bias, old.bias, share),
            magnetic: between(new.magnetic, old.magnetic, share),
            meander: between(new.meander, old.meander, share),
        }
    }

    /// The terms of an accelerometer, on their way to `new`.
    pub(super) fn accel(&self, index: usize, new: AccelTerms, share: f64) -> AccelTerms {
        let Some(old) = self.accels.get(index) else { return new };
        AccelTerms {
            bias: between(new.bias, old.bias, share),
            per_scale_factor: between(new.per_scale_factor, old.per_scale_factor, share),
            ratio: between(new.ratio, old.ratio, share),
        }
    }
}

/// Case axes on their way from what the old inverse of the same sensors gives; where the sensors differ, there is no way.
pub(super) fn axes(
    new: [f64; 3],
    old: Option<&(SensorMask, Inverse)>,
    mask: SensorMask,
    readings: &[f64],
    share: f64,
) -> [f64; 3] {
    match old {
        Some((old_mask, inverse)) if share > 0.0 && *old_mask == mask => {
            let mut axes = new;
            axes.iter_mut()
                .zip(inverse.apply(readings))
                .for_each(|(axis, old)| *axis = between(*axis, old, share));
            axes
        }
        _ => new,
    }
}

/// `new` where `share` of the old is 0, `old` where it is 1.
fn between(new: f64, old: f64, share: f64) -> f64 {
    new + (old - new) * share
}
