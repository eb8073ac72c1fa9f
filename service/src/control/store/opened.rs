//! What the audit file was found like.

use std::path::PathBuf;

use thiserror::Error;

use super::folder::AHEAD;

/// Most damaged lines that are kept in words.
const MAX_DAMAGES: usize = 16;

/// What was found when a state folder was opened.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Opened {
    /// Entries read.
    pub entries: u64,
    /// Lines that were skipped, being damaged or not understood.
    pub damaged: u64,
    /// The first of them.
    pub damages: Vec<Damage>,
    /// Entries that are missing between two lines.
    pub gaps: Vec<Gap>,
    /// Entries that are missing at the end.
    pub cut: Option<Cut>,
    /// What became of a last line that was not written to its end.
    pub torn: Option<Torn>,
    /// Units whose newest acceptance is among the damaged lines.
    pub lost: Vec<LostRevision>,
    /// The audit file is empty, and was not always.
    pub emptied: Option<Emptied>,
    /// The file with the highest revision that may have been given is lost.
    pub unmarked: Option<Unmarked>,
}

/// The file with the highest revision that may have been given is damaged or missing.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "{file}, which has the highest revision that may have been given, {reason}: revisions continue from {}, {AHEAD} above \
     the highest that the audit file has",
    floor.saturating_add(1), file = file.display()
)]
pub struct Unmarked {
    /// The file.
    pub file: PathBuf,
    /// What is wrong with it.
    pub reason: String,
    /// Revisions up to this one are not given again.
    pub floor: u64,
}

/// A revision that was accepted, and cannot be put in force again because its line is damaged.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "unit {unit}: revision {revision} was accepted, but its line of the audit file is damaged: {}; put the newer \
     document in force with `isotherm swap`",
    instead(*in_its_place)
)]
pub struct LostRevision {
    /// Serial of the unit.
    pub unit: String,
    /// The revision.
    pub revision: u64,
    /// The revision that holds in its place; `None` where there is none.
    pub in_its_place: Option<u64>,
}

/// An audit file without entries beside documents that were accepted.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "the audit file of {folder} is empty, though {documents} document{} kept next to it: the history is lost; was the \
     file emptied or removed? {}; check every unit, and restore what is missing with `isotherm swap` (documents: \
     {folder}/documents). {}",
    if *documents == 1 { " is" } else { "s are" },
    if *has_older {
        "Older sets, of the audit file before it, are in force"
    } else {
        "What was in force is unknown, and units begin with the folder of calibrations"
    },
    next_revision(*floor),
    folder = folder.display()
)]
pub struct Emptied {
    /// The state folder.
    pub folder: PathBuf,
    /// How many documents are kept.
    pub documents: usize,
    /// Whether an older audit file is there, so that older sets hold.
    pub has_older: bool,
    /// Revisions up to this one are not given again; 0 where nothing is known of them.
    pub floor: u64,
}

/// Entries whose lines are missing in the middle of an audit file.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "{file}:{line}: {} missing before this line; if it was an acceptance, an older calibration may be in force than \
     expected: check `isotherm status`",
    entries(*first, *last),
    file = file.display()
)]
pub struct Gap {
    /// The audit file.
    pub file: PathBuf,
    /// The line behind them, from 1.
    pub line: u64,
    /// Number of the first missing entry.
    pub first: u64,
    /// Number of the last missing entry.
    pub last: u64,
}

/// Entries that were written and are missing at the end of the audit file.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "the audit file ends with entry {last}, but entry {written} was written: the last {} entries are missing, and older \
     calibrations may be in force than before. Check every unit, and restore what is missing with `isotherm swap`. \
     Revisions continue from {}, so no number is used twice",
    written - last,
    floor.saturating_add(1)
)]
pub struct Cut {
    /// Number of the last entry that is there; 0 where there is none.
    pub last: u64,
    /// Number of the last one that was written.
    pub written: u64,
    /// Revisions up to this one are not given again.
    pub floor: u64,
}

/// A line that was skipped; it stays in its file as it is.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "{file}:{line}: {words}; the line is skipped, and if it was an acceptance, the one before it is in force",
    file = file.display()
)]
pub struct Damage {
    /// The audit file.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: u64,
    /// What is wrong with it.
    pub words: String,
}

/// A last line that was not written to its end.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Torn {
    /// Only the line feed was missing: the entry counts, the line feed was added.
    #[error("the last line of the audit file had no line feed: it was added")]
    Completed,
    /// It was cut off the audit file.
    #[error("the last line of the audit file was cut short: its {bytes} bytes are now in {to}", to = to.display())]
    Moved {
        /// The file that holds it now.
        to: PathBuf,
        /// How long it is.
        bytes: u64,
    },
}

impl Opened {
    pub(super) fn damage(&mut self, damage: Damage) {
        self.damaged += 1;
        if self.damages.len() < MAX_DAMAGES {
            self.damages.push(damage);
        }
    }

    /// What was lost, in words: an older calibration may be in force than the operator knows of, or none.
    pub fn losses(&self) -> impl Iterator<Item = String> {
        self.lost.iter().map(ToString::to_string).chain(self.losses_of_all())
    }

    /// The same of losses that concern every unit.
    pub(crate) fn losses_of_all(&self) -> impl Iterator<Item = String> {
        let emptied = self.emptied.iter().map(ToString::to_string);
        let cut = self.cut.iter().map(ToString::to_string);
        emptied.chain(cut).chain(self.unmarked.iter().map(ToString::to_string))
    }

    /// Everything else that an operator should know, a line each; none after a clean stop.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let damages = self.damages.iter().map(ToString::to_string);
        let beyond = self.damaged.saturating_sub(self.damages.len() as u64);
        let more =
            (beyond > 0).then(|| format!("and {beyond} more damaged lines of the audit file, all skipped"));
        let gaps = self.gaps.iter().map(ToString::to_string);
        damages.chain(more).chain(gaps).chain(self.torn.iter().map(ToString::to_string))
    }
}

/// What is in force in the place of a revision that is lost.
pub(crate) fn instead(older: Option<u64>) -> String {
    older.map_or_else(
        || "there is no older one to put in force".to_owned(),
        |older| format!("the older revision {older} is in force instead"),
    )
}

/// Where revisions go on.
fn next_revision(floor: u64) -> String {
    match floor {
        0 => "Revisions begin at 1 again".to_owned(),
        floor => format!("Revisions continue from {}, so no number is used twice", floor.saturating_add(1)),
    }
}

/// Entries that are missing.
fn entries(first: u64, last: u64) -> String {
    if first == last { format!("entry {first} is") } else { format!("entries {first} to {last} are") }
}
