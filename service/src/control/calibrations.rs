//! The calibrations of all units, seen or not: what each is to correct with, and what is to follow at a stated tick.
//!
//! The swap manager writes here what it has accepted; a unit that appears is given what stands here.

use std::collections::BTreeMap;
use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::operation::Command;
use isotherm_correction::units::Span;
use isotherm_protocol::control::Schedule;
use isotherm_protocol::corrected::Revision;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::Source;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::stream::Label;

use crate::control::compressed::CompressedText;

/// A calibration as a unit is given it.
#[derive(Debug, Clone)]
pub struct Installable {
    /// Its number among those of the unit, and the head of the digest.
    pub revision: Revision,
    /// The compiled calibration.
    pub calibration: Arc<Calibration>,
    /// What the status says of it; without a digest for a calibration that never was a document.
    pub label: Label,
    /// The text that it was compiled from, for the journal; `None` for a calibration that never was a document.
    pub text: Option<CompressedText>,
}

impl Installable {
    /// A calibration that never was a document.
    #[must_use]
    pub fn plain(revision: Revision, calibration: Arc<Calibration>) -> Self {
        Self { revision, calibration, label: Label::default(), text: None }
    }

    /// One that was compiled from a document; `overlay` was laid over it.
    #[must_use]
    pub fn of_document(
        counter: u64,
        calibration: Arc<Calibration>,
        (label, overlay): (Label, Option<Digest>),
        text: CompressedText,
        source: &Source,
    ) -> Self {
        let digest = label.digest.map(|digest| digest.head()).unwrap_or_default();
        let label = Label { overlay, source: source.to_string(), ..label };
        Self { revision: Revision { counter, digest }, calibration, label, text: Some(text) }
    }
}

/// A calibration that is to take the place of another.
#[derive(Debug, Clone)]
pub struct Change {
    /// What is to be in force.
    pub next: Arc<Installable>,
    /// From which tick on.
    pub at: Schedule,
    /// Time over which the change is made; zero is at once.
    pub slew: Span,
}

/// What one unit corrects with, and what is to follow.
#[derive(Debug, Clone, Default)]
pub struct Plan {
    /// In force from the next tick on, or already.
    pub current: Option<Arc<Installable>>,
    /// To follow at its tick.
    pub pending: Option<Change>,
    /// Commands that a unit which appears is given: what an operator wanted of it before the service was restarted.
    pub intent: Vec<Command>,
}

impl Plan {
    /// Takes a change in; what it replaces before it came in force.
    pub fn change(&mut self, change: Change) -> Option<Change> {
        let replaced = self.pending.take();
        if change.at == Schedule::NextTick {
            self.current = Some(change.next);
        } else {
            self.pending = Some(change);
        }
        replaced
    }

    /// What was to follow has come in force.
    pub fn settle(&mut self) {
        if let Some(change) = self.pending.take() {
            self.current = Some(change.next);
        }
    }

    /// Revision counter of what is to follow, and when.
    #[must_use]
    pub fn waiting(&self) -> Option<(u64, Schedule)> {
        self.pending.as_ref().map(|change| (change.next.revision.counter, change.at))
    }

    /// What a unit that knows nothing yet is to be given, in this order.
    pub fn changes(&self) -> impl Iterator<Item = Change> {
        let current = self.current.clone();
        let current = current.map(|next| Change { next, at: Schedule::NextTick, slew: Span::ZERO });
        current.into_iter().chain(self.pending.clone())
    }
}

/// Plans by unit.
#[derive(Debug, Clone, Default)]
pub struct Calibrations {
    by_unit: BTreeMap<UnitId, Plan>,
}

impl Calibrations {
    /// Adds or replaces the calibration of one unit by one that is no document, as its first revision.
    pub fn insert(&mut self, unit: UnitId, calibration: Arc<Calibration>, digest: [u8; 8]) {
        let revision = Revision { counter: 1, digest };
        let current = Arc::new(Installable::plain(revision, calibration));
        self.by_unit.insert(unit, Plan { current: Some(current), ..Plan::default() });
    }

    /// The plan of one unit, to be changed; an empty one is made where there is none.
    pub fn plan_mut(&mut self, unit: &UnitId) -> &mut Plan {
        self.by_unit.entry(unit.clone()).or_default()
    }

    /// Forgets what one unit was to be given.
    pub fn remove(&mut self, unit: &UnitId) {
        self.by_unit.remove(unit);
    }

    /// The plan of one unit.
    #[must_use]
    pub fn get(&self, unit: &UnitId) -> Option<&Plan> {
        self.by_unit.get(unit)
    }

    /// The units that have a calibration, or are to be given one at its tick.
    pub fn units(&self) -> impl Iterator<Item = &UnitId> {
        self.by_unit.keys().filter(|unit| self.has(unit))
    }

    /// Whether a unit has a calibration, or is to be given one at its tick.
    #[must_use]
    pub fn has(&self, unit: &UnitId) -> bool {
        self.get(unit).is_some_and(|plan| plan.changes().next().is_some())
    }

    /// Units and their plans.
    pub fn iter(&self) -> impl Iterator<Item = (&UnitId, &Plan)> {
        self.by_unit.iter()
    }
}
