//! The gyros' part of a tick: scale, bias, servo transient, substitution, case axes.

use core::array;

use super::needs::Needs;
use super::{Corrector, Paired, of_sensors, withdraw};
use crate::calibration::Calibration;
use crate::lanes::{Lanes, narrow, put, within};
use crate::observation::SOUND;
use crate::orientation::SensorMask;
use crate::reversal::{Reversal, Substitution, TickInput};
use crate::sample::{
    CorrectedTick, GyroTick, LasingMode, MAX_SENSORS, MIN_SENSORS, OutputKind, SensorFlags, TickFlags,
};
use crate::servo::{ServoTick, Transient};
use crate::thermal::Shares;
use crate::unit::counters::Counters;

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
    /// The terms of the gyros in use, given those of the bank: with the trend in the bias, and on their way from what was before a swap.
    #[cold]
    pub(super) fn special_terms<const N: usize>(
        &self,
        calibration: &Calibration,
        terms: &mut [[f64; N]; 4],
        since_turn_on_s: f64,
    ) {
        let trend = calibration.trends.as_ref().map_or([0.0; N], |trends| trends.at(since_turn_on_s));
        terms[1] = array::from_fn(|i| terms[1][i] + trend[i]);
        if let Some(slewing) = self.slewing() {
            slewing.terms(terms, &slewing.from.gyros);
        }
    }

    /// What the gyros drift by acceleration and rate, and those whose rate is beyond its curve.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "lanes that stay in registers")]
    fn drift_with_motion<const N: usize>(
        &mut self,
        calibration: &Calibration,
        shares: Shares<'_>,
        scale: Scale<N>,
        readings: [f64; N],
        duration_s: f64,
    ) -> ([f64; N], SensorMask) {
        let mut clamped = SensorMask::NONE;
        let mut drift = if self.calm.needs.contains(Needs::FORCE) {
            self.drift_with_force::<N>(shares)
        } else {
            [0.0; N]
        };
        if self.calm.needs.contains(Needs::RATES) {
            let limits = narrow::<N>(&calibration.gyro_limits);
            let within = array::from_fn(|lane| readings[lane].max(-limits[lane]).min(limits[lane]));
            let rates = scale.angles(within).map(|angle| angle / duration_s);
            clamped = self.weigh_over_rate::<N>(calibration, shares, &rates, &mut drift);
        }
        (drift, clamped)
    }

    /// Corrects the gyros' readings of a tick that lasted `duration_s`.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    pub(super) fn gyros<const N: usize>(
        &mut self,
        calibration: &Calibration,
        (tick, duration_s): (&Paired<'_>, f64),
        shares: Shares<'_>,
        counters: &mut Counters,
        out: &mut CorrectedTick,
    ) {
        let (raw, count) = (tick.gyro, calibration.gyros.len());
        let time = raw.end_time;
        let reversal = calibration.reversal.as_ref().map(|reversal| (reversal, input(tick)));
        let lost = reversal.is_some_and(|(reversal, input)| self.substitution.is_lost(reversal, &input));

        let [mut weight, mut bias] = self.thermal.gyros.at::<N, 2>(shares);
        if self.calm.needs.intersects(Needs::MODAL.union(Needs::SPECIAL)) {
            let mut terms = self.thermal.gyros.at::<N, 4>(shares);
            // What few ticks need is given copies: lanes of which nobody has the address stay in registers.
            if self.calm.needs.contains(Needs::SPECIAL) {
                let mut special = terms;
                self.special_terms(calibration, &mut special, time.seconds_from(tick.turn_on));
                terms = special;
            }
            let (mode_sign, meander_sign) = (sign(raw.mode), sign(raw.meander));
            let [_, plain, magnetic, meander] = terms;
            (weight, bias) = (terms[0], plain);
            if self.calm.needs.contains(Needs::MODAL) {
                bias = array::from_fn(|i| plain[i] + mode_sign * magnetic[i] + meander_sign * meander[i]);
            }
        }
        let readings: [f64; N] = *raw.readings.lanes();
        let scale =
            Scale { weight, times_s: (calibration.gyro_output == OutputKind::Mean).then_some(duration_s) };
        let mut clamped = SensorMask::NONE;
        if self.calm.needs.intersects(Needs::FORCE.union(Needs::RATES)) {
            let drift;
            (drift, clamped) = self.drift_with_motion(calibration, shares, scale, readings, duration_s);
            bias = array::from_fn(|lane| bias[lane] + drift[lane]);
        }
        if self.calm.needs.contains(Needs::SWITCHES) {
            self.servo.advance(lost, time, raw.duration);
        }
        if let Some(settles_s) = calibration.servos_settle_s.filter(|_| !lost)
            && !self.servo.pass_settled(settles_s, (time, raw.duration), &raw.half_periods)
        {
            let (weight, mut disturbed) = (weight, bias);
            out.flags |= self.servo_transients(calibration, raw, &weight, &mut disturbed);
            bias = disturbed;
        }
        let mut subtrahend = bias;
        if self.calm.needs.contains(Needs::SPECIAL) && self.drift.subtracts() {
            let drift: [f64; N] = array::from_fn(|i| self.drift.subtrahend(i, time));
            put(&mut self.seen.gyros.drift, drift);
            subtrahend = array::from_fn(|i| bias[i] + drift[i]);
        }
        let scaled = scale.angles(readings);
        let mut increments: [f64; N] = array::from_fn(|i| scaled[i] - subtrahend[i] * duration_s);

        let mut usable = self.thermal.gyro_axes.included();
        let outside = clamped != SensorMask::NONE;
        let sound =
            !(lost | outside) & self.calm.sound[0] & within(&readings, narrow(&calibration.gyro_limits));
        let mut flags = SOUND;
        if !sound {
            if lost {
                (increments, flags) = ([0.0; N], self.thermal.gyro_footing.lost(time));
            } else {
                let (mut patched, mut counted) = (readings, usable);
                let patch = (&mut patched, &calibration.gyro_limits, count);
                let (found, numbers) = self.thermal.gyro_footing.patch(time, patch, &mut counted, counters);
                (usable, flags) = (counted, found);
                // A copy: what is looked at lane by lane gets a place in memory.
                let (scaled, subtrahend) = (scale.angles(patched), subtrahend);
                let before: [f64; N] = *narrow(&self.last_rates);
                increments = array::from_fn(|i| {
                    if numbers.contains(i) {
                        scaled[i] - subtrahend[i] * duration_s
                    } else {
                        before[i] * duration_s
                    }
                });
                mark_clamped(&mut flags, clamped);
            }
        }
        // Before the substitution: the angle that it restores is a lump, not a rate.
        let mut rates: [f64; N] = increments.map(|increment| increment / duration_s);
        self.note_rates(sound, flags, rates);

        self.seen.gyros.note([readings, array::from_fn(|i| rates[i] + subtrahend[i]), bias], count, flags);
        out.gyro_flags = of_sensors(flags, count);

        match reversal {
            Some((_, input)) if self.substitution.passes(&input) => {
                self.pass_switches(&input, (rates, count), (!sound).then_some(usable));
            }
            None if !self.calm.needs.contains(Needs::SPECIAL) => {}
            _ => {
                let (mut bridged, mut counted) = (increments, usable);
                self.substitute(calibration, reversal, (&mut bridged[..count], &mut counted), out);
                (increments, usable) = (bridged, counted);
            }
        }
        if out.flags.intersects(SWITCHING) {
            count_switch_flags(out.flags, counters);
        }
        let mut comparable = true;
        if self.calm.needs.contains(Needs::DELAYS) {
            let (mut held, mut counted) = (increments, usable);
            (rates, comparable) = self.hold_gyros_back(calibration, tick, (&mut held, &mut counted), out);
            (increments, usable) = (held, counted);
        }
        self.seen.settled = !lost && self.slew.is_none() && !out.flags.intersects(UNSETTLED);
        let watched = comparable.then_some(rates);
        self.resolve_angle(calibration, usable, (increments, watched), counters, out);
    }

    /// Remembers the rates (rad/s) of a tick away from mode switches; `usable`: the gyros whose readings count, where these are not all.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    fn pass_switches<const N: usize>(
        &mut self,
        input: &TickInput,
        (rates, count): ([f64; N], usize),
        usable: Option<SensorMask>,
    ) {
        // A memory of the unit holds them, and is the same to the bit wherever it is made.
        let counted: [f64; N] = array::from_fn(|i| if i < count { rates[i] } else { f64::NAN });
        let mut of_sensors = [f64::NAN; MAX_SENSORS];
        put(&mut of_sensors, counted);
        if let Some(usable) = usable {
            leave_out(&mut of_sensors, usable);
        }
        self.substitution.pass(input, of_sensors);
    }

    /// Remembers the rates (rad/s) of those readings that were good.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    fn note_rates<const N: usize>(
        &mut self,
        sound: bool,
        flags: [SensorFlags; MAX_SENSORS],
        rates: [f64; N],
    ) {
        self.gyro_health.ticks += 1;
        if sound {
            put(&mut self.last_rates, rates);
        } else {
            let copied = rates;
            self.note_good_rates(flags, &copied);
        }
    }

    #[cold]
    fn note_good_rates(&mut self, flags: [SensorFlags; MAX_SENSORS], rates: &[f64]) {
        for ((last, rate), flags) in self.last_rates.iter_mut().zip(rates).zip(flags) {
            if flags.contains(SensorFlags::VALID) {
                *last = *rate;
            }
        }
        self.gyro_health.note(flags);
    }

    /// Adds what the gyros' servos show in a good tick to their biases (rad/s); `weight` in rad per count.
    #[cold]
    fn servo_transients<const N: usize>(
        &mut self,
        calibration: &Calibration,
        tick: &GyroTick,
        weight: &[f64; N],
        bias: &mut [f64; N],
    ) -> TickFlags {
        let mut flags = TickFlags::empty();
        let temperatures = &self.thermal.gyro_footing.temperature_deg_c;
        let lanes = calibration.gyros.iter().zip(weight).zip(temperatures).zip(bias).enumerate();
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
        flags
    }

    /// Bridges a mode switch (models §5). Gyros that it has no angle of leave `usable`, where the others do without.
    fn substitute(
        &mut self,
        calibration: &Calibration,
        reversal: Option<(&Reversal, TickInput)>,
        (increments, usable): (&mut [f64], &mut SensorMask),
        out: &mut CorrectedTick,
    ) {
        out.flags |= match reversal {
            Some((reversal, input)) => {
                let mut flags = self.substitution.tick(reversal, input, increments, *usable);
                let axes = &self.thermal.gyro_axes;
                let others = axes.included().but(self.substitution.apart());
                if flags.intersects(TickFlags::INTERPOLATED | TickFlags::ANGLE_RESTORED)
                    && others != axes.included()
                {
                    if axes.are_spanned_by(&calibration.gyro_orientation, others, input.end_time) {
                        *usable = usable.intersection(others);
                    } else {
                        flags |= TickFlags::SWITCH_UNRESOLVED;
                    }
                }
                withdraw(&mut out.gyro_flags, *usable);
                flags
            }
            // A swap took the substitution away in the middle of a transition.
            None if !self.substitution.is_settled() => {
                self.substitution = Substitution::default();
                TickFlags::SWITCH_UNRESOLVED
            }
            None => TickFlags::empty(),
        };
    }

    /// Resolves the increments (rad) in case axes, and watches the parity of the rates before the substitution (rad/s), where these can be
    /// compared.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    fn resolve_angle<const N: usize>(
        &mut self,
        calibration: &Calibration,
        usable: SensorMask,
        (increments, rates): ([f64; N], Option<[f64; N]>),
        counters: &mut Counters,
        out: &mut CorrectedTick,
    ) {
        let orientation = &calibration.gyro_orientation;
        let axes = &mut self.thermal.gyro_axes;
        let mut excluded = false;
        if orientation.sensors() > MIN_SENSORS {
            out.gyro_parity.clear();
            if let Some(watched) = rates.filter(|_| !out.flags.contains(TickFlags::INTERPOLATED)) {
                let watched = &watched[..orientation.sensors()];
                excluded = axes.watch(orientation, usable, watched, (&mut out.gyro_parity, &mut out.flags));
            }
        }
        let (angle, trusted) = axes.resolve(orientation, usable, (&increments, None), out.end_time);
        out.delta_angle = self.slewing().map_or(angle, |slewing| {
            let copied = increments;
            slewing.axes(angle, slewing.from.gyro_axes.as_ref(), usable, &copied[..orientation.sensors()])
        });
        if !trusted {
            out.flags |= TickFlags::ANGLE_INVALID;
        }
        if excluded {
            self.exclude(calibration, counters);
        }
    }
}

/// How readings become angles.
#[derive(Debug, Clone, Copy)]
struct Scale<const N: usize> {
    /// rad per count, or rad per rad.
    weight: [f64; N],
    /// Duration of the tick (s), where the readings are rates.
    times_s: Option<f64>,
}

impl<const N: usize> Scale<N> {
    /// Angles of readings (rad).
    #[inline]
    fn angles(&self, mut readings: [f64; N]) -> [f64; N] {
        if let Some(duration_s) = self.times_s {
            readings = readings.map(|reading| reading * duration_s);
        }
        array::from_fn(|lane| self.weight[lane] * readings[lane])
    }
}

/// Makes no number of what gyros outside `usable` are said to read.
#[cold]
fn leave_out(rates: &mut Lanes, usable: SensorMask) {
    let unused = rates.iter_mut().enumerate().filter(|(lane, _)| !usable.contains(*lane));
    unused.for_each(|(_, rate)| *rate = f64::NAN);
}

/// What the substitution must know of a tick.
fn input(tick: &Paired<'_>) -> TickInput {
    TickInput {
        end_time: tick.gyro.end_time,
        duration: tick.gyro.duration,
        mode: tick.gyro.mode,
        switch_command: tick.gyro.switch_command,
        missed: tick.before.missed,
        restart: tick.before.restart,
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
