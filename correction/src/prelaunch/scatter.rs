//! White noise of one gyro, from second differences of its angle.
//!
//! The rate beyond the modelled bias, summed over the good time of a stretch of one mode, is an angle that runs straight
//! but for noise. With its means ā over consecutive cells of τ = 5 s,
//!
//! ```text
//! d_k = ā_{k+1} − 2·ā_k + ā_{k−1},        E[d²] = N²·τ        (N: angle random walk, rad/√s)
//! ```
//!
//! which is the modified Allan variance (2·τ²·Mod σ² = E[d²]; D. W. Allan and J. A. Barnes 1981) of white noise of the rate.
//! A constant rate gives nothing, nor does a change of it from one mode to the other, since no difference reaches over a switch; a
//! slow drift gives little. Counts do not disturb it either: their remainder, which the plain scatter of short means would
//! take for noise of the rate, is averaged out in the mean of the angle over a cell.

use serde::{Deserialize, Serialize};

use crate::sample::LasingMode;

/// τ (s).
const CELL_S: f64 = 5.0;
/// 1 + 2·(1/3² + 1/6²): how many correlated differences are worth one that is not.
const CORRELATION: f64 = 1.0 + 2.0 * (1.0 / 9.0 + 1.0 / 36.0);
/// Fewest differences that say something.
const FEWEST: f64 = 8.0;

/// Running second differences.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Scatter {
    mode: Option<LasingMode>,
    /// Angle since the mode began (rad).
    angle_rad: f64,
    /// Part of the open cell that is filled (s), and ∫angle dt over it (rad·s).
    cell: (f64, f64),
    /// Means of the two cells before, the older one first (rad).
    before: [Option<f64>; 2],
    /// Σd² (rad²) and how many there are.
    squares: f64,
    differences: f64,
}

impl Scatter {
    /// Adds a good tick. Ticks that are missing between good ones of the same mode leave the angle as it is.
    pub(super) fn add(&mut self, mode: Option<LasingMode>, rate_rad_per_s: f64, duration_s: f64) {
        if mode != self.mode {
            *self = Self { mode, squares: self.squares, differences: self.differences, ..Self::default() };
        }
        let mut left_s = duration_s;
        // Over the end of a cell a tick is divided: cells of unequal length would take a constant rate for noise.
        while left_s > 0.0 {
            let part_s = left_s.min(CELL_S - self.cell.0);
            let end_rad = self.angle_rad + rate_rad_per_s * part_s;
            self.cell.0 += part_s;
            self.cell.1 += 0.5 * (self.angle_rad + end_rad) * part_s;
            self.angle_rad = end_rad;
            left_s -= part_s;
            // What rounding leaves of a cell is none.
            if CELL_S - self.cell.0 < 1e-9 {
                self.close();
            }
        }
    }

    fn close(&mut self) {
        let (_, integral) = core::mem::take(&mut self.cell);
        let mean = integral / CELL_S;
        let [older, old] = self.before;
        if let (Some(older), Some(old)) = (older, old) {
            let difference = mean - 2.0 * old + older;
            self.squares += difference * difference;
            self.differences += 1.0;
        }
        self.before = [old, Some(mean)];
    }

    /// Upper limit of N² (rad²/s): the estimate and two of its standard deviations; `None` while there are too few
    /// differences.
    ///
    /// The upper limit, for a run whose differences happen to be small must not claim more than it knows. Neighbouring
    /// differences are correlated by −1/3 and −1/6, so that n of them are worth n/1.28.
    pub(super) fn walk_squared_limit(&self) -> Option<f64> {
        let estimate = self.squares / (self.differences * CELL_S);
        let relative_sigma = libm::sqrt(2.0 * CORRELATION / self.differences);
        (self.differences >= FEWEST).then_some(estimate * (1.0 + 2.0 * relative_sigma))
    }
}
