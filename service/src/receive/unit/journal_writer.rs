//! A unit's journal: what the service does to the stream beside giving it frames, told at once and in order.

use std::sync::Arc;

use isotherm_correction::operation::{Command, Refusal, State};
use isotherm_protocol::codec;
use isotherm_protocol::journal::{JournalEntry, JournalEvent, split};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::stream::UnitStream;

use super::UnitActor;
use crate::control::change::Change;
use crate::control::compressed::Compressed;
use crate::control::revision::Revision;
use crate::receive::fault::FaultKind;

/// Where the frames of journals go; `Err` is one that could not be published.
pub type JournalOutlet = dyn Fn(&UnitId, Vec<u8>) -> Result<(), zenoh::Error> + Send + Sync;

/// The journals of a service instance.
#[derive(Clone)]
pub struct Journal {
    /// The instance: its Zenoh id as text.
    pub instance: Arc<str>,
    /// Where frames go.
    pub outlet: Arc<JournalOutlet>,
}

impl Journal {
    /// Says that nothing is done any more to a unit that has not appeared.
    pub(crate) fn tell_end(&self, unit: &UnitId) {
        let (number, heard, event) = (0, Default::default(), JournalEvent::Ended);
        let entry = JournalEntry {
            unit: unit.to_string(),
            instance: self.instance.to_string(),
            number,
            heard,
            event,
        };
        if let Err(error) = self.publish(unit, &entry) {
            tracing::warn!(%unit, "journal ({}): {}", entry.event.name(), isotherm_bus::words(&error));
        }
    }

    fn publish(&self, unit: &UnitId, entry: &JournalEntry) -> Result<(), zenoh::Error> {
        split(entry).into_iter().try_for_each(|part| (self.outlet)(unit, codec::encode(&part)?))
    }
}

impl std::fmt::Debug for Journal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Journal").field("instance", &self.instance).finish_non_exhaustive()
    }
}

/// Numbers a unit's entries. It keeps none: who was not there asks for the memory.
#[derive(Debug, Default)]
pub(super) struct JournalWriter {
    journal: Option<Journal>,
    /// Number of the last entry.
    number: u64,
}

impl UnitActor {
    /// Has everything told to a journal from here on; a unit that has seen nothing begins it.
    pub(crate) fn journal_to(&mut self, journal: Journal) {
        self.journal_writer.journal = Some(journal);
        self.journal(began);
    }

    /// The service stops: nothing more is done to the unit.
    pub(crate) fn end(&mut self) {
        self.journal(|_| JournalEvent::Ended);
    }

    /// Everything that the unit's stream knows at this moment, as the journal's entry; `instance` is the service's name for
    /// itself.
    pub(crate) fn memory(&self, instance: &str) -> JournalEntry {
        let text = |next: &Arc<Revision>| next.document.text.as_ref().map(Compressed::text);
        let event = JournalEvent::Memory {
            memory: self.stream.memory(),
            document: self.plan.current.as_ref().and_then(text),
            pending: self.plan.pending.as_ref().and_then(|change| text(&change.next)),
        };
        self.entry(instance, event)
    }

    fn entry(&self, instance: &str, event: JournalEvent) -> JournalEntry {
        JournalEntry {
            unit: self.id().to_string(),
            instance: instance.to_owned(),
            number: self.journal_writer.number,
            heard: self.stream.heard(),
            event,
        }
    }

    /// Tells an event that has been applied to the stream, where there is a journal. No event takes frames in: the stream
    /// has heard what it had heard before.
    pub(super) fn journal(&mut self, event: impl FnOnce(&UnitStream) -> JournalEvent) {
        // That of the instance that speaks is the unit's.
        if self.speaks() {
            self.write_entry(event);
        }
    }

    /// Tells what was ordered here, though another instance may have begun to speak since the order was taken: that one does it too. What
    /// a unit is given when it appears is none of this.
    pub(super) fn journal_order(&mut self, event: impl FnOnce(&UnitStream) -> JournalEvent) {
        let has_heard = self.stream.heard().iter().any(|heard| heard.frames > 0);
        if has_heard {
            let event = event(&self.stream);
            self.note_own(event.clone());
            self.write_entry(|_| event);
        } else if self.speaks() {
            self.write_entry(event);
        }
    }

    pub(super) fn write_entry(&mut self, event: impl FnOnce(&UnitStream) -> JournalEvent) {
        let Some(journal) = self.journal_writer.journal.clone() else { return };
        self.journal_writer.number += 1;
        self.tell_entry(&self.entry(&journal.instance, event(&self.stream)));
    }

    /// Says in the journal what the stream knows.
    pub(super) fn journal_memory(&mut self) {
        let Some(journal) = self.journal_writer.journal.clone() else { return };
        self.tell_entry(&self.memory(&journal.instance));
    }

    fn tell_entry(&mut self, entry: &JournalEntry) {
        let Some(journal) = &self.journal_writer.journal else { return };
        if let Err(error) = journal.publish(self.stream.id(), entry) {
            self.fault(FaultKind::JournalUnpublished, 1, || {
                format!(
                    "journal, entry {} ({}): {}",
                    entry.number,
                    entry.event.name(),
                    isotherm_bus::words(&error)
                )
            });
        }
    }
}

/// That the stream knows nothing.
pub(super) fn began(stream: &UnitStream) -> JournalEvent {
    JournalEvent::Began {
        settings: *stream.unit().settings(),
        highest_revision: stream.next_counter().saturating_sub(1),
    }
}

/// That the unit was given a calibration.
pub(super) fn changed(change: &Change) -> JournalEvent {
    let Change { next, at, slew } = change;
    JournalEvent::Changed {
        revision: next.number,
        at: *at,
        slew_ns: slew.as_ns(),
        document: next.document.text.as_ref().map(Compressed::text),
        overlay: next.document.label.overlay,
        source: next.source.clone(),
    }
}

/// That the unit was given a command, and what came of it.
pub(super) fn commanded(command: &Command, done: &Result<State, Refusal>) -> JournalEvent {
    JournalEvent::Commanded {
        command: command.clone(),
        accepted: done.is_ok(),
        words: done.as_ref().map_or_else(ToString::to_string, ToString::to_string),
    }
}
