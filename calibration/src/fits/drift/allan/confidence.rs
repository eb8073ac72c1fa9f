//! How well a variance is known: equivalent degrees of freedom, and how variances at different τ hang together.
//!
//! The sum of squared differences is a quadratic form in Gaussian noise; its variance is the sum of the squares of the
//! differences' covariances. For power-law noise these follow from the generalised autocovariance of the phase, as in
//! Greenhall and Riley, "Uncertainty of stability variances based on finite differences" (2003): quantization, white,
//! flicker and random-walk noise of the rate have δ, −|t|, t²·ln|t| and |t|³. The same covariances between two
//! averaging times give what a fit over all of them needs, which the paper does not need and does not have.

use super::deviation::Estimator;
use crate::numbers::real;

/// Kinds of noise by the power of frequency that the rate's spectrum goes with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PowerLaw {
    /// f²: quantization of the angle.
    Quantization,
    /// f⁰: angle random walk.
    White,
    /// f⁻¹: bias instability.
    Flicker,
    /// f⁻²: rate random walk.
    RandomWalk,
}

/// Kernels are sampled so often per averaging time where that is long.
const SAMPLES: usize = 64;
/// Kernels are followed for so many averaging times; beyond it they are zero, or below 10⁻³ of their middle.
const REACH: f64 = 8.0;
/// Averaging times further apart than this share next to nothing.
const FARTHEST_RATIO: usize = 16;

/// Generalised autocovariance of the phase, up to a factor; `smooth` integrates it twice more for the phase's average.
fn autocovariance(law: PowerLaw, smooth: bool, t: f64) -> f64 {
    let a = t.abs();
    let logarithm = || if a > 0.0 { libm::log(a) } else { 0.0 };
    match (law, smooth) {
        (PowerLaw::Quantization, false) => f64::from(u8::from(a < 1e-9)),
        (PowerLaw::White, false) | (PowerLaw::Quantization, true) => -a,
        (PowerLaw::Flicker, false) => a * a * logarithm(),
        (PowerLaw::RandomWalk, false) | (PowerLaw::White, true) => a * a * a,
        (PowerLaw::Flicker, true) => -a * a * a * a * logarithm(),
        (PowerLaw::RandomWalk, true) => -a * a * a * a * a,
    }
}

/// Covariance of two differences t averaging times apart, up to a factor.
fn kernel(law: PowerLaw, smooth: bool, t: f64) -> f64 {
    let phase = |t: f64| {
        let s = |t| autocovariance(law, smooth, t);
        if smooth { 2.0 * s(t) - s(t - 1.0) - s(t + 1.0) } else { s(t) }
    };
    6.0 * phase(t) - 4.0 * (phase(t - 1.0) + phase(t + 1.0)) + phase(t - 2.0) + phase(t + 2.0)
}

/// Equivalent degrees of freedom of a variance over means of `m` ticks that rests on so many differences: ν in
/// "ν·σ̂²/σ² is distributed as χ²".
pub fn degrees_of_freedom(estimator: Estimator, law: PowerLaw, m: usize, differences: usize) -> f64 {
    let count = real(differences.max(1));
    // Differences per averaging time, and how many of them one sample of the kernel stands for.
    let per_time = if estimator == Estimator::Plain { 1 } else { m.max(1) };
    let smooth = estimator == Estimator::Modified;
    let spikes = law == PowerLaw::Quantization && !smooth;
    let stride = if spikes { 1 } else { (per_time / SAMPLES).max(1) };
    let middle = kernel(law, smooth, 0.0);
    let share = |lag: f64| (1.0 - lag / count).max(0.0);
    let lags: Vec<f64> = if spikes {
        vec![real(per_time), 2.0 * real(per_time)]
    } else {
        let last = (REACH * real(per_time)).min(count - 1.0);
        (1..=u32::MAX).map(|k| f64::from(k) * real(stride)).take_while(|lag| *lag <= last).collect()
    };
    let square = |lag: f64| {
        let value = kernel(law, smooth, lag / real(per_time)) / middle;
        share(lag) * value * value
    };
    let sum = real(stride) * (1.0 + 2.0 * lags.into_iter().map(square).sum::<f64>());
    // A stride says nothing where there are fewer differences than that.
    (count / sum.min(count)).max(1.0)
}

/// Noise of the phase as a sum of kinds, in readings times ticks.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Mixture {
    /// Q²/τ0².
    pub quantization: f64,
    /// N²/τ0.
    pub white: f64,
    /// B².
    pub flicker: f64,
    /// K²·τ0.
    pub random_walk: f64,
    /// R·τ0: a ramp, which is no noise, but beats with it.
    pub ramp: f64,
}

impl Mixture {
    /// Autocovariance of the phase over a lag of ticks.
    fn phase(&self, lag: f64) -> f64 {
        let of = |law| autocovariance(law, false, lag);
        // A logarithm costs more than all the rest.
        let flicker = if self.flicker > 0.0 { self.flicker * of(PowerLaw::Flicker) } else { 0.0 };
        self.quantization * of(PowerLaw::Quantization)
            + 0.5 * self.white * of(PowerLaw::White)
            + flicker / (2.0 * std::f64::consts::PI)
            + self.random_walk * of(PowerLaw::RandomWalk) / 12.0
    }

    /// Covariance of two overlapping variances, over means of so many ticks (first) from so many differences (second). Of means longer
    /// than `SAMPLES` ticks every so many lags are taken: both lengths are multiples of that stride, as octaves are.
    pub fn covariance(&self, one: (usize, usize), other: (usize, usize)) -> f64 {
        let (short, long) = (one.0.min(other.0), one.0.max(other.0));
        if long > FARTHEST_RATIO * short {
            return 0.0;
        }
        let stride = (short / SAMPLES).max(1);
        // Spikes fall between samples that are far apart; quantization is nothing at such times.
        let smooth = Self { quantization: if stride == 1 { self.quantization } else { 0.0 }, ..*self };
        let (a, b) = (one.0 / stride, other.0 / stride);
        // A pair of differences asks for nine lags, and the pairs for each of them nine times: all are made once.
        let reach = 3 * (a + b);
        let phase: Vec<f64> = (0..=reach + a + b).map(|lag| smooth.phase(real(lag * stride))).collect();
        let (differences, others) = (real(one.1), real(other.1));
        let (width, of_other) = (real(one.0), real(other.0));
        let ramps = self.ramp * self.ramp * width * width * of_other * of_other;
        let pairs = |lag: f64| (differences.min(others + lag) - lag.max(0.0)).max(0.0);
        let [a, b, reach] = [a, b, reach].map(usize::cast_signed);
        let mut sum = 0.0;
        for lag in b - a - reach..=b - a + reach {
            let count = pairs(real(lag) * real(stride));
            if count > 0.0 {
                let c = second_differences(&phase, [a, b], lag);
                sum += count * (2.0 * c * c + 4.0 * ramps * c);
            }
        }
        sum * real(stride) / (4.0 * width * width * of_other * of_other * differences * others)
    }
}

/// Covariance of a second difference of the phase over means of a with one over means of b, `lag` further on, from its autocovariance by
/// lags from 0.
fn second_differences(phase: &[f64], [a, b]: [isize; 2], lag: isize) -> f64 {
    const WEIGHTS: [(isize, f64); 3] = [(0, 1.0), (1, -2.0), (2, 1.0)];
    let mut sum = 0.0;
    for (i, p) in WEIGHTS {
        for (j, q) in WEIGHTS {
            sum += p * q * phase[(lag + i * a - j * b).unsigned_abs()];
        }
    }
    sum
}

#[expect(clippy::cast_precision_loss, reason = "numbers of ticks of tests")]
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn degrees_of_freedom_agree_with_known_cases() {
        // White noise, every tick: known exactly, (2/3)·(N − 1)… for means of one tick, large N.
        let nu = degrees_of_freedom(Estimator::Overlapping, PowerLaw::White, 1, 10_000);
        assert!((nu / 6_667.0 - 1.0).abs() < 2e-3, "{nu}");
        // NIST SP 1065, table of the overlapping estimator: white noise, many ticks: ν ≈ 3(N−1)/(2m)·4m²/(4m²+5).
        let (m, n) = (100_usize, 100_000_usize);
        let known = 1.5 * n as f64 / m as f64;
        let nu = degrees_of_freedom(Estimator::Overlapping, PowerLaw::White, m, n - 2 * m + 1);
        assert!((nu / known - 1.0).abs() < 0.03, "{nu} {known}");
        // Random walk of the rate, plain: neighbours are nearly independent.
        let nu = degrees_of_freedom(Estimator::Plain, PowerLaw::RandomWalk, 100, 1000);
        assert!((nu / 889.0 - 1.0).abs() < 0.02, "{nu}");
        for law in [PowerLaw::Quantization, PowerLaw::White, PowerLaw::Flicker, PowerLaw::RandomWalk] {
            for estimator in [Estimator::Plain, Estimator::Overlapping, Estimator::Modified] {
                assert!((degrees_of_freedom(estimator, law, 1000, 1) - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn the_covariance_of_a_variance_with_itself_is_that_of_its_degrees_of_freedom() {
        let kinds = [
            (PowerLaw::White, Mixture { white: 2.0, ..Mixture::default() }),
            (PowerLaw::Flicker, Mixture { flicker: 2.0, ..Mixture::default() }),
            (PowerLaw::RandomWalk, Mixture { random_walk: 2.0, ..Mixture::default() }),
        ];
        for (law, mixture) in kinds {
            for (m, count) in [(1_usize, 5000), (16, 5000), (512, 20_000)] {
                let width = m as f64;
                let phase: Vec<f64> = (0..=2 * m).map(|lag| mixture.phase(lag as f64)).collect();
                let of_differences = second_differences(&phase, [m.cast_signed(); 2], 0);
                let variance = of_differences / (2.0 * width * width);
                let of_itself = mixture.covariance((m, count), (m, count));
                let nu = 2.0 * variance * variance / of_itself;
                let known = degrees_of_freedom(Estimator::Overlapping, law, m, count);
                assert!((nu / known - 1.0).abs() < 0.04, "{law:?} {m}: {nu} {known}");
            }
        }
    }
}
