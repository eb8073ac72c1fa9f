//! Functions of one variable as a calibration states them: polynomial, piecewise-linear table, natural cubic
//! spline.
//!
//! A curve is never extrapolated: outside its fitted range the argument is clamped to the range and the
//! result says so (models §2). The unit of argument and value is that of the term that owns the curve.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use crate::defect::{Checker, Defect, DefectKind};

/// Most coefficients of a polynomial: degree 9.
pub const MAX_COEFFICIENTS: usize = 10;
/// Fewest knots of a table or spline.
pub const MIN_KNOTS: usize = 2;
/// Most knots of a table or spline.
pub const MAX_KNOTS: usize = 64;

/// A curve as the calibration document states it.
#[derive(Debug, Clone, PartialEq)]
pub enum CurveParts {
    /// The same value everywhere.
    Constant {
        /// The value (finite).
        value: f64,
    },
    /// `Σ c_k·(x − reference)^k`.
    Polynomial {
        /// Point about which the powers are taken (argument's unit, finite).
        reference: f64,
        /// `c_0`, `c_1`, … (value's unit per argument's unit^k, 1…10 of them, finite).
        coefficients: Vec<f64>,
        /// Fitted range: first and last valid argument (argument's unit, first < last).
        range: [f64; 2],
    },
    /// Straight lines between knots.
    PiecewiseLinear {
        /// [argument, value] pairs (2…64, arguments strictly increasing, finite).
        knots: Vec<[f64; 2]>,
    },
    /// Cubic spline through the knots, natural: second derivative zero at both ends.
    Spline {
        /// [argument, value] pairs (2…64, arguments strictly increasing, finite).
        knots: Vec<[f64; 2]>,
    },
}

/// Range of a constant: wider than any temperature or rate.
pub(crate) const ANYWHERE: [f64; 2] = [-1e9, 1e9];

impl CurveParts {
    /// The value at an argument, clamped to the fitted range; `None` where the numbers make no curve.
    #[must_use]
    pub fn at(&self, x: f64) -> Option<f64> {
        Curve::new(self).ok().map(|curve| curve.at(x).value)
    }

    /// The curve in other units: arguments times `over`, values times `factor`, `plus` a constant.
    #[must_use]
    pub fn scaled(&self, over: f64, factor: f64, plus: f64) -> Self {
        let convert = |knots: &[[f64; 2]]| knots.iter().map(|[x, y]| [x * over, y * factor + plus]).collect();
        match self {
            Self::Constant { value } => Self::Constant { value: value * factor + plus },
            Self::Polynomial { reference, coefficients, range } => {
                let factors = core::iter::successors(Some(factor), |factor| Some(factor / over));
                let mut coefficients: Vec<f64> =
                    coefficients.iter().zip(factors).map(|(c, f)| c * f).collect();
                if let Some(first) = coefficients.first_mut() {
                    *first += plus;
                }
                let (reference, range) = (reference * over, range.map(|end| end * over));
                Self::Polynomial { reference, coefficients, range }
            }
            Self::PiecewiseLinear { knots } => Self::PiecewiseLinear { knots: convert(knots) },
            Self::Spline { knots } => Self::Spline { knots: convert(knots) },
        }
    }
}

/// A curve's value at one argument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evaluated {
    /// The value (the owning term's unit).
    pub value: f64,
    /// The argument was outside the fitted range (or not a number) and was clamped to it.
    pub clamped: bool,
}

/// One stretch of a curve: `Σ c_k·(x − origin)^k` up to the next one's origin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Piece {
    origin: f64,
    coefficients: ArrayVec<f64, MAX_COEFFICIENTS>,
}

/// A validated curve, ready to evaluate without allocation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// A polynomial is one piece, about its reference. A table or spline has one per knot: the last one holds the last
    /// knot's value, so that it is met exactly.
    pieces: Vec<Piece>,
    range: [f64; 2],
}

impl Curve {
    /// Validates and compiles a stated curve.
    ///
    /// # Errors
    ///
    /// The first thing that is wrong with it.
    pub fn new(parts: &CurveParts) -> Result<Self, Defect> {
        match parts {
            CurveParts::Constant { value } => polynomial(0.0, &[*value], ANYWHERE),
            CurveParts::Polynomial { reference, coefficients, range } => {
                polynomial(*reference, coefficients, *range)
            }
            CurveParts::PiecewiseLinear { knots } => pieces(knots, |_| Vec::new()),
            CurveParts::Spline { knots } => pieces(knots, natural_second_derivatives),
        }
    }

    /// The same value everywhere; only a NaN argument counts as clamped.
    #[must_use]
    pub fn constant(value: f64) -> Self {
        let piece = Piece { origin: 0.0, coefficients: [value].into_iter().collect() };
        Self { pieces: [piece].into(), range: [f64::NEG_INFINITY, f64::INFINITY] }
    }

    /// Evaluates at `x`, clamped to the fitted range.
    ///
    /// A NaN argument gives the value at the polynomial's reference (clamped) or at the first knot.
    #[must_use]
    pub fn at(&self, x: f64) -> Evaluated {
        let [first, last] = self.range;
        let clamped = !(x >= first && x <= last);
        let stated = if x.is_nan() { self.pieces.first().map_or(x, |piece| piece.origin) } else { x };
        let x = stated.max(first).min(last);
        let after = self.pieces.partition_point(|piece| piece.origin <= x);
        let piece = self.pieces.get(after.saturating_sub(1));
        let value = piece.map_or(0.0, |piece| nested(&piece.coefficients, x - piece.origin));
        Evaluated { value, clamped }
    }

    /// Arguments at which one stretch of the curve ends and another begins; the reference of a polynomial.
    pub(crate) fn knots(&self) -> impl Iterator<Item = f64> {
        self.pieces.iter().map(|piece| piece.origin)
    }

    /// First and last argument of the fitted range; without end where there is none.
    #[must_use]
    pub const fn range(&self) -> [f64; 2] {
        self.range
    }
}

/// `Σ c_k·x^k` in nested (Horner) form.
fn nested(coefficients: &[f64], x: f64) -> f64 {
    let mut descending = coefficients.iter().rev();
    let highest = descending.next().copied().unwrap_or(0.0);
    descending.fold(highest, |sum, c| sum * x + c)
}

/// Whether `Σ |c_k|·x^k`, a bound of the polynomial on [−x, x], is representable.
fn is_bounded(coefficients: &[f64], x: f64) -> bool {
    let bound = coefficients.iter().rev().fold(0.0, |sum: f64, c| sum * x.abs() + c.abs());
    bound.is_finite()
}

/// Somewhere beyond `near` the values cannot be represented.
fn overflow(near: f64) -> Defect {
    Defect { path: String::new(), kind: DefectKind::Overflow { near } }
}

/// Compiles a polynomial.
fn polynomial(reference: f64, stated: &[f64], range: [f64; 2]) -> Result<Curve, Defect> {
    let mut checker = Checker::default();
    // Of the curve as a whole: the list may be one that a document lacks.
    checker.count("", stated.len(), 1, MAX_COEFFICIENTS);
    checker.finite("reference", reference);
    for &coefficient in stated {
        checker.finite("coefficients", coefficient);
    }
    checker.range("range", range, f64::MIN, f64::MAX);
    checker.first()?;
    if let Some(near) = range.into_iter().find(|end| !is_bounded(stated, end - reference)) {
        return Err(overflow(near));
    }
    let coefficients = stated.iter().copied().take(MAX_COEFFICIENTS).collect();
    Ok(Curve { pieces: [Piece { origin: reference, coefficients }].into(), range })
}

/// Compiles a table or spline; `second` gives the second derivatives at the knots, empty for straight lines.
fn pieces(knots: &[[f64; 2]], second: fn(&[[f64; 2]]) -> Vec<f64>) -> Result<Curve, Defect> {
    let mut checker = Checker::default();
    checker.count("", knots.len(), MIN_KNOTS, MAX_KNOTS);
    checker.finite_rows("knots", knots);
    let stretches = || knots.iter().zip(knots.iter().skip(1)).enumerate();
    for (index, ([previous, _], [got, _])) in stretches().filter(|(_, (a, b))| b[0] <= a[0]) {
        let (index, previous, got) = (index + 1, *previous, *got);
        let kind = DefectKind::KnotsNotIncreasing { index, previous, got };
        checker.push(&format!("knots[{index}]"), kind);
    }
    checker.first()?;
    let second = second(knots);
    let second_at = |index: usize| second.get(index).copied().unwrap_or(0.0);
    let mut pieces = Vec::with_capacity(knots.len());
    for (index, (a, b)) in stretches() {
        let width = b[0] - a[0];
        let (m, n) = (second_at(index), second_at(index + 1));
        let slope = (b[1] - a[1]) / width - width * (2.0 * m + n) / 6.0;
        let coefficients = [a[1], slope, m / 2.0, (n - m) / (6.0 * width)];
        if !is_bounded(&coefficients, width) {
            return Err(overflow(a[0]));
        }
        pieces.push(Piece { origin: a[0], coefficients: coefficients.into_iter().collect() });
    }
    let ends = [knots.first(), knots.last()].map(|knot| knot.copied().unwrap_or_default());
    let [[from, _], [to, value]] = ends;
    pieces.push(Piece { origin: to, coefficients: [value, 0.0, 0.0, 0.0].into_iter().collect() });
    Ok(Curve { pieces, range: [from, to] })
}

/// Second derivatives of the natural cubic spline at its knots.
///
/// `h_{i−1}·m_{i−1} + 2(h_{i−1} + h_i)·m_i + h_i·m_{i+1} = 6(s_i − s_{i−1})`, m = 0 at both ends; the system
/// is diagonally dominant, so elimination without pivoting is stable.
fn natural_second_derivatives(knots: &[[f64; 2]]) -> Vec<f64> {
    let inner = knots.iter().zip(knots.iter().skip(1)).zip(knots.iter().skip(2));
    // Row i after elimination: m_i = right − upper · m_{i+1}.
    let mut rows = Vec::with_capacity(knots.len());
    let (mut upper, mut right) = (0.0, 0.0);
    for ((a, b), c) in inner {
        let (h, g) = (b[0] - a[0], c[0] - b[0]);
        let bend = 6.0 * ((c[1] - b[1]) / g - (b[1] - a[1]) / h);
        let pivot = 2.0 * (h + g) - h * upper;
        right = (bend - h * right) / pivot;
        upper = g / pivot;
        rows.push((upper, right));
    }
    let mut second = Vec::with_capacity(knots.len());
    second.push(0.0);
    let mut next = 0.0;
    for (upper, right) in rows.into_iter().rev() {
        next = right - upper * next;
        second.push(next);
    }
    second.push(0.0);
    second.reverse();
    second
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "knots and clamped ends are met to the bit")]
mod tests;
