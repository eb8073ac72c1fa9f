//! The fit and the service agree: what a report states of its residuals is what `isotherm-replay correct` leaves of the log with the
//! document that was written, both run as their users run them. `thermal` has the same in [`crate::thermal`], by method.

use std::fmt::Write as _;
use std::path::Path;

use isotherm_calibration::document::Written;
use isotherm_calibration::fits::positions::plan::Plan;
use isotherm_calibration::fits::thermal::bare::bare;
use isotherm_calibration::numbers::{ARCSEC_PER_RAD, Size};
use isotherm_correction::sample::CorrectedTick;
use isotherm_protocol::document::{Document, Residual, Sample, Trend};
use isotherm_simulator::Scenario;
use isotherm_simulator::chamber::Profile;
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;

use crate::command::{data, json, replayed, root, shipped};
use crate::modes_rates::{base, record, table, zeeman};
use crate::positions_command::driven;
use crate::simulated_logs::{fibre_optic, record as record_one, record_events};
use crate::stand::{self, GRAVITY};

/// A path in a folder, as text.
fn within(folder: &tempfile::TempDir) -> impl Fn(&str) -> String {
    move |name| folder.path().join(name).display().to_string()
}

/// The residual that a document states.
fn stated(document: &str, of: &str, sample: Sample) -> Residual {
    let document = Document::parse(&std::fs::read_to_string(document).unwrap(), None).unwrap().document;
    let all = document.origin.unwrap().residual;
    all.into_iter().find(|residual| residual.of == of && residual.sample == sample).unwrap()
}

#[track_caller]
fn same(what: &str, stated: f64, own: f64) {
    assert!((stated / own - 1.0).abs() < 1e-9, "{what}: {stated} is stated, {own} is what comes out");
}

/// The residual of a document against values of its own.
#[track_caller]
fn agrees(document: &str, of: &str, sample: Sample, own: &[f64]) {
    let (stated, own) = (stated(document, of, sample), Size::of(own));
    same(of, stated.rms_after, own.rms);
    same(of, stated.peak_to_peak_after.unwrap(), own.peak_to_peak);
}

fn less_mean(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| value - mean).collect()
}

fn deg_per_h(rad_per_s: f64) -> f64 {
    rad_per_s.to_degrees() * 3600.0
}

/// Start and end of a tick since the beginning of the first (s).
fn span_s(ticks: &[CorrectedTick], tick: &CorrectedTick) -> [f64; 2] {
    let begin = |tick: &CorrectedTick| tick.end_time.as_ns() - tick.duration.as_ns();
    [begin(tick), tick.end_time.as_ns()].map(|time| (time - begin(&ticks[0])) as f64 * 1e-9)
}

/// Means of increments over the ticks whose middle lies in a window (per second).
fn mean_within(
    ticks: &[CorrectedTick],
    [from, to]: [f64; 2],
    of: fn(&CorrectedTick) -> [f64; 3],
) -> [f64; 3] {
    let (mut sum, mut seconds) = ([0.0; 3], 0.0);
    for tick in ticks {
        let [begin, end] = span_s(ticks, tick);
        if (from..to).contains(&(0.5 * (begin + end))) {
            sum.iter_mut().zip(of(tick)).for_each(|(sum, increment)| *sum += increment);
            seconds += tick.duration.as_s();
        }
    }
    sum.map(|sum| sum / seconds)
}

/// Mean rates about an axis over whole windows of so many ticks (°/h).
fn rates(ticks: &[CorrectedTick], count: usize, axis: usize) -> Vec<f64> {
    let mean = |window: &[CorrectedTick]| {
        let seconds: f64 = window.iter().map(|tick| tick.duration.as_s()).sum();
        deg_per_h(window.iter().map(|tick| tick.delta_angle[axis]).sum::<f64>() / seconds)
    };
    ticks.chunks_exact(count).map(mean).collect()
}

/// Numbers of a table's column.
fn column(rows: &Value, index: usize) -> Vec<String> {
    rows.as_array().unwrap().iter().map(|row| row[index].as_str().unwrap().to_owned()).collect()
}

#[test]
fn of_a_rate_table() {
    let folder = tempfile::tempdir().unwrap();
    let path = within(&folder);
    let (seen, judged, out) = (path("seen.mcap"), path("judged.mcap"), path("rates.toml"));
    record(Path::new(&seen), &table(1, [0.0, 0.0, 1.0], &[45.0, -45.0, 135.0, -135.0]));
    record(Path::new(&judged), &table(2, [0.0, 0.0, 1.0], &[90.0, -90.0]));
    // Steps of stated times, of whole turns, so that they need not be found again here and the Earth's rate across them is nothing.
    let steps = [
        (1, 0.0, 1.0, 9.0),
        (1, 45.0, 11.0, 19.0),
        (1, -45.0, 31.0, 39.0),
        (1, 135.0, 51.0, 59.0),
        (1, -135.0, 71.0, 79.0),
        (2, 90.0, 11.0, 19.0),
        (2, -90.0, 31.0, 39.0),
    ];
    let rows = steps.map(|(log, rate, from, to)| format!("{log},z,{rate},{from},{to}\n")).concat();
    std::fs::write(path("steps.csv"), format!("log,axis,rate_deg_per_s,begin_s,end_s\n{rows}")).unwrap();
    let fit = ["rates", &seen, "--judge", &judged, "--steps", &path("steps.csv"), "--remove-mean"];
    let report = json(&[&fit[..], &["--out", &out, "--json"]].concat());
    let windows = |rows: &Value, log: &str| -> Vec<[f64; 2]> {
        let own = column(rows, 0).into_iter().zip(column(rows, 1)).filter(|(of, _)| of == log);
        own.map(|(_, window)| {
            let (from, to) = window.split_once('…').unwrap();
            [from.parse().unwrap(), to.parse().unwrap()]
        })
        .collect()
    };
    let logs = [
        (&seen, Sample::In, "Linearity of gyro z", "1"),
        (&judged, Sample::Out, "Errors of the judging steps", "2"),
    ];
    for (log, sample, rows, number) in logs {
        let rows = &report["tables"][rows]["rows"];
        let ticks = replayed(&[log], &out, &["--ignore-journal"]);
        let rates: Vec<f64> = column(rows, 2).iter().map(|rate| rate.parse().unwrap()).collect();
        let windows = windows(rows, number);
        assert_eq!((windows.len(), rates.len()), if sample == Sample::In { (5, 5) } else { (2, 2) });
        // Of axes that were not turned about nothing is stated.
        let error = |(window, rate): (&[f64; 2], &f64)| {
            deg_per_h(mean_within(&ticks, *window, |tick| tick.delta_angle)[2]) - 3600.0 * rate
        };
        let errors: Vec<f64> = windows.iter().zip(&rates).map(error).collect();
        agrees(&out, "gyro.z", sample, &less_mean(&errors));
    }
}

fn text_of(path: &Path) -> String {
    path.display().to_string()
}

#[test]
fn of_positions_at_two_temperatures() {
    let folder = tempfile::tempdir().unwrap();
    let path = within(&folder);
    let (plan, order) = (Plan::twelve(), (0..12).collect::<Vec<usize>>());
    let mut times = "start_s,end_s,position,log\n".to_owned();
    let mut held_by_log = Vec::new();
    for (name, deg_c) in [("cold.mcap", -20.0), ("hot.mcap", 55.0), ("room.mcap", 20.0)] {
        let (events, held) = stand::log(&stand::instrument(), deg_c, &plan, &order, &driven(21));
        record_events(Path::new(&path(name)), "MEMS-0001", &events);
        let held: Vec<([f64; 2], usize)> =
            held.into_iter().map(|(span, position)| ([span[0] + 2.0, span[1] - 0.5], position)).collect();
        for ([from, to], position) in &held {
            writeln!(times, "{from},{to},{},{name}", plan.positions[*position].name).unwrap();
        }
        held_by_log.push(held);
    }
    std::fs::write(path("times.csv"), times).unwrap();
    std::fs::write(path("base.toml"), Written::of(&stand::document()).unwrap().text).unwrap();
    let (cold, hot, room, out) = (path("cold.mcap"), path("hot.mcap"), path("room.mcap"), path("new.toml"));
    let logs = ["positions", &cold, &hot, "--judge", &room, "--times", &path("times.csv")];
    let rest = ["--calibration", &path("base.toml"), "--gravity", "9.8154", "--out", &out, "--json"];
    let report = json(&[&logs[..], &rest].concat());
    let coefficients = report["coefficients"].as_array().unwrap();
    let errors = [1, 2, 3].map(|number| {
        let name = format!("stand δ{number}");
        let found = coefficients.iter().find(|coefficient| coefficient["name"] == name.as_str()).unwrap();
        found["value"].as_f64().unwrap() / ARCSEC_PER_RAD
    });
    let left = |log: &str, held: &[([f64; 2], usize)]| -> Vec<[f64; 4]> {
        let ticks = replayed(&[log], &out, &["--ignore-journal"]);
        let one = |(span, position): &([f64; 2], usize)| {
            let force = mean_within(&ticks, *span, |tick| tick.delta_velocity);
            let up = plan.up(*position, errors);
            let [x, y, z] = [0, 1, 2].map(|axis| force[axis] - GRAVITY * up[axis]);
            [x, y, z, Vector3::from(force).norm() - GRAVITY]
        };
        held.iter().map(one).collect()
    };
    let inside = [left(&cold, &held_by_log[0]), left(&hot, &held_by_log[1])].concat();
    let outside = left(&room, &held_by_log[2]);
    assert_eq!((inside.len(), outside.len()), (24, 12));
    for (index, of) in
        ["accelerometer.x", "accelerometer.y", "accelerometer.z", "|f|−g"].into_iter().enumerate()
    {
        for (sample, left) in [(Sample::In, &inside), (Sample::Out, &outside)] {
            agrees(&out, of, sample, &left.iter().map(|left| left[index]).collect::<Vec<_>>());
        }
    }
}

/// How a fixed vector's components change while the case turns by a rotation vector.
fn turned(turn: Vector3<f64>) -> Matrix3<f64> {
    nalgebra::Rotation3::new(-turn).into_inner()
}

#[test]
fn of_the_real_tumble_log() {
    let Some(data) = data("tumble-mems") else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = within(&folder)("tumble.toml");
    let files = ["gyro.txt.gz", "acc.txt.gz"].map(|name| text_of(&data.join(name)));
    let mapping = text_of(&root().join("config/mappings/tumble-mems.toml"));
    let log = [&files[0], &files[1], "--mapping", &mapping, "--unit", "TUMBLE-0001"];
    let report = json(&[&["tumble"], &log[..], &["--gravity", "9.81744", "--out", &out, "--json"]].concat());
    let ticks = replayed(&log, &out, &[]);
    // Times of poses are printed to a hundredth of a second, which is a tick.
    let rows = &report["tables"]["Poses"]["rows"];
    let times =
        |index| column(rows, index).iter().map(|cell| cell.parse::<f64>().unwrap()).collect::<Vec<_>>();
    let poses: Vec<[f64; 2]> = times(1).into_iter().zip(times(2)).map(|(from, to)| [from, to]).collect();
    let forces: Vec<Vector3<f64>> = poses
        .iter()
        .map(|pose| Vector3::from(mean_within(&ticks, *pose, |tick| tick.delta_velocity)))
        .collect();
    let lengths: Vec<f64> = forces.iter().map(|force| force.norm() - 9.81744).collect();
    agrees(&out, "|f|−g", Sample::In, &lengths);
    // From pose to pose by the gyros.
    let mut angles = Vec::new();
    for (pair, force) in poses.windows(2).zip(forces.windows(2)) {
        let [before, after] = [0, 1].map(|index| force[index].normalize());
        if before.dot(&after) >= 0.1_f64.cos() || pair[1][0] - pair[0][1] >= 60.0 {
            continue;
        }
        let between = ticks.iter().filter(|tick| {
            let [begin, end] = span_s(&ticks, tick);
            (pair[0][1]..pair[1][0]).contains(&(0.5 * (begin + end)))
        });
        let seen = between.fold(before, |seen, tick| turned(Vector3::from(tick.delta_angle)) * seen);
        angles.push(seen.angle(&after).to_degrees());
    }
    let after = &report["verdicts"][1]["in_sample"]["after"];
    assert_eq!(after["count"].as_u64(), Some(angles.len() as u64));
    same("gyros", after["rms"].as_f64().unwrap(), Size::of(&angles).rms);
}

#[test]
fn of_a_mode_reversed_gyro() {
    let folder = tempfile::tempdir().unwrap();
    let path = within(&folder);
    let (run, judge, out) = (path("run.mcap"), path("judge.mcap"), path("modes.toml"));
    let base = text_of(&base(folder.path()));
    record(Path::new(&run), &[zeeman(1, Profile::constant(50.0).ramp(-30.0, 4.0).ramp(50.0, 4.0))]);
    record(Path::new(&judge), &[zeeman(2, Profile::constant(20.0).hold(4.0).ramp(45.0, 3.0).ramp(0.0, 5.0))]);
    let report = json(&[
        "modes",
        &run,
        "--judge",
        &judge,
        "--calibration",
        &base,
        "--remove-mean",
        "--out",
        &out,
        "--json",
    ]);
    for (log, sample) in [(&run, Sample::In), (&judge, Sample::Out)] {
        let ticks = replayed(&[log], &out, &["--ignore-journal"]);
        for (axis, of) in ["gyro.x", "gyro.y", "gyro.z"].into_iter().enumerate() {
            let which = if sample == Sample::In { "in_sample" } else { "out_of_sample" };
            let windows = report["verdicts"][axis][which]["after"]["count"].as_u64().unwrap() as usize;
            // Windows are whole reversal periods, which have as many ticks each.
            let own = rates(&ticks, ticks.len() / windows / 1200 * 1200, axis);
            assert_eq!(own.len(), windows, "{} ticks", ticks.len());
            agrees(&out, of, sample, &less_mean(&own));
        }
    }
}

#[test]
fn of_a_thermal_fit_to_recordings_with_accelerometers() {
    let folder = tempfile::tempdir().unwrap();
    let path = within(&folder);
    let (train, judge) = (path("train.mcap"), path("judge.mcap"));
    let chamber = |ramp: f64| {
        Profile::constant(20.0)
            .hold(20.0)
            .ramp(-10.0, ramp)
            .hold(30.0)
            .ramp(40.0, ramp)
            .hold(30.0)
            .ramp(20.0, ramp)
    };
    for (log, seed, ramp) in [(&train, 5, 2.0), (&judge, 6, 3.0)] {
        let chamber = chamber(ramp);
        let seconds = chamber.duration_s();
        record_one(Path::new(log), &Scenario { chamber, ..fibre_optic(seed, "FOG-0001", seconds) });
    }
    // Without terms that a fit could be worse than.
    let document = path("base.toml");
    let mut without = bare(&Written::read(&shipped("FOG-0001.toml")).unwrap().document);
    without.gyro.sensor[1].trend = Some(Trend { coefficients_deg_per_h: vec![1e-6], interval_h: [0.0, 1.0] });
    Written::of(&without).unwrap().save(Path::new(&document), false).unwrap();
    for method in ["sequential", "joint"] {
        let out = path(&format!("{method}.toml"));
        let fit =
            ["thermal", &train, "--judge", &judge, "--method", method, "--window", "20", "--accept-partial"];
        let report = json(&[&fit[..], &["--calibration", &document, "--out", &out, "--json"]].concat());
        let warnings = report["warnings"].as_array().unwrap();
        let of_trend = warnings.iter().filter(|words| words.as_str().unwrap().contains(" trend "));
        insta::allow_duplicates! { insta::assert_snapshot!(of_trend.map(Value::to_string).collect::<String>()) };
        for (log, sample) in [(&train, Sample::In), (&judge, Sample::Out)] {
            let ticks = replayed(&[log], &out, &["--ignore-journal"]);
            for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
                agrees(&out, &format!("gyro.{letter}"), sample, &less_mean(&rates(&ticks, 20, axis)));
                let force = |window: &[CorrectedTick]| {
                    window.iter().map(|tick| tick.delta_velocity[axis]).sum::<f64>() / 20.0
                };
                let forces: Vec<f64> = ticks.chunks_exact(20).map(force).collect();
                agrees(&out, &format!("accelerometer.{letter}"), sample, &less_mean(&forces));
            }
        }
    }
}

#[test]
fn of_noise_and_drift_and_of_a_judgement() {
    let folder = tempfile::tempdir().unwrap();
    let path = within(&folder);
    let (log, out, csv) = (path("static.mcap"), path("new.toml"), path("corrected.csv"));
    record_one(Path::new(&log), &fibre_optic(7, "FOG-0001", 9000.0));
    let document = text_of(&shipped("FOG-0001.toml"));
    let report = json(&["drift", &log, "--calibration", &document, "--out", &out, "--json"]);
    let ticks = replayed(&[&log], &out, &["--ignore-journal"]);
    // The first tick has no temperature yet and is analysed like all others.
    assert_eq!(report["ticks"].as_u64(), Some(ticks.len() as u64));
    for axis in 0..3 {
        let rates: Vec<f64> = rates(&ticks, 1, axis);
        let sensor = &report["sensors"][axis];
        same("mean", sensor["mean"].as_f64().unwrap(), Size::of(&rates).mean);
        let count = rates.len() as f64;
        let deviation = Size::of(&rates).deviation * (count / (count - 1.0)).sqrt();
        same("standard deviation", sensor["standard_deviation"].as_f64().unwrap(), deviation);
    }
    // All other figures of the same ticks as the program wrote them.
    let mut text = Vec::new();
    isotherm_log::offline::rows::write_header(&mut text).unwrap();
    for tick in &ticks {
        isotherm_log::offline::rows::write_tick(&mut text, tick).unwrap();
    }
    std::fs::write(&csv, text).unwrap();
    let of_csv = json(&["drift", &csv, "--json"]);
    for (one, other) in
        report["sensors"].as_array().unwrap().iter().zip(of_csv["sensors"].as_array().unwrap())
    {
        for figure in ["allan", "noise", "markov_sigma", "trend_per_h", "extrapolation"] {
            assert_eq!(one[figure], other[figure], "{figure}");
        }
    }

    let judgement = json(&["validate", &out, &log, "--window", "20", "--json"]);
    for axis in 0..3 {
        let own = Size::of(&less_mean(&rates(&ticks, 20, axis)));
        let verdict = &judgement["verdicts"][axis];
        let after = &verdict["in_sample"]["after"];
        same("judged", after["rms"].as_f64().unwrap(), own.rms);
        same("judged", after["peak_to_peak"].as_f64().unwrap(), own.peak_to_peak);
    }
}
