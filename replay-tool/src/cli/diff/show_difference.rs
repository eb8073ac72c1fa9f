//! The first difference of two logs, for people.

use std::fmt::Write as _;

use isotherm_correction::sample::CorrectedTick;
use isotherm_log::diff::{Equivalent, FieldDifference, FirstDifference, Happened, LogTick, Row, mode};

use crate::cli::show;

/// The first difference with the ticks around it, in words; `names` are those of the two logs.
pub(in crate::cli) fn first_difference(first: &FirstDifference, names: [&str; 2]) -> String {
    let [a, b] = names;
    let mut text = format!("tick {}, which ends at {} ns", first.sequence, first.end_time_ns);
    match first.only_in {
        Some(one) => {
            let _ = writeln!(text, ", is in {} alone", if one == "a" { a } else { b });
        }
        None => text += "\n",
    }
    for field in &first.fields {
        text += &in_field(field, names);
    }
    text += &happened(&first.event_a, a);
    text += &happened(&first.event_b, b);
    text += &around(first, names);
    text
}

/// One field: both values as they read back, their bits, and what the difference comes to.
fn in_field(field: &FieldDifference, [name_a, name_b]: [&str; 2]) -> String {
    let FieldDifference { field, a, b, a_bits, b_bits, equivalent } = field;
    let bits = |bits: &Option<String>| bits.as_ref().map(|bits| format!("  {bits}")).unwrap_or_default();
    let width = name_a.len().max(name_b.len());
    let equivalent = match equivalent {
        Some(Equivalent::DegPerH(rate)) => format!("    differ by {rate:.3e} °/h\n"),
        Some(Equivalent::MilliG(force)) => format!("    differ by {force:.3e} mg\n"),
        None => String::new(),
    };
    format!(
        "  {field}\n    {name_a:width$} {a}{}\n    {name_b:width$} {b}{}\n{equivalent}",
        bits(a_bits),
        bits(b_bits)
    )
}

/// What happened last in a log.
fn happened(happened: &Happened, name: &str) -> String {
    let line = |words: &Option<String>| {
        words.as_ref().map(|words| format!("  last in {name}: {words}\n")).unwrap_or_default()
    };
    line(&happened.journal) + &line(&happened.tick)
}

/// The ticks around it side by side.
fn around(first: &FirstDifference, [name_a, name_b]: [&str; 2]) -> String {
    let head = ["", "tick", "", "Δθ x, y, z (rad)", "Δv x, y, z (m/s)", "mode", "rev", "flags"];
    let mut rows = Vec::new();
    for (place, Row { a, b }) in first.around.iter().enumerate() {
        let marker = if place == first.at { ">" } else { "" };
        match (a, b) {
            (Some(a), Some(b)) if isotherm_log::diff::identical(a, b) => {
                rows.push(row(marker, "both", Some(a)));
            }
            _ => {
                rows.extend([row(marker, name_a, a.as_ref()), row(marker, name_b, b.as_ref())]);
            }
        }
    }
    show::grid(head, rows, ..0)
}

fn row(marker: &str, name: &str, tick: Option<&LogTick>) -> [String; 8] {
    let Some(LogTick { tick, .. }) = tick else {
        return [marker, "", name, "—", "", "", "", ""].map(str::to_owned);
    };
    let CorrectedTick { sequence, delta_angle, delta_velocity, revision, flags, .. } = tick;
    // Every digit of what differs stands above.
    let vector = |vector: &[f64; 3]| vector.map(|value| format!("{value:>10.3e}")).join(" ");
    let flags: Vec<_> = flags.iter_names().map(|(name, _)| name).collect();
    [
        marker.to_owned(),
        sequence.to_string(),
        name.to_owned(),
        vector(delta_angle),
        vector(delta_velocity),
        mode(tick.mode).to_owned(),
        revision.to_string(),
        flags.join(" "),
    ]
}
