//! Gravity at the place of a calibration: every scale factor of an accelerometer is relative to it.

use crate::error::Error;
use crate::report::{short, six};

/// Standard gravity (m/s²).
pub const STANDARD_M_PER_S2: f64 = 9.806_65;
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
///
/// # Errors
/// [`Error::Usage`] for numbers that are none of a place on Earth.
pub fn stated(
    gravity: Option<f64>,
    latitude_deg: Option<f64>,
    height_m: f64,
) -> Result<(f64, Option<String>), Error> {
    let usage =
        |name: &str, got: f64, range: &str| Err(Error::Usage(format!("{name} is {got}, must be {range}")));
    if let Some(got) = latitude_deg.filter(|latitude| !(-90.0..=90.0).contains(latitude)) {
        return usage("--latitude", got, "from -90 to 90 degrees");
    }
    if !(-1000.0..=20_000.0).contains(&height_m) {
        return usage("--height", height_m, "from -1000 to 20000 m");
    }
    match (gravity, latitude_deg) {
        (Some(gravity), _) if !(9.7..=9.9).contains(&gravity) => {
            usage("--gravity", gravity, "from 9.7 to 9.9 m/s², as on Earth")
        }
        (Some(gravity), _) => Ok((gravity, None)),
        (None, Some(latitude)) => Ok((normal(latitude, height_m), radians(latitude))),
        (None, None) => Ok((
            STANDARD_M_PER_S2,
            Some(format!(
                "gravity is assumed as {STANDARD_M_PER_S2} m/s²; at your place it, and all scale factors, may differ \
                 by up to 0.3 %: state --gravity, or --latitude and --height"
            )),
        )),
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
        assert_eq!(stated(Some(9.81), None, 0.0).unwrap(), (9.81, None));
        assert!(stated(None, None, 0.0).unwrap().1.is_some());
        assert!(
            stated(None, Some(0.97), 0.0)
                .unwrap()
                .1
                .unwrap()
                .contains("That would be 55.5769°, and gravity 0.360 % more")
        );
        assert_eq!(stated(None, Some(55.75), 0.0).unwrap().1, None);
        assert!(stated(Some(981.0), None, 0.0).is_err() && stated(None, Some(91.0), 0.0).is_err());
    }
}
