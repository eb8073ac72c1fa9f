//! The gyros' part of a tick: scale, bias, servo transient, substitution, case axes.

use core::array;

use super::patch::{Patch, SOUND, within};
use super::{Corrector, OnItsWay, of_sensors};
use crate::calibration::Calibration;
use crate::lanes::{narrow, of_readings, put};
use crate::orientation::SensorMask;
use crate::reversal::{Reversal, Substitution, TickInput};
use crate::sample::{
    CorrectedTick, GyroTick, LasingMode, MAX_SENSORS, MIN_SENSORS, OutputKind, SensorFlags, TickFlags,
};
use crate::servo::{ServoTick, Transient};
use crate::thermal::Shares;
use crate::unit::counters::Counters;
use crate::unit::pipeline::Released;

/// What the substitution did, and the servo could not: counted.
const SWITCHING: TickFlags = TickFlags::INTERPOLATED
    .union(TickFlags::ANGLE_RESTORED)
    .union(TickFlags::SWITCH_UNRESOLVED)
    .union(TickFlags::SERVO_UNMEASURED);
/// The increments of a tick that are not those of a settled instrument.
const UNSETTLED: TickFlags = TickFlags::INTERPOLATED
    .union(TickFlags::ANGLE_RESTORED)
    .union(TickFlags::SERVO_TRANSIENT)
    .union(TickFlags::SERVO_UNMEASURED);

impl Corrector {
    /// The terms of the gyros in use, the trend in the bias: increment weight, bias, magnetic and slow-meander term.
    pub(super) fn gyro_terms<const N: usize>(
        &self,
        calibration: &Calibration,
        shares: &Shares,
        since_turn_on_s: f64,
    ) -> [[f64; N]; 4] {
        let mut terms = self.thermal.gyros.at::<N>(shares);
        let trend = calibration.trends.as_ref().map_or([0.0; N], |trends| trends.at(since_turn_on_s));
        terms[1] = array::from_fn(|i| terms[1][i] + trend[i]);
        if let Some(slewing) = self.slewing() {
            slewing.terms(&mut terms, &slewing.from.gyros);
        }
        terms
    }

    /// Corrects the gyros' readings of a tick.
    #[inline]
    pub(super) fn gyros<const N: usize>(
        &mut self,
        calibration: &Calibration,
        tick: &OnItsWay<'_>,
        shares: &Shares,
        counters: &mut Counters,
        out: &mut CorrectedTick,
    ) {
        let raw = tick.released.tick;
        let (time, duration_s) = (raw.end_time, raw.duration.as_s());
        let count = calibration.gyros.len();
        let reversal = calibration.reversal.as_ref().map(|reversal| (reversal, input(tick.released)));
        let lost = reversal.is_some_and(|(reversal, input)| self.substitution.is_lost(reversal, &input));

        let [weight, bias, magnetic, meander] =
            self.gyro_terms::<N>(calibration, shares, tick.since_turn_on_s);
        let (mode_sign, meander_sign) = (sign(raw.mode), sign(raw.meander));
        let mut bias: [f64; N] =
            array::from_fn(|i| bias[i] + mode_sign * magnetic[i] + meander_sign * meander[i]);
        let readings: [f64; N] = of_readings(&raw.readings);
        let scaled = |lane: usize, reading: f64| match calibration.gyro_output {
            OutputKind::Counts => weight[lane] * reading,
            OutputKind::Mean => weight[lane] * (reading * duration_s),
        };
        let mut clamped = SensorMask::NONE;
        if self.moves {
            let limits = narrow::<N>(&calibration.gyro_limits);
            let within = |lane: usize| readings[lane].max(-limits[lane]).min(limits[lane]);
            let rates = array::from_fn(|lane| scaled(lane, within(lane)) / duration_s);
            (bias, clamped) = self.gyros_in_motion::<N>(calibration, shares, &rates, bias);
        }
        self.servo.advance(lost, time, raw.duration);
        if let Some(settles_s) = calibration.servos_settle_s.filter(|_| !lost)
            && !self.servo.pass_settled(settles_s, (time, raw.duration), &raw.half_periods)
        {
            let (disturbed, flags) = self.servo_transients(calibration, raw, &weight, bias);
            bias = disturbed;
            out.flags |= flags;
        }
        let drift: [f64; N] = if self.drift.subtracts() {
            array::from_fn(|i| self.drift.subtrahend(i, time))
        } else {
            [0.0; N]
        };
        let subtrahend: [f64; N] = array::from_fn(|i| bias[i] + drift[i]);
        let corrected = |lane: usize, reading| scaled(lane, reading) - subtrahend[lane] * duration_s;
        let mut increments: [f64; N] = array::from_fn(|i| corrected(i, readings[i]));

        let mut usable = self.thermal.gyro_axes.included();
        let footing = &self.thermal.gyro_footing;
        let outside = clamped != SensorMask::NONE;
        let sound =
            !(lost | outside) & footing.is_sound(time) & within(&readings, narrow(&calibration.gyro_limits));
        let mut flags = if sound {
            SOUND
        } else {
            let limits = &calibration.gyro_limits;
            let patch = Patch { count, readings: &raw.readings, limits, footing, time };
            if lost {
                increments = [0.0; N];
                patch.lost()
            } else {
                let good = &self.last_rates;
                patch.apply(&mut usable, counters, |lane, reading| {
                    increments[lane] = match reading {
                        Some(reading) => corrected(lane, reading),
                        None => good[lane] * duration_s,
                    };
                })
            }
        };
        if clamped != SensorMask::NONE {
            mark_clamped(&mut flags, clamped);
        }
        // Before the substitution: the angle that it restores is a lump, not a rate.
        let mut rates: [f64; N] = increments.map(|increment| increment / duration_s);
        if sound {
            put(&mut self.last_rates, rates);
            self.gyro_health.note_sound();
        } else {
            for lane in (0..count).filter(|lane| flags[*lane].contains(SensorFlags::VALID)) {
                self.last_rates[lane] = rates[lane];
            }
            self.gyro_health.note(flags);
        }

        let seen = &mut self.seen.gyros;
        seen.count = count;
        put(&mut seen.reading, readings);
        put::<N>(&mut seen.rate, array::from_fn(|i| rates[i] + subtrahend[i]));
        put(&mut seen.bias, bias);
        put(&mut seen.drift, drift);
        seen.flags = flags;
        out.gyro_flags = of_sensors(flags, count);

        out.flags |= self.substitute(reversal, &mut increments[..count]);
        if out.flags.intersects(SWITCHING) {
            count_switch_flags(out.flags, counters);
        }
        if self.moves && self.holds_back() {
            let held = (&mut increments, &mut usable);
            let held = self.hold_gyros_back(calibration, tick.released, &mut out.flags, held);
            rates = held.unwrap_or(rates);
        }
        self.seen.settled = !lost && self.slew.is_none() && !out.flags.intersects(UNSETTLED);
        self.resolve_angle(calibration, usable, (&increments, &rates), counters, out);
    }

    /// Adds what the gyros' servos show in a good tick to their biases (rad/s); `weight` in rad per count.
    #[cold]
    fn servo_transients<const N: usize>(
        &mut self,
        calibration: &Calibration,
        tick: &GyroTick,
        weight: &[f64; N],
        mut bias: [f64; N],
    ) -> ([f64; N], TickFlags) {
        let mut flags = TickFlags::empty();
        let temperatures = &self.thermal.gyro_footing.temperature_deg_c;
        let lanes = calibration.gyros.iter().zip(weight).zip(temperatures).zip(&mut bias).enumerate();
        for (lane, (((model, weight), temperature_deg_c), bias)) in lanes {
            let Some(servo) = &model.servo else { continue };
            let servo_tick = ServoTick {
                end_time: tick.end_time,
                duration: tick.duration,
                temperature_deg_c: *temperature_deg_c,
                scale_rad_per_count: *weight,
                half_periods: tick.half_periods.get(lane).copied(),
            };
            let transient = self.servo.apparent_rate(lane, servo, &servo_tick);
            *bias += transient.rate_rad_per_s();
            flags |= match transient {
                Transient::Settled => TickFlags::empty(),
                Transient::Apparent { .. } => TickFlags::SERVO_TRANSIENT,
                Transient::Unmeasured => TickFlags::SERVO_UNMEASURED,
            };
        }
        (bias, flags)
    }

    /// Bridges a mode switch (models §5).
    fn substitute(&mut self, reversal: Option<(&Reversal, TickInput)>, increments: &mut [f64]) -> TickFlags {
        match reversal {
            Some((reversal, input)) => self.substitution.tick(reversal, input, increments),
            // A swap took the substitution away in the middle of a transition.
            None if !self.substitution.is_settled() => {
                self.substitution = Substitution::new();
                TickFlags::SWITCH_UNRESOLVED
            }
            None => TickFlags::empty(),
        }
    }

    /// Resolves the increments (rad) in case axes, and watches the parity of the rates before the substitution (rad/s).
    fn resolve_angle<const N: usize>(
        &mut self,
        calibration: &Calibration,
        usable: SensorMask,
        (increments, rates): (&[f64; N], &[f64; N]),
        counters: &mut Counters,
        out: &mut CorrectedTick,
    ) {
        let orientation = &calibration.gyro_orientation;
        let axes = &mut self.thermal.gyro_axes;
        let mut excluded = false;
        if orientation.sensors() > MIN_SENSORS && !out.flags.contains(TickFlags::INTERPOLATED) {
            let rates = &rates[..orientation.sensors()];
            excluded = axes.watch(orientation, usable, rates, (&mut out.gyro_parity, &mut out.flags));
        }
        let (angle, trusted) = axes.resolve(orientation, usable, increments, out.end_time);
        out.delta_angle = self.slewing().map_or(angle, |slewing| {
            slewing.axes(angle, slewing.from.gyro_axes.as_ref(), usable, &increments[..orientation.sensors()])
        });
        if !trusted {
            out.flags |= TickFlags::ANGLE_INVALID;
        }
        if excluded {
            counters.sensors_excluded += 1;
            self.thermal.note_footing(calibration);
        }
    }
}

/// What the substitution must know of a tick.
fn input(released: &Released<'_>) -> TickInput {
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

/// Sign of a lasing mode or of the meander's phase; +1 where the instrument has none.
fn sign(phase: Option<LasingMode>) -> f64 {
    phase.map_or(1.0, LasingMode::sign)
}

/// Marks gyros whose rate is outside the range that its curve was fitted to.
#[cold]
fn mark_clamped(flags: &mut [SensorFlags; MAX_SENSORS], clamped: SensorMask) {
    let lanes = flags.iter_mut().enumerate().filter(|(lane, _)| clamped.contains(*lane));
    lanes.for_each(|(_, flags)| *flags |= SensorFlags::CLAMPED_RATE);
}

/// Counts what the substitution did.
#[cold]
fn count_switch_flags(flags: TickFlags, counters: &mut Counters) {
    counters.ticks_interpolated += u64::from(flags.contains(TickFlags::INTERPOLATED));
    counters.switches_restored += u64::from(flags.contains(TickFlags::ANGLE_RESTORED));
    counters.servo_unmeasured += u64::from(flags.contains(TickFlags::SERVO_UNMEASURED));
    counters.switches_unresolved += u64::from(flags.contains(TickFlags::SWITCH_UNRESOLVED));
}
