//! ZLG-0001: the Zeeman laser unit, by the constants of the simulated instrument.

use isotherm_correction::units::Angle;
use isotherm_protocol::document::{
    Document, Filter, Gyro, GyroOutput, GyroSensor, ModeReversal, Origin, Servo, ServoKind,
};
use isotherm_simulator::Scenario;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::zeeman::{MEANDER_REFERENCE_DEG_C, Zeeman, ZeemanGyro};

use crate::instrument::{
    AXES, accelerometers, bare_gyro, deg_per_h, orientation, polynomial, scale_error, temperature, tidy,
};
use crate::write::{Failure, document};

/// The temperatures move slowly, but the dither frequency loses 28 Hz/K, so the filter must not be late.
const FILTER: Filter = Filter {
    grid_step_s: 1.0,
    smoothing_s: 3.0,
    derivative_step_s: 1.0,
    stale_after_s: 10.0,
    branch_dead_band_deg_c2_per_s3: None,
};
/// Times τ after which e⁻¹⁶ of the servo's transient is left.
const SETTLED: f64 = 8.0;

/// The document of a Zeeman unit.
///
/// # Errors
/// Where the scenario holds another kind of unit.
pub(crate) fn make(scenario: &Scenario) -> Result<Document, Failure> {
    let instrument = &scenario.instrument;
    let (Gyros::Zeeman(unit), Some(block)) = (&instrument.gyros, &instrument.accelerometers) else {
        return Err(Failure::WrongUnit { unit: scenario.unit.clone() });
    };
    let sensors = unit.gyros.iter().zip(AXES).enumerate();
    Ok(Document {
        note: Some(
            "Constants of the simulated instrument, as if its makers had told them. The slow meander is not reported, \
             so its term has the sign + throughout."
                .into(),
        ),
        origin: Some(Origin {
            method: Some("constants of the simulated instrument (presets zeeman_rest, zeeman_sine)".into()),
            ..Origin::default()
        }),
        temperature: temperature(instrument, FILTER, 25.0),
        gyro: Gyro {
            output: GyroOutput::Counts,
            sensor: sensors.map(|(index, (gyro, name))| sensor(unit, gyro, index, name)).collect(),
            orientation: orientation(&instrument.gyro_orientation),
        },
        accel: Some(accelerometers(block)),
        mode_reversal: Some(ModeReversal::default()),
        ..document(&scenario.unit)
    })
}

fn sensor(unit: &Zeeman, gyro: &ZeemanGyro, index: usize, name: &str) -> GyroSensor {
    let reference = gyro.reference_deg_c;
    let rates = |coefficients: &[f64]| coefficients.iter().copied().map(deg_per_h).collect::<Vec<_>>();
    GyroSensor {
        increment_weight_arcsec_per_count: Some(tidy(Angle::from_rad(gyro.scale_rad_per_count).as_arcsec())),
        increment_weight_error: Some(scale_error(reference, gyro.scale_per_k)),
        static_bias: Some(polynomial(reference, &rates(&gyro.bias_nonmagnetic_rad_per_s))),
        magnetic_bias: Some(polynomial(reference, &rates(&gyro.bias_magnetic_rad_per_s))),
        slow_meander: Some(polynomial(MEANDER_REFERENCE_DEG_C, &rates(&gyro.meander_rad_per_s))),
        servo: Some(Servo {
            // Whole half-period counts are a poor measure of a frequency: one of them is 200 Hz in a tick of 5 ms. The
            // exponential needs only the first, and its error decays with the transient.
            form: ServoKind::Modelled,
            time_constant_s: unit.reversal.servo_time_constant_s,
            rest_frequency: polynomial(reference, &gyro.dither_hz),
            settle_time_constants: SETTLED,
        }),
        ..bare_gyro(index, name)
    }
}
