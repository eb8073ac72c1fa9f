//! Two units in one recording: every command does both and closes them with one table, does that of its document and says that it
//! leaves the other alone, or refuses and says what to do.

use std::path::Path;

use isotherm_calibration::document::Written;
use isotherm_log::text::LogEvent;
use serde_json::Value;

use crate::command::{calibrate, fails, json, shipped, succeeds, told, words};
use crate::modes_rates::{self, table};
use crate::simulated_logs::{events, fibre_optic, record_units};
use crate::stand::GRAVITY;
use crate::tumble::tumbled_log;

const UNITS: [&str; 2] = ["FOG-0001", "FOG-0002"];

/// A recording of both units, and a folder with the document of each.
fn both(folder: &Path, of: impl Fn(u64, &str) -> Vec<LogEvent>) -> (String, String) {
    let log = folder.join("both.mcap");
    record_units(&log, &[(UNITS[0], of(1, UNITS[0])), (UNITS[1], of(2, UNITS[1]))]);
    let documents = folder.join("documents");
    std::fs::create_dir(&documents).unwrap();
    for unit in UNITS {
        let mut document = Written::read(&shipped("FOG-0001.toml")).unwrap().document;
        unit.clone_into(&mut document.unit);
        Written::of(&document).unwrap().save(&documents.join(format!("{unit}.toml")), false).unwrap();
    }
    (log.display().to_string(), documents.display().to_string())
}

fn at_rest(seconds: f64) -> impl Fn(u64, &str) -> Vec<LogEvent> {
    move |seed, unit| events(&fibre_optic(seed, unit, seconds)).collect()
}

/// The serials that a batch's table has rows of.
fn units(report: &Value) -> Vec<&str> {
    report["batch"]["units"].as_array().unwrap().iter().map(|unit| unit["unit"].as_str().unwrap()).collect()
}

#[test]
fn noise_and_drift_of_both_end_with_one_table() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (log, documents) = both(folder.path(), at_rest(3000.0));
    let (out, html) = (path("new.toml"), path("drift.html"));
    let said = succeeds(&["drift", &log, "--calibration", &documents, "--out", &out, "--html", &html]);
    let mut all = said;
    assert!(std::fs::exists(&html).unwrap());
    // A unit comes to the same by itself.
    let of = |name: &str| Written::read(&folder.path().join(name)).unwrap().document;
    let (one, alone) = (format!("{documents}/FOG-0002.toml"), path("alone.toml"));
    all += &succeeds(&["drift", &log, "--calibration", &one, "--out", &alone]);
    assert_eq!(of("new-FOG-0002.toml").gyro, of("alone.toml").gyro);
    assert!(
        of("new-FOG-0001.toml").gyro.sensor[0].drift.is_some()
            && Path::new(&path("drift-FOG-0001.html")).exists()
    );
    // What is read is not replaced, though it may be.
    std::fs::remove_file(&alone).unwrap();
    let here = folder.path().to_str().unwrap();
    all += &told(folder.path(), &["drift", &log, "--calibration", here, "--out", &out, "--overwrite"]);
    // Raw readings need no document; a unit without one does not stop the other.
    let part = ["drift", &log, "--duration", "300"];
    assert_eq!(units(&json(&[&part[..], &["--json"]].concat())), UNITS);
    std::fs::remove_file(&one).unwrap();
    all += &told(folder.path(), &[&part[..], &["--calibration", &documents]].concat());
    all += &told(folder.path(), &[&part[..], &["--out", &out]].concat());
    insta::assert_snapshot!(all.replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn both_put_down_by_hand_end_with_one_table() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (log, _) = both(folder.path(), |seed, _| tumbled_log(16, seed));
    let gravity = GRAVITY.to_string();
    let fit = ["tumble", &log, "--gravity", &gravity, "--accelerometer-unit", "m/s2"];
    let said = succeeds(&[&fit[..], &["--out", &path("new.toml"), "--html", &path("new.html")]].concat());
    for unit in UNITS {
        assert_eq!(
            Written::read(&folder.path().join(format!("new-{unit}.toml"))).unwrap().document.unit,
            unit
        );
        assert!(Path::new(&path(&format!("new-{unit}.html"))).exists());
    }
    // By itself, started from its own document: what is found does not depend on the company.
    let alone = path("alone.toml");
    succeeds(&[&fit[..], &["--unit", UNITS[1], "--out", &alone]].concat());
    let accel = |name: &str| Written::read(&folder.path().join(name)).unwrap().document.accel;
    assert_eq!(accel("alone.toml"), accel("new-FOG-0002.toml"));
    let said = said + &succeeds(&[&fit[..], &["--calibration", &alone]].concat());
    insta::assert_snapshot!(said.replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn both_on_a_table_are_fitted_and_one_document_takes_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (log, _) =
        both(folder.path(), |seed, _| modes_rates::events(&table(seed, [0.0, 0.0, 1.0], &[36.0, -36.0])));
    let fit = "--axis z --rates 36,-36 --latitude 55.75 --heading 30 --pitch 0 --roll 0 --json";
    let fit: Vec<&str> = ["rates", &log].into_iter().chain(fit.split(' ')).collect();
    assert_eq!(units(&json(&[&fit[..], &["--out", &path("new.toml")]].concat())), UNITS);
    let alone = json(&[&fit[..], &["--calibration", &path("new-FOG-0001.toml")]].concat());
    assert_eq!(alone["unit"], "FOG-0001");
    let warnings = format!("{:#}", alone["warnings"]);
    insta::assert_snapshot!(warnings.replace(folder.path().to_str().unwrap(), "FOLDER"));
}

#[test]
fn both_at_rest_are_judged_by_a_folder_and_one_by_its_own_document() {
    let folder = tempfile::tempdir().unwrap();
    let (log, documents) = both(folder.path(), at_rest(1500.0));
    let (code, said, _) = words(&calibrate(&["validate", &documents, &log, "--json"]));
    assert!(matches!(code, Some(0 | 1)));
    assert_eq!(units(&serde_json::from_str(&said).unwrap()), UNITS);
    let one = format!("{documents}/FOG-0001.toml");
    let (code, said, _) = words(&calibrate(&["validate", &one, &log, "--json"]));
    assert!(matches!(code, Some(0 | 1)));
    let report: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(report["unit"], "FOG-0001");
    // Of its own unit, half an hour is too short for a calibration and a voyage.
    let refused = fails(&["impact", &log, "--calibration", &one, "--calibration-hours", "0.5"], 1);
    let told = format!("{:#}\n{refused}", report["warnings"]);
    insta::assert_snapshot!(told.replace(folder.path().to_str().unwrap(), "FOLDER"));
}
