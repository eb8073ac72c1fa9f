//! Runs at several temperatures.

use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{Document, Terms};
use isotherm_simulator::Scenario;
use isotherm_simulator::instrument::Gyros;

use super::super::steps::listed;
use super::{AXES, RATES, made_from, place, quiet, run_of};
use crate::finding::Kind;
use crate::runs::Run;

/// A run of steps at a temperature of the chamber, of gyros whose axes turn and whose scale changes with it.
fn run_at(seed: u64, axis: [f64; 3], deg_c: f64) -> Run {
    run_of(&format!("at {deg_c}"), (seed, axis), |seed| at(seed, deg_c), |reading| reading)
}

/// The unit in a chamber of this temperature, with its thermometers.
fn at(seed: u64, deg_c: f64) -> Scenario {
    let mut scenario = quiet(seed, deg_c);
    for (sensor, row) in scenario.instrument.gyro_orientation.rows_per_k.iter_mut().enumerate() {
        // Some ″/°C, another one for every gyro.
        *row = [0.0; 3];
        row[(sensor + 1) % 3] = [2e-5, -1.5e-5, 1e-5][sensor];
        row[(sensor + 2) % 3] = [-1e-5, 0.5e-5, 2.5e-5][sensor];
    }
    scenario
}

/// The shipped document without what its axes and weights do over temperature.
fn warm_base() -> Document {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
    let mut document = Document::parse(&std::fs::read_to_string(path).unwrap(), None).unwrap().document;
    document.accel = None;
    document.gyro.orientation.thermal = None;
    // Nor of its bias: each temperature has its own.
    document.gyro.sensor.iter_mut().for_each(|gyro| gyro.terms = Terms::default());
    document
}

#[test]
fn several_temperatures_give_the_slopes_of_axes_and_weights() {
    let temperatures = [-20.0, 20.0, 60.0];
    let runs: Vec<Run> = temperatures
        .iter()
        .enumerate()
        .flat_map(|(level, deg_c)| {
            let seed = 2000 + 3 * u64::try_from(level).unwrap();
            (0..3_usize).map(move |axis| run_at(seed + u64::try_from(axis).unwrap(), AXES[axis], *deg_c))
        })
        .collect();
    let axes = ["x", "y", "z"].map(str::to_owned);
    let axes: Vec<String> = axes.iter().cycle().take(9).cloned().collect();
    let steps = listed(&axes, [&RATES, &[]], [9, 0]).unwrap();
    let made = made_from(&warm_base(), &runs, &steps, &place()).unwrap();
    let over = made.over_temperature.as_ref().unwrap();
    assert_eq!(over.levels.len(), 3);
    assert!(made.gyros.iter().flatten().all(|found| !found.widened), "{:?}", made.report().warnings);
    let scenario = at(0, 20.0);
    let Gyros::Mems(gyros) = &scenario.instrument.gyros else { panic!() };
    let truth = &scenario.instrument.gyro_orientation;
    let mut errors = Vec::new();
    for (sensor, (line, gyro)) in over.lines.iter().zip(gyros).enumerate() {
        for along in (0..3).filter(|along| *along != sensor) {
            // The axes follow the housing in truth and the gyros' channels here, which are as much warmer at every temperature.
            errors.push((line.slope[along] - truth.rows_per_k[sensor][along]) / line.slope_sigma[along]);
            assert!(line.slope_sigma[along] < 2e-6, "{line:?}");
        }
        let own: Vec<f64> = over.levels.iter().map(|level| level.own_deg_c[sensor]).collect();
        let scale = |t: f64| {
            let away = t - gyro.reference_deg_c;
            1.0 + gyro.scale_per_k[0] * away + gyro.scale_per_k[1] * away * away
        };
        let curve = made.written.document.gyro.sensor[sensor].terms.curve(Feature::Reading).unwrap();
        let at = |t: f64| 1.0 + 1e-6 * curve.shape().at(t).unwrap();
        let (found, wanted) = (at(own[2]) / at(own[0]), scale(own[2]) / scale(own[0]));
        assert!((found / wanted - 1.0).abs() < 2e-5, "gyro {sensor}: {found} {wanted}");
    }
    assert!(errors.iter().all(|error| error.abs() < 4.0), "{errors:?}");
    let thermal = made.written.document.gyro.orientation.thermal.as_ref().unwrap();
    assert_eq!(thermal.slopes_arcsec_per_deg_c.len(), 3);
    assert!(made.verdicts.iter().all(|verdict| verdict.accepted), "{:?}", made.verdicts);
    let report = made.report();
    assert!(
        report
            .charts
            .iter()
            .any(|(heading, chart)| heading == "Axes over temperature" && chart.panels.len() == 6)
    );
    let (_, axes) = report.tables.iter().find(|(heading, _)| heading == "Axes by temperature, ″").unwrap();
    assert_eq!(axes.rows.len(), 3);
}

#[test]
fn a_temperature_that_does_not_tell_all_axes_is_told_and_counts_with_the_others() {
    let runs: Vec<Run> = [(0, 20.0), (1, 20.0), (2, 20.0), (0, 60.0)]
        .into_iter()
        .map(|(axis, deg_c): (usize, f64)| run_at(3000 + u64::try_from(axis).unwrap(), AXES[axis], deg_c))
        .collect();
    let axes = ["x", "y", "z", "x"].map(str::to_owned);
    let steps = listed(&axes, [&RATES, &[]], [4, 0]).unwrap();
    let made = made_from(&warm_base(), &runs, &steps, &place()).unwrap();
    assert!(made.over_temperature.is_none());
    let told = made.warnings.iter().any(|found| matches!(found.kind, Kind::NotEachTemperature { .. }));
    assert!(told, "{:?}", made.warnings);
    assert!(made.gyros.iter().flatten().all(|found| found.bias_of.len() == 2), "each its own bias");
}
