//! The accelerometers' part of a tick: bias, scale factor, board ratio, case axes.

use super::gyros::UNSOUND;
use super::{Corrector, of_length, resolve, watch_parity};
use crate::calibration::Calibration;
use crate::observation::AccelSeen;
use crate::sample::{AccelTick, CorrectedTick, MAX_SENSORS, OutputKind, SensorFlags, TickFlags};
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
        self.seen.specific_force = None;
        let Some(orientation) = &calibration.accel_orientation else {
            self.seen.accels.clear();
            out.accel_flags.clear();
            return;
        };
        let Some(tick) = accel else {
            self.seen.accels.clear();
            out.flags |= TickFlags::ACCELEROMETER_MISSING | TickFlags::VELOCITY_INVALID;
            of_length(&mut out.accel_flags, calibration.accels.len());
            out.accel_flags.fill(SensorFlags::empty());
            counters.accel_missing += 1;
            return;
        };
        let duration_s = tick.duration.as_s();
        let Some(axes) = &self.thermal.accel_axes else { return };
        let included = axes.included();
        let mut mask = included;
        let mut forces = [0.0; MAX_SENSORS];
        let count = calibration.accels.len();
        of_length(&mut self.seen.accels, count);
        of_length(&mut out.accel_flags, count);
        let slew = self.slew.as_ref().filter(|_| self.slew_share > 0.0);
        let (
            Some(thermals),
            Some(footings),
            Some(last_forces),
            Some(healths),
            Some(seen),
            Some(all_flags),
            Some(readings),
            Some(forces),
        ) = (
            self.thermal.accels.get(..count),
            self.thermal.footings.accels.get(..count),
            self.last_forces.get_mut(..count),
            self.accel_health.get_mut(..count),
            self.seen.accels.get_mut(..count),
            out.accel_flags.get_mut(..count),
            tick.readings.get(..count),
            forces.get_mut(..count),
        )
        else {
            return;
        };
        for (i, model) in calibration.accels.iter().enumerate() {
            let terms = thermals[i].at(time);
            let terms = slew.map_or(terms, |slew| slew.accel(i, terms, self.slew_share));
            let mut flags = footings[i].flags(time);
            if !included.contains(i) {
                flags |= SensorFlags::EXCLUDED;
            }
            let (reading, limit) = (readings[i], model.input_limit);
            let force = if reading.is_finite() {
                if reading.abs() >= limit {
                    flags |= SensorFlags::OVERRANGE;
                    counters.overrange_readings += 1;
                }
                let reading = reading.clamp(-limit, limit);
                terms.specific_force(match calibration.accel_output {
                    OutputKind::Counts => reading / duration_s,
                    OutputKind::Mean => reading,
                })
            } else {
                flags |= SensorFlags::NOT_FINITE;
                counters.not_finite_readings += 1;
                last_forces[i]
            };
            if flags.intersects(SensorFlags::OVERRANGE | SensorFlags::NOT_FINITE) {
                mask = mask.without(i);
            } else {
                last_forces[i] = force;
            }
            if flags.intersects(UNSOUND) {
                flags -= SensorFlags::VALID;
            }
            forces[i] = force;
            all_flags[i] = flags;
            healths[i].note(flags);
            seen[i] = AccelSeen { reading, flags };
        }
        let Some(axes) = &mut self.thermal.accel_axes else { return };
        let told = (&mut out.accel_parity, &mut out.flags);
        watch_parity(axes, orientation, (mask, forces), told, counters);
        let (force, trusted) = resolve(axes, orientation, mask, forces, time);
        let slewed_from = self.slew.as_ref().and_then(|slew| slew.accel_axes.as_ref());
        let force = crate::unit::slew::axes(force, slewed_from, mask, forces, self.slew_share);
        out.delta_velocity = force.map(|f| f * duration_s);
        out.flags.set(TickFlags::VELOCITY_INVALID, !trusted);
        self.seen.specific_force = trusted.then_some(force);
    }
}
