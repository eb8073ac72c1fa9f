//! The audit file as a chain: the digest of each entry covers the entry and the digest before it.
//!
//! `chain` of a line is the SHA-256 of 64 hexadecimal digits, the digest before it, and of the line as it would be without
//! `chain` and `crc`. The first line of a file, and the first of all, name the digest before them as `previous`: zeros where
//! nothing stood there, and where the line before it is of a version that wrote no digests, the SHA-256 of that line.
//!
//! Whoever changes, removes, inserts or exchanges lines breaks it. Whoever may write the file can make every digest anew from
//! some line on, or cut the end off: only a digest that was noted elsewhere tells.

use thiserror::Error;

use super::line::{LineError, Name, checked, read, sealed, with_last, without_last};
use super::{AuditEntry, Digest};

/// What stands before the digits of an entry's digest, which is the last field before the checksum.
const CHAIN: &str = ",\"chain\":\"";
/// What stands before the digits of the digest that it carries on from.
const PREVIOUS: &str = ",\"previous\":\"";
/// Before the first entry of all.
const NOTHING: Digest = Digest([0; 32]);

/// The end of a chain, where the next entry carries on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Chain {
    /// Digest of the last entry; `None` where there is none.
    last: Option<Digest>,
    /// An entry has a digest.
    begun: bool,
    /// The next line names what it carries on from.
    names_previous: bool,
}

impl Chain {
    /// Passes a line that was read; a damaged one counts as none.
    pub fn pass(&mut self, line: &[u8]) {
        let Ok(json) = checked(line) else { return };
        match Link::of(&json) {
            Some(chained) => (self.last, self.begun) = (Some(chained.digest), true),
            None if !self.begun => self.last = Some(Digest::of(json.as_bytes())),
            None => {}
        }
    }

    /// The next line is the first of a file.
    pub fn begin_file(&mut self) {
        self.names_previous = true;
    }

    /// The next entry as a line, line feed included; the chain goes on behind it.
    ///
    /// # Errors
    /// [`LineError`] as [`AuditEntry::to_line`]; the chain ends where it did, then.
    pub fn line(&mut self, entry: &AuditEntry) -> Result<String, LineError> {
        let mut json = entry.to_json()?;
        let previous = self.last.unwrap_or(NOTHING);
        if self.names_previous || !self.begun {
            json = with_last(json, PREVIOUS, previous);
        }
        let digest = digest(previous, &json);
        let line = sealed(with_last(json, CHAIN, digest))?;
        *self = Self { last: Some(digest), begun: true, names_previous: false };
        Ok(line)
    }
}

fn digest(previous: Digest, json: &str) -> Digest {
    Digest::of(&[previous.to_string().as_bytes(), json.as_bytes()].concat())
}

/// What a line says of the chain.
struct Link {
    /// The line without digest and checksum.
    json: String,
    digest: Digest,
    previous: Option<Digest>,
}

impl Link {
    /// `None` for a line of a version that wrote no digests.
    fn of(json: &str) -> Option<Self> {
        let (json, digits) = without_last(json, CHAIN)?;
        let previous = without_last(&json, PREVIOUS).and_then(|(_, digits)| digits.parse().ok());
        Some(Self { digest: digits.parse().ok()?, previous, json })
    }
}

/// What is broken about a line, and what to do about it.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Fault {
    /// The line is no entry, or was damaged.
    #[error("{0}; compare it with a backup")]
    Line(#[from] LineError),
    /// Entries are missing before it.
    #[error("{}", missing(*.first, *.last, "before"))]
    Missing {
        /// Number of the first of them.
        first: u64,
        /// Number of the last of them.
        last: u64,
    },
    /// An entry with a higher number stands before it.
    #[error("comes after entry {last}: lines were exchanged or inserted; compare both with a backup")]
    Behind {
        /// The highest number before it.
        last: u64,
    },
    /// The digest does not fit.
    #[error(
        "its digest is wrong: the entry was changed, or the one before it, with its digest; compare both with a \
         backup"
    )]
    Digest,
    /// It has no digest, though entries before it have.
    #[error(
        "has no digest, which entries from {begins} on must have: it was inserted, or written by an older version; compare \
         it with a backup"
    )]
    Without {
        /// Number of the first entry with a digest.
        begins: u64,
    },
    /// It is the first line of a file, and carries on from another entry than the last of the file before.
    #[error(
        "does not continue from the last entry before it: the end of the file before was changed, or a file is \
         missing; compare it with a backup"
    )]
    Elsewhere,
    /// It is the first of all, and does not say what it carries on from.
    #[error(
        "continues from an entry that is not here: the beginning of the file is missing; look for it in a backup"
    )]
    Headless,
    /// Entries are missing at the end.
    #[error("{}", missing(*.first, *.last, "behind"))]
    Cut {
        /// Number of the first of them.
        first: u64,
        /// Number of the last that was written.
        last: u64,
    },
}

fn missing(first: u64, last: u64, side: &str) -> String {
    if first == last {
        format!("entry {first} is missing {side} it; look for it in a backup")
    } else {
        format!("entries {first} to {last} are missing {side} it; look for them in a backup")
    }
}

/// A line at which the chain is broken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Broken {
    /// Number of the entry, where it can be read.
    pub number: Option<u64>,
    /// Serial of its unit, where it names one.
    pub unit: Option<String>,
    /// What is broken.
    pub fault: Fault,
}

/// An entry and its digest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Head {
    /// Number of the entry.
    pub number: u64,
    /// Its digest, which covers everything before it.
    pub digest: Digest,
}

/// Verifies a chain, line by line.
#[derive(Debug, Clone, Default)]
pub struct Verifier {
    /// Entries read.
    pub entries: u64,
    /// Number of the first entry.
    pub first: Option<u64>,
    /// Number of the first entry with a digest.
    pub begins: Option<u64>,
    /// The last entry with a digest.
    pub head: Option<Head>,
    last: Option<Digest>,
    /// Highest number so far.
    highest: u64,
    /// Unit of that entry.
    unit: Option<String>,
    /// Lines that cannot be read behind the last entry: what the next digest is made over is not known.
    lost: u64,
    /// No older entries were removed for their age.
    from_first: bool,
}

impl Verifier {
    /// Of a chain that is there from its first entry on: another one at its beginning is a break.
    #[must_use]
    pub fn from_first() -> Self {
        Self { from_first: true, ..Self::default() }
    }

    /// Takes the next line in, with or without its line feed; what is broken at it.
    pub fn line(&mut self, line: &[u8]) -> Option<Broken> {
        let read = checked(line).and_then(|json| Ok((read(&json)?, json)));
        let (Name { number, unit }, json) = match read {
            Ok(read) => read,
            Err(error) => return Some(self.unreadable(line, error)),
        };
        self.entries += 1;
        let chained = Link::of(&json);
        let fault = self.judge(number, chained.as_ref()).err();
        self.first = self.first.or(Some(number));
        // What stands in another's place changes nothing for those behind it.
        if number > self.highest && (chained.is_some() || self.begins.is_none()) {
            let digest =
                chained.as_ref().map_or_else(|| Digest::of(json.as_bytes()), |chained| chained.digest);
            (self.last, self.lost) = (Some(digest), 0);
            (self.highest, self.unit) = (number, unit.clone());
            if chained.is_some() {
                self.begins = self.begins.or(Some(number));
                self.head = Some(Head { number, digest });
            }
        }
        fault.map(|fault| Broken { number: Some(number), unit, fault })
    }

    /// What is missing at the end, where the number of the last entry that was written is known.
    #[must_use]
    pub fn end(&self, written: Option<u64>) -> Option<Broken> {
        let first = self.highest.saturating_add(1).saturating_add(self.lost);
        let last = written.filter(|written| *written >= first)?;
        let fault = Fault::Cut { first, last };
        Some(Broken { number: Some(self.highest), unit: self.unit.clone(), fault })
    }

    fn unreadable(&mut self, line: &[u8], error: LineError) -> Broken {
        self.lost += 1;
        let text = String::from_utf8_lossy(line);
        let behind = |mark: &str| text.split_once(mark).map(|(_, rest)| rest);
        let digits = behind("\"number\":").and_then(|rest| rest.split_once(','));
        let unit = behind("\"unit\":\"").and_then(|rest| rest.split_once('"'));
        Broken {
            number: digits.and_then(|(digits, _)| digits.parse().ok()),
            unit: unit.map(|(unit, _)| unit.chars().take(64).collect()),
            fault: Fault::Line(error),
        }
    }

    fn judge(&self, number: u64, link: Option<&Link>) -> Result<(), Fault> {
        if self.first.is_some() && number <= self.highest {
            return Err(Fault::Behind { last: self.highest });
        }
        if let (None, Some(begins)) = (link, self.begins) {
            return Err(Fault::Without { begins });
        }
        if self.lost > 0 {
            return Ok(());
        }
        let previous = link.map(|link| link.previous);
        if self.first.is_none() && previous == Some(None) {
            return Err(Fault::Headless);
        }
        // Where older files are removed, the oldest that is there may begin at any number, unless it says that nothing stood before.
        let carries_on = self.first.is_some() || self.from_first || previous == Some(Some(NOTHING));
        if carries_on && number > self.highest.saturating_add(1) {
            return Err(Fault::Missing { first: self.highest + 1, last: number - 1 });
        }
        let Some(link) = link else { return Ok(()) };
        let previous = match (self.last, link.previous) {
            (Some(last), Some(previous)) if last != previous => return Err(Fault::Elsewhere),
            (last, previous) => last.or(previous).unwrap_or(NOTHING),
        };
        if digest(previous, &link.json) == link.digest { Ok(()) } else { Err(Fault::Digest) }
    }
}

#[cfg(test)]
mod tests;
