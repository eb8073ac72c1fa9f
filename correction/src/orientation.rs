//! From the sensors' input axes to case axes, with temperature, for three to eight sensors (models §4).
//!
//! ```text
//! s = C(T)·v,   C(T) = C_0 + C_1·(T − T_ref),   v = C(T)⁺·s
//! ```
//!
//! More than three sensors leave N − 3 parity residuals; [`ParityCheck`] publishes them and names the sensor
//! that explains them. Everything here works on arrays of fixed size: only the statement ([`OrientationParts`])
//! and the compiled calibration own memory from the heap.

mod linear;
mod parity;
mod parts;
mod range;

use alloc::vec::Vec;
use core::array;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

pub(crate) use linear::Rows;
use linear::{condition_number, is_conditioned, orthonormal_columns};

use parts::norm;

pub use parity::{ISOLATION_RATIO, ParityCheck, ParityVerdict};
pub use parts::{AxesPlay, CONDITION_LIMIT, OrientationParts, ROW_NORM_TOLERANCE, WEIGHT_RATIO_LIMIT};

use crate::defect::{Checker, Defect, DefectKind};
use crate::lanes::{Lanes, Readings};
use crate::sample::{MAX_SENSORS, MIN_SENSORS, Sensors};
use crate::thermal::MAX_PLAYS;
use crate::vector::dot;

/// Which sensors of a kind take part: bit i for sensor i.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub struct SensorMask(u8);

impl SensorMask {
    /// No sensor.
    pub const NONE: Self = Self(0);

    /// Sensors 0…n−1; n above eight counts as eight.
    #[must_use]
    pub const fn all(n: usize) -> Self {
        if n >= MAX_SENSORS { Self(u8::MAX) } else { Self((1 << n) - 1) }
    }

    /// Whether sensor `index` takes part.
    #[must_use]
    pub const fn contains(self, index: usize) -> bool {
        index < MAX_SENSORS && self.0 & (1 << index) != 0
    }

    /// The same sensors but for `index`.
    #[must_use]
    pub const fn without(self, index: usize) -> Self {
        if index < MAX_SENSORS { Self(self.0 & !(1 << index)) } else { self }
    }

    /// The same sensors and `index`; beyond the eighth there is none to add.
    #[must_use]
    pub const fn with(self, index: usize) -> Self {
        if index < MAX_SENSORS { Self(self.0 | (1 << index)) } else { self }
    }

    /// The same sensors, `index` among them or not.
    #[must_use]
    pub const fn set(self, index: usize, takes_part: bool) -> Self {
        if takes_part { self.with(index) } else { self.without(index) }
    }

    /// The sensors that both masks hold.
    #[must_use]
    pub const fn intersection(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// The sensors of this mask that the other one does not hold.
    #[must_use]
    pub const fn but(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// How many sensors take part.
    #[must_use]
    pub const fn count(self) -> usize {
        self.0.count_ones() as usize
    }
}

/// A validated orientation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Orientation {
    reference_deg_c: f64,
    range_deg_c: [f64; 2],
    sensors: usize,
    /// `C_0` with its rows normalised, and `C_1` (1/°C): by case axis, a lane for each sensor.
    cosines: [Lanes; 3],
    slopes_per_deg_c: [Lanes; 3],
    plays: ArrayVec<AxesPlay, MAX_PLAYS>,
    /// √w with the mean of w over all sensors made one, so that parity keeps the sensors' unit.
    root_weights: [f64; MAX_SENSORS],
    parity_limit: Option<f64>,
    parity_confirm_ticks: u32,
}

impl Orientation {
    /// Validates a stated orientation and normalises its rows.
    ///
    /// # Errors
    ///
    /// Everything that is wrong with it.
    pub fn new(parts: &OrientationParts) -> Result<Self, Vec<Defect>> {
        let mut checker = Checker::default();
        parts.check(&mut checker);
        // The matrix checks below would only repeat what is already known of broken numbers.
        if !checker.defects.is_empty() {
            return Err(checker.defects);
        }

        let mut rows = Rows::default();
        for (to, from) in rows.iter_mut().zip(&parts.rows) {
            let norm = norm(from);
            *to = from.map(|c| c / norm);
        }

        let mut slopes_per_deg_c = Rows::default();
        for (to, from) in slopes_per_deg_c.iter_mut().zip(&parts.slopes_per_deg_c) {
            *to = *from;
        }
        let orientation = Self {
            reference_deg_c: parts.reference_deg_c,
            range_deg_c: parts.range_deg_c,
            sensors: parts.rows.len(),
            cosines: array::from_fn(|axis| rows.map(|row| row[axis])),
            slopes_per_deg_c: array::from_fn(|axis| slopes_per_deg_c.map(|row| row[axis])),
            plays: parts.plays.iter().copied().take(MAX_PLAYS).collect(),
            root_weights: root_weights(&parts.weights, parts.rows.len()),
            parity_limit: parts.parity_limit,
            parity_confirm_ticks: parts.parity_confirm_ticks,
        };
        let [first, last] = parts.range_deg_c;
        let at_reference = condition_number(&rows);
        let stated = [
            (parts.reference_deg_c, at_reference),
            (first, condition_number(&orientation.rows_at(first))),
            (last, condition_number(&orientation.rows_at(last))),
        ];
        // Without slopes all three are one.
        let same = if parts.slopes_per_deg_c.is_empty() { stated.len() - 1 } else { 0 };
        for (temperature_deg_c, got) in stated.into_iter().skip(same) {
            // NaN comes from slopes that overflow.
            if got.is_nan() || got > CONDITION_LIMIT {
                checker.push("rows", DefectKind::Condition { temperature_deg_c, got });
            }
        }
        if checker.defects.is_empty()
            && let Some((temperature_deg_c, got)) =
                orientation.ill_conditioned(SensorMask::all(MAX_SENSORS), [first, last])
        {
            checker.push("thermal.slopes", DefectKind::ConditionInside { temperature_deg_c, got });
        }
        checker.finish(orientation)
    }

    /// Number of sensors N (3…8).
    #[must_use]
    pub const fn sensors(&self) -> usize {
        self.sensors
    }

    /// What sticks of the thermal change.
    pub(crate) fn plays(&self) -> &[AxesPlay] {
        &self.plays
    }

    /// First and last temperature of the fitted range (°C).
    #[must_use]
    pub const fn range_deg_c(&self) -> [f64; 2] {
        self.range_deg_c
    }

    /// C(T)⁺ over the sensors of `mask`: the inverse of three, the weighted pseudo-inverse
    /// (CᵀWC)⁻¹CᵀW of more.
    ///
    /// `None` where fewer than three sensors remain or their condition number is over
    /// [`CONDITION_LIMIT`]. T is clamped to the fitted range; NaN stands for the reference.
    #[must_use]
    pub fn inverse(&self, temperature_deg_c: f64, mask: SensorMask) -> Option<Inverse> {
        let mask = mask.intersection(SensorMask::all(self.sensors));
        if mask.count() < MIN_SENSORS {
            return None;
        }
        let rows = masked(self.rows_at(temperature_deg_c), mask);
        if !is_conditioned(&rows, CONDITION_LIMIT) {
            return None;
        }
        // √W·C = Q·R, hence (CᵀWC)⁻¹CᵀW = R⁻¹·Qᵀ·√W; the condition number is not squared this way.
        let (q, r) = orthonormal_columns(&self.weighted(rows))?;
        let mut columns = [[0.0; 4]; MAX_SENSORS];
        for (([x, y, z, _], q), root_weight) in columns.iter_mut().zip(&q).zip(&self.root_weights) {
            let b = q.map(|q| q * root_weight);
            *z = b[2] / r[2][2];
            *y = (b[1] - r[1][2] * *z) / r[1][1];
            *x = (b[0] - r[0][1] * *y - r[0][2] * *z) / r[0][0];
        }
        Some(Inverse { columns, mask })
    }

    /// Whether the axes of the sensors in `mask` keep clear of one plane at every temperature between two (°C): their condition
    /// number stays within [`CONDITION_LIMIT`], or a hundredth above it.
    #[must_use]
    pub fn is_conditioned_between(&self, mask: SensorMask, one_deg_c: f64, other_deg_c: f64) -> bool {
        let mask = mask.intersection(SensorMask::all(self.sensors));
        // That of all sensors was looked at when the calibration was made.
        mask == SensorMask::all(self.sensors) || {
            let (one, other) = (self.clamped(one_deg_c), self.clamped(other_deg_c));
            self.ill_conditioned(mask, [one.min(other), one.max(other)]).is_none()
        }
    }

    /// A temperature (°C) in a range at which the sensors of `mask` are ill-conditioned, with the condition number.
    fn ill_conditioned(&self, mask: SensorMask, range_deg_c: [f64; 2]) -> Option<(f64, f64)> {
        let rows_at = |temperature_deg_c| masked(self.rows_at(temperature_deg_c), mask);
        let slopes = by_sensor(|axis, sensor| self.slopes_per_deg_c[axis][sensor]);
        range::ill_conditioned(range_deg_c, rows_at, &masked(slopes, mask), CONDITION_LIMIT)
    }

    /// What the sensors read for the vector `v` in case axes: s = C(T)·v (unit of `v`).
    #[must_use]
    pub fn forward(&self, temperature_deg_c: f64, v: [f64; 3]) -> Sensors<f64> {
        let rows = self.rows_at(temperature_deg_c);
        rows.iter().take(self.sensors).map(|row| dot(*row, v)).collect()
    }

    /// Direction cosines of the input axes, by case axis and sensor.
    #[inline]
    pub(crate) fn axes_at(&self, temperature_deg_c: f64) -> impl Fn(usize, usize) -> f64 {
        let excess = self.clamped(temperature_deg_c) - self.reference_deg_c;
        move |axis, sensor| self.cosines[axis][sensor] + self.slopes_per_deg_c[axis][sensor] * excess
    }

    /// C(T), with T clamped to the fitted range and NaN standing for the reference.
    pub(crate) fn rows_at(&self, temperature_deg_c: f64) -> Rows {
        by_sensor(self.axes_at(temperature_deg_c))
    }

    /// A temperature within the fitted range; NaN stands for the reference (°C).
    fn clamped(&self, temperature_deg_c: f64) -> f64 {
        let [first, last] = self.range_deg_c;
        let stated = if temperature_deg_c.is_nan() { self.reference_deg_c } else { temperature_deg_c };
        // Not `max` and `min`, which look for NaN again.
        let stated = if stated > first { stated } else { first };
        if stated < last { stated } else { last }
    }

    /// √W·C.
    fn weighted(&self, mut rows: Rows) -> Rows {
        for (row, root_weight) in rows.iter_mut().zip(&self.root_weights) {
            *row = row.map(|c| c * root_weight);
        }
        rows
    }
}

/// √w with the mean of w over the sensors made one; all ones where no weights are stated.
fn root_weights(weights: &[f64], sensors: usize) -> [f64; MAX_SENSORS] {
    let mut roots = [1.0; MAX_SENSORS];
    // Scaled by the largest first, so that the sum cannot overflow.
    let largest = weights.iter().copied().fold(0.0, f64::max);
    let sum: f64 = weights.iter().map(|w| w / largest).sum();
    let count = weights.iter().take(sensors).fold(0.0, |n, _| n + 1.0);
    for (root, weight) in roots.iter_mut().zip(weights) {
        *root = libm::sqrt(weight / largest * count / sum);
    }
    roots
}

/// What is known by case axis and sensor, as rows.
fn by_sensor(of: impl Fn(usize, usize) -> f64) -> Rows {
    array::from_fn(|sensor| array::from_fn(|axis| of(axis, sensor)))
}

/// The rows with those of the sensors outside the mask made zero.
fn masked(mut rows: Rows, mask: SensorMask) -> Rows {
    for (index, row) in rows.iter_mut().enumerate() {
        if !mask.contains(index) {
            *row = [0.0; 3];
        }
    }
    rows
}

/// A compiled C(T)⁺, aligned as [`crate::lanes`] are; by default of no sensor.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[repr(align(16))]
pub struct Inverse {
    /// What one unit of each sensor's reading gives along the case axes; the fourth axis is none, and a sensor that takes no
    /// part gives nothing.
    columns: [[f64; 4]; MAX_SENSORS],
    mask: SensorMask,
}

impl Inverse {
    /// What one unit of a sensor's reading gives along the case axes; nothing of one that takes no part.
    #[must_use]
    pub fn column(&self, sensor: usize) -> [f64; 3] {
        let [x, y, z, _] = self.columns.get(sensor).copied().unwrap_or_default();
        [x, y, z]
    }

    /// v = C⁺·s (unit of `readings`).
    ///
    /// A sensor outside the mask is not looked at, so its reading may be anything, NaN too. Readings that are
    /// missing count as zero.
    #[must_use]
    pub fn apply(&self, readings: &[f64]) -> [f64; 3] {
        let used = |(index, s): (usize, &f64)| if self.mask.contains(index) { *s } else { 0.0 };
        let readings: Readings = readings.iter().enumerate().map(used).collect();
        sum_of_columns::<MAX_SENSORS>(&self.columns, readings.lanes())
    }

    /// What [`lerp`](Self::lerp) to `other` gives along the case axes at `u` from 0 on; readings of sensors that take no part must be zero.
    #[expect(clippy::inline_always, reason = "twice per tick: a call costs as much as half of the work")]
    #[inline(always)]
    pub(crate) fn apply_to<const N: usize>(&self, other: &Self, u: f64, readings: &[f64; N]) -> [f64; 3] {
        if self.mask == other.mask && u < 1.0 {
            sum_of_columns(&self.columns_to(other, u), readings)
        } else {
            sum_of_columns(other.columns.first_chunk().unwrap_or(&[[0.0; 4]; N]), readings)
        }
    }

    /// The columns of what [`lerp`](Self::lerp) to `other` gives at `u` from 0 on, of the first `N` sensors.
    #[expect(clippy::inline_always, reason = "twice per tick: a call costs as much as half of the work")]
    #[inline(always)]
    pub(crate) fn columns_to<const N: usize>(&self, other: &Self, u: f64) -> [[f64; 4]; N] {
        let mut columns = [[0.0; 4]; N];
        let ends = self.columns.iter().zip(&other.columns);
        if self.mask == other.mask && u < 1.0 {
            for (column, (from, to)) in columns.iter_mut().zip(ends) {
                *column = array::from_fn(|axis| from[axis] + (to[axis] - from[axis]) * u);
            }
        } else {
            columns.iter_mut().zip(&other.columns).for_each(|(column, to)| *column = *to);
        }
        columns
    }

    /// The matrix a fraction `u` of the way from this one to `other`, u clamped to 0…1.
    ///
    /// Only between matrices of the same sensors: where the masks differ the result is `other` at once, since a
    /// blend would still use the sensor that was just taken out.
    #[must_use]
    pub fn lerp(&self, other: &Self, u: f64) -> Self {
        Self { columns: self.columns_to(other, u.clamp(0.0, 1.0)), mask: other.mask }
    }
}

/// What readings give along the case axes, by the columns of an inverse; those of sensors that take no part must be zero.
#[expect(clippy::inline_always, reason = "twice per tick: a call costs as much as half of the work")]
#[inline(always)]
pub(crate) fn sum_of_columns<const N: usize>(columns: &[[f64; 4]; N], readings: &[f64; N]) -> [f64; 3] {
    let mut sum = [0.0; 4];
    for (column, reading) in columns.iter().zip(readings) {
        sum = array::from_fn(|axis| sum[axis] + column[axis] * reading);
    }
    let [x, y, z, _] = sum;
    [x, y, z]
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "the identity is inverted to the bit")]
mod tests;
