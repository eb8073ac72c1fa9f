//! An orientation as a calibration states it, and the checks that need no matrix.

use alloc::format;
use alloc::vec::Vec;

use crate::defect::{Checker, DefectKind};
use crate::sample::{MAX_SENSORS, MIN_SENSORS};
use crate::thermal::PLAY_WIDTHS_DEG_C;

/// Largest deviation of a row's norm from one that is taken for rounding in the document.
pub const ROW_NORM_TOLERANCE: f64 = 1e-3;
/// Largest condition number of an orientation that can be inverted sensibly [models §4].
pub const CONDITION_LIMIT: f64 = 100.0;
/// Largest ratio of two sensors' weights: beyond it the lighter sensor should be left out instead.
pub const WEIGHT_RATIO_LIMIT: f64 = 1e6;

/// The orientation of one kind of sensor as the calibration document states it.
#[derive(Debug, Clone, PartialEq)]
pub struct OrientationParts {
    /// Reference temperature (°C, finite).
    pub reference_deg_c: f64,
    /// `C_0`: one unit vector in case axes per sensor (dimensionless, 3…8 rows, norm 1 ± 10⁻³).
    pub rows: Vec<[f64; 3]>,
    /// `C_1`: change of each row with temperature (1/°C); empty for none.
    pub slopes_per_deg_c: Vec<[f64; 3]>,
    /// What sticks of the thermal change; at most [`MAX_PLAYS`](crate::thermal::MAX_PLAYS), none for axes that follow at once.
    pub plays: Vec<AxesPlay>,
    /// Weight of each sensor in the pseudo-inverse, 1/σ² up to a common factor (> 0); empty for equal.
    pub weights: Vec<f64>,
    /// Fitted range: first and last temperature (°C, first ≤ last); outside it T is clamped.
    pub range_deg_c: [f64; 2],
    /// Length of the parity vector beyond which a sensor must be at fault (the sensor's unit: rad/s or
    /// m/s², > 0); `None` to publish residuals only.
    pub parity_limit: Option<f64>,
    /// Ticks in a row that must point at the same sensor before it is excluded (≥ 1 where there is a limit).
    pub parity_confirm_ticks: u32,
}

/// A part of the thermal change of axes that sticks: they turn as if T were `T + share·(p_w[T] − T)` (models §4).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct AxesPlay {
    /// Half width w of the play (°C, > 0).
    pub half_width_deg_c: f64,
    /// Share of the change that goes with the play (dimensionless).
    pub share: f64,
}

/// Length of a row.
pub(super) fn norm(row: &[f64; 3]) -> f64 {
    libm::sqrt(row.iter().map(|c| c * c).sum())
}

impl OrientationParts {
    /// Checks the lengths of the lists, every number by itself, the norms of rows, and the weights against each other.
    pub(super) fn check(&self, checker: &mut Checker) {
        checker.count("rows", self.rows.len(), MIN_SENSORS, MAX_SENSORS);
        self.check_lists(self.rows.len(), checker);
        let [least, most] = PLAY_WIDTHS_DEG_C;
        for (index, AxesPlay { half_width_deg_c, share }) in self.plays.iter().enumerate() {
            checker.within(
                &format!("thermal.hysteresis[{index}].half_width"),
                *half_width_deg_c,
                least,
                most,
            );
            checker.within(&format!("thermal.hysteresis[{index}].share"), *share, -10.0, 10.0);
        }
        checker.finite("thermal.reference", self.reference_deg_c);
        checker.finite_rows("rows", &self.rows);
        checker.finite_rows("thermal.slopes", &self.slopes_per_deg_c);
        for (index, row) in self.rows.iter().enumerate() {
            let norm = norm(row);
            if norm.is_finite() && (norm - 1.0).abs() > ROW_NORM_TOLERANCE {
                checker.push(&format!("rows[{index}]"), DefectKind::RowNorm { norm });
            }
        }
        let [low, high] = self.range_deg_c;
        for end in [low, high] {
            checker.finite("thermal.range", end);
        }
        if low > high {
            checker.push("thermal.range", DefectKind::InvertedRange { low, high });
        }
        if let Some(limit) = self.parity_limit {
            checker.above_zero("parity.limit", limit);
            checker.within("parity.confirm_ticks", self.parity_confirm_ticks.into(), 1.0, u32::MAX.into());
        }
        for (index, weight) in self.weights.iter().enumerate() {
            checker.above_zero(&format!("weights[{index}]"), *weight);
        }
        let smallest = self.weights.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = self.weights.iter().copied().fold(0.0, f64::max);
        if smallest > 0.0 && largest / smallest > WEIGHT_RATIO_LIMIT {
            checker.push("weights", DefectKind::WeightRatio { got: largest / smallest });
        }
    }

    /// Checks that lists have an entry for each sensor, or none.
    pub(crate) fn check_lists(&self, sensors: usize, checker: &mut Checker) {
        for (list, got) in [("thermal.slopes", self.slopes_per_deg_c.len()), ("weights", self.weights.len())]
        {
            if got != 0 && got != sensors {
                checker.push(list, DefectKind::ListCount { got, sensors });
            }
        }
    }
}
