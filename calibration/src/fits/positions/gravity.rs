//! Gravity at the place of a calibration: every scale factor of an accelerometer is relative to it.

use isotherm_correction::units::STANDARD_GRAVITY_M_PER_S2;

use crate::report::{short, six};

/// Decrease of gravity with height (1/s²).
const PER_METRE: f64 = 3.086e-6;

/// Gravity on the WGS 84 ellipsoid by Somigliana's closed formula, less the free-air decrease with height (m/s²).
pub fn normal(latitude_deg: f64, height_m: f64) -> f64 {
    let sine = libm::sin(latitude_deg.to_radians());
    let square = sine * sine;
    let on_ellipsoid = 9.780_325_335_9 * (1.0 + 0.001_931_852_652_41 * square)
        / libm::sqrt(1.0 - 0.006_694_379_990_13 * square);
    on_ellipsoid - PER_METRE * height_m
}

/// Gravity from what the command line says, and a warning where it says nothing.
pub fn stated(gravity: Option<f64>, latitude_deg: Option<f64>, height_m: f64) -> (f64, Option<String>) {
    match (gravity, latitude_deg) {
        (Some(gravity), latitude) => (gravity, latitude.and_then(radians)),
        (None, Some(latitude)) => (normal(latitude, height_m), radians(latitude)),
        (None, None) => {
            let assumed = format!(
                "gravity is assumed as {STANDARD_GRAVITY_M_PER_S2} m/s²; at your place it, and all scale factors, may differ by up \
                 to 0.3 %: state --gravity, or --latitude and --height"
            );
            (STANDARD_GRAVITY_M_PER_S2, Some(assumed))
        }
    }
}

/// Words where a latitude may be in radians.
fn radians(latitude: f64) -> Option<String> {
    let may_be = latitude != 0.0 && latitude.abs() <= std::f64::consts::FRAC_PI_2;
    may_be.then(|| {
        format!(
            "--latitude is {latitude}°, near the equator: is it in radians? That would be {}°, and gravity {} % more",
            six(latitude.to_degrees()),
            short(100.0 * (normal(latitude.to_degrees(), 0.0) / normal(latitude, 0.0) - 1.0))
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gravity_is_that_of_the_ellipsoid_and_falls_with_height() {
        // WGS 84: equator, pole.
        assert!((normal(0.0, 0.0) - 9.780_325_336).abs() < 1e-9);
        assert!((normal(90.0, 0.0) - 9.832_184_938).abs() < 1e-6);
        assert!((normal(45.0, 1000.0) - normal(45.0, 0.0) + 3.086e-3).abs() < 1e-9);
        assert_eq!(stated(Some(9.81), None, 0.0), (9.81, None));
        assert!(stated(Some(9.81), Some(0.97), 0.0).1.is_some());
        assert!(stated(None, None, 0.0).1.is_some());
        insta::assert_snapshot!(stated(None, Some(0.97), 0.0).1.unwrap());
        assert_eq!(stated(None, Some(55.75), 0.0).1, None);
    }
}
