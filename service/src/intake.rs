//! What the receive threads do with a raw message: find its unit, have it corrected, survive whatever it is.

use std::any::Any;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};
use std::time::Instant;

use isotherm_protocol::codec::{self, CodecError};
use isotherm_protocol::key::{self, RawStream, UnitId};
use isotherm_protocol::raw::{AccelBatch, GyroBatch, TemperatureBatch};
use isotherm_protocol::status::Status;

use crate::calibrations::Calibrations;
use crate::config::Settings;
use crate::fault::{FaultKind, FaultLog};
use crate::totals::Totals;
use crate::unit::{Outlet, QuietSettings, UnitActor};

/// Makes the outlet of a unit that appears.
pub type OutletMaker = Box<dyn Fn(&UnitId) -> Result<Outlet, zenoh::Error> + Send + Sync>;

/// All units, and what belongs to none.
pub struct Intake {
    settings: Settings,
    calibrations: Calibrations,
    outlets: OutletMaker,
    units: RwLock<Units>,
    faults: Mutex<FaultLog>,
}

/// The units that have appeared.
#[derive(Debug, Default)]
struct Units {
    // By the serial's text, so that the key of a message finds its unit without an allocation.
    by_serial: HashMap<String, Arc<Mutex<UnitActor>>>,
    /// How many of them came with a calibration.
    calibrated: usize,
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
        Self { settings, calibrations, outlets, units: RwLock::default(), faults: Mutex::default() }
    }

    /// Takes one message; whether subscribers of the status should hear of it at once.
    ///
    /// Whatever goes wrong is counted; nothing gets out of here but the answer.
    pub fn receive(&self, key: &str, payload: Option<&[u8]>, arrival: Instant) -> bool {
        let Some((serial, stream)) = key::parse_raw(key) else {
            self.fault(FaultKind::UnknownStream, || format!("{key} is no raw stream: gyro, accel or temp"));
            return false;
        };
        let Some(frame) = payload else {
            self.fault(FaultKind::Deletion, || format!("{key}: a deletion means nothing here"));
            return false;
        };
        let known = self.unit(serial);
        let Some(unit) = known.or_else(|| self.appear(serial, stream, frame)) else { return false };
        let mut actor = lock(&unit);
        guarded(&mut actor, |actor| actor.receive(stream, frame, arrival));
        actor.is_status_due()
    }

    /// Makes the unit of a message that is its first, unless the message is bad or there are too many.
    fn appear(&self, serial: &str, stream: RawStream, frame: &[u8]) -> Option<Arc<Mutex<UnitActor>>> {
        let id = UnitId::new(serial)
            .map_err(|error| self.fault(FaultKind::BadSerial, || format!("serial {serial:?} {error}")))
            .ok()?;
        let installable = self.calibrations.get(&id);
        // Rubbish on a strange serial makes no unit; on a serial with a calibration it is that unit's rubbish.
        if installable.is_none()
            && let Err(error) = readable(stream, frame)
        {
            self.fault(FaultKind::from(&error), || {
                format!("first message of unit {id}, raw/{}: {error}", stream.chunk())
            });
            return None;
        }
        // Looked at without the right to write first: a flood of strange serials must not hold the others up.
        if !self.has_place(&read(&self.units), installable.is_some()) {
            return self.refuse(&id);
        }
        let mut units = self.units.write().unwrap_or_else(PoisonError::into_inner);
        if let Some(unit) = units.by_serial.get(serial) {
            return Some(Arc::clone(unit));
        }
        if !self.has_place(&units, installable.is_some()) {
            return self.refuse(&id);
        }
        let outlet = match (self.outlets)(&id) {
            Ok(outlet) => outlet,
            Err(error) => {
                self.fault(FaultKind::TooManyUnits, || {
                    format!("unit {id} is refused: no publisher: {error}")
                });
                return None;
            }
        };
        let unit_settings = self.settings.unit;
        let pairing_window =
            std::time::Duration::from_nanos(unit_settings.pairing_window.as_ns().unsigned_abs());
        let quiet = QuietSettings { tail_flush: self.settings.tail_flush, pairing_window };
        let mut actor = UnitActor::new(id.clone(), unit_settings, quiet, outlet);
        if let Some(installable) = installable {
            let revision = actor.install(Arc::clone(&installable.calibration), installable.digest);
            tracing::info!(unit = %id, revision = revision.counter, "appeared, calibrated");
        } else {
            tracing::warn!(unit = %id, uncalibrated = ?unit_settings.uncalibrated, "appeared, no calibration");
        }
        let unit = Arc::new(Mutex::new(actor));
        units.by_serial.insert(serial.to_owned(), Arc::clone(&unit));
        units.calibrated += usize::from(installable.is_some());
        Some(unit)
    }

    /// Whether one more unit may appear; places for units that have a calibration are kept free for them.
    fn has_place(&self, units: &Units, calibrated: bool) -> bool {
        let kept = if calibrated { 0 } else { self.calibrations.len().saturating_sub(units.calibrated) };
        units.by_serial.len() + kept < self.settings.max_units
    }

    fn refuse<T>(&self, id: &UnitId) -> Option<T> {
        let limit = self.settings.max_units;
        self.fault(FaultKind::TooManyUnits, || {
            format!("unit {id} is refused: all {limit} places (max_units) are taken or kept")
        });
        None
    }

    /// The unit of a serial, if it has appeared.
    fn unit(&self, serial: &str) -> Option<Arc<Mutex<UnitActor>>> {
        read(&self.units).by_serial.get(serial).map(Arc::clone)
    }

    /// Counts a fault that belongs to no unit, and logs the first of its kind.
    fn fault(&self, kind: FaultKind, words: impl FnOnce() -> String) {
        let mut faults = lock(&self.faults);
        if faults.note(kind, 1, words) {
            let words = faults.last().unwrap_or_default();
            tracing::warn!(kind = kind.name(), "{words}; further ones are counted only");
        }
    }

    /// Does something with every unit, in the order of their serials; a panic costs that unit its memory and no more.
    pub fn each_unit<T>(&self, mut work: impl FnMut(&mut UnitActor) -> T) -> Vec<T> {
        let units = read(&self.units);
        let mut units: Vec<_> =
            units.by_serial.iter().map(|(serial, unit)| (serial.clone(), Arc::clone(unit))).collect();
        units.sort_by(|(a, _), (b, _)| a.cmp(b));
        units.iter().filter_map(|(_, unit)| guarded(&mut lock(unit), &mut work)).collect()
    }

    /// Status of one unit.
    #[must_use]
    pub fn status(&self, unit: &UnitId) -> Option<Status> {
        let unit = self.unit(unit.as_str())?;
        let status = lock(&unit).status();
        Some(status)
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

/// Whether a frame is a batch of its stream.
fn readable(stream: RawStream, frame: &[u8]) -> Result<(), CodecError> {
    match stream {
        RawStream::Gyro => codec::decode::<GyroBatch>(frame).map(drop),
        RawStream::Accel => codec::decode::<AccelBatch>(frame).map(drop),
        RawStream::Temperature => codec::decode::<TemperatureBatch>(frame).map(drop),
    }
}

/// Locks; a panic while the lock was held has been dealt with where it happened.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Locks for reading, likewise.
fn read<T>(lock: &RwLock<T>) -> std::sync::RwLockReadGuard<'_, T> {
    lock.read().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests;
