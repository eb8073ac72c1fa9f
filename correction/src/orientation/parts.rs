//! An orientation as a calibration states it, and the checks that need no matrix.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use crate::sample::{MAX_SENSORS, MIN_SENSORS};
use crate::stated::AtDegC;
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

/// What is wrong with a stated orientation.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OrientationError {
    /// Too few or too many sensors.
    #[error("{got} rows; from {min} to {max} are allowed")]
    RowCount {
        /// Rows stated.
        got: usize,
        /// Fewest that are allowed.
        min: usize,
        /// Most that are allowed.
        max: usize,
    },
    /// A list has neither one entry per sensor nor none.
    #[error("has {got} entries, must have {sensors}: one for each sensor")]
    ListCount {
        /// What the list holds.
        name: &'static str,
        /// Entries stated.
        got: usize,
        /// Sensors that there are.
        sensors: usize,
    },
    /// A number is NaN or infinite.
    #[error("{name} {index} is {got}; a finite number is needed")]
    NotFinite {
        /// What the number is.
        name: &'static str,
        /// Index of its row or entry, from 0.
        index: usize,
        /// The number.
        got: f64,
    },
    /// A row of `C_0` is not a unit vector.
    #[error("has norm {norm:.6}, must be 1 within {tolerance}: a unit vector")]
    RowNorm {
        /// Index of the row, from 0.
        row: usize,
        /// Its norm.
        norm: f64,
        /// Largest deviation allowed.
        tolerance: f64,
    },
    /// The axes are too close to one plane.
    #[error("condition number {got:.1} {}; at most {limit} is allowed", AtDegC(*.temperature_deg_c))]
    Condition {
        /// Temperature of the offending matrix (°C): the reference or an end of the range.
        temperature_deg_c: f64,
        /// Its condition number.
        got: f64,
        /// Largest one allowed.
        limit: f64,
    },
    /// The axes come too close to one plane at a temperature within the range.
    #[error(
        "C(T) has condition number {got:.1} at {temperature_deg_c:.1} °C, within range_deg_c; at most {limit} is allowed: check sign and \
         unit of the slopes, or narrow range_deg_c"
    )]
    ConditionInside {
        /// The temperature (°C).
        temperature_deg_c: f64,
        /// Condition number there.
        got: f64,
        /// Largest one allowed.
        limit: f64,
    },
    /// A weight is zero or negative.
    #[error("weight {index} is {got}; it must be above 0")]
    WeightNotPositive {
        /// Index of the weight, from 0.
        index: usize,
        /// The weight.
        got: f64,
    },
    /// The weights differ beyond what can be inverted.
    #[error("largest weight is {got} times the smallest; at most {limit} is allowed")]
    WeightRatio {
        /// Largest weight over smallest.
        got: f64,
        /// Largest ratio allowed.
        limit: f64,
    },
    /// The temperature range is reversed.
    #[error("range from {first} °C to {last} °C; the first must not be above the last")]
    EmptyRange {
        /// Stated first temperature (°C).
        first: f64,
        /// Stated last temperature (°C).
        last: f64,
    },
    /// A play without slack, or a share or half width that is no number within its limits.
    #[error(
        "play {index} has half width {half_width} °C and share {share}; from {min} to {max} °C and −10 to 10 are allowed"
    )]
    Play {
        /// Index of the play, from 0.
        index: usize,
        /// Its half width (°C).
        half_width: f64,
        /// Its share.
        share: f64,
        /// Least half width (°C).
        min: f64,
        /// Largest half width (°C).
        max: f64,
    },
    /// The parity limit is zero or negative.
    #[error("parity limit is {got}; it must be above 0")]
    ParityLimit {
        /// The limit.
        got: f64,
    },
    /// A parity limit without ticks to confirm it.
    #[error("parity is confirmed by 0 ticks; at least 1 is needed")]
    ParityConfirm,
}

impl OrientationError {
    /// Field that it speaks of, as documents have it but for units; of a number in a list, what the number is.
    pub(crate) fn field(&self) -> String {
        let field = match self {
            Self::RowNorm { row, .. } => return format!("rows[{row}]"),
            Self::Play { index, .. } => return format!("thermal.hysteresis[{index}]"),
            Self::ListCount { name, .. } | Self::NotFinite { name, .. } => name,
            Self::WeightNotPositive { .. } | Self::WeightRatio { .. } => "weights",
            Self::EmptyRange { .. } => "thermal.range",
            Self::ParityLimit { .. } => "parity.limit",
            Self::ParityConfirm => "parity.confirm_ticks",
            Self::ConditionInside { .. } => "thermal.slopes",
            Self::RowCount { .. } | Self::Condition { .. } => "rows",
        };
        field.to_owned()
    }
}

/// Length of a row.
pub(super) fn norm(row: &[f64; 3]) -> f64 {
    libm::sqrt(row.iter().map(|c| c * c).sum())
}

impl OrientationParts {
    /// Checks the lengths of the lists.
    pub(super) fn check_counts(&self, errors: &mut Vec<OrientationError>) {
        let rows = self.rows.len();
        if !(MIN_SENSORS..=MAX_SENSORS).contains(&rows) {
            let (min, max) = (MIN_SENSORS, MAX_SENSORS);
            errors.push(OrientationError::RowCount { got: rows, min, max });
        }
        errors.extend(self.check_lists(rows));
    }

    /// Lists that have neither an entry for each sensor nor none.
    pub(crate) fn check_lists(&self, sensors: usize) -> impl Iterator<Item = OrientationError> {
        let lists = [("thermal.slopes", self.slopes_per_deg_c.len()), ("weights", self.weights.len())];
        let wrong = lists.into_iter().filter(move |(_, got)| *got != 0 && *got != sensors);
        wrong.map(move |(name, got)| OrientationError::ListCount { name, got, sensors })
    }

    /// Checks every number by itself, the norms of rows, and the weights against each other.
    pub(super) fn check_numbers(&self, errors: &mut Vec<OrientationError>) {
        fn named(name: &'static str, rows: &[[f64; 3]]) -> impl Iterator<Item = (&'static str, usize, f64)> {
            rows.iter().enumerate().flat_map(move |(index, row)| row.map(|c| (name, index, c)))
        }
        let [min, max] = PLAY_WIDTHS_DEG_C;
        for (index, AxesPlay { half_width_deg_c, share }) in self.plays.iter().copied().enumerate() {
            if !(min..=max).contains(&half_width_deg_c) || !(-10.0..=10.0).contains(&share) {
                errors.push(OrientationError::Play { index, half_width: half_width_deg_c, share, min, max });
            }
        }
        let [first, last] = self.range_deg_c;
        let weights = self.weights.iter().copied().enumerate();
        let numbers = [("reference temperature", 0, self.reference_deg_c)].into_iter();
        let numbers = numbers.chain(named("row", &self.rows)).chain(named("slope", &self.slopes_per_deg_c));
        let numbers = numbers.chain([("range limit", 0, first), ("range limit", 1, last)]);
        let numbers = numbers.chain(self.parity_limit.map(|limit| ("parity limit", 0, limit)));
        let numbers = numbers.chain(weights.clone().map(|(index, weight)| ("weight", index, weight)));
        let broken = numbers.filter(|(.., got)| !got.is_finite());
        errors.extend(broken.map(|(name, index, got)| OrientationError::NotFinite { name, index, got }));

        for (row, values) in self.rows.iter().enumerate() {
            let norm = norm(values);
            if norm.is_finite() && (norm - 1.0).abs() > ROW_NORM_TOLERANCE {
                errors.push(OrientationError::RowNorm { row, norm, tolerance: ROW_NORM_TOLERANCE });
            }
        }
        if first.is_finite() && last.is_finite() && first > last {
            errors.push(OrientationError::EmptyRange { first, last });
        }
        if let Some(got) = self.parity_limit.filter(|limit| limit.is_finite()) {
            if got <= 0.0 {
                errors.push(OrientationError::ParityLimit { got });
            }
            if self.parity_confirm_ticks == 0 {
                errors.push(OrientationError::ParityConfirm);
            }
        }
        if !self.weights.iter().all(|weight| weight.is_finite()) {
            return;
        }
        let wrong = weights.filter(|(_, got)| *got <= 0.0);
        errors.extend(wrong.map(|(index, got)| OrientationError::WeightNotPositive { index, got }));
        let smallest = self.weights.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = self.weights.iter().copied().fold(0.0, f64::max);
        if smallest > 0.0 && largest / smallest > WEIGHT_RATIO_LIMIT {
            let (got, limit) = (largest / smallest, WEIGHT_RATIO_LIMIT);
            errors.push(OrientationError::WeightRatio { got, limit });
        }
    }
}
