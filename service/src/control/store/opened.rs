//! What the audit file was found like.

use std::path::PathBuf;

use isotherm_protocol::key::UnitId;
use thiserror::Error;

use super::folder::AHEAD;

/// Most flaws that are kept in words.
const MAX_FLAWS: usize = 16;

/// What was found when a state folder was opened.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Opened {
    /// Entries read.
    pub entries: u64,
    /// Lines that were skipped, being damaged or not understood.
    pub damaged: u64,
    /// The first flaws among the lines.
    pub flaws: Vec<Flaw>,
    /// How many more there are.
    pub more_flaws: u64,
    /// What became of a last line that was not written to its end.
    pub torn: Option<Torn>,
    /// What was lost: an older calibration may be in force than the operator knows of, or none.
    pub losses: Vec<Loss>,
}

/// What is wrong within an audit file.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Flaw {
    /// A line that was skipped; it stays in its file as it is.
    #[error(
        "{file}:{line}: {words}; the line is skipped, and if it was an acceptance, the one before it is in force",
        file = file.display()
    )]
    Damage {
        /// The audit file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// What is wrong with it.
        words: String,
    },
    /// Entries whose lines are missing in the middle.
    #[error(
        "{file}:{line}: {} missing before this line; if it was an acceptance, an older calibration may be in force than \
         expected: check `isotherm status`",
        entries(*first, *last),
        file = file.display()
    )]
    Gap {
        /// The audit file.
        file: PathBuf,
        /// The line behind them, from 1.
        line: u64,
        /// Number of the first missing entry.
        first: u64,
        /// Number of the last missing entry.
        last: u64,
    },
}

/// What was lost with lines or files of a state folder.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Loss {
    /// The newest acceptance of a unit is among the damaged lines.
    #[error(
        "unit {unit}: revision {revision} was accepted, but its line of the audit file is damaged: {}; put the newer \
         document in force with `isotherm swap`",
        instead(*in_its_place)
    )]
    Revision {
        /// The unit.
        unit: UnitId,
        /// The revision.
        revision: u64,
        /// The revision that holds in its place; `None` where there is none.
        in_its_place: Option<u64>,
    },
    /// An audit file without entries beside documents that were accepted.
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
    Emptied {
        /// The state folder.
        folder: PathBuf,
        /// How many documents are kept.
        documents: usize,
        /// Whether an older audit file is there, so that older sets hold.
        has_older: bool,
        /// Revisions up to this one are not given again; 0 where nothing is known of them.
        floor: u64,
    },
    /// Entries that were written and are missing at the end of the audit file.
    #[error(
        "the audit file ends with entry {last}, but entry {written} was written: the last {} entries are missing, and older \
         calibrations may be in force than before. Check every unit, and restore what is missing with `isotherm swap`. \
         Revisions continue from {}, so no number is used twice",
        written - last,
        floor.saturating_add(1)
    )]
    Cut {
        /// Number of the last entry that is there; 0 where there is none.
        last: u64,
        /// Number of the last one that was written.
        written: u64,
        /// Revisions up to this one are not given again.
        floor: u64,
    },
    /// The file with the highest revision that may have been given is damaged or missing.
    #[error(
        "{file}, which has the highest revision that may have been given, {reason}: revisions continue from {}, {AHEAD} above \
         the highest that the audit file has",
        floor.saturating_add(1), file = file.display()
    )]
    Unmarked {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        reason: String,
        /// Revisions up to this one are not given again.
        floor: u64,
    },
}

impl Loss {
    /// The unit that it concerns; `None` where it is every one.
    pub(crate) fn unit(&self) -> Option<&UnitId> {
        match self {
            Self::Revision { unit, .. } => Some(unit),
            _ => None,
        }
    }
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
    /// Takes a flaw in, beyond the first ones by its number alone.
    pub(super) fn note(&mut self, flaw: Flaw) {
        if self.flaws.len() < MAX_FLAWS {
            self.flaws.push(flaw);
        } else {
            self.more_flaws += 1;
        }
    }

    /// What an operator should know beside the losses, a line each; none after a clean stop.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let more = Some(self.more_flaws).filter(|more| *more > 0);
        let more = more.map(|more| format!("and {more} more damaged or missing lines of the audit files"));
        let torn = self.torn.iter().map(ToString::to_string);
        self.flaws.iter().map(ToString::to_string).chain(more).chain(torn)
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
