//! What σ of an output is made from.

use super::Corrector;
use crate::calibration::Calibration;
use crate::orientation::Orientation;
use crate::sample::{CorrectedTick, MAX_SENSORS};
use crate::sigma::{Resolved, Sigma, SigmaMemory, SigmaModel, Watched};
use crate::unit::axes::Axes;
use crate::unit::flags::Footing;

impl Corrector {
    /// σ of the tick that was just corrected to `out`.
    #[cold]
    pub(in crate::unit) fn sigma(
        &self,
        memory: &mut SigmaMemory,
        (calibration, model): (&Calibration, &SigmaModel),
        out: &CorrectedTick,
        since_turn_on_s: f64,
    ) -> Sigma {
        let resolved = |orientation, axes: &Axes, footing| -> Resolved<'_> {
            let (orientation, footing): (&Orientation, &Footing) = (orientation, footing);
            Resolved {
                sensors: orientation.sensors(),
                rows: orientation.rows_at(axes.temperature_deg_c(out.end_time)),
                inverse: axes.in_use(out.end_time).map(|(_, inverse)| inverse),
                clamped: axes.clamped(),
                temperature_deg_c: &footing.temperature_deg_c,
            }
        };
        let thermal = &self.thermal;
        let accels = calibration.accel_orientation.as_ref().zip(thermal.accel_axes.as_ref());
        let mut drift_sigma = [f64::NAN; MAX_SENSORS];
        if self.drift.subtracts() {
            for (to, estimate) in drift_sigma.iter_mut().zip(self.drift.estimates()) {
                *to = estimate.map_or(f64::NAN, |estimate| estimate.sigma);
            }
        }
        let (own_flags, held_back_ticks) = self.gyros_held_back(calibration, out.flags);
        let watched = Watched {
            calibration,
            seen: &self.seen,
            out,
            own_flags,
            held_back_ticks,
            substitution: &self.substitution,
            since_turn_on_s,
            gyros: resolved(&calibration.gyro_orientation, &thermal.gyro_axes, &thermal.gyro_footing),
            accels: accels.map(|(orientation, axes)| resolved(orientation, axes, &thermal.accel_footing)),
            drift_sigma,
        };
        memory.of(model, &watched)
    }
}
