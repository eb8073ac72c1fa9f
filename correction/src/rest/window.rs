//! A window of about a second: mean and scatter of a vector.

use serde::{Deserialize, Serialize};

use crate::units::Span;
use crate::vector::{TimeMean, minus, plus};

/// Length of a full window (s).
pub(super) const WINDOW_S: f64 = 1.0;
/// Fewest ticks whose scatter says something of vibration.
const SCATTER_TICKS: f64 = 5.0;

/// An open window. Components are those of the case axes.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Window {
    /// Mean over its time.
    pub(super) over_time: TimeMean,
    ticks: f64,
    /// The first value: the squares are taken of what differs from it, so that gravity does not eat their digits.
    origin: [f64; 3],
    sum: [f64; 3],
    squares: [f64; 3],
    /// Whether a mode switch is in it.
    pub(super) switched: bool,
}

impl Window {
    /// Adds the mean over one tick.
    pub(super) fn add(&mut self, value: [f64; 3], duration: Span) {
        if self.ticks < 0.5 {
            self.origin = value;
        }
        self.ticks += 1.0;
        self.over_time.add(value, duration.as_s());
        let away = minus(value, self.origin);
        self.sum = plus(self.sum, away);
        self.squares = plus(self.squares, away.map(|away| away * away));
    }

    /// Whether one more tick like the last one would make it longer than it should be by more than half of it.
    pub(super) fn is_full(&self, tick: Span) -> bool {
        self.over_time.time_s + 0.5 * tick.as_s() > WINDOW_S
    }

    /// Mean duration of its ticks (s).
    pub(super) fn tick_s(&self) -> f64 {
        self.over_time.time_s / self.ticks
    }

    /// Standard deviation of the ticks about their mean; `None` where there are too few.
    pub(super) fn scatter(&self) -> Option<[f64; 3]> {
        let of_mean = self.sum.map(|sum| sum * sum / self.ticks);
        let squares = minus(self.squares, of_mean);
        let scatter = squares.map(|squares| libm::sqrt((squares / (self.ticks - 1.0)).max(0.0)));
        (self.ticks >= SCATTER_TICKS).then_some(scatter)
    }
}
