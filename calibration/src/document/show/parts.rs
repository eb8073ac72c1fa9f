//! What a merged document was put together from: `origin.details.parts`.

use isotherm_protocol::document::{Document, Measure, Residual, Sample};
use toml::{Table, Value};

use crate::report::{Report, or_dash, short};

/// Most entries of a list that are named.
const NAMED: usize = 4;

/// One part, as the document keeps its origin.
struct Part<'a> {
    name: String,
    about: &'a Table,
}

/// Its parts, and theirs where they were merged themselves.
fn parts<'a>(details: Option<&'a Table>, above: &str) -> Vec<Part<'a>> {
    let own = details.and_then(|details| details.get("parts")?.as_table());
    let mut all = Vec::new();
    for (name, about) in own.into_iter().flatten() {
        let Some(about) = about.as_table() else { continue };
        let name = if above.is_empty() { name.clone() } else { format!("{above} / {name}") };
        let below = parts(about.get("details").and_then(Value::as_table), &name);
        all.push(Part { name, about });
        all.extend(below);
    }
    all
}

/// Which parts there are, what was taken from each, and how good each is by its own account.
pub(super) fn tables(sheet: &mut Report, document: &Document) {
    let details = document.origin.as_ref().and_then(|origin| origin.details.as_ref());
    let parts = parts(details, "");
    let row = |part: &Part<'_>| {
        let text = |key: &str| part.about.get(key).and_then(Value::as_str).unwrap_or("–").to_owned();
        let taken = part.about.get("taken").and_then(Value::as_array).into_iter().flatten();
        let logs = part.about.get("log").and_then(Value::as_array).into_iter().flatten();
        let logs = logs.filter_map(|log| log.get("name")?.as_str());
        vec![
            part.name.clone(),
            text("method"),
            or_dash(part.about.get("created").map(Value::to_string)),
            named(taken.filter_map(Value::as_str)),
            named(logs),
        ]
    };
    let head = ["part", "method", "of", "taken from it", "logs"];
    sheet.table("Parts", head, parts.iter().map(row));
    let mut rows = Vec::new();
    for part in &parts {
        for residual in part.about.get("residual").and_then(Value::as_array).into_iter().flatten() {
            let Ok(residual) = residual.clone().try_into::<Residual>() else { continue };
            let mut row = of_residual(&residual);
            row[0] = format!("{}: {}", part.name, row[0]);
            rows.push(row);
        }
    }
    sheet.table("Residuals as stated by each part", HEAD, rows);
}

fn named<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    match names.len() {
        0 => "–".to_owned(),
        count if count > NAMED => format!("{} and {} more", names[..NAMED].join(", "), count - NAMED),
        _ => names.join(", "),
    }
}

/// Columns of a table of residuals.
pub(super) const HEAD: [&str; 3] = ["", "rms", "peak to peak"];

/// A residual of the document.
pub(super) fn of_residual(residual: &Residual) -> Vec<String> {
    let measure = match residual.measure {
        Measure::DegPerH => "°/h",
        Measure::MetresPerSecondSquared => "m/s²",
    };
    let pair = |(before, after): (f64, f64)| format!("{} → {}", short(before), short(after));
    let sample = if residual.sample == Sample::In { "in sample" } else { "out of sample" };
    let peaks = residual.peak_to_peak_before.zip(residual.peak_to_peak_after);
    vec![
        format!("{}, {measure}, {sample}", residual.of),
        pair((residual.rms_before, residual.rms_after)),
        or_dash(peaks.map(pair)),
    ]
}
