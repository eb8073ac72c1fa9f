//! What a simulated instrument states of itself, turned into the document's directions and units.
//!
//! Directions: the simulator's gyro scale leads from counts to angle and its bias adds to the input, as the document
//! has both. Its accelerometer scale leads from specific force to output, as the document's scale factor does. Its
//! thermometers lead from °C to the reading; the document goes back.

use isotherm_correction::thermal::Feature;
use isotherm_correction::units::{Angle, AngularRate};
use isotherm_protocol::document::{
    Accel, AccelOutput, AccelSensor, Channel, Curve, Filter, GyroSensor, Orientation, OrientationThermal,
    Shape, Temperature,
};
use isotherm_simulator::accelerometer::{AccelerometerOutput, Accelerometers};
use isotherm_simulator::instrument::Instrument;
use isotherm_simulator::orientation::Orientation as Axes;

/// Temperatures over which the constants of a simulated instrument hold (°C).
pub(crate) const RANGE_DEG_C: [f64; 2] = [-55.0, 100.0];
/// Physical range of the thermometers (°C).
const SENSOR_RANGE_DEG_C: [f64; 2] = [-70.0, 130.0];
/// The channels are read once a second and the units change by some hundredths of a degree in it.
const SPIKE_LIMIT_DEG_C: f64 = 1.0;
/// Names of gyros and accelerometers.
pub(crate) const AXES: [&str; 3] = ["x", "y", "z"];
/// Channel of the housing, which the orientations follow.
const HOUSING: &str = "housing";
/// Channel of the electronics board.
const BOARD: &str = "board";

/// A number without the dust of unit conversions: twelve digits.
pub(crate) fn tidy(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// A figure as it is stated: four digits.
pub(crate) fn stated(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// °/h from rad/s.
pub(crate) fn deg_per_h(rad_per_s: f64) -> f64 {
    AngularRate::from_rad_per_s(rad_per_s).as_deg_per_h()
}

/// A polynomial, lowest power first.
pub(crate) fn polynomial(reference: f64, coefficients: &[f64]) -> Curve {
    let coefficients = coefficients.iter().copied().map(tidy).collect();
    Curve::new(Shape::Polynomial { reference, coefficients, range: RANGE_DEG_C })
}

/// The scale's thermal coefficients κ1 (1/K) and κ2 (1/K²).
pub(crate) fn scale_error(reference: f64, [first, second]: [f64; 2]) -> Curve {
    polynomial(reference, &[0.0, first * 1e6, second * 1e6])
}

/// A gyro without any term.
pub(crate) fn bare_gyro(index: usize, name: &str) -> GyroSensor {
    GyroSensor { channel: Some(format!("gyro{index}")), ..GyroSensor::bare(name) }
}

/// All temperature channels of an instrument.
pub(crate) fn temperature(instrument: &Instrument, filter: Filter, assumed_deg_c: f64) -> Temperature {
    let channels = instrument.thermometers.channels.iter().map(|channel| {
        let per_raw = 1.0 / channel.raw_per_deg_c;
        Channel {
            name: channel.name.clone(),
            conversion_deg_c: [-channel.raw_at_0_deg_c * per_raw, per_raw].map(tidy).to_vec(),
            range_deg_c: SENSOR_RANGE_DEG_C,
            spike_limit_deg_c: SPIKE_LIMIT_DEG_C,
        }
    });
    Temperature { assumed_deg_c, filter: Some(filter), channel: channels.collect() }
}

/// Input axes that follow the housing.
pub(crate) fn orientation<P>(axes: &Axes) -> Orientation<P> {
    let slopes = axes.rows_per_k.iter().map(|row| row.map(|slope| tidy(Angle::from_rad(slope).as_arcsec())));
    Orientation {
        rows: axes.rows.iter().map(|row| row.map(tidy)).collect(),
        weights: None,
        thermal: Some(OrientationThermal {
            channels: vec![HOUSING.into()],
            reference_deg_c: axes.reference_deg_c,
            range_deg_c: RANGE_DEG_C,
            slopes_arcsec_per_deg_c: slopes.collect(),
            hysteresis: Vec::new(),
        }),
        parity: None,
    }
}

/// The accelerometers by their own constants.
pub(crate) fn accelerometers(block: &Accelerometers) -> Accel {
    let (output, per_output) = match block.output {
        AccelerometerOutput::Counts { hz_per_v, .. } => (AccelOutput::Counts, hz_per_v),
        AccelerometerOutput::Mean => (AccelOutput::MetresPerSecondSquared, 1.0),
    };
    let sensors = block.sensors.iter().zip(AXES).enumerate().map(|(index, (sensor, name))| {
        let reference = sensor.reference_deg_c;
        let [_, first, second] = sensor.board_ratio;
        AccelSensor {
            channel: Some(format!("accel{index}")),
            board_channel: Some(BOARD.into()),
            board_ratio_error: Some(scale_error(reference, [first, second])),
            ..AccelSensor::bare(
                name,
                polynomial(reference, &sensor.scale_v_per_m_per_s2.map(|k| k * per_output))
                    .in_unit(output.scale_unit()),
            )
        }
        .with(Feature::One, polynomial(reference, &sensor.bias_v.map(|s| s * per_output)))
    });
    Accel { output, sensor: sensors.collect(), orientation: orientation(&block.orientation) }
}
