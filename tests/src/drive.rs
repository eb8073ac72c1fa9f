//! Ways to drive a unit without a session.

use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::drift::Reference;
use isotherm_correction::sample::{AccelTick, CorrectedTick, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::unit::{Event, Unit, UnitSettings};

/// An event that owns what it carries.
#[derive(Debug, Clone)]
pub enum Owned {
    /// Gyro ticks with mean readings.
    Gyro(Vec<GyroTick>),
    /// Accelerometer ticks with mean readings.
    Accel(Vec<AccelTick>),
    /// Temperature readings.
    Temperature(Vec<TemperatureReading>),
    /// The true rate of the case over a span.
    Reference(Reference),
}

/// A unit with a calibration.
#[must_use]
pub fn unit(calibration: &Arc<Calibration>) -> Unit {
    let mut unit = Unit::new(UnitSettings::default());
    unit.install(Arc::clone(calibration), 1);
    unit
}

/// Hands one event over and collects what comes out.
pub fn hand(unit: &mut Unit, event: &Owned, out: &mut Vec<CorrectedTick>) {
    let mut emit = |tick: &CorrectedTick| out.push(tick.clone());
    match event {
        Owned::Gyro(ticks) => unit.handle(Event::Gyro { output: OutputKind::Mean, ticks }, &mut emit),
        Owned::Accel(ticks) => unit.handle(Event::Accel { output: OutputKind::Mean, ticks }, &mut emit),
        Owned::Temperature(readings) => unit.handle(Event::Temperature(readings), &mut emit),
        Owned::Reference(reference) => unit.handle(Event::Reference(reference), &mut emit),
    }
}

/// Hands over all events, flushes, and returns all that came out.
#[must_use]
pub fn run(unit: &mut Unit, events: &[Owned]) -> Vec<CorrectedTick> {
    let mut out = Vec::new();
    for event in events {
        hand(unit, event, &mut out);
    }
    unit.handle(Event::Flush, &mut |tick| out.push(tick.clone()));
    out
}
