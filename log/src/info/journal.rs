//! What acted on a unit beside its frames, and what the service said of it.

use std::collections::BTreeMap;

use isotherm_protocol::codec;
use isotherm_protocol::control::Schedule;
use isotherm_protocol::corrected::Revision;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::journal::{Joiner, JournalEvent, JournalPart};
use isotherm_protocol::status::{Output, State, Status};
use serde::Serialize;

use super::{MAX_LISTED, remember};

/// A calibration that was given to the unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SwapInfo {
    /// When the entry was received (ns since 1970-01-01 UTC).
    pub received_ns: u64,
    /// Its revision.
    #[serde(flatten)]
    pub revision: Revision,
    /// From which tick on.
    pub at: Schedule,
    /// Time over which the change is made (ns).
    pub slew_ns: i64,
    /// Where it came from, in words.
    pub source: String,
    /// SHA-256 of the overlay in it; `None` without one.
    pub overlay: Option<Digest>,
    /// Whether the journal has the document's text.
    pub has_document: bool,
}

/// A command that was given to the unit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CommandInfo {
    /// When the entry was received (ns since 1970-01-01 UTC).
    pub received_ns: u64,
    /// Its name.
    pub command: &'static str,
    /// Whether it was carried out.
    pub accepted: bool,
    /// Why not, or the state that it led to.
    pub words: String,
}

/// What the journal of a unit says.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct JournalInfo {
    /// Entries by their kind.
    pub entries: BTreeMap<&'static str, u64>,
    /// Numbers that are nowhere: entries that were lost.
    pub missing_entries: u64,
    /// Parts that make no entry.
    pub broken_parts: u64,
    /// Why the first of them does not.
    pub first_broken: Option<String>,
    /// Calibrations given to the unit, the first 1024.
    pub swaps: Vec<SwapInfo>,
    /// Commands given to the unit, the first 1024.
    pub commands: Vec<CommandInfo>,
}

/// Follows a journal.
#[derive(Debug, Default)]
pub(super) struct JournalSurvey {
    info: JournalInfo,
    joiner: Joiner,
    /// The last number of each instance.
    numbers: BTreeMap<String, u64>,
}

impl JournalSurvey {
    /// Takes one part.
    ///
    /// # Errors
    /// Where the frame is none.
    pub(super) fn take(&mut self, received_ns: u64, frame: &[u8]) -> Result<(), codec::CodecError> {
        let part = codec::decode::<JournalPart>(frame)?;
        let entry = match self.joiner.join(part) {
            Ok(Some(entry)) => entry,
            Ok(None) => return Ok(()),
            Err(error) => {
                self.info.broken_parts += 1;
                self.info.first_broken.get_or_insert_with(|| error.to_string());
                return Ok(());
            }
        };
        *self.info.entries.entry(entry.event.name()).or_default() += 1;
        if self.numbers.len() < MAX_LISTED || self.numbers.contains_key(&entry.instance) {
            let is_memory = matches!(entry.event, JournalEvent::Memory { .. });
            let last = self.numbers.entry(entry.instance).or_insert(entry.number);
            // A memory bears the number of the entry before it.
            let expected = last.saturating_add(u64::from(!is_memory));
            self.info.missing_entries += entry.number.saturating_sub(expected);
            // One that comes late is no step back.
            *last = entry.number.max(*last);
        }
        match entry.event {
            JournalEvent::Changed { revision, at, slew_ns, document, overlay, source }
                if self.info.swaps.len() < MAX_LISTED =>
            {
                let has_document = document.is_some();
                let swap = SwapInfo { received_ns, revision, at, slew_ns, source, overlay, has_document };
                self.info.swaps.push(swap);
            }
            JournalEvent::Commanded { command, accepted, words } if self.info.commands.len() < MAX_LISTED => {
                let command = command.name();
                self.info.commands.push(CommandInfo { received_ns, command, accepted, words });
            }
            _ => {}
        }
        Ok(())
    }

    pub(super) fn finish(self) -> Option<JournalInfo> {
        let Self { mut info, joiner, .. } = self;
        info.broken_parts += joiner.given_up();
        (!info.entries.is_empty() || info.broken_parts > 0).then_some(info)
    }
}

/// What a unit was doing from some time on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct StateInfo {
    /// When the first such status was received (ns since 1970-01-01 UTC).
    pub received_ns: u64,
    /// The last tick that was published by then (ns on the producer's clock).
    pub last_tick_ns: Option<i64>,
    /// What it was doing.
    pub state: State,
    /// What became of its ticks.
    pub output: Output,
}

/// What the statuses of a unit say.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct StatusInfo {
    /// States in their order, the first 1024.
    pub states: Vec<StateInfo>,
    /// Changes from one to another.
    pub changes: u64,
    /// Versions of the service, in the order of their appearance.
    pub versions: Vec<String>,
    /// Instances of the service, likewise.
    pub instances: Vec<String>,
    #[serde(skip)]
    last: Option<(State, Output)>,
}

impl StatusInfo {
    pub(super) fn take(&mut self, received_ns: u64, status: &Status) {
        let (state, output) = (status.state, status.output);
        let before = self.last.replace((state, output));
        if before != Some((state, output)) {
            self.changes += u64::from(before.is_some());
            if self.states.len() < MAX_LISTED {
                let last_tick_ns = status.last_tick.map(|tick| tick.end_time_ns);
                self.states.push(StateInfo { received_ns, last_tick_ns, state, output });
            }
        }
        remember(&mut self.versions, &status.version);
        remember(&mut self.instances, &status.instance);
    }
}
