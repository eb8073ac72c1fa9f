use nalgebra::{Cholesky, Matrix4, Vector4};
use proptest::prelude::*;

use super::*;

const PARTS: DriftParts = DriftParts {
    sigma_rad_per_s: 2e-8,
    correlation_time_s: 28_800.0,
    trend_sigma_rad_per_s2: 2e-13,
    trend_correlation_time_s: 180_000.0,
    initial_sigma_rad_per_s: 2e-7,
    angle_random_walk_rad_per_sqrt_s: 1.5e-7,
};

/// Simpson's rule over 0…h.
fn integral(h: f64, f: impl Fn(f64) -> f64) -> f64 {
    let pieces = 20_000;
    let step = h / f64::from(pieces);
    let at = |i: i32| {
        let u = step * f64::from(i);
        f(u) + 4.0 * f(u + 0.5 * step) + f(u + step)
    };
    (0..pieces).map(at).sum::<f64>() * step / 6.0
}

/// E1 and E2 by their first terms where the closed forms would lose digits.
fn responses(u: f64, tau: f64) -> [f64; 3] {
    let x = u / tau;
    let once = -tau * libm::expm1(-x);
    let twice = if x < 1e-2 {
        u * u * (1.0 / 2.0 - x / 6.0 + x * x / 24.0 - x * x * x / 120.0 + x * x * x * x / 720.0)
    } else {
        tau * (u - once)
    };
    [libm::exp(-x), once, twice]
}

#[test]
fn every_integral_is_that_of_the_impulse_response() {
    for tau in [60.0, 3e4, 1e9] {
        for share in [1e-9, 1e-5, 0.003, 0.5, 0.999, 1.0, 1.001, 4.0, 60.0] {
            let h = tau * share;
            let m = Moments::over(h, tau);
            let [decay, once, twice] = responses(h, tau);
            let pairs = [
                (m.decay, decay),
                (m.once, once),
                (m.twice, twice),
                (m.square_decay, integral(h, |u| responses(u, tau)[0].powi(2))),
                (m.square_once, integral(h, |u| responses(u, tau)[1].powi(2))),
                (m.square_twice, integral(h, |u| responses(u, tau)[2].powi(2))),
            ];
            for (index, (got, expected)) in pairs.into_iter().enumerate() {
                let off = (got / expected - 1.0).abs();
                assert!(off < 1e-9, "moment {index} over {share} τ of {tau} s: {got}, expected {expected}");
            }
        }
    }
}

#[test]
fn nothing_changes_over_no_time() {
    let step = Step::over(0.0, &PARTS);
    assert_eq!(step.transition, Matrix4::identity());
    assert_eq!(step.noise, Matrix4::zeros());
}

#[test]
fn markov_part_and_trend_keep_their_sigmas_for_ever() {
    for duration_s in [1e-3, 60.0, 1e5, 1e8] {
        let step = Step::over(duration_s, &PARTS);
        for (index, sigma) in [(1, PARTS.sigma_rad_per_s), (2, PARTS.trend_sigma_rad_per_s2)] {
            let decay = step.transition[(index, index)];
            let variance = decay * decay * sigma * sigma + step.noise[(index, index)];
            assert!((variance / (sigma * sigma) - 1.0).abs() < 1e-12, "{duration_s} s: {variance}");
        }
    }
}

proptest! {
    #[test]
    fn two_steps_are_one_over_both_times(
        first_exponent in -2.0..6.0_f64,
        second_exponent in -2.0..6.0_f64,
        tau_exponent in 1.8..8.0_f64,
        trend_tau_exponent in 1.8..8.0_f64,
    ) {
        let parts = DriftParts {
            correlation_time_s: 10_f64.powf(tau_exponent),
            trend_correlation_time_s: 10_f64.powf(trend_tau_exponent),
            ..PARTS
        };
        let (first_s, second_s) = (10_f64.powf(first_exponent), 10_f64.powf(second_exponent));
        let (first, second) = (Step::over(first_s, &parts), Step::over(second_s, &parts));
        // The integral goes on over both, as the fourth state does.
        let transition = second.transition * first.transition;
        let noise = second.transition * first.noise * second.transition.transpose() + second.noise;
        let whole = Step::over(first_s + second_s, &parts);
        for i in 0..4 {
            for j in 0..4 {
                let (got, expected) = (transition[(i, j)], whole.transition[(i, j)]);
                // What has decayed to the smallest numbers that there are has no twelve digits.
                let slack = 1e-12 * expected.abs() + f64::MIN_POSITIVE;
                prop_assert!((got - expected).abs() <= slack, "F({i}, {j}): {got}, {expected}");
                let scale = libm::sqrt(whole.noise[(i, i)] * whole.noise[(j, j)]);
                let (got, expected) = (noise[(i, j)], whole.noise[(i, j)]);
                prop_assert!((got - expected).abs() <= 1e-9 * scale, "Q({i}, {j}): {got}, {expected}");
            }
        }
    }

    #[test]
    fn the_noise_is_a_covariance(exponent in -3.0..9.0_f64) {
        let noise = Step::over(10_f64.powf(exponent), &PARTS).noise;
        let scale = Matrix4::from_diagonal(&noise.diagonal().map(|variance| 1.0 / libm::sqrt(variance)));
        // Over short times ε0, χ and the angle of one noise are nearly dependent: a correlation matrix within rounding.
        let correlation = scale * noise * scale + Matrix4::from_diagonal(&Vector4::repeat(1e-12));
        prop_assert!(Cholesky::new(correlation).is_some(), "{noise}");
    }
}
