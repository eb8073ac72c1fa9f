//! Overlays by themselves, on their base, and as candidates.

use isotherm_correction::thermal::Feature;

use super::*;
use crate::digest::Digest;
use crate::document::{Document, Parsed, difference};

const FULL: &str = include_str!("../../../config/calibration/example-full.toml");
const OVERLAY: &str = "schema = 1
overlay_of = \"BASE\"
unit = \"EXAMPLE-0001\"
created = 2026-11-22T06:10:00Z
note = \"Hangar 2.\"

[[gyro]]
name = \"x\"
static_bias_change_deg_per_h = 0.031
static_bias_sigma_deg_per_h = 0.004
magnetic_bias_change_deg_per_h = -0.012
magnetic_bias_sigma_deg_per_h = 0.005

[[gyro]]
name = \"y\"
static_bias_change_deg_per_h = -0.02
static_bias_sigma_deg_per_h = 0.004

[pre_launch]
latitude_deg = 55.0
heading_deg = 90.0
pitch_roll_deg = [1.5, -0.5]
duration_s = 600.0
start_ns = 1000000000
end_ns = 601000000000
mean_temperature_deg_c = [31.5, 31.25, 31.0, 30.5]
";

fn digest(text: &str) -> Digest {
    Digest::of(text.as_bytes())
}

/// The overlay for a base.
fn overlay_of(base: &str) -> String {
    OVERLAY.replacen("BASE", &digest(base).to_string(), 1)
}

#[track_caller]
fn base(text: &str) -> Parsed {
    Document::parse(text, None).unwrap_or_else(|problems| panic!("{}", listed(&problems)))
}

fn listed(problems: &[Problem]) -> String {
    problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

#[track_caller]
fn candidate(text: &str, base: Option<&str>) -> Candidate {
    Candidate::parse(text, Some("field.toml"), base)
        .unwrap_or_else(|problems| panic!("{}", listed(&problems)))
}

#[track_caller]
fn refuse(text: &str, base: Option<&str>) -> Vec<Problem> {
    match Candidate::parse(text, Some("field.toml"), base) {
        Ok(_) => panic!("not refused:\n{text}"),
        Err(problems) => problems,
    }
}

#[test]
fn the_changes_are_added_to_all_of_a_curve_and_nothing_else_changes() {
    let text = overlay_of(FULL);
    let made = candidate(&text, Some(FULL));
    let changes = difference(&base(FULL).document, &made.document);
    let words: Vec<_> = changes.iter().map(|change| (change.key.as_str(), change.after.as_deref())).collect();
    assert_eq!(words[0], ("gyro.sensor[0].static_bias.coefficients_deg_per_h[0]", Some("1.315")));
    assert_eq!(words[1], ("gyro.sensor[0].magnetic_bias.coefficients_deg_per_h[0]", Some("3.398")));
    for (i, (knot, before)) in words[2..7].iter().zip([-0.91, -0.62, -0.55, -0.71, -1.02]).enumerate() {
        assert_eq!(knot.0, format!("gyro.sensor[1].static_bias.knots_deg_per_h[{i}][1]"));
        let after: f64 = knot.1.unwrap().parse().unwrap();
        assert!((after - (before - 0.02)).abs() < 1e-15, "{after}");
    }
    assert_eq!(words.len(), 2 + 5 + 1 + 2, "{words:?}");
    assert_eq!(words[7], ("created", Some("2026-11-22T06:10:00Z")));
    assert!(words[8..].iter().all(|(key, _)| key.starts_with("origin.details.overlays[0].")), "{words:?}");
}

#[test]
fn a_bias_that_the_base_leaves_out_becomes_a_constant() {
    let mut document = base(FULL).document;
    document.gyro.sensor[0].set(Feature::One, None);
    document.gyro.sensor[0].set(Feature::LasingMode, None);
    document.origin = None;
    let bare = document.to_toml().unwrap();
    let made = candidate(&overlay_of(&bare), Some(&bare)).document;
    let text: toml::Table = made.to_toml().unwrap().parse().unwrap();
    for (bias, value) in [("static_bias", 0.031), ("magnetic_bias", -0.012)] {
        let constant = format!("kind = \"constant\"\nvalue_deg_per_h = {value}");
        assert_eq!(text["gyro"]["sensor"][0][bias].as_table(), Some(&constant.parse().unwrap()));
    }
    assert!(made.origin.unwrap().details.unwrap().contains_key("overlays"));
}

#[test]
fn taken_back_it_leaves_the_base_as_it_was() {
    let text = overlay_of(FULL);
    let made = candidate(&text, Some(FULL));
    let reverted = candidate(FULL, Some(&made.text));
    assert_eq!(reverted.digest, made.base_digest);
    assert_eq!((reverted.text.as_str(), reverted.overlay), (FULL, None));
    assert_eq!(difference(&base(FULL).document, &reverted.document), []);
    assert_eq!(reverted.calibration, base(FULL).calibration);

    // The opposite changes, made to the result, lead back to the numbers, but for the last digit.
    let opposite = OVERLAY
        .replacen("change_deg_per_h = 0.031", "change_deg_per_h = -0.031", 1)
        .replacen("change_deg_per_h = -0.012", "change_deg_per_h = 0.012", 1)
        .replacen("change_deg_per_h = -0.02\n", "change_deg_per_h = 0.02\n", 1)
        .replacen("BASE", &made.digest.to_string(), 1);
    let back = candidate(&opposite, Some(&made.text));
    for change in difference(&base(FULL).document, &back.document) {
        let number = |text: Option<String>| text.and_then(|text| text.parse::<f64>().ok());
        if let (Some(before), Some(after)) = (number(change.before), number(change.after)) {
            assert!((before - after).abs() < 1e-15, "{}", change.key);
        } else {
            let about = change.key == "created" || change.key.starts_with("origin.details.overlays[");
            assert!(about, "{}", change.key);
        }
    }
    let overlays = &back.document.origin.unwrap().details.unwrap()["overlays"];
    assert_eq!(overlays.as_array().map(Vec::len), Some(2));
}

#[test]
fn the_revision_names_base_and_overlay_and_is_the_same_every_time() {
    let text = overlay_of(FULL);
    let (made, again) = (candidate(&text, Some(FULL)), candidate(&text, Some(FULL)));
    assert_eq!(made, again);
    assert_eq!(made.digest, digest(&made.text));
    assert_eq!(made.base_digest, digest(FULL));
    let overlay = made.overlay.as_ref().unwrap();
    assert_eq!(overlay.digest, digest(&text));
    assert!(
        made.text.contains(&overlay.digest.to_string()) && made.text.contains(&made.base_digest.to_string())
    );
    // The text that stands for it is a document like any other.
    let plain = candidate(&made.text, None);
    assert_eq!(
        (plain.digest, plain.base_digest, plain.calibration),
        (made.digest, made.digest, made.calibration)
    );
    let other = candidate(&text.replacen("0.031", "0.032", 1), Some(FULL));
    assert_ne!(other.digest, made.digest);
}

#[test]
fn a_wrong_base_is_refused_with_what_to_do() {
    let text = overlay_of(FULL);
    let problems = refuse(&text, None);
    let other = FULL.replacen("# Every key", "# every key", 1);
    let told = format!("{}\n{}", listed(&problems), listed(&refuse(&text, Some(&other))));
    // The digests are those of the shipped example.
    let told =
        told.replace(&digest(FULL).to_string(), "ITS-BASE").replace(&digest(&other).to_string(), "IN-FORCE");
    insta::assert_snapshot!(told);

    let problems = refuse(&overlay_of("schema = 1"), Some("schema = 1"));
    assert!(problems.iter().all(|problem| problem.file.as_deref() == Some("document in force")));
}

#[test]
fn what_does_not_fit_the_base_is_told_at_once_with_its_place() {
    let single_mode = {
        let mut document = base(FULL).document;
        document.mode_reversal = None;
        document.gyro.sensor.iter_mut().for_each(|sensor| {
            sensor.set(Feature::LasingMode, None);
            sensor.servo = None;
        });
        document.to_toml().unwrap()
    };
    let text = overlay_of(&single_mode)
        .replacen("EXAMPLE-0001", "EXAMPLE-0002", 1)
        .replacen("name = \"y\"", "name = \"yy\"", 1)
        .replacen(", 30.5]", "]", 1);
    let problems = refuse(&text, Some(&single_mode));
    insta::assert_snapshot!(listed(&problems));
}

/// An overlay that is broken in one place: text to replace, replacement, text on the line of the problem, key.
type Case = (&'static str, &'static str, &'static str, &'static str);

const BROKEN: [Case; 19] = [
    ("schema = 1", "schema = = 1", "schema", ""),
    ("schema = 1", "schema = 2", "schema", "schema"),
    ("schema = 1\n", "", "overlay_of", "schema"),
    ("\"BASE\"", "\"27FB\"", "overlay_of", "overlay_of"),
    ("EXAMPLE-0001", "EXAMPLE/0001", "unit", "unit"),
    ("2026-11-22T06:10:00Z", "\"today\"", "created", "created"),
    ("note =", "colour =", "colour", "colour"),
    ("name = \"x\"", "name = \"\"", "name = \"\"", "gyro[0].name"),
    ("name = \"y\"", "name = \"x\"", "name = \"x\"\nstatic_bias_change_deg_per_h = -0.02", "gyro[1].name"),
    ("= 0.031", "= \"0.031\"", "0.031", "gyro[0].static_bias_change_deg_per_h"),
    ("= 0.031", "= nan", "= nan", "gyro[0].static_bias_change_deg_per_h"),
    ("= 0.004", "= -0.004", "= -0.004", "gyro[0].static_bias_sigma_deg_per_h"),
    ("static_bias_sigma_deg_per_h = 0.004\n", "", "[[gyro]]", "gyro[0].static_bias_sigma_deg_per_h"),
    ("magnetic_bias_sigma_deg_per_h = 0.005\n", "", "[[gyro]]", "gyro[0].magnetic_bias_sigma_deg_per_h"),
    (
        "static_bias_change_deg_per_h",
        "static_bias_change",
        "static_bias_change =",
        "gyro[0].static_bias_change",
    ),
    ("latitude_deg = 55.0", "latitude_deg = 95.0", "95.0", "pre_launch.latitude_deg"),
    ("[1.5, -0.5]", "[1.5]", "[1.5]", "pre_launch.pitch_roll_deg"),
    ("start_ns = 1000000000", "start_ns = 1.5", "start_ns", "pre_launch.start_ns"),
    ("end_ns = 601000000000", "end_ns = 6", "end_ns", "pre_launch.end_ns"),
];

#[test]
fn each_error_is_told_with_its_line_key_and_limit() {
    let mut told = String::new();
    for (from, to, at, key) in BROKEN {
        assert!(OVERLAY.contains(from), "{from}");
        let text = OVERLAY.replacen(from, to, 1).replacen("BASE", &"0f".repeat(32), 1);
        let problems = Overlay::parse(&text, Some("field.toml")).unwrap_err();
        let line = text[..text.find(at).unwrap_or_else(|| panic!("{at}"))].matches('\n').count() + 1;
        let found = problems.iter().any(|p| p.key == key && p.line == line);
        assert!(found, "no problem at line {line}, {key:?} in\n{}", listed(&problems));
        assert!(problems.len() <= 2, "one error, but\n{}", listed(&problems));
        // The one way in says the same, before it looks at any base.
        assert_eq!(refuse(&text, None).len(), problems.len(), "{key}");
        told += &(listed(&problems) + "\n");
    }
    insta::assert_snapshot!(told);
}

#[test]
fn both_kinds_are_told_apart() {
    assert!(is_overlay(&overlay_of(FULL)));
    assert!(is_overlay("schema = = 1\noverlay_of = 3\n"));
    assert!(!is_overlay(FULL));
    assert!(!is_overlay("[origin.details]\noverlay_of = \"x\"\n"));
    assert!(!is_overlay(""));
}

#[test]
fn what_is_written_is_read_back() {
    let text = overlay_of(FULL);
    let first = Overlay::parse(&text, None).unwrap();
    let written = first.overlay.to_toml().unwrap();
    assert_eq!(Overlay::parse(&written, None).unwrap().overlay, first.overlay);
}

#[test]
fn one_overlay_after_another_does_what_both_do() {
    let first = candidate(&overlay_of(FULL), Some(FULL));
    let second_text = OVERLAY
        .replacen("= 0.031", "= 0.25", 1)
        .replacen("name = \"y\"", "name = \"z\"", 1)
        .replacen("BASE", &first.digest.to_string(), 1);
    let second = candidate(&second_text, Some(&first.text));
    let (one, two) = (&first.overlay.as_ref().unwrap().overlay, &second.overlay.as_ref().unwrap().overlay);
    let both = two.after(one);
    assert_eq!(both.overlay_of, digest(FULL).to_string());
    assert_eq!(both.gyro[0].magnetic_bias_sigma_deg_per_h, Some(0.005));
    let both = candidate(&both.to_toml().unwrap(), Some(FULL));
    for change in difference(&second.document, &both.document) {
        let about = change.key.starts_with("origin.details.overlays[");
        let number = |text: &Option<String>| text.as_ref().and_then(|text| text.parse::<f64>().ok());
        let dust =
            number(&change.before).zip(number(&change.after)).is_some_and(|(a, b)| (a - b).abs() < 1e-15);
        assert!(about || dust, "{}", change.words());
    }
}
