//! Covariances of known axes.

use isotherm_correction::units::AngularRate;

use super::*;
use crate::Mapping;

fn mapping() -> UnitMapping {
    let text = "version = 1\n[[unit]]\nserial = \"A-1\"\nraw = \"/raw\"\ncorrected = \"/imu\"\ntime.tick_ms = 10\n\
                accel.velocity_random_walk_m_per_s_per_sqrt_h = 0.6\ngyro.angle_random_walk_deg_per_sqrt_h = 0.06\n";
    Mapping::parse(text, "m").unwrap().units.into_iter().next().unwrap()
}

fn document(name: &str) -> Document {
    let path = format!("{}/../config/calibration/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    Document::parse(&std::fs::read_to_string(path).unwrap(), None).unwrap().document
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-3 * b.abs()
}

#[test]
fn the_document_comes_before_the_mapping() {
    let laser = document("ZLG-0001");
    let drift = laser.gyro.sensor[0].drift.clone().unwrap();
    let noise = Noise::of(&laser, [1; 8], &mapping());
    let covariance = noise.rate(0.01);
    let white = drift.angle_random_walk_deg_per_sqrt_h.to_radians() / 60.0;
    let slow = (drift.initial_sigma_deg_per_h.powi(2) + drift.sigma_deg_per_h.powi(2))
        * AngularRate::from_deg_per_h(1.0).as_rad_per_s().powi(2);
    // Its input axes are the case axes but for minutes of arc.
    assert!(close(covariance[0], white * white / 0.01 + slow), "{covariance:?}");
    assert!(covariance[1].abs() < 0.01 * covariance[0] && covariance[1].total_cmp(&covariance[3]).is_eq());

    let mems = Noise::of(&document("MEMS-0001"), [2; 8], &mapping());
    let walk = 0.06_f64.to_radians() / 60.0;
    assert!(close(mems.rate(0.01)[4], walk * walk / 0.01), "{:?}", mems.rate(0.01));
    assert!(close(mems.force(0.01)[8], 1e-4 / 0.01), "{:?}", mems.force(0.01));
    let unstated = UnitMapping { gyro: crate::mapping::GyroMapping::default(), ..mapping() };
    assert_eq!(Noise::of(&document("MEMS-0001"), [2; 8], &unstated).gyro, None, "unknown");
}

#[test]
fn the_drift_estimator_s_sigma_replaces_the_document_s() {
    let mut noise = Noise::of(&document("ZLG-0001"), [1; 8], &mapping());
    let drift = |rate_rad_per_s, subtracted| DriftStatus {
        gyro: "x".to_owned(),
        rate_rad_per_s,
        sigma_rad_per_s: 3.0,
        trend_rad_per_s2: 0.0,
        updates: 1,
        refused: 0,
        mean_nis: None,
        last_update_ns: None,
        subtracted,
    };
    noise.update(&[drift(4.0, false), drift(4.0, true), drift(0.0, false)]);
    let covariance = noise.rate(1e6);
    assert!(
        close(covariance[0], 25.0) && close(covariance[4], 9.0) && close(covariance[8], 9.0),
        "{covariance:?}"
    );
}

/// Four gyros on a cone: the covariance of their least squares.
#[test]
fn a_redundant_set_is_resolved() {
    let (s, c) = (0.5_f64.sqrt(), 0.5_f64.sqrt());
    let rows = vec![[s, 0.0, c], [-s, 0.0, c], [0.0, s, c], [0.0, -s, c]];
    let orientation = OrientationParts {
        reference_deg_c: 20.0,
        rows,
        slopes_per_deg_c: Vec::new(),
        plays: Vec::new(),
        weights: Vec::new(),
        range_deg_c: [-60.0, 100.0],
        parity_limit: None,
        parity_confirm_ticks: 1,
    };
    let resolved = Resolved::new(&orientation, vec![(2.0, 1.0); 4]).unwrap();
    let covariance = resolved.covariance(2.0);
    // Σ s² over two of them is 1 about x and y, Σ c² over all is 2 about z.
    for (at, expected) in [(0, 2.0), (4, 2.0), (8, 1.0), (1, 0.0), (2, 0.0), (5, 0.0)] {
        assert!((covariance[at] - expected).abs() < 1e-12, "{covariance:?}");
    }
}

#[test]
fn what_a_batch_says_stands_where_it_is_known() {
    let causes = Causes { noise: [3e-6, 0.0, 1e-6], calibration: [4e-6, 2e-6, 0.0], ..Causes::default() };
    let covariance = stated(&causes, 0.01).unwrap();
    for (at, expected) in [(0, 25e-8), (4, 4e-8), (8, 1e-8), (1, 0.0), (5, 0.0)] {
        assert!((covariance[at] - expected).abs() < 1e-15, "{covariance:?}");
    }
    assert_eq!(stated(&Causes { clamping: [0.0, f64::NAN, 0.0], ..causes }, 0.01), None);
}
