//! What the commands show: differences, problems, tables.

use std::fmt::Write;

use comfy_table::{Table, TableComponent};
use isotherm_protocol::control::{CorrectionChange, Difference};
use isotherm_protocol::document::Problem;
use isotherm_protocol::escape::escaped;

/// A table with a line under its header; columns from `right` on are aligned to the right.
pub(super) fn table<const N: usize>(header: [&str; N], rows: Vec<Vec<String>>, right: usize) -> Table {
    let mut table = isotherm_cli::table(header, rows, right..);
    for line in [
        TableComponent::HeaderLines,
        TableComponent::LeftHeaderIntersection,
        TableComponent::MiddleHeaderIntersections,
        TableComponent::RightHeaderIntersection,
    ] {
        table.set_style(line, '─');
    }
    table
}

/// A problem; that of the document under the name that the operator gave the file, `sent` with the key that it was sent to. What is no
/// matter of a file is told without a place.
pub(super) fn problem(problem: &Problem, sent: Option<(&str, &str)>) -> String {
    let Some(place) = &problem.file else { return escaped(&problem.message).into_owned() };
    let name = sent.filter(|(key, _)| place == key).map_or(place.as_str(), |(_, name)| name);
    Problem { file: Some(name.to_owned()), ..problem.clone() }.to_string()
}

/// Entries of a document that are shown of those that change.
const MOST_CHANGES: usize = 24;

/// A difference: entries of the document line by line, and a table of what comes of them.
pub(super) fn difference(difference: &Difference) -> String {
    let mut text = String::new();
    if difference.document.is_empty() {
        text.push_str("No entry of the document differs.\n");
    }
    for change in difference.document.iter().take(MOST_CHANGES) {
        let _ = writeln!(text, "  {}", change.words());
    }
    if let Some(more) = difference.document.len().checked_sub(MOST_CHANGES).filter(|more| *more > 0) {
        let _ = writeln!(text, "  … and {more} more: --json");
    }
    if difference.temperatures.is_empty() {
        text.push_str("The unit's temperatures are not known yet, so the effect is unknown.");
    } else if difference.correction.is_empty() {
        text.push_str("The correction at the present temperatures does not change.");
    } else {
        let rows = difference.correction.iter().map(correction_row);
        let header = ["subtracted", "before", "after", "change", "unit"];
        let _ = write!(text, "\n{}", table(header, rows.collect(), 1));
    }
    if !difference.temperatures.is_empty() {
        let _ = write!(text, "\nat {}", difference.temperatures.join(", "));
    }
    text
}

fn correction_row(change: &CorrectionChange) -> Vec<String> {
    let CorrectionChange { quantity, unit, before, after } = change;
    vec![
        quantity.clone(),
        format!("{before:.6}"),
        format!("{after:.6}"),
        format!("{:+.6}", after - before),
        unit.clone(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_problems_of_the_document_are_told_under_its_name() {
        let of = |file: Option<&str>| Problem {
            file: file.map(ToOwned::to_owned),
            line: 3,
            column: 1,
            key: String::new(),
            message: "words".to_owned(),
        };
        let sent = Some(("imu/U/calibration", "new.toml"));
        assert!(problem(&of(Some("imu/U/calibration")), sent).starts_with("new.toml:3:1:"));
        assert!(problem(&of(Some("/etc/keys")), sent).starts_with("/etc/keys:3:1:"));
        assert!(problem(&of(Some("state/a.toml")), None).starts_with("state/a.toml:3:1:"));
        assert_eq!(problem(&of(None), sent), "words");
    }
}
