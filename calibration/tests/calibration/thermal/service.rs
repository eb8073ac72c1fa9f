//! The fit and the service agree: the residual in the report is what the corrector makes of the log with the document.

use std::fmt::Write as _;
use std::path::Path;

use isotherm_calibration::fits::thermal::{Method, Settings, fit};
use isotherm_calibration::report::residuals;
use isotherm_calibration::runs::Run;
use isotherm_correction::thermal::Feature;
use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::Span;
use isotherm_log::mapping::Mapping;
use isotherm_log::offline::{load_calibration, unit_id};
use isotherm_log::part::{LogFiles, Part};
use isotherm_log::text::LogReader;
use isotherm_protocol::document::{Curve, Document, Sample, Shape};
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::presets::fibre_optic_chamber;
use isotherm_simulator::{Scenario, Simulation};

const MAPPING: &str = "version = 1\n[[file]]\nname = \"log.csv\"\ndelimiter = \"comma\"\nheader = true\n\
    [file.time]\ncolumn = \"t\"\nunit = \"us\"\nmarks = \"end\"\nduration = \"measured\"\ntick_ms = 1000.0\n\
    [file.gyro]\noutput = \"mean\"\nsensors = [{ column = \"x\", unit = \"rad_per_s\" }, { column = \"y\", unit = \"rad_per_s\" }, \
    { column = \"z\", unit = \"rad_per_s\" }]\n\
    [[file.temperature]]\nchannel = \"coil\"\ncolumn = \"deg_c\"\nunit = \"deg_c\"\n";

/// A short chamber run of the simulated coil as a text log.
pub(crate) fn text_log(folder: &Path) -> (std::path::PathBuf, Mapping) {
    let chamber = Profile::constant(20.0)
        .hold(20.0)
        .ramp(-10.0, 2.0)
        .hold(40.0)
        .ramp(40.0, 2.0)
        .hold(40.0)
        .ramp(20.0, 2.0);
    let scenario = Scenario { tick_ns: 1_000_000_000, ..fibre_optic_chamber(5, chamber) };
    let mut text = "t,x,y,z,deg_c\n".to_owned();
    let mut deg_c = f64::NAN;
    for step in Simulation::new(&scenario).unwrap() {
        if let Some(reading) = step.temperatures.iter().find(|reading| &reading.channel[..] == "gyro0") {
            deg_c = (reading.raw - 1.5) * 100.0;
        }
        let [x, y, z] = [0, 1, 2].map(|i| step.gyro.readings[i]);
        let _ = writeln!(text, "{},{x:e},{y:e},{z:e},{deg_c}", step.gyro.end_time.as_ns() / 1000);
    }
    let (log, mapping) = (folder.join("log.csv"), folder.join("mapping.toml"));
    std::fs::write(&log, text).unwrap();
    std::fs::write(&mapping, MAPPING).unwrap();
    (log, Mapping::load(&mapping).unwrap())
}

pub(crate) fn run_of(log: &Path, mapping: &Mapping) -> Run {
    part_of(log, mapping, &Part::default())
}

fn part_of(log: &Path, mapping: &Mapping, part: &Part) -> Run {
    let unit = unit_id("UNIT").unwrap();
    let files = LogFiles::Text {
        paths: vec![log.to_path_buf()],
        mapping: Box::new(mapping.clone()),
        unit: unit.clone(),
        batch_ticks: 512,
    };
    Run::new("log".to_owned(), unit, files, part)
}

#[test]
fn the_residual_of_the_report_is_that_of_the_service() {
    let folder = tempfile::tempdir().unwrap();
    let (log, mapping) = text_log(folder.path());
    for method in [Method::Sequential, Method::Joint] {
        let run = run_of(&log, &mapping);
        let settings = Settings { method, window_s: Some(10.0), ..super::usual() };
        let made = fit(None, (&[run], &[]), &settings).unwrap();
        let out = folder.path().join(format!("{}.toml", method.name()));
        made.written.save(&out, false).unwrap();
        assert!(made.report.verdicts.iter().any(|verdict| verdict.accepted), "{}", made.report.to_text());
        let curves: usize = made.written.document.gyro.sensor.iter().map(super::over_derivatives).sum();
        assert_eq!(curves > 0, method == Method::Sequential, "{}", made.report.headline());

        // As isotherm-replay correct does it: the document from its file, the log event by event.
        let mut unit = load_calibration(&out).unwrap().stream(UnitSettings::default());
        for event in LogReader::open(&mapping, std::slice::from_ref(&log)).unwrap() {
            unit.handle((&event.unwrap()).into());
        }
        unit.flush();
        let ticks = unit.take_ready();
        let residuals = residuals(&made.report.verdicts);
        for (axis, name) in ["gyro.x", "gyro.y", "gyro.z"].into_iter().enumerate() {
            let mut means = Vec::new();
            for window in ticks.chunks(10).filter(|window| window.len() == 10) {
                let (angle, time) = window
                    .iter()
                    .fold((0.0, 0.0), |(a, t), tick| (a + tick.delta_angle[axis], t + tick.duration.as_s()));
                means.push((angle / time).to_degrees() * 3600.0);
            }
            let mean = means.iter().sum::<f64>() / means.len() as f64;
            let rms =
                (means.iter().map(|m| (m - mean) * (m - mean)).sum::<f64>() / means.len() as f64).sqrt();
            let stated = residuals.iter().find(|r| r.of == name && r.sample == Sample::In).unwrap().rms_after;
            assert!((stated / rms - 1.0).abs() < 1e-9, "{method:?} {name}: {stated} {rms}");
        }
    }
}

/// A document may have its constants from elsewhere: from positions, or from turns about the north.
#[test]
fn a_level_that_the_run_cannot_tell_stays_what_it_was() {
    const LEVELS_DEG_PER_H: [f64; 3] = [3.0, -2.0, 0.5];
    let folder = tempfile::tempdir().unwrap();
    let (log, mapping) = text_log(folder.path());
    let settings = Settings { window_s: Some(10.0), ..super::usual() };
    let fitted = |base: Option<&Document>| {
        fit(base, (&[run_of(&log, &mapping)], &[]), &settings).unwrap().written.document
    };
    let mut base = fitted(None);
    for (sensor, value) in base.gyro.sensor.iter_mut().zip(LEVELS_DEG_PER_H) {
        sensor.set(Feature::One, Curve::new(Shape::Constant { value }));
    }
    let again = fitted(Some(&base));
    for (sensor, level) in again.gyro.sensor.iter().zip(LEVELS_DEG_PER_H) {
        let bias = sensor.terms.curve(Feature::One).unwrap();
        let Shape::Polynomial { reference, coefficients, .. } = bias.shape() else { panic!("{bias:?}") };
        assert!(coefficients.len() > 1, "{bias:?}");
        let kept = bias.shape().at(*reference).unwrap();
        assert!((kept - level).abs() < 1e-9, "{}: {kept}, {level} before", sensor.name);
    }
}

/// Half of the chamber's programme says less than the whole of it, from which the document before was made.
#[test]
fn a_document_that_is_worse_than_the_one_before_it_is_refused() {
    const HALF: Span = Span::from_ns(4_500_000_000_000);
    let folder = tempfile::tempdir().unwrap();
    let (log, mapping) = text_log(folder.path());
    let settings = Settings { window_s: Some(10.0), ..super::usual() };
    let whole = fit(None, (&[run_of(&log, &mapping)], &[]), &settings).unwrap().written.document;
    let [fitted, judging] = [(Span::ZERO, Some(HALF)), (HALF, None)]
        .map(|(start, end)| part_of(&log, &mapping, &Part { start, end, ..Part::default() }));
    let again = |base: &Document| {
        fit(Some(base), (std::slice::from_ref(&fitted), std::slice::from_ref(&judging)), &settings).unwrap()
    };
    let made = again(&whole);
    let terms =
        |document: &Document| document.gyro.sensor.iter().map(|gyro| gyro.terms.clone()).collect::<Vec<_>>();
    let kept = terms(&made.written.document).into_iter().zip(terms(&whole)).map(|(new, old)| new == old);
    let refused: Vec<bool> = made.report.verdicts.iter().map(|verdict| !verdict.accepted).collect();
    assert_eq!(kept.collect::<Vec<_>>(), refused, "{}", made.report.to_text());
    assert!(refused.contains(&true), "{}", made.report.to_text());
    // A base without terms has nothing that could be kept.
    let mut bare = whole.clone();
    bare.gyro.sensor.iter_mut().for_each(|gyro| gyro.terms.retain(|_| false));
    let verdicts = again(&bare).report.verdicts;
    insta::assert_snapshot!(verdicts.iter().map(|one| one.words() + "\n").collect::<String>());
}
