//! Raw frames of simulated units, the same whoever makes them: the source publishes them, the check corrects them offline.

use arrayvec::ArrayVec;
use isotherm_correction::sample::{
    AccelTick, ChannelName, GyroTick, OutputKind, Readings, TemperatureReading,
};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec;
use isotherm_protocol::raw::{AccelBatch, GyroBatch, MAX_CHANNELS, TemperatureBatch};
use isotherm_simulator::{Scenario, Simulation, presets};

use crate::chain::Case;
use crate::error::Error;

/// Ticks of the simulation that are repeated again and again.
const REPEATED: usize = 2_000;
/// How far one unit is ahead of another in them.
const AHEAD: usize = 7;
/// Event time of the start (ns).
const START_NS: u64 = 1_000_000_000_000;

/// What a unit reads: three gyros, three accelerometers and eight temperature channels of the micromechanical preset.
#[derive(Debug)]
pub(crate) struct Instrument {
    gyro: Vec<Readings>,
    accel: Vec<Readings>,
    channels: ArrayVec<ChannelName, MAX_CHANNELS>,
    temperatures: Vec<ArrayVec<f64, MAX_CHANNELS>>,
}

/// What goes out at once.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Message {
    /// Frame of temperatures, once in a second.
    pub(crate) temperatures: Option<Vec<u8>>,
    /// Frame of accelerometer ticks.
    pub(crate) accel: Vec<u8>,
    /// Frame of gyro ticks.
    pub(crate) gyro: Vec<u8>,
}

impl Instrument {
    /// Simulates it.
    pub(crate) fn simulate(rate_hz: u32) -> Result<Self, Error> {
        let scenario = Scenario { tick_ns: 1_000_000_000 / i64::from(rate_hz), ..presets::mems_chamber(1) };
        let simulation = Simulation::new(&scenario).map_err(Error::of("simulation"))?;
        let mut instrument =
            Self { gyro: Vec::new(), accel: Vec::new(), channels: ArrayVec::new(), temperatures: Vec::new() };
        for step in simulation.take(REPEATED) {
            instrument.gyro.push(step.gyro.readings);
            instrument.accel.push(step.accel.map(|tick| tick.readings).unwrap_or_default());
            if !step.temperatures.is_empty() {
                instrument.channels = step.temperatures.iter().map(|reading| reading.channel).collect();
                instrument.temperatures.push(step.temperatures.iter().map(|reading| reading.raw).collect());
            }
        }
        Ok(instrument)
    }

    /// Message `index` of a unit.
    pub(crate) fn message(&self, case: &Case, unit: usize, index: usize) -> Result<Message, Error> {
        let first = index * case.batch;
        let (start_ns, tick_ns) = (START_NS.cast_signed(), case.tick_ns().cast_signed());
        let end_time = |tick: usize| Timestamp::from_ns(start_ns + (tick as u64 + 1).cast_signed() * tick_ns);
        let (output, duration) = (OutputKind::Mean, Span::from_ns(tick_ns));
        let means = |of: &[Readings], tick: usize| {
            let place = (tick + unit * AHEAD) % of.len().max(1);
            of.get(place).copied().unwrap_or_default()
        };
        let ticks = first..first + case.batch;
        let second = ticks.clone().find(|tick| tick % case.rate_hz as usize == 0);
        let temperatures = second.map(|tick| {
            let time = Timestamp::from_ns(end_time(tick).as_ns() - tick_ns);
            let place = tick / case.rate_hz as usize % self.temperatures.len().max(1);
            let raw = self.temperatures.get(place).cloned().unwrap_or_default();
            let reading = |(&channel, raw)| TemperatureReading { channel, time, raw };
            TemperatureBatch { readings: self.channels.iter().zip(raw).map(reading).collect() }
        });
        let accels = ticks.clone().map(|tick| AccelTick {
            sequence: tick as u64,
            end_time: end_time(tick),
            duration,
            readings: means(&self.accel, tick),
        });
        let accel = AccelBatch { output, ticks: accels.collect() };
        let gyros = ticks.map(|tick| GyroTick {
            sequence: tick as u64,
            end_time: end_time(tick),
            duration,
            readings: means(&self.gyro, tick),
            ..GyroTick::default()
        });
        let gyro = GyroBatch { output, ticks: gyros.collect() };
        let encoding = Error::of("source");
        Ok(Message {
            temperatures: temperatures.map(|batch| codec::encode(&batch)).transpose().map_err(&encoding)?,
            accel: codec::encode(&accel).map_err(&encoding)?,
            gyro: codec::encode(&gyro).map_err(&encoding)?,
        })
    }
}
