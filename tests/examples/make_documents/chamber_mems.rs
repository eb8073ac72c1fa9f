//! CHAMBER-MEMS: the MEMS unit of the real chamber log, with a cubic of temperature per sensor.

use std::path::Path;
use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{
    Accel, AccelOutput, AccelSensor, Channel, Curve, Document, Filter, Gyro, GyroOutput, GyroSensor, Measure,
    Orientation, Origin, Residual, Sample, Shape, Temperature,
};
use isotherm_tests::logs::{RealLog, correct};
use isotherm_tests::simulated::Size;

use crate::instrument::{AXES, bare_gyro, deg_per_h, stated, tidy};
use crate::least_squares::solve;
use crate::logs::{LogEvent, origin, read};
use crate::write::{Failure, document};

/// Highest power of temperature.
const DEGREE: usize = 3;
/// Temperature at which the cubics are zero (°C).
const REFERENCE_DEG_C: f64 = 25.0;
/// Temperatures of the log (°C).
const RANGE_DEG_C: [f64; 2] = [-18.0, 74.0];
/// Channel of the log's one thermometer, as its mapping calls it.
const CHANNEL: &str = "imu";

const NOTE: &str = "Cubic of temperature per sensor, fitted to the whole log but its first row. Each is zero at 25 \u{b0}C: one \
log at one attitude that nobody wrote down cannot tell a constant bias from the Earth's rate and gravity, so what is \
removed is the change of the output against 25 \u{b0}C, and its level stays. Residuals: deviation about the mean, in \
sample, of the whole log but its first row. The fit is the one to compare better ones with, not a recommendation: \
gyro x follows something else than temperature.";

/// Mean outputs of the six sensors over the log: gyros in °/h, accelerometers in m/s².
type Outputs = [Vec<f64>; 6];

/// The document of the real chamber log.
///
/// # Errors
/// Where the log cannot be read, or the fit has no solution.
pub(crate) fn make(data: &Path) -> Result<Document, Failure> {
    let events = read(data, RealLog::ChamberMems)?;
    let bare = bare();
    let before = outputs(&bare, &events)?;
    let column = |power: usize| {
        let mut coefficients = [[0.0; DEGREE + 1]; 6];
        for coefficients in &mut coefficients {
            coefficients[power] = 1.0;
        }
        let with = outputs(&with_cubics(&bare, &coefficients), &events)?;
        let pairs = before.iter().zip(with);
        Ok(pairs
            .map(|(before, with)| before.iter().zip(with).map(|(b, w)| b - w).collect::<Vec<_>>())
            .collect())
    };
    let columns: Vec<Vec<Vec<f64>>> = (0..=DEGREE).map(column).collect::<Result<_, Failure>>()?;
    let mut cubics = [[0.0; DEGREE + 1]; 6];
    for (sensor, (cubic, target)) in cubics.iter_mut().zip(&before).enumerate() {
        let columns: Vec<Vec<f64>> =
            columns.iter().filter_map(|column| column.get(sensor).cloned()).collect();
        let failure = || Failure::NoSolution { of: format!("sensor {sensor} of the chamber log") };
        let solution = solve(&columns, target).ok_or_else(failure)?;
        // The constant belongs to the fit, not to the document: see the note.
        for (place, coefficient) in cubic.iter_mut().zip(solution).skip(1) {
            *place = tidy(coefficient);
        }
    }
    let mut made = with_cubics(&bare, &cubics);
    let after = outputs(&made, &events)?;
    made.origin = Some(Origin {
        method: Some("cubic of temperature, least squares".into()),
        range_deg_c: Some(RANGE_DEG_C),
        log: vec![origin(data, RealLog::ChamberMems)?],
        residual: residuals(&before, &after),
        ..Origin::default()
    });
    Ok(made)
}

/// The unit without a bias: everything stands as it was logged.
fn bare() -> Document {
    let gyro = |name: &&str| GyroSensor {
        channel: Some(CHANNEL.into()),
        increment_weight_rad_per_rad: Some(1.0),
        ..bare_gyro(0, name)
    };
    let accel = |name: &&str| AccelSensor {
        channel: Some(CHANNEL.into()),
        ..AccelSensor::bare(
            name,
            Curve::new(Shape::Constant { value: 1.0 })
                .in_unit(AccelOutput::MetresPerSecondSquared.scale_unit()),
        )
    };
    Document {
        note: Some(NOTE.into()),
        temperature: Temperature {
            assumed_deg_c: REFERENCE_DEG_C,
            filter: Some(Filter {
                grid_step_s: 0.5,
                smoothing_s: 0.5,
                derivative_step_s: 10.0,
                stale_after_s: 5.0,
                branch_dead_band_deg_c2_per_s3: None,
            }),
            channel: vec![Channel {
                name: CHANNEL.into(),
                conversion_deg_c: vec![0.0, 1.0],
                range_deg_c: [-40.0, 105.0],
                spike_limit_deg_c: 2.0,
            }],
        },
        gyro: Gyro {
            output: GyroOutput::Mean,
            sensor: AXES.iter().map(gyro).collect(),
            orientation: Orientation::along_case_axes(),
        },
        accel: Some(Accel {
            output: AccelOutput::MetresPerSecondSquared,
            sensor: AXES.iter().map(accel).collect(),
            orientation: Orientation::along_case_axes(),
        }),
        ..document("CHAMBER-MEMS")
    }
}

/// The document with one cubic per sensor, gyros first (°/h, m/s²).
fn with_cubics(bare: &Document, cubics: &[[f64; DEGREE + 1]; 6]) -> Document {
    let curve = |cubic: &[f64]| {
        let (reference, coefficients, range) = (REFERENCE_DEG_C, cubic.to_vec(), RANGE_DEG_C);
        Curve::new(Shape::Polynomial { reference, coefficients, range })
    };
    let mut document = bare.clone();
    let (gyros, accels) = cubics.split_at(AXES.len());
    for (sensor, cubic) in document.gyro.sensor.iter_mut().zip(gyros) {
        sensor.set(Feature::One, curve(cubic));
    }
    for (sensor, cubic) in document.accel.iter_mut().flat_map(|accel| &mut accel.sensor).zip(accels) {
        sensor.set(Feature::One, curve(cubic));
    }
    document
}

/// The log through the state machine, without its first row.
fn outputs(document: &Document, events: &[LogEvent]) -> Result<Outputs, Failure> {
    let calibration =
        Calibration::new(&document.to_parts()).map_err(|defects| Failure::Compile(format!("{defects:?}")))?;
    let mut outputs = Outputs::default();
    for tick in correct(&Arc::new(calibration), events).iter().skip(1) {
        let duration_s = tick.duration.as_s();
        let rates = tick.delta_angle.map(|angle| deg_per_h(angle / duration_s));
        let forces = tick.delta_velocity.map(|velocity| velocity / duration_s);
        for (output, value) in outputs.iter_mut().zip(rates.into_iter().chain(forces)) {
            output.push(value);
        }
    }
    Ok(outputs)
}

/// Deviations before and after.
fn residuals(before: &Outputs, after: &Outputs) -> Vec<Residual> {
    let kinds = [("gyro", Measure::DegPerH), ("accel", Measure::MetresPerSecondSquared)];
    let sensors =
        kinds.into_iter().flat_map(|(kind, measure)| AXES.map(|axis| (format!("{kind}.{axis}"), measure)));
    let mut residuals = Vec::new();
    for ((of, measure), (before, after)) in sensors.zip(before.iter().zip(after)) {
        let (before, after) = (Size::of(before.iter().copied()), Size::of(after.iter().copied()));
        let unit = if measure == Measure::DegPerH { "°/h" } else { "m/s²" };
        println!(
            "CHAMBER-MEMS {of} in sample: deviation {:.4} -> {:.4} {unit}",
            before.deviation, after.deviation
        );
        residuals.push(Residual {
            of,
            sample: Sample::In,
            measure,
            rms_before: stated(before.deviation),
            rms_after: stated(after.deviation),
            peak_to_peak_before: Some(stated(before.peak_to_peak)),
            peak_to_peak_after: Some(stated(after.peak_to_peak)),
        });
    }
    residuals
}
