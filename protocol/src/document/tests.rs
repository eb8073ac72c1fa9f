//! Tests of the document as a whole.

mod broken;
mod keys;
mod published;
mod reference;
mod robust;
mod units;

use isotherm_correction::calibration::{CoefficientParts, TermParts};
use isotherm_correction::curve::{Curve, CurveParts};
use isotherm_correction::thermal::Feature;
use isotherm_correction::units::STANDARD_GRAVITY_M_PER_S2;

use super::{Document, Parsed, Problem, problem_at};

/// The document that shows every key.
pub(super) const FULL: &str = include_str!("../../../config/calibration/example-full.toml");
/// The same for the keys that exclude others: mean rate, volts, no temperature channels.
pub(super) const OTHER: &str = include_str!("tests/other.toml");

/// Parses a document that must hold.
#[track_caller]
pub(super) fn accept(text: &str) -> Parsed {
    match Document::parse(text, Some("test.toml")) {
        Ok(parsed) => parsed,
        Err(problems) => panic!("refused:\n{}", listed(&problems)),
    }
}

/// Parses a document that must be refused.
#[track_caller]
fn refuse(text: &str) -> Vec<Problem> {
    match Document::parse(text, Some("test.toml")) {
        Ok(_) => panic!("not refused:\n{text}"),
        Err(problems) => problems,
    }
}

fn listed(problems: &[Problem]) -> String {
    problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

#[test]
fn the_examples_hold_and_raise_no_warnings() {
    for text in [FULL, OTHER] {
        let parsed = accept(text);
        assert_eq!(listed(&parsed.warnings), "");
    }
}

#[test]
fn a_problem_stands_at_its_key_or_at_what_is_around_it() {
    let text =
        "# unit = \"no\"\nschema = 1\n  unit   = \"A\"\n[gyro]\ncreated = 1\n[[gyro.sensor]]\nname = \"x\"\n";
    let place = |key| {
        let problem = problem_at(text, "f", key, String::new());
        (problem.line, problem.column)
    };
    assert_eq!(["unit", "gyro.sensor[0].name"].map(place), [(3, 12), (7, 8)]);
    assert_eq!(["created", ""].map(place), [(1, 1); 2], "that of a table is another key");
    assert_eq!(place("gyro.sensor[0].static_bias").0, 6);
}

#[test]
fn every_document_in_config_holds() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration");
    let mut checked = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            let bytes = std::fs::read(&path).unwrap();
            if let Err(problems) = Document::parse_bytes(&bytes, path.to_str()) {
                panic!("{}", listed(&problems));
            }
            assert!(bytes.starts_with(b"#:schema ../calibration.schema.json\n"), "{}", path.display());
            checked += 1;
        }
    }
    assert!(checked > 0);
}

#[test]
fn what_is_written_is_read_back() {
    for text in [FULL, OTHER] {
        let first = accept(text);
        let written = first.document.to_toml().unwrap();
        let second = accept(&written);
        assert_eq!(first.document, second.document, "{written}");
        assert_eq!(first.calibration, second.calibration);
        assert_ne!(first.digest, second.digest);
        assert_eq!(second.document.to_toml().unwrap(), written);
    }
}

/// The curve of a term.
fn term(terms: &[TermParts], feature: Feature) -> &CurveParts {
    let term = terms.iter().find(|term| term.feature == feature).unwrap();
    match &term.coefficient {
        CoefficientParts::Curve(curve) => curve,
        other @ CoefficientParts::Branched(_) => panic!("{other:?}"),
    }
}

#[test]
fn units_become_si() {
    let parts = accept(FULL).document.to_parts();
    let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-12 * b.abs(), "{a} {b}");
    let rad_per_s = |deg_per_h: f64| deg_per_h.to_radians() / 3600.0;
    let x = &parts.gyros[0];
    close(x.increment_weight, (0.9837_f64 / 3600.0).to_radians());
    let trend = x.trend.as_ref().unwrap();
    close(trend.coefficients[2], rad_per_s(0.0017) / (3600.0 * 3600.0));
    close(trend.interval_s[1], 21600.0);
    close(parts.gyro_orientation.slopes_per_deg_c[0][1], (0.12_f64 / 3600.0).to_radians());
    close(parts.gyro_orientation.parity_limit.unwrap(), rad_per_s(20.0));
    match term(&x.terms, Feature::Reading) {
        CurveParts::Polynomial { coefficients, .. } => {
            close(coefficients[1], 0.42e-6);
        }
        other => panic!("{other:?}"),
    }
    match parts.accels[0].board_ratio.as_ref().unwrap() {
        CurveParts::Polynomial { coefficients, .. } => {
            close(coefficients[0], 1.0);
            close(coefficients[1], 8.4e-6);
        }
        other => panic!("{other:?}"),
    }
    let drift = x.drift.as_ref().unwrap();
    close(drift.sigma_rad_per_s, rad_per_s(0.0035));
    close(drift.correlation_time_s, 32400.0);
    close(drift.trend_sigma_rad_per_s2, rad_per_s(0.00012) / 3600.0);
    // Over one hour an angle random walk of N °/√h gives N °: over one second a sixtieth of that.
    close(drift.angle_random_walk_rad_per_sqrt_s, 0.006_f64.to_radians() / 60.0);
    let other = accept(OTHER).document.to_parts();
    close(other.gyros[0].input_limit, 400_f64.to_radians());
}

#[test]
fn doubts_are_warnings() {
    let single_mode = OTHER.split("[mode_reversal]\n").next().unwrap().to_owned();
    let doubtful = [
        FULL.replacen("smoothing_s = 20.0", "smoothing_s = 20.4", 1),
        FULL.replacen("channel = \"coil\"\n", "", 1),
        FULL.replacen("range_deg_c = [-65.0, 110.0]", "range_deg_c = [-30.0, 60.0]", 1),
        single_mode,
    ];
    insta::assert_snapshot!(doubtful.map(|text| listed(&accept(&text).warnings)).join("\n\n"));
}

#[test]
fn bytes_that_are_no_text_are_placed() {
    let mut bytes = FULL.as_bytes().to_vec();
    let at = FULL.find("unit =").unwrap();
    bytes[at + 8] = 0xff;
    let problems = Document::parse_bytes(&bytes, None).unwrap_err();
    assert_eq!((problems.len(), problems[0].column), (1, 9));
    assert_eq!(problems[0].line, FULL[..at].matches('\n').count() + 1);
}

#[test]
fn problems_are_serialised_field_by_field() {
    let problem = &refuse("schema = 2")[0];
    let json = serde_json::to_value(problem).unwrap();
    insta::assert_snapshot!(json);
}

#[test]
fn correcting_the_board_before_the_bias_would_differ_by_eight_micrograms_at_most() {
    // 001 has f = (U·r − S)/K, the corrector (U − S)·r/K: apart by S·(r − 1)/K, whatever the input.
    let text = include_str!("../../../config/calibration/ZLG-0001.toml");
    let parts = accept(text).document.to_parts();
    let mut largest = 0.0_f64;
    for accel in &parts.accels {
        let curve = |parts: &CurveParts| Curve::new(parts).unwrap();
        let (scale, bias) = (curve(&accel.scale_factor), curve(term(&accel.terms, Feature::One)));
        let ratio = curve(accel.board_ratio.as_ref().unwrap());
        for (sensor, board) in (-40..=70).flat_map(|sensor| (-40..=85).map(move |board| (sensor, board))) {
            let [sensor, board] = [sensor, board].map(f64::from);
            let apart = bias.at(sensor).value * (ratio.at(board).value - 1.0) / scale.at(sensor).value;
            largest = largest.max(apart.abs() / STANDARD_GRAVITY_M_PER_S2);
        }
    }
    assert!((5e-6..8e-6).contains(&largest), "{largest} g");
}
