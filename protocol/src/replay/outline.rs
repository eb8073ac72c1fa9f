//! What the journals of a recording hold, before any of it is gone through: where each entry stands, not what it says.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::journal::{JournalEntry, JournalEvent};
use crate::key::{Input, UnitId};
use crate::stream::Heard;

/// Kind of an entry, as far as its place hangs on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MarkKind {
    /// The stream knew nothing.
    Began,
    /// Everything that the stream knew.
    Memory,
    /// The service stopped.
    Ended,
    /// Anything else.
    Other,
}

/// Where an entry stands among those of its instance: entries by number, a memory behind the entry whose number it has.
pub(super) type Place = (u64, bool, u64);

/// An entry of a journal, without what it says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mark {
    /// The service instance.
    pub instance: Arc<str>,
    /// Number of the entry.
    pub number: u64,
    /// Its kind.
    pub kind: MarkKind,
    /// What the stream had been given before it.
    pub heard: [Heard; Input::ALL.len()],
    /// When it was received (ns since 1970-01-01 UTC).
    pub received_ns: u64,
}

impl Mark {
    /// That of an entry.
    #[must_use]
    pub fn of(entry: &JournalEntry, received_ns: u64) -> Self {
        Self {
            instance: entry.instance.as_str().into(),
            number: entry.number,
            kind: match entry.event {
                JournalEvent::Began { .. } => MarkKind::Began,
                JournalEvent::Memory { .. } => MarkKind::Memory,
                JournalEvent::Ended => MarkKind::Ended,
                _ => MarkKind::Other,
            },
            heard: entry.heard,
            received_ns,
        }
    }

    pub(super) fn place(&self) -> Place {
        let frames = self.heard.iter().map(|heard| heard.frames).sum();
        (self.number, self.kind == MarkKind::Memory, frames)
    }

    /// Whether a stream can begin here.
    fn begins(&self) -> bool {
        matches!(self.kind, MarkKind::Began | MarkKind::Memory)
    }
}

/// The journal of one unit in a recording.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Outline {
    /// In the order in which they act, one service instance behind the other.
    pub(super) marks: Vec<Mark>,
    /// Instances that were at work beside another one; their entries are left out.
    pub beside: Vec<Arc<str>>,
    /// Entries at the front of an instance that no stream can begin with, and that no memory holds.
    pub without_beginning: u64,
}

impl Outline {
    /// Puts the entries of one unit, as they were received, in order.
    #[must_use]
    pub fn new(marks: Vec<Mark>) -> Self {
        let mut instances: Vec<(Arc<str>, Vec<Mark>)> = Vec::new();
        for mark in marks {
            match instances.iter_mut().find(|(instance, _)| *instance == mark.instance) {
                Some((_, marks)) => marks.push(mark),
                None => instances.push((Arc::clone(&mark.instance), vec![mark])),
            }
        }
        let mut outline = Self::default();
        // An instance that the one before had not left when it came works beside it.
        let mut left_ns = 0;
        for (instance, mut marks) in instances {
            let first_ns = marks.iter().map(|mark| mark.received_ns).min().unwrap_or(0);
            if first_ns < left_ns {
                outline.beside.push(instance);
                continue;
            }
            left_ns = marks.iter().map(|mark| mark.received_ns).max().unwrap_or(0);
            marks.sort_by_key(Mark::place);
            marks.dedup_by_key(|mark| mark.place());
            let begin = marks.iter().position(Mark::begins).unwrap_or(marks.len());
            if marks.get(begin).is_none_or(|mark| mark.kind != MarkKind::Memory) {
                outline.without_beginning += begin as u64;
            }
            outline.marks.extend(marks.drain(begin..));
        }
        outline
    }

    /// Whether there is anything that a stream can begin with.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.marks.is_empty()
    }

    /// How many entries there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.marks.len()
    }
}

/// The journals of a recording, and what else is in it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Outlines {
    /// Every unit of which there is any message.
    pub units: BTreeMap<UnitId, UnitOutline>,
    /// Parts of entries that could not be put together, in words.
    pub damaged: Vec<String>,
}

/// What a recording has of one unit.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct UnitOutline {
    /// Its journal.
    pub journal: Outline,
    /// Whether there are raw frames or references.
    pub has_raw: bool,
    /// Whether there are corrected frames.
    pub has_corrected: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mark(instance: &str, number: u64, kind: MarkKind, frames: u64, received_ns: u64) -> Mark {
        let mut heard = [Heard::default(); 5];
        heard[0].frames = frames;
        Mark { instance: instance.into(), number, kind, heard, received_ns }
    }

    fn numbers(outline: &Outline) -> Vec<(String, u64, bool)> {
        let marks = outline.marks.iter();
        marks.map(|mark| (mark.instance.to_string(), mark.number, mark.kind == MarkKind::Memory)).collect()
    }

    #[test]
    fn a_memory_stands_behind_the_entry_whose_number_it_has_whenever_it_came() {
        use MarkKind::{Memory, Other};
        let outline = Outline::new(vec![
            mark("a", 6, Other, 9, 10),
            mark("a", 5, Memory, 7, 11),
            mark("a", 7, Other, 20, 12),
            mark("a", 7, Other, 20, 13),
            mark("a", 7, Memory, 30, 14),
        ]);
        let expected = [("a", 5, true), ("a", 6, false), ("a", 7, false), ("a", 7, true)];
        assert_eq!(numbers(&outline), expected.map(|(i, n, m)| (i.to_owned(), n, m)));
    }

    #[test]
    fn what_a_memory_holds_already_is_no_loss_and_what_nothing_holds_is() {
        use MarkKind::{Began, Memory, Other};
        let held = Outline::new(vec![mark("a", 3, Other, 1, 1), mark("a", 4, Memory, 5, 2)]);
        assert_eq!((held.len(), held.without_beginning), (1, 0));
        let lost = Outline::new(vec![mark("a", 3, Other, 1, 1), mark("a", 4, Began, 5, 2)]);
        assert_eq!((lost.len(), lost.without_beginning), (1, 1));
        let none = Outline::new(vec![mark("a", 3, Other, 1, 1)]);
        assert!(none.is_empty() && none.without_beginning == 1);
    }

    #[test]
    fn of_two_services_at_once_the_first_is_followed_and_of_two_one_behind_the_other_both() {
        use MarkKind::{Began, Ended, Other};
        let behind = Outline::new(vec![
            mark("a", 1, Began, 0, 1),
            mark("a", 2, Ended, 9, 5),
            mark("b", 1, Began, 0, 6),
        ]);
        assert_eq!((behind.len(), behind.beside.len()), (3, 0));
        let beside = Outline::new(vec![
            mark("a", 1, Began, 0, 1),
            mark("b", 1, Began, 0, 3),
            mark("a", 2, Other, 9, 5),
        ]);
        assert_eq!((beside.len(), beside.beside.as_slice()), (2, ["b".into()].as_slice()));
    }
}
