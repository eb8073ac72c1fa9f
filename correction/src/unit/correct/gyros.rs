//! The gyros' part of a tick: scale, bias, servo transient, substitution, case axes.

use super::{Corrector, of_length, resolve, watch_parity};
use crate::calibration::Calibration;
use crate::observation::GyroSeen;
use crate::orientation::SensorMask;
use crate::reversal::{Substitution, TickInput};
use crate::sample::{CorrectedTick, GyroTick, LasingMode, MAX_SENSORS, OutputKind, SensorFlags, TickFlags};
use crate::servo::{ServoTick, Transient};
use crate::thermal::{GyroModel, GyroTerms};
use crate::unit::counters::Counters;
use crate::unit::footing::Footing;
use crate::unit::release::Released;
use crate::units::Timestamp;

/// A reading that does not count as it stands.
pub(super) const UNSOUND: SensorFlags =
    SensorFlags::OVERRANGE.union(SensorFlags::NOT_FINITE).union(SensorFlags::EXCLUDED);

/// The increments of a tick that are not those of a settled instrument.
const UNSETTLED: TickFlags = TickFlags::INTERPOLATED
    .union(TickFlags::ANGLE_RESTORED)
    .union(TickFlags::SERVO_TRANSIENT)
    .union(TickFlags::SERVO_UNMEASURED);

impl Corrector {
    /// The terms of a gyro in use, its trend in the bias.
    pub(super) fn gyro_terms(
        &self,
        index: usize,
        model: &GyroModel,
        time: Timestamp,
        since_turn_on_s: f64,
    ) -> Option<GyroTerms> {
        let terms = terms(self.thermal.gyros.get(index)?.at(time), model, since_turn_on_s);
        let slew = self.slew.as_ref().filter(|_| self.slew_share > 0.0);
        Some(slew.map_or(terms, |slew| slew.gyro(index, terms, self.slew_share)))
    }

    /// Corrects the gyros' readings of a tick.
    pub(super) fn gyros(
        &mut self,
        calibration: &Calibration,
        released: &Released<'_>,
        since_turn_on_s: f64,
        out: &mut CorrectedTick,
        counters: &mut Counters,
    ) {
        let tick = released.tick;
        let duration_s = tick.duration.as_s();
        let input = input(released);
        let lost = calibration.reversal.as_ref().is_some_and(|r| self.substitution.is_lost(r, &input));
        self.servo.advance(lost, tick.end_time, tick.duration);

        let included = self.thermal.gyro_axes.included();
        let mut mask = included;
        let (mut increments, mut rates) = ([0.0; MAX_SENSORS], [0.0; MAX_SENSORS]);
        let count = calibration.gyros.len();
        of_length(&mut self.seen.gyros, count);
        of_length(&mut out.gyro_flags, count);
        let slew = self.slew.as_ref().filter(|_| self.slew_share > 0.0);
        let signs = Signs::of(tick);
        // Lists of one length, so that it is checked here and not at every access.
        let (
            Some(thermals),
            Some(footings),
            Some(last_rates),
            Some(healths),
            Some(seen),
            Some(all_flags),
            Some(readings),
            Some(increments),
            Some(rates),
        ) = (
            self.thermal.gyros.get(..count),
            self.thermal.footings.gyros.get(..count),
            self.last_rates.get_mut(..count),
            self.gyro_health.get_mut(..count),
            self.seen.gyros.get_mut(..count),
            out.gyro_flags.get_mut(..count),
            tick.readings.get(..count),
            increments.get_mut(..count),
            rates.get_mut(..count),
        )
        else {
            return;
        };
        for (i, model) in calibration.gyros.iter().enumerate() {
            let terms = terms(thermals[i].at(tick.end_time), model, since_turn_on_s);
            let terms = slew.map_or(terms, |slew| slew.gyro(i, terms, self.slew_share));
            let Footing { temperature_deg_c, .. } = footings[i];
            let mut bias = signs.bias(&terms);
            if let (Some(servo), false) = (&model.servo, lost) {
                let servo_tick = ServoTick {
                    end_time: tick.end_time,
                    duration: tick.duration,
                    temperature_deg_c,
                    scale_rad_per_count: terms.increment_weight,
                    half_periods: tick.half_periods.get(i).copied(),
                };
                let transient = self.servo.apparent_rate(i, servo, &servo_tick);
                bias += transient.rate_rad_per_s();
                out.flags |= flags_of(transient);
            }
            let drift = self.drift.subtrahend(i, tick.end_time);
            let mut flags = footings[i].flags(tick.end_time);
            if !included.contains(i) {
                flags |= SensorFlags::EXCLUDED;
            }

            let (reading, limit) = (readings[i], model.input_limit);
            increments[i] = if lost {
                0.0
            } else if reading.is_finite() {
                if reading.abs() >= limit {
                    flags |= SensorFlags::OVERRANGE;
                    counters.overrange_readings += 1;
                    mask = mask.without(i);
                }
                // Beyond its limit a reading says no more than the limit, and stays finite whatever it is.
                let reading = reading.clamp(-limit, limit);
                scaled(calibration.gyro_output, reading, terms.increment_weight, duration_s)
                    - (bias + drift) * duration_s
            } else {
                flags |= SensorFlags::NOT_FINITE;
                counters.not_finite_readings += 1;
                mask = mask.without(i);
                last_rates[i] * duration_s
            };
            // Before the substitution: the angle that it restores is a lump, not a rate.
            rates[i] = increments[i] / duration_s;
            if lost || flags.intersects(UNSOUND) {
                flags -= SensorFlags::VALID;
            } else {
                last_rates[i] = rates[i];
            }
            all_flags[i] = flags;
            healths[i].note(flags);
            let rate = rates[i] + (bias + drift);
            seen[i] = GyroSeen { reading, rate, bias, drift, temperature_deg_c, flags };
        }

        out.flags |= self.substitute(calibration, input, increments);
        count_switch_flags(out.flags, counters);
        self.seen.settled = !lost && self.slew.is_none() && !out.flags.intersects(UNSETTLED);
        self.resolve_angle(calibration, mask, (increments, rates), out, counters);
    }

    /// Resolves the increments (rad) in case axes, and watches the parity of the rates before the substitution (rad/s).
    fn resolve_angle(
        &mut self,
        calibration: &Calibration,
        mask: SensorMask,
        (increments, rates): (&[f64], &[f64]),
        out: &mut CorrectedTick,
        counters: &mut Counters,
    ) {
        let orientation = &calibration.gyro_orientation;
        let axes = &mut self.thermal.gyro_axes;
        if !out.flags.contains(TickFlags::INTERPOLATED) {
            let told = (&mut out.gyro_parity, &mut out.flags);
            watch_parity(axes, orientation, (mask, rates), told, counters);
        }
        let (angle, trusted) = resolve(axes, orientation, mask, increments, out.end_time);
        let slewed_from = self.slew.as_ref().and_then(|slew| slew.gyro_axes.as_ref());
        out.delta_angle = crate::unit::slew::axes(angle, slewed_from, mask, increments, self.slew_share);
        out.flags.set(TickFlags::ANGLE_INVALID, !trusted);
    }
}

impl Corrector {
    /// Bridges a mode switch (models §5).
    fn substitute(
        &mut self,
        calibration: &Calibration,
        input: TickInput,
        increments: &mut [f64],
    ) -> TickFlags {
        match &calibration.reversal {
            Some(reversal) => self.substitution.tick(reversal, input, increments),
            // A swap took the substitution away in the middle of a transition.
            None if !self.substitution.is_settled() => {
                self.substitution = Substitution::new();
                TickFlags::SWITCH_UNRESOLVED
            }
            None => TickFlags::empty(),
        }
    }
}

/// What the substitution must know of a tick.
pub(super) fn input(released: &Released<'_>) -> TickInput {
    let tick = released.tick;
    TickInput {
        end_time: tick.end_time,
        duration: tick.duration,
        mode: tick.mode,
        switch_command: tick.switch_command,
        missed: released.missed,
        restart: released.restart,
    }
}

/// What is told of a tick with this transient of the servo.
const fn flags_of(transient: Transient) -> TickFlags {
    match transient {
        Transient::Settled => TickFlags::empty(),
        Transient::Apparent { .. } => TickFlags::SERVO_TRANSIENT,
        Transient::Unmeasured => TickFlags::SERVO_UNMEASURED,
    }
}

/// The terms with the trend in the bias.
fn terms(mut thermal: GyroTerms, model: &GyroModel, since_turn_on_s: f64) -> GyroTerms {
    thermal.bias += model.trend.as_ref().map_or(0.0, |trend| trend.at(since_turn_on_s));
    thermal
}

/// Signs of a tick's mode and meander; +1 where the instrument has none.
#[derive(Debug, Clone, Copy)]
pub(super) struct Signs {
    mode: f64,
    meander: f64,
}

impl Signs {
    pub(super) fn of(tick: &GyroTick) -> Self {
        let sign = |phase: Option<LasingMode>| phase.map_or(1.0, LasingMode::sign);
        Self { mode: sign(tick.mode), meander: sign(tick.meander) }
    }

    /// The terms of Ω that follow temperature (rad/s).
    pub(super) fn bias(&self, terms: &GyroTerms) -> f64 {
        terms.bias + self.mode * terms.magnetic + self.meander * terms.meander
    }
}

/// K(T)·P (rad).
fn scaled(output: OutputKind, reading: f64, increment_weight: f64, duration_s: f64) -> f64 {
    match output {
        OutputKind::Counts => increment_weight * reading,
        OutputKind::Mean => increment_weight * (reading * duration_s),
    }
}

/// Counts what the substitution did.
fn count_switch_flags(flags: TickFlags, counters: &mut Counters) {
    counters.ticks_interpolated += u64::from(flags.contains(TickFlags::INTERPOLATED));
    counters.switches_restored += u64::from(flags.contains(TickFlags::ANGLE_RESTORED));
    counters.servo_unmeasured += u64::from(flags.contains(TickFlags::SERVO_UNMEASURED));
    counters.switches_unresolved += u64::from(flags.contains(TickFlags::SWITCH_UNRESOLVED));
}
