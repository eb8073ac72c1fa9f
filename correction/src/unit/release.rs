//! Ticks leave the unit: what fits the calibration, which tick need not wait any longer, and what is said with it.

use super::accel_intake::Pending;
use super::gyro_intake::Left;
use super::operating::Operating;
use super::{Active, Uncalibrated, Unit, correct};
use crate::calibration::Calibration;
use crate::sample::{CorrectedTick, GyroTick, OutputKind, TickFlags};
use crate::units::Timestamp;

/// A tick on its way into the correction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Released<'a> {
    pub(super) tick: &'a GyroTick,
    pub(super) output: OutputKind,
    pub(super) missed: u64,
    pub(super) restart: bool,
    /// It may be corrected by the plan of plain ticks.
    pub(super) plainly: bool,
}

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

    /// Gives out the first ticks of a batch that need not wait at all, as they are: each goes on where the one before it
    /// left off, and its accelerometers are at hand. How many.
    ///
    /// What comes out is what [`release`](Self::release) gives once they have been admitted.
    pub(super) fn pass_straight(
        &mut self,
        output: OutputKind,
        ticks: &[GyroTick],
        emit: &mut dyn FnMut(&CorrectedTick),
    ) -> usize {
        let takes = |active: &Active| {
            let calibration = &active.calibration;
            (calibration.gyro_output(), calibration.gyro_count(), calibration.accel_count() > 0)
        };
        let Some((need_output, need_sensors, expects_accel)) = self.active.as_ref().map(takes) else {
            return 0;
        };
        if output != need_output || self.pending.is_some() {
            return 0;
        }
        // Out of the unit meanwhile, so that accelerometer ticks are corrected where they stand.
        let mut accels = core::mem::take(&mut self.accels);
        let mut passed = 0;
        for tick in ticks {
            if tick.readings.len() != need_sensors || !self.gyros.goes_straight(tick) {
                break;
            }
            let accel = accels.meets(tick, &mut self.counters);
            if expects_accel && accel.is_none() {
                break;
            }
            let met = accel.is_some();
            self.counters.gyro_ticks_in += 1;
            self.gyros.went_straight(tick);
            let plainly = !self.general_path_only;
            let released = Released { tick, output, missed: 0, restart: false, plainly };
            self.correct_and_give_out(released, accel, emit);
            accels.gyro_released(tick.end_time, met);
            passed += 1;
        }
        self.accels = accels;
        passed
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
            let accel = self.accels.take(front.tick, &mut self.counters);
            if accel.is_none() && expects_accel && !front.expired {
                return;
            }
            let Some(Left { tick, output, missed, restart }) = self.gyros.release() else { return };
            self.accels.gyro_released(tick.end_time, false);
            // The run that a sequence number or a time was meant for is over with a restart.
            if let Some(change) = self.pending.take_if(|change| restart || change.at.is_due(&tick)) {
                self.take_effect(change);
            }
            let plainly = !self.general_path_only;
            let released = Released { tick: &tick, output, missed, restart, plainly };
            self.correct_and_give_out(released, accel.as_ref(), emit);
        }
    }

    /// Corrects one tick and gives it out.
    fn correct_and_give_out(
        &mut self,
        mut released: Released<'_>,
        accel: Option<&Pending>,
        emit: &mut dyn FnMut(&CorrectedTick),
    ) {
        // A swap since it came may have changed what fits.
        let accel = accel.filter(|Pending { tick, output, .. }| {
            self.fits(false, *output, tick.readings.len(), |c| (c.accel_output(), c.accel_count()))
        });
        let accel = accel.map(|accel| &accel.tick);
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
        let Released { tick, output, .. } = released;
        // A swap since it came may have changed what fits.
        let fits = self.fits(false, output, tick.readings.len(), |c| (c.gyro_output(), c.gyro_count()));
        let turn_on = *self.turn_on.get_or_insert(tick.end_time);
        let settings = &self.settings;
        let mut held = false;
        let corrected = &mut self.corrected;
        match &mut self.active {
            Some(active) if fits => {
                active.corrector.correct(
                    &active.calibration,
                    (&released, accel),
                    turn_on,
                    (&mut self.waiting, settings.temperature_delay),
                    &mut self.counters,
                    corrected,
                );
                corrected.revision = active.revision;
                if self.operating.watches() {
                    watch(&mut self.operating, active, tick.end_time);
                }
            }
            Some(_) => {}
            None => {
                held = settings.uncalibrated == Uncalibrated::Hold;
                *corrected = correct::pass_through(tick, accel);
            }
        }
        held |= !self.operating.state().is_running();
        if held || (self.active.is_some() && !fits) {
            self.unannounced = missed.saturating_add(1);
            self.restart_due = restart;
            if self.active.is_none() || !fits {
                self.unseen = (released.missed.saturating_add(1), released.restart);
            }
            self.counters.ticks_held += u64::from(held);
            return;
        }
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
        self.steps.push(&settings.navigation, corrected, emit);
    }
}

/// Shows a corrected tick to those who watch the unit.
fn watch(operating: &mut Operating, active: &mut Active, time: Timestamp) {
    let temperature = |name: &_| active.corrector.thermal().alive(&active.calibration, name, time);
    let in_force = (&*active.calibration, active.revision);
    let reference = operating.observe(&active.corrector.seen, in_force, &temperature);
    if let Some(reference) = reference {
        // What is refused is counted.
        let _ = active.corrector.drift.submit_at_rest(&reference);
    }
}
