//! A unit that another instance speaks for.

use std::time::Instant;

use isotherm_protocol::digest::Digest;
use isotherm_protocol::journal::{JournalEntry, JournalEvent};
use isotherm_protocol::replay::Follower;
use isotherm_protocol::stream::UnitStream;

use super::Footing;
use super::kept::Kept;

/// Entries of the journal that are remembered until they are in the audit file.
const MOST_ORDERS: usize = 8;

/// While another instance speaks.
#[derive(Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is known, or not, without the others")]
pub(super) struct Following {
    pub(super) follower: Follower,
    pub(super) since: Instant,
    pub(super) kept: Kept,
    pub(super) asked: Option<Instant>,
    /// The stream is what it was when the unit still spoke: it need not have joined to speak again.
    pub(super) doubt: bool,
    /// It lacks nothing, as far as is known.
    pub(super) intact: bool,
    /// Neither the other instance nor the producer is heard: swaps and commands are taken, for this may be the only one left.
    pub(super) isolated: bool,
    /// Since when it has listened for others.
    pub(super) listens: Instant,
    /// What is computed goes out all the same: the instance is active, and the stream has joined.
    pub(super) also_out: bool,
    /// Calibrations and the last command that came with the journal, the newest last.
    pub(super) orders: Vec<JournalEntry>,
    /// Documents that came with the other's memory.
    pub(super) documents: Vec<String>,
}

impl Following {
    /// One that begins at a time, with the stream as it is.
    pub(super) fn new(stream: &UnitStream, now: Instant, footing: Footing) -> Self {
        Self {
            follower: Follower::new(stream.id().clone(), stream.heard()),
            since: now,
            kept: Kept::default(),
            asked: None,
            doubt: footing == Footing::Doubt,
            intact: footing != Footing::Nothing,
            isolated: footing == Footing::Isolated,
            listens: now,
            also_out: false,
            orders: Vec::new(),
            documents: Vec::new(),
        }
    }

    /// The other's memory must be taken anew.
    pub(super) fn lose(&mut self) {
        self.follower.lose();
        (self.asked, self.intact) = (None, false);
    }

    /// What the unit was given before the memory was taken may be in nobody else's audit file any more when the other instance is gone.
    pub(super) fn note_given(&mut self, stream: &UnitStream) {
        let documents = std::mem::take(&mut self.documents);
        let text =
            |digest: &Digest| documents.iter().find(|text| Digest::of(text.as_bytes()) == *digest).cloned();
        let (unit, instance) =
            (stream.id().to_string(), self.follower.instance().unwrap_or_default().to_string());
        let entry = |event| JournalEntry {
            unit: unit.clone(),
            instance: instance.clone(),
            number: 0,
            heard: stream.heard(),
            event,
        };
        self.orders.splice(..0, stream.given(text).map(entry));
    }

    /// Notes what the other instance was ordered, until it is in the audit file. Of commands the last one says what holds.
    pub(super) fn note_order(&mut self, entry: JournalEntry) {
        let is_command = |entry: &JournalEntry| matches!(entry.event, JournalEvent::Commanded { .. });
        if is_command(&entry) {
            self.orders.retain(|before| !is_command(before));
        }
        self.orders.push(entry);
        let beyond = self.orders.len().saturating_sub(MOST_ORDERS);
        self.orders.drain(..beyond);
    }

    pub(super) fn ns(&self, now: Instant) -> u64 {
        u64::try_from(now.saturating_duration_since(self.since).as_nanos()).unwrap_or(u64::MAX)
    }
}
