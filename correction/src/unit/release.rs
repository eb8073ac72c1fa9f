//! Ticks leave the unit: what fits the calibration, which tick need not wait any longer, and what is said with it.

use super::accel_intake::Match;
use super::gyro_intake::Released;
use super::{Uncalibrated, Unit, correct};
use crate::calibration::Calibration;
use crate::sample::{AccelTick, CorrectedTick, OutputKind, TickFlags};

impl Unit {
    /// Checks kind and number of readings against the calibration, if there is one: the one in force, or the one that waits.
    pub(super) fn fits(
        &mut self,
        waiting: bool,
        output: OutputKind,
        sensors: usize,
        expect: fn(&Calibration) -> (OutputKind, usize),
    ) -> bool {
        let in_force = self.active.as_ref().map(|active| &active.calibration);
        let calibration =
            self.pending.as_ref().filter(|_| waiting).map(|change| &change.calibration).or(in_force);
        let Some((need_output, need_sensors)) = calibration.map(|calibration| expect(calibration)) else {
            return true;
        };
        if sensors != need_sensors {
            self.counters.wrong_sensor_count += 1;
            return false;
        }
        if output != need_output {
            self.counters.wrong_output_kind += 1;
            return false;
        }
        true
    }

    /// Whether the calibration that waits takes accelerometer readings of this kind and number.
    pub(super) fn pending_takes_accels(&self, output: OutputKind, sensors: usize) -> bool {
        let waiting = self.pending.as_ref().map(|change| &change.calibration);
        waiting.is_some_and(|waiting| (waiting.accel_output(), waiting.accel_count()) == (output, sensors))
    }

    /// Gives out every tick that need not wait any longer.
    pub(super) fn release(&mut self, flushing: bool, emit: &mut dyn FnMut(&CorrectedTick)) {
        while let Some(front) = self.gyros.front(self.settings.pairing_window, flushing) {
            if front.restart {
                self.accels.starts_anew(front.tick.end_time, &mut self.counters);
            }
            // Whether a unit without calibration has accelerometers is not known: it waits as if it had.
            let expects_accel =
                self.active.as_ref().is_none_or(|active| active.calibration.accel_count() > 0);
            let accel = match self.accels.take(front.tick, &mut self.counters) {
                Match::Found(accel, output) => Some((accel, output)),
                Match::NotYet if expects_accel && !front.expired => return,
                Match::NotYet => None,
            };
            let Some(released) = self.gyros.release() else { return };
            self.accels.gyro_released(released.tick.end_time);
            // The run that a sequence number or a time was meant for is over with a restart.
            if let Some(change) =
                self.pending.take_if(|change| released.restart || change.at.is_due(&released.tick))
            {
                self.take_effect(change);
            }
            // A swap since it came may have changed what fits.
            let accel = accel.filter(|(accel, output)| {
                self.fits(false, *output, accel.readings.len(), |c| (c.accel_output(), c.accel_count()))
            });
            self.give_out(released, accel.as_ref().map(|(accel, _)| accel), emit);
        }
    }

    /// Corrects one tick and gives it out.
    fn give_out(
        &mut self,
        mut released: Released,
        accel: Option<&AccelTick>,
        emit: &mut dyn FnMut(&CorrectedTick),
    ) {
        self.last_end = released.tick.end_time;
        if released.restart {
            self.waiting.restart(self.last_end);
            self.turn_on = None;
        }
        // What the consumer has not been told, and what the corrector has not seen: a tick that is held back in standby
        // is unknown to the one and not to the other.
        let restart = released.restart | core::mem::take(&mut self.restart_due);
        let missed = released.missed.saturating_add(core::mem::take(&mut self.unannounced));
        let (unseen, restart_unseen) = core::mem::take(&mut self.unseen);
        released.missed = released.missed.saturating_add(unseen);
        released.restart |= restart_unseen;
        let Released { tick, output, .. } = &released;
        // A swap since it came may have changed what fits.
        let fits = self.fits(false, *output, tick.readings.len(), |c| (c.gyro_output(), c.gyro_count()));
        let turn_on = *self.turn_on.get_or_insert(tick.end_time);
        let settings = &self.settings;
        let mut held = false;
        let corrected = match &mut self.active {
            Some(active) if fits => {
                let mut corrected = active.corrector.correct(
                    &active.calibration,
                    &released,
                    turn_on,
                    accel,
                    (&mut self.waiting, settings.temperature_delay),
                    &mut self.counters,
                );
                corrected.revision = active.revision;
                let temperature =
                    |name: &_| active.corrector.thermal().alive(&active.calibration, name, tick.end_time);
                let in_force = (&*active.calibration, active.revision);
                let reference = self.operating.observe(&active.corrector.seen, in_force, &temperature);
                if let Some(reference) = reference {
                    // What is refused is counted.
                    let _ = active.corrector.drift.submit_at_rest(&reference);
                }
                Some(corrected)
            }
            Some(_) => None,
            None => {
                held = settings.uncalibrated == Uncalibrated::Hold;
                Some(correct::pass_through(tick, accel))
            }
        };
        held |= !self.operating.state().is_running();
        let Some(mut corrected) = corrected.filter(|_| !held) else {
            self.unannounced = missed.saturating_add(1);
            self.restart_due = restart;
            if self.active.is_none() || !fits {
                self.unseen = (released.missed.saturating_add(1), released.restart);
            }
            self.counters.ticks_held += u64::from(held);
            return;
        };
        corrected.missed = missed;
        if corrected.missed > 0 {
            corrected.flags |= TickFlags::GAP;
            self.counters.gaps += 1;
            self.counters.ticks_missed = self.counters.ticks_missed.saturating_add(corrected.missed);
        }
        if restart {
            corrected.flags |= TickFlags::RESTART;
        }
        self.counters.ticks_out += 1;
        self.steps.push(&settings.navigation, &corrected, &mut |tick| emit(&tick));
    }
}
