//! What a log holds, by unit: found before anything is written, so that every output knows its columns.

use std::collections::BTreeMap;

use isotherm_correction::sample::{ChannelName, OutputKind};
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::raw::GyroBatch;

use super::decoded::{Decoded, decode};
use crate::message::Message;

/// Most temperature channels of a unit: beyond them a log is not of an instrument.
pub const MOST_CHANNELS: usize = 64;

/// What ticks of one kind look like.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shape {
    /// Readings are counts; otherwise means.
    pub counts: bool,
    /// Sensors.
    pub sensors: usize,
    /// Gyros with half-period counts.
    pub half_periods: bool,
}

impl Shape {
    /// Of readings, with half-period counts or without.
    #[must_use]
    pub fn of(output: OutputKind, readings: &[f64], half_periods: bool) -> Self {
        Self { counts: output == OutputKind::Counts, sensors: readings.len(), half_periods }
    }

    /// What the readings stand for.
    #[must_use]
    pub fn output(self) -> OutputKind {
        if self.counts { OutputKind::Counts } else { OutputKind::Mean }
    }
}

/// Ticks by shape.
pub type Shapes = BTreeMap<Shape, u64>;

/// The shape that most ticks have; the first of several that are equally frequent.
#[must_use]
pub fn usual(shapes: &Shapes) -> Option<Shape> {
    let sensed = shapes.iter().filter(|(shape, _)| shape.sensors > 0);
    sensed.rev().max_by_key(|(_, ticks)| **ticks).map(|(shape, _)| *shape)
}

/// Largest numbers per corrected tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CorrectedShape {
    /// Gyros with flags.
    pub gyros: usize,
    /// Accelerometers with flags.
    pub accels: usize,
    /// Parity residuals of the gyros.
    pub gyro_parity: usize,
    /// Parity residuals of the accelerometers.
    pub accel_parity: usize,
    /// Whether there are standard errors.
    pub sigma: bool,
}

/// What a log holds of one unit.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct UnitContents {
    /// Raw gyro ticks.
    pub gyro: Shapes,
    /// Raw accelerometer ticks.
    pub accel: Shapes,
    /// Raw temperature channels in the order in which they come, at most [`MOST_CHANNELS`].
    pub channels: Vec<ChannelName>,
    /// Raw temperature readings.
    pub temperature_readings: u64,
    /// Health readings.
    pub health_readings: u64,
    /// Some gyro tick has a lasing mode or a switch command.
    pub mode: bool,
    /// Some gyro tick has a phase of the slow meander.
    pub meander: bool,
    /// Corrected ticks.
    pub corrected_ticks: u64,
    /// What these have.
    pub corrected: CorrectedShape,
    /// Channels whose temperatures were applied, likewise.
    pub applied_channels: Vec<ChannelName>,
    /// Rate references.
    pub references: u64,
    /// Status messages.
    pub status: u64,
    /// Journal messages.
    pub journal: u64,
}

/// What a log holds.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Contents {
    /// By unit.
    pub units: BTreeMap<UnitId, UnitContents>,
    /// Messages of no unit.
    pub others: u64,
    /// Frames that cannot be read.
    pub bad_frames: u64,
}

impl Contents {
    /// Takes one message.
    pub fn add(&mut self, message: &Message) {
        match decode(message) {
            Ok(Some((unit, decoded))) => match self.units.get_mut(unit) {
                Some(contents) => contents.add(&decoded),
                None => self.units.entry(unit.clone()).or_default().add(&decoded),
            },
            Ok(None) => self.others += 1,
            Err(_) => self.bad_frames += 1,
        }
    }
}

impl UnitContents {
    /// Whether there are raw ticks or readings.
    #[must_use]
    pub fn has_raw(&self) -> bool {
        !self.gyro.is_empty() || !self.accel.is_empty() || self.temperature_readings > 0
    }

    fn add(&mut self, decoded: &Decoded) {
        match decoded {
            Decoded::Gyro(batch) => self.add_gyro(batch),
            Decoded::Accel(batch) => {
                for tick in &batch.ticks {
                    *self.accel.entry(Shape::of(batch.output, &tick.readings, false)).or_default() += 1;
                }
            }
            Decoded::Temperature(batch) => {
                self.temperature_readings += batch.readings.len() as u64;
                add_channels(&mut self.channels, batch.readings.iter().map(|reading| &reading.channel));
            }
            Decoded::Health(batch) => {
                self.health_readings +=
                    batch.ticks.iter().map(|tick| tick.readings.len() as u64).sum::<u64>();
            }
            Decoded::Reference(_) => self.references += 1,
            Decoded::Corrected(batch) => self.add_corrected(batch),
            Decoded::Status(_) => self.status += 1,
            Decoded::Journal => self.journal += 1,
        }
    }

    fn add_gyro(&mut self, batch: &GyroBatch) {
        for tick in &batch.ticks {
            let shape = Shape::of(batch.output, &tick.readings, !tick.half_periods.is_empty());
            *self.gyro.entry(shape).or_default() += 1;
            self.mode |= tick.mode.is_some() || tick.switch_command;
            self.meander |= tick.meander.is_some();
        }
    }

    fn add_corrected(&mut self, batch: &CorrectedBatch) {
        self.corrected_ticks += batch.ticks.len() as u64;
        add_channels(&mut self.applied_channels, batch.temperatures.iter().map(|applied| &applied.channel));
        let shape = &mut self.corrected;
        for tick in &batch.ticks {
            shape.gyros = shape.gyros.max(tick.gyro_flags.len());
            shape.accels = shape.accels.max(tick.accel_flags.len());
            shape.gyro_parity = shape.gyro_parity.max(tick.gyro_parity.len());
            shape.accel_parity = shape.accel_parity.max(tick.accel_parity.len());
            shape.sigma |= tick.sigma.is_some();
        }
    }
}

/// Adds names while there is room.
fn add_channels<'a>(channels: &mut Vec<ChannelName>, names: impl Iterator<Item = &'a ChannelName>) {
    for name in names {
        if channels.len() < MOST_CHANNELS && !channels.contains(name) {
            channels.push(*name);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_shape_has_most_ticks_and_sensors_at_all() {
        let shape = |counts, sensors| Shape { counts, sensors, half_periods: false };
        assert_eq!(usual(&Shapes::new()), None);
        let shapes = Shapes::from([(shape(false, 0), 9), (shape(false, 3), 2), (shape(true, 6), 2)]);
        assert_eq!(usual(&shapes), Some(shape(false, 3)));
        let shapes = Shapes::from([(shape(false, 3), 2), (shape(true, 6), 3)]);
        assert_eq!(usual(&shapes), Some(shape(true, 6)));
    }
}
