//! What a merged document was put together from: `origin.details.parts`.

use isotherm_protocol::document::{Document, Measure, Residual, Sample};
use toml::Table;

use crate::document::merge::origin::Part;
use crate::report::{Report, or_dash, short};

/// Most entries of a list that are named.
const NAMED: usize = 4;

/// The parts by their names, and theirs where they were merged themselves.
fn parts(details: Option<&Table>, above: &str) -> Vec<(String, Part)> {
    let own = details.and_then(|details| details.get("parts")?.as_table());
    let mut all = Vec::new();
    for (name, about) in own.into_iter().flatten() {
        let Ok(part) = about.clone().try_into::<Part>() else { continue };
        let name = if above.is_empty() { name.clone() } else { format!("{above} / {name}") };
        let below = parts(part.origin.details.as_ref(), &name);
        all.push((name, part));
        all.extend(below);
    }
    all
}

/// Which parts there are, what was taken from each, and how good each is by its own account.
pub(super) fn tables(sheet: &mut Report, document: &Document) {
    let details = document.origin.as_ref().and_then(|origin| origin.details.as_ref());
    let parts = parts(details, "");
    let row = |(name, part): &(String, Part)| {
        vec![
            name.clone(),
            or_dash(part.origin.method.clone()),
            or_dash(part.created.map(|created| created.to_string())),
            named(part.taken.iter().map(String::as_str)),
            named(part.origin.log.iter().map(|log| log.name.as_str())),
        ]
    };
    let head = ["part", "method", "of", "taken from it", "logs"];
    sheet.table("Parts", head, parts.iter().map(row));
    let of_part = |(name, part): &(String, Part)| -> Vec<Vec<String>> {
        let named = |residual| {
            let mut row = of_residual(residual);
            row[0] = format!("{name}: {}", row[0]);
            row
        };
        part.origin.residual.iter().map(named).collect()
    };
    sheet.table("Residuals as stated by each part", HEAD, parts.iter().flat_map(of_part));
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

/// A residual as a row.
pub(super) fn of_residual(residual: &Residual) -> Vec<String> {
    let measure = match residual.measure {
        Measure::DegPerH => "°/h",
        Measure::MetresPerSecondSquared => "m/s²",
    };
    let sample = if residual.sample == Sample::In { "in sample" } else { "out of sample" };
    let pair = |before: f64, after: f64| format!("{} → {}", short(before), short(after));
    let peaks = residual.peak_to_peak_before.zip(residual.peak_to_peak_after);
    vec![
        format!("{}, {measure}, {sample}", residual.of),
        pair(residual.rms_before, residual.rms_after),
        or_dash(peaks.map(|(before, after)| pair(before, after))),
    ]
}
