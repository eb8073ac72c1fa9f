//! Broken documents: what is said about each, and where.

mod relations;
mod values;

use super::{FULL, Problem, listed, refuse};

/// A document that is broken in one place: name, text to replace (its first occurrence), replacement, text that stands
/// on the line of the problem after the edit, key, part of the message.
type Case = (&'static str, &'static str, &'static str, &'static str, &'static str, &'static str);

/// The mode reversal of the full document.
const MODE_REVERSAL: &str = "[mode_reversal]
transition_ticks = 3
predict_readings = 4
predict_degree = 1
fit_readings_before = 2
fit_readings_after = 2
fit_degree = 2
";

/// Line of the first occurrence, from 1.
fn line_of(text: &str, part: &str) -> usize {
    let at = text.find(part).unwrap_or_else(|| panic!("{part:?} is not in the text"));
    text[..at].matches('\n').count() + 1
}

#[test]
fn each_error_is_told_with_its_line_key_and_limit() {
    for (name, from, to, at, key, message) in values::CASES.into_iter().chain(relations::CASES) {
        assert!(FULL.contains(from), "{name}: {from:?} is not in the document");
        let text = &FULL.replacen(from, to, 1);
        let problems = refuse(text);
        let line = line_of(text, at);
        let found = problems.iter().any(|p| p.key == key && p.line == line && p.message.contains(message));
        assert!(found, "{name}: no problem at line {line}, {key:?}, {message:?} in\n{}", listed(&problems));
        // A key that is taken for another one is missing as well, and what needs it may say so.
        assert!(problems.len() <= 3, "{name}: one error, but\n{}", listed(&problems));
    }
}

#[test]
fn axes_in_one_plane_are_refused() {
    let start = FULL.find("[gyro.orientation]").unwrap();
    let end = FULL.find("[gyro.orientation.thermal]").unwrap();
    let rows = "[gyro.orientation]\nrows = [[1, 0, 0], [0, 1, 0], [0.6, 0.8, 0], [0.8, 0.6, 0]]\n\n";
    let problems = refuse(&format!("{}{rows}{}", &FULL[..start], &FULL[end..]));
    let about_rows =
        |p: &Problem| p.key == "gyro.orientation.rows" && p.message.contains("at most 100 is allowed");
    assert!(problems.iter().all(about_rows), "{}", listed(&problems));
}

#[test]
fn errors_of_every_kind_are_told_at_once_in_the_order_of_the_text() {
    let mut text = FULL.to_owned();
    for (from, to) in [
        ("grid_step_s = 1.0", "grid_step_s = -1.0"),
        ("smoothing_s = 20.0", "smoothing_s = 20.0\nsmoothing_s = 30.0"),
        ("spike_limit_deg_c = 2.0", "spike_limit = 2.0"),
        ("name = \"y\"", "nmae = \"y\""),
        ("value_deg_per_h = -0.047", "value_deg_per_h = \"small\""),
        ("[0.0, 0.12], [25.0", "[0.0, 0.12], [-25.0"),
        ("channel = \"coil\"", "channel = \"foil\""),
        ("[0.0005, -0.0004, 0.9999998]", "[0.0005, -0.0004, 0.99]"),
        ("[70.0, 1018.9]", "[70.0, -1018.9]"),
        ("predict_readings = 4", "predict_readings = 1"),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    let problems = refuse(&text);
    let keys: Vec<_> = problems.iter().map(|problem| problem.key.as_str()).collect();
    let expected = [
        "temperature.filter.grid_step_s",
        "",
        "temperature.channel[1].spike_limit_deg_c",
        "temperature.channel[1].spike_limit",
        "gyro.sensor[1].name",
        "gyro.sensor[1].nmae",
        "gyro.sensor[1].slow_meander.value_deg_per_h",
        "gyro.sensor[2].static_bias.knots_deg_per_h[2]",
        "gyro.sensor[3].channel",
        "gyro.orientation.rows[2]",
        "accel.sensor[1].scale_factor",
        "mode_reversal.predict_degree",
    ];
    assert_eq!(keys, expected, "{}", listed(&problems));
}

#[test]
fn nothing_is_said_about_stand_ins() {
    // Each is one error, however much hangs on it.
    for (from, to, key) in [
        ("grid_step_s = 1.0", "grid_step_s = 0", "temperature.filter.grid_step_s"),
        ("name = \"block\" ", "name = 5 ", "temperature.channel[0].name"),
        ("predict_readings = 4", "predict_readings = 0", "mode_reversal.predict_readings"),
        ("rows = [\n", "rows = [ 7,\n", "gyro.orientation.rows"),
        ("output = \"counts\"", "output = 1", "gyro.output"),
        (
            "scale_factor = { kind = \"piecewise-linear\"",
            "scale_factor = { kind = \"pw\"",
            "accel.sensor[1].scale_factor.kind",
        ),
    ] {
        let problems = refuse(&FULL.replacen(from, to, 1));
        assert!(problems.iter().all(|problem| problem.key.starts_with(key)), "{key}:\n{}", listed(&problems));
    }
    let output = FULL.replacen(
        "output = \"counts\"                         # or \"V\"",
        "output = \"mV\" # or \"V\"",
        1,
    );
    let problems = refuse(&output);
    assert_eq!(problems.len(), 1, "{}", listed(&problems));
    assert_eq!(problems[0].key, "accel.output");
}

#[test]
fn an_empty_document_asks_for_its_four_parts() {
    let keys: Vec<_> = refuse("").into_iter().map(|problem| problem.key).collect();
    assert_eq!(keys, ["schema", "unit", "temperature", "gyro"]);
}
