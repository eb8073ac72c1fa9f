//! What follows the unit's motion: drift with acceleration, weights that depend on the rate, squares of forces, and accelerometers
//! away from the reference point (models §2, §3).

use alloc::boxed::Box;
use core::array;

use serde::{Deserialize, Serialize};

use super::Corrector;
use super::held::HeldBack;
use super::needs::Needs;
use crate::calibration::Calibration;
use crate::lanes::{Lanes, narrow};
use crate::orientation::{Orientation, SensorMask, sum_of_columns};
use crate::sample::{CorrectedTick, MAX_SENSORS, TickFlags};
use crate::thermal::{Bank, Motion, Shares};
use crate::unit::slew::between;
use crate::units::Timestamp;
use crate::vector::{minus, plus};

/// Place of the asymmetry among the lines of a gyro's terms that follow motion.
pub(super) const ASYMMETRY: usize = 3;

/// What was in use when a swap took effect, for a slew away from it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in crate::unit) struct MotionInUse {
    pub(super) motion: Motion,
    gyros: [Lanes; 4],
    accels: [Lanes; 1],
}

/// Motion of the last ticks, in case axes.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct MotionMemory {
    /// Last specific force to be trusted (m/s²).
    force: [f64; 3],
    /// Angular rate of the last tick without a gap (rad/s), with the middle of the tick.
    rate: Option<([f64; 3], Timestamp)>,
    /// Its slope from the one before (rad/s²), and the time between them (s).
    slope: Option<([f64; 3], f64)>,
    /// What is held back; `None` where nothing is.
    pub(super) held: Option<Box<HeldBack>>,
}

impl MotionMemory {
    /// Angular acceleration at the middle of the tick (rad/s²), from its rate and those of up to two ticks before it: the slope of the
    /// parabola through the three, of the line through two, zero without.
    ///
    /// With equal ticks it is (3ω₀ − 4ω₁ + ω₂)/2Δt: white noise of the rate of standard deviation σ gives it √26/2 ≈ 2.55 σ/Δt.
    fn acceleration(&mut self, rate: [f64; 3], middle: Timestamp) -> [f64; 3] {
        let Some((last, before)) = self.rate.replace((rate, middle)) else { return [0.0; 3] };
        let over_s = middle.seconds_from(before);
        let here = minus(rate, last).map(|step| step / over_s);
        let Some((there, before_s)) = self.slope.replace((here, over_s)) else { return here };
        plus(here, minus(here, there).map(|bend| bend * over_s / (over_s + before_s)))
    }

    /// Forgets rates: what comes next does not follow them without a gap.
    fn interrupt(&mut self) {
        (self.rate, self.slope) = (None, None);
    }

    /// Forgets what came before: another series begins.
    pub(super) fn restart(&mut self) {
        self.interrupt();
        self.held = None;
    }
}

impl Corrector {
    /// What is in use, for a slew away from it; `None` where it is nothing.
    pub(super) fn motion_in_use(&self, calibration: &Calibration, shares: Shares<'_>) -> Option<MotionInUse> {
        let motion = calibration.motion.as_deref().or(self.slew_from_motion().map(|old| &old.motion))?;
        let (gyros, accels) = (self.gyro_motion(shares), self.accel_motion(shares));
        Some(MotionInUse { motion: motion.clone(), gyros, accels })
    }

    pub(super) fn slew_from_motion(&self) -> Option<&MotionInUse> {
        self.slewing().and_then(|slewing| slewing.from.motion.as_ref())
    }

    /// Coefficients of the gyros' terms that follow motion.
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    #[inline(always)]
    fn gyro_motion<const N: usize>(&self, shares: Shares<'_>) -> [[f64; N]; 4] {
        let bank = self.thermal.motion.as_deref().map(|banks| &banks.gyros);
        self.coefficients(bank, self.slew_from_motion().map(|old| &old.gyros), shares)
    }

    /// Coefficients of the accelerometers' terms that follow motion.
    fn accel_motion<const N: usize>(&self, shares: Shares<'_>) -> [[f64; N]; 1] {
        let bank = self.thermal.motion.as_deref().map(|banks| &banks.accels);
        self.coefficients(bank, self.slew_from_motion().map(|old| &old.accels), shares)
    }

    /// Coefficients of a bank, on their way from the old ones; zero where there are none.
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    #[inline(always)]
    fn coefficients<const N: usize, const T: usize>(
        &self,
        bank: Option<&Bank<T>>,
        old: Option<&[Lanes; T]>,
        shares: Shares<'_>,
    ) -> [[f64; N]; T] {
        // Not `map_or`, which would be a call.
        let terms = if let Some(bank) = bank { bank.at(shares) } else { [[0.0; N]; T] };
        let Some(slewing) = self.slewing() else { return terms };
        // A copy: lanes of which nobody has the address stay in registers.
        let mut slewed = terms;
        slewing.terms(&mut slewed, old.unwrap_or(&[[0.0; MAX_SENSORS]; T]));
        slewed
    }

    /// A number of each sensor, on its way from the old one.
    pub(super) fn on_its_way<const N: usize>(
        &self,
        calibration: &Calibration,
        of: impl Fn(&Motion) -> &Lanes,
    ) -> [f64; N] {
        let lanes = |motion: Option<&Motion>| motion.map_or([0.0; N], |motion| *narrow(of(motion)));
        let new = lanes(calibration.motion.as_deref());
        self.slewing().map_or(new, |slewing| {
            let old = lanes(slewing.from.motion.as_ref().map(|old| &old.motion));
            array::from_fn(|lane| between(new[lane], old[lane], slewing.share))
        })
    }

    /// Drift of the gyros with the specific force (rad/s).
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    #[inline(always)]
    pub(super) fn drift_with_force<const N: usize>(&self, shares: Shares<'_>) -> [f64; N] {
        let mut drift = [0.0; N];
        for (along, force) in self.gyro_motion::<N>(shares).iter().zip(self.motion.force) {
            drift = array::from_fn(|lane| drift[lane] + along[lane] * force);
        }
        drift
    }

    /// Takes from the gyros' drift (rad/s) what their weights miss at the rates that they read (rad/s), before any bias is subtracted. Gives
    /// the gyros whose rate is outside the range of its curve.
    #[inline(never)]
    pub(super) fn weigh_over_rate<const N: usize>(
        &self,
        calibration: &Calibration,
        shares: Shares<'_>,
        rates: &[f64; N],
        drift: &mut [f64; N],
    ) -> SensorMask {
        let asymmetry = self.gyro_motion::<N>(shares)[ASYMMETRY];
        let (mut clamped, mut errors) = (SensorMask::NONE, [0.0; N]);
        if self.calm.needs.contains(Needs::CURVES) {
            clamped = self.errors_over_rate(calibration, rates, &mut errors);
        }
        *drift = array::from_fn(|lane| {
            let rate = rates[lane];
            drift[lane] - asymmetry[lane] * rate.abs() - errors[lane] * rate
        });
        clamped
    }

    /// Relative errors of the gyros' weights at their rates (rad/s), and the gyros whose rate is outside the range of its curve.
    fn errors_over_rate<const N: usize>(
        &self,
        calibration: &Calibration,
        rates: &[f64; N],
        errors: &mut [f64; N],
    ) -> SensorMask {
        let mut clamped = SensorMask::NONE;
        for (lane, (rate, error)) in rates.iter().zip(errors).enumerate().take(calibration.gyros.len()) {
            let over_rate = |motion: Option<&Motion>| {
                motion?.gyros.get(lane)?.over_rate.as_ref().map(|curve| curve.at(*rate))
            };
            let here = over_rate(calibration.motion.as_deref());
            clamped = clamped.set(lane, here.is_some_and(|error| error.clamped));
            let new = here.map_or(0.0, |error| error.value);
            *error = self.slewing().map_or(new, |slewing| {
                let old = over_rate(slewing.from.motion.as_ref().map(|old| &old.motion));
                between(new, old.map_or(0.0, |error| error.value), slewing.share)
            });
        }
        clamped
    }

    /// Notes the specific force of a tick in case axes, from what the usable accelerometers feel (m/s²), for the gyros that drift with it; where
    /// it is not to be had, the last one stands. Gives the inverse of the axes, where that is of all accelerometers.
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    #[inline(always)]
    pub(super) fn note_force<const N: usize>(
        &mut self,
        orientation: &Orientation,
        (forces, usable): ([f64; N], SensorMask),
        time: Timestamp,
    ) -> Option<[[f64; 4]; N]> {
        let axes = self.thermal.accel_axes.as_mut()?;
        let whole = if usable == axes.included() { axes.inverse(time) } else { None };
        let Some(inverse) = whole else {
            let felt = forces;
            if let (force, true) = axes.resolve_some(orientation, usable, &felt, time) {
                self.motion.force = force;
            }
            return None;
        };
        self.motion.force = sum_of_columns(&inverse, &forces);
        Some(inverse)
    }

    /// Takes second-order terms out of the forces that the accelerometers feel (m/s²): m = f + K2·f² has the solution
    /// f = 2m/(1 + √(1 + 4·K2·m)) next to m.
    #[inline(never)]
    pub(super) fn remove_squares<const N: usize>(&self, shares: Shares<'_>, forces: &mut [f64; N]) {
        let [second_order] = self.accel_motion::<N>(shares);
        for (force, second_order) in forces.iter_mut().zip(second_order) {
            let root = libm::sqrt((1.0 + 4.0 * second_order * *force).max(0.0));
            *force = 2.0 * *force / (1.0 + root);
        }
    }

    /// Takes out what accelerometers feel for sitting elsewhere: ω × (ω × r) + α × r along the input axis.
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    #[inline(always)]
    pub(super) fn remove_size_effect<const N: usize>(
        &mut self,
        calibration: &Calibration,
        orientation: &Orientation,
        out: &CorrectedTick,
        forces: [f64; N],
    ) -> [f64; N] {
        let (rate, acceleration) = self.turning(out);
        let slewed;
        let positions = if let (None, Some(motion)) = (self.slewing(), calibration.motion.as_deref()) {
            &motion.positions_m
        } else {
            slewed = self.positions_on_their_way(calibration);
            &slewed
        };
        let Some(axes) = &self.thermal.accel_axes else { return forces };
        let axes = orientation.axes_at(axes.temperature_deg_c(out.end_time));
        let at = positions.each_ref().map(narrow::<N>);
        let of_place = acceleration_by_place(rate, acceleration);
        let [x, y, z]: [[f64; N]; 3] = [0, 1, 2].map(|axis: usize| {
            let [by_x, by_y, by_z] = of_place[axis];
            array::from_fn(|lane| {
                axes(axis, lane) * (by_x * at[0][lane] + by_y * at[1][lane] + by_z * at[2][lane])
            })
        });
        array::from_fn(|lane| forces[lane] - (x[lane] + y[lane] + z[lane]))
    }

    /// Where the accelerometers sit, axis by axis (m), in the middle of a swap.
    #[cold]
    fn positions_on_their_way(&self, calibration: &Calibration) -> [Lanes; 3] {
        [0, 1, 2].map(|axis| self.on_its_way(calibration, |motion| &motion.positions_m[axis]))
    }

    /// Angular rate (rad/s) and acceleration (rad/s²) of a tick, in case axes. A tick that carries the restored angle of a mode switch
    /// turns as the one before it.
    #[inline]
    fn turning(&mut self, out: &CorrectedTick) -> ([f64; 3], [f64; 3]) {
        if self.seen.missed > 0 {
            self.motion.interrupt();
        }
        if out.flags.intersects(TickFlags::ANGLE_RESTORED | TickFlags::ANGLE_INVALID) {
            let rate = self.motion.rate.map_or([0.0; 3], |(rate, _)| rate);
            self.motion.interrupt();
            return (rate, [0.0; 3]);
        }
        let (rate, middle) = (self.seen.angular_rate, out.end_time - out.duration.half());
        (rate, self.motion.acceleration(rate, middle))
    }
}

/// ω × (ω × r) + α × r as a matrix on r (1/s²), from angular rate (rad/s) and acceleration (rad/s²).
#[inline]
fn acceleration_by_place([x, y, z]: [f64; 3], [ax, ay, az]: [f64; 3]) -> [[f64; 3]; 3] {
    [
        [-(y * y + z * z), x * y - az, x * z + ay],
        [x * y + az, -(x * x + z * z), y * z - ax],
        [x * z - ay, y * z + ax, -(x * x + y * y)],
    ]
}
