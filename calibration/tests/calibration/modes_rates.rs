//! `modes` and `rates` as their users run them: recordings in, documents and reports out, exit codes.

use std::path::{Path, PathBuf};

use isotherm_log::message::{Message, Topic};
use isotherm_log::offline::unit_id;
use isotherm_log::recording::{RecordingOptions, RecordingWriter};
use isotherm_protocol::document::{Document, Sample};
use isotherm_protocol::raw::Batcher;
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::motion::Path as Movement;
use isotherm_simulator::presets::{mems_chamber, zeeman_rest};
use isotherm_simulator::{Scenario, Simulation};
use serde_json::Value;

use crate::command::{fails, shipped, succeeds};

/// Scenarios one after the other, as one recording; each starts where the last one ended.
fn record(path: &Path, scenarios: &[Scenario]) {
    let unit = unit_id(&scenarios[0].unit).unwrap();
    let mut writer = RecordingWriter::create(path, RecordingOptions::default()).unwrap();
    let mut batcher = Batcher::new(64);
    let mut write = |batcher: &mut Batcher| {
        while let Some(frame) = batcher.next_frame() {
            let topic = Topic::Raw(unit.clone(), frame.stream);
            let received_ns = u64::try_from(frame.time.as_ns()).unwrap();
            writer.write(&Message { topic, received_ns, frame: frame.frame }).unwrap();
        }
    };
    let mut offset = 0;
    for scenario in scenarios {
        let mut next = offset;
        for step in Simulation::new(scenario).unwrap() {
            for reading in step.temperatures {
                batcher.temperature(reading).unwrap();
            }
            let mut tick = step.gyro;
            tick.sequence += offset;
            next = tick.sequence + 1;
            if let (Some(kind), Some(mut accel)) = (scenario.instrument.accel_output_kind(), step.accel) {
                accel.sequence += offset;
                batcher.accel(kind, accel).unwrap();
            }
            batcher.gyro(scenario.instrument.gyros.output_kind(), tick).unwrap();
            write(&mut batcher);
        }
        offset = next;
    }
    batcher.flush().unwrap();
    write(&mut batcher);
    writer.finish().unwrap();
}

/// The Zeeman unit through a chamber programme at ten ticks a second, with its accelerometers.
fn zeeman(seed: u64, chamber: Profile) -> Scenario {
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
fn base(folder: &Path) -> PathBuf {
    let path = shipped("ZLG-0001.toml");
    let mut document = Document::parse(&std::fs::read_to_string(path).unwrap(), None).unwrap().document;
    for sensor in &mut document.gyro.sensor {
        sensor.static_bias = None;
        sensor.magnetic_bias = None;
        sensor.slow_meander = None;
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
    let fit = ["modes", text(&run), "--document", text(&base), "--latitude", "55.75", "--heading", "30"];
    let rest =
        ["--judge", text(&judge), "--out", text(&out), "--html", text(&html), "--created", "2026-11-22"];
    let words = succeeds(&[&fit[..], &rest[..]].concat());
    assert!(
        words.lines().next().unwrap().starts_with("gyro x: ") && words.contains("out of sample; accepted."),
        "{words}"
    );
    let written = std::fs::read_to_string(&out).unwrap();
    let document = Document::parse(&written, None).unwrap().document;
    let origin = document.origin.as_ref().unwrap();
    assert_eq!(origin.log.len(), 1);
    assert_eq!(origin.residual.iter().filter(|residual| residual.sample == Sample::Out).count(), 3);
    for residual in origin.residual.iter().filter(|residual| residual.sample == Sample::Out) {
        assert!(residual.rms_after < 0.2 * residual.rms_before, "{residual:?}");
    }
    let details = &origin.details.as_ref().unwrap()["modes"];
    assert_eq!(details["gyro"].as_array().unwrap().len(), 3);
    assert!(details["gyro"][0]["covariance"].is_array());
    let page = std::fs::read_to_string(&html).unwrap();
    assert!(
        page.contains("Over temperature") && page.contains("Cross-validation") && page.contains("gyro z")
    );

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
    assert_eq!(json["verdict"], words.lines().next().unwrap());

    // What is missing is asked for; what is there already is kept.
    assert!(fails(&["modes", text(&run), "--document", text(&base)], 2).contains("--latitude and --heading"));
    assert!(fails(&["modes", text(&run), "--remove-mean"], 2).contains("give --document"));
    assert!(fails(&[&fit[..], &["--out", text(&out)]].concat(), 2).contains("--overwrite"));
    let other = ["modes", text(&run), "--document", text(&base), "--remove-mean", "--unit", "NOBODY"];
    assert!(fails(&other, 1).contains("is --unit right?"));
}

/// A run on the table: a rest before every step of whole turns.
fn table(seed: u64, axis: [f64; 3], rates: &[f64]) -> Vec<Scenario> {
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
    let words = succeeds(&[&fit[..], &["--out", text(&out)]].concat());
    assert!(words.contains("12 steps of the table and 12 rests"), "{words}");
    assert!(words.contains("Linearity of gyro y"));
    let document = Document::parse(&std::fs::read_to_string(&out).unwrap(), None).unwrap().document;
    let weight = document.gyro.sensor[0].increment_weight_rad_per_rad.unwrap();
    assert!((weight - 1.0015).abs() < 4e-4, "{weight}");
    assert!(
        (document.gyro.orientation.rows[0][2] - 2.1e-4).abs() < 3e-5,
        "{:?}",
        document.gyro.orientation.rows
    );
    assert!(document.origin.unwrap().details.unwrap()["rates"]["gyro"][2]["asymmetry_ppm"].is_float());
    let json: Value = serde_json::from_str(&succeeds(&[&fit[..], &["--json"]].concat())).unwrap();
    assert_eq!(json["accepted"], true);

    let steps = place("steps.csv");
    std::fs::write(
        &steps,
        "axis,rate_deg_per_s,begin_s,end_s\nz,36,11,19\nz,-36,31,39\nz,0,1,9\nz,108,51,59\n",
    )
    .unwrap();
    let by_file = succeeds(&["rates", logs[2], "--steps", text(&steps), "--remove-mean"]);
    assert!(
        by_file.contains("gyro z increment weight") && by_file.contains("gyro x: its input axis is across"),
        "{by_file}"
    );
    let wrong = [&["rates", logs[0], "--axis", "x", "--rates", "36,-36,108"][..], &attitude].concat();
    assert!(fails(&wrong, 1).contains("3 steps of the table are stated"));
    assert!(fails(&[&["rates", logs[0]][..], &attitude].concat(), 2).contains("--axis and --rates"));
}
