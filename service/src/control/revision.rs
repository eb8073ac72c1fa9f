//! A revision: a document under the number that a unit was given it by; and what each unit has, and is to follow.
//!
//! The swap manager writes here what it has accepted; a unit that appears is given what stands here.

use std::collections::BTreeMap;
use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::operation::Command;
use isotherm_correction::units::Span;
use isotherm_protocol::control::Schedule;
use isotherm_protocol::corrected;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::Source;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::status::Swaps;
use isotherm_protocol::stream::Label;

use super::change::Change;
use super::command::PreLaunchRun;
use super::control_status::{OLDER, UNTRUSTED};
use super::document::Document;
use crate::receive::unit::SwapAccount;

/// A document as a unit is given it.
#[derive(Debug, Clone)]
pub struct Revision {
    /// Its number among those of the unit, and the head of the digest.
    pub number: corrected::Revision,
    /// The document.
    pub document: Arc<Document>,
    /// Where it came from, in words.
    pub source: String,
}

impl Revision {
    /// A calibration that never was a document.
    pub(crate) fn plain(number: corrected::Revision, calibration: Arc<Calibration>) -> Self {
        Self { number, document: Arc::new(Document::plain(calibration)), source: String::new() }
    }

    /// A document under a revision counter.
    #[must_use]
    pub fn new(counter: u64, document: Arc<Document>, source: &Source) -> Self {
        let digest = document.digest().map(|digest| digest.head()).unwrap_or_default();
        Self { number: corrected::Revision { counter, digest }, document, source: source.to_string() }
    }

    /// What the status says of it.
    pub(crate) fn label(&self) -> Label {
        Label { source: self.source.clone(), ..self.document.label.clone() }
    }
}

/// What one unit corrects with, and what is to follow.
#[derive(Debug, Clone, Default)]
pub(crate) struct Plan {
    /// In force from the next tick on, or already.
    pub(crate) current: Option<Arc<Revision>>,
    /// To follow at its tick.
    pub(crate) pending: Option<Change>,
    /// Commands that a unit which appears is given: what an operator wanted of it before the service was restarted.
    pub(crate) intent: Vec<Command>,
}

impl Plan {
    /// Takes a change in; what it replaces before it came in force.
    pub(crate) fn change(&mut self, change: Change) -> Option<Change> {
        let replaced = self.pending.take();
        if change.at == Schedule::NextTick {
            self.current = Some(change.next);
        } else {
            self.pending = Some(change);
        }
        replaced
    }

    /// What was to follow has come in force.
    pub(crate) fn settle(&mut self) {
        if let Some(change) = self.pending.take() {
            self.current = Some(change.next);
        }
    }

    /// Revision counter of what is to follow, and when.
    pub(crate) fn waiting(&self) -> Option<(u64, Schedule)> {
        self.pending.as_ref().map(|change| (change.next.number.counter, change.at))
    }

    /// What a unit that knows nothing yet is to be given, in this order.
    pub(crate) fn changes(&self) -> impl Iterator<Item = Change> {
        let current = self.current.clone();
        let current = current.map(|next| Change { next, at: Schedule::NextTick, slew: Span::ZERO });
        current.into_iter().chain(self.pending.clone())
    }

    /// What is in force and what is to follow.
    pub(crate) fn revisions(&self) -> impl Iterator<Item = &Arc<Revision>> + Clone {
        self.current.iter().chain(self.pending.iter().map(|change| &change.next))
    }

    /// What was accepted last, in force or to follow.
    pub(crate) fn last(&self) -> Option<&Arc<Revision>> {
        self.revisions().last()
    }
}

/// Plans by unit.
#[derive(Debug, Clone, Default)]
pub struct Calibrations {
    pub(crate) plans: BTreeMap<UnitId, Plan>,
}

impl Calibrations {
    /// Adds or replaces the calibration of one unit by one that is no document, as its first revision.
    pub fn insert(&mut self, unit: UnitId, calibration: Arc<Calibration>, digest: [u8; 8]) {
        let current = Revision::plain(corrected::Revision { counter: 1, digest }, calibration);
        self.plans.insert(unit, Plan { current: Some(Arc::new(current)), ..Plan::default() });
    }

    /// The units that have a calibration, or are to be given one at its tick.
    pub(crate) fn units(&self) -> impl Iterator<Item = &UnitId> {
        self.plans.keys().filter(|unit| self.has(unit))
    }

    /// Whether a unit has a calibration, or is to be given one at its tick.
    pub(crate) fn has(&self, unit: &UnitId) -> bool {
        self.plans.get(unit).is_some_and(|plan| plan.last().is_some())
    }
}

/// What the swap manager keeps of one unit.
#[derive(Debug, Clone, Default)]
pub(super) struct Record {
    /// What it was given, and is to follow. What has come in force since may still stand there as what is to follow.
    pub(super) plan: Plan,
    /// Since the service started: what a unit is given first, from its file, is no swap.
    pub(super) swaps: Swaps,
    /// The pre-launch calibration that was asked for last.
    pub(super) pre_launch: Option<PreLaunchRun>,
    /// The overlay that the last one was stored as.
    pub(super) overlay: Option<Digest>,
    /// Why what was put in force again at the start would be refused today, for want of a signature.
    pub(super) untrusted: Option<String>,
    /// Sets that were accepted last and could not be put in force again.
    pub(super) skipped: Option<Skipped>,
}

/// Sets that could not be put in force again.
#[derive(Debug, Clone)]
pub(super) struct Skipped {
    /// SHA-256 of their documents.
    pub(super) digests: Vec<Digest>,
    /// Why, what is in force in their place, and what to do.
    pub(super) words: String,
}

impl Record {
    /// What was accepted last, in force or to follow.
    pub(super) fn last(&self) -> Option<&Arc<Revision>> {
        self.plan.last()
    }

    /// The document that was accepted last; `None` where that never was one.
    pub(super) fn document(&self) -> Option<&Arc<Document>> {
        self.last().map(|last| &last.document).filter(|document| document.text.is_some())
    }

    /// What is in force, where `waiting` is the revision that waits for its tick.
    pub(super) fn in_force(&self, waiting: Option<u64>) -> Option<&Arc<Revision>> {
        let last = self.last()?;
        let waits = waiting == Some(last.number.counter);
        self.plan.current.as_ref().filter(|_| waits).or(Some(last))
    }

    /// Whether this document was accepted last and could not be put in force again.
    pub(super) fn lacks(&self, digest: &Digest) -> bool {
        self.skipped.as_ref().is_some_and(|skipped| skipped.digests.contains(digest))
    }

    /// What is wrong with what was put in force again, until something else is accepted: kinds of faults, with words.
    pub(super) fn problems(&self) -> Vec<(&'static str, String)> {
        let skipped = self.skipped.iter().map(|skipped| (OLDER, skipped.words.clone()));
        skipped.chain(self.untrusted.iter().map(|words| (UNTRUSTED, words.clone()))).collect()
    }

    /// What the unit's status says of its swaps.
    pub(super) fn account(&self) -> SwapAccount {
        SwapAccount { swaps: self.swaps.clone(), overlay: self.overlay, problems: self.problems() }
    }
}
