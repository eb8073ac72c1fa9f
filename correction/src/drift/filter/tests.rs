use super::*;
use crate::units::{AngularRate, Span};

/// The gyro of 002's table 1 with the shortest correlation time, and its first trend of table 2.
fn parts() -> DriftParts {
    let deg_per_h = |rate| AngularRate::from_deg_per_h(rate).as_rad_per_s();
    DriftParts {
        sigma_rad_per_s: deg_per_h(0.0040),
        correlation_time_s: 6.0 * 3600.0,
        trend_sigma_rad_per_s2: deg_per_h(8e-5) / 3600.0,
        trend_correlation_time_s: 48.0 * 3600.0,
        initial_sigma_rad_per_s: deg_per_h(0.05),
        angle_random_walk_rad_per_sqrt_s: deg_per_h(5e-4 * 60.0),
    }
}

fn filter(parts: &DriftParts) -> Filter {
    let mut filter = Filter::new(DriftModel::new(parts).unwrap());
    filter.start(at_s(0.0));
    filter
}

fn at_s(s: f64) -> Timestamp {
    Timestamp::default() + Span::from_s(s)
}

fn minute(k: u32, mean: f64) -> Measured {
    let start = at_s(60.0 * f64::from(k));
    Measured { start, end: start + Span::from_ms(60_000), mean, variance: 0.0 }
}

/// Measurements taken, refused, and believed.
fn counts(filter: &Filter) -> [u64; 3] {
    [filter.updates, filter.refused, filter.believed]
}

#[test]
fn before_anything_is_measured_sigma_is_the_stated_one() {
    let parts = parts();
    let filter = filter(&parts);
    let DriftEstimate { sigma, trend, trend_sigma, .. } = filter.estimate(at_s(0.0));
    let whole = libm::hypot(parts.initial_sigma_rad_per_s, parts.sigma_rad_per_s);
    assert!((sigma / whole - 1.0).abs() < 1e-12);
    assert!(trend == 0.0 && filter.rate_at(at_s(1e6)) == 0.0);
    assert!((trend_sigma / parts.trend_sigma_rad_per_s2 - 1.0).abs() < 1e-12);
}

#[test]
fn a_constant_drift_is_found_as_well_as_white_noise_allows() {
    let constant = DriftParts { sigma_rad_per_s: 0.0, trend_sigma_rad_per_s2: 0.0, ..parts() };
    let mut filter = filter(&constant);
    for k in 0..60 {
        assert!(filter.update(&minute(k, 1e-7)));
    }
    // Weight of the initial knowledge against 3600 s of white noise.
    let white = constant.angle_random_walk_rad_per_sqrt_s.powi(2) / 3600.0;
    let initial = constant.initial_sigma_rad_per_s.powi(2);
    let expected = 1e-7 * initial / (initial + white);
    assert!((filter.rate_at(at_s(3600.0)) / expected - 1.0).abs() < 1e-9);
    let sigma = libm::sqrt(initial * white / (initial + white));
    assert!((filter.estimate(at_s(3600.0)).sigma / sigma - 1.0).abs() < 1e-9);
}

#[test]
fn one_reference_says_the_same_as_its_two_halves() {
    // The drift changes by several sigmas within the span: the mean over it is measured, no value at a time.
    let fast = DriftParts { correlation_time_s: 60.0, ..parts() };
    let mut whole = filter(&fast);
    // Halves with the same white noise; their mean is the whole's measurement.
    let mut halves = filter(&fast);
    let [start, middle, end] = [0.0, 30.0, 60.0].map(at_s);
    whole.update(&Measured { start, end, mean: 2e-8, variance: 0.0 });
    halves.update(&Measured { start, end: middle, mean: 2e-8, variance: 0.0 });
    halves.update(&Measured { start: middle, end, mean: 2e-8, variance: 0.0 });
    // Two halves know a little more (which of them held how much), never less.
    let (one, two) = (whole.estimate(end).sigma, halves.estimate(end).sigma);
    assert!(two <= one && two > 0.97 * one, "{two} of {one}");
}

#[test]
fn taking_a_minute_for_a_point_would_err_by_a_twentieth_of_its_noise() {
    // The mean over 60 s and the value at its end differ by the drift's own change; with 002's shortest correlation time
    // it is small against white noise, but it needs not be neglected and is not.
    let parts = parts();
    let step = Step::over(60.0, &parts);
    let mean_less_end = Vector4::new(-1.0, -1.0, 0.0, 1.0 / 60.0);
    let from_noise = mean_less_end.dot(&(step.noise * mean_less_end));
    let markov_start = step.transition.m42 / 60.0 - step.transition.m22;
    let variance = from_noise + markov_start * markov_start * parts.sigma_rad_per_s.powi(2);
    let white = parts.angle_random_walk_rad_per_sqrt_s.powi(2) / 60.0;
    let share = libm::sqrt(variance / white);
    assert!((0.03..0.06).contains(&share), "{share}");
    // By hand: σ²·(2/3)·L/τ for the Markov part.
    let by_hand = parts.sigma_rad_per_s * libm::sqrt(2.0 / 3.0 * 60.0 / parts.correlation_time_s);
    assert!((libm::sqrt(variance) / by_hand - 1.0).abs() < 0.01);
}

#[test]
fn the_markov_part_fades_from_the_prediction_and_the_constant_part_stays() {
    let fading = DriftParts { trend_sigma_rad_per_s2: 0.0, initial_sigma_rad_per_s: 1e-12, ..parts() };
    let staying = DriftParts { trend_sigma_rad_per_s2: 0.0, sigma_rad_per_s: 0.0, ..parts() };
    let [fading, staying] = [fading, staying].map(|parts| {
        let mut filter = filter(&parts);
        (0..60).for_each(|k| assert!(filter.update(&minute(k, 2e-8))));
        [0.0, 1.0, 10.0].map(|taus| filter.rate_at(at_s(3600.0 + taus * parts.correlation_time_s)))
    });
    assert!(fading[0] > 1e-8 && (fading[1] / fading[0] - libm::exp(-1.0)).abs() < 1e-3, "{fading:?}");
    assert!(fading[2] < 1e-3 * fading[0], "{fading:?}");
    assert_eq!(staying.map(f64::to_bits), [staying[0].to_bits(); 3]);
}

#[test]
fn the_trend_goes_on_in_the_prediction_for_its_correlation_time() {
    let trend = 1e-12;
    let trending = DriftParts {
        sigma_rad_per_s: 0.0,
        trend_sigma_rad_per_s2: trend,
        trend_correlation_time_s: 1e6,
        angle_random_walk_rad_per_sqrt_s: 1e-9,
        ..parts()
    };
    let mut filter = filter(&trending);
    (0..600).for_each(|k| {
        filter.update(&minute(k, trend * (60.0 * f64::from(k) + 30.0)));
    });
    let end = at_s(36_000.0);
    assert!((filter.estimate(end).trend / trend - 1.0).abs() < 0.05, "{:?}", filter.estimate(end));
    let gained = |s| filter.rate_at(end + Span::from_s(s)) - filter.rate_at(end);
    assert!((gained(1e4) / (trend * 1e4) - 1.0).abs() < 0.05);
    // In the end χ·τ1, not χ·t.
    assert!((gained(1e8) / (trend * 1e6) - 1.0).abs() < 0.05, "{}", gained(1e8));
}

#[test]
fn a_wrong_reference_changes_no_bit_of_the_state() {
    let mut filter = filter(&parts());
    for k in 0..120 {
        filter.update(&minute(k, 3e-8));
    }
    let before = filter.clone();
    let innovation_sigma = libm::sqrt(
        before.estimate(at_s(7200.0)).sigma.powi(2) + parts().angle_random_walk_rad_per_sqrt_s.powi(2) / 60.0,
    );
    let wrong = before.rate_at(at_s(7200.0)) + 5.2 * innovation_sigma;
    assert!(!filter.update(&minute(120, wrong)));
    assert_eq!(
        (filter.state, filter.covariance, filter.time),
        (before.state, before.covariance, before.time)
    );
    assert_eq!(counts(&filter), [120, 1, 0]);
    let near = before.rate_at(at_s(7200.0)) + 4.8 * innovation_sigma;
    assert!(filter.update(&minute(120, near)));
}

#[test]
fn readings_that_are_no_numbers_are_refused_for_ever() {
    let mut filter = filter(&parts());
    let before = filter.clone();
    for k in 0..40 {
        let broken =
            [(f64::NAN, 0.0), (0.0, f64::INFINITY), (f64::INFINITY, f64::NAN), (1e300, 0.0)][k as usize % 4];
        let measured = Measured { variance: broken.1, ..minute(k, broken.0) };
        assert!(!filter.update(&measured));
    }
    assert_eq!((filter.state, filter.covariance), (before.state, before.covariance));
}

#[test]
fn refusals_that_agree_are_believed_at_last_and_others_never() {
    let mut stepped = filter(&parts());
    let mut chatter = filter(&parts());
    let mut absurd = filter(&parts());
    for k in 0..60 {
        for filter in [&mut stepped, &mut chatter, &mut absurd] {
            filter.update(&minute(k, 0.0));
        }
    }
    let step = AngularRate::from_deg_per_h(0.3).as_rad_per_s();
    for k in 60..69 {
        assert!(!stepped.update(&minute(k, step)), "{k}");
    }
    assert!(stepped.update(&minute(69, step)), "believed");
    assert_eq!(counts(&stepped), [61, 9, 1]);
    for k in 70..80 {
        assert!(stepped.update(&minute(k, step)), "{k}");
    }
    assert!((stepped.rate_at(at_s(4800.0)) / step - 1.0).abs() < 0.01);

    for k in 60..200 {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        assert!(!chatter.update(&minute(k, sign * step)), "{k}");
    }
    // Twelve initial sigmas: that is no drift of this gyro.
    for k in 60..200 {
        assert!(!absurd.update(&minute(k, 2.0 * step)), "{k}");
    }
    assert_eq!(counts(&absurd), [60, 140, 0]);
}

#[test]
fn after_a_step_back_of_time_the_constant_part_is_kept_with_less_trust() {
    let mut filter = filter(&parts());
    for k in 0..600 {
        filter.update(&minute(k, 1e-7));
    }
    let before = filter.state;
    filter.lose_time();
    filter.start(at_s(5.0));
    assert!((filter.rate_at(at_s(5.0)) - before.x).abs() < 1e-20);
    let sigma = filter.estimate(at_s(5.0)).sigma;
    assert!(sigma > parts().initial_sigma_rad_per_s && sigma < 2.0 * parts().initial_sigma_rad_per_s);
    assert_eq!(filter.last_update, None);
    assert_eq!(filter.updates, 600);
}

#[test]
fn the_covariance_stays_one_whatever_the_parameters_and_however_long() {
    let [least, most] = [1e-12, 0.1];
    let hard = [
        parts(),
        DriftParts { initial_sigma_rad_per_s: most, angle_random_walk_rad_per_sqrt_s: 1e-12, ..parts() },
        DriftParts {
            sigma_rad_per_s: 0.0,
            trend_sigma_rad_per_s2: 1e-4,
            trend_correlation_time_s: 60.0,
            ..parts()
        },
        DriftParts {
            sigma_rad_per_s: 0.1,
            correlation_time_s: 60.0,
            initial_sigma_rad_per_s: least,
            ..parts()
        },
        DriftParts { trend_correlation_time_s: 1e9, correlation_time_s: 1e9, ..parts() },
    ];
    for parts in hard {
        let mut filter = filter(&parts);
        for k in 0..100_000_u32 {
            let measured =
                Measured { variance: 1e-30, ..minute(k, filter.rate_at(at_s(60.0 * f64::from(k)))) };
            assert!(filter.update(&measured), "{parts:?}");
        }
        let p = filter.covariance;
        assert!(p.iter().all(|value| value.is_finite()), "{p}");
        assert_eq!(p, p.transpose());
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let minor = p[(i, i)] * p[(j, j)] - p[(i, j)] * p[(i, j)];
            assert!(p[(i, i)] >= 0.0 && minor >= -1e-12 * p[(i, i)] * p[(j, j)], "{parts:?}: {p}");
        }
    }
}

#[test]
fn the_mean_of_the_innovations_forgets_what_is_long_past() {
    let mut filter = filter(&parts());
    let mean = |filter: &Filter| filter.estimate(at_s(0.0)).mean_nis;
    assert_eq!(mean(&filter), None);
    filter.innovations.push(8.0);
    assert_eq!(mean(&filter), Some(8.0));
    for _ in 0..INNOVATIONS_KEPT {
        filter.innovations.push(1.0);
    }
    assert_eq!(mean(&filter), Some(1.0));
}
