//! MEMS-0001: the micromechanical unit, by the constants of the simulated instrument.

use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{Document, Filter, Gyro, GyroOutput, GyroSensor, Origin};
use isotherm_simulator::Scenario;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::mems::MemsGyro;

use crate::instrument::{
    AXES, accelerometers, bare_gyro, deg_per_h, orientation, polynomial, scale_error, temperature, tidy,
};
use crate::write::{Failure, document};

/// Temperatures change by some hundredths of a degree a second: a late filter costs more than the sensors' noise.
const FILTER: Filter = Filter {
    grid_step_s: 1.0,
    smoothing_s: 3.0,
    derivative_step_s: 1.0,
    stale_after_s: 10.0,
    branch_dead_band_deg_c2_per_s3: None,
};

/// The document of a micromechanical unit.
///
/// # Errors
/// Where the scenario holds another kind of unit.
pub(crate) fn make(scenario: &Scenario) -> Result<Document, Failure> {
    let instrument = &scenario.instrument;
    let (Gyros::Mems(gyros), Some(block)) = (&instrument.gyros, &instrument.accelerometers) else {
        return Err(Failure::WrongUnit { unit: scenario.unit.clone() });
    };
    Ok(Document {
        note: Some("Constants of the simulated instrument, as if its makers had told them.".into()),
        origin: Some(Origin {
            method: Some("constants of the simulated instrument (preset mems_chamber)".into()),
            ..Origin::default()
        }),
        temperature: temperature(instrument, FILTER, 25.0),
        gyro: Gyro {
            output: GyroOutput::Mean,
            sensor: gyros
                .iter()
                .zip(AXES)
                .enumerate()
                .map(|(index, (gyro, name))| sensor(gyro, index, name))
                .collect(),
            orientation: orientation(&instrument.gyro_orientation),
        },
        accel: Some(accelerometers(block)),
        ..document(&scenario.unit)
    })
}

fn sensor(gyro: &MemsGyro, index: usize, name: &str) -> GyroSensor {
    let reference = gyro.reference_deg_c;
    GyroSensor { increment_weight_rad_per_rad: Some(tidy(gyro.scale)), ..bare_gyro(index, name) }
        .with(Feature::Reading, scale_error(reference, gyro.scale_per_k))
        .with(Feature::One, polynomial(reference, &gyro.bias_rad_per_s.map(deg_per_h)))
}
