//! `show`, `diff` and `merge`, as their user calls them.

use std::path::Path;

use isotherm_calibration::document::Written;
use isotherm_calibration::document::show::show;
use isotherm_correction::thermal::Feature;
use isotherm_pages::{Content, Ink};
use isotherm_protocol::document::{Curve, Document, Measure, Origin, Residual, Sample, Shape};
use serde_json::Value;

use crate::command::{calibrate, headings, json, shipped, succeeds, told};

fn save(path: &str, change: impl FnOnce(&mut Document)) {
    let mut document = Written::read(&shipped("MEMS-0001.toml")).unwrap().document;
    change(&mut document);
    Written::of(&document).unwrap().save(Path::new(path), true).unwrap();
}

#[test]
fn every_document_that_is_shipped_can_be_shown() {
    let pages = tempfile::tempdir().unwrap();
    let html = pages.path().join("page.html").display().to_string();
    let mut told = Vec::new();
    for entry in std::fs::read_dir(shipped("")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let path = path.display().to_string();
        let output = calibrate(&["show", &path, "--html", &html, "--overwrite"]);
        assert!(output.status.success(), "{path}: {}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8(output.stdout).unwrap();
        let page = std::fs::read_to_string(&html).unwrap();
        let first = text.lines().next().unwrap();
        assert!(page.contains(first.trim_end_matches('.')), "{first}");
        told.push(format!("{first}\n{}", headings(&html)));
    }
    told.sort();
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn shown_values_are_those_of_the_document() {
    let path = shipped("example-full.toml").display().to_string();
    let shown = json(&["show", &path, "--json"]);
    assert_eq!(shown["document"]["unit"], "EXAMPLE-0001");
    let terms = shown["terms"].as_array().unwrap();
    let of = |sensor: &str, name: &str| {
        let mine = |term: &&Value| term["sensor"] == sensor && term["term"] == name && term["kind"] == "gyro";
        terms.iter().find(mine).unwrap()
    };
    let bias = of("x", "static_bias");
    for point in bias["points"].as_array().unwrap() {
        let [t, value] = [0, 1].map(|index| point[index].as_f64().unwrap());
        let tau = t.clamp(-40.0, 70.0) - 25.0;
        assert!((value - (1.284 - 0.0131 * tau + 0.00021 * tau * tau)).abs() < 1e-9, "{point}");
    }
    assert_eq!(of("s", "lag of 45 s")["unit"], "(°/h)/(°C/s)");
    assert_eq!(of("s", "thermal_rate run-up")["argument"], "°C/s");
    let rows = shown["tables"]["Terms"]["rows"].as_array().unwrap();
    insta::assert_snapshot!(rows.iter().map(|row| row.to_string() + "\n").collect::<String>());
}

#[test]
fn a_sensor_has_one_colour_whichever_terms_it_has() {
    let shown = show(&Written::read(&shipped("example-full.toml")).unwrap()).unwrap();
    let of_gyros = shown.charts.iter().filter(|(heading, _)| heading.starts_with("Gyros over"));
    let curves = of_gyros.flat_map(|(_, chart)| &chart.panels).filter_map(|panel| match &panel.content {
        Content::Series(curves) => Some(curves),
        Content::Lanes(_) => None,
    });
    let lone: Vec<_> = curves.clone().filter(|curves| curves.len() == 1).flatten().collect();
    assert!(lone.iter().any(|curve| curve.name == "s"), "{lone:?}");
    for (name, ink) in [("x", Ink::First), ("y", Ink::Second), ("z", Ink::Third), ("s", Ink::Fourth)] {
        let mut own = curves.clone().flatten().filter(|curve| curve.name == name);
        assert!(own.all(|curve| curve.ink == ink), "{name}");
    }
}

#[test]
fn diff_tells_what_has_changed() {
    let files = tempfile::tempdir().unwrap();
    let path = |name: &str| files.path().join(name).display().to_string();
    save(&path("before.toml"), |_| ());
    save(&path("after.toml"), |document| {
        document.accel.as_mut().unwrap().orientation.rows[2][0] += 50.0 / 206_265.0;
        document.gyro.sensor[0].set(Feature::One, Curve::new(Shape::Constant { value: 9.0 }));
    });
    let (before, after, html) = (path("before.toml"), path("after.toml"), path("diff.html"));
    let changes = json(&["diff", &before, &after, "--axis-sigma", "5", "--json", "--html", &html]);
    let axis =
        changes["axes"].as_array().unwrap().iter().find(|axis| axis["of"] == "accelerometer z").unwrap();
    assert!((axis["turned_arcsec"].as_f64().unwrap() - 50.0).abs() < 0.1, "{axis}");
    assert!((axis["significance"].as_f64().unwrap() - 50.0 / 50.0_f64.sqrt()).abs() < 0.1, "{axis}");
    let verdict = changes["verdict"].as_str().unwrap();
    let of_same = told(files.path(), &["diff", &before, &before]);
    insta::assert_snapshot!([verdict, &headings(&html), &of_same].join("\n"));
    let [brief, all] =
        [&[][..], &["--all"]].map(|all| succeeds(&[&["diff", &before, &after][..], all].concat()));
    let moved = "accel.orientation.rows[2]";
    assert!(brief.lines().count() < 20 && !brief.contains(moved) && all.contains(moved), "{brief}\n{all}");
    assert_eq!(calibrate(&["diff", &before, &after, "--axis-sigma", "-1"]).status.code(), Some(2));
}

#[test]
fn merge_puts_parts_together_or_says_what_is_in_the_way() {
    let files = tempfile::tempdir().unwrap();
    let path = |name: &str| files.path().join(name).display().to_string();
    let bias = |value: f64| {
        move |document: &mut Document| {
            document.gyro.sensor[0].set(Feature::One, Curve::new(Shape::Constant { value }));
        }
    };
    let axes =
        |document: &mut Document| document.accel.as_mut().unwrap().orientation.rows[0] = [1.0, 2e-5, 0.0];
    let residual = Residual {
        of: "gyro.x".into(),
        sample: Sample::Out,
        measure: Measure::DegPerH,
        rms_before: 90.0,
        rms_after: 1.25,
        peak_to_peak_before: Some(300.0),
        peak_to_peak_after: Some(5.5),
    };
    let fitted = |document: &mut Document| {
        bias(4.0)(document);
        document.origin =
            Some(Origin { method: Some("joint".into()), residual: vec![residual], ..Origin::default() });
    };
    save(&path("base.toml"), |_| ());
    save(&path("thermal.toml"), fitted);
    save(&path("other.toml"), bias(5.0));
    save(&path("positions.toml"), axes);
    let (base, thermal, other, positions, new) = (
        path("base.toml"),
        path("thermal.toml"),
        path("other.toml"),
        path("positions.toml"),
        path("new.toml"),
    );
    let merged = json(&["merge", &base, &thermal, &positions, "--out", &new, "--json"]);
    assert_eq!(merged["taken"]["gyro.sensor.x.static_bias"], "thermal.toml");
    assert_eq!(merged["taken"]["accel.orientation.rows"], "positions.toml");
    let mut expected = Written::read(Path::new(&base)).unwrap().document;
    bias(4.0)(&mut expected);
    axes(&mut expected);
    let document = Written::read(Path::new(&new)).unwrap().document;
    assert_eq!((&document.gyro, &document.accel), (&expected.gyro, &expected.accel));
    // What each part says of itself is shown, and it is that part's.
    let rows = |name: &str, heading: &str| -> Vec<Value> {
        let mut shown = json(&["show", name, "--json"]);
        serde_json::from_value(shown["tables"][heading]["rows"].take()).unwrap()
    };
    let parts = [rows(&new, "Parts"), rows(&new, "Residuals as stated by each part")].concat();
    let parts: String = parts.iter().map(|row| row.to_string() + "\n").collect();
    // A merged document goes into the next merge, with all that it says of itself.
    let again = path("again.toml");
    let twice = calibrate(&["merge", &new, &base, "--out", &again]);
    assert!(twice.status.success(), "{}", String::from_utf8_lossy(&twice.stderr));
    assert!(rows(&again, "Parts").iter().any(|part| part[0] == "new.toml / positions.toml"));
    // Never over a file that is there, nor with a conflict.
    let arguments = ["merge", &base, &thermal, &other, "--out", &path("conflict.toml")];
    insta::assert_snapshot!(parts + &told(files.path(), &arguments));
    assert!(!Path::new(&path("conflict.toml")).exists());
    let decided = calibrate(&[&arguments[..], &["--take", "gyro.sensor.x=other.toml"]].concat());
    assert!(decided.status.success(), "{}", String::from_utf8_lossy(&decided.stderr));
    assert_eq!(calibrate(&["merge", &base, &thermal, "--out", &new]).status.code(), Some(2));
    assert_eq!(calibrate(&["merge", &base, &base, "--out", &path("x.toml")]).status.code(), Some(2));
}
