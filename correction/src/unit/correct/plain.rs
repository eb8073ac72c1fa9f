//! A plain tick: the next one, every reading sound, nothing under way. Corrected sensor beside sensor by the [plan](super::plan).
//!
//! It does what the general path of [`Corrector::correct`] does with such a tick, operation by operation in the same
//! order, so that neither a bit of what comes out nor of the memory tells which path a tick took. What the general path
//! decides for each sensor is decided here once, for the tick, and before anything is changed.

use core::array;

use super::gyros::{Signs, input};
use super::plan::Lines;
use super::{Corrector, of_length, watch_parity};
use crate::calibration::Calibration;
use crate::observation::{AccelSeen, GyroSeen};
use crate::orientation::SensorMask;
use crate::reversal::TickInput;
use crate::sample::{AccelTick, CorrectedTick, OutputKind, SensorFlags};
use crate::thermal::GyroTerms;
use crate::unit::counters::Counters;
use crate::unit::release::Released;

/// A tick on its way by the plan.
pub(super) struct Tick<'a> {
    pub(super) released: &'a Released<'a>,
    pub(super) accel: Option<&'a AccelTick>,
    pub(super) since_turn_on_s: f64,
}

/// Its readings, a place for each sensor.
struct Readings<const N: usize> {
    gyros: [f64; N],
    accels: [f64; N],
    input: TickInput,
}

impl Corrector {
    /// Whether there is a plan that holds.
    pub(in crate::unit) fn has_plan(&self) -> bool {
        self.plan.four().is_some() || self.plan.eight().is_some()
    }

    /// Corrects a tick by the plan, where there is one and the tick is plain; otherwise nothing has changed.
    ///
    /// Temperature readings that are due must have been looked for.
    pub(super) fn correct_plainly(
        &mut self,
        calibration: &Calibration,
        tick: &Tick<'_>,
        out: &mut CorrectedTick,
        counters: &mut Counters,
    ) -> bool {
        // Out of the way while the rest is written to.
        let mut plan = core::mem::take(&mut self.plan);
        let corrected = if let Some(lines) = plan.four() {
            self.by_lines(lines, calibration, tick, out, counters)
        } else if let Some(lines) = plan.eight() {
            self.by_lines(lines, calibration, tick, out, counters)
        } else {
            None
        };
        if corrected == Some(Excluded(true)) {
            plan.lapse();
        }
        self.plan = plan;
        corrected.is_some()
    }

    /// Corrects a plain tick by the lines; whether a sensor was excluded by it. `None` where it is not plain.
    fn by_lines<const N: usize>(
        &mut self,
        lines: &Lines<N>,
        calibration: &Calibration,
        tick: &Tick<'_>,
        out: &mut CorrectedTick,
        counters: &mut Counters,
    ) -> Option<Excluded> {
        let readings = self.plain(lines, calibration, tick)?;
        self.advance_drift(calibration, tick.released);
        self.begin(tick.released, out);
        let mut excluded = self.plain_gyros(lines, calibration, tick, &readings, out, counters);
        excluded |= self.plain_accels(lines, calibration, tick.accel, &readings, out, counters);
        self.note(tick.released, out);
        self.drift.observe(&self.seen);
        Some(Excluded(excluded))
    }

    /// The readings of a tick that is plain.
    fn plain<const N: usize>(
        &self,
        lines: &Lines<N>,
        calibration: &Calibration,
        tick: &Tick<'_>,
    ) -> Option<Readings<N>> {
        let Tick { released, accel, .. } = tick;
        let (time, duration) = (released.tick.end_time, released.tick.duration);
        let gyros = within(&released.tick.readings, &lines.gyros.limit)?;
        let accels = match (&lines.accels, accel) {
            (Some((lines, _)), Some(accel)) => within(&accel.readings, &lines.limit)?,
            (Some(_), None) => return None,
            (None, _) => [0.0; N],
        };
        let input = input(released);
        let settled = match &calibration.reversal {
            Some(reversal) => self.substitution.is_plain(*reversal, &input),
            None => self.substitution.is_settled(),
        };
        let settles_s = lines.gyros.servos.as_ref().map(|servos| servos.settles_s);
        let servos = self.servo.is_settled(settles_s, time, duration);
        (settled && servos && time.is_near() && time <= lines.fresh_until).then_some(Readings {
            gyros,
            accels,
            input,
        })
    }

    /// As [`gyros`](Self::gyros); whether a sensor was excluded.
    fn plain_gyros<const N: usize>(
        &mut self,
        lines: &Lines<N>,
        calibration: &Calibration,
        tick: &Tick<'_>,
        readings: &Readings<N>,
        out: &mut CorrectedTick,
        counters: &mut Counters,
    ) -> bool {
        let (raw, readings, input) = (tick.released.tick, &readings.gyros, &readings.input);
        let (time, duration_s) = (raw.end_time, raw.duration.as_s());
        let gyros = &lines.gyros;
        let share = gyros.pace.share(time);
        let weight = gyros.increment_weight.at(&share);
        let (still, magnetic, meander) =
            (gyros.bias.at(&share), gyros.magnetic.at(&share), gyros.meander.at(&share));
        let trend = gyros.trend.as_ref().map_or([0.0; N], |trend| trend.at(tick.since_turn_on_s));
        let signs = Signs::of(raw);
        let mut bias: [f64; N] = array::from_fn(|i| {
            let bias = still[i] + trend[i];
            signs.bias(&GyroTerms {
                increment_weight: weight[i],
                bias,
                magnetic: magnetic[i],
                meander: meander[i],
            })
        });
        if let Some(servos) = &gyros.servos {
            bias = array::from_fn(|i| bias[i] + servos.settled[i]);
            self.servo.note_settled(servos.of, (time, raw.duration), &raw.half_periods);
        }
        let drift: [f64; N] = if self.drift.subtracts() {
            array::from_fn(|i| self.drift.subtrahend(i, time))
        } else {
            [0.0; N]
        };
        let subtrahend: [f64; N] = array::from_fn(|i| bias[i] + drift[i]);
        let scaled: [f64; N] = match calibration.gyro_output {
            OutputKind::Counts => array::from_fn(|i| weight[i] * readings[i]),
            OutputKind::Mean => array::from_fn(|i| weight[i] * (readings[i] * duration_s)),
        };
        let increments: [f64; N] = array::from_fn(|i| scaled[i] - subtrahend[i] * duration_s);
        let rates: [f64; N] = increments.map(|increment| increment / duration_s);
        let measured: [f64; N] = array::from_fn(|i| rates[i] + subtrahend[i]);

        let count = calibration.gyros.len();
        of_length(&mut self.seen.gyros, count);
        of_length(&mut out.gyro_flags, count);
        for i in 0..N {
            let (Some(seen), Some(health), Some(last), Some(flags)) = (
                self.seen.gyros.get_mut(i),
                self.gyro_health.get_mut(i),
                self.last_rates.get_mut(i),
                out.gyro_flags.get_mut(i),
            ) else {
                break;
            };
            *flags = SensorFlags::VALID;
            *seen = GyroSeen {
                reading: readings[i],
                rate: measured[i],
                bias: bias[i],
                drift: drift[i],
                temperature_deg_c: gyros.temperature_deg_c[i],
                flags: SensorFlags::VALID,
            };
            health.note_valid();
            *last = rates[i];
        }
        if calibration.reversal.is_some() {
            let of_sensor = |i| if i < count { rates.get(i).copied().unwrap_or(f64::NAN) } else { f64::NAN };
            self.substitution.note_good(input, array::from_fn(of_sensor));
        }
        self.seen.settled = true;
        out.delta_angle = lines.gyro_axes.resolve(time, &increments);

        let watched = (SensorMask::all(count), rates.get(..count).unwrap_or_default());
        let told = (&mut out.gyro_parity, &mut out.flags);
        watch_parity(&mut self.thermal.gyro_axes, &calibration.gyro_orientation, watched, told, counters)
    }

    /// As [`accels`](Self::accels); whether a sensor was excluded.
    fn plain_accels<const N: usize>(
        &mut self,
        lines: &Lines<N>,
        calibration: &Calibration,
        tick: Option<&AccelTick>,
        readings: &Readings<N>,
        out: &mut CorrectedTick,
        counters: &mut Counters,
    ) -> bool {
        let (Some((accels, axes)), Some(tick), Some(orientation)) =
            (&lines.accels, tick, &calibration.accel_orientation)
        else {
            self.seen.specific_force = None;
            self.seen.accels.clear();
            out.accel_flags.clear();
            return false;
        };
        let readings = &readings.accels;
        // The corrected tick has the gyro tick's time.
        let (time, duration_s) = (out.end_time, tick.duration.as_s());
        let (share, board_share) = (accels.pace.share(time), accels.board_pace.share(time));
        let bias = accels.bias.at(&share);
        let per_scale_factor = accels.per_scale_factor.at(&share);
        let ratio = accels.ratio.at(&board_share);
        let outputs: [f64; N] = match calibration.accel_output {
            OutputKind::Counts => readings.map(|reading| reading / duration_s),
            OutputKind::Mean => *readings,
        };
        let forces: [f64; N] = array::from_fn(|i| (outputs[i] - bias[i]) * ratio[i] * per_scale_factor[i]);

        let count = calibration.accels.len();
        of_length(&mut self.seen.accels, count);
        of_length(&mut out.accel_flags, count);
        for i in 0..N {
            let (Some(seen), Some(health), Some(last), Some(flags)) = (
                self.seen.accels.get_mut(i),
                self.accel_health.get_mut(i),
                self.last_forces.get_mut(i),
                out.accel_flags.get_mut(i),
            ) else {
                break;
            };
            *flags = SensorFlags::VALID;
            *seen = AccelSeen { reading: readings[i], flags: SensorFlags::VALID };
            health.note_valid();
            *last = forces[i];
        }
        let force = axes.resolve(time, &forces);
        out.delta_velocity = force.map(|force| force * duration_s);
        self.seen.specific_force = Some(force);

        let Some(axes) = &mut self.thermal.accel_axes else { return false };
        let watched = (SensorMask::all(count), forces.get(..count).unwrap_or_default());
        let told = (&mut out.accel_parity, &mut out.flags);
        watch_parity(axes, orientation, watched, told, counters)
    }
}

/// Whether a plain tick has led to the exclusion of a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Excluded(bool);

/// A place for each reading, where every one is a number below its sensor's limit.
fn within<const N: usize>(readings: &[f64], limits: &[f64; N]) -> Option<[f64; N]> {
    let readings: [f64; N] = array::from_fn(|i| readings.get(i).copied().unwrap_or(0.0));
    let sound =
        readings.iter().zip(limits).fold(true, |sound, (reading, limit)| sound & (reading.abs() < *limit));
    sound.then_some(readings)
}
