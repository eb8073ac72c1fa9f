//! The accelerometers' part of a tick: bias, scale factor, board ratio, case axes.

use super::{Corrector, resolve};
use crate::calibration::Calibration;
use crate::sample::{AccelTick, CorrectedTick, MIN_SENSORS, OutputKind, SensorFlags, Sensors, TickFlags};
use crate::thermal::AccelTerms;
use crate::unit::counters::Counters;
use crate::units::Timestamp;

impl Corrector {
    /// The terms of an accelerometer in use.
    pub(super) fn accel_terms(&self, index: usize, time: Timestamp) -> Option<AccelTerms> {
        let terms = self.thermal.accels.get(index)?.at(time);
        let slew = self.slew.as_ref().filter(|_| self.slew_share > 0.0);
        Some(slew.map_or(terms, |slew| slew.accel(index, terms, self.slew_share)))
    }

    /// Corrects the accelerometers' readings of a tick.
    pub(super) fn accels(
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
        for (i, model) in calibration.accels.iter().enumerate() {
            let stale = self.thermal.stale(calibration, model.channel, time)
                || self.thermal.stale(calibration, model.board_channel, time);
            let mut flags = SensorFlags::VALID;
            let thermal = self.thermal.accels.get(i);
            let clamped = thermal.is_some_and(crate::thermal::AccelThermal::clamped);
            flags.set(SensorFlags::CLAMPED_TEMPERATURE, clamped || axes.clamped());
            flags.set(SensorFlags::STALE_TEMPERATURE, stale);
            flags.set(SensorFlags::EXCLUDED, axes.is_excluded(i));
            let reading = tick.readings.get(i).copied().unwrap_or(f64::NAN);
            let Some(terms) = self.accel_terms(i, time) else { continue };
            let force = if reading.is_finite() {
                if reading.abs() >= model.input_limit {
                    flags |= SensorFlags::OVERRANGE;
                    counters.overrange_readings += 1;
                }
                let reading = reading.clamp(-model.input_limit, model.input_limit);
                terms.specific_force(match calibration.accel_output {
                    OutputKind::Counts => reading / duration_s,
                    OutputKind::Mean => reading,
                })
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
        let slewed_from = self.slew.as_ref().and_then(|slew| slew.accel_axes.as_ref());
        let force = crate::unit::slew::axes(force, slewed_from, mask, &forces, self.slew_share);
        out.delta_velocity = force.map(|f| f * duration_s);
        out.flags.set(TickFlags::VELOCITY_INVALID, !trusted);
        self.seen.accel_readings.clone_from(&tick.readings);
        self.seen.specific_force = trusted.then_some(force);
    }
}
