//! What units have to do with other instances.

use std::sync::Arc;
use std::time::{Duration, Instant};

use isotherm_protocol::key::UnitId;
use isotherm_protocol::status::Fault;

use super::{Intake, guarded, lock, write};
use crate::control::revision::Plan;
use crate::pair::Pair;
use crate::receive::fault::{FaultKind, standing};

/// How long whoever asks something of a unit waits until it is known which instance speaks for it, and how often that is looked for.
const LONGEST_DOUBT: Duration = Duration::from_millis(500);
const DOUBT_INTERVAL: Duration = Duration::from_millis(5);
/// The same where this process stood still: the watch looks long before, unless the machine is too busy to tell.
const LONGEST_STILL: Duration = Duration::from_millis(100);

/// Which instance does what is asked for of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Answers {
    /// This one.
    Here,
    /// Another one, which is asked too.
    Elsewhere,
    /// It was not known when this one was asked: maybe none.
    Unknown,
}

impl Intake {
    /// Has units be silent while another instance speaks for them.
    pub(crate) fn paired_with(self, pair: Arc<Pair>) -> Self {
        Self { pair, ..self }
    }

    /// Where swaps and commands of a unit are for another service: what to tell whoever asks, and whether to leave that to the
    /// service that takes the unit.
    pub(crate) fn is_not_taken(&self, unit: &UnitId) -> Option<(String, bool)> {
        (!self.takes(unit)).then(|| {
            let units = &self.settings.units;
            let words = format!(
                "unit {unit} is not taken by this service (units = {units:?}): ask the service that takes it"
            );
            (words, self.pair.is_taken_elsewhere(unit))
        })
    }

    /// Whether swaps and commands of a unit are this instance's.
    pub(crate) fn speaks_for(&self, unit: &UnitId) -> bool {
        self.with(unit, |actor| actor.speaks()).unwrap_or_else(|| self.pair.speaks_first())
    }

    /// The same; waits where it is being found out, where this process stood still and the units do not know it yet, and where the
    /// instance that spoke is gone and this one is about to.
    pub(crate) fn answers_for(&self, unit: &UnitId) -> Answers {
        let since = Instant::now();
        let pair = &self.pair;
        let stood_still =
            || since.elapsed() < LONGEST_STILL && pair.has_stood_still(Instant::now()).is_some();
        let is_open = || {
            let [doubts, speaks] =
                self.with(unit, |actor| [actor.doubts(), actor.speaks()]).unwrap_or([false, true]);
            stood_still() || doubts || (!speaks && pair.standing().alone_since.is_some())
        };
        let mut was_open = false;
        while since.elapsed() < LONGEST_DOUBT && is_open() {
            was_open = true;
            std::thread::sleep(DOUBT_INTERVAL);
        }
        match self.speaks_for(unit) {
            true if !stood_still() => Answers::Here,
            false if !was_open => Answers::Elsewhere,
            _ => Answers::Unknown,
        }
    }

    /// A unit is forgotten: the journal says so of one that has not appeared, too, so that other instances ask for its history.
    pub(crate) fn tell_end(&self, unit: &UnitId) {
        if let Some(journal) = self.journal.as_ref().filter(|_| !self.has(unit)) {
            journal.tell_end(unit);
        }
    }

    /// This instance's name for itself: its Zenoh id as text.
    pub(crate) fn instance(&self) -> &str {
        &self.pair.me().instance
    }

    /// That the other instance of a pair is not there.
    pub(crate) fn missing_other(&self) -> Option<Fault> {
        self.pair.is_missing_other(Instant::now()).then(|| {
            let words = "the other instance is not there: nobody takes over from this one; start it, or mend the connection";
            standing("other_instance_missing", 1, words.to_owned())
        })
    }

    /// Another instance has published a frame of a unit.
    pub(crate) fn hear(&self, serial: &str, frame: &[u8], now: Instant) {
        let Some(unit) = self.unit(serial) else { return };
        let standing = self.pair.standing();
        guarded(&mut lock(&unit), |actor| actor.hear(frame, now, &standing));
    }

    /// Something that was to be impossible has happened.
    pub(crate) fn alarm(&self, kind: FaultKind, words: String) {
        self.fault(kind, || words);
    }

    /// Has a unit, seen or not, begin with what it had before a restart, or with what another instance has written down.
    pub(crate) fn plan_again(&self, unit: &UnitId, plan: Plan) {
        let mut calibrations = write(&self.calibrations);
        calibrations.plans.insert(unit.clone(), plan.clone());
        drop(calibrations);
        self.with(unit, |actor| actor.plan_again(plan));
    }
}
