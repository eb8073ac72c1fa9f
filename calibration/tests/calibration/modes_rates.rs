//! `modes` and `rates` as their users run them: recordings in, documents and reports out, exit codes.

use std::path::{Path, PathBuf};

use isotherm_correction::thermal::Feature;
use isotherm_log::text::LogEvent;
use isotherm_protocol::document::{Document, Sample};
use isotherm_simulator::Scenario;
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::motion::Path as Movement;
use isotherm_simulator::presets::{mems_chamber, zeeman_rest};
use serde_json::Value;

use crate::command::{calibrate, fails, headings, json, shipped, succeeds, told, words};
use crate::simulated_logs::{events_after, record_events};

/// Scenarios one after the other, as one recording; each starts where the last one ended.
pub(crate) fn record(path: &Path, scenarios: &[Scenario]) {
    record_events(path, &scenarios[0].unit, events(scenarios));
}

/// What the unit reads through scenarios one after the other.
pub(crate) fn events(scenarios: &[Scenario]) -> Vec<LogEvent> {
    let (mut all, mut ticks) = (Vec::new(), 0);
    for scenario in scenarios {
        all.extend(events_after(scenario, ticks));
        ticks = all.iter().filter(|event| matches!(event, LogEvent::Gyro { .. })).count() as u64;
    }
    all
}

/// The Zeeman unit through a chamber programme at ten ticks a second, with its accelerometers.
pub(crate) fn zeeman(seed: u64, chamber: Profile) -> Scenario {
    let mut scenario = zeeman_rest(seed);
    scenario.duration_s = chamber.duration_s();
    scenario.chamber = chamber;
    scenario.tick_ns = 100_000_000;
    if let Gyros::Zeeman(unit) = &mut scenario.instrument.gyros {
        unit.reversal.period_s = 60.0;
        // A transient of 40 ms would be lost in a tick of 100 ms, and not be told from drift.
        unit.reversal.miss_rms_wavelengths = 0.0;
    }
    scenario
}

/// The unit's document without what `modes` is to find.
pub(crate) fn base(folder: &Path) -> PathBuf {
    let path = shipped("ZLG-0001.toml");
    let mut document = Document::parse(&std::fs::read_to_string(path).unwrap(), None).unwrap().document;
    for sensor in &mut document.gyro.sensor {
        sensor
            .terms
            .retain(|feature| !matches!(feature, Feature::One | Feature::LasingMode | Feature::Meander));
        sensor.servo = None;
    }
    document.mode_reversal = None;
    let path = folder.join("base.toml");
    std::fs::write(&path, document.to_toml().unwrap()).unwrap();
    path
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn modes_are_fitted_judged_written_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let base = base(folder.path());
    let (run, judge) = (place("run.mcap"), place("judge.mcap"));
    record(&run, &[zeeman(1, Profile::constant(50.0).ramp(-30.0, 4.0).ramp(50.0, 4.0))]);
    record(&judge, &[zeeman(2, Profile::constant(20.0).hold(4.0).ramp(45.0, 3.0).ramp(0.0, 5.0).hold(4.0))]);
    let (out, html) = (place("modes.toml"), place("modes.html"));
    let fit = ["modes", text(&run), "--calibration", text(&base), "--latitude", "55.75", "--heading", "30"];
    let rest =
        ["--judge", text(&judge), "--out", text(&out), "--html", text(&html), "--created", "2026-11-22"];
    let said = succeeds(&[&fit[..], &rest[..]].concat());
    let written = std::fs::read_to_string(&out).unwrap();
    let document = Document::parse(&written, None).unwrap().document;
    let origin = document.origin.as_ref().unwrap();
    assert_eq!(origin.log.len(), 1);
    assert_eq!(origin.residual.iter().filter(|residual| residual.sample == Sample::Out).count(), 3);
    for residual in origin.residual.iter().filter(|residual| residual.sample == Sample::Out) {
        assert!(residual.rms_after < 0.2 * residual.rms_before, "{residual:?}");
    }
    let details = &origin.details.as_ref().unwrap()["modes"];
    assert_eq!(details["covariance"].as_table().unwrap().len(), 3);
    assert!(details["coefficients"].as_table().unwrap().len() > 9);
    let page = std::fs::read_to_string(&html).unwrap();

    // The same again, to the byte; and JSON says what the text says.
    let again = place("again.toml");
    let json: Value = serde_json::from_str(&succeeds(
        &[&fit[..], &["--judge", text(&judge), "--out", text(&again), "--created", "2026-11-22", "--json"]]
            .concat(),
    ))
    .unwrap();
    let without_command =
        |text: &str| text.lines().filter(|line| !line.starts_with("command")).collect::<Vec<_>>().join("\n");
    assert_eq!(without_command(&written), without_command(&std::fs::read_to_string(&again).unwrap()));
    assert_eq!(json["accepted"], true);
    // One sentence to a line in the text, all of them in JSON; powers and names as in all reports.
    assert!(json["verdict"].as_str().unwrap().starts_with(said.lines().next().unwrap()), "{json}");
    let named = |of: &Value| of["name"] == "gyro x static bias, power 2" && of["unit"] == "°/h/°C²";
    assert!(json["coefficients"].as_array().unwrap().iter().any(named), "{json}");
    for text in [&json.to_string(), &page] {
        assert!(!text.contains("°C^") && !text.contains("static_bias,"), "{text}");
    }

    several_modes(folder.path(), &run, &again);

    // What is missing is asked for; what is there already is kept.
    let refused = [
        &["modes", text(&run), "--calibration", text(&base)][..],
        &["modes", text(&run), "--remove-mean"],
        &[&fit[..], &["--out", text(&out)]].concat(),
        &["modes", text(&run), "--calibration", text(&base), "--remove-mean", "--unit", "NOBODY"],
    ];
    let refused = refused.map(|arguments| told(folder.path(), arguments)).concat();
    insta::assert_snapshot!([said, headings(&html), refused].join("\n"));
}

/// Two units and a third without a document: each has what it would have by itself, and one table closes them.
fn several_modes(folder: &Path, run: &Path, alone: &Path) {
    let place = |name: &str| folder.join(name);
    let documents = place("documents");
    std::fs::create_dir(&documents).unwrap();
    let base = std::fs::read_to_string(place("base.toml")).unwrap();
    std::fs::write(documents.join("ZLG-0001.toml"), &base).unwrap();
    std::fs::write(documents.join("ZLG-0002.toml"), base.replace("ZLG-0001", "ZLG-0002")).unwrap();
    let (second, third) = (place("second.mcap"), place("third.mcap"));
    let of = |unit: &str, chamber| Scenario { unit: unit.into(), ..zeeman(3, chamber) };
    record(&second, &[of("ZLG-0002", Profile::constant(50.0).ramp(-30.0, 4.0).ramp(50.0, 4.0))]);
    record(&third, &[of("ZLG-0003", Profile::constant(20.0).hold(0.5))]);
    let (out, html) = (place("batch.toml"), place("batch.html"));
    let logs = ["modes", text(run), text(&second), text(&third)];
    let rest = [
        "--calibration",
        text(&documents),
        "--latitude",
        "55.75",
        "--heading",
        "30",
        "--created",
        "2026-11-22",
    ];
    let outputs = ["--out", text(&out), "--html", text(&html)];
    let arguments = [&logs[..], &rest, &outputs].concat();
    let said = told(folder, &arguments);
    // What a unit has does not depend on the company it is in.
    let of = |path: &Path| Document::parse(&std::fs::read_to_string(path).unwrap(), None).unwrap().document;
    let (alone, among) = (of(alone), of(&place("batch-ZLG-0001.toml")));
    assert_eq!(alone.gyro, among.gyro);
    assert_eq!(among.origin.unwrap().log, alone.origin.unwrap().log, "its own log only");
    assert_eq!(of(&place("batch-ZLG-0002.toml")).unit, "ZLG-0002");
    let page = std::fs::read_to_string(&html).unwrap();
    let verdict = page.lines().find(|line| line.contains("class=\"headline\"")).unwrap();
    insta::assert_snapshot!(said + verdict);
    assert!(place("batch-ZLG-0002.html").exists());
    // Nothing that is there is written over, and nothing is fitted before that is said.
    let first = fails(&arguments, 2);
    std::fs::remove_file(&html).unwrap();
    assert!(first.contains("batch.html") && fails(&arguments, 2).contains("batch-ZLG-0001.toml"), "{first}");
}

/// A run on the table: a rest before every step of whole turns.
pub(crate) fn table(seed: u64, axis: [f64; 3], rates: &[f64]) -> Vec<Scenario> {
    let rests = rates.iter().flat_map(|rate| [0.0, *rate]);
    let step = |(number, rate): (u64, f64)| {
        let mut scenario = mems_chamber(seed * 100 + number);
        scenario.chamber = Profile::constant(25.0);
        scenario.start_ns = i64::try_from(number).unwrap() * 10_000_000_000;
        scenario.duration_s = 10.0;
        if rate != 0.0 {
            scenario.motion.path = Movement::ConstantRate { axis, rate_deg_per_s: rate };
        }
        scenario
    };
    (0..).zip(rests).map(step).collect()
}

#[test]
fn rates_are_fitted_written_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let rates = [36.0, -36.0, 108.0, -108.0];
    let logs: Vec<PathBuf> = ["x", "y", "z"].iter().map(|name| place(&format!("{name}.mcap"))).collect();
    for (index, log) in logs.iter().enumerate() {
        let mut axis = [0.0; 3];
        axis[index] = 1.0;
        record(log, &table(u64::try_from(index).unwrap(), axis, &rates));
    }
    let out = place("rates.toml");
    let attitude = ["--latitude", "55.75", "--heading", "30", "--pitch", "0", "--roll", "0"];
    let table = ["--axis", "x", "--axis", "y", "--axis", "z", "--rates", "36,-36,108,-108"];
    let logs: Vec<&str> = logs.iter().map(|path| text(path)).collect();
    let fit = [&["rates"][..], &logs, &table, &attitude].concat();
    succeeds(&[&fit[..], &["--out", text(&out)]].concat());
    let document = Document::parse(&std::fs::read_to_string(&out).unwrap(), None).unwrap().document;
    let weight = document.gyro.sensor[0].increment_weight_rad_per_rad.unwrap();
    assert!((weight - 1.0015).abs() < 4e-4, "{weight}");
    assert!(
        (document.gyro.orientation.rows[0][2] - 2.1e-4).abs() < 3e-5,
        "{:?}",
        document.gyro.orientation.rows
    );
    let coefficients = &document.origin.as_ref().unwrap().details.as_ref().unwrap()["rates"]["coefficients"];
    assert!(coefficients["gyro z scale factor asymmetry"]["value"].is_float());
    let report = json(&[&fit[..], &["--json"]].concat());
    assert_eq!(report["accepted"], true);
    insta::assert_snapshot!(
        format!("{:#}", report["notes"]).replace(folder.path().to_str().unwrap(), "FOLDER")
    );
    assert!(report["tables"]["Linearity of gyro y"].is_object(), "{report}");

    let steps = place("steps.csv");
    std::fs::write(
        &steps,
        "axis,rate_deg_per_s,begin_s,end_s\nz,36,11,19\nz,-36,31,39\nz,0,1,9\nz,108,51,59\n",
    )
    .unwrap();
    let by_file = json(&["rates", logs[2], "--steps", text(&steps), "--remove-mean", "--json"]);
    let is_weight = |of: &Value| of["name"] == "gyro z increment weight";
    assert!(by_file["coefficients"].as_array().unwrap().iter().any(is_weight), "{by_file}");
    // A first document has the log's accelerometers; what was not turned about is no verdict.
    let first = by_file["verdicts"][0]["words"].as_str().unwrap();
    assert!(document.accel.is_some() && document.temperature.channel.is_empty());
    let wrong = [&["rates", logs[0], "--axis", "x", "--rates", "36,-36,108"][..], &attitude].concat();
    let without = [&["rates", logs[0]][..], &attitude].concat();
    let refused = [wrong, without].map(|arguments| told(folder.path(), &arguments)).concat();
    insta::assert_snapshot!(format!("{first}\n{refused}"));
}

fn refs(arguments: &[String]) -> Vec<&str> {
    arguments.iter().map(String::as_str).collect()
}

#[test]
fn rates_are_judged_on_steps_that_the_fit_has_not_seen() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    let (seen, judged, other) = (place("seen.mcap"), place("judged.mcap"), place("other.mcap"));
    let axis = [0.0, 0.0, 1.0];
    record(Path::new(&seen), &table(1, axis, &[36.0, -36.0, 108.0, -108.0]));
    record(Path::new(&judged), &table(2, axis, &[72.0, -72.0]));
    // A unit whose scale factor has changed by more than the fit mends.
    let mut changed = table(3, axis, &[72.0, -72.0]);
    for scenario in &mut changed {
        if let Gyros::Mems(gyros) = &mut scenario.instrument.gyros {
            gyros[2].scale = 2.0 - gyros[2].scale;
        }
    }
    record(Path::new(&other), &changed);
    let (out, bad) = (place("rates.toml"), place("bad.toml"));
    let fit = |judge: &str, out: &str| -> Vec<String> {
        let rest = "--axis z --axis z --rates 36,-36,108,-108 --judge-rates 72,-72 --latitude 55.75 --heading 30 --pitch 0 --roll 0";
        let start = ["rates", &seen, "--judge", judge, "--out", out, "--json"];
        start.into_iter().chain(rest.split(' ')).map(str::to_owned).collect()
    };
    let report: Value = serde_json::from_str(&succeeds(&refs(&fit(&judged, &out)))).unwrap();
    let z = &report["verdicts"][2];
    let size = |sample: &str, when: &str| z[sample][when]["rms"].as_f64().unwrap();
    assert!(size("out_of_sample", "after") < 0.1 * size("out_of_sample", "before"), "{z}");
    assert!(size("in_sample", "after") < 0.1 * size("in_sample", "before"), "{z}");
    assert_eq!(
        report["tables"]["Errors of the judging steps"]["rows"].as_array().unwrap().len(),
        4,
        "two steps, two rests"
    );
    let document =
        |path: &str| Document::parse(&std::fs::read_to_string(path).unwrap(), None).unwrap().document;
    let made = document(&out);
    let origin = made.origin.as_ref().unwrap();
    assert_eq!(origin.log.len(), 1, "what it was judged on is not what it was made from");
    assert_eq!(origin.residual.iter().filter(|residual| residual.sample == Sample::Out).count(), 1);

    // What makes the judging steps worse is refused, and the gyro keeps what it had.
    let (code, report, errors) = words(&calibrate(&refs(&fit(&other, &bad))));
    let report: Value = serde_json::from_str(&report).unwrap();
    let refused = &report["verdicts"][2];
    assert_eq!((code, &refused["accepted"]), (Some(1), &false.into()));
    let worse = format!("{errors}{}\n", refused["reason"].as_str().unwrap());
    let worse = worse.replace(folder.path().to_str().unwrap(), "FOLDER");
    let kept = document(&bad).gyro.sensor[2].increment_weight_rad_per_rad;
    assert_eq!(kept, Some(1.0), "the nominal weight");
    assert_ne!(made.gyro.sensor[2].increment_weight_rad_per_rad, kept);
    // One axis short.
    let short =
        ["rates", &seen, "--judge", &judged, "--axis", "z", "--rates", "36,-36,108,-108", "--remove-mean"];
    let same = ["rates", &seen, "--judge", &seen, "--axis", "z", "--axis", "z", "--rates", "36,-36,108,-108"];
    insta::assert_snapshot!(worse + &told(folder.path(), &short) + &told(folder.path(), &same));
}

#[test]
fn several_units_on_one_table_are_fitted_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).display().to_string();
    let mut logs = Vec::new();
    for (seed, unit) in [(1, "MEMS-0001"), (2, "MEMS-0002")] {
        let mut scenarios = table(seed, [0.0, 0.0, 1.0], &[36.0, -36.0, 108.0, -108.0]);
        for scenario in &mut scenarios {
            scenario.unit = unit.into();
        }
        let log = place(&format!("{unit}.mcap"));
        record(Path::new(&log), &scenarios);
        logs.push(log);
    }
    let (out, html) = (place("rates.toml"), place("rates.html"));
    let rest = [
        "--axis",
        "z",
        "--rates",
        "36,-36,108,-108",
        "--remove-mean",
        "--out",
        &out,
        "--html",
        &html,
        "--json",
    ];
    let arguments = [&["rates", &logs[0], &logs[1]][..], &rest].concat();
    let report: Value = serde_json::from_str(&succeeds(&arguments)).unwrap();
    assert_eq!(report["reports"].as_array().unwrap().len(), 2);
    for unit in ["MEMS-0001", "MEMS-0002"] {
        let text = std::fs::read_to_string(place(&format!("rates-{unit}.toml"))).unwrap();
        let document = Document::parse(&text, None).unwrap().document;
        assert_eq!((document.unit.as_str(), document.origin.unwrap().log.len()), (unit, 1));
        assert!(std::fs::exists(place(&format!("rates-{unit}.html"))).unwrap());
    }
    let verdict = report["batch"]["verdict"].as_str().unwrap();
    assert!(std::fs::read_to_string(&html).unwrap().contains(verdict));
    insta::assert_snapshot!(verdict);
}
