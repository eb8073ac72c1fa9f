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
mod flags;
mod gyro_intake;
mod operating;
mod pipeline;
mod settings;
mod slew;
mod thermal_memory;
mod view;

use alloc::sync::Arc;
use core::slice;

use serde::{Deserialize, Serialize};

use accel_intake::{AccelIntake, PendingAccel};
pub use at_rest::AtRest;
pub use change::{At, Change};
pub use correct::Applied;
pub use counters::Counters;
pub use flags::SensorHealth;
pub use gyro_intake::MAX_TICK_DURATION;
use gyro_intake::{Break, GyroIntake, Left};
pub use operating::PreLaunchView;
use pipeline::{Pipeline, Run};
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
                pipeline.counters.accel_ticks_in += ticks.len() as u64;
                let settled = pipeline.settled().filter(|calibration| calibration.accel_output == output);
                let fitting = settled.map(|calibration| calibration.accels.len());
                for tick in ticks {
                    if fitting == Some(tick.readings.len()) || pipeline.takes_accel(tick, output) {
                        self.accels.admit(tick, output, &mut pipeline.counters);
                    }
                }
                self.release(false, emit);
            }
            Event::Temperature(readings) => pipeline.take_temperatures(readings),
            Event::Health(readings) => {
                let now = pipeline.now();
                for reading in readings {
                    pipeline.operating.health(reading, now);
                }
            }
            Event::Reference(reference) => {
                if let Some(active) = &mut pipeline.active {
                    active.corrector.refer(reference, false);
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
        self.pipeline.counters.gyro_ticks_in += ticks.len() as u64;
        let mut starts_anew = false;
        let mut rest = ticks;
        while let Some((tick, others)) = rest.split_first() {
            let waiting = self.accels.waiting();
            let run = self.run(output, rest, waiting);
            if let Some((run, behind)) = rest.split_at_checked(run)
                && let Some(last) = run.last()
            {
                let accels = waiting.get(..run.len()).unwrap_or_default();
                let (end_time, met) = (last.end_time, accels.len());
                self.gyros.passed(run);
                self.pipeline.pass(&Run { ticks: run, accels, before: Break::default() }, true, emit);
                self.accels.gyros_released(end_time, met);
                rest = behind;
                continue;
            }
            if self.pipeline.takes_gyro(tick, output) {
                starts_anew |= self.gyros.admit(tick, output, &mut self.pipeline.counters);
            } else {
                self.gyros.refuse();
            }
            rest = others;
        }
        self.gyros.end_batch();
        if starts_anew {
            self.accels.sets_apart();
        } else {
            self.accels.goes_on(&mut self.pipeline.counters);
        }
        self.release(false, emit);
    }

    /// How many of these ticks need not wait: they go on where the last one left off, fit the calibration, and have their accelerometer
    /// ticks among those that wait, or there are no accelerometers.
    #[inline]
    fn run(&self, output: OutputKind, ticks: &[GyroTick], accels: &[PendingAccel]) -> usize {
        let Some(calibration) = self.pipeline.settled() else { return 0 };
        let accel_count = calibration.accels.len();
        if calibration.gyro_output != output || (accel_count == 0 && !accels.is_empty()) {
            return 0;
        }
        self.gyros.run(ticks, |index, tick| {
            let is_met = |accel: &PendingAccel| {
                let fits =
                    accel.tick.readings.len() == accel_count && accel.output == calibration.accel_output;
                fits && accel.ends_with(tick)
            };
            tick.readings.len() == calibration.gyros.len()
                && (accel_count == 0 || accels.get(index).is_some_and(is_met))
        })
    }

    /// Gives out every tick that waits and need not wait any longer.
    #[inline]
    fn release<E: FnMut(&CorrectedTick) + ?Sized>(&mut self, flushing: bool, emit: &mut E) {
        if !self.gyros.is_empty() {
            self.release_waiting(flushing, emit);
        }
    }

    #[inline(never)]
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
            let Some(Left { tick, output, before }) = self.gyros.release() else { return };
            self.pipeline.begin(&tick, before.restart);
            let fits = self.pipeline.takes_gyro(&tick, output);
            // A swap since it came may have changed what fits.
            let accel = accel.filter(|accel| self.pipeline.fits_accel(accel));
            let (ticks, accels) = (slice::from_ref(&tick), accel.map_or(&[][..], slice::from_ref));
            self.pipeline.pass(&Run { ticks, accels, before }, fits, emit);
            self.accels.gyros_released(tick.end_time, usize::from(met));
        }
    }
}
