//! Where playing is, and what it came to.

use std::time::Duration;

use indicatif::HumanDuration;
use tokio::time::Instant;

use super::{Player, Stage};
use crate::pace::Speed;
use crate::play::report::{PlayReport, UnitReport};
use crate::play::units::PlayedUnit;

impl Player<'_> {
    /// How fast it was, pauses left out.
    fn actual_speed(&self, elapsed: Duration, paused: Duration) -> f64 {
        let playing = elapsed.saturating_sub(paused).as_secs_f64();
        if playing > 0.0 { seconds(self.played_ns) / playing } else { 0.0 }
    }

    fn times(&self) -> (Duration, Duration) {
        let now = self.ended.unwrap_or_else(Instant::now);
        let paused = self.paused_for + self.paused.map_or(Duration::ZERO, |since| now - since);
        (now - self.begun, paused)
    }

    /// Shows where playing is: time in the log, pass, ticks sent, speed, and how long the rest takes at this speed, pauses left out.
    pub(super) fn show(&mut self) {
        self.shown = Some(Instant::now());
        if self.screen.is_hidden() {
            return;
        }
        let (elapsed, paused) = self.times();
        let log_s = seconds(self.last_at.or(self.from).unwrap_or(0));
        let of_pass = match self.options.part.end {
            Some(end) => log_s / (end.as_s() - self.options.part.start.as_s()),
            None => self.playlist.share(),
        };
        let of_pass = if of_pass.is_finite() { of_pass.clamp(0.0, 1.0) } else { 0.0 };
        // Of this pass where there is no last one.
        #[expect(clippy::cast_precision_loss, reason = "shares of a bar")]
        let (share, passes_left) = match self.options.passes {
            Some(passes) => (
                ((self.pass - 1) as f64 + of_pass) / passes.max(1) as f64,
                passes.saturating_sub(self.pass) as f64,
            ),
            None => (of_pass, 0.0),
        };
        let (speed, actual_speed) = (self.pacer.speed(), self.actual_speed(elapsed, paused));
        let times = match speed {
            Speed::Times(times) => times,
            Speed::Max => actual_speed,
        };
        // How long the log is shows by how far it has been read; whole seconds: it is an estimate.
        let left =
            Duration::try_from_secs_f64((log_s / of_pass * (1.0 - of_pass + passes_left) / times).floor());
        let left = left.map_or_else(|_| String::new(), |left| format!("  {:#} left", HumanDuration(left)));
        let pass = if self.pass > 1 { format!("  pass {}", self.pass) } else { String::new() };
        let is_paused = self.paused.is_some();
        let speed = if is_paused { "paused".to_owned() } else { format!("{actual_speed:.1}× of {speed}") };
        let ticks = self.ticks_sent;
        self.screen.at(share, format!("{log_s:.2} s{pass}  {ticks} ticks  {speed}{left}"));
    }

    /// What playing came to.
    pub(in crate::play) fn report(&self, stopped: bool) -> PlayReport {
        let (elapsed, paused) = self.times();
        let mut units: Vec<_> = self.units.all.iter().map(PlayedUnit::report).collect();
        if self.stage == Stage::Waited {
            units.iter_mut().for_each(UnitReport::give_up);
        }
        PlayReport {
            passes: self.pass,
            seeks: self.seeks,
            log_s: seconds(self.played_ns),
            elapsed_s: elapsed.as_secs_f64(),
            paused_s: paused.as_secs_f64(),
            actual_speed: self.actual_speed(elapsed, paused),
            lateness: self.pacer.late.lateness(),
            stopped,
            ..PlayReport::of(units)
        }
    }
}

#[expect(clippy::cast_precision_loss, reason = "exact below 100 days, and no result rests on it")]
fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}
