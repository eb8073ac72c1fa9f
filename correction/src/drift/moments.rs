//! Transition and process noise of the drift over an interval, exact and in closed form.
//!
//! The response of a first-order process to a unit impulse is `E0(u) = e^(−u/τ)`; its integrals are
//! `E1 = ∫E0 = τ·(1 − E0)` and `E2 = ∫E1 = τ·(u − E1)`. Every element of transition and noise is one of them at the end
//! of the interval, or an integral of a product of two of them:
//!
//! ```text
//! ∫E0·E1 = E1²/2,    ∫E1·E2 = E2²/2,    ∫E0·E2 = E1·E2 − ∫E1²
//! ```
//!
//! For intervals far below τ the closed forms lose their digits in differences; there the power series stand in.

use nalgebra::Matrix4;

use super::DriftParts;

/// Share of τ below which the series are used.
const SERIES_BELOW: f64 = 1.0;
/// Terms of a series: at one τ the last is below 10⁻¹⁹ of the first.
const SERIES_TERMS: usize = 24;

/// Impulse response of a first-order process at the end of an interval, with its integrals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moments {
    /// `E0`, dimensionless.
    pub(super) decay: f64,
    /// `E1` (s).
    pub(super) once: f64,
    /// `E2` (s²).
    pub(super) twice: f64,
    /// `∫E0²` (s).
    pub(super) square_decay: f64,
    /// `∫E1²` (s³).
    pub(super) square_once: f64,
    /// `∫E2²` (s⁵).
    pub(super) square_twice: f64,
}

impl Moments {
    /// Over an interval of `duration_s` (≥ 0) of a process with correlation time τ (s, > 0).
    pub(super) fn over(duration_s: f64, correlation_time_s: f64) -> Self {
        let h = duration_s;
        let x = h / correlation_time_s;
        let decay = libm::exp(-x);
        // Dimensionless: E1 = h·once, E2 = h²·twice, ∫E0² = h·…, ∫E1² = h³·…, ∫E2² = h⁵·…
        let (once, twice, square_decay, square_once, square_twice) = if x < SERIES_BELOW {
            let twice = series(x, 2, |_, _| 1.0);
            let once = 1.0 - x * twice;
            let square_decay = 1.0 - 2.0 * x * series(2.0 * x, 2, |_, _| 1.0);
            let square_once = series(x, 2, |k, power| (power - 2.0) / (k + 1.0));
            let square_twice = series(x, 4, |k, power| (power - 2.0 * k - 2.0) / (k + 1.0));
            (once, twice, square_decay, square_once, square_twice)
        } else {
            let once = -libm::expm1(-x) / x;
            let twice = (1.0 - once) / x;
            let thrice = (0.5 - twice) / x;
            let square_decay = -libm::expm1(-2.0 * x) / (2.0 * x);
            let square_once = (twice - 0.5 * once * once) / x;
            let square_twice = (1.0 / 3.0 - 2.0 * (twice - thrice) + square_once) / (x * x);
            (once, twice, square_decay, square_once, square_twice)
        };
        let h3 = h * h * h;
        Self {
            decay,
            once: h * once,
            twice: h * h * twice,
            square_decay: h * square_decay,
            square_once: h3 * square_once,
            square_twice: h3 * h * h * square_twice,
        }
    }
}

/// `Σ_{k ≥ first} c(k, 2^k)·(−1)^k·x^(k − first)/k!` for an even `first`.
fn series(x: f64, first: usize, coefficient: impl Fn(f64, f64) -> f64) -> f64 {
    let (mut k, mut term, mut power) = (0.0, 1.0, 1.0);
    for _ in 0..first {
        k += 1.0;
        term /= k;
        power *= 2.0;
    }
    let mut sum = 0.0;
    for _ in 0..SERIES_TERMS {
        sum += coefficient(k, power) * term;
        k += 1.0;
        term *= -x / k;
        power *= 2.0;
    }
    sum
}

/// Transition F and process noise Q of (ε0, ε1, χ, ∫ε) over an interval.
///
/// The fourth state is the integral of ε (rad) since the start of the interval: a reference gives the mean over its
/// span, and with this state that mean is measured as what it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    pub(super) transition: Matrix4<f64>,
    pub(super) noise: Matrix4<f64>,
}

impl Step {
    /// Over an interval of `duration_s` (s, ≥ 0).
    pub(super) fn over(duration_s: f64, parts: &DriftParts) -> Self {
        let m = Moments::over(duration_s, parts.correlation_time_s);
        let t = Moments::over(duration_s, parts.trend_correlation_time_s);
        // Spectral densities of the driving white noises.
        let q = 2.0 * parts.sigma_rad_per_s * parts.sigma_rad_per_s / parts.correlation_time_s;
        let q1 = 2.0 * parts.trend_sigma_rad_per_s2 * parts.trend_sigma_rad_per_s2
            / parts.trend_correlation_time_s;
        #[rustfmt::skip]
        let transition = Matrix4::new(
            1.0,        0.0,     t.once,  0.0,
            0.0,        m.decay, 0.0,     0.0,
            0.0,        0.0,     t.decay, 0.0,
            duration_s, m.once,  t.twice, 1.0,
        );
        let (constant, constant_trend) = (q1 * t.square_once, q1 * 0.5 * t.once * t.once);
        let (markov, trend) = (q * m.square_decay, q1 * t.square_decay);
        let constant_angle = q1 * 0.5 * t.twice * t.twice;
        let markov_angle = q * 0.5 * m.once * m.once;
        let trend_angle = q1 * (t.once * t.twice - t.square_once);
        let angle = q * m.square_once + q1 * t.square_twice;
        #[rustfmt::skip]
        let noise = Matrix4::new(
            constant,       0.0,          constant_trend, constant_angle,
            0.0,            markov,       0.0,            markov_angle,
            constant_trend, 0.0,          trend,          trend_angle,
            constant_angle, markov_angle, trend_angle,    angle,
        );
        Self { transition, noise }
    }
}

#[cfg(test)]
mod tests;
