//! What is found different, and how it is told.

use isotherm_correction::channel::ThermalState;
use isotherm_correction::sample::LasingMode;
use isotherm_correction::thermal::Feature;

use super::super::tests::{FULL, OTHER, accept};
use super::super::{Parsed, Side, correction_change};
use super::*;
use crate::control::CorrectionChange;

/// The documents that are shipped.
fn shipped() -> Vec<(String, String)> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let documents = files.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    documents.map(|path| (path.display().to_string(), std::fs::read_to_string(&path).unwrap())).collect()
}

/// Changes between a text and the same with its first `from` replaced, in words.
#[track_caller]
fn changed(text: &str, from: &str, to: &str) -> Vec<String> {
    assert!(text.contains(from), "{from}");
    let (before, after) = (accept(text).document, accept(&text.replacen(from, to, 1)).document);
    difference(&before, &after).iter().map(DocumentChange::words).collect()
}

/// What the correction does under two documents, where every channel has this temperature.
fn change(
    before: &Parsed,
    after: &Parsed,
    deg_c: Option<f64>,
    mode: Option<LasingMode>,
) -> Vec<CorrectionChange> {
    let state = deg_c.map(|deg_c| ThermalState { temperature: deg_c, ..ThermalState::default() });
    let [old, new] = [before, after].map(|parsed| parsed.calibration.steady(|_| state, mode));
    let before = Side { document: &before.document, steady: &old };
    correction_change(before, Side { document: &after.document, steady: &new })
}

#[test]
fn every_shipped_document_is_no_different_from_itself() {
    let shipped = shipped();
    assert!(shipped.len() >= 6, "{}", shipped.len());
    for (name, text) in shipped {
        let parsed = accept(&text);
        let rewritten = accept(&parsed.document.to_toml().unwrap());
        assert_eq!(difference(&parsed.document, &rewritten.document), [], "{name}");
        assert_eq!(change(&parsed, &rewritten, None, None), [], "{name}");
    }
}

#[test]
fn the_last_digit_of_any_number_is_found_and_named() {
    let mut tried = 0;
    for text in [FULL, OTHER] {
        let before = accept(text).document;
        let written = before.to_toml().unwrap();
        let lines: Vec<&str> = written.lines().collect();
        for (i, line) in lines.iter().enumerate() {
            let Some((key, value)) = line.split_once(" = ").filter(|(_, value)| value.parse::<f64>().is_ok())
            else {
                continue;
            };
            // One unit of the last digit, or a larger whole number.
            let last = if value.ends_with('8') || value.ends_with('9') { '7' } else { '9' };
            let other = format!("{}{last}", &value[..value.len() - 1]);
            let mut edited = lines.clone();
            let edited_line = format!("{key} = {other}");
            edited[i] = &edited_line;
            let Ok(after) = Document::parse(&edited.join("\n"), None) else { continue };
            let changes = difference(&before, &after.document);
            assert_eq!(changes.len(), 1, "{line}: {changes:?}");
            assert!(changes[0].key.ends_with(key), "{line}: {changes:?}");
            assert_eq!(changes[0].before.as_deref(), Some(value), "{line}");
            tried += 1;
        }
    }
    assert!(tried > 50, "{tried}");
}

#[test]
fn changes_are_told_by_key_value_and_size() {
    for (from, to, expected) in [
        (
            "coefficients_deg_per_h = [1.284, -0.0131",
            "coefficients_deg_per_h = [1.29, -0.0131",
            &["gyro.sensor[0].static_bias.coefficients_deg_per_h[0]: 1.284 -> 1.29 (+0.006, +0.4673 %)"][..],
        ),
        (
            "[3.18, 0.0161]",
            "[3.18]",
            &["gyro.sensor[2].magnetic_bias.coefficients_deg_per_h[1]: removed, was 0.0161"],
        ),
        (
            "[3.18, 0.0161]",
            "[3.18, 0.0161, 1e-7]",
            &["gyro.sensor[2].magnetic_bias.coefficients_deg_per_h[2]: new, 0.0000001"],
        ),
        (
            "value_deg_per_h = -0.047",
            "value_deg_per_h = 0.047",
            &["gyro.sensor[1].slow_meander.value_deg_per_h: -0.047 -> 0.047 (+0.094, +200 %)"],
        ),
        (
            "slow_meander = { kind = \"constant\", value_deg_per_h = -0.047 }",
            "slow_meander = { kind = \"spline\", knots_deg_per_h = [[-40, 1], [70, 2]] }",
            &[
                "gyro.sensor[1].slow_meander.kind: \"constant\" -> \"spline\"",
                "gyro.sensor[1].slow_meander.knots_deg_per_h[0][0]: new, -40.0",
                "gyro.sensor[1].slow_meander.knots_deg_per_h[0][1]: new, 1.0",
                "gyro.sensor[1].slow_meander.knots_deg_per_h[1][0]: new, 70.0",
                "gyro.sensor[1].slow_meander.knots_deg_per_h[1][1]: new, 2.0",
                "gyro.sensor[1].slow_meander.value_deg_per_h: removed, was -0.047",
            ],
        ),
    ] {
        assert_eq!(changed(FULL, from, to), expected, "{from}");
    }
}

#[test]
fn layout_comments_and_stated_defaults_are_no_change() {
    for (from, to) in [
        ("schema = 1\n", "# another comment\nschema    =   1\n"),
        ("incr", "incr"),
        ("coefficients_ppm = [0.0, 0.42, -0.003]", "coefficients_ppm = [0, 4.2e-1, -3e-3]"),
        (
            "[gyro.sensor.servo]\nform = \"modelled\"",
            "[gyro.sensor.servo]\nsettle_time_constants = 8\nform = \"modelled\"",
        ),
    ] {
        assert_eq!(changed(FULL, from, to), [""; 0], "{from}");
    }
}

#[test]
fn sensors_are_matched_by_name_and_their_order_is_told() {
    let mut after = accept(OTHER).document;
    let before = after.clone();
    after.gyro.sensor.swap(0, 2);
    let words: Vec<_> = difference(&before, &after).iter().map(DocumentChange::words).collect();
    assert_eq!(words, ["gyro.sensor: [\"x\", \"y\", \"z\"] -> [\"z\", \"y\", \"x\"]"]);

    after.gyro.sensor[0].increment_weight_rad_per_rad = Some(-1.1);
    let words: Vec<_> = difference(&before, &after).iter().map(DocumentChange::words).collect();
    assert_eq!(words[1..], ["gyro.sensor[0].increment_weight_rad_per_rad: -1.0 -> -1.1 (-0.1, -10 %)"]);

    after.gyro.sensor[0].name = "s".to_owned();
    let keys: Vec<_> = difference(&before, &after).into_iter().map(|change| change.key).collect();
    assert_eq!(
        keys,
        [
            "gyro.sensor",
            "gyro.sensor[0].name",
            "gyro.sensor[0].increment_weight_rad_per_rad",
            "gyro.sensor[2].name",
            "gyro.sensor[2].increment_weight_rad_per_rad",
        ]
    );
    // Channels are found by name: their order means nothing.
    let mut after = accept(FULL).document;
    let before = after.clone();
    after.temperature.channel.reverse();
    assert_eq!(difference(&before, &after), []);
}

#[test]
fn what_is_only_for_readers_comes_last() {
    let text = FULL
        .replacen("2026-11-21T09:30:00+03:00", "2026-11-22", 1)
        .replacen("method = \"joint\"", "method = \"lag\"", 1)
        .replacen("transition_ticks = 3", "transition_ticks = 2", 1);
    let changes = difference(&accept(FULL).document, &accept(&text).document);
    let keys: Vec<_> = changes.iter().map(|change| change.key.as_str()).collect();
    assert_eq!(keys, ["mode_reversal.transition_ticks", "created", "origin.method"]);
    // Long values are cut, in characters.
    let change = DocumentChange { key: "note".into(), before: None, after: Some("\"é".repeat(40)) };
    assert_eq!(change.words(), format!("note: new, {}…", "\"é".repeat(30)));
}

#[test]
fn a_change_of_the_correction_is_told_per_sensor_and_in_case_axes() {
    let before = accept(FULL);
    let text = FULL
        .replacen("coefficients_deg_per_h = [1.284, -0.0131", "coefficients_deg_per_h = [1.294, -0.0131", 1)
        .replacen(
            "increment_weight_arcsec_per_count = 0.9841",
            "increment_weight_arcsec_per_count = 0.9843",
            1,
        )
        .replacen("[0.0005, -0.0004, 0.9999998]", "[0.0006, -0.0004, 0.9999998]", 1)
        .replacen("value_counts_per_s = 4.7", "value_counts_per_s = 14.7", 1)
        .replacen("value_counts_per_s_per_m_per_s2 = 1021.3", "value_counts_per_s_per_m_per_s2 = 1021.4", 1);
    let after = accept(&text);
    assert_eq!(difference(&before.document, &after.document).len(), 5);
    let found = change(&before, &after, Some(25.0), Some(LasingMode::Plus));
    let of = |quantity: &str| {
        let mut found = found.iter().filter(|change| change.quantity == quantity);
        found.next().unwrap_or_else(|| panic!("{quantity} is not told"))
    };
    // Static, magnetic, meander and the trend at the end of its interval.
    let bias = of("gyro x bias");
    assert_eq!(bias.unit, "°/h");
    let trend = 0.06 - 0.02 * 6.0 + 0.0017 * 36.0;
    // Every channel reads 25 here, the supply too: 20 above its nominal value.
    let supply = 0.08 * (25.0 - 5.0);
    assert!((bias.before - (1.284 + 3.41 + 0.082 + trend + supply)).abs() < 1e-9, "{bias:?}");
    assert!((bias.after - bias.before - 0.01).abs() < 1e-9, "{bias:?}");
    let weight = of("gyro y increment weight");
    assert!((weight.after - 0.9843).abs() < 1e-9 && weight.unit == "″/count", "{weight:?}");
    let turn = of("gyro z input axis turns");
    assert!((turn.after - 1e-4_f64.to_degrees() * 3600.0).abs() < 0.01 && turn.unit == "″", "{turn:?}");
    let bias = of("accelerometer s bias");
    let milli_g = 10.0 / 1018.6 / 9.806_65 * 1e3;
    assert!((bias.after - bias.before - milli_g).abs() < 1e-9 && bias.unit == "mg", "{bias:?}");
    let scale = of("accelerometer z scale factor");
    assert!((scale.after - 1021.4).abs() < 1e-9 && scale.unit == "(counts/s)/(m/s²)", "{scale:?}");
    // Of 0.01 °/h along x, a redundant set of four takes most.
    let rate = of("angular rate bias about x");
    assert!((0.007..0.0101).contains(&(rate.after - rate.before)), "{rate:?}");
    assert!(found.iter().any(|change| change.quantity == "specific force bias along y"));
    // What does not differ is not told.
    assert!(found.iter().all(|change| !change.quantity.starts_with("gyro s ")));
    // In the other mode the magnetic bias has the other sign.
    let other = change(&before, &after, Some(25.0), Some(LasingMode::Minus));
    assert!((other[0].before - (1.284 - 3.41 + 0.082 + trend + supply)).abs() < 1e-9, "{:?}", other[0]);
}

#[test]
fn a_section_that_is_gone_is_named_and_a_term_is_none() {
    let full = accept(FULL).document;
    let lost = |change: &dyn Fn(&mut Document)| {
        let mut after = full.clone();
        change(&mut after);
        lost_sections(&full, &after)
    };
    assert!(full.accel.is_some() && full.mode_reversal.is_some() && full.self_test.is_some());
    assert_eq!(lost(&|_| {}), [""; 0]);
    assert_eq!(lost(&|it| it.accel = None), ["[accel]"]);
    assert_eq!(
        lost(&|it| (it.mode_reversal, it.self_test) = (None, None)),
        ["[mode_reversal]", "[self_test]"]
    );
    let final_gyro = full.gyro.sensor.last().unwrap().name.clone();
    let gone = lost(&|it| drop(it.gyro.sensor.pop()));
    assert_eq!(gone, [format!("[[gyro.sensor]] \"{final_gyro}\"")]);
    assert_eq!(lost(&|it| it.gyro.sensor[0].name = "renamed".to_owned()), [""; 0]);
    assert_eq!(lost(&|it| it.gyro.sensor[0].drift = None), ["[gyro.sensor.drift]"]);
    assert_eq!(lost(&|it| it.gyro.sensor[0].set(Feature::One, None)), [""; 0], "a curve");
    assert_eq!(lost(&|it| (it.origin, it.created, it.note) = (None, None, None)), [""; 0]);
    assert_eq!(lost_sections(&Document { accel: None, ..full.clone() }, &full), [""; 0], "it gains one");
}
