//! What a user does wrong, or a recorder: files that may not be written, logs that are cut short, empty, swapped, or too short.

use std::path::Path;

use isotherm_calibration::document::Written;
use isotherm_calibration::fits::positions::plan::Plan;
use isotherm_log::text::LogEvent;
use isotherm_simulator::chamber::Profile;
use serde_json::Value;

use crate::command::{calibrate, fails, shipped, succeeds, words};
use crate::modes_rates::{base, events as events_of, zeeman};
use crate::positions_command::driven;
use crate::simulated_logs::{events, fibre_optic, record, record_events, record_units};
use crate::stand;

fn fog() -> String {
    shipped("FOG-0001.toml").display().to_string()
}

/// The beginning of a file, as a recorder leaves it that was killed.
fn cut(from: &str, to: &str, per_mille: usize) {
    let bytes = std::fs::read(from).unwrap();
    std::fs::write(to, &bytes[..bytes.len() * per_mille / 1000]).unwrap();
}

#[test]
fn nothing_is_replaced_without_overwrite() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (notes, log) = (path("notes.txt"), path("log.mcap"));
    record(Path::new(&log), &fibre_optic(5, "FOG-0001", 900.0));
    std::fs::write(&notes, "mine").unwrap();
    let (fog, mems) = (fog(), shipped("MEMS-0001.toml").display().to_string());
    let commands: [&[&str]; 4] = [
        &["impact", "--trend", "0.00008", "--hours", "1"],
        &["show", &fog],
        &["diff", &mems, &mems],
        &["validate", &fog, &log],
    ];
    let mut told = String::new();
    for command in commands {
        let html = |more: &[&'static str]| [command, &["--html", &notes], more].concat();
        told += &fails(&html(&[]), 2);
        assert_eq!(std::fs::read_to_string(&notes).unwrap(), "mine", "{command:?}");
        calibrate(&html(&["--overwrite"]));
        assert!(std::fs::read_to_string(&notes).unwrap().contains("<html"), "{command:?}");
        std::fs::write(&notes, "mine").unwrap();
    }
    insta::assert_snapshot!(told.replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn outputs_are_checked_before_anything_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    // None of these logs and documents is there: that would be told next.
    let (log, document) = (path("none.mcap"), path("none.toml"));
    let (out, page) = (path("made/x.toml"), path("made/x.html"));
    let commands: [&[&str]; 7] = [
        &["thermal", &log, "--out", &out],
        &["drift", &log, "--html", &page],
        &["tumble", &log, "--out", &out],
        &["validate", &document, &log, "--html", &page],
        &["show", &document, "--html", &page],
        &["impact", &log, "--html", &page],
        &["merge", &document, &document, "--out", &out],
    ];
    let both = path("both");
    let told = commands.map(|command| fails(command, 2)).concat()
        + &fails(&["thermal", &log, "--out", &both, "--html", &both], 2);
    insta::assert_snapshot!(told.replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn a_recording_that_is_cut_short_is_told_by_every_command_and_ends_with_3() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (whole, log, nothing) = (path("whole.mcap"), path("cut.mcap"), path("nothing.mcap"));
    record(Path::new(&whole), &fibre_optic(5, "FOG-0001", 9000.0));
    cut(&whole, &log, 900);
    let (fog, page) = (fog(), path("page.html"));
    let commands: [&[&str]; 5] = [
        &["drift", &log, "--html", &page],
        &["drift", &log, "--calibration", &fog, "--json"],
        &["validate", &fog, &log],
        &["validate", &fog, &log, "--json"],
        &["impact", &log, "--calibration", &fog, "--calibration-hours", "0.5", "--hours", "0.5"],
    ];
    for command in commands {
        let (code, said, errors) = words(&calibrate(command));
        assert!(code == Some(3) && said.contains("cut.mcap"), "{command:?}: {said}{errors}");
    }
    assert!(std::fs::read_to_string(&page).unwrap().contains("cut.mcap"));
    // A batch, of which one log is cut.
    let other = path("other.mcap");
    record(Path::new(&other), &fibre_optic(6, "FOG-0002", 3000.0));
    let (code, said, errors) = words(&calibrate(&["drift", &log, "--json"]));
    assert!(code == Some(3) && serde_json::from_str::<Value>(&said).is_ok(), "{errors}");
    let both = path("both.mcap");
    let of = |seed, unit: &'static str| {
        (unit, events(&fibre_optic(seed, unit, 3000.0)).collect::<Vec<LogEvent>>())
    };
    record_units(Path::new(&both), &[of(1, "A"), of(2, "B")]);
    let cut_both = path("cut-both.mcap");
    cut(&both, &cut_both, 900);
    let (code, said, errors) = words(&calibrate(&["drift", &cut_both, "--json"]));
    let report: Value = serde_json::from_str(&said).unwrap();
    assert_eq!((code, report["reports"].as_array().unwrap().len()), (Some(3), 2), "{errors}");
    assert!(errors.contains("cut-both.mcap"), "{errors}");
    // Nothing whole is left of it: the refusal says why.
    cut(&whole, &nothing, 2);
    let commands: [&[&str]; 7] = [
        &["thermal", &nothing],
        &["drift", &nothing],
        &["modes", &nothing, "--calibration", &fog, "--remove-mean"],
        &["positions", &nothing],
        &["tumble", &nothing],
        &["rates", &nothing, "--axis", "z", "--rates", "1,-1", "--remove-mean"],
        &["drift", &nothing, "--unit", "FOG-0001"],
    ];
    let mut told = commands.map(|command| fails(command, 1)).concat();
    std::fs::write(&nothing, "").unwrap();
    told += &fails(&["drift", &nothing], 1);
    insta::assert_snapshot!(told.replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn swapped_columns_are_pointed_out_where_the_attitude_is_stated() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("swapped.mcap").display().to_string();
    let warnings = |change: &dyn Fn(&mut LogEvent)| {
        let scenario = fibre_optic(5, "FOG-0001", 900.0);
        let all = events(&scenario).map(|mut event| {
            change(&mut event);
            event
        });
        let _ = std::fs::remove_file(&log);
        record_events(Path::new(&log), "FOG-0001", all);
        let stated = ["--latitude", "55.75", "--heading", "30", "--pitch", "0", "--roll", "0", "--json"];
        let (_, said, errors) = words(&calibrate(&[&["validate", &fog(), &log][..], &stated].concat()));
        let report: Value = serde_json::from_str(&said).unwrap_or_default();
        format!("{:#}\n{errors}", report["warnings"])
    };
    let sound = warnings(&|_| ());
    let gyros = warnings(&|event| {
        if let LogEvent::Gyro { tick, .. } = event {
            tick.readings.swap(0, 2);
        }
    });
    let accelerometers = warnings(&|event| {
        if let LogEvent::Accel { tick, .. } = event {
            tick.readings.swap(1, 2);
        }
    });
    insta::assert_snapshot!([sound, gyros, accelerometers].join("\n"));
}

#[test]
fn positions_with_swapped_columns_name_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let (log, base) = (path("log.mcap"), path("base.toml"));
    std::fs::write(&base, Written::of(&stand::document()).unwrap().text).unwrap();
    let times = path("times.csv").display().to_string();
    let call = |plan: &str, more: &[&str], change: &dyn Fn(&mut LogEvent)| {
        let positions = Plan::named(plan).unwrap();
        let order: Vec<usize> = (0..positions.positions.len()).collect();
        let (mut events, held) = stand::log(&stand::instrument(), 20.0, &positions, &order, &driven(21));
        events.iter_mut().for_each(change);
        let _ = std::fs::remove_file(&log);
        record_events(&log, "MEMS-0001", &events);
        let rows = held.iter().map(|([from, to], position)| {
            format!("{},{},{}\n", from + 2.0, to - 1.0, positions.positions[*position].name)
        });
        std::fs::write(&times, format!("start_s,end_s,position\n{}", rows.collect::<String>())).unwrap();
        let call =
            ["positions", log.to_str().unwrap(), "--calibration", base.to_str().unwrap(), "--plan", plan];
        let (code, said, errors) = words(&calibrate(&[&call[..], &["--gravity", "9.8154"], more].concat()));
        (code, format!("{said}{errors}"))
    };
    let accelerometers = |event: &mut LogEvent| {
        if let LogEvent::Accel { tick, .. } = event {
            tick.readings.swap(0, 1);
        }
    };
    let gyros = |event: &mut LogEvent| {
        if let LogEvent::Gyro { tick, .. } = event {
            tick.readings.swap(0, 2);
        }
    };
    let mut told = String::new();
    for plan in ["twelve", "six"] {
        // The gyros do not matter for what is found, but for whoever corrects with that mapping.
        let none = |_: &mut LogEvent| {};
        let changes: [&dyn Fn(&mut LogEvent); 3] = [&none, &accelerometers, &gyros];
        for (change, expected) in changes.into_iter().zip([0, 1, 0]) {
            let (code, said) = call(plan, &[], change);
            assert_eq!(code, Some(expected), "{said}");
            told += &said;
        }
    }
    // Where the times are stated nothing is matched: what is found is far from what the document states.
    let (_, turned) = call("twelve", &["--times", &times], &accelerometers);
    insta::assert_snapshot!((told + &turned).replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn modes_point_out_swapped_columns_where_the_attitude_is_stated() {
    let folder = tempfile::tempdir().unwrap();
    let base = base(folder.path());
    let log = folder.path().join("run.mcap");
    let chamber = || Profile::constant(50.0).ramp(-30.0, 4.0).ramp(50.0, 4.0);
    let stated = ["--latitude", "55.75", "--heading", "30", "--pitch", "0", "--roll", "0", "--json"];
    let warnings = |[gyros, accelerometers]: [bool; 2]| {
        let mut all = events_of(&[zeeman(1, chamber())]);
        for event in &mut all {
            match event {
                LogEvent::Gyro { tick, .. } if gyros => tick.readings.swap(0, 2),
                LogEvent::Accel { tick, .. } if accelerometers => tick.readings.swap(0, 2),
                _ => {}
            }
        }
        let _ = std::fs::remove_file(&log);
        record_events(&log, "ZLG-0001", &all);
        let call = ["modes", log.to_str().unwrap(), "--calibration", base.to_str().unwrap()];
        let (_, said, errors) = words(&calibrate(&[&call[..], &stated].concat()));
        let report: Value = serde_json::from_str(&said).unwrap_or_default();
        format!("{:#}\n{errors}", report["warnings"])
    };
    let told = warnings([false, false]) + &warnings([true, true]);
    // The right columns, and the heading of another log.
    let _ = std::fs::remove_file(&log);
    record_events(&log, "ZLG-0001", events_of(&[zeeman(1, chamber())]));
    let call =
        ["modes", log.to_str().unwrap(), "--calibration", base.to_str().unwrap(), "--latitude", "55.75"];
    let (_, said, _) = words(&calibrate(&[&call[..], &["--heading", "210", "--json"]].concat()));
    let turned: Value = serde_json::from_str(&said).unwrap();
    insta::assert_snapshot!(format!("{told}{:#}", turned["warnings"]));
}

#[test]
fn thermal_refuses_a_log_in_another_attitude_than_the_stated_one() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("run.mcap").display().to_string();
    record(Path::new(&log), &fibre_optic(5, "FOG-0001", 3000.0));
    let fog = fog();
    let call =
        ["thermal", &log, "--calibration", &fog, "--latitude", "55.75", "--heading", "30", "--pitch", "0"];
    let (_, said, errors) = words(&calibrate(&[&call[..], &["--roll", "0"]].concat()));
    assert!(!format!("{said}{errors}").contains("run.mcap: "), "{said}{errors}");
    let refused = fails(&[&call[..], &["--roll", "180"]].concat(), 1);
    insta::assert_snapshot!(refused.replace(folder.path().to_str().unwrap(), "FOLDER"));
    // A run that only judges is told of.
    let judge = folder.path().join("judge.mcap");
    let mut swapped = events_of(&[fibre_optic(6, "FOG-0001", 3000.0)]);
    for event in &mut swapped {
        if let LogEvent::Accel { tick, .. } = event {
            tick.readings.swap(0, 2);
        }
    }
    record_events(&judge, "FOG-0001", &swapped);
    let with_judge = [&call[..], &["--roll", "0", "--judge", judge.to_str().unwrap()]].concat();
    let (_, said, errors) = words(&calibrate(&with_judge));
    let told = format!("{said}{errors}");
    assert!(told.contains("judge.mcap: ") && !told.contains("run.mcap: "), "{told}");
}

#[test]
fn a_log_that_is_too_short_for_a_drift_says_so_in_its_first_line() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("ramp.mcap").display().to_string();
    // Heating for a quarter of an hour: what moves is temperature.
    let mut scenario = isotherm_simulator::presets::mems_chamber(5);
    scenario.chamber = Profile::constant(20.0).ramp(60.0, 3.0);
    (scenario.tick_ns, scenario.duration_s) = (100_000_000, 800.0);
    record(Path::new(&log), &scenario);
    let said = succeeds(&["drift", &log]);
    insta::assert_snapshot!(said.lines().next().unwrap());
}
