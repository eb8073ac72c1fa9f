//! ZLG-0001: the Zeeman laser unit, by the constants of the simulated instrument.

use isotherm_correction::thermal::Feature;
use isotherm_correction::units::Angle;
use isotherm_protocol::document::{
    Document, Drift, Filter, Gyro, GyroOutput, GyroSensor, ModeReversal, Origin, SelfTest, SelfTestCounter,
    SelfTestVoltage, Servo, ServoKind, Unit,
};
use isotherm_simulator::Scenario;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::zeeman::{MEANDER_REFERENCE_DEG_C, Zeeman, ZeemanGyro};

use crate::instrument::{
    AXES, accelerometers, bare_gyro, deg_per_h, orientation, polynomial, scale_error, stated, temperature,
    tidy,
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

/// Half-wave voltage of the mode control (V): that of a piezo drive, with room for temperature and age.
const HALF_WAVE_V: [f64; 2] = [41.0, 55.0];
/// Errors of the producer's own transfers that a self-test may see.
const FRAME_ERRORS: u32 = 3;
/// Drift of the middle of the six gyros in table 1 of 002 (σ 0.0026…0.0046 °/h over 6…13 h), and of its trends
/// (0.00008…0.00016 °/h per hour, stable over some days).
const SIGMA_DEG_PER_H: f64 = 0.0034;
const CORRELATION_TIME_H: f64 = 9.0;
const TREND_SIGMA_DEG_PER_H2: f64 = 0.000_12;
const TREND_CORRELATION_TIME_H: f64 = 48.0;
/// From one turn-on to the next.
const INITIAL_SIGMA_DEG_PER_H: f64 = 0.05;

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
             so its term has the sign + throughout. The instrument has no drift and no mode control to report on: what the \
             estimator is to expect is the size of the gyros in table 1 of 002, and the limits of the self-test are plausible \
             ones."
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
        self_test: Some(SelfTest {
            voltage: AXES
                .iter()
                .map(|name| SelfTestVoltage { name: format!("half-wave {name}"), range_v: HALF_WAVE_V })
                .collect(),
            counter: vec![SelfTestCounter { name: "frame errors".into(), max_increase: FRAME_ERRORS }],
        }),
        ..document(&scenario.unit)
    })
}

fn sensor(unit: &Zeeman, gyro: &ZeemanGyro, index: usize, name: &str) -> GyroSensor {
    let reference = gyro.reference_deg_c;
    let rates = |coefficients: &[f64]| coefficients.iter().copied().map(deg_per_h).collect::<Vec<_>>();
    GyroSensor {
        increment_weight_arcsec_per_count: Some(tidy(Angle::from_rad(gyro.scale_rad_per_count).as_arcsec())),
        servo: Some(Servo {
            // Whole half-period counts are a poor measure of a frequency: one of them is 200 Hz in a tick of 5 ms. The
            // exponential needs only the first, and its error decays with the transient.
            form: ServoKind::Modelled,
            time_constant_s: unit.reversal.servo_time_constant_s,
            rest_frequency: polynomial(reference, &gyro.dither_hz).in_unit(Unit::HZ),
            settle_time_constants: SETTLED,
        }),
        drift: Some(Drift {
            sigma_deg_per_h: SIGMA_DEG_PER_H,
            correlation_time_h: CORRELATION_TIME_H,
            trend_sigma_deg_per_h2: TREND_SIGMA_DEG_PER_H2,
            trend_correlation_time_h: TREND_CORRELATION_TIME_H,
            initial_sigma_deg_per_h: INITIAL_SIGMA_DEG_PER_H,
            angle_random_walk_deg_per_sqrt_h: stated(walk_deg_per_sqrt_h(gyro)),
        }),
        ..bare_gyro(index, name)
    }
    .with(Feature::Reading, scale_error(reference, gyro.scale_per_k))
    .with(Feature::One, polynomial(reference, &rates(&gyro.bias_nonmagnetic_rad_per_s)))
    .with(Feature::LasingMode, polynomial(reference, &rates(&gyro.bias_magnetic_rad_per_s)))
    .with(Feature::Meander, polynomial(MEANDER_REFERENCE_DEG_C, &rates(&gyro.meander_rad_per_s)))
}

/// White noise of the measured rate as the estimator meets it: that of the gyro, and that of counting (°/√h).
///
/// A reference at rest spans a minute. At either end a count is rounded, which leaves w/√6 in the angle between them; over the
/// span τ that is as much as an angle random walk of w/√(6·τ).
fn walk_deg_per_sqrt_h(gyro: &ZeemanGyro) -> f64 {
    const SPAN_S: f64 = 60.0;
    let (white, count) = (gyro.noise.angle_random_walk_rad_per_sqrt_s, gyro.scale_rad_per_count);
    let walk = (white * white + count * count / (6.0 * SPAN_S)).sqrt();
    Angle::from_rad(walk).as_deg() * 60.0
}
