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
mod pipeline;
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
pub use counters::Counters;
pub use gyro_intake::MAX_TICK_DURATION;
use gyro_intake::{GyroIntake, Left};
pub use health::SensorHealth;
pub use operating::PreLaunchView;
use pipeline::{Pipeline, Released};
pub use settings::{Uncalibrated, UnitSettings};
pub use thermal_memory::ChannelReport;

use crate::calibration::Calibration;
use crate::drift::Reference;
use crate::operation::{Command, HealthReading, Refusal, State};
use crate::sample::{AccelTick, CorrectedTick, GyroTick, OutputKind, TemperatureReading};
use crate::units::Span;

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

/// One unit.
#[derive(Debug, Serialize, Deserialize)]
pub struct Unit {
    gyros: GyroIntake,
    accels: AccelIntake,
    pipeline: Pipeline,
}

impl Unit {
    /// A unit that has seen nothing and has no calibration.
    #[must_use]
    pub fn new(settings: UnitSettings) -> Self {
        Self {
            gyros: GyroIntake::default(),
            accels: AccelIntake::default(),
            pipeline: Pipeline::new(settings),
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
        let replaced = self.pipeline.pending.take().map(|change| change.revision);
        if change.at == At::NextTick {
            self.pipeline.take_effect(change);
        } else {
            self.pipeline.pending = Some(change);
        }
        replaced
    }

    /// Carries a command out before the next tick; the state that it leads to.
    ///
    /// # Errors
    /// [`Refusal`]: the state is as before.
    pub fn command(&mut self, command: &Command) -> Result<State, Refusal> {
        let in_force = self.pipeline.active.as_ref().map(|active| (&*active.calibration, active.revision));
        self.pipeline.operating.command(command, in_force)
    }

    /// Takes one event; every corrected tick that it releases goes to `emit`.
    pub fn handle<E: FnMut(&CorrectedTick) + ?Sized>(&mut self, event: Event<'_>, emit: &mut E) {
        let pipeline = &mut self.pipeline;
        match event {
            Event::Gyro { output, ticks } => self.take_gyros(output, ticks, emit),
            Event::Accel { output, ticks } => {
                for tick in ticks {
                    pipeline.counters.accel_ticks_in += 1;
                    if pipeline.takes_accel(tick, output) {
                        self.accels.admit(tick, output, &mut pipeline.counters);
                    }
                }
                self.release(false, emit);
            }
            Event::Temperature(readings) => pipeline.take_temperatures(readings),
            Event::Health(readings) => {
                for reading in readings {
                    pipeline.operating.health(reading);
                }
            }
            Event::Reference(reference) => {
                if let Some(active) = &mut pipeline.active {
                    // What is refused is counted.
                    let _ = active.corrector.drift.submit(reference);
                }
            }
            Event::Flush => {
                self.release(true, emit);
                self.pipeline.steps.flush(&self.pipeline.settings.navigation, emit);
            }
        }
    }

    /// Takes the gyro ticks of one batch.
    fn take_gyros<E: FnMut(&CorrectedTick) + ?Sized>(
        &mut self,
        output: OutputKind,
        ticks: &[GyroTick],
        emit: &mut E,
    ) {
        let mut starts_anew = false;
        for tick in ticks {
            self.pipeline.counters.gyro_ticks_in += 1;
            if !self.pipeline.takes_gyro(tick, output) {
                continue;
            }
            if self.gyros.is_next(tick) && self.pass_next(tick, emit) {
                continue;
            }
            starts_anew |= self.gyros.admit(tick, output, &mut self.pipeline.counters);
        }
        self.gyros.end_batch();
        if starts_anew {
            self.accels.sets_apart();
        } else {
            self.accels.goes_on();
        }
        self.release(false, emit);
    }

    /// Gives out a tick that is the next, where its accelerometers are at hand; whether they were.
    #[inline]
    fn pass_next<E: FnMut(&CorrectedTick) + ?Sized>(&mut self, tick: &GyroTick, emit: &mut E) -> bool {
        let accel = self.accels.partner(tick, &mut self.pipeline.counters);
        let met = accel.is_some();
        if !met && self.pipeline.expects_accels() {
            return false;
        }
        self.gyros.passed(tick);
        self.pipeline.begin(tick, false);
        self.pipeline.pass(Released { tick, missed: 0, restart: false }, true, accel, emit);
        self.accels.gyro_released(tick.end_time, met);
        true
    }

    /// Gives out every tick that waits and need not wait any longer.
    #[inline]
    fn release<E: FnMut(&CorrectedTick) + ?Sized>(&mut self, flushing: bool, emit: &mut E) {
        if !self.gyros.is_empty() {
            self.release_waiting(flushing, emit);
        }
    }

    fn release_waiting<E: FnMut(&CorrectedTick) + ?Sized>(&mut self, flushing: bool, emit: &mut E) {
        let window = self.pipeline.settings.pairing_window;
        while let Some(front) = self.gyros.front(window, flushing) {
            if front.restart {
                self.accels.starts_anew(front.tick.end_time, &mut self.pipeline.counters);
            }
            let accel = self.accels.partner(front.tick, &mut self.pipeline.counters);
            let met = accel.is_some();
            if !met && self.pipeline.expects_accels() && !front.expired {
                return;
            }
            let Some(Left { tick, output, missed, restart }) = self.gyros.release() else { return };
            self.pipeline.begin(&tick, restart);
            let fits = self.pipeline.takes_gyro(&tick, output);
            self.pipeline.pass(Released { tick: &tick, missed, restart }, fits, accel, emit);
            self.accels.gyro_released(tick.end_time, met);
        }
    }
}
