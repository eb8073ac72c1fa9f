//! What the audit file was found like.

use std::fmt;
use std::path::PathBuf;

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
    /// What became of a last line that was not written to its end.
    pub torn: Option<Torn>,
}

/// A line that was skipped; it stays in its file as it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// The audit file.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: u64,
    /// What is wrong with it.
    pub words: String,
}

/// A last line that was not written to its end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Torn {
    /// Only the line feed was missing: the entry counts, the line feed was added.
    Completed,
    /// It was cut off the audit file.
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

    /// Everything that an operator should know, a line each; none after a clean stop.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let damages = self.damages.iter().map(ToString::to_string);
        let beyond = self.damaged.saturating_sub(self.damages.len() as u64);
        let more =
            (beyond > 0).then(|| format!("and {beyond} more damaged lines of the audit file, all skipped"));
        damages.chain(more).chain(self.torn.iter().map(ToString::to_string))
    }
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}; the line is skipped", self.file.display(), self.line, self.words)
    }
}

impl fmt::Display for Torn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Completed => f.write_str("the last line of the audit file had no line feed: it was added"),
            Self::Moved { to, bytes } => write!(
                f,
                "the last line of the audit file was not written to its end: its {bytes} bytes are in {} now",
                to.display()
            ),
        }
    }
}
