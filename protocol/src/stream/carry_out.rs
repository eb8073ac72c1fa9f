//! What a service did to a stream beside giving it frames, done again.

use std::sync::Arc;

use isotherm_correction::navigation::NavigationStep;
use isotherm_correction::unit::{Change, UnitSettings};
use isotherm_correction::units::Span;
use thiserror::Error;

use super::{Label, MemoryError, UnitStream};
use crate::corrected::Revision;
use crate::digest::Digits;
use crate::document::{Document, Problem};
use crate::escape::clipped;
use crate::journal::JournalEvent;

/// Most problems of a document that an error repeats.
const MAX_SHOWN: usize = 3;
/// What of each is shown, in characters.
const LONGEST_SHOWN: usize = 200;

/// Why an event of a journal cannot be carried out; the stream is as before, unless it is said otherwise.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum JournalError {
    /// A calibration that never was a document.
    #[error(
        "revision {revision} was not a document, so the journal lacks its coefficients: the log cannot be corrected \
         from here on"
    )]
    NoDocument {
        /// The revision counter.
        revision: u64,
    },
    /// The text is not the one that the revision names.
    #[error("the document of revision {} has the digest {got}…, must be {}…", .revision.counter, Digits(&.revision.digest))]
    OtherDocument {
        /// The revision.
        revision: Revision,
        /// Head of the text's SHA-256, in hexadecimal digits.
        got: String,
    },
    /// The text is no valid document for this program.
    #[error("the document of revision {revision} is not valid here: {}", words(.problems))]
    Document {
        /// The revision counter.
        revision: u64,
        /// Everything that is wrong with it.
        problems: Vec<Problem>,
    },
    /// The stream was given that revision before, or a later one.
    #[error("revision {got} comes too late: the stream already has revision {given}")]
    OldRevision {
        /// The revision counter.
        got: u64,
        /// The highest that the stream was given.
        given: u64,
    },
    /// The command had another outcome than in the service; it has been given all the same.
    #[error("command {command} was {} by the service and is {} here: {words}", outcome(*.accepted), outcome(!.accepted))]
    OtherOutcome {
        /// Its name.
        command: &'static str,
        /// Whether the service's unit took it.
        accepted: bool,
        /// What the refusing one of the two said.
        words: String,
    },
    /// The settings are none that a unit can have.
    #[error("the unit began with impossible settings: {what}")]
    Settings {
        /// What is wrong with them.
        what: String,
    },
    /// The memory cannot be gone on with.
    #[error(transparent)]
    Memory(#[from] MemoryError),
    /// The memory is that of another unit.
    #[error("the memory is of unit {got}, the stream of unit {need}")]
    OtherUnit {
        /// The unit of the memory.
        got: String,
        /// The unit of the stream.
        need: String,
    },
}

/// The first problems of a document, and how many there are beside them.
fn words(problems: &[Problem]) -> String {
    let (shown, others) = problems.split_at(problems.len().min(MAX_SHOWN));
    let shown: Vec<_> = shown.iter().map(|problem| clipped(&problem.to_string(), LONGEST_SHOWN)).collect();
    let others = if others.is_empty() { String::new() } else { format!("; and {} more", others.len()) };
    format!("{}{others}", shown.join("; "))
}

fn outcome(accepted: bool) -> &'static str {
    if accepted { "accepted" } else { "refused" }
}

impl UnitStream {
    /// Does what the service did, between the same two frames: where [`UnitStream::heard`] is what the entry says.
    ///
    /// [`JournalEvent::Memory`] puts the memory in the place of the stream's own; a stream that stands where the memory
    /// was taken gives the same bits with it and without. [`JournalEvent::Ended`] changes nothing.
    ///
    /// # Errors
    /// [`JournalError`].
    pub fn carry_out(&mut self, event: &JournalEvent) -> Result<(), JournalError> {
        match event {
            JournalEvent::Began { settings, highest_revision } => {
                check(settings)?;
                self.begin_anew(*settings, *highest_revision);
            }
            JournalEvent::Memory { memory, .. } => self.remember(memory)?,
            JournalEvent::Changed { revision, at, slew_ns, document, overlay, source } => {
                let next_counter = self.next_counter();
                if revision.counter < next_counter {
                    let given = next_counter - 1;
                    return Err(JournalError::OldRevision { got: revision.counter, given });
                }
                let Some(text) = document else {
                    return Err(JournalError::NoDocument { revision: revision.counter });
                };
                let parsed = Document::parse(text, None)
                    .map_err(|problems| JournalError::Document { revision: revision.counter, problems })?;
                let digest = parsed.digest;
                if digest.head() != revision.digest {
                    let got = Digits(&digest.head()).to_string();
                    return Err(JournalError::OtherDocument { revision: *revision, got });
                }
                let label = Label { overlay: *overlay, ..Label::of(&parsed.document, digest, source) };
                let (at, slew) = (*at, Span::from_ns(*slew_ns));
                let calibration = Arc::new(parsed.calibration);
                self.schedule(Change { calibration, revision: revision.counter, at, slew }, label);
            }
            JournalEvent::Commanded { command, accepted, words } => {
                let done = self.command(command);
                if done.is_ok() != *accepted {
                    let words = done.err().map_or_else(|| words.clone(), |refusal| refusal.to_string());
                    return Err(JournalError::OtherOutcome {
                        command: command.name(),
                        accepted: *accepted,
                        words,
                    });
                }
            }
            JournalEvent::Flushed => self.flush(),
            JournalEvent::SelfTestExpired => self.expire_self_test(),
            JournalEvent::PreLaunchEnded => self.end_pre_launch(),
            JournalEvent::Ended => {}
        }
        Ok(())
    }

    /// Gives up everything but the serial and the account of what was heard: the unit begins again, with the counter of
    /// its next revision behind `highest_revision`.
    pub fn begin_anew(&mut self, settings: UnitSettings, highest_revision: u64) {
        let anew = Self::new(self.id.clone(), settings).with_revision(highest_revision);
        self.outgoing.clear();
        let outgoing = std::mem::take(&mut self.outgoing);
        *self = Self { heard: self.heard, outgoing, ..anew };
    }

    fn remember(&mut self, memory: &[u8]) -> Result<(), JournalError> {
        let mut remembered = Self::from_memory(memory)?;
        if remembered.id != self.id {
            let (got, need) = (remembered.id.to_string(), self.id.to_string());
            return Err(JournalError::OtherUnit { got, need });
        }
        let mut outgoing = std::mem::take(&mut self.outgoing);
        // The remembered unit counts changes of its temperatures anew.
        outgoing.forget_head();
        remembered.outgoing.take().0.iter().for_each(|tick| outgoing.push(tick));
        *self = Self { outgoing, ..remembered };
        Ok(())
    }
}

/// Checks what came from outside, as far as the unit rests on it.
fn check(settings: &UnitSettings) -> Result<(), JournalError> {
    let (ticks, coning_sculling) = (settings.navigation.ticks(), settings.navigation.coning_sculling());
    match NavigationStep::new(ticks, coning_sculling) {
        Ok(_) => Ok(()),
        Err(error) => Err(JournalError::Settings { what: format!("navigation: {error}") }),
    }
}
