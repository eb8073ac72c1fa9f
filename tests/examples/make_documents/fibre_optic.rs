//! FOG-0001: the fibre-optic unit, its thermal terms fitted to one chamber run and judged on another.

use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{
    Document, Filter, Gyro, GyroOutput, GyroSensor, Measure, Orientation, Origin, Residual, Sample,
};
use isotherm_simulator::Scenario;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::presets::{fibre_optic_chamber, judging_profile, training_profile};
use isotherm_tests::simulated::{Size, Windows, rate_errors};

use crate::instrument::{
    AXES, accelerometers, bare_gyro, orientation, scale_error, stated, temperature, tidy,
};
use crate::least_squares::solve;
use crate::regressors::{Term, columns, rates};
use crate::write::{Failure, document};

const FILTER: Filter = Filter {
    grid_step_s: 1.0,
    smoothing_s: 5.0,
    derivative_step_s: 1.0,
    stale_after_s: 10.0,
    branch_dead_band_deg_c2_per_s3: None,
};
/// Time constants of the lags (s): 8 mm of fibre and potting follow their outermost layer within seconds to minutes.
const LAGS_S: [f64; 6] = [3.0, 10.0, 30.0, 80.0, 160.0, 320.0];
/// Powers of temperature in the static bias.
const STATIC_POWERS: usize = 5;
/// Powers of temperature in each lag's gain.
const GAIN_POWERS: usize = 2;
/// Temperatures that the coils take in the training run (°C).
const RANGE_DEG_C: [f64; 2] = [-37.0, 65.0];
/// Tick of the simulated runs (ns): what matters here changes within seconds.
const TICK_NS: i64 = 100_000_000;
/// Averaging of the fit (s), short against the fastest lag that counts.
const FIT_WINDOW_S: f64 = 10.0;
/// Averaging of the residuals (s): white noise is then no longer what they show.
const JUDGE_WINDOW_S: f64 = 100.0;
/// Seeds of the noise in the training and the judging run.
const SEEDS: [u64; 2] = [101, 202];

fn training() -> Scenario {
    Scenario { tick_ns: TICK_NS, ..fibre_optic_chamber(SEEDS[0], training_profile()) }
}

fn judging() -> Scenario {
    Scenario { tick_ns: TICK_NS, ..fibre_optic_chamber(SEEDS[1], judging_profile()) }
}

/// The document of the fibre-optic unit, with what it comes to in and out of sample.
///
/// # Errors
/// Where the fit has no solution.
pub(crate) fn make() -> Result<Document, Failure> {
    let scenario = training();
    let mut made = with_scale(&scenario)?;
    let terms: Vec<Term> = (0..STATIC_POWERS)
        .map(Term::Static)
        .chain(LAGS_S.iter().flat_map(|&tau| (0..GAIN_POWERS).map(move |power| Term::Lag(tau, power))))
        .collect();
    let columns = columns(&made, &scenario, FIT_WINDOW_S, &terms, RANGE_DEG_C)?;
    let axes = &scenario.instrument.gyro_orientation;
    let target = rates(&made, &scenario, FIT_WINDOW_S, |step| {
        let along = axes.project(step.truth.delta_angle, step.truth.housing_deg_c);
        [0, 1, 2].map(|axis| along.get(axis).copied().unwrap_or_default())
    })?;
    for (axis, sensor) in made.gyro.sensor.iter_mut().enumerate() {
        let columns: Vec<Vec<f64>> = columns.iter().map(|column| column.axis(axis).collect()).collect();
        let target: Vec<f64> = target.axis(axis).collect();
        let failure = || Failure::NoSolution { of: format!("{} gyro {}", scenario.unit, sensor.name) };
        let solution = solve(&columns, &target).ok_or_else(failure)?;
        for (term, coefficient) in terms.iter().zip(solution) {
            term.add(sensor, tidy(coefficient), RANGE_DEG_C);
        }
    }
    made.gyro.orientation = orientation(axes);
    let residual = [(training(), Sample::In), (judging(), Sample::Out)];
    let residual = residual.iter().map(|(scenario, sample)| residuals(&made, scenario, *sample));
    let residual = residual.collect::<Result<Vec<_>, _>>()?.concat();
    if let Some(origin) = &mut made.origin {
        origin.residual = residual;
    }
    Ok(made)
}

/// The document with the instrument's own scale, along gyro axes, and no thermal term of the bias.
fn with_scale(scenario: &Scenario) -> Result<Document, Failure> {
    let instrument = &scenario.instrument;
    let (Gyros::FibreOptic(gyros), Some(block)) = (&instrument.gyros, &instrument.accelerometers) else {
        return Err(Failure::WrongUnit { unit: scenario.unit.clone() });
    };
    let sensors = gyros.iter().zip(AXES).enumerate().map(|(index, (gyro, name))| {
        GyroSensor { increment_weight_rad_per_rad: Some(tidy(gyro.scale)), ..bare_gyro(index, name) }
            .with(Feature::Reading, scale_error(gyro.reference_deg_c, gyro.scale_per_k))
    });
    Ok(Document {
        note: Some(format!(
            "Static bias and thermal lags fitted by least squares to a simulated chamber run (training profile); scale \
             factors, axes and accelerometers are the constants of the simulated instrument. Residuals: rate errors of \
             the corrected output against the truth, averaged over {JUDGE_WINDOW_S} s, white noise included; in sample \
             on the training profile, out of sample on the judging profile with other noise."
        )),
        origin: Some(Origin {
            method: Some("lag".into()),
            range_deg_c: Some(RANGE_DEG_C),
            details: Some(toml::Table::from_iter([
                ("preset".into(), "fibre_optic_chamber".into()),
                ("training_seed".into(), toml::Value::Integer(SEEDS[0].cast_signed())),
                ("judging_seed".into(), toml::Value::Integer(SEEDS[1].cast_signed())),
                ("tick_ns".into(), toml::Value::Integer(TICK_NS)),
                ("averaging_of_the_residuals_s".into(), JUDGE_WINDOW_S.into()),
            ])),
            ..Origin::default()
        }),
        temperature: temperature(instrument, FILTER, 25.0),
        gyro: Gyro {
            output: GyroOutput::Mean,
            sensor: sensors.collect(),
            orientation: Orientation {
                rows: vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                weights: None,
                thermal: None,
                parity: None,
            },
        },
        accel: Some(accelerometers(block)),
        ..document(&scenario.unit)
    })
}

/// Rate errors before and after, per axis.
fn residuals(document: &Document, scenario: &Scenario, sample: Sample) -> Result<Vec<Residual>, Failure> {
    let errors = |document: &Document| -> Result<Windows, Failure> {
        let calibration = Calibration::new(&document.to_parts())
            .map_err(|defects| Failure::Compile(format!("{defects:?}")))?;
        Ok(rate_errors(&Arc::new(calibration), scenario, JUDGE_WINDOW_S)?)
    };
    let (before, after) = (errors(&document.nominal())?, errors(document)?);
    let residual = |(axis, name): (usize, &str)| {
        let (before, after) = (Size::of(before.axis(axis)), Size::of(after.axis(axis)));
        println!(
            "{} gyro.{name} {sample:?}: rms {:.4} -> {:.4} °/h ({:.1} times), peak to peak {:.3} -> {:.3}",
            scenario.unit,
            before.rms,
            after.rms,
            before.rms / after.rms,
            before.peak_to_peak,
            after.peak_to_peak,
        );
        Residual {
            of: format!("gyro.{name}"),
            sample,
            measure: Measure::DegPerH,
            rms_before: stated(before.rms),
            rms_after: stated(after.rms),
            peak_to_peak_before: Some(stated(before.peak_to_peak)),
            peak_to_peak_after: Some(stated(after.peak_to_peak)),
        }
    };
    Ok(AXES.into_iter().enumerate().map(residual).collect())
}
