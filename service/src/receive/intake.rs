//! What the receive threads do with a raw message: find its unit, have it corrected, survive whatever it is.

mod appear;
mod paired;
mod units;

pub(crate) use paired::Answers;

use std::any::Any;
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};
use std::time::Instant;

use isotherm_protocol::control::Schedule;
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::status::{Fault, Status};
use zenoh::key_expr::OwnedKeyExpr;

use crate::config::{Settings, chunks, includes};
use crate::control::Inbox;
use crate::control::change::Change;
use crate::control::revision::{Calibrations, Plan};
use crate::observe::totals::Totals;
use crate::pair::Pair;
use crate::receive::fault::{FaultKind, FaultLog};
use crate::receive::unit::{Journal, Present, SwapAccount, UnitActor};
pub use units::OutletMaker;
use units::{Outlets, Unit, Units};

/// All units, and what belongs to none.
pub struct Intake {
    settings: Settings,
    /// Chunks of the serials that are taken.
    taken: Vec<OwnedKeyExpr>,
    /// Locked after the units, where both are.
    calibrations: RwLock<Calibrations>,
    outlets: Outlets,
    /// To whom units tell what only the swap manager can write down.
    inbox: Option<Inbox>,
    /// Where the journals of units go.
    journal: Option<Journal>,
    /// This instance among the others.
    pair: Arc<Pair>,
    units: RwLock<Units>,
    faults: Mutex<FaultLog>,
    looked_for_room: Mutex<Option<Instant>>,
    /// Units with a calibration that there was no place for. Locked last.
    refused: Mutex<BTreeSet<UnitId>>,
}

impl std::fmt::Debug for Intake {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Intake")
            .field("units", &self.units)
            .field("faults", &self.faults)
            .finish_non_exhaustive()
    }
}

impl Intake {
    /// An intake without units.
    #[must_use]
    pub fn new(settings: Settings, calibrations: Calibrations, outlets: OutletMaker) -> Self {
        let calibrations = RwLock::new(calibrations);
        Self {
            taken: chunks(&settings.units),
            // Alone, unless it is paired.
            pair: Arc::new(Pair::new(&settings, String::new(), 0, Vec::new())),
            settings,
            calibrations,
            outlets: Outlets::new(outlets),
            inbox: None,
            journal: None,
            units: RwLock::default(),
            faults: Mutex::default(),
            looked_for_room: Mutex::default(),
            refused: Mutex::default(),
        }
    }

    /// Has every unit that appears tell the swap manager what it has to tell.
    pub(crate) fn reporting_to(self, inbox: Inbox) -> Self {
        Self { inbox: Some(inbox), ..self }
    }

    /// Has every unit that appears keep a journal.
    #[must_use]
    pub fn journaling_to(self, journal: Journal) -> Self {
        Self { journal: Some(journal), ..self }
    }

    /// Makes the outlet of every unit that has a calibration, as far as there is a place for it; gives how many.
    pub(crate) fn prepare(&self) -> usize {
        let calibrations = read(&self.calibrations);
        let taken = calibrations.units().filter(|unit| self.takes(unit));
        let units: Vec<_> = taken.take(self.settings.max_units).cloned().collect();
        drop(calibrations);
        let made = units.iter().filter(|unit| match self.outlets.prepare(unit) {
            Ok(()) => true,
            Err(error) => {
                tracing::warn!(%unit, "no publisher yet, tried again when the unit appears: {error}");
                false
            }
        });
        made.count()
    }

    /// Takes one message; whether subscribers of the status should hear of it at once. A rate reference makes no unit.
    ///
    /// Whatever goes wrong is counted; nothing gets out of here but the answer.
    pub fn receive(&self, key: &str, payload: Option<&[u8]>, arrival: Instant) -> bool {
        let Some((serial, input)) = key::parse_input(key) else {
            self.fault(FaultKind::UnknownStream, || {
                format!("{key} is not an input: raw/gyro, raw/accel, raw/temp, raw/health or reference")
            });
            return false;
        };
        let Some(frame) = payload else {
            self.fault(FaultKind::Deletion, || format!("{key}: a deletion has no effect"));
            return false;
        };
        let known = self.unit(serial);
        let Some(unit) = known.or_else(|| self.appear(serial, input, frame, arrival)) else { return false };
        let mut actor = lock(&unit);
        if let Some(short) = self.pair.has_stood_still(arrival) {
            actor.follow(arrival, Pair::footing(short));
        }
        // After a panic it is due.
        guarded(&mut actor, |actor| actor.receive(input, frame, arrival)).unwrap_or(true)
    }

    /// Knows nothing more of a unit; it appears anew with its next message.
    pub(crate) fn forget(&self, unit: &UnitId) {
        write(&self.calibrations).plans.remove(unit);
        self.outlets.drop_prepared(unit);
        let gone = write(&self.units).remove(unit);
        if let Some(unit) = gone {
            guarded(&mut lock(&unit), |actor| {
                actor.flush();
                actor.end();
            });
        }
    }

    /// Whether a unit is one of those that this service takes (`units`).
    pub(crate) fn takes(&self, unit: &UnitId) -> bool {
        includes(&self.taken, unit.as_str())
    }

    /// Whether a unit has appeared.
    pub(crate) fn has(&self, unit: &UnitId) -> bool {
        read(&self.units).by_serial.contains_key(unit)
    }

    /// The unit of a serial, if it has appeared.
    fn unit(&self, serial: &str) -> Option<Unit> {
        read(&self.units).by_serial.get(serial).map(Arc::clone)
    }

    /// Counts a fault that belongs to no unit, and logs the first of its kind.
    fn fault(&self, kind: FaultKind, words: impl FnOnce() -> String) {
        let telling = lock(&self.faults).note(kind, 1, words);
        if let Some(telling) = telling {
            tracing::warn!(kind = kind.name(), "{telling}");
        }
    }

    /// Faults that belong to no unit.
    pub(crate) fn faults(&self) -> Vec<Fault> {
        lock(&self.faults).faults()
    }

    /// Has a unit, seen or not, correct with another calibration from a tick on, and tells it its account of swaps. Gives
    /// the revision counter of a change that was waiting and is replaced.
    pub(crate) fn change(&self, unit: &UnitId, change: Change, account: SwapAccount) -> Option<u64> {
        let before = {
            let mut calibrations = write(&self.calibrations);
            calibrations.plans.entry(unit.clone()).or_default().change(change.clone())
        };
        // Behind the entry above: a unit that appears in between has been given it.
        match self.with(unit, |actor| {
            actor.tell_swaps(account);
            actor.change(change)
        }) {
            Some(replaced) => replaced,
            None => before.map(|change| change.next.number.counter),
        }
    }

    /// The change that waits for its tick: its revision counter, and when it takes effect.
    pub(crate) fn waiting(&self, unit: &UnitId) -> Option<(u64, Schedule)> {
        let seen = self.with(unit, |actor| actor.waiting());
        let planned = || read(&self.calibrations).plans.get(unit).and_then(Plan::waiting);
        seen.unwrap_or_else(planned)
    }

    /// Does something with one unit; `None` where it has not appeared, or the work panicked and the unit was reset.
    pub(crate) fn with<T>(&self, unit: &UnitId, work: impl FnOnce(&mut UnitActor) -> T) -> Option<T> {
        let unit = self.unit(unit.as_str())?;
        let mut actor = lock(&unit);
        guarded(&mut actor, work)
    }

    /// What a unit is like at this moment; `None` where it has not appeared.
    pub(crate) fn present(&self, unit: &UnitId) -> Option<Present> {
        self.with(unit, |actor| actor.present())
    }

    /// Does something with every unit, in the order of their serials; a panic costs that unit its memory and no more.
    pub fn each_unit<T>(&self, mut work: impl FnMut(&mut UnitActor) -> T) -> Vec<T> {
        // Not locked meanwhile: a unit that appears must not wait for a look at all others.
        let units = read(&self.units).in_order();
        units.iter().filter_map(|(_, unit)| guarded(&mut lock(unit), &mut work)).collect()
    }

    /// Does something with every unit, as [`Self::each_unit`], and what is to follow with each before the next: the unit is
    /// not locked any more then. How many had something to follow.
    pub(crate) fn one_by_one<T>(
        &self,
        mut work: impl FnMut(&mut UnitActor) -> Option<T>,
        mut then: impl FnMut(T),
    ) -> usize {
        let units = read(&self.units).in_order();
        let found = units.iter().filter_map(|(_, unit)| {
            // A statement of its own: the lock ends with it.
            let found = guarded(&mut lock(unit), &mut work);
            found.flatten()
        });
        found.map(&mut then).count()
    }

    /// Status of one unit; `instance` is the service's name for itself.
    pub(crate) fn status(&self, unit: &UnitId, instance: &str) -> Option<Status> {
        self.with(unit, |actor| actor.status(instance))
    }

    /// The account so far.
    #[must_use]
    pub fn totals(&self) -> Totals {
        let units = self.each_unit(|actor| (actor.id().to_string(), actor.totals()));
        let refused = lock(&self.faults).counters().map(|counter| (counter.name, counter.value)).collect();
        Totals { units: units.into_iter().collect(), refused, stopped_in_time: false }
    }
}

/// Runs one unit's work; where it panics, the unit is reset and the thread goes on.
fn guarded<T>(actor: &mut UnitActor, work: impl FnOnce(&mut UnitActor) -> T) -> Option<T> {
    // Unwind safety: whatever state the panic leaves behind is given up by the reset.
    match catch_unwind(AssertUnwindSafe(|| work(actor))) {
        Ok(done) => Some(done),
        Err(panic) => {
            actor.reset(&words_of(panic.as_ref()));
            None
        }
    }
}

/// What a panic says.
fn words_of(panic: &(dyn Any + Send)) -> String {
    let text =
        panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    format!("panic: {}", text.unwrap_or("without words"))
}

/// Locks; a panic while the lock was held has been dealt with where it happened.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Locks for reading, likewise.
pub(crate) fn read<T>(lock: &RwLock<T>) -> RwLockReadGuard<'_, T> {
    lock.read().unwrap_or_else(PoisonError::into_inner)
}

/// Locks for writing, likewise.
pub(crate) fn write<T>(lock: &RwLock<T>) -> RwLockWriteGuard<'_, T> {
    lock.write().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests;
