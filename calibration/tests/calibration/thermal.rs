//! Thermal fits on simulated coils: what the methods reach out of sample, on profiles that they were not fitted to.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::panic,
    reason = "a test stops where something is missing, and its numbers are small"
)]

mod accuracy;
mod bad_input;
mod chamber;
mod command;
mod scale;
mod service;
mod sparse;

use clap::Parser;
use isotherm_calibration::fits::thermal::bare::bare;
use isotherm_calibration::fits::thermal::{Fitted, Method, Settings, Site, Stand, fit};
use isotherm_calibration::report::Report;
use isotherm_calibration::runs::Run;
use isotherm_correction::earth::Place;
use isotherm_correction::thermal::Feature;
use isotherm_log::text::LogEvent;
use isotherm_protocol::document::{Argument, Document, GyroSensor, StatedTerm};
use isotherm_simulator::Scenario;
use isotherm_simulator::presets::{fibre_optic_chamber, judging_profile, paper_profile, training_profile};

use crate::simulated_logs::{self, events};

/// What the command asks for where nothing is said.
fn usual() -> Settings {
    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        settings: Settings,
    }
    Line::parse_from(["thermal"]).settings
}

/// Length of a simulated tick (ns).
const TICK_NS: i64 = 500_000_000;

/// A run of the simulator's gyros and thermometers in memory.
fn run(scenario: &Scenario) -> Run {
    let events = events(scenario).filter(|event| !matches!(event, LogEvent::Accel { .. }));
    simulated_logs::run("simulated", &scenario.unit, events)
}

/// The shipped document of the fibre-optic unit without accelerometers and without terms that a fit could be worse than: scale and axes are
/// those of the simulated instrument.
fn base() -> Document {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/FOG-0001.toml");
    let mut document = Document::parse(&std::fs::read_to_string(path).unwrap(), None).unwrap().document;
    document.accel = None;
    document.origin = None;
    document.note = None;
    bare(&document)
}

fn settings(method: Method) -> Settings {
    let place = Place::new(55.75, 30.0, Some([0.0, 0.0])).unwrap();
    Settings {
        method,
        stands: vec![Stand { site: Site::Known { place, force_m_per_s2: None }, turning: None }],
        window_s: Some(100.0),
        ..usual()
    }
}

fn fitted(method: Method, [train, judge]: &[Run; 2]) -> Fitted {
    let base = base();
    let runs = (std::slice::from_ref(train), std::slice::from_ref(judge));
    fit(Some(&base), runs, &settings(method)).unwrap()
}

/// Times by which rms and peak to peak fall out of sample, by gyro.
fn factors(report: &Report) -> Vec<[f64; 2]> {
    let gyros = report.verdicts.iter().filter(|verdict| verdict.of.starts_with("gyro"));
    gyros
        .map(|verdict| {
            let [before, after] = verdict.out_of_sample.unwrap();
            [before.rms / after.rms, before.peak_to_peak / after.peak_to_peak]
        })
        .collect()
}

fn preset() -> [Run; 2] {
    [(101, training_profile()), (202, judging_profile())]
        .map(|(seed, profile)| run(&Scenario { tick_ns: TICK_NS, ..fibre_optic_chamber(seed, profile) }))
}

/// Times by which rms and peak to peak fall out of sample, of all gyros together.
fn together(report: &Report) -> [f64; 2] {
    let gyros = || report.verdicts.iter().filter(|verdict| verdict.of.starts_with("gyro"));
    let size = |of: fn(&isotherm_calibration::numbers::Size) -> f64, which: usize| {
        gyros().map(|verdict| of(&verdict.out_of_sample.unwrap()[which]).powi(2)).sum::<f64>().sqrt()
    };
    [size(|s| s.rms, 0) / size(|s| s.rms, 1), size(|s| s.peak_to_peak, 0) / size(|s| s.peak_to_peak, 1)]
}

#[test]
fn methods_reach_what_they_must_on_a_simulated_coil() {
    let runs = preset();
    let wanted = [(Method::Rate, 2.0, 1.2), (Method::Sequential, 6.0, 2.4), (Method::Joint, 15.0, 6.0)];
    for (method, rms, peak_to_peak) in wanted {
        let Fitted { report, written, .. } = fitted(method, &runs);
        let gyros = &written.document.gyro.sensor;
        assert_eq!(gyros.iter().all(|gyro| gyro.terms.has(Feature::ThermalRate)), method != Method::Joint);
        assert!(
            method != Method::Rate || gyros.iter().all(|gyro| !gyro.terms.has(Feature::ThermalAcceleration))
        );
        println!("{method:?}: {:.1?} times smaller, together {:.1?}", factors(&report), together(&report));
        println!("{}", report.headline());
        let reached = together(&report);
        assert!(
            report.accepted() && reached[0] >= rms && reached[1] >= peak_to_peak,
            "{method:?} {reached:?}"
        );
    }
}

#[test]
fn the_sequential_fit_reaches_on_the_programme_of_000_what_the_paper_states() {
    // From 1.68 to 0.19 °/h peak to peak, of the log that was fitted: gyro y reaches that, and the others what stands here.
    let least = [3.8, 1.68 / 0.19, 3.2];
    let log = run(&Scenario { tick_ns: TICK_NS, ..fibre_optic_chamber(303, paper_profile()) });
    let Fitted { report, written, .. } =
        fit(Some(&base()), (&[log], &[]), &settings(Method::Sequential)).unwrap();
    println!("{}", report.headline());
    for ((verdict, gyro), least) in report.verdicts.iter().zip(&written.document.gyro.sensor).zip(least) {
        let [before, after] = verdict.in_sample.map(|size| size.peak_to_peak);
        println!("{}: {before:.3} to {after:.3} °/h, {:.1} times", verdict.of, before / after);
        assert!(before / after >= least && over_derivatives(gyro) > 0, "{}", verdict.of);
    }
}

/// Number of a gyro's curves over Ṫ or T̈.
fn over_derivatives(gyro: &GyroSensor) -> usize {
    let curves = |stated: &StatedTerm| {
        stated.braking.as_ref().map(|braking| [stated.coefficient.argument(), braking.argument()])
    };
    let arguments = gyro.terms.iter().filter_map(curves).flatten().flatten();
    arguments.filter(|argument| *argument != Argument::DegC).count()
}
