//! Scale factors over temperature: what gravity or a rate table tells of them, and their way into a document.
//!
//! With a scale factor error s(T), in parts of one, an accelerometer puts out U = K(T)·(1 + s)·f/r + S(T), and a gyro that shows y
//! turns at ω = (1 + s)·y − Ω(T). Both are linear in the coefficients of s, beside those of the bias:
//!
//! ```text
//! (U·r/K − f)·K/r = S(T) + s(T)·f·K/r            y − ω = Ω(T) − s(T)·y
//! ```
//!
//! The y beside s is taken from a cubic over temperature for each run: its noise would otherwise pull s towards that of nothing.

use isotherm_correction::units::STANDARD_GRAVITY_M_PER_S2;
use isotherm_protocol::document::{Curve, Shape};

use crate::document::tidy;
use crate::lsq::weighted::beside_cubic;
use crate::numbers::real;
use crate::report::short;

/// Highest power of temperature in a scale factor error.
pub const HIGHEST: usize = 2;
/// How far the input of an accelerometer must differ between runs (m/s²), and that of a gyro (°/h).
const ENOUGH_M_PER_S2: f64 = 0.5 * STANDARD_GRAVITY_M_PER_S2;
const ENOUGH_DEG_PER_H: f64 = 3600.0;
/// Share of that below which nobody can have meant the runs for a scale factor.
const NOT_MEANT: f64 = 0.01;
/// Parts of the range of temperature, and how many of them must have runs of different input.
const PARTS: usize = 10;
const ENOUGH_PARTS: usize = 8;
/// Most coefficients, and knots, of a curve in a document.
const MOST_COEFFICIENTS: usize = 10;
const KNOTS: u16 = 61;

/// Why a sensor keeps its scale factor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Kept {
    /// Its runs were not made for anything else.
    NotMeant,
    /// They were, but do not reach; in words.
    Short(String),
}

/// Whether the inputs of a sensor (m/s² or °/h by window, no number where there is none) tell its scale factor over temperature.
///
/// # Errors
/// Why they do not.
pub fn told(gyro: bool, inputs: &[f64], temperature: &[f64], [low, high]: [f64; 2]) -> Result<(), Kept> {
    let mut parts = [[f64::INFINITY, f64::NEG_INFINITY]; PARTS];
    let mut whole = [f64::INFINITY, f64::NEG_INFINITY];
    for (input, t) in inputs.iter().zip(temperature).filter(|(input, t)| input.is_finite() && t.is_finite()) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 9")]
        let part = ((t - low) / (high - low).max(1e-9) * real(PARTS)).clamp(0.0, real(PARTS) - 1.0) as usize;
        for ends in [&mut parts[part], &mut whole] {
            *ends = [ends[0].min(*input), ends[1].max(*input)];
        }
    }
    let spread = |ends: &[f64; 2]| (ends[1] - ends[0]).max(0.0);
    let limit = if gyro { ENOUGH_DEG_PER_H } else { ENOUGH_M_PER_S2 };
    if spread(&whole) < NOT_MEANT * limit {
        return Err(Kept::NotMeant);
    }
    let in_words = |value: f64| {
        if gyro { format!("{} °/s", short(value / 3600.0)) } else { format!("{} m/s²", short(value)) }
    };
    if spread(&whole) < limit {
        let what = if gyro {
            "turn the unit on a rate table (--axis, --rate for each log)"
        } else {
            "add a run in another attitude (--roll, --pitch for each log)"
        };
        return Err(Kept::Short(format!(
            "its runs spread its input by {}, at least {} are needed: {what}",
            in_words(spread(&whole)),
            in_words(limit)
        )));
    }
    let enough = parts.iter().filter(|ends| spread(ends) >= limit).count();
    if enough < ENOUGH_PARTS {
        return Err(Kept::Short(format!(
            "its runs spread its input by {} and more in only {enough} of {PARTS} parts of the range of temperature, \
             at least {ENOUGH_PARTS} are needed: take every run through the same temperatures",
            in_words(limit)
        )));
    }
    Ok(())
}

/// What a gyro showed without its noise: a cubic over temperature for each run.
pub fn smoothed(shown: &[f64], run: &[usize], temperature: &[f64], range: [f64; 2]) -> Vec<f64> {
    let runs = run.last().map_or(0, |last| last + 1);
    let mut smooth = vec![f64::NAN; shown.len()];
    for of in 0..runs {
        let rows: Vec<usize> = (0..shown.len()).filter(|&row| run[row] == of).collect();
        let [values, at] =
            [shown, temperature].map(|of| rows.iter().map(|&row| of[row]).collect::<Vec<f64>>());
        let Some(left) = beside_cubic(&at, range, &values, &vec![1.0; rows.len()]) else { continue };
        for (row, (value, left)) in rows.iter().zip(values.iter().zip(&left)) {
            smooth[*row] = value - left;
        }
    }
    smooth
}

/// What the curve holds that a scale factor error (ppm) goes into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Holds {
    /// A scale factor: K·(1 + s).
    Factor,
    /// An error beside one, in ppm: (1 + e)·(1 + s) − 1.
    Error,
}

impl Holds {
    /// The new value from the old one and s (ppm).
    fn value(self, old: f64, s: f64) -> f64 {
        match self {
            Self::Factor => old + 1e-6 * old * s,
            Self::Error => old + s + 1e-6 * old * s,
        }
    }

    /// Likewise for polynomials about the same point.
    fn polynomial(self, old: &[f64], s: &[f64]) -> Vec<f64> {
        let mut new = vec![0.0; (old.len() + s.len()).saturating_sub(1).max(1)];
        for (i, a) in old.iter().enumerate() {
            new[i] += a;
            for (j, b) in s.iter().enumerate() {
                new[i + j] += 1e-6 * a * b;
            }
        }
        if self == Self::Error {
            new.iter_mut().zip(s).for_each(|(new, s)| *new += s);
        }
        new
    }
}

/// A curve with a scale factor error (ppm, by powers about a reference, over a range of temperature) put in.
///
/// Polynomials stay polynomials and splines keep their knots; what has no such form over the fitted range becomes straight lines
/// between knots near enough.
pub fn put(old: &Curve, (reference_deg_c, range): (f64, [f64; 2]), s: &[f64], how: Holds) -> Curve {
    let at = |t: f64| {
        let away = t.clamp(range[0], range[1]) - reference_deg_c;
        s.iter().rev().fold(0.0, |sum, c| sum * away + c)
    };
    let about_reference = match old.shape() {
        Shape::Constant { value } => Some(vec![*value]),
        Shape::Polynomial { reference, coefficients, range: own }
            if own[0] <= range[0] && own[1] >= range[1] =>
        {
            Some(moved(coefficients, reference_deg_c - reference))
        }
        _ => None,
    };
    let polynomial = about_reference
        .map(|old| how.polynomial(&old, s))
        .filter(|new| new.len() <= MOST_COEFFICIENTS)
        .map(|new| Shape::Polynomial {
            reference: reference_deg_c,
            coefficients: new.into_iter().map(tidy).collect(),
            range,
        });
    let shape = polynomial.unwrap_or_else(|| match old.shape() {
        Shape::Spline { knots } => Shape::Spline {
            knots: knots.iter().map(|[t, value]| [*t, tidy(how.value(*value, at(*t)))]).collect(),
        },
        other => {
            let knot = |index: u16| {
                let t = range[0] + (range[1] - range[0]) * f64::from(index) / f64::from(KNOTS - 1);
                [tidy(t), tidy(how.value(other.at(t).unwrap_or(0.0), at(t)))]
            };
            Shape::PiecewiseLinear { knots: (0..KNOTS).map(knot).collect() }
        }
    });
    Curve::new(shape).in_unit(old.unit())
}

/// Coefficients of the same polynomial about a point that lies `by` further.
fn moved(coefficients: &[f64], by: f64) -> Vec<f64> {
    let mut moved = coefficients.to_vec();
    for from in 0..moved.len() {
        for index in (from..moved.len().saturating_sub(1)).rev() {
            moved[index] += by * moved[index + 1];
        }
    }
    moved
}

#[cfg(test)]
mod tests {
    use isotherm_protocol::document::AccelOutput;

    use super::*;

    const OVER: (f64, [f64; 2]) = (10.0, [-40.0, 60.0]);

    #[test]
    fn the_product_is_the_same_function_in_every_form() {
        let s = [300.0, 20.0, -0.1];
        let wide = Shape::Polynomial {
            reference: 25.0,
            coefficients: vec![0.1, 1e-5, -3e-8],
            range: [-60.0, 100.0],
        };
        let Shape::Polynomial { reference, coefficients, .. } = wide.clone() else { unreachable!() };
        let narrow = Shape::Polynomial { reference, coefficients, range: [-20.0, 50.0] };
        let lines = Shape::PiecewiseLinear { knots: vec![[-40.0, 0.099], [60.0, 0.102]] };
        for (shape, limit) in
            [(wide, 1e-12), (narrow, 1e-6), (lines, 1e-6), (Shape::Constant { value: 0.1 }, 1e-12)]
        {
            let old = Curve::new(shape).in_unit(AccelOutput::Volts.scale_unit());
            let new = put(&old, OVER, &s, Holds::Factor);
            assert_eq!(new.unit(), old.unit());
            for t in [-40.0, -31.0, -7.3, 0.0, 10.0, 44.4, 60.0] {
                let away = t - 10.0;
                let factor = 1.0 + 1e-6 * (s[0] + s[1] * away + s[2] * away * away);
                let wanted = old.shape().at(t).unwrap() * factor;
                let got = new.shape().at(t).unwrap();
                assert!((got / wanted - 1.0).abs() < limit, "{t}: {got} {wanted}");
            }
        }
        let old = Curve::new(Shape::Constant { value: 500.0 });
        let new = put(&old, OVER, &s, Holds::Error);
        let got = 1.0 + 1e-6 * new.shape().at(30.0).unwrap();
        let wanted = (1.0 + 500e-6) * (1.0 + 1e-6 * (300.0 + 400.0 - 40.0));
        assert!((got - wanted).abs() < 1e-12);
    }

    #[test]
    fn inputs_must_differ_at_the_same_temperatures() {
        let temperature: Vec<f64> = (0..200).map(|i| f64::from(i % 100)).collect();
        let of =
            |second: f64| -> Vec<f64> { (0..200).map(|i| if i < 100 { -9.8 } else { second }).collect() };
        let range = [0.0, 99.0];
        assert_eq!(told(false, &of(9.8), &temperature, range), Ok(()));
        assert_eq!(told(false, &of(-9.79), &temperature, range), Err(Kept::NotMeant));
        let Err(Kept::Short(near)) = told(false, &of(-6.0), &temperature, range) else { panic!() };
        let cold: Vec<f64> = (0..200).map(|i| f64::from(i % 100) * if i < 100 { 1.0 } else { 0.3 }).collect();
        let Err(Kept::Short(apart)) = told(false, &of(9.8), &cold, range) else { panic!() };
        let Err(Kept::Short(slow)) = told(true, &of(2000.0), &temperature, range) else { panic!() };
        insta::assert_snapshot!([near, apart, slow].join("\n"));
    }
}
