//! Scale factors over temperature: from gravity in two attitudes, and from a rate table.

use std::collections::BTreeSet;

use isotherm_calibration::fits::thermal::{Fitted, Method, Settings, Site, Stand, Turning, fit};
use isotherm_calibration::report::{Report, residuals};
use isotherm_calibration::runs::Run;
use isotherm_correction::thermal::Feature;
use isotherm_correction::unit::UnitSettings;
use isotherm_log::offline::load_calibration;
use isotherm_log::text::LogEvent;
use isotherm_protocol::document::{AccelOutput, Curve, Document, Sample, Shape};
use isotherm_simulator::Scenario;
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::motion::Path;
use isotherm_simulator::presets::mems_chamber;

use crate::simulated_logs::{self, events};

const LATITUDE_DEG: f64 = 55.75;
const HEADING_DEG: f64 = 30.0;
/// Pitch and roll with gravity alike on all three axes, and those of the opposite attitude (°).
const DIAGONAL: [[f64; 2]; 2] = [[35.264_389_682_754_654, -135.0], [-35.264_389_682_754_654, 45.0]];
/// The diagonal of the case, as an axis.
const ALIKE: f64 = 0.577_350_269_189_625_8;

/// The micromechanical unit through a short chamber cycle, one tick a second.
fn scenario(seed: u64, [pitch_deg, roll_deg]: [f64; 2], rate_deg_per_s: f64) -> Scenario {
    let chamber = Profile::constant(25.0).hold(8.0).ramp(-30.0, 4.0).hold(10.0).ramp(70.0, 4.0).hold(10.0);
    let chamber = chamber.ramp(25.0, 4.0);
    let mut scenario =
        Scenario { duration_s: chamber.duration_s(), chamber, tick_ns: 1_000_000_000, ..mems_chamber(seed) };
    scenario.motion.heading_deg = HEADING_DEG;
    scenario.motion.pitch_deg = pitch_deg;
    scenario.motion.roll_deg = roll_deg;
    if rate_deg_per_s != 0.0 {
        scenario.motion.path = Path::ConstantRate { axis: [ALIKE; 3], rate_deg_per_s };
    }
    scenario
}

fn run(name: &str, scenario: &Scenario) -> Run {
    simulated_logs::run(name, &scenario.unit, events(scenario))
}

/// What a log's operator states of it.
fn stand([pitch, roll]: [f64; 2], rate_deg_per_s: f64) -> Stand {
    let site = Site::at(LATITUDE_DEG, HEADING_DEG, Some([pitch, roll]), None).unwrap();
    let turning = (rate_deg_per_s != 0.0).then_some(Turning { axis: [ALIKE; 3], rate_deg_per_s });
    Stand { site, turning }
}

/// The shipped document without what its scale factors do over temperature.
fn base() -> Document {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
    let mut document = Document::parse(&std::fs::read_to_string(path).unwrap(), None).unwrap().document;
    document.gyro.sensor.iter_mut().for_each(|gyro| gyro.set(Feature::Reading, None));
    for accel in document.accel.iter_mut().flat_map(|accel| &mut accel.sensor) {
        let Shape::Polynomial { coefficients, .. } = accel.scale_factor.shape().clone() else { panic!() };
        let constant = Shape::Constant { value: coefficients[0] };
        accel.scale_factor = Curve::new(constant).in_unit(AccelOutput::MetresPerSecondSquared.scale_unit());
    }
    document.origin = None;
    document
}

fn fitted(runs: &[Run], stands: Vec<Stand>, method: Method) -> Fitted {
    let settings = Settings { method, stands, window_s: Some(10.0), ..super::usual() };
    fit(Some(&base()), (runs, &[]), &settings).unwrap()
}

/// The true scale factor error of a sensor (ppm) as a polynomial about another point.
fn truth(scenario: &Scenario, gyro: bool, index: usize, about_deg_c: f64) -> [f64; 3] {
    let (reference, relative) = if gyro {
        let Gyros::Mems(gyros) = &scenario.instrument.gyros else { panic!() };
        let [first, second] = gyros[index].scale_per_k;
        (gyros[index].reference_deg_c, [0.0, first, second])
    } else {
        let accel = &scenario.instrument.accelerometers.as_ref().unwrap().sensors[index];
        let [whole, first, second] = accel.scale_v_per_m_per_s2;
        (accel.reference_deg_c, [0.0, first / whole, second / whole])
    };
    let by = about_deg_c - reference;
    let [zeroth, first, second] = relative.map(|part| 1e6 * part);
    [zeroth + first * by + second * by * by, first + 2.0 * second * by, second]
}

/// Point about which the powers of a fitted sensor are taken (°C).
fn reference(document: &Document, gyro: bool, index: usize) -> f64 {
    let shape = if gyro {
        document.gyro.sensor[index].terms.curve(Feature::Reading).unwrap().shape().clone()
    } else {
        document.accel.as_ref().unwrap().sensor[index].scale_factor.shape().clone()
    };
    let Shape::Polynomial { reference, .. } = shape else { panic!("{shape:?}") };
    reference
}

/// Found scale factor coefficients of a sensor less the true ones, in their standard errors.
fn distances(made: &Fitted, scenario: &Scenario, gyro: bool, index: usize) -> Vec<f64> {
    let name = format!("{} {}", if gyro { "gyro" } else { "accelerometer" }, ["x", "y", "z"][index]);
    let truth = truth(scenario, gyro, index, reference(&made.written.document, gyro, index));
    let found = |power: usize| {
        let wanted = format!("{name} scale factor error, power {power}");
        made.report.coefficients.iter().find(|coefficient| coefficient.name == wanted)
    };
    (0..3)
        .map(|power| match found(power) {
            Some(found) => {
                println!("{name} {power}: {} ± {:?}, true {}", found.value, found.sigma, truth[power]);
                (found.value - truth[power]) / found.sigma.unwrap()
            }
            None => panic!("{name} has no scale factor of power {power}: {}", made.report.to_text()),
        })
        .collect()
}

/// All distances together: none beyond three.
#[track_caller]
fn within_three(distances: &[f64]) {
    println!("{distances:.1?}: rms {:.2}", rms(distances));
    assert!(distances.iter().all(|distance| distance.abs() < 3.0), "{distances:.1?}");
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn accelerometer_scale_comes_from_gravity_in_two_attitudes() {
    let (mut all, mut told) = (Vec::new(), BTreeSet::new());
    for seed in 1..=4 {
        let scenarios = [(10 * seed, DIAGONAL[0]), (10 * seed + 1, DIAGONAL[1])]
            .map(|(seed, attitude)| scenario(seed, attitude, 0.0));
        let runs = scenarios.each_ref().map(|scenario| run("one attitude", scenario));
        let made = fitted(&runs, DIAGONAL.map(|attitude| stand(attitude, 0.0)).to_vec(), Method::Joint);
        assert!(made.report.accepted(), "{}", made.report.to_text());
        for index in 0..3 {
            all.extend(distances(&made, &scenarios[0], false, index));
            // The Earth's rate tells nothing of a gyro's scale factor, and nobody meant it to.
            assert!(!made.written.document.gyro.sensor[index].terms.has(Feature::Reading));
        }
        // The gyros keep their scale factors, and nothing is wrong with the others: all four say the same.
        told.insert(format!("{}\n{}\n", made.report.warnings.join("\n"), made.report.notes[0]));
    }
    insta::assert_snapshot!(told.into_iter().collect::<String>());
    within_three(&all);
    assert!((0.5..1.5).contains(&rms(&all)), "the standard errors are no guess: {}", rms(&all));
}

#[test]
fn gyro_scale_comes_from_a_rate_table() {
    let rates: [f64; 3] = [0.0, 20.0, -20.0];
    let mut all = Vec::new();
    for seed in 1..=3 {
        let scenarios = rates.map(|rate| scenario(100 * seed + rate.abs() as u64, [0.0, 0.0], rate));
        let runs = scenarios.each_ref().map(|scenario| run("on the table", scenario));
        let stands = rates.map(|rate| stand([0.0, 0.0], rate)).to_vec();
        let made = fitted(&runs, stands, Method::Joint);
        assert!(made.report.accepted(), "{}", made.report.to_text());
        for index in 0..3 {
            all.extend(distances(&made, &scenarios[0], true, index));
        }
        // The accelerometers were at rest in one attitude, and feel nothing of the other runs.
        let curves = made.report.residuals.iter().filter(|curve| curve.of.starts_with("accelerometer"));
        assert_eq!(curves.count(), 3);
    }
    // What is left is the temperature's delay in the filter, alike in all windows of a ramp: the standard errors know of it.
    within_three(&all);
}

#[test]
fn sequential_and_lag_find_scale_factors_too_and_an_unknown_place_leaves_the_constant() {
    let scenarios = DIAGONAL.map(|attitude| scenario(7, attitude, 0.0));
    let runs = scenarios.each_ref().map(|scenario| run("one attitude", scenario));
    for method in [Method::Sequential, Method::Joint] {
        let made = fitted(&runs, DIAGONAL.map(|attitude| stand(attitude, 0.0)).to_vec(), method);
        for index in 0..3 {
            let about = reference(&made.written.document, false, index);
            let wanted = truth(&scenarios[0], false, index, about)[1];
            let name = format!("accelerometer {} scale factor error, power 1", ["x", "y", "z"][index]);
            let found = made.report.coefficients.iter().find(|c| c.name == name).unwrap().value;
            println!("{method:?} {index}: {found} {wanted}");
            assert!(
                (found - wanted).abs() < 0.1 * wanted.abs().max(20.0),
                "{method:?} {index}: {found} {wanted}"
            );
        }
    }
    let scenarios = [20.0, -20.0].map(|rate| scenario(8, [0.0, 0.0], rate));
    let runs = scenarios.each_ref().map(|scenario| run("on the table", scenario));
    let stands = [20.0, -20.0].map(|rate| Stand { site: Site::Unknown, ..stand([0.0, 0.0], rate) });
    let made = fitted(&runs, stands.to_vec(), Method::Joint);
    let named = |power: usize| format!("gyro x scale factor error, power {power}");
    let has = |power: usize| made.report.coefficients.iter().any(|c| c.name == named(power));
    assert!(!has(0) && has(1), "{}", made.report.to_text());
}

#[test]
fn runs_that_do_not_spread_an_input_leave_the_scale_factor_and_say_so() {
    let attitudes = [[0.0, 0.0], [0.0, 20.0]];
    let runs = attitudes.map(|attitude| run("tilted", &scenario(3, attitude, 0.0)));
    let made = fitted(&runs, attitudes.map(|attitude| stand(attitude, 0.0)).to_vec(), Method::Joint);
    // y feels a third of gravity's change, z a sixteenth.
    insta::assert_snapshot!(made.report.warnings.join("\n"));
    assert!(made.report.coefficients.iter().all(|coefficient| !coefficient.name.contains("scale")));
    let kept = &made.written.document.accel.as_ref().unwrap().sensor;
    assert_eq!(kept[1].scale_factor, base().accel.unwrap().sensor[1].scale_factor);
}

#[test]
fn a_table_that_turns_otherwise_is_refused() {
    let turned = run("on the table", &scenario(5, [0.0, 0.0], 20.0));
    let refused = |rate: f64, runs: &[Run]| {
        let stands = vec![stand([0.0, 0.0], rate)];
        let settings = Settings { stands, ..super::usual() };
        fit(Some(&base()), (runs, &[]), &settings).unwrap_err().to_string()
    };
    let otherwise = refused(-20.0, std::slice::from_ref(&turned));
    let mut started: Vec<LogEvent> = events(&scenario(5, [0.0, 0.0], 0.0)).collect();
    let still =
        started.iter().position(|event| matches!(event, LogEvent::Gyro { tick, .. } if tick.sequence == 60));
    started.truncate(still.unwrap());
    let behind = events(&scenario(5, [0.0, 0.0], 20.0));
    started.extend(behind.filter(|event| match event {
        LogEvent::Gyro { tick, .. } => tick.sequence >= 60,
        LogEvent::Accel { tick, .. } => tick.sequence >= 60,
        LogEvent::Temperature(reading) => reading.time.as_ns() > 60_000_000_000,
    }));
    let started = simulated_logs::run("started late", "MEMS-0001", started);
    insta::assert_snapshot!(otherwise + "\n" + &refused(20.0, &[started]));
}

#[test]
fn the_residual_of_runs_in_two_attitudes_is_that_of_the_service() {
    let scenarios = DIAGONAL.map(|attitude| scenario(9, attitude, 0.0));
    let stands = DIAGONAL.map(|attitude| stand(attitude, 0.0));
    let runs = scenarios.each_ref().map(|scenario| run("one attitude", scenario));
    let folder = tempfile::tempdir().unwrap();
    for method in [Method::Sequential, Method::Joint] {
        let made = fitted(&runs, stands.to_vec(), method);
        let out = folder.path().join(format!("{}.toml", method.name()));
        made.written.save(&out, false).unwrap();
        let loaded = load_calibration(&out).unwrap();
        let mut left: [Vec<f64>; 3] = Default::default();
        for (scenario, stand) in scenarios.iter().zip(&stands) {
            let Site::Known { force_m_per_s2: Some(force), .. } = stand.site else { panic!() };
            let mut unit = loaded.stream(UnitSettings::default());
            for event in events(scenario) {
                unit.handle((&event).into());
            }
            unit.flush();
            for window in unit.take_ready().chunks(10).filter(|window| window.len() == 10) {
                for axis in 0..3 {
                    let mean = window.iter().map(|tick| tick.delta_velocity[axis]).sum::<f64>()
                        / window.iter().map(|tick| tick.duration.as_s()).sum::<f64>();
                    left[axis].push(mean - force[axis]);
                }
            }
        }
        for (axis, left) in left.iter().enumerate() {
            let rms = rms(left);
            let stated = stated(&made.report, axis);
            assert!((stated / rms - 1.0).abs() < 1e-9, "{method:?} {axis}: {stated} {rms}");
        }
    }
}

#[test]
fn a_known_scale_factor_does_not_get_into_the_bias_where_the_attitude_is_not_known() {
    // z feels one g, through a scale factor that the document knows.
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
    let known = Document::parse(&std::fs::read_to_string(path).unwrap(), None).unwrap().document;
    let runs = [run("level", &scenario(4, [0.0, 0.0], 0.0))];
    let made = fit(Some(&known), (&runs, &[]), &super::usual()).unwrap();
    assert!(made.report.accepted(), "{}", made.report.to_text());
    let slope = |document: &Document| {
        let bias = document.accel.as_ref().unwrap().sensor[2].terms.curve(Feature::One).cloned().unwrap();
        let Shape::Polynomial { coefficients, .. } = bias.shape().clone() else { panic!() };
        coefficients[1]
    };
    let (found, wanted) = (slope(&made.written.document), slope(&known));
    assert!((found / wanted - 1.0).abs() < 0.15, "{found} {wanted}");
}

/// What report and document both state of an accelerometer axis in sample (m/s²).
fn stated(report: &Report, axis: usize) -> f64 {
    let name = ["x", "y", "z"][axis];
    let of = format!("accelerometer.{name}");
    let residuals = residuals(&report.verdicts);
    let own = residuals.iter().find(|r| r.of == of && r.sample == Sample::In).unwrap();
    let verdict = report.verdicts.iter().find(|v| v.of == format!("accelerometer {name}")).unwrap();
    assert!((own.rms_after - verdict.in_sample[1].rms).abs() < 1e-12);
    own.rms_after
}
