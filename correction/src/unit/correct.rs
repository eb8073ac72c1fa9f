//! One tick through every model, sensor beside sensor, in the order of the signal path.
//!
//! scale and bias per gyro (with the mode's sign) → perimeter-servo transient → four-step substitution → delays → case axes;
//! accelerometers: bias, scale and board ratio → delays → case axes.
//!
//! Every tick goes this way. A sensor that cannot be taken as it stands is put right on its lane.

mod accels;
mod gyros;
mod held;
mod motion;
mod needs;
mod sigma;

use alloc::boxed::Box;
use alloc::sync::Arc;

use serde::{Deserialize, Serialize};

use super::counters::Counters;
use super::flags::Health;
use super::gyro_intake::Break;
use super::slew::{Slew, Slewing};
use super::thermal_memory::{ThermalMemory, Waiting};
use crate::calibration::Calibration;
use crate::drift::{DriftEstimator, DriftSettings, Reference};
use crate::lanes::Lanes;
use crate::observation::Observation;
use crate::orientation::{Inverse, SensorMask};
use crate::reversal::Substitution;
use crate::sample::{AccelTick, CorrectedTick, GyroTick, MAX_SENSORS, SensorFlags, Sensors, TickFlags};
use crate::servo::ServoMemory;
use crate::units::{Span, Timestamp};

pub(super) use motion::MotionInUse;
use motion::MotionMemory;
use needs::Needs;

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
    pub(super) gyro_health: Health,
    pub(super) accel_health: Health,
    thermal: ThermalMemory,
    motion: MotionMemory,
    substitution: Substitution,
    servo: ServoMemory,
    /// Last good rate of each gyro (rad/s), standing in for a reading that is no number.
    last_rates: Lanes,
    /// Last good specific force of each accelerometer (m/s²), likewise.
    last_forces: Lanes,
    /// The swap that is being made over a time, and the share of what was before it at the present tick.
    slew: Option<Box<Slew>>,
    slew_share: f64,
    /// What holds for the next ticks: no memory, only a shorter way.
    #[serde(skip)]
    calm: Calm,
}

/// What a tick finds as the last one did, until a temperature reading falls due or one is too old, the drift estimator moves on, a swap
/// does, or a new series begins.
#[derive(Debug, Clone, Copy, Default)]
struct Calm {
    /// Ticks that end later look for what has changed; all do without.
    until: Option<Timestamp>,
    /// Whether the temperatures have nothing to say of any gyro, of any accelerometer.
    sound: [bool; 2],
    needs: Needs,
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

/// A gyro tick with its accelerometers'.
#[derive(Debug, Clone, Copy)]
pub(super) struct Paired<'a> {
    pub(super) gyro: &'a GyroTick,
    pub(super) accel: Option<&'a AccelTick>,
    /// What lies between it and the last tick that was corrected.
    pub(super) before: Break,
    /// When the unit was turned on.
    pub(super) turn_on: Timestamp,
}

impl Corrector {
    /// Makes the state for a calibration; what still means the same under the new one is kept.
    pub(super) fn new(
        calibration: &Calibration,
        before: Option<(Arc<Calibration>, Self)>,
        takeover: Takeover,
    ) -> Self {
        let Takeover { now, slew, drift, .. } = takeover;
        let (gyros, accels) = (calibration.gyro_count(), calibration.accel_count());
        let old_thermal = before.as_ref().map(|(old, c)| (old.as_ref(), &c.thermal));
        let thermal = ThermalMemory::new(calibration, old_thermal, now);
        let drifts: Sensors<_> = (0..gyros).map(|i| calibration.drift(i).copied()).collect();
        let new = Self {
            drift: DriftEstimator::new(&drifts, drift),
            seen: Observation::default(),
            gyro_health: Health::new(gyros),
            accel_health: Health::new(accels),
            thermal,
            motion: MotionMemory::default(),
            substitution: Substitution::default(),
            servo: ServoMemory::default(),
            last_rates: [0.0; MAX_SENSORS],
            last_forces: [0.0; MAX_SENSORS],
            slew: None,
            slew_share: 0.0,
            calm: Calm::default(),
        };
        let Some((old_calibration, old)) =
            before.filter(|(old, _)| old.gyro_count() == gyros && old.accel_count() == accels)
        else {
            return new;
        };
        let same_output = old_calibration.gyro_output == calibration.gyro_output
            && old_calibration.accel_output == calibration.accel_output;
        let slew =
            (slew > Span::ZERO && same_output).then(|| Box::new(old.in_use(&old_calibration, takeover)));
        let same_basis = old_calibration.same_thermal_basis(calibration);
        let same_bias = |i| same_basis && old_calibration.terms_of_gyro(i) == calibration.terms_of_gyro(i);
        let Self { mut drift, thermal, .. } = new;
        drift.carry(old.drift, same_bias);
        Self { drift, thermal, slew, slew_share: 0.0, calm: Calm::default(), ..old }
    }

    /// Everything as it is in use at the end of the last tick, for a slew away from it.
    fn in_use(&self, calibration: &Calibration, takeover: Takeover) -> Slew {
        let Takeover { now, since_turn_on_s, slew: over, .. } = takeover;
        // In the middle of a slew the axes are on their way too.
        let on_its_way =
            |now: Option<(SensorMask, Inverse)>, old: Option<(SensorMask, Inverse)>| match (now, old) {
                (Some((mask, new)), Some((same, old))) if mask == same && self.slew_share > 0.0 => {
                    Some((mask, new.lerp(&old, self.slew_share)))
                }
                _ => now,
            };
        let old = self.slew.as_deref();
        let mut each = None;
        let shares = self.thermal.paces.shares(now, &mut each);
        let mut gyros = self.thermal.gyros.at(shares);
        self.special_terms(calibration, &mut gyros, since_turn_on_s);
        let (accels, boards) = self.accel_terms(shares);
        Slew {
            start: now,
            over,
            gyros,
            accels,
            boards,
            motion: self.motion_in_use(calibration, shares),
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

    /// Corrects one tick, with its accelerometers'; readings of `waiting` that fall due before its end take effect first. What is the
    /// same for a whole run stands in `out`.
    pub(super) fn correct(
        &mut self,
        calibration: &Calibration,
        tick: &Paired<'_>,
        (waiting, delay): (&mut Waiting, Span),
        counters: &mut Counters,
        out: &mut CorrectedTick,
    ) {
        let time = tick.gyro.end_time;
        if tick.before.restart || Some(time) > self.calm.until {
            self.renew(calibration, tick, (waiting, delay), counters);
        }
        // Four lanes fill two registers of every x86-64, and suffice for most units.
        if self.calm.needs.contains(Needs::WIDE) {
            self.correct_lanes::<MAX_SENSORS>(calibration, tick, counters, out);
        } else {
            self.correct_lanes::<4>(calibration, tick, counters, out);
        }
    }

    /// Does before a tick what few need: a new series begins, temperature readings or rate references take effect, a swap is on its
    /// way.
    #[cold]
    fn renew(
        &mut self,
        calibration: &Calibration,
        tick: &Paired<'_>,
        (waiting, delay): (&mut Waiting, Span),
        counters: &mut Counters,
    ) {
        let time = tick.gyro.end_time;
        if tick.before.restart {
            self.thermal.restart(calibration);
            self.servo.reset();
            self.motion.restart();
            self.slew = None;
        }
        if waiting.is_due(time, delay) {
            // No tick lasts no time: nothing was corrected yet.
            let goes_on = !tick.before.restart && self.seen.duration > Span::ZERO;
            let last_end = goes_on.then_some(self.seen.end_time);
            self.thermal.advance(calibration, waiting, delay, (last_end, time), counters);
        }
        self.drift.advance(time, tick.before.restart, &|rate| {
            calibration.gyro_orientation.forward(self.thermal.gyro_axes.temperature_deg_c(time), rate)
        });
        self.seen.gyros.temperature_deg_c = self.thermal.gyro_footing.temperature_deg_c;
        self.slew_share = self.slew.as_ref().map_or(0.0, |slew| slew.share(time));
        if self.slew_share <= 0.0 {
            self.slew = None;
        }
        if !self.drift.subtracts() {
            self.seen.gyros.drift = [0.0; MAX_SENSORS];
        }
        let sound = [&self.thermal.gyro_footing, &self.thermal.accel_footing].map(|it| it.sound_from(time));
        let due = sound.into_iter().flatten().fold(waiting.due_after(delay), Timestamp::min);
        self.calm = Calm {
            until: self.drift.rests_until().map(|rests| rests.min(due)).filter(|_| self.slew.is_none()),
            sound: sound.map(|until| until.is_some()),
            needs: self.needs(calibration),
        };
    }

    /// Takes a reference for the drift estimator; `at_rest`: one that the unit made itself. What is refused is counted.
    pub(super) fn refer(&mut self, reference: &Reference, at_rest: bool) {
        let _ = if at_rest { self.drift.submit_at_rest(reference) } else { self.drift.submit(reference) };
        self.disturb();
    }

    /// Has the next tick look for what has changed.
    pub(super) fn disturb(&mut self) {
        self.calm.until = None;
    }

    #[inline(always)]
    #[expect(clippy::inline_always, reason = "once for each width")]
    fn correct_lanes<const N: usize>(
        &mut self,
        calibration: &Calibration,
        tick: &Paired<'_>,
        counters: &mut Counters,
        out: &mut CorrectedTick,
    ) {
        let &Paired { gyro: raw, before: Break { missed, restart }, .. } = tick;
        out.sequence = raw.sequence;
        out.end_time = raw.end_time;
        out.duration = raw.duration;
        out.mode = raw.mode;
        let seen = &mut self.seen;
        seen.sequence = raw.sequence;
        seen.end_time = raw.end_time;
        seen.missed = missed;
        seen.mode = raw.mode;
        out.flags = if self.thermal.warming_up { TickFlags::WARM_UP } else { TickFlags::empty() };
        if let Some(held) = self.motion.held.as_mut().filter(|_| missed > 0) {
            held.interrupt();
        }
        let mut each = None;
        let shares = self.thermal.paces.shares(raw.end_time, &mut each);
        let felt = self.accels_feel::<N>(calibration, tick, shares, counters, out);
        let duration_s = raw.duration.as_s();
        self.gyros::<N>(calibration, (tick, duration_s), shares, counters, out);
        let per_second = 1.0 / duration_s;
        let seen = &mut self.seen;
        seen.duration = raw.duration;
        seen.angular_rate = out.delta_angle.map(|angle| angle * per_second);
        if let Some(felt) = felt {
            self.resolve_force(calibration, felt, counters, out);
        } else {
            out.delta_velocity = [0.0; 3];
            out.accel_parity.clear();
            (seen.specific_force, seen.accels.count) = (None, 0);
        }
        let seen = &mut self.seen;
        seen.flags = out.flags;
        if restart {
            seen.flags |= TickFlags::RESTART;
        }
        if self.calm.needs.contains(Needs::DRIFTS) {
            self.drift.add::<N>(&self.seen);
        }
    }

    /// A sensor was excluded: the flags of the next ticks say so.
    #[cold]
    fn exclude(&mut self, calibration: &Calibration, counters: &mut Counters) {
        counters.sensors_excluded += 1;
        self.thermal.note_footing(calibration);
        self.disturb();
    }

    /// The swap that is on its way at the present tick: mostly none, which is all that a tick asks.
    fn slewing(&self) -> Option<Slewing<'_>> {
        if self.slew.is_none() { None } else { self.slewing_from() }
    }

    #[cold]
    fn slewing_from(&self) -> Option<Slewing<'_>> {
        let slew = self.slew.as_deref().filter(|_| self.slew_share > 0.0);
        slew.map(|from| Slewing { from, share: self.slew_share })
    }

    /// What is presently subtracted, in case axes.
    pub(super) fn applied(&self, calibration: &Calibration) -> Applied {
        let time = self.seen.end_time;
        let gyros = self.thermal.gyro_axes.in_use(time);
        let accels = self.thermal.accel_axes.as_ref().and_then(|axes| axes.in_use(time));
        let rates: Sensors<f64> = self.seen.gyros.iter().map(|gyro| gyro.bias + gyro.drift).collect();
        let ([bias, per_scale_factor], [ratio]) =
            self.accel_terms::<MAX_SENSORS>(self.thermal.paces.shares(time, &mut None));
        let lanes = 0..calibration.accels.len();
        let forces: Sensors<f64> =
            lanes.map(|lane| bias[lane] * ratio[lane] * per_scale_factor[lane]).collect();
        Applied {
            angular_rate: gyros.map_or([0.0; 3], |(_, inverse)| inverse.apply(&rates)),
            specific_force: accels.map_or([0.0; 3], |(_, inverse)| inverse.apply(&forces)),
        }
    }
}

/// The flags of the sensors that there are.
fn of_sensors(flags: [SensorFlags; MAX_SENSORS], sensors: usize) -> Sensors<SensorFlags> {
    let mut flags = Sensors::from(flags);
    flags.truncate(sensors);
    flags
}

/// No sensor outside `usable` is used as read, whatever its own reading.
#[cold]
fn withdraw(flags: &mut Sensors<SensorFlags>, usable: SensorMask) {
    let unused = flags.iter_mut().enumerate().filter(|(lane, _)| !usable.contains(*lane));
    unused.for_each(|(_, flags)| *flags -= SensorFlags::VALID);
}

/// The first three raw readings as they are, unscaled and flagged.
pub(super) fn pass_through(tick: &GyroTick, accel: Option<&AccelTick>) -> CorrectedTick {
    let first_three = |readings: &[f64]| {
        core::array::from_fn(|i| readings.get(i).copied().filter(|r| r.is_finite()).unwrap_or(0.0))
    };
    CorrectedTick {
        sequence: tick.sequence,
        series: tick.series,
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
        gyro_flags: of_sensors([SensorFlags::empty(); MAX_SENSORS], tick.readings.len()),
        accel_flags: of_sensors(
            [SensorFlags::empty(); MAX_SENSORS],
            accel.map_or(0, |accel| accel.readings.len()),
        ),
        ..CorrectedTick::default()
    }
}
