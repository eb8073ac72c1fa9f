//! Revisions that a stream still has something to say of.

use std::collections::VecDeque;

use isotherm_correction::units::Span;
use serde::{Deserialize, Serialize};

use super::Label;
use crate::corrected::Revision;

/// Most first outputs that wait to be asked for; beyond it the oldest is forgotten.
const MAX_IN_FORCE: usize = 64;

/// A revision with its first output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct InForce {
    /// The revision.
    pub revision: Revision,
    /// The producer's run that the output belongs to.
    pub series: u64,
    /// Sequence number of the first raw tick in the output.
    pub sequence: u64,
    /// End of the output (ns on the producer's clock): of that tick, unless several are summed to a navigation step.
    pub end_time_ns: i64,
}

/// A calibration that was given to the unit.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Given {
    pub(super) revision: Revision,
    pub(super) label: Label,
    /// Time over which the change to it is made.
    pub(super) slew: Span,
    /// It has made outputs, which may not have been taken yet.
    made_outputs: bool,
}

/// The revision in force, one that waits for its tick, and those whose ticks have not been taken yet.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Revisions {
    /// In the order in which they were given.
    given: VecDeque<Given>,
    /// Highest counter so far.
    highest: u64,
    /// Counter of the last output that was released.
    released: u64,
    in_force: VecDeque<InForce>,
}

impl Revisions {
    /// None yet; counters go on behind `highest`.
    pub(super) fn new(highest: u64) -> Self {
        Self { given: VecDeque::new(), highest, released: 0, in_force: VecDeque::new() }
    }

    /// Counter of the next one.
    pub(super) fn next_counter(&self) -> u64 {
        self.highest.saturating_add(1)
    }

    /// Enters one.
    pub(super) fn give(&mut self, revision: Revision, label: Label, slew: Span) {
        self.highest = self.highest.max(revision.counter);
        let made_outputs = self.find(revision.counter).is_some_and(|given| given.made_outputs);
        // Mostly the only one.
        self.given.reserve_exact(1);
        self.given.push_back(Given { revision, label, slew, made_outputs });
    }

    /// That of a counter; the latest where a counter was given twice.
    pub(super) fn find(&self, counter: u64) -> Option<&Given> {
        self.given.iter().rfind(|given| given.revision.counter == counter)
    }

    /// Its revision; without a digest where it is not known.
    pub(super) fn revision(&self, counter: u64) -> Revision {
        self.find(counter).map_or(Revision { counter, ..Revision::default() }, |given| given.revision)
    }

    /// Whether an output of this counter is the first of its revision.
    pub(super) fn is_new(&self, counter: u64) -> bool {
        self.released != counter
    }

    /// Notes the first output of a revision.
    #[cold]
    pub(super) fn released(&mut self, counter: u64, first: impl FnOnce(Revision) -> InForce) {
        self.released = counter;
        if let Some(given) = self.given.iter_mut().rfind(|given| given.revision.counter == counter) {
            given.made_outputs = true;
        }
        if self.in_force.len() == MAX_IN_FORCE {
            self.in_force.pop_front();
        }
        // Taken after the same frame.
        self.in_force.reserve_exact(1);
        self.in_force.push_back(first(self.revision(counter)));
    }

    /// The first output of the next revision, once each.
    pub(super) fn take_in_force(&mut self) -> Option<InForce> {
        self.in_force.pop_front()
    }

    /// Drops those before one whose ticks have been taken.
    pub(super) fn taken(&mut self, counter: u64) {
        while self.given.len() > 1 && self.given.front().is_some_and(|given| given.revision.counter < counter)
        {
            self.given.pop_front();
        }
    }

    /// Drops those that have made no output and are not `needed`, by counter: they were replaced before their time.
    pub(super) fn drop_replaced(&mut self, needed: [Option<u64>; 3]) {
        self.given.retain(|given| given.made_outputs || needed.contains(&Some(given.revision.counter)));
    }

    #[cfg(test)]
    pub(super) fn len(&self) -> usize {
        self.given.len()
    }
}
