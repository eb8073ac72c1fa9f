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
mod footing;
mod gyro_intake;
mod health;
mod operating;
mod release;
mod room;
mod settings;
mod slew;
mod thermal_memory;
mod view;

use alloc::sync::Arc;

use serde::{Deserialize, Serialize};

use accel_intake::AccelIntake;
pub use at_rest::AtRest;
pub use change::{At, Change};
pub use correct::Applied;
use correct::{Corrector, Takeover};
pub use counters::Counters;
use gyro_intake::GyroIntake;
pub use health::SensorHealth;
use operating::Operating;
pub use operating::PreLaunchView;
pub use room::Room;
pub use settings::{Uncalibrated, UnitSettings};
pub use thermal_memory::ChannelReport;
use thermal_memory::Waiting;

use crate::calibration::Calibration;
use crate::drift::{DriftSettings, Reference};
use crate::navigation::StepSum;
use crate::operation::{Command, HealthReading, Refusal, State};
use crate::sample::{AccelTick, CorrectedTick, GyroTick, OutputKind, TemperatureReading};
use crate::units::{Span, Timestamp};

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
    /// Where a tick is corrected: no memory, only a place.
    #[serde(skip)]
    corrected: CorrectedTick,
    /// No tick takes the shorter way of plain ones.
    #[serde(skip)]
    general_path_only: bool,
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
            corrected: CorrectedTick::default(),
            general_path_only: false,
        }
    }

    /// The same unit, which corrects every tick by the general path: for comparing the two. Not part of its memory.
    #[must_use]
    pub fn by_general_path(mut self) -> Self {
        self.general_path_only = true;
        self
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
                let passed = self.pass_straight(output, ticks, emit);
                for tick in ticks.iter().skip(passed) {
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
                self.steps.flush(&self.settings.navigation, emit);
            }
        }
    }
}
