//! The first message of a unit: whether there is a place for it, and the unit with what was written for it.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use isotherm_document::few;
use isotherm_protocol::codec::{self, CodecError};
use isotherm_protocol::key::{Input, RawStream, UnitId};
use isotherm_protocol::raw::{AccelBatch, GyroBatch, HealthBatch, TemperatureBatch};
use isotherm_protocol::status::Fault;

use super::units::{Unit, Units};
use super::{Intake, lock, read, write};
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
            self.make_room(calibrated, now);
        }
        let mut units = write(&self.units);
        if let Some(unit) = units.by_serial.get(serial) {
            return Some(Arc::clone(unit));
        }
        if !self.has_place(&units, calibrated) {
            let limit = self.settings.max_units;
            self.fault(FaultKind::TooManyUnits, || {
                format!("unit {id} is refused: all {limit} places (max_units) are taken")
            });
            if calibrated {
                lock(&self.refused).insert(id);
            }
            return None;
        }
        lock(&self.refused).remove(&id);
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
        if !self.pair.speaks_first() {
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

    /// That units with a calibration have not appeared: their serial may be misspelt, or their producer be off; or there is no place
    /// for them.
    pub(crate) fn awaited(&self) -> Vec<Fault> {
        // The units first, as everywhere: what is locked in one order locks nobody out.
        let (units, calibrations) = (read(&self.units), read(&self.calibrations));
        let refused = lock(&self.refused);
        let awaited = self.awaited_of(&units, &calibrations);
        let limit = self.settings.max_units;
        let (refused, silent): (Vec<_>, Vec<_>) =
            awaited.partition(|unit| units.len() >= limit && refused.contains(*unit));
        let told = [
            ("awaited_units", silent, "calibrated, nothing received yet".to_owned()),
            (
                "refused_units",
                refused,
                format!(
                    "calibrated, but refused: other calibrated units have all {limit} places, raise max_units"
                ),
            ),
        ];
        let told = told.into_iter().filter(|(_, units, _)| !units.is_empty());
        let told = told.map(|(kind, units, words)| {
            let names = few(units.iter().map(|unit| unit.as_str()));
            standing(kind, units.len() as u64, format!("{words}: {names}"))
        });
        told.collect()
    }

    /// Forgets the unit without a calibration that has been silent longest: anybody can make one appear, and it must not hold its
    /// place for ever. For a unit with a calibration at once; for another one of those without only after a silence that is long
    /// enough, and looked for now and then, for a flood of strange serials is not to cost more.
    fn make_room(&self, calibrated: bool, now: Instant) {
        if !calibrated {
            let mut looked = lock(&self.looked_for_room);
            if looked.is_some_and(|looked| now.saturating_duration_since(looked) < ROOM_INTERVAL) {
                return;
            }
            *looked = Some(now);
        }
        let units = read(&self.units).in_order();
        let strangers: Vec<_> = {
            let calibrations = read(&self.calibrations);
            units.iter().filter(|(id, _)| !calibrations.has(id)).collect()
        };
        let silent = strangers.into_iter().filter_map(|(id, unit)| {
            // Whoever is at work on it hears of it.
            Some((unit.try_lock().ok()?.silence(now), id))
        });
        let shortest = if calibrated { Duration::ZERO } else { STRANGER_KEPT };
        if let Some((silence, id)) = silent.max().filter(|(silence, _)| *silence >= shortest) {
            let silence_s = silence.as_secs();
            tracing::warn!(unit = %id, silence_s, calibrated, "forgotten: it has no calibration, and its place is needed");
            self.forget(id);
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
