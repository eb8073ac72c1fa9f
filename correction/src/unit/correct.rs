//! One tick through every model, in the order of the signal path.
//!
//! scale and bias per gyro (with the mode's sign) → perimeter-servo transient → four-step substitution → case axes;
//! accelerometers: bias, scale and board ratio → case axes.

mod accels;
mod gyros;
mod plain;
mod plan;

use alloc::sync::Arc;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use plain::Tick;
use plan::Plan;

use super::axes::Axes;
use super::counters::Counters;
use super::health::SensorHealth;
use super::release::Released;
use super::slew::Slew;
use super::thermal_memory::{ThermalMemory, Waiting};
use crate::calibration::Calibration;
use crate::drift::{DriftEstimator, DriftSettings};
use crate::observation::Observation;
use crate::orientation::{Inverse, Orientation, SensorMask};
use crate::reversal::Substitution;
use crate::sample::{
    AccelTick, CorrectedTick, GyroTick, MAX_PARITY, MAX_SENSORS, MIN_SENSORS, SensorFlags, Sensors, TickFlags,
};
use crate::servo::ServoMemory;
use crate::units::{Span, Timestamp};

/// What is presently subtracted from a unit's readings, in case axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Applied {
    /// Bias of the gyros (rad/s): all terms at the last tick, a subtracted drift included.
    pub angular_rate: [f64; 3],
    /// Bias of the accelerometers (m/s²); zero without accelerometers.
    pub specific_force: [f64; 3],
}

/// Running state of one unit under one calibration.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Corrector {
    pub(super) drift: DriftEstimator,
    pub(super) seen: Observation,
    pub(super) gyro_health: Sensors<SensorHealth>,
    pub(super) accel_health: Sensors<SensorHealth>,
    thermal: ThermalMemory,
    substitution: Substitution,
    servo: ServoMemory,
    /// Last good rate of each gyro (rad/s), standing in for a reading that is no number.
    last_rates: Sensors<f64>,
    /// Last good specific force of each accelerometer (m/s²), likewise.
    last_forces: Sensors<f64>,
    /// The swap that is being made over a time, and the share of what was before it at the present tick.
    slew: Option<Slew>,
    slew_share: f64,
    /// What plain ticks are corrected with: copied from the above.
    #[serde(skip)]
    plan: Plan,
}

/// When a corrector begins, as seen from the one before it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Takeover {
    /// End of the last tick.
    pub(super) now: Timestamp,
    /// Time since the unit was turned on (s).
    pub(super) since_turn_on_s: f64,
    /// Time over which the change is to be made.
    pub(super) slew: Span,
    /// What the drift estimator is to do.
    pub(super) drift: DriftSettings,
}

impl Corrector {
    /// Makes the state for a calibration; what still means the same under the new one is kept.
    pub(super) fn new(
        calibration: &Calibration,
        before: Option<(Arc<Calibration>, Self)>,
        takeover: Takeover,
    ) -> Self {
        let Takeover { now, slew, drift, .. } = takeover;
        let thermal =
            ThermalMemory::new(calibration, before.as_ref().map(|(old, c)| (old.as_ref(), &c.thermal)), now);
        let kept = before.filter(|(old, _)| {
            old.gyro_count() == calibration.gyro_count() && old.accel_count() == calibration.accel_count()
        });
        let drifts: Sensors<_> =
            (0..calibration.gyro_count()).map(|i| calibration.drift(i).copied()).collect();
        let fresh = |sensors| core::iter::repeat_n(SensorHealth::default(), sensors).collect();
        let mut new = Self {
            drift: DriftEstimator::new(&drifts, drift),
            seen: Observation::default(),
            gyro_health: fresh(calibration.gyro_count()),
            accel_health: fresh(calibration.accel_count()),
            thermal,
            substitution: Substitution::new(),
            servo: ServoMemory::new(),
            last_rates: core::iter::repeat_n(0.0, calibration.gyro_count()).collect(),
            last_forces: core::iter::repeat_n(0.0, calibration.accel_count()).collect(),
            slew: None,
            slew_share: 0.0,
            plan: Plan::default(),
        };
        if let Some((old_calibration, old)) = kept {
            let same_output = old_calibration.gyro_output == calibration.gyro_output
                && old_calibration.accel_output == calibration.accel_output;
            if slew > Span::ZERO && same_output {
                new.slew = Some(old.in_use(&old_calibration, takeover));
            }
            let same_basis = old_calibration.same_thermal_basis(calibration);
            let same_bias = |i| same_basis && old_calibration.gyros.get(i) == calibration.gyros.get(i);
            new.drift.carry(old.drift, same_bias);
            new.seen = old.seen;
            new.gyro_health = old.gyro_health;
            new.accel_health = old.accel_health;
            new.substitution = old.substitution;
            new.servo = old.servo;
            new.last_rates = old.last_rates;
            new.last_forces = old.last_forces;
        }
        new
    }

    /// Everything as it is in use at the end of the last tick, for a slew away from it.
    fn in_use(&self, calibration: &Calibration, takeover: Takeover) -> Slew {
        let Takeover { now, since_turn_on_s, slew: over, .. } = takeover;
        let gyros = calibration.gyros.iter().enumerate();
        // In the middle of a slew the axes are on their way too.
        let on_its_way =
            |now: Option<(SensorMask, Inverse)>, old: Option<(SensorMask, Inverse)>| match (now, old) {
                (Some((mask, new)), Some((same, old))) if mask == same && self.slew_share > 0.0 => {
                    Some((mask, new.lerp(&old, self.slew_share)))
                }
                _ => now,
            };
        let old = self.slew.as_ref();
        Slew {
            start: now,
            over,
            gyros: gyros.filter_map(|(i, model)| self.gyro_terms(i, model, now, since_turn_on_s)).collect(),
            accels: (0..calibration.accels.len()).filter_map(|i| self.accel_terms(i, now)).collect(),
            gyro_axes: on_its_way(self.thermal.gyro_axes.in_use(now), old.and_then(|slew| slew.gyro_axes)),
            accel_axes: on_its_way(
                self.thermal.accel_axes.as_ref().and_then(|axes| axes.in_use(now)),
                old.and_then(|slew| slew.accel_axes),
            ),
        }
    }

    /// The thermal memory, for reports.
    pub(super) fn thermal(&self) -> &ThermalMemory {
        &self.thermal
    }

    /// Corrects one tick, with its accelerometers', of a unit that was turned on at `turn_on`.
    pub(super) fn correct(
        &mut self,
        calibration: &Calibration,
        (released, accel): (&Released<'_>, Option<&AccelTick>),
        turn_on: Timestamp,
        (waiting, delay): (&mut Waiting, Span),
        counters: &mut Counters,
        out: &mut CorrectedTick,
    ) {
        let tick = released.tick;
        let since_turn_on_s = tick.end_time.seconds_from(turn_on);
        if released.plainly && !released.restart && !waiting.is_due(tick.end_time, delay) {
            let tick = Tick { released, accel, since_turn_on_s };
            if self.correct_plainly(calibration, &tick, out, counters) {
                return;
            }
        }
        if released.restart {
            self.thermal.restart(calibration);
            self.servo.reset();
            self.slew = None;
        }
        self.thermal.advance(calibration, waiting, delay, tick.end_time, counters);
        self.advance_drift(calibration, released);
        self.slew_share = self.slew.as_ref().map_or(0.0, |slew| slew.share(tick.end_time));
        if self.slew_share <= 0.0 {
            self.slew = None;
        }

        self.begin(released, out);
        self.gyros(calibration, released, since_turn_on_s, out, counters);
        self.accels(calibration, tick.end_time, accel, out, counters);
        self.note(released, out);
        self.drift.observe(&self.seen);
        let mut plan = core::mem::take(&mut self.plan);
        plan.gather(calibration, self);
        self.plan = plan;
    }

    /// Goes on with the drift estimate to the end of a tick.
    fn advance_drift(&mut self, calibration: &Calibration, released: &Released<'_>) {
        let (time, axes) = (released.tick.end_time, &self.thermal.gyro_axes);
        let project = |rate| calibration.gyro_orientation.forward(axes.temperature_deg_c(time), rate);
        self.drift.advance(time, released.restart, &project);
    }

    /// Begins the corrected tick with what is known of it before its readings.
    fn begin(&self, released: &Released<'_>, out: &mut CorrectedTick) {
        let tick = released.tick;
        out.sequence = tick.sequence;
        out.end_time = tick.end_time;
        out.duration = tick.duration;
        out.ticks = 1;
        out.mode = tick.mode;
        out.delta_velocity = [0.0; 3];
        out.gyro_parity.clear();
        out.accel_parity.clear();
        out.flags = TickFlags::empty();
        out.flags.set(TickFlags::WARM_UP, self.thermal.footings.warming_up);
    }

    /// Completes the observation of the tick.
    fn note(&mut self, released: &Released<'_>, out: &CorrectedTick) {
        let tick = released.tick;
        let per_second = 1.0 / tick.duration.as_s();
        let seen = &mut self.seen;
        seen.sequence = tick.sequence;
        seen.end_time = tick.end_time;
        seen.duration = tick.duration;
        seen.missed = released.missed;
        seen.mode = tick.mode;
        seen.angular_rate = out.delta_angle.map(|angle| angle * per_second);
        seen.flags = out.flags;
        seen.flags.set(TickFlags::RESTART, released.restart);
    }

    /// What is presently subtracted, in case axes.
    pub(super) fn applied(&self, calibration: &Calibration) -> Applied {
        let time = self.seen.end_time;
        let gyros = self.thermal.gyro_axes.in_use(time);
        let accels = self.thermal.accel_axes.as_ref().and_then(|axes| axes.in_use(time));
        let rates: Sensors<f64> = self.seen.gyros.iter().map(|gyro| gyro.bias + gyro.drift).collect();
        let forces: Sensors<f64> = (0..calibration.accels.len())
            .filter_map(|i| self.accel_terms(i, time))
            .map(|terms| terms.bias * terms.ratio * terms.per_scale_factor)
            .collect();
        Applied {
            angular_rate: gyros.map_or([0.0; 3], |(_, inverse)| inverse.apply(&rates)),
            specific_force: accels.map_or([0.0; 3], |(_, inverse)| inverse.apply(&forces)),
        }
    }
}

/// Gives a list one place per sensor; what stands in them is left, to be overwritten.
fn of_length<T: Copy + Default>(list: &mut Sensors<T>, sensors: usize) {
    if list.len() != sensors {
        *list = core::iter::repeat_n(T::default(), sensors.min(MAX_SENSORS)).collect();
    }
}

/// Watches the parity of readings, where there are more sensors than axes: what is left over, for the corrected tick. Whether a
/// sensor was excluded by it.
fn watch_parity(
    axes: &mut Axes,
    orientation: &Orientation,
    (mask, readings): (SensorMask, &[f64]),
    (parity, flags): (&mut ArrayVec<f64, MAX_PARITY>, &mut TickFlags),
    counters: &mut Counters,
) -> bool {
    if orientation.sensors() <= MIN_SENSORS {
        return false;
    }
    let verdict = axes.watch(orientation, mask, readings);
    *parity = verdict.residuals;
    if verdict.exceeded {
        *flags |= TickFlags::PARITY_EXCEEDED;
    }
    let excluded = verdict.exclude.is_some();
    counters.sensors_excluded += u64::from(excluded);
    excluded
}

/// Case axes from the usable sensors; where they are too few, from all that are not excluded, and not to be trusted.
fn resolve(
    axes: &mut Axes,
    orientation: &Orientation,
    mask: SensorMask,
    readings: &[f64],
    time: Timestamp,
) -> ([f64; 3], bool) {
    if let Some(vector) = axes.resolve(orientation, mask, readings, time) {
        return (vector, true);
    }
    let included = axes.included();
    (axes.resolve(orientation, included, readings, time).unwrap_or_default(), false)
}

/// The first three raw readings as they are, unscaled and flagged.
pub(super) fn pass_through(tick: &GyroTick, accel: Option<&AccelTick>) -> CorrectedTick {
    let first_three = |readings: &[f64]| {
        core::array::from_fn(|i| readings.get(i).copied().filter(|r| r.is_finite()).unwrap_or(0.0))
    };
    CorrectedTick {
        sequence: tick.sequence,
        end_time: tick.end_time,
        duration: tick.duration,
        ticks: 1,
        delta_angle: first_three(&tick.readings),
        delta_velocity: accel.map_or([0.0; 3], |accel| first_three(&accel.readings)),
        mode: tick.mode,
        flags: TickFlags::UNCALIBRATED
            | TickFlags::ANGLE_INVALID
            | TickFlags::VELOCITY_INVALID
            | if accel.is_none() { TickFlags::ACCELEROMETER_MISSING } else { TickFlags::empty() },
        gyro_flags: tick.readings.iter().map(|_| SensorFlags::empty()).collect(),
        accel_flags: accel
            .map_or_else(Sensors::new, |a| a.readings.iter().map(|_| SensorFlags::empty()).collect()),
        ..CorrectedTick::default()
    }
}
