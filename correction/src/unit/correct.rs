//! One tick through every model, in the order of the signal path.
//!
//! scale and bias per gyro (with the mode's sign) → perimeter-servo transient → four-step substitution → case axes;
//! accelerometers: bias, scale and board ratio → case axes.

use alloc::sync::Arc;

use super::axes::Axes;
use super::counters::Counters;
use super::gyro_intake::Released;
use super::thermal_memory::{ThermalMemory, Waiting};
use crate::calibration::Calibration;
use crate::orientation::{Orientation, SensorMask};
use crate::reversal::{Substitution, TickInput};
use crate::sample::{
    AccelTick, CorrectedTick, GyroTick, LasingMode, MIN_SENSORS, OutputKind, SensorFlags, Sensors, TickFlags,
};
use crate::servo::{ServoMemory, ServoTick, Transient};
use crate::units::{Span, Timestamp};

/// Running state of one unit under one calibration.
#[derive(Debug)]
pub(super) struct Corrector {
    thermal: ThermalMemory,
    substitution: Substitution,
    servo: ServoMemory,
    /// Last good rate of each gyro (rad/s), standing in for a reading that is no number.
    last_rates: Sensors<f64>,
    /// Last good specific force of each accelerometer (m/s²), likewise.
    last_forces: Sensors<f64>,
}

impl Corrector {
    /// Makes the state for a calibration; what still means the same under the new one is kept.
    pub(super) fn new(
        calibration: &Calibration,
        before: Option<(Arc<Calibration>, Self)>,
        now: Timestamp,
    ) -> Self {
        let thermal =
            ThermalMemory::new(calibration, before.as_ref().map(|(old, c)| (old.as_ref(), &c.thermal)), now);
        let kept = before.filter(|(old, _)| {
            old.gyro_count() == calibration.gyro_count() && old.accel_count() == calibration.accel_count()
        });
        let mut new = Self {
            thermal,
            substitution: Substitution::new(),
            servo: ServoMemory::new(),
            last_rates: core::iter::repeat_n(0.0, calibration.gyro_count()).collect(),
            last_forces: core::iter::repeat_n(0.0, calibration.accel_count()).collect(),
        };
        if let Some((_, old)) = kept {
            new.substitution = old.substitution;
            new.servo = old.servo;
            new.last_rates = old.last_rates;
            new.last_forces = old.last_forces;
        }
        new
    }

    /// The thermal memory, for reports.
    pub(super) fn thermal(&self) -> &ThermalMemory {
        &self.thermal
    }

    /// Corrects one tick of a unit that was turned on at `turn_on`.
    pub(super) fn correct(
        &mut self,
        calibration: &Calibration,
        released: &Released,
        turn_on: Timestamp,
        accel: Option<&AccelTick>,
        (waiting, delay): (&mut Waiting, Span),
        counters: &mut Counters,
    ) -> CorrectedTick {
        let tick = &released.tick;
        if released.restart {
            self.thermal.restart();
            self.servo.reset();
        }
        self.thermal.advance(calibration, waiting, delay, tick.end_time, counters);

        let mut out = CorrectedTick {
            sequence: tick.sequence,
            end_time: tick.end_time,
            duration: tick.duration,
            ticks: 1,
            mode: tick.mode,
            ..CorrectedTick::default()
        };
        if self.thermal.warming_up(calibration) {
            out.flags |= TickFlags::WARM_UP;
        }
        self.gyros(calibration, released, tick.end_time.seconds_from(turn_on), &mut out, counters);
        self.accels(calibration, tick.end_time, accel, &mut out, counters);
        out
    }

    fn gyros(
        &mut self,
        calibration: &Calibration,
        released: &Released,
        since_turn_on_s: f64,
        out: &mut CorrectedTick,
        counters: &mut Counters,
    ) {
        let tick = &released.tick;
        let duration_s = tick.duration.as_s();
        let input = TickInput {
            end_time: tick.end_time,
            duration: tick.duration,
            mode: tick.mode,
            switch_command: tick.switch_command,
            missed: released.missed,
            restart: released.restart,
        };
        let lost = calibration.reversal.as_ref().is_some_and(|r| self.substitution.is_lost(r, &input));
        self.servo.advance(lost, tick.end_time, tick.duration);

        let mut mask = self.thermal.gyro_axes.included(&calibration.gyro_orientation);
        let mut increments = Sensors::<f64>::new();
        for (i, (model, thermal)) in calibration.gyros.iter().zip(&self.thermal.gyros).enumerate() {
            let terms = thermal.at(tick.end_time);
            let trend = model.trend.as_ref().map_or(0.0, |trend| trend.at(since_turn_on_s));
            let sign = tick.mode.map_or(1.0, LasingMode::sign);
            let phase = tick.meander.map_or(1.0, LasingMode::sign);
            let mut bias = terms.bias + trend + sign * terms.magnetic + phase * terms.meander;
            if let (Some(servo), false) = (&model.servo, lost) {
                let servo_tick = ServoTick {
                    end_time: tick.end_time,
                    duration: tick.duration,
                    temperature_deg_c: self.thermal.temperature(calibration, model.channel),
                    scale_rad_per_count: terms.increment_weight,
                    half_periods: tick.half_periods.get(i).copied(),
                };
                match self.servo.apparent_rate(i, servo, &servo_tick) {
                    Transient::Settled => {}
                    Transient::Apparent { rate_rad_per_s } => {
                        bias += rate_rad_per_s;
                        out.flags |= TickFlags::SERVO_TRANSIENT;
                    }
                    Transient::Unmeasured => out.flags |= TickFlags::SERVO_UNMEASURED,
                }
            }
            let mut flags = SensorFlags::VALID;
            let clamped = thermal.clamped() || self.thermal.gyro_axes.clamped();
            flags.set(SensorFlags::CLAMPED_TEMPERATURE, clamped);
            flags.set(
                SensorFlags::STALE_TEMPERATURE,
                self.thermal.stale(calibration, model.channel, tick.end_time),
            );
            flags.set(SensorFlags::EXCLUDED, self.thermal.gyro_axes.is_excluded(i));

            let reading = tick.readings.get(i).copied().unwrap_or(f64::NAN);
            let last_rate = self.last_rates.get(i).copied().unwrap_or(0.0);
            let increment = if lost {
                0.0
            } else if reading.is_finite() {
                if reading.abs() >= model.input_limit {
                    flags |= SensorFlags::OVERRANGE;
                    counters.overrange_readings += 1;
                }
                // Beyond its limit a reading says no more than the limit, and stays finite whatever it is.
                let reading = reading.clamp(-model.input_limit, model.input_limit);
                scaled(calibration.gyro_output, reading, terms.increment_weight, duration_s)
                    - bias * duration_s
            } else {
                flags |= SensorFlags::NOT_FINITE;
                counters.not_finite_readings += 1;
                last_rate * duration_s
            };
            if lost
                || flags.intersects(SensorFlags::OVERRANGE | SensorFlags::NOT_FINITE | SensorFlags::EXCLUDED)
            {
                flags -= SensorFlags::VALID;
            }
            if flags.intersects(SensorFlags::OVERRANGE | SensorFlags::NOT_FINITE) {
                mask = mask.without(i);
            }
            increments.push(increment);
            out.gyro_flags.push(flags);
        }

        // Before the substitution: the angle that it restores is a lump, not a rate.
        let rates: Sensors<f64> = increments.iter().map(|increment| increment / duration_s).collect();
        for ((last, rate), flags) in self.last_rates.iter_mut().zip(&rates).zip(&out.gyro_flags) {
            if flags.contains(SensorFlags::VALID) {
                *last = *rate;
            }
        }
        match &calibration.reversal {
            Some(reversal) => out.flags |= self.substitution.tick(reversal, input, &mut increments),
            // A swap took the substitution away in the middle of a transition.
            None if !self.substitution.is_settled() => {
                self.substitution = Substitution::new();
                out.flags |= TickFlags::SWITCH_UNRESOLVED;
            }
            None => {}
        }
        count_switch_flags(out.flags, counters);
        let interpolated = out.flags.contains(TickFlags::INTERPOLATED);

        let orientation = &calibration.gyro_orientation;
        let axes = &mut self.thermal.gyro_axes;
        if orientation.sensors() > MIN_SENSORS && !interpolated {
            let verdict = axes.watch(orientation, mask, &rates);
            out.gyro_parity = verdict.residuals;
            out.flags.set(TickFlags::PARITY_EXCEEDED, verdict.exceeded);
            counters.sensors_excluded += u64::from(verdict.exclude.is_some());
        }
        let (angle, trusted) = resolve(axes, orientation, mask, &increments, tick.end_time);
        out.delta_angle = angle;
        out.flags.set(TickFlags::ANGLE_INVALID, !trusted);
    }

    fn accels(
        &mut self,
        calibration: &Calibration,
        time: Timestamp,
        accel: Option<&AccelTick>,
        out: &mut CorrectedTick,
        counters: &mut Counters,
    ) {
        let Some(orientation) = &calibration.accel_orientation else { return };
        let Some(tick) = accel else {
            out.flags |= TickFlags::ACCELEROMETER_MISSING | TickFlags::VELOCITY_INVALID;
            out.accel_flags.extend(core::iter::repeat_n(SensorFlags::empty(), calibration.accel_count()));
            counters.accel_missing += 1;
            return;
        };
        let duration_s = tick.duration.as_s();
        let Some(axes) = &self.thermal.accel_axes else { return };
        let mut mask = axes.included(orientation);
        let mut forces = Sensors::<f64>::new();
        for (i, (model, thermal)) in calibration.accels.iter().zip(&self.thermal.accels).enumerate() {
            let stale = self.thermal.stale(calibration, model.channel, time)
                || self.thermal.stale(calibration, model.board_channel, time);
            let mut flags = SensorFlags::VALID;
            flags.set(SensorFlags::CLAMPED_TEMPERATURE, thermal.clamped() || axes.clamped());
            flags.set(SensorFlags::STALE_TEMPERATURE, stale);
            flags.set(SensorFlags::EXCLUDED, axes.is_excluded(i));
            let reading = tick.readings.get(i).copied().unwrap_or(f64::NAN);
            let force = if reading.is_finite() {
                if reading.abs() >= model.input_limit {
                    flags |= SensorFlags::OVERRANGE;
                    counters.overrange_readings += 1;
                }
                let reading = reading.clamp(-model.input_limit, model.input_limit);
                let output = match calibration.accel_output {
                    OutputKind::Counts => reading / duration_s,
                    OutputKind::Mean => reading,
                };
                thermal.specific_force(output, time)
            } else {
                flags |= SensorFlags::NOT_FINITE;
                counters.not_finite_readings += 1;
                self.last_forces.get(i).copied().unwrap_or(0.0)
            };
            if flags.intersects(SensorFlags::OVERRANGE | SensorFlags::NOT_FINITE) {
                mask = mask.without(i);
                flags -= SensorFlags::VALID;
            } else if let Some(last) = self.last_forces.get_mut(i) {
                *last = force;
            }
            if flags.contains(SensorFlags::EXCLUDED) {
                flags -= SensorFlags::VALID;
            }
            forces.push(force);
            out.accel_flags.push(flags);
        }
        let Some(axes) = &mut self.thermal.accel_axes else { return };
        if orientation.sensors() > MIN_SENSORS {
            let verdict = axes.watch(orientation, mask, &forces);
            out.accel_parity = verdict.residuals;
            if verdict.exceeded {
                out.flags |= TickFlags::PARITY_EXCEEDED;
            }
            counters.sensors_excluded += u64::from(verdict.exclude.is_some());
        }
        let (force, trusted) = resolve(axes, orientation, mask, &forces, time);
        out.delta_velocity = force.map(|f| f * duration_s);
        out.flags.set(TickFlags::VELOCITY_INVALID, !trusted);
    }
}

/// K(T)·P (rad).
fn scaled(output: OutputKind, reading: f64, increment_weight: f64, duration_s: f64) -> f64 {
    match output {
        OutputKind::Counts => increment_weight * reading,
        OutputKind::Mean => increment_weight * (reading * duration_s),
    }
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
    let included = axes.included(orientation);
    (axes.resolve(orientation, included, readings, time).unwrap_or_default(), false)
}

/// Counts what the substitution did.
fn count_switch_flags(flags: TickFlags, counters: &mut Counters) {
    counters.ticks_interpolated += u64::from(flags.contains(TickFlags::INTERPOLATED));
    counters.switches_restored += u64::from(flags.contains(TickFlags::ANGLE_RESTORED));
    counters.servo_unmeasured += u64::from(flags.contains(TickFlags::SERVO_UNMEASURED));
    counters.switches_unresolved += u64::from(flags.contains(TickFlags::SWITCH_UNRESOLVED));
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
