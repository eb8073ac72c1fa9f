//! Whether a unit stands still (models §7).
//!
//! A unit at rest feels a constant rate and a constant force. Means over windows of a second are compared with those
//! of the windows before them, per case axis; what no noise of the windows themselves explains is a motion:
//!
//! | motion | compared | limit |
//! |---|---|---|
//! | turn | angle gathered in a window, and in two in a row, beyond the mean rate of the last 60 | floor or k·σ |
//! | slow turn | angle of the last minute beyond the mean rate of the minutes before | floor or k·σ·√60 |
//! | rate | mean rate of the last 60 windows | stated |
//! | push | velocity gathered in a window, and in two in a row, beyond the mean force of the last 60 | floor or k·σ |
//! | force change | mean force of the last minute against that of the first | floor or k·σ/√60 |
//! | shake | scatter of the ticks within a window against that of the last 60 | floor or k·σ |
//!
//! σ is the standard deviation of the windows that are compared with, so that a noisy unit has wide limits; a unit whose
//! limits grow beyond a stated ceiling is restless: a nudge could hide in its noise. No limit is below four counts of
//! the coarsest sensor.
//!
//! Rates of the two lasing modes have references of their own: a magnetic bias that is not what the calibration says
//! makes a step of the corrected rate at each switch, and no motion.

#[cfg(test)]
pub(crate) mod fixture;
mod limits;
mod track;
mod window;

use core::fmt;

use serde::{Deserialize, Serialize};

pub use limits::RestLimits;
use track::{Finding, Scale, Track};
use window::Window;

use crate::by_mode::ByMode;
use crate::calibration::Calibration;
use crate::observation::Observation;
use crate::sample::{LasingMode, TickFlags};
use crate::units::{Angle, SpecificForce, Timestamp};

/// Kinds of motion, each with the unit of measure of its value and limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Motion {
    /// Turned within one or two seconds (rad).
    Turn,
    /// Turned within a minute (rad).
    SlowTurn,
    /// Turns steadily (rad/s).
    Rate,
    /// Pushed, or tilted, within one or two seconds (m/s).
    Push,
    /// Force at the end differs from that at the start: tilted slowly (m/s²).
    ForceChange,
    /// Vibrates more than before (m/s² rms).
    Shake,
    /// The angle gathered in a second scatters too much for a nudge to be seen (rad).
    RestlessTurn,
    /// The velocity gathered in a second scatters too much for a knock to be seen (m/s).
    RestlessPush,
}

/// A motion that was seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Moved {
    /// What it was.
    pub what: Motion,
    /// Case axis, 0…2.
    pub axis: usize,
    /// How much, in the unit of measure of `what`; never negative.
    pub value: f64,
    /// Most that counts as rest, likewise.
    pub limit: f64,
    /// End of the tick at which it was certain.
    pub at: Timestamp,
}

fn degrees(rad: f64) -> f64 {
    Angle::from_rad(rad).as_deg()
}

fn milli_g(m_per_s2: f64) -> f64 {
    SpecificForce::from_m_per_s2(m_per_s2).as_g() * 1e3
}

impl fmt::Display for Moved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis = ["x", "y", "z"].get(self.axis).copied().unwrap_or("?");
        let (what, converted, unit, about): (_, fn(f64) -> f64, _, _) = match self.what {
            Motion::Turn => ("turned by", degrees, "°", "about"),
            Motion::SlowTurn => ("turned within a minute by", degrees, "°", "about"),
            Motion::Rate => ("turns steadily at", degrees, "°/s", "about"),
            Motion::Push => ("was pushed by", milli_g, " mg·s", "along"),
            Motion::ForceChange => ("was tilted: its force changed by", milli_g, " mg", "along"),
            Motion::Shake => ("was shaken by", milli_g, " mg rms", "along"),
            Motion::RestlessTurn => ("is too restless: angle in a second within", degrees, "°", "about"),
            Motion::RestlessPush => {
                ("is too restless: velocity in a second within", milli_g, " mg·s", "along")
            }
        };
        let [value, limit] = [self.value, self.limit].map(converted);
        write!(f, "the unit {what} {value:.4}{unit} {about} {axis}, at most {limit:.4}{unit} is rest")
    }
}

/// What is known of the unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Rest {
    /// Too little has been seen: half a minute of each lasing mode is needed.
    Learning,
    /// It stands still.
    Still,
    /// It moved. Stays so until the unit has been still for as long as learning takes.
    Moved(Moved),
}

/// Watches one unit. Allocates when it is made, not per tick.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RestMonitor {
    limits: RestLimits,
    rate_scale: Scale,
    force_scale: Scale,
    /// What one count of the coarsest accelerometer is worth (m/s).
    force_quantum_m_per_s: f64,
    rates: ByMode<Track>,
    rate: Window,
    rate_mode: Option<LasingMode>,
    forces: Track,
    shakes: Track,
    force: Window,
    moved: Option<Moved>,
}

impl RestMonitor {
    /// A monitor of a unit with this calibration, from which it takes what a count is worth.
    #[must_use]
    pub fn new(limits: &RestLimits, calibration: &Calibration) -> Self {
        let angle_rad = calibration.count_rad().fold(0.0, f64::max);
        let velocity_m_per_s = calibration.count_m_per_s().fold(0.0, f64::max);
        Self {
            rate_scale: Scale::new(limits.turn_rad, limits.turn_ceiling_rad, limits.sigmas, angle_rad),
            force_scale: Scale::new(
                limits.push_m_per_s,
                limits.push_ceiling_m_per_s,
                limits.sigmas,
                velocity_m_per_s,
            ),
            force_quantum_m_per_s: velocity_m_per_s,
            limits: *limits,
            rates: ByMode::default(),
            rate: Window::default(),
            rate_mode: None,
            forces: Track::default(),
            shakes: Track::default(),
            force: Window::default(),
            moved: None,
        }
    }

    /// Takes one tick and says what is known with it.
    ///
    /// A mode switch is no motion: seconds that hold ticks which are not settled have a limit of their own.
    pub fn observe(&mut self, observation: &Observation) -> Rest {
        if observation.flags.contains(TickFlags::RESTART) {
            self.start_anew();
            self.moved = None;
        }
        let mut seen = self.observe_rate(observation);
        seen = seen.or(self.observe_force(observation));
        if self.moved.is_some() && self.has_learned() {
            self.moved = None;
        }
        self.note(seen, observation.end_time)
    }

    /// Judges the seconds that are still open: for the end of a stream, or of the time that rest is needed for.
    pub fn finish(&mut self, at: Timestamp) -> Rest {
        let mut seen = self.close_rate(false);
        seen = seen.or(self.close_force(false));
        self.note(seen, at)
    }

    fn note(&mut self, seen: Option<(Motion, Finding)>, at: Timestamp) -> Rest {
        if let Some((what, Finding { axis, value, limit })) = seen {
            // What was learned before a motion is not what comes after it.
            self.start_anew();
            self.moved = Some(Moved { what, axis, value, limit, at });
        }
        self.verdict()
    }

    /// What is known of the unit.
    #[must_use]
    pub fn verdict(&self) -> Rest {
        match self.moved {
            Some(moved) => Rest::Moved(moved),
            None if self.has_learned() => Rest::Still,
            None => Rest::Learning,
        }
    }

    /// Whether every kind of window that has been seen has been seen often enough.
    fn has_learned(&self) -> bool {
        let rates = self.rates.each().into_iter().all(|track| track.is_empty() || track.has_learned());
        let any = self.rates.each().into_iter().any(Track::has_learned);
        rates && any && (self.forces.is_empty() || self.forces.has_learned())
    }

    fn start_anew(&mut self) {
        self.rates = ByMode::default();
        (self.forces, self.shakes) = (Track::default(), Track::default());
        (self.rate, self.force) = (Window::default(), Window::default());
    }

    fn observe_rate(&mut self, observation: &Observation) -> Option<(Motion, Finding)> {
        // A transient that could not be measured is still in the rate.
        let unusable = TickFlags::ANGLE_INVALID | TickFlags::UNCALIBRATED | TickFlags::SERVO_UNMEASURED;
        if observation.flags.intersects(unusable) {
            return None;
        }
        let mut seen = None;
        if observation.mode != self.rate_mode {
            seen = self.close_rate(false);
            self.rate_mode = observation.mode;
            self.rates.get_mut(self.rate_mode).cut();
        }
        self.rate.add(observation.angular_rate, observation.duration);
        self.rate.switched |= !observation.settled;
        if self.rate.is_full(observation.duration) {
            seen = seen.or(self.close_rate(true));
        }
        seen
    }

    /// Judges the open window of rates. One that was cut short, or with a switch in it, is no reference for others.
    fn close_rate(&mut self, full: bool) -> Option<(Motion, Finding)> {
        let window = core::mem::take(&mut self.rate);
        let (mean, duration_s) = (window.over_time.mean()?, window.over_time.time_s);
        let RestLimits { slow_turn_rad, rate_rad_per_s, switch_turn_rad, .. } = self.limits;
        let scale = self.rate_scale;
        let track = self.rates.get_mut(self.rate_mode);
        if window.switched || !full {
            let scale = if window.switched { scale.at_least(switch_turn_rad) } else { scale };
            return track.take_aside(&scale, mean, duration_s).map(of(Motion::Turn));
        }
        let turn = track.take(&scale, mean, duration_s).map(of(Motion::Turn));
        turn.or_else(|| track.restless(&scale).map(of(Motion::RestlessTurn)))
            .or_else(|| track.large(rate_rad_per_s).map(of(Motion::Rate)))
            .or_else(|| track.drift_since_before(&scale, slow_turn_rad).map(of(Motion::SlowTurn)))
    }

    fn observe_force(&mut self, observation: &Observation) -> Option<(Motion, Finding)> {
        let force = observation.specific_force?;
        self.force.add(force, observation.duration);
        if self.force.is_full(observation.duration) { self.close_force(true) } else { None }
    }

    /// Judges the open window of forces.
    fn close_force(&mut self, full: bool) -> Option<(Motion, Finding)> {
        let window = core::mem::take(&mut self.force);
        let (mean, duration_s) = (window.over_time.mean()?, window.over_time.time_s);
        let (scale, track) = (&self.force_scale, &mut self.forces);
        if !full {
            return track.take_aside(scale, mean, duration_s).map(of(Motion::Push));
        }
        let push = track.take(scale, mean, duration_s).map(of(Motion::Push));
        let seen = push.or_else(|| track.restless(scale).map(of(Motion::RestlessPush))).or_else(|| {
            track.drift_since_start(scale, self.limits.force_change_m_per_s2).map(of(Motion::ForceChange))
        });
        if seen.is_some() {
            return seen;
        }
        let scatter = window.scatter()?;
        // One count more or less in a tick is no vibration.
        let count = self.force_quantum_m_per_s / window.tick_s();
        let scale = Scale::one_sided(self.limits.shake_m_per_s2, self.limits.sigmas, count);
        self.shakes.take(&scale, scatter, 1.0).map(of(Motion::Shake))
    }
}

/// Says what kind of motion a finding is.
fn of(what: Motion) -> impl FnOnce(Finding) -> (Motion, Finding) {
    move |finding| (what, finding)
}

#[cfg(test)]
mod tests;
