//! The accelerometers' part of a tick: bias, scale factor, board ratio, case axes.

use core::array;

use super::patch::{Patch, SOUND, within};
use super::{Corrector, OnItsWay, of_sensors};
use crate::calibration::Calibration;
use crate::lanes::{narrow, put};
use crate::orientation::SensorMask;
use crate::sample::{CorrectedTick, MAX_SENSORS, MIN_SENSORS, OutputKind, SensorFlags, TickFlags};
use crate::thermal::Shares;
use crate::unit::counters::Counters;

/// Terms of the accelerometers at a tick: S and 1/K, and r of their boards.
pub(super) type AccelTerms<const N: usize> = ([[f64; N]; 2], [[f64; N]; 1]);

/// Specific force along the input axes in a tick (m/s²), a lane for each accelerometer.
pub(super) struct Felt<const N: usize> {
    pub(super) forces: [f64; N],
    /// Accelerometers whose reading counts.
    usable: SensorMask,
    /// Whether every reading is a number below its limit.
    pub(super) within: bool,
    /// Measured duration of their tick (s).
    duration_s: f64,
}

/// Specific force along the input axis of one accelerometer (m/s²) that reads this over a tick (models §3).
#[inline]
fn felt<const N: usize>(
    ([bias, per_scale_factor], [ratio]): &AccelTerms<N>,
    output: OutputKind,
    lane: usize,
    reading: f64,
    duration_s: f64,
) -> f64 {
    let output = match output {
        OutputKind::Counts => reading / duration_s,
        OutputKind::Mean => reading,
    };
    (output - bias[lane]) * ratio[lane] * per_scale_factor[lane]
}

impl Corrector {
    /// The terms of the accelerometers in use: S and 1/K, and r of their boards.
    #[expect(clippy::inline_always, reason = "once per tick: lanes that stay in registers")]
    #[inline(always)]
    pub(super) fn accel_terms<const N: usize>(&self, shares: &Shares) -> AccelTerms<N> {
        let (mut terms, mut board) =
            (self.thermal.accels.at::<N>(shares), self.thermal.boards.at::<N>(shares));
        if let Some(slewing) = self.slewing() {
            slewing.terms(&mut terms, &slewing.from.accels);
            slewing.terms(&mut board, &slewing.from.boards);
        }
        (terms, board)
    }

    /// What the accelerometers feel in a tick; `None` without accelerometers, or without their tick.
    #[inline]
    pub(super) fn accels_feel<const N: usize>(
        &mut self,
        calibration: &Calibration,
        tick: &OnItsWay<'_>,
        shares: &Shares,
        counters: &mut Counters,
        out: &mut CorrectedTick,
    ) -> Option<Felt<N>> {
        let count = calibration.accels.len();
        self.seen.specific_force = None;
        self.seen.accels.count = 0;
        let Some(axes) = &self.thermal.accel_axes else {
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
        let terms = self.accel_terms::<N>(shares);
        let readings = narrow::<N>(&raw.readings);
        let corrected =
            |lane: usize, reading: f64| felt(&terms, calibration.accel_output, lane, reading, duration_s);
        let mut forces: [f64; N] = array::from_fn(|i| corrected(i, readings[i]));

        let mut usable = axes.included();
        let footing = &self.thermal.accel_footing;
        let within = within(readings, narrow(&calibration.accel_limits));
        let flags = if footing.is_sound(time) & within {
            put(&mut self.last_forces, forces);
            self.accel_health.note_sound();
            SOUND
        } else {
            let limits = &calibration.accel_limits;
            let patch = Patch { count, readings: raw.readings(), limits, footing, time };
            let last = &self.last_forces;
            let flags = patch.apply(&mut usable, counters, |lane, reading| {
                forces[lane] = reading.map_or(last[lane], |reading| corrected(lane, reading));
            });
            let taken = SensorFlags::OVERRANGE | SensorFlags::NOT_FINITE;
            for lane in (0..count).filter(|lane| !flags[*lane].intersects(taken)) {
                self.last_forces[lane] = forces[lane];
            }
            self.accel_health.note(flags);
            flags
        };
        let seen = &mut self.seen.accels;
        seen.count = count;
        seen.reading = raw.readings;
        seen.flags = flags;
        out.accel_flags = of_sensors(flags, count);
        if self.moves {
            self.remove_squares(shares, &mut forces);
            if self.holds_back() {
                let held = (&mut forces, &mut usable);
                self.hold_accels_back(calibration, tick.released, duration_s, held);
            }
        }
        Some(Felt { forces, usable, within, duration_s })
    }

    /// Resolves what the accelerometers feel in case axes, and watches its parity.
    #[inline]
    pub(super) fn resolve_force<const N: usize>(
        &mut self,
        calibration: &Calibration,
        felt: &Felt<N>,
        missed: u64,
        counters: &mut Counters,
        out: &mut CorrectedTick,
    ) {
        let &Felt { mut forces, usable, duration_s, .. } = felt;
        if self.moves {
            self.remove_size_effect(calibration, missed, out, &mut forces);
        }
        let time = out.end_time;
        let (Some(orientation), Some(axes)) = (&calibration.accel_orientation, &mut self.thermal.accel_axes)
        else {
            return;
        };
        let excluded = orientation.sensors() > MIN_SENSORS
            && axes.watch(
                orientation,
                usable,
                &forces[..orientation.sensors()],
                (&mut out.accel_parity, &mut out.flags),
            );
        let (force, trusted) = axes.resolve(orientation, usable, &forces, time);
        let force = self.slewing().map_or(force, |slewing| {
            let old = slewing.from.accel_axes.as_ref();
            slewing.axes(force, old, usable, &forces[..orientation.sensors()])
        });
        out.delta_velocity = force.map(|f| f * duration_s);
        if !trusted {
            out.flags |= TickFlags::VELOCITY_INVALID;
        }
        self.seen.specific_force = trusted.then_some(force);
        if excluded {
            counters.sensors_excluded += 1;
            self.thermal.note_footing(calibration);
        }
    }
}
