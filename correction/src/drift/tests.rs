use super::*;

const SOUND: DriftParts = DriftParts {
    sigma_rad_per_s: 2e-8,
    correlation_time_s: 28_800.0,
    trend_sigma_rad_per_s2: 2e-13,
    trend_correlation_time_s: 180_000.0,
    initial_sigma_rad_per_s: 2e-7,
    angle_random_walk_rad_per_sqrt_s: 1.5e-7,
};

#[test]
fn every_wrong_number_is_named_at_once() {
    let broken = DriftParts {
        sigma_rad_per_s: -1.0,
        correlation_time_s: f64::NAN,
        trend_sigma_rad_per_s2: f64::INFINITY,
        trend_correlation_time_s: 59.0,
        initial_sigma_rad_per_s: 0.0,
        angle_random_walk_rad_per_sqrt_s: 0.0,
    };
    let errors = DriftModel::new(&broken).unwrap_err();
    let names: Vec<_> = errors.iter().map(|error| error.name).collect();
    assert_eq!(
        names,
        [
            "sigma_rad_per_s",
            "correlation_time_s",
            "trend_sigma_rad_per_s2",
            "trend_correlation_time_s",
            "initial_sigma_rad_per_s",
            "angle_random_walk_rad_per_sqrt_s",
        ],
    );
}

#[test]
fn a_gyro_may_be_without_markov_part_and_without_trend() {
    let plain = DriftParts { sigma_rad_per_s: 0.0, trend_sigma_rad_per_s2: 0.0, ..SOUND };
    assert_eq!(DriftModel::new(&plain).unwrap().parts(), &plain);
    assert!(DriftModel::new(&SOUND).is_ok());
}
