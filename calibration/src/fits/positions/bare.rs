//! A document of a unit that has none yet: everything as the log has it, for a fit to complete.

use isotherm_protocol::document::{AccelOutput, Document, Filter, GyroOutput, Temperature};

use isotherm_correction::sample::OutputKind;

use crate::document::{ASSUMED_DEG_C, channels, faults, plain};
use crate::error::Error;
use crate::runs::Run;
use crate::runs::series::Series;

/// Physical range of a channel whose readings are °C already.
const RANGE_DEG_C: [f64; 2] = [-70.0, 130.0];

/// A document that passes on what a log has: gyros in rad/s with weight one, accelerometers with scale factor one, both along
/// the case axes; temperature channels that read °C.
///
/// # Errors
/// [`Error::Refused`] where the log needs a document: counts of gyros, skewed sensors, channels that do not read °C.
pub fn bare(series: &Series, accel_output: AccelOutput) -> Result<Document, Error> {
    let reasons = faults(series, true, RANGE_DEG_C);
    if !reasons.is_empty() {
        return Err(Error::Refused(reasons));
    }
    let channels = channels(series, RANGE_DEG_C, |_| 5.0);
    let filter = Filter {
        grid_step_s: 1.0,
        smoothing_s: 5.0,
        derivative_step_s: 1.0,
        stale_after_s: 60.0,
        branch_dead_band_deg_c2_per_s3: None,
    };
    let filter = (!channels.is_empty()).then_some(filter);
    let temperature = Temperature { assumed_deg_c: ASSUMED_DEG_C, filter, channel: channels };
    Ok(plain(series.unit.as_str(), GyroOutput::Mean, temperature, Some(accel_output)))
}

/// The same from a run whose readings that are no counts are in "V" or "m/s2"; where nobody says, in what its mapping states, or else V.
///
/// # Errors
/// As [`Run::series`] and [`bare`]; [`Error::Usage`] where the mapping states another unit.
pub fn of_run(run: &Run, accelerometer_unit: Option<&str>) -> Result<Document, Error> {
    let of_log = run.accelerometer_unit().filter(|unit| ["V", "m/s²"].contains(unit));
    if let (Some(given), Some(of_log)) = (accelerometer_unit, of_log)
        && given != of_log.replace('²', "2")
    {
        return Err(Error::Usage(format!(
            "--accelerometer-unit is {given}, the mapping of {} states {of_log}: leave the option out, or correct the mapping",
            run.name
        )));
    }
    let series = run.series()?;
    let output = match (series.accels.output, accelerometer_unit.or(of_log).unwrap_or("V")) {
        (Some(OutputKind::Counts), _) => AccelOutput::Counts,
        (_, "V") => AccelOutput::Volts,
        _ => AccelOutput::MetresPerSecondSquared,
    };
    bare(&series, output)
}
