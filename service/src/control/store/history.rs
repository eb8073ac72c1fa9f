//! Entries read back for operators, the newest ones.

use std::collections::VecDeque;
use std::path::Path;

use isotherm_protocol::history::AuditEntry;
use isotherm_protocol::key::UnitId;

use super::{StoreError, scan};

/// Most entries that are given at once.
pub(super) const MAX_ENTRIES: usize = 10_000;
/// Within how many bytes of a line its unit, author and event are named.
const MAX_HEAD: usize = 512;

/// The newest `limit` entries of a file, of one unit or of all, the oldest of them first. Damaged lines are skipped: they
/// were told when the file was opened.
pub(super) fn newest(
    path: &Path,
    unit: Option<&UnitId>,
    limit: usize,
    carried: bool,
) -> Result<Vec<AuditEntry>, StoreError> {
    // Cheaper than JSON: most lines of a large file are another unit's, or too old.
    let mark = unit.map(|unit| format!("\"unit\":\"{unit}\""));
    let mut newest: VecDeque<Vec<u8>> = VecDeque::new();
    let read = scan::lines(path, |scan::Line { bytes: line, .. }| {
        let of_unit = mark.as_ref().is_none_or(|mark| contains(line, mark));
        let wanted = of_unit && (carried || !contains(line, "\"event\":\"carried-"));
        if wanted && AuditEntry::is_whole(line) {
            newest.push_back(line.to_vec());
            if newest.len() > limit {
                newest.pop_front();
            }
        }
    });
    read.map_err(StoreError::read(path))?;
    Ok(newest.iter().filter_map(|line| AuditEntry::from_line(line).ok()).collect())
}

/// Whether a line has this mark near its beginning, where unit and event stand. No other text of an entry can hold it: a
/// quotation mark within a text has a backslash before it.
fn contains(line: &[u8], mark: &str) -> bool {
    String::from_utf8_lossy(line.get(..MAX_HEAD).unwrap_or(line)).contains(mark)
}
