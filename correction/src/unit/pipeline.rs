//! Ticks in their order go through the corrector and out: what fits the calibration, when a change takes effect, and what is
//! announced with a tick.

use alloc::boxed::Box;
use alloc::sync::Arc;

use serde::{Deserialize, Serialize};

use super::accel_intake::PendingAccel;
use super::change::{At, Change};
use super::correct::{Corrector, Paired, Takeover, pass_through};
use super::counters::Counters;
use super::gyro_intake::Break;
use super::operating::Operating;
use super::settings::{Uncalibrated, UnitSettings};
use super::thermal_memory::Waiting;
use crate::calibration::Calibration;
use crate::drift::DriftSettings;
use crate::navigation::StepSum;
use crate::sample::{AccelTick, CorrectedTick, GyroTick, OutputKind, TemperatureReading, TickFlags};
use crate::sigma::SigmaMemory;
use crate::units::{Span, Timestamp};

/// A calibration in force, with the memory that belongs to it.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Active {
    #[serde(with = "crate::written::shared")]
    pub(super) calibration: Arc<Calibration>,
    pub(super) corrector: Corrector,
    pub(super) revision: u64,
    /// `None` where σ is not asked for.
    sigma: Option<Box<SigmaMemory>>,
}

/// Gyro ticks that leave the intake together, in their order: nothing lies between them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run<'a> {
    pub(super) ticks: &'a [GyroTick],
    /// The accelerometer tick of each; none, where there is none for the first.
    pub(super) accels: &'a [PendingAccel],
    /// What lies before the first.
    pub(super) before: Break,
}

/// Everything that a tick passes between the intake and the owner of the unit.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Pipeline {
    pub(super) settings: UnitSettings,
    pub(super) active: Option<Active>,
    pub(super) pending: Option<Change>,
    pub(super) operating: Operating,
    pub(super) waiting: Waiting,
    pub(super) steps: StepSum,
    pub(super) counters: Counters,
    /// What the next output must announce of ticks that left the intake and were not given out.
    unannounced: Break,
    /// What the corrector has not seen: ticks that left the intake without being corrected.
    unseen: Break,
    /// End of the first tick since the unit appeared or its producer restarted.
    turn_on: Option<Timestamp>,
    pub(super) last_end: Timestamp,
    /// Where a tick is corrected: no memory, only a place.
    #[serde(skip)]
    corrected: CorrectedTick,
}

impl Pipeline {
    pub(super) fn new(settings: UnitSettings) -> Self {
        Self { settings, operating: Operating::new(settings.in_standby), ..Self::default() }
    }

    /// Puts a change in force, before the next tick.
    pub(super) fn take_effect(&mut self, change: Change) {
        let Change { calibration, revision, slew, .. } = change;
        let since_turn_on_s = self.turn_on.map_or(0.0, |turn_on| self.last_end.seconds_from(turn_on));
        // A unit that has given nothing out has nothing to move away from.
        let slew = if self.turn_on.is_some() { slew } else { Span::ZERO };
        let (kept, kept_sigma) =
            self.active.take().map(|active| ((active.calibration, active.corrector), active.sigma)).unzip();
        let UnitSettings { reference_delay: delay, subtract_drift: subtract, .. } = self.settings;
        let drift = DriftSettings { delay, subtract };
        let takeover = Takeover { now: self.last_end, since_turn_on_s, slew, drift };
        let corrector = Corrector::new(&calibration, kept, takeover);
        self.operating.calibration_changed(&calibration);
        // Ticks without σ and parity must not go out with those of the last one.
        self.corrected = CorrectedTick::default();
        let kept = kept_sigma.flatten();
        let sigma = calibration.sigma.as_ref().map(|_| kept.unwrap_or_default());
        self.active = Some(Active { calibration, corrector, revision, sigma });
    }

    /// Takes temperature readings, which wait for the first tick that is to feel them.
    pub(super) fn take_temperatures(&mut self, readings: &[TemperatureReading]) {
        for reading in readings {
            self.counters.temperature_readings_in += 1;
            self.waiting.push(reading, &mut self.counters);
        }
        if let Some(active) = &mut self.active {
            active.corrector.disturb();
        }
    }

    /// End of the last tick; `None` before the first.
    pub(super) fn now(&self) -> Option<Timestamp> {
        self.turn_on.map(|_| self.last_end)
    }

    /// Whether a gyro tick fits the calibration that will correct it, as things stand.
    #[inline]
    pub(super) fn takes_gyro(&mut self, tick: &GyroTick, output: OutputKind) -> bool {
        let due = self.pending.as_ref().is_some_and(|change| change.at.is_due(tick));
        self.fits(due, output, tick.readings.len(), |c| (c.gyro_output(), c.gyro_count()))
    }

    /// Whether an accelerometer tick fits the calibration that will correct it.
    #[inline]
    pub(super) fn takes_accel(&mut self, tick: &AccelTick, output: OutputKind) -> bool {
        let sensors = tick.readings.len();
        // Which gyro tick it will go with is not known yet.
        let due = self.pending.as_ref().is_some_and(|change| match change.at {
            At::TimeNs(time_ns) => tick.end_time.as_ns() >= time_ns,
            At::Sequence(_) => {
                let waiting = &change.calibration;
                (waiting.accel_output(), waiting.accel_count()) == (output, sensors)
            }
            At::NextTick => false,
        });
        self.fits(due, output, sensors, |c| (c.accel_output(), c.accel_count()))
    }

    /// Checks kind and number of readings against the calibration, if there is one: the one in force, or the one that waits.
    #[inline]
    fn fits(
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

    /// The calibration in force, where no change waits.
    #[inline]
    pub(super) fn settled(&self) -> Option<&Calibration> {
        self.active.as_ref().filter(|_| self.pending.is_none()).map(|active| &*active.calibration)
    }

    /// Whether an accelerometer tick fits the calibration in force.
    pub(super) fn fits_accel(&mut self, accel: &PendingAccel) -> bool {
        self.fits(false, accel.output, accel.tick.readings.len(), |c| (c.accel_output(), c.accel_count()))
    }

    /// Whether a gyro tick cannot go without its accelerometers. Whether a unit without calibration has any is not known: it
    /// waits as if it had.
    pub(super) fn expects_accels(&self) -> bool {
        self.active.as_ref().is_none_or(|active| active.calibration.accel_count() > 0)
    }

    /// Has the change that waits take effect, where it is due at a tick.
    #[inline]
    pub(super) fn begin(&mut self, tick: &GyroTick, restart: bool) {
        // The run that a sequence number or a time was meant for is over with a restart.
        if self.pending.is_some()
            && let Some(change) = self.pending.take_if(|change| restart || change.at.is_due(tick))
        {
            self.take_effect(change);
        }
    }

    /// Corrects ticks and gives them out. `fits`: their readings are those that the calibration in force takes.
    pub(super) fn pass<E: FnMut(&CorrectedTick) + ?Sized>(
        &mut self,
        run: &Run<'_>,
        fits: bool,
        emit: &mut E,
    ) {
        let Some(first) = run.ticks.first() else { return };
        if run.before.restart {
            self.waiting.restart(first.end_time);
            self.turn_on = None;
        }
        let mut begins = self.turn_on.is_none();
        let turn_on = *self.turn_on.get_or_insert(first.end_time);
        let uncalibrated = self.active.is_none();
        let held = uncalibrated && self.settings.uncalibrated == Uncalibrated::Hold;
        let mut watches = self.operating.watches();
        // What the consumer has not been told, and what the corrector has not seen: a tick that is held back in standby
        // is unknown to the one and not to the other.
        let mut untold = run.before.after(core::mem::take(&mut self.unannounced));
        let mut unseen = run.before.after(core::mem::take(&mut self.unseen));
        let mut accels = run.accels.iter();
        let sums = self.steps.sums(self.settings.navigation);
        if let Some(active) = &self.active {
            let out = &mut self.corrected;
            (out.ticks, out.series, out.revision) = (1, first.series, active.revision);
        }
        for tick in run.ticks {
            let steps = !tick.follows(self.last_end) && !begins;
            begins = false;
            self.last_end = tick.end_time;
            let accel = accels.next().map(|accel| &accel.tick);
            match &mut self.active {
                Some(active) if fits => {
                    let tick = Paired { gyro: tick, accel, before: unseen, turn_on };
                    let waiting = (&mut self.waiting, self.settings.temperature_delay);
                    let (counters, out) = (&mut self.counters, &mut self.corrected);
                    active.corrector.correct(&active.calibration, &tick, waiting, counters, out);
                    unseen = Break::default();
                    if active.sigma.is_some() {
                        sigma(active, out, turn_on);
                    }
                    if watches {
                        watch(&mut self.operating, active, self.last_end);
                        watches = self.operating.watches();
                    }
                }
                Some(_) => {}
                None => self.corrected = pass_through(tick, accel),
            }
            let is_running = self.operating.state.is_running() && !held;
            if !is_running || !(fits || uncalibrated) {
                untold = untold.and_a_tick();
                if uncalibrated || !fits {
                    unseen = unseen.and_a_tick();
                }
                self.counters.ticks_held += u64::from(!is_running);
                continue;
            }
            self.corrected.missed = untold.missed;
            if (untold.missed > 0) | untold.restart | steps {
                self.announce(untold, steps);
            }
            (untold, unseen) = (Break::default(), Break::default());
            self.counters.ticks_out += 1;
            if sums {
                self.steps.push(&self.settings.navigation, &self.corrected, emit);
            } else {
                emit(&self.corrected);
            }
        }
        (self.unannounced, self.unseen) = (untold, unseen);
    }

    /// Flags what lies between a tick and the one that was given out before it.
    #[cold]
    fn announce(&mut self, untold: Break, steps: bool) {
        let flags = &mut self.corrected.flags;
        if untold.missed > 0 {
            *flags |= TickFlags::GAP;
            self.counters.gaps += 1;
            self.counters.ticks_missed = self.counters.ticks_missed.saturating_add(untold.missed);
        } else if steps {
            *flags |= TickFlags::TIME_STEP;
        }
        if untold.restart {
            *flags |= TickFlags::RESTART;
        }
    }
}

/// Says how far off the tick that was just corrected to `out` may be.
#[cold]
fn sigma(active: &mut Active, out: &mut CorrectedTick, turn_on: Timestamp) {
    let Active { calibration, corrector, sigma: Some(memory), .. } = active else { return };
    let calibration: &Calibration = calibration;
    let Some(model) = calibration.sigma.as_deref() else { return };
    let since_turn_on_s = out.end_time.seconds_from(turn_on);
    let sigma = corrector.sigma(memory, (calibration, model), out, since_turn_on_s);
    **out.sigma.get_or_insert_default() = sigma;
}

/// Shows a corrected tick to those who watch the unit.
#[cold]
fn watch(operating: &mut Operating, active: &mut Active, time: Timestamp) {
    let temperature = |name: &_| active.corrector.thermal().alive(&active.calibration, name, time);
    let in_force = (&*active.calibration, active.revision);
    let reference = operating.observe(&active.corrector.seen, in_force, &temperature);
    if let Some(reference) = reference {
        active.corrector.refer(&reference, true);
    }
}
