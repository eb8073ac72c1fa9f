//! What the audit file was found like.

use std::path::Path;

use isotherm_protocol::history::LineError;
use isotherm_protocol::key::UnitId;

/// Most damaged lines that are kept in words.
const MAX_DAMAGES: u64 = 16;

/// What was found when a state folder was opened.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Opened {
    /// Entries read.
    pub entries: u64,
    /// Lines that were skipped, being damaged or not understood.
    pub damaged: u64,
    /// The first of them, and entries that are missing between two lines, in words.
    pub doubts: Vec<String>,
    /// What became of a last line that was not written to its end.
    pub torn: Option<String>,
    /// Acceptances that are lost, with the unit of each where it is known.
    pub lost: Vec<(Option<UnitId>, String)>,
    /// Entries that are missing at the end.
    pub cut: Option<String>,
}

impl Opened {
    /// A line was skipped; it stays in its file as it is.
    pub(super) fn damage(&mut self, file: &Path, line: u64, error: &LineError) {
        self.damaged += 1;
        if self.damaged <= MAX_DAMAGES {
            self.doubts.push(format!(
                "{}:{line}: {error}; the line is skipped, and if it was an acceptance, the one before it is in force",
                file.display()
            ));
        }
    }

    /// The entries from `first` to `last` are missing before a line.
    pub(super) fn miss(&mut self, file: &Path, line: u64, first: u64, last: u64) {
        let entries = if first == last {
            format!("entry {first} is")
        } else {
            format!("entries {first} to {last} are")
        };
        self.doubts.push(format!(
            "{}:{line}: {entries} missing before this line; if it was an acceptance, an older calibration may be in force \
             than expected: check `isotherm status`",
            file.display()
        ));
    }

    /// Entries that were written are missing at the end.
    pub(super) fn cut(&mut self, last: u64, written: u64, floor: u64) {
        self.cut = Some(format!(
            "the audit file ends with entry {last}, but entry {written} was written: the last {} entries are missing, and \
             older calibrations may be in force than before. Check every unit, and restore what is missing with \
             `isotherm swap`. {}",
            written - last,
            going_on(floor)
        ));
    }

    /// A revision was accepted, and cannot be put in force again because its line is damaged.
    pub(super) fn lose(&mut self, unit: &UnitId, revision: u64, older: Option<u64>) {
        let instead = older.map_or("there is no older one to put in force".to_owned(), |older| {
            format!("the older revision {older} is in force instead")
        });
        let words = format!(
            "unit {unit}: revision {revision} was accepted, but its line of the audit file is damaged: {instead}; put \
             the newer document in force with `isotherm swap`"
        );
        self.lost.push((Some(unit.clone()), words));
    }

    /// There are no entries, though documents were accepted.
    pub(super) fn lose_all(&mut self, folder: &Path, documents: usize, has_older: bool, floor: u64) {
        let folder = folder.display();
        let are = if documents == 1 { " is" } else { "s are" };
        let in_force = if has_older {
            "Older sets, of the audit file before it, are in force"
        } else {
            "What was in force is unknown, and units begin with the folder of calibrations"
        };
        let revisions = if floor == 0 { "Revisions begin at 1 again".to_owned() } else { going_on(floor) };
        let words = format!(
            "the audit file of {folder} is empty, though {documents} document{are} kept next to it: the history is lost; \
             was the file emptied or removed? {in_force}; check every unit, and restore what is missing with \
             `isotherm swap` (documents: {folder}/documents). {revisions}"
        );
        self.lost.push((None, words));
    }

    /// What was lost, in words: an older calibration may be in force than the operator knows of, or none.
    pub fn losses(&self) -> impl Iterator<Item = &String> {
        self.lost.iter().map(|(_, words)| words).chain(&self.cut)
    }

    /// What else is odd about the audit file, in words.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let beyond = self.damaged.saturating_sub(MAX_DAMAGES);
        let more =
            (beyond > 0).then(|| format!("and {beyond} more damaged lines of the audit file, all skipped"));
        self.doubts.iter().cloned().chain(more).chain(self.torn.clone())
    }
}

/// How revisions are numbered after a loss.
fn going_on(floor: u64) -> String {
    format!("Revisions continue from {}, so no number is used twice", floor.saturating_add(1))
}
