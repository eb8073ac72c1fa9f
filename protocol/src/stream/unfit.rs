//! Readings that a calibration cannot take, in words.

use isotherm_correction::calibration::Calibration;
use isotherm_correction::sample::OutputKind;

/// Names of the counters of ticks that were refused for their number of readings, and for their kind.
pub const COUNTERS: [&str; 2] = ["wrong_sensor_count", "wrong_output_kind"];

/// What a calibration takes against what comes; `None` where the counter is not of [`COUNTERS`].
#[must_use]
pub fn words(counter: &str, calibration: &Calibration) -> Option<String> {
    let word = |output| if output == OutputKind::Counts { "counts" } else { "means" };
    let (gyros, accels) = (word(calibration.gyro_output()), word(calibration.accel_output()));
    let takes = match counter {
        "wrong_sensor_count" => format!(
            "{} gyros and {} accelerometers, but other numbers come",
            calibration.gyro_count(),
            calibration.accel_count()
        ),
        "wrong_output_kind" if gyros != accels => {
            format!("{gyros} of gyros and {accels} of accelerometers, but others come")
        }
        "wrong_output_kind" => {
            format!("{gyros}, but {} come", if gyros == "counts" { "means" } else { "counts" })
        }
        _ => return None,
    };
    Some(format!("the calibration takes {takes}: use the document of this unit, or correct what is sent"))
}
