//! The accelerometers' part of a tick: bias, scale factor, board ratio, case axes.

use core::array;

use super::needs::Needs;
use super::{Corrector, Paired, of_sensors, withdraw};
use crate::calibration::Calibration;
use crate::lanes::{narrow, put, within};
use crate::observation::SOUND;
use crate::orientation::SensorMask;
use crate::sample::{CorrectedTick, MAX_SENSORS, MIN_SENSORS, OutputKind, SensorFlags, TickFlags};
use crate::thermal::Shares;
use crate::unit::counters::Counters;
use crate::units::Span;

/// Terms of the accelerometers at a tick: S and 1/K, and r of their boards.
pub(super) type AccelTerms<const N: usize> = ([[f64; N]; 2], [[f64; N]; 1]);

/// Specific force along the input axes in a tick (m/s²), a lane for each accelerometer.
#[derive(Clone, Copy)]
pub(super) struct Felt<const N: usize> {
    pub(super) forces: [f64; N],
    /// Accelerometers whose reading counts.
    usable: SensorMask,
    /// Whether all of them tell of the same time.
    comparable: bool,
    /// Measured duration of their tick (s).
    duration_s: f64,
    /// Inverse of the axes of all accelerometers, where it is worked out already.
    inverse: Option<[[f64; 4]; N]>,
}

/// Specific forces along the input axes of accelerometers (m/s²) that read this over a tick (models §3).
#[inline]
fn sensed<const N: usize>(
    ([bias, per_scale_factor], [ratio]): &AccelTerms<N>,
    output: OutputKind,
    mut readings: [f64; N],
    duration_s: f64,
) -> [f64; N] {
    if output == OutputKind::Counts {
        readings = readings.map(|reading| reading / duration_s);
    }
    array::from_fn(|lane| (readings[lane] - bias[lane]) * ratio[lane] * per_scale_factor[lane])
}

/// Whether a tick of the accelerometers lasts a quarter longer or shorter than the gyros': its increments are not those of that time.
#[cold]
fn differ(accel: Span, gyro: Span) -> bool {
    accel.as_ns().abs_diff(gyro.as_ns()) > gyro.as_ns().unsigned_abs() / 4
}

impl Corrector {
    /// The terms of the accelerometers in use: S and 1/K, and r of their boards.
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    #[inline(always)]
    pub(super) fn accel_terms<const N: usize>(&self, shares: Shares<'_>) -> AccelTerms<N> {
        let (mut terms, mut board) =
            (self.thermal.accels.at::<N, 2>(shares), self.thermal.boards.at::<N, 1>(shares));
        if let Some(slewing) = self.slewing() {
            slewing.terms(&mut terms, &slewing.from.accels);
            slewing.terms(&mut board, &slewing.from.boards);
        }
        (terms, board)
    }

    /// What the accelerometers feel in a tick; `None` without accelerometers, or without their tick.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    pub(super) fn accels_feel<const N: usize>(
        &mut self,
        calibration: &Calibration,
        tick: &Paired<'_>,
        shares: Shares<'_>,
        counters: &mut Counters,
        out: &mut CorrectedTick,
    ) -> Option<Felt<N>> {
        let count = calibration.accels.len();
        let (Some(orientation), Some(axes)) = (&calibration.accel_orientation, &self.thermal.accel_axes)
        else {
            out.accel_flags.clear();
            return None;
        };
        let Some(raw) = tick.accel else {
            out.accel_flags = of_sensors([SensorFlags::empty(); MAX_SENSORS], count);
            out.flags |= TickFlags::ACCELEROMETER_MISSING | TickFlags::VELOCITY_INVALID;
            counters.accel_missing += 1;
            if let Some(held) = &mut self.motion.held {
                held.miss_accels();
            }
            return None;
        };
        // The corrected tick has the gyro tick's time.
        let (time, duration_s) = (out.end_time, raw.duration.as_s());
        if raw.duration != out.duration && differ(raw.duration, out.duration) {
            out.flags |= TickFlags::VELOCITY_INVALID;
        }
        let terms = self.accel_terms::<N>(shares);
        let readings = raw.readings.lanes::<N>();
        let output = calibration.accel_output;
        let mut forces = sensed(&terms, output, *readings, duration_s);

        let mut usable = axes.included();
        let within = within(readings, narrow(&calibration.accel_limits));
        let mut flags = SOUND;
        self.accel_health.ticks += 1;
        if self.calm.sound[1] & within {
            put(&mut self.last_forces, forces);
        } else {
            let (mut patched, mut counted) = (*readings, usable);
            let patch = (&mut patched, &calibration.accel_limits, count);
            let (found, numbers) = self.thermal.accel_footing.patch(time, patch, &mut counted, counters);
            (usable, flags) = (counted, found);
            let (felt, last): (_, [f64; N]) =
                (sensed(&terms, output, patched, duration_s), *narrow(&self.last_forces));
            let felt: [f64; N] = array::from_fn(|i| if numbers.contains(i) { felt[i] } else { last[i] });
            let taken = SensorFlags::OVERRANGE | SensorFlags::NOT_FINITE;
            let good: [f64; N] =
                array::from_fn(|i| if flags[i].intersects(taken) { last[i] } else { felt[i] });
            put(&mut self.last_forces, good);
            forces = felt;
            self.accel_health.note(flags);
        }
        let seen = &mut self.seen.accels;
        seen.count = count;
        put(&mut seen.reading, *readings);
        seen.flags = flags;
        out.accel_flags = of_sensors(flags, count);
        let mut comparable = true;
        if self.calm.needs.intersects(Needs::SQUARES.union(Needs::DELAYS)) {
            let (mut left, mut counted) = (forces, usable);
            if self.calm.needs.contains(Needs::SQUARES) {
                self.remove_squares(shares, &mut left);
            }
            if self.calm.needs.contains(Needs::DELAYS) {
                comparable = self.hold_accels_back(calibration, tick, duration_s, (&mut left, &mut counted));
                withdraw(&mut out.accel_flags, counted);
            }
            (forces, usable) = (left, counted);
        }
        let mut felt = Felt { forces, usable, comparable, duration_s, inverse: None };
        if self.calm.needs.contains(Needs::FORCE) {
            felt.inverse = self.note_force(orientation, (forces, usable), time);
        }
        Some(felt)
    }

    /// Resolves what the accelerometers feel in case axes, and watches its parity.
    #[inline(always)]
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    pub(super) fn resolve_force<const N: usize>(
        &mut self,
        calibration: &Calibration,
        Felt { forces, usable, comparable, duration_s, inverse }: Felt<N>,
        counters: &mut Counters,
        out: &mut CorrectedTick,
    ) {
        let Some(orientation) = &calibration.accel_orientation else { return };
        let forces = if self.calm.needs.contains(Needs::POSITIONS) {
            self.remove_size_effect(calibration, orientation, out, forces)
        } else {
            forces
        };
        let Some(axes) = &mut self.thermal.accel_axes else { return };
        let time = out.end_time;
        let sensors = orientation.sensors();
        let mut excluded = false;
        if sensors > MIN_SENSORS && !comparable {
            out.accel_parity.clear();
        } else if sensors > MIN_SENSORS {
            let watched = forces;
            let left_over = (&mut out.accel_parity, &mut out.flags);
            excluded = axes.watch(orientation, usable, &watched[..sensors], left_over);
        }
        let (force, trusted) = axes.resolve(orientation, usable, (&forces, inverse), time);
        let force = self.slewing().map_or(force, |slewing| {
            let (old, forces) = (slewing.from.accel_axes.as_ref(), forces);
            slewing.axes(force, old, usable, &forces[..sensors])
        });
        out.delta_velocity = force.map(|f| f * duration_s);
        if !trusted {
            out.flags |= TickFlags::VELOCITY_INVALID;
        }
        self.seen.specific_force = trusted.then_some(force);
        if excluded {
            self.exclude(calibration, counters);
        }
    }
}
