//! `positions` as its user calls it.

use std::path::Path;
use std::process::Output;

use isotherm_calibration::document::Written;
use isotherm_calibration::fits::positions::plan::Plan;
use isotherm_calibration::report::Sigmas;
use isotherm_protocol::document::Document;

use crate::command::{ended, headings, program};
use crate::simulated_logs::record_events;
use crate::stand::{self, ARCSEC, Dice, Stand};

/// A stand that turns the unit, ten ticks a second.
pub(crate) fn driven(seed: u64) -> Stand {
    Stand {
        errors: Dice::new(seed).vector(60.0 * ARCSEC),
        positioning: 5.385 * ARCSEC,
        tick_ns: 100_000_000,
        hold_s: 14.0,
        start_s: 0.0,
        turn_deg_per_s: Some(15.0),
        seed,
    }
}

/// Runs the program in a folder.
fn within(folder: &Path, arguments: &[&str]) -> Output {
    program(arguments).current_dir(folder).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn the_command_writes_the_document_and_says_what_it_did() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let order: Vec<usize> = (0..12).collect();
    let mut logs = Vec::new();
    for (name, deg_c) in [("cold", -20.0), ("room", 20.0), ("hot", 55.0)] {
        let (events, _) = stand::log(&stand::instrument(), deg_c, &Plan::twelve(), &order, &driven(21));
        let (csv, mapping) = stand::as_text(&events, true);
        std::fs::write(at(&format!("{name}.csv")), csv).unwrap();
        std::fs::write(at("mapping.toml"), mapping).unwrap();
        logs.push(format!("{name}.csv"));
    }
    std::fs::write(at("base.toml"), Written::of(&stand::document()).unwrap().text).unwrap();
    let common = ["--mapping", "mapping.toml", "--calibration", "base.toml", "--gravity", "9.8154"];
    let call = |more: &[&str]| {
        let mut args = vec!["positions", "cold.csv", "hot.csv"];
        args.extend(common);
        args.extend(more);
        within(folder.path(), &args)
    };
    let done = call(&["--out", "new.toml", "--html", "new.html", "--judge", "room.csv"]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    let said = text(&done.stdout);
    let page = headings(at("new.html"));
    let written = Written::read(&at("new.toml")).unwrap();
    let thermal = written.document.accel.as_ref().unwrap().orientation.thermal.as_ref().unwrap();
    assert_eq!(
        thermal.channels,
        ["accel0", "accel1", "accel2"],
        "the accelerometers' own where nothing else is said"
    );
    let origin = written.document.origin.as_ref().unwrap();
    assert_eq!(
        (origin.log.len(), origin.residual.len()),
        (2, 8),
        "two logs; three axes and |f| in and out of sample"
    );
    // The same bytes once more, and not over them without being asked.
    let first = std::fs::read(at("new.toml")).unwrap();
    let again = call(&["--out", "new.toml", "--html", "new.html", "--judge", "room.csv"]);
    assert_eq!(again.status.code(), Some(2));
    let again = call(&["--out", "new.toml", "--html", "new.html", "--judge", "room.csv", "--overwrite"]);
    assert!(again.status.success());
    let second = std::fs::read_to_string(at("new.toml")).unwrap();
    assert_eq!(text(&first), second.replace(" --overwrite", ""));
    // JSON instead of tables; a warning where nobody says what gravity is.
    let json = within(
        folder.path(),
        &["positions", "room.csv", "--mapping", "mapping.toml", "--calibration", "base.toml", "--json"],
    );
    let value: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    let is_of_stand = |of: &serde_json::Value| of["name"] == "stand δ1";
    assert!(value["coefficients"].as_array().unwrap().iter().any(is_of_stand), "{value}");
    let wrong = ended(&call(&["--plan", "absent.toml"]));
    insta::assert_snapshot!(format!("{said}\n{page}\n{:#}\n{wrong}", value["warnings"]));
    let usage = call(&["--levelling", "0"]);
    assert_eq!(usage.status.code(), Some(2));
}

#[test]
fn several_units_on_one_stand_end_with_one_table() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("documents")).unwrap();
    let order: Vec<usize> = (0..12).collect();
    for (seed, unit) in [(21, "MEMS-0001"), (22, "MEMS-0002")] {
        let (events, _) = stand::log(&stand::instrument(), 20.0, &Plan::twelve(), &order, &driven(seed));
        record_events(&at(&format!("{unit}.mcap")), unit, &events);
        let document = Document { unit: unit.into(), ..stand::document() };
        std::fs::write(at(&format!("documents/{unit}.toml")), Written::of(&document).unwrap().text).unwrap();
    }
    let logs = ["positions", "MEMS-0001.mcap", "MEMS-0002.mcap"];
    let rest =
        ["--calibration", "documents", "--gravity", "9.8154", "--out", "new.toml", "--html", "new.html"];
    let done = within(folder.path(), &[&logs[..], &rest].concat());
    assert!(done.status.success(), "{}", text(&done.stderr));
    let said = text(&done.stdout);
    insta::assert_snapshot!(said);
    for unit in ["MEMS-0001", "MEMS-0002"] {
        let written = Written::read(&at(&format!("new-{unit}.toml"))).unwrap();
        assert_eq!(written.document.unit, unit);
        let sigma = Sigmas::of(&written.document);
        let axis = sigma.get("accel", "x", "axis_arcsec").unwrap();
        assert!(axis[0] < 0.1 && axis[1] > 1.0 && axis[1] < 30.0, "{axis:?}");
        assert!(sigma.get("accel", "x", "scale_factor").is_some_and(|sigma| sigma[0] > 0.0));
        assert!(at(&format!("new-{unit}.html")).exists());
    }
    // By itself a unit comes to the same.
    let alone = ["positions", "MEMS-0002.mcap", "--calibration", "documents/MEMS-0002.toml"];
    let done = within(folder.path(), &[&alone[..], &["--gravity", "9.8154", "--out", "alone.toml"]].concat());
    assert!(done.status.success(), "{}", text(&done.stderr));
    let accel = |name: &str| Written::read(&at(name)).unwrap().document.accel;
    assert_eq!(accel("alone.toml"), accel("new-MEMS-0002.toml"));
    // What diff makes of the two: each axis beside its standard error.
    let changed = within(folder.path(), &["diff", "alone.toml", "new-MEMS-0002.toml", "--json"]);
    let changed: serde_json::Value = serde_json::from_slice(&changed.stdout).unwrap();
    assert!(changed["axes"][3]["turned_sigma_arcsec"].is_number(), "{}", changed["axes"]);
}

#[test]
fn the_budget_prints_the_examples_of_the_paper() {
    let folder = tempfile::tempdir().unwrap();
    let said = text(&within(folder.path(), &["positions", "--budget"]).stdout);
    let json = within(
        folder.path(),
        &["positions", "--budget", "--json", "--axis-rate", "6", "--positioning", "1", "--run-out", "0"],
    );
    let value: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    let stand = value["stand_arcsec"].as_f64().unwrap();
    assert!((stand - 2.0 * 1.0_f64.hypot(2.0626)).abs() < 1e-3, "{value}");
    assert!((value["temperature_arcsec"].as_f64().unwrap() - 1.2).abs() < 1e-12);
    // Of another plan the first line is another one; of one that tells nothing it says so.
    let first = |plan: &str| {
        let done = within(folder.path(), &["positions", "--budget", "--plan", plan]);
        assert!(done.status.success());
        text(&done.stdout).lines().next().unwrap().to_owned()
    };
    std::fs::write(folder.path().join("flat.csv"), "name,axis_1_deg,axis_2_deg\na,0,0\nb,90,0\nc,0,180\n")
        .unwrap();
    insta::assert_snapshot!(said + &["twelve", "six", "flat.csv"].map(first).join("\n"));
}

#[test]
fn a_judging_log_in_another_unit_of_measure_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let order: Vec<usize> = (0..12).collect();
    let document = stand::document();
    for (name, factor) in [("own", 1.0), ("other", 9.81)] {
        let (mut events, _) = stand::log(&stand::instrument(), 20.0, &Plan::twelve(), &order, &driven(33));
        for event in &mut events {
            if let isotherm_log::text::LogEvent::Accel { tick, .. } = event {
                tick.readings.iter_mut().for_each(|reading| *reading = (*reading * factor).round());
            }
        }
        record_events(&folder.path().join(format!("{name}.mcap")), "MEMS-0001", &events);
    }
    std::fs::write(folder.path().join("base.toml"), Written::of(&document).unwrap().text).unwrap();
    let call = [
        "positions",
        "own.mcap",
        "--judge",
        "other.mcap",
        "--calibration",
        "base.toml",
        "--gravity",
        "9.8154",
    ];
    let done = within(folder.path(), &call);
    assert_eq!(done.status.code(), Some(1));
    insta::assert_snapshot!(text(&done.stdout));
}
