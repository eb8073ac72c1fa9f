//! The substitution as a calibration states it, and its checks.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use super::window::MIN_ADAPTIVE_READINGS;
use crate::defect::{Checker, Defect, DefectKind};
use crate::units::Span;

/// Most ticks of one transition.
pub const MAX_TRANSITION_TICKS: u8 = 32;
/// Shortest and longest time that a transition may be stated to take (s).
pub const TRANSITION_RANGE_S: [f64; 2] = [1e-4, 1.0];
/// Most readings of one fit on either side of the switch.
pub const MAX_FIT_READINGS: u8 = 8;
/// Highest degree of the prediction.
pub const MAX_PREDICT_DEGREE: u8 = 2;
/// Highest degree of the two-sided fit.
pub const MAX_FIT_DEGREE: u8 = 3;

/// How long a transition takes: n ticks that carry nothing, the commanded one included.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Transition {
    /// That many ticks (1…32).
    Ticks(u8),
    /// A time from the command on (s, 10⁻⁴…1): the ticks that it covers, one that it covers by less than a sixteenth left out, and
    /// at most 32.
    Time(f64),
}

impl Transition {
    /// n at ticks of a duration: ticks that carry nothing, the commanded one included (1…32).
    #[must_use]
    pub fn ticks(self, duration: Span) -> u8 {
        let ticks = self.covered(duration).clamp(1, MAX_TRANSITION_TICKS.into());
        u8::try_from(ticks).unwrap_or(MAX_TRANSITION_TICKS)
    }

    /// Whether it covers more ticks of a duration than a transition may have.
    #[must_use]
    pub fn is_cut(self, duration: Span) -> bool {
        self.covered(duration) > MAX_TRANSITION_TICKS.into()
    }

    fn covered(self, duration: Span) -> i64 {
        match self {
            Self::Ticks(ticks) => ticks.into(),
            Self::Time(time_s) => {
                // In whole nanoseconds: a clock that is a little off brings no tick in or out.
                let tick_ns = duration.as_ns().max(1);
                let covered_ns = Span::from_s(time_s).as_ns().saturating_sub(tick_ns / TOUCHED);
                covered_ns / tick_ns + i64::from(covered_ns % tick_ns > 0)
            }
        }
    }
}

/// Which readings the two-sided fit takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum FitWindow {
    /// All that are stated.
    Fixed,
    /// Those of them, as many on either side, with the least error by their own noise and motion.
    Adaptive,
}

/// Part of a tick that a transition must cover for the tick to be lost: one over this.
const TOUCHED: i64 = 16;
/// Tick durations that readings reach where the transition is not long.
const REACH_TICKS: u8 = 16;

/// The substitution as the calibration document states it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReversalParts {
    /// How long a transition takes.
    pub transition: Transition,
    /// Readings of the prediction (1…8).
    pub predict_readings: u8,
    /// Degree of the prediction (0…2, below `predict_readings`).
    pub predict_degree: u8,
    /// Readings before the switch in the two-sided fit (1…8).
    pub fit_readings_before: u8,
    /// Readings after the switch in the two-sided fit (1…8).
    pub fit_readings_after: u8,
    /// Degree of the two-sided fit (0…3, below the number of its readings).
    pub fit_degree: u8,
    /// Which of the readings the two-sided fit takes; where it chooses, there must be at least twelve.
    pub fit_window: FitWindow,
}

impl Default for ReversalParts {
    /// The paper's figures, with the linear prediction that was found the most robust to noise.
    fn default() -> Self {
        Self {
            transition: Transition::Ticks(3),
            predict_readings: 4,
            predict_degree: 1,
            fit_readings_before: 2,
            fit_readings_after: 2,
            fit_degree: 2,
            fit_window: FitWindow::Fixed,
        }
    }
}

/// A validated substitution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Reversal {
    pub(super) parts: ReversalParts,
}

impl Reversal {
    /// Validates a stated substitution.
    ///
    /// # Errors
    ///
    /// Everything that is wrong with it.
    pub fn new(parts: &ReversalParts) -> Result<Self, Vec<Defect>> {
        let mut checker = Checker::default();
        match parts.transition {
            Transition::Ticks(ticks) => {
                checker.within("transition_ticks", ticks.into(), 1.0, MAX_TRANSITION_TICKS.into());
            }
            Transition::Time(time_s) => {
                let [shortest, longest] = TRANSITION_RANGE_S;
                checker.within("transition_s", time_s, shortest, longest);
            }
        }
        for (field, got, [least, most]) in [
            ("predict_readings", parts.predict_readings, [1, MAX_FIT_READINGS]),
            ("predict_degree", parts.predict_degree, [0, MAX_PREDICT_DEGREE]),
            ("fit_readings_before", parts.fit_readings_before, [1, MAX_FIT_READINGS]),
            ("fit_readings_after", parts.fit_readings_after, [1, MAX_FIT_READINGS]),
            ("fit_degree", parts.fit_degree, [0, MAX_FIT_DEGREE]),
        ] {
            checker.within(field, got.into(), least.into(), most.into());
        }
        let fit_readings = parts.fit_readings_before.saturating_add(parts.fit_readings_after);
        for (field, got, readings) in [
            ("predict_degree", parts.predict_degree, parts.predict_readings),
            ("fit_degree", parts.fit_degree, fit_readings),
        ] {
            if got >= readings {
                checker.push(field, DefectKind::DegreeNeedsReadings { got, readings });
            }
        }
        if parts.fit_window == FitWindow::Adaptive && fit_readings < MIN_ADAPTIVE_READINGS {
            checker.push("fit_window", DefectKind::AdaptiveNeedsReadings { readings: fit_readings });
        }
        checker.finish(Self { parts: *parts })
    }

    /// Tick durations beyond which a reading says nothing about a lost tick, and most lost ticks that wait for one fit.
    pub(super) fn reach_ticks(&self, duration: Span) -> u8 {
        REACH_TICKS.max(2 * self.parts.transition.ticks(duration))
    }
}
