//! A unit's stream, made again from what was recorded: the same frames, and between them what the service did.
//!
//! | file | holds |
//! |---|---|
//! | [`scan`] | looks ahead for the journals of a recording |
//! | [`Replica`] | the stream itself |
//! | [`stepper`] | its events one by one |
//!
//! What a replica gives out equals what the service published, to the bit, as long as no notice says otherwise.

mod scan;
pub mod stepper;
#[cfg(test)]
mod tests;
mod words;

use std::sync::Arc;

use isotherm_correction::unit::UnitSettings;
use isotherm_protocol::codec::{self, CodecError};
use isotherm_protocol::control::Schedule;
use isotherm_protocol::corrected::{CorrectedBatch, Revision};
use isotherm_protocol::journal::{Joiner, JournalEntry, JournalEvent};
use isotherm_protocol::key::{Input, UnitId};
use isotherm_protocol::stream::{Label, UnitStream};
use serde::Serialize;

pub use isotherm_protocol::replay::{
    Deed, Mark, MarkKind, NEAR_NS, Notice, Outline, Outlines, Sequencer, UnitOutline,
};
pub(crate) use scan::join;
pub use scan::{check_units, scan};
pub use words::entry_words;

use crate::message::{Message, Topic};
use crate::offline::Loaded;

/// Most notices that are kept word for word; those behind them are counted.
const MOST_NOTICES: usize = 100;

/// How a replica differs, on purpose, from what the service did.
#[derive(Debug, Clone, Default)]
pub struct Changes {
    /// In force from the beginning, in the place of what was.
    pub calibration: Option<Loaded>,
    /// Leaves out the swaps of the journal.
    pub ignore_swaps: bool,
}

impl Changes {
    /// Whether there are any.
    #[must_use]
    pub fn any(&self) -> bool {
        self.calibration.is_some() || self.ignore_swaps
    }
}

/// What became of a recording's journal.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct ReplicaReport {
    /// Frames given to the unit.
    pub frames: u64,
    /// Frames that no stream was given: the service had heard them before its memory was recorded, or was not there.
    pub frames_before: u64,
    /// Entries of the journal carried out.
    pub entries: u64,
    /// Memories of the service that were, to the bit, what the replica had become.
    pub memories_equal: u64,
    /// Where recorder and service did not have the same; the first hundred.
    pub notices: Vec<Notice>,
    /// Notices beyond these.
    pub further_notices: u64,
}

impl ReplicaReport {
    /// Whether everything was as the service had it.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.notices.is_empty()
    }

    fn note(&mut self, notice: Notice) {
        if self.notices.len() < MOST_NOTICES {
            self.notices.push(notice);
        } else {
            self.further_notices += 1;
        }
    }
}

/// What a replica has just done.
#[derive(Debug)]
pub enum Done {
    /// Took a frame.
    Frame {
        /// Of which input.
        input: Input,
        /// When it was received (ns since 1970-01-01 UTC).
        received_ns: u64,
        /// The frame.
        frame: Vec<u8>,
        /// What was wrong with it.
        taken: Result<(), CodecError>,
    },
    /// Carried an entry of the journal out, or left it out.
    Entry {
        /// The entry.
        entry: Box<JournalEntry>,
        /// When it was received (ns since 1970-01-01 UTC).
        received_ns: u64,
        /// Whether it was left out on purpose.
        left_out: bool,
    },
    /// Something is to be said.
    Notice(Notice),
    /// Released everything that waited: the log is over.
    Flushed,
}

/// One unit's stream, driven by what was recorded.
#[derive(Debug)]
pub struct Replica {
    id: UnitId,
    /// `None` before the first entry that one begins with.
    stream: Option<UnitStream>,
    sequencer: Sequencer,
    joiner: Joiner,
    changes: Changes,
    /// Whether what still waits is released at the end: there is no service that would go on with it.
    flush_due: bool,
    report: ReplicaReport,
}

impl Replica {
    /// Of a unit whose journal was recorded.
    #[must_use]
    pub fn new(id: UnitId, outline: Outline, changes: Changes) -> Self {
        Self {
            id,
            stream: None,
            sequencer: Sequencer::new(outline),
            joiner: Joiner::new(),
            changes,
            flush_due: false,
            report: ReplicaReport::default(),
        }
    }

    /// Of a unit without a journal: with these settings, and a calibration that is in force from the first tick on.
    #[must_use]
    pub fn without_journal(id: UnitId, settings: UnitSettings, calibration: Option<&Loaded>) -> Self {
        let mut stream = UnitStream::new(id.clone(), settings).keeping_ticks();
        if let Some(loaded) = calibration {
            stream = loaded.installed(stream);
        }
        let sequencer = Sequencer::without_journal();
        let unchanged = Self::new(id, Outline::default(), Changes::default());
        Self { stream: Some(stream), sequencer, flush_due: true, ..unchanged }
    }

    /// Takes a message of the unit, in recorded order; [`Replica::step`] then says what comes of it.
    pub fn take(&mut self, message: Message) {
        let Message { topic, received_ns, frame } = message;
        match topic {
            Topic::Raw(_, stream) => self.sequencer.frame(Input::Raw(stream), received_ns, frame),
            Topic::Reference(_) => self.sequencer.frame(Input::Reference, received_ns, frame),
            Topic::Journal(_) if !self.flush_due => match join(&mut self.joiner, &frame) {
                Ok(Some(entry)) => self.sequencer.entry(entry, received_ns),
                Ok(None) => {}
                Err(words) => self.report.note(Notice::Damaged { words }),
            },
            Topic::Corrected(_) => self.sequencer.published(received_ns, || {
                Some(codec::decode::<CorrectedBatch>(&frame).ok()?.ticks.first()?.sequence)
            }),
            Topic::Journal(_) | Topic::Status(_) | Topic::Service(_) | Topic::Other(_) => {}
        }
    }

    /// The log is over.
    pub fn finish(&mut self) {
        self.sequencer.finish();
    }

    /// Does the next thing that can be done; `None` until more has been taken.
    ///
    /// `ready` is called before an entry is carried out: corrected ticks that are ready then were made before it.
    pub fn step(&mut self, ready: &mut dyn FnMut(&mut UnitStream)) -> Option<Done> {
        let done = match self.sequencer.next_deed() {
            Some(Deed::Frame { input, received_ns, frame }) => {
                self.report.frames += 1;
                let taken = self.stream.as_mut().map_or(Ok(()), |stream| stream.receive(input, &frame));
                Done::Frame { input, received_ns, frame, taken }
            }
            Some(Deed::Entry { entry, received_ns, anchor }) => {
                if let Some(stream) = &mut self.stream {
                    ready(stream);
                }
                let left_out = self.carry_out(&entry, anchor);
                Done::Entry { entry, received_ns, left_out }
            }
            Some(Deed::Notice(notice)) => {
                self.report.note(notice.clone());
                Done::Notice(notice)
            }
            None => return self.flush(),
        };
        // Asked for by the service after every frame; it is part of the memory.
        if let Some(stream) = &mut self.stream {
            while stream.take_in_force().is_some() {}
        }
        self.report.frames_before = self.sequencer.unheard();
        Some(done)
    }

    /// Releases what waits, once, behind the end of a log without a journal.
    fn flush(&mut self) -> Option<Done> {
        let over = self.flush_due && self.sequencer.is_over();
        let stream = self.stream.as_mut().filter(|stream| over && stream.is_waiting())?;
        stream.flush();
        Some(Done::Flushed)
    }

    /// Carries an entry out; whether it was left out on purpose.
    fn carry_out(&mut self, entry: &JournalEntry, anchor: bool) -> bool {
        let JournalEntry { event, number, .. } = entry;
        self.report.entries += 1;
        match event {
            JournalEvent::Memory { .. } if !anchor && self.changes.any() => return true,
            JournalEvent::Memory { memory, .. } if !anchor => self.verify(memory, *number),
            JournalEvent::Changed { revision, at, .. } => {
                let unused = |stream: &UnitStream| stream.unit().observation().is_none();
                let at_beginning = *at == Schedule::NextTick && self.stream.as_ref().is_none_or(unused);
                if at_beginning && self.changes.calibration.is_some() {
                    self.install(*revision);
                    return true;
                }
                if !at_beginning && self.changes.ignore_swaps {
                    return true;
                }
            }
            _ => {}
        }
        let fresh = || UnitStream::new(self.id.clone(), UnitSettings::default()).keeping_ticks();
        if anchor {
            self.stream = Some(fresh());
        }
        let stream = self.stream.get_or_insert_with(fresh);
        if let Err(error) = stream.carry_out(event) {
            let words = error.to_string();
            self.report.note(Notice::NotCarriedOut { entry: *number, words });
            if anchor {
                // Nothing to go on with: better no ticks than any.
                self.stream = None;
                return false;
            }
        }
        match event {
            // Until the journal gives the unit a calibration; under the counter before that one's.
            JournalEvent::Began { highest_revision, .. } => {
                self.install(Revision { counter: *highest_revision, digest: [0; 8] });
            }
            JournalEvent::Memory { .. } => {
                let revision = self.stream.as_ref().map(UnitStream::revision).unwrap_or_default();
                self.install(revision);
            }
            _ => {}
        }
        false
    }

    /// Puts the calibration of [`Changes`] in force under a counter that another one had; nothing without one.
    fn install(&mut self, revision: Revision) {
        let (Some(loaded), Some(stream)) = (&self.changes.calibration, &mut self.stream) else { return };
        let revision = Revision { digest: loaded.digest, ..revision };
        stream.install_as(Arc::clone(&loaded.calibration), revision, Label::default());
    }

    /// Compares the service's memory with the replica's own.
    fn verify(&mut self, memory: &[u8], number: u64) {
        let Some(stream) = &self.stream else { return };
        let own = stream.memory();
        if own == memory {
            self.report.memories_equal += 1;
            return;
        }
        let words = match UnitStream::from_memory(memory) {
            Ok(service) => difference(stream, &service),
            Err(error) => error.to_string(),
        };
        self.report.note(Notice::OtherMemory { entry: number, words });
    }

    /// The stream, once it has begun.
    #[must_use]
    pub fn stream(&self) -> Option<&UnitStream> {
        self.stream.as_ref()
    }

    /// Likewise, to take from.
    pub fn stream_mut(&mut self) -> Option<&mut UnitStream> {
        self.stream.as_mut()
    }

    /// What became of the journal so far.
    #[must_use]
    pub fn report(&self) -> &ReplicaReport {
        &self.report
    }
}

/// In what two streams differ, as far as it can be seen from outside.
fn difference(own: &UnitStream, service: &UnitStream) -> String {
    let mut words = Vec::new();
    for input in Input::ALL {
        let frames = |stream: &UnitStream| stream.heard().get(input.index()).map_or(0, |heard| heard.frames);
        if frames(own) != frames(service) {
            words.push(format!("{} frames {} here, {} there", input.name(), frames(own), frames(service)));
        }
    }
    let counters = own.counters().into_iter().zip(service.counters());
    let other = counters.filter(|(own, service)| own.value != service.value);
    words.extend(
        other.map(|(own, service)| format!("{} {} here, {} there", own.name, own.value, service.value)),
    );
    if own.revision() != service.revision() {
        let counters = (own.revision().counter, service.revision().counter);
        words.push(format!("revision {} here, {} there", counters.0, counters.1));
    }
    if own.unit().state() != service.unit().state() {
        words.push(format!("state {} here, {} there", own.unit().state(), service.unit().state()));
    }
    if words.is_empty() { "in the readings it remembers".to_owned() } else { words.join(", ") }
}
