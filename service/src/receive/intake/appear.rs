//! The first message of a unit: whether there is a place for it, and the unit with what was written for it.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use isotherm_document::few;
use isotherm_protocol::codec::{self, CodecError};
use isotherm_protocol::key::{Input, RawStream, UnitId};
use isotherm_protocol::raw::{AccelBatch, GyroBatch, HealthBatch, TemperatureBatch};
use isotherm_protocol::status::{Fault, Output};

use super::units::{Unit, Units};
use super::{Intake, lock, read};
use crate::control::revision::Calibrations;
use crate::receive::fault::{FaultKind, standing};
use crate::receive::unit::{Footing, Outlet, UnitActor};

/// How long a unit without a calibration is silent before another may have its place.
const STRANGER_KEPT: Duration = Duration::from_secs(60);
/// Shortest distance of two looks for such a unit.
const ROOM_INTERVAL: Duration = Duration::from_millis(100);

impl Intake {
    /// Makes the unit of a message that is its first, unless the message is bad or there are too many.
    pub(super) fn appear(&self, serial: &str, input: Input, frame: &[u8], now: Instant) -> Option<Unit> {
        let Input::Raw(stream) = input else {
            self.fault(FaultKind::UnknownStream, || {
                format!("unit {serial}: a reference for a unit that has not appeared")
            });
            return None;
        };
        let id = UnitId::new(serial)
            .map_err(|error| self.fault(FaultKind::BadSerial, || format!("serial {serial:?} {error}")))
            .ok()?;
        let calibrated = read(&self.calibrations).has(&id);
        // Rubbish on a strange serial makes no unit; on a serial with a calibration it is that unit's rubbish.
        if !calibrated && let Err(error) = readable(stream, frame) {
            self.fault(FaultKind::from(&error), || {
                format!("first message of unit {id}, {}: {error}", input.topic())
            });
            return None;
        }
        // Looked at without the right to write first: a flood of strange serials must not hold the others up.
        if !self.has_place(&read(&self.units), calibrated) {
            self.make_room(now);
        }
        let mut units = self.units.write().unwrap_or_else(PoisonError::into_inner);
        if let Some(unit) = units.by_serial.get(serial) {
            return Some(Arc::clone(unit));
        }
        if !self.has_place(&units, calibrated) {
            let limit = self.settings.max_units;
            self.fault(FaultKind::TooManyUnits, || {
                format!("unit {id} is refused: all {limit} places (max_units) are taken")
            });
            return None;
        }
        let outlet = match self.outlets.take(&id) {
            Ok(outlet) => outlet,
            Err(error) => {
                self.fault(FaultKind::TooManyUnits, || {
                    format!("unit {id} is refused: no publisher: {error}")
                });
                return None;
            }
        };
        let mut actor = self.make(&id, outlet);
        // Read while nobody else may write the units: what is changed behind this finds the unit there.
        let plan = read(&self.calibrations).plans.get(&id).cloned().unwrap_or_default();
        for change in plan.changes() {
            actor.change(change);
        }
        for command in &plan.intent {
            match actor.command(command) {
                Ok(state) => {
                    tracing::info!(unit = %id, %state, "{} restored after the restart", command.name());
                }
                Err(refusal) => {
                    tracing::warn!(unit = %id, "the state before the restart cannot be restored: {refusal}");
                }
            }
        }
        if let Some(current) = &plan.current {
            tracing::info!(unit = %id, revision = current.number.counter, "appeared, calibrated");
        } else {
            tracing::warn!(unit = %id, uncalibrated = ?self.settings.unit.uncalibrated, "appeared, no calibration");
        }
        let unit = Arc::new(Mutex::new(actor));
        units.insert(id, &unit);
        Some(unit)
    }

    /// A unit that knows nothing yet.
    fn make(&self, id: &UnitId, outlet: Outlet) -> UnitActor {
        let mut actor = UnitActor::new(id.clone(), self.settings.unit, self.settings.tail_flush, outlet);
        if self.pair.as_ref().is_some_and(|pair| !pair.speaks_first()) {
            // The others may have heard more of it; where none speaks it does, after a while.
            actor.follow(Instant::now(), Footing::Nothing);
        }
        if let Some(inbox) = &self.inbox {
            actor.report_to(inbox.clone());
        }
        if let Some(journal) = &self.journal {
            actor.journal_to(journal.clone());
        }
        actor
    }

    /// Whether one more unit may appear; places for units that have a calibration are kept free for them.
    fn has_place(&self, units: &Units, calibrated: bool) -> bool {
        let limit = self.settings.max_units;
        // Most of the time there is room for all of them, whoever has appeared.
        units.len() < limit
            && (calibrated || units.len() + self.awaited_of(units, &read(&self.calibrations)).count() < limit)
    }

    /// Those that are taken and have a calibration, and have not appeared, in the order of their serials.
    fn awaited_of<'u>(
        &self,
        units: &Units,
        calibrations: &'u Calibrations,
    ) -> impl Iterator<Item = &'u UnitId> {
        calibrations.units().filter(|unit| self.takes(unit) && !units.by_serial.contains_key(*unit))
    }

    /// That units with a calibration have not appeared: their serial may be misspelt, or their producer be off.
    pub(crate) fn awaited(&self) -> Option<Fault> {
        // The units first, as everywhere: what is locked in one order locks nobody out.
        let (units, calibrations) = (read(&self.units), read(&self.calibrations));
        let awaited: Vec<_> = self.awaited_of(&units, &calibrations).map(UnitId::as_str).collect();
        (!awaited.is_empty()).then(|| {
            let words = format!("calibrated, nothing received yet: {}", few(&awaited));
            standing("awaited_units", awaited.len() as u64, words)
        })
    }

    /// Forgets the unit without a calibration that has been silent longest, if that is long enough: anybody can make one appear, and
    /// it must not hold its place for ever. Looked for now and then, for a flood of strange serials is not to cost more.
    fn make_room(&self, now: Instant) {
        {
            let mut looked = lock(&self.looked_for_room);
            if looked.is_some_and(|looked| now.saturating_duration_since(looked) < ROOM_INTERVAL) {
                return;
            }
            *looked = Some(now);
        }
        let units = read(&self.units).in_order();
        let silent = units.iter().filter_map(|(id, unit)| {
            // Whoever is at work on it hears of it.
            let actor = unit.try_lock().ok()?;
            (actor.doing().1 != Output::Calibrated).then(|| (actor.silence(now), id.clone()))
        });
        if let Some((silence, id)) = silent.max().filter(|(silence, _)| *silence >= STRANGER_KEPT) {
            tracing::info!(unit = %id, "forgotten: silent for {} s, and its place is needed", silence.as_secs());
            self.forget(&id);
        }
    }
}

/// Whether a frame is a batch of its stream.
fn readable(stream: RawStream, frame: &[u8]) -> Result<(), CodecError> {
    match stream {
        RawStream::Gyro => codec::decode::<GyroBatch>(frame).map(drop),
        RawStream::Accel => codec::decode::<AccelBatch>(frame).map(drop),
        RawStream::Temperature => codec::decode::<TemperatureBatch>(frame).map(drop),
        RawStream::Health => codec::decode::<HealthBatch>(frame).map(drop),
    }
}
