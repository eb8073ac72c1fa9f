//! Calibration documents that pass by in the journals of units, and the account of these journals.

use std::collections::{BTreeMap, BTreeSet};

use isotherm_protocol::digest::Digest;
use isotherm_protocol::journal::{Joiner, JournalEntry, JournalEvent};
use serde::Serialize;

use super::Attachment;
use crate::replica::join;

/// Media type of a calibration document.
const MEDIA_TYPE: &str = "application/toml";

/// What the journals in a recording came to.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct JournalAccount {
    /// Whole entries, answers to queries among them.
    pub entries: u64,
    /// Entries whose numbers were passed over: they are lost.
    pub missing: u64,
    /// Messages on a journal's topic that are no part of an entry.
    pub unreadable: u64,
}

/// Follows the journals of all units.
#[derive(Debug, Default)]
pub struct Documents {
    joiner: Joiner,
    /// Number of the last entry, by instance and unit.
    last: BTreeMap<(String, String), u64>,
    /// Units whose memory, or whose beginning, is known.
    known: BTreeSet<String>,
    account: JournalAccount,
}

impl Documents {
    /// Takes one message of a journal; the documents in the entry that it completes.
    pub fn take(&mut self, frame: &[u8], received_ns: u64) -> Vec<Attachment> {
        let entry = match join(&mut self.joiner, frame) {
            Ok(Some(entry)) => entry,
            Ok(None) => return Vec::new(),
            Err(_) => {
                self.account.unreadable += 1;
                return Vec::new();
            }
        };
        self.note(&entry);
        let texts = match entry.event {
            JournalEvent::Changed { document, .. } => [document, None],
            JournalEvent::Memory { document, pending, .. } => [document, pending],
            _ => [None, None],
        };
        texts.into_iter().flatten().map(|text| Self::attachment(text.into_bytes(), received_ns)).collect()
    }

    /// A document as a file inside a recording.
    #[must_use]
    pub fn attachment(bytes: Vec<u8>, attached_ns: u64) -> Attachment {
        let name = format!("{}.toml", Digest::of(&bytes));
        Attachment { name, media_type: MEDIA_TYPE.to_owned(), attached_ns, bytes }
    }

    /// Whether a unit's memory or beginning has passed by: from there on its correction can be repeated.
    #[must_use]
    pub fn knows(&self, unit: &str) -> bool {
        self.known.contains(unit)
    }

    /// The account so far.
    #[must_use]
    pub fn account(&self) -> &JournalAccount {
        &self.account
    }

    fn note(&mut self, entry: &JournalEntry) {
        self.account.entries += 1;
        let last = self.last.entry((entry.instance.clone(), entry.unit.clone())).or_insert(entry.number);
        let is_memory = matches!(entry.event, JournalEvent::Memory { .. });
        if is_memory || matches!(entry.event, JournalEvent::Began { .. }) {
            self.known.insert(entry.unit.clone());
        }
        // A memory has the number of the entry before it, and says everything that this one and those before it did.
        if !is_memory {
            self.account.missing += entry.number.saturating_sub(*last).saturating_sub(1);
        }
        *last = entry.number.max(*last);
    }
}

#[cfg(test)]
mod tests {
    use isotherm_protocol::codec;
    use isotherm_protocol::journal::split;

    use super::*;

    fn take(documents: &mut Documents, number: u64, event: JournalEvent) -> Vec<Attachment> {
        let unit = "A-1".to_owned();
        let entry = JournalEntry { unit, instance: "i".into(), number, heard: Default::default(), event };
        let parts = split(&entry);
        parts.iter().flat_map(|part| documents.take(&codec::encode(part).unwrap(), 7)).collect()
    }

    #[test]
    fn documents_are_found_and_lost_entries_counted() {
        let mut documents = Documents::default();
        assert!(take(&mut documents, 4, JournalEvent::Flushed).is_empty());
        assert!(!documents.knows("A-1"));
        let text = |text: &str| Some(text.to_owned());
        // Longer than a part.
        let long = "x".repeat(700_000);
        let event = JournalEvent::Memory { memory: vec![1], document: text(&long), pending: text("b = 2\n") };
        let found = take(&mut documents, 4, event);
        assert_eq!(found.iter().map(|file| file.bytes.len()).collect::<Vec<_>>(), [700_000, 6]);
        assert_eq!(found[1].name, format!("{}.toml", Digest::of(b"b = 2\n")));
        assert!(documents.knows("A-1"));
        take(&mut documents, 5, JournalEvent::Flushed);
        take(&mut documents, 9, JournalEvent::Flushed);
        take(&mut documents, 8, JournalEvent::Flushed);
        assert!(documents.take(b"nonsense", 7).is_empty());
        assert_eq!(documents.account(), &JournalAccount { entries: 5, missing: 3, unreadable: 1 });
    }
}
