//! The per-unit state machine: events with their own timestamps in, corrected ticks out.
//!
//! The contract:
//!
//! 1. [`Unit::handle`] takes one [`Event`] and hands each corrected tick that it releases to `emit`, in order.
//! 2. [`Unit::schedule`] gives the unit a calibration; it takes effect at a tick boundary, which the space between two
//!    calls of `handle` always is. [`Unit::command`] moves it from state to state, likewise.
//! 3. Output depends on the events alone: gyro ticks wait for their accelerometer tick and for missing
//!    neighbours as long as *later ticks* say that the pairing window is open; a temperature reading takes effect for
//!    ticks that end after its time plus [`UnitSettings::temperature_delay`].
//! 4. [`Event::Flush`] ends the waiting. The owner sends it at the end of a log, or when a stream has stopped.
//! 5. No event, however broken, panics or stops the unit; what is refused is counted and announced as a gap.

mod accel_intake;
mod at_rest;
mod axes;
mod change;
mod correct;
mod counters;
mod gyro_intake;
mod health;
mod operating;
mod slew;
mod thermal_memory;
mod view;

use alloc::sync::Arc;

use serde::{Deserialize, Serialize};

use accel_intake::{AccelIntake, Match};
pub use at_rest::AtRest;
pub use change::{At, Change};
pub use correct::Applied;
use correct::{Corrector, Takeover};
pub use counters::Counters;
use gyro_intake::{GyroIntake, Released};
pub use health::SensorHealth;
use operating::Operating;
pub use operating::PreLaunchView;
pub use thermal_memory::ChannelReport;
use thermal_memory::Waiting;

use crate::calibration::Calibration;
use crate::drift::{DriftSettings, Reference};
use crate::navigation::{NavigationStep, StepSum};
use crate::operation::{Command, HealthReading, Refusal, State};
use crate::sample::{AccelTick, CorrectedTick, GyroTick, OutputKind, TemperatureReading, TickFlags};
use crate::units::{Span, Timestamp};

/// What a unit does without a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Uncalibrated {
    /// The first three raw gyro and accelerometer readings go out as they are, unscaled and flagged: neither radians
    /// nor metres per second.
    PassThrough,
    /// Nothing goes out; the ticks are announced as missing once a calibration is there.
    Hold,
}

/// Settings of a unit that are not part of its calibration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UnitSettings {
    /// How long, in event time, a gyro tick waits for its accelerometer tick or a missing neighbour.
    pub pairing_window: Span,
    /// A temperature reading takes effect for ticks that end after its time plus this.
    pub temperature_delay: Span,
    /// What to do without a calibration.
    pub uncalibrated: Uncalibrated,
    /// Whether the unit begins in standby; otherwise it runs at once.
    pub in_standby: bool,
    /// Whether the estimated drift is subtracted; it is published in any case.
    pub subtract_drift: bool,
    /// A reference takes effect for ticks that end after its end plus this.
    pub reference_delay: Span,
    /// Summation of ticks to navigation steps.
    pub navigation: NavigationStep,
}

impl Default for UnitSettings {
    fn default() -> Self {
        Self {
            pairing_window: Span::from_ms(50),
            temperature_delay: Span::from_ms(50),
            uncalibrated: Uncalibrated::PassThrough,
            in_standby: false,
            subtract_drift: false,
            reference_delay: Span::from_ms(1000),
            navigation: NavigationStep::default(),
        }
    }
}

/// What can happen to a unit.
#[derive(Debug, Clone, Copy)]
pub enum Event<'a> {
    /// Raw gyro ticks, consecutive or not.
    Gyro {
        /// What their readings stand for.
        output: OutputKind,
        /// The ticks of one batch.
        ticks: &'a [GyroTick],
    },
    /// Raw accelerometer ticks.
    Accel {
        /// What their readings stand for.
        output: OutputKind,
        /// The ticks of one batch.
        ticks: &'a [AccelTick],
    },
    /// Temperature readings.
    Temperature(&'a [TemperatureReading]),
    /// What the producer reports of itself.
    Health(&'a [HealthReading]),
    /// The true rate of the case over a span, for the drift estimator.
    Reference(&'a Reference),
    /// Nothing more is to be waited for.
    Flush,
}

/// A calibration in force, with the memory that belongs to it.
#[derive(Debug, Serialize, Deserialize)]
struct Active {
    #[serde(with = "crate::written::shared")]
    calibration: Arc<Calibration>,
    corrector: Corrector,
    revision: u64,
}

/// One unit.
#[derive(Debug, Serialize, Deserialize)]
pub struct Unit {
    settings: UnitSettings,
    active: Option<Active>,
    pending: Option<Change>,
    operating: Operating,
    gyros: GyroIntake,
    accels: AccelIntake,
    waiting: Waiting,
    steps: StepSum,
    counters: Counters,
    /// Ticks that left the intake and were neither given out nor announced.
    unannounced: u64,
    /// Ticks that left the intake without being corrected, and whether the producer restarted at one of them.
    unseen: (u64, bool),
    /// The next output must announce a restart that fell on a tick which was held back.
    restart_due: bool,
    /// End of the first tick since the unit appeared or its producer restarted.
    turn_on: Option<Timestamp>,
    last_end: Timestamp,
}

impl Unit {
    /// A unit that has seen nothing and has no calibration.
    #[must_use]
    pub fn new(settings: UnitSettings) -> Self {
        Self {
            settings,
            active: None,
            pending: None,
            operating: Operating::new(settings.in_standby),
            gyros: GyroIntake::default(),
            accels: AccelIntake::default(),
            waiting: Waiting::default(),
            steps: StepSum::new(),
            counters: Counters::default(),
            unannounced: 0,
            unseen: (0, false),
            restart_due: false,
            turn_on: None,
            last_end: Timestamp::default(),
        }
    }

    /// Puts a calibration in force from the next tick on, at once. Running state that still means the same is kept.
    pub fn install(&mut self, calibration: Arc<Calibration>, revision: u64) {
        self.schedule(Change { calibration, revision, at: At::NextTick, slew: Span::ZERO });
    }

    /// Has a calibration take effect; running state that still means the same is kept.
    ///
    /// Gives the revision counter of a change that was waiting and is replaced by this one.
    pub fn schedule(&mut self, change: Change) -> Option<u64> {
        let replaced = self.pending.take().map(|change| change.revision);
        if change.at == At::NextTick {
            self.take_effect(change);
        } else {
            self.pending = Some(change);
        }
        replaced
    }

    /// Puts a change in force, before the next tick.
    fn take_effect(&mut self, change: Change) {
        let Change { calibration, revision, slew, .. } = change;
        let since_turn_on_s = self.turn_on.map_or(0.0, |turn_on| self.last_end.seconds_from(turn_on));
        // A unit that has given nothing out has nothing to move away from.
        let slew = if self.turn_on.is_some() { slew } else { Span::ZERO };
        let before = self.active.take();
        let kept = before.map(|active| (active.calibration, active.corrector));
        let UnitSettings { reference_delay: delay, subtract_drift: subtract, .. } = self.settings;
        let drift = DriftSettings { delay, subtract };
        let takeover = Takeover { now: self.last_end, since_turn_on_s, slew, drift };
        let corrector = Corrector::new(&calibration, kept, takeover);
        self.operating.calibration_changed(&calibration);
        self.active = Some(Active { calibration, corrector, revision });
    }

    /// Carries a command out before the next tick; the state that it leads to.
    ///
    /// # Errors
    /// [`Refusal`]: the state is as before.
    pub fn command(&mut self, command: &Command) -> Result<State, Refusal> {
        let in_force = self.active.as_ref().map(|active| (&*active.calibration, active.revision));
        self.operating.command(command, in_force)
    }

    /// Takes one event; every corrected tick that it releases goes to `emit`.
    pub fn handle(&mut self, event: Event<'_>, emit: &mut dyn FnMut(&CorrectedTick)) {
        match event {
            Event::Gyro { output, ticks } => {
                let mut starts_anew = false;
                for tick in ticks {
                    self.counters.gyro_ticks_in += 1;
                    let due = self.pending.as_ref().is_some_and(|change| change.at.is_due(tick));
                    if self.fits(due, output, tick.readings.len(), |c| (c.gyro_output(), c.gyro_count())) {
                        starts_anew |= self.gyros.admit(tick, output, &mut self.counters);
                    }
                }
                self.gyros.end_batch();
                if starts_anew {
                    self.accels.sets_apart();
                } else {
                    self.accels.goes_on();
                }
                self.release(false, emit);
            }
            Event::Accel { output, ticks } => {
                for tick in ticks {
                    self.counters.accel_ticks_in += 1;
                    // Which gyro tick it will go with is not known yet.
                    let due = match self.pending.as_ref().map(|change| change.at) {
                        Some(At::Time(time)) => tick.end_time >= time,
                        Some(At::Sequence(_)) => self.pending_takes_accels(output, tick.readings.len()),
                        Some(At::NextTick) | None => false,
                    };
                    if self.fits(due, output, tick.readings.len(), |c| (c.accel_output(), c.accel_count())) {
                        self.accels.admit(tick, output, &mut self.counters);
                    }
                }
                self.release(false, emit);
            }
            Event::Temperature(readings) => {
                for reading in readings {
                    self.counters.temperature_readings_in += 1;
                    if reading.time + self.settings.temperature_delay < self.last_end {
                        self.counters.temperature_late += 1;
                    }
                    self.waiting.push(reading, &mut self.counters);
                }
            }
            Event::Health(readings) => readings.iter().for_each(|reading| self.operating.health(reading)),
            Event::Reference(reference) => {
                if let Some(active) = &mut self.active {
                    // What is refused is counted.
                    let _ = active.corrector.drift.submit(reference);
                }
            }
            Event::Flush => {
                self.release(true, emit);
                self.steps.flush(&self.settings.navigation, &mut |tick| emit(&tick));
            }
        }
    }

    /// Checks kind and number of readings against the calibration, if there is one: the one in force, or the one that waits.
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

    /// Whether the calibration that waits takes accelerometer readings of this kind and number.
    fn pending_takes_accels(&self, output: OutputKind, sensors: usize) -> bool {
        let waiting = self.pending.as_ref().map(|change| &change.calibration);
        waiting.is_some_and(|waiting| (waiting.accel_output(), waiting.accel_count()) == (output, sensors))
    }

    /// Gives out every tick that need not wait any longer.
    fn release(&mut self, flushing: bool, emit: &mut dyn FnMut(&CorrectedTick)) {
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
