//! The per-unit state machine: events with their own timestamps in, corrected ticks out.
//!
//! The contract:
//!
//! 1. [`Unit::handle`] takes one [`Event`] and hands each corrected tick that it releases to `emit`, in order.
//! 2. [`Unit::install`] gives the unit a calibration; it takes effect at a tick boundary, which the space between two
//!    calls of `handle` always is.
//! 3. Output depends on the events alone: gyro ticks wait for their accelerometer tick and for missing
//!    neighbours as long as *later ticks* say that the pairing window is open; a temperature reading takes effect for
//!    ticks that end after its time plus [`UnitSettings::temperature_delay`].
//! 4. [`Event::Flush`] ends the waiting. The owner sends it at the end of a log, or when a stream has stopped.
//! 5. No event, however broken, panics or stops the unit; what is refused is counted and announced as a gap.

mod accel_intake;
mod axes;
mod correct;
mod counters;
mod gyro_intake;
mod thermal_memory;

use alloc::sync::Arc;

use accel_intake::{AccelIntake, Match};
use correct::Corrector;
pub use counters::Counters;
use gyro_intake::{GyroIntake, Released};
pub use thermal_memory::ChannelReport;
use thermal_memory::Waiting;

use crate::calibration::Calibration;
use crate::navigation::{NavigationStep, StepSum};
use crate::sample::{AccelTick, CorrectedTick, GyroTick, OutputKind, TemperatureReading, TickFlags};
use crate::units::{Span, Timestamp};

/// What a unit does without a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Uncalibrated {
    /// The first three raw gyro and accelerometer readings go out as they are, unscaled and flagged: neither radians
    /// nor metres per second.
    PassThrough,
    /// Nothing goes out; the ticks are announced as missing once a calibration is there.
    Hold,
}

/// Settings of a unit that are not part of its calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitSettings {
    /// How long, in event time, a gyro tick waits for its accelerometer tick or a missing neighbour.
    pub pairing_window: Span,
    /// A temperature reading takes effect for ticks that end after its time plus this.
    pub temperature_delay: Span,
    /// What to do without a calibration.
    pub uncalibrated: Uncalibrated,
    /// Summation of ticks to navigation steps.
    pub navigation: NavigationStep,
}

impl Default for UnitSettings {
    fn default() -> Self {
        Self {
            pairing_window: Span::from_ms(50),
            temperature_delay: Span::from_ms(50),
            uncalibrated: Uncalibrated::PassThrough,
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
    /// Nothing more is to be waited for.
    Flush,
}

/// A calibration in force, with the memory that belongs to it.
#[derive(Debug)]
struct Active {
    calibration: Arc<Calibration>,
    corrector: Corrector,
    revision: u64,
}

/// One unit.
#[derive(Debug)]
pub struct Unit {
    settings: UnitSettings,
    active: Option<Active>,
    gyros: GyroIntake,
    accels: AccelIntake,
    waiting: Waiting,
    steps: StepSum,
    counters: Counters,
    /// Ticks that left the intake and were neither given out nor announced.
    unannounced: u64,
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
            gyros: GyroIntake::default(),
            accels: AccelIntake::default(),
            waiting: Waiting::default(),
            steps: StepSum::new(),
            counters: Counters::default(),
            unannounced: 0,
            restart_due: false,
            turn_on: None,
            last_end: Timestamp::default(),
        }
    }

    /// Puts a calibration in force from the next tick on. Running state that still means the same is kept.
    pub fn install(&mut self, calibration: Arc<Calibration>, revision: u64) {
        let before = self.active.take();
        let kept = before.map(|active| (active.calibration, active.corrector));
        let corrector = Corrector::new(&calibration, kept, self.last_end);
        self.active = Some(Active { calibration, corrector, revision });
    }

    /// Takes one event; every corrected tick that it releases goes to `emit`.
    pub fn handle(&mut self, event: Event<'_>, emit: &mut dyn FnMut(&CorrectedTick)) {
        match event {
            Event::Gyro { output, ticks } => {
                let mut starts_anew = false;
                for tick in ticks {
                    self.counters.gyro_ticks_in += 1;
                    if self.fits(output, tick.readings.len(), |c| (c.gyro_output(), c.gyro_count())) {
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
                    if self.fits(output, tick.readings.len(), |c| (c.accel_output(), c.accel_count())) {
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
            Event::Flush => {
                self.release(true, emit);
                self.steps.flush(&self.settings.navigation, &mut |tick| emit(&tick));
            }
        }
    }

    /// Checks kind and number of readings against the calibration, if there is one.
    fn fits(
        &mut self,
        output: OutputKind,
        sensors: usize,
        expect: fn(&Calibration) -> (OutputKind, usize),
    ) -> bool {
        let Some(active) = &self.active else { return true };
        let (need_output, need_sensors) = expect(&active.calibration);
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
            // A swap since it came may have changed what fits.
            let accel = accel.filter(|(accel, output)| {
                self.fits(*output, accel.readings.len(), |c| (c.accel_output(), c.accel_count()))
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
        released.restart |= core::mem::take(&mut self.restart_due);
        released.missed = released.missed.saturating_add(core::mem::take(&mut self.unannounced));
        let Released { tick, output, missed, restart } = &released;
        // A swap since it came may have changed what fits.
        let fits = self.fits(*output, tick.readings.len(), |c| (c.gyro_output(), c.gyro_count()));
        let turn_on = *self.turn_on.get_or_insert(tick.end_time);
        let settings = &self.settings;
        let mut corrected = match &mut self.active {
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
                corrected
            }
            None if settings.uncalibrated == Uncalibrated::PassThrough => correct::pass_through(tick, accel),
            held_or_misfit => {
                self.unannounced = missed.saturating_add(1);
                self.restart_due = *restart;
                self.counters.ticks_held += u64::from(held_or_misfit.is_none());
                return;
            }
        };
        corrected.missed = *missed;
        if corrected.missed > 0 {
            corrected.flags |= TickFlags::GAP;
            self.counters.gaps += 1;
            self.counters.ticks_missed = self.counters.ticks_missed.saturating_add(corrected.missed);
        }
        if *restart {
            corrected.flags |= TickFlags::RESTART;
        }
        self.counters.ticks_out += 1;
        self.steps.push(&settings.navigation, &corrected, &mut |tick| emit(&tick));
    }

    /// What has been counted.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// The calibration in force and its revision.
    #[must_use]
    pub fn calibration(&self) -> Option<(&Arc<Calibration>, u64)> {
        self.active.as_ref().map(|active| (&active.calibration, active.revision))
    }

    /// The temperature channels as they stand at the last tick; none without a calibration.
    pub fn channels(&self) -> impl Iterator<Item = ChannelReport> + '_ {
        self.active
            .iter()
            .flat_map(|active| active.corrector.thermal().report(&active.calibration, self.last_end))
    }

    /// Whether ticks wait for their accelerometer tick, a missing neighbour, or the end of a navigation step.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        !self.gyros.is_empty() || !self.steps.is_empty()
    }

    /// The settings it was made with.
    #[must_use]
    pub fn settings(&self) -> &UnitSettings {
        &self.settings
    }
}
