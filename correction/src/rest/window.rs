//! A window of about a second: mean and scatter of a vector.

use serde::{Deserialize, Serialize};

use crate::units::Span;

/// Length of a full window (s).
pub(super) const WINDOW_S: f64 = 1.0;
/// Fewest ticks whose scatter says something of vibration.
const SCATTER_TICKS: f64 = 5.0;

/// An open window. Components are those of the case axes.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Window {
    ticks: f64,
    duration_s: f64,
    /// ∫v dt.
    integral: [f64; 3],
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
        let duration_s = duration.as_s();
        self.duration_s += duration_s;
        for (integral, value) in self.integral.iter_mut().zip(value) {
            *integral += value * duration_s;
        }
        let sums = self.sum.iter_mut().zip(&mut self.squares);
        for ((sum, square), (value, origin)) in sums.zip(value.iter().zip(self.origin)) {
            let away = value - origin;
            *sum += away;
            *square += away * away;
        }
    }

    /// Whether one more tick like the last one would make it longer than it should be by more than half of it.
    pub(super) fn is_full(&self, tick: Span) -> bool {
        self.duration_s + 0.5 * tick.as_s() > WINDOW_S
    }

    /// How long it is (s).
    pub(super) fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Mean duration of its ticks (s).
    pub(super) fn tick_s(&self) -> f64 {
        self.duration_s / self.ticks
    }

    /// Mean over time; `None` without any.
    pub(super) fn mean(&self) -> Option<[f64; 3]> {
        (self.duration_s > 0.0).then(|| self.integral.map(|integral| integral / self.duration_s))
    }

    /// Standard deviation of the ticks about their mean; `None` where there are too few.
    pub(super) fn scatter(&self) -> Option<[f64; 3]> {
        (self.ticks >= SCATTER_TICKS).then(|| {
            let mut scatter = self.squares;
            for (scatter, sum) in scatter.iter_mut().zip(self.sum) {
                *scatter = libm::sqrt(((*scatter - sum * sum / self.ticks) / (self.ticks - 1.0)).max(0.0));
            }
            scatter
        })
    }
}
