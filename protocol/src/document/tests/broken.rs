//! Broken documents: what is said about each, and where.

mod relations;
mod values;

use isotherm_correction::reversal::{FitWindow, ReversalParts, Transition};

use super::{FULL, accept, listed, refuse};

/// A document that is broken in one place: name, text to replace (its first occurrence), replacement, text that stands
/// on the line of the problem after the edit, key.
type Case = (&'static str, &'static str, &'static str, &'static str, &'static str);

/// The mode reversal of the full document.
const MODE_REVERSAL: &str = "[mode_reversal]
transition_ticks = 3                      # or transition_s = 0.015, where the ticks are not always as long
predict_readings = 4
predict_degree = 1
fit_readings_before = 2
fit_readings_after = 2
fit_degree = 2
fit_window = \"fixed\"                      # or \"adaptive\": as few of up to 8 readings on a side as motion asks for, as many as noise does
";

/// Line of the first occurrence, from 1.
fn line_of(text: &str, part: &str) -> usize {
    let at = text.find(part).unwrap_or_else(|| panic!("{part:?} is not in the text"));
    text[..at].matches('\n').count() + 1
}

#[test]
fn each_error_is_told_with_its_line_key_and_limit() {
    let mut told = String::new();
    for (name, from, to, at, key) in values::CASES.into_iter().chain(relations::CASES) {
        assert!(FULL.contains(from), "{name}: {from:?} is not in the document");
        let text = &FULL.replacen(from, to, 1);
        let problems = refuse(text);
        let line = line_of(text, at);
        let found = problems.iter().any(|p| p.key == key && p.line == line);
        assert!(found, "{name}: no problem at line {line}, {key:?} in\n{}", listed(&problems));
        // A key that is taken for another one is missing as well, and what needs it may say so.
        assert!(problems.len() <= 3, "{name}: one error, but\n{}", listed(&problems));
        told += &[name, &listed(&problems), ""].join("\n");
    }
    insta::assert_snapshot!(told);
}

#[test]
fn axes_in_one_plane_are_refused() {
    let start = FULL.find("[gyro.orientation]").unwrap();
    let end = FULL.find("[gyro.orientation.thermal]").unwrap();
    let rows = "[gyro.orientation]\nrows = [[1, 0, 0], [0, 1, 0], [0.6, 0.8, 0], [0.8, 0.6, 0]]\n\n";
    let problems = refuse(&format!("{}{rows}{}", &FULL[..start], &FULL[end..]));
    insta::assert_snapshot!(listed(&problems));
}

#[test]
fn axes_that_come_into_one_plane_within_their_range_are_refused() {
    // The first two point the same way at 55 °C, and at no other temperature.
    let from = "    [0.0, 1.4, -0.9],\n    [-1.1, 0.0, 1.2],\n    [0.8, -1.3, 0.0],\n    [0.5, -0.2, -0.3],";
    let to = "    [0.0, 6875.5, 0.0],\n    [6875.5, 0.0, 0.0],\n    [0.0, 0.0, 0.0],";
    let start = FULL.find("[accel.orientation]").unwrap();
    let three = FULL[start..].replacen("    [0.5773, 0.5775, 0.57725],\n", "", 1).replacen(from, to, 1);
    let three = three.replacen("weights = [1.0, 1.0, 1.0, 0.5]", "weights = [1.0, 1.0, 1.0]", 1);
    let (before, fourth) = FULL[..start].split_at(FULL[..start].rfind("[[accel.sensor]]").unwrap());
    assert!(fourth.lines().any(|line| line == "name = \"s\""));
    let problems = refuse(&format!("{before}{three}"));
    insta::assert_snapshot!(listed(&problems));
}

#[test]
fn a_transition_is_stated_once_as_ticks_or_as_a_time() {
    let with = |keys: &str| FULL.replacen(MODE_REVERSAL, &format!("[mode_reversal]\n{keys}\n"), 1);
    let parts = |keys: &str| accept(&with(keys)).document.to_parts().reversal.unwrap();
    let default = ReversalParts::default();
    assert_eq!(parts(""), default);
    assert_eq!(parts("transition_ticks = 32").transition, Transition::Ticks(32));
    assert_eq!(parts("transition_s = 0.015").transition, Transition::Time(0.015));
    let adaptive = ReversalParts {
        fit_readings_before: 8,
        fit_readings_after: 8,
        fit_window: FitWindow::Adaptive,
        ..default
    };
    assert_eq!(parts("fit_window = \"adaptive\""), adaptive);
    let wrong = [
        "transition_s = 0.015\ntransition_ticks = 3",
        "transition_s = 1.5",
        "transition_ticks = 33",
        "fit_window = \"wide\"",
        "fit_window = \"adaptive\"\nfit_readings_after = 3",
    ];
    insta::assert_snapshot!(wrong.map(|keys| listed(&refuse(&with(keys)))).join("\n"));
    // What is written is what was read.
    for keys in ["", "transition_s = 0.015", "fit_window = \"adaptive\"\ntransition_ticks = 20"] {
        let document = accept(&with(keys)).document;
        assert_eq!(accept(&document.to_toml().unwrap()).document, document, "{keys}");
    }
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
