//! Temperature channels: where they sit, how they turn a temperature into a reading, how often.

use isotherm_correction::sample::{ChannelName, TemperatureReading};
use isotherm_correction::units::Timestamp;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::noise::{Noise, Purpose};
use crate::polynomial::rounded;

/// All temperature channels of a unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Thermometers {
    /// Time between readings (s, ≥ one tick). All channels are read together; the first time at the start.
    #[schemars(range(min = 1e-4, max = 1e6))]
    pub period_s: f64,
    /// The channels.
    pub channels: Vec<Channel>,
}

/// One temperature channel: raw = raw at 0 °C + raw per °C · (T + noise), rounded to the resolution.
///
/// A corrector goes the other way: T = a0 + a1·raw with a1 = 1/`raw_per_deg_c`, a0 = −`raw_at_0_deg_c`·a1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// Name, 1…24 bytes.
    #[schemars(length(min = 1, max = 24))]
    pub name: String,
    /// Where it sits.
    pub place: Place,
    /// Reading at 0 °C (V, counts or °C).
    #[schemars(range(min = -1e12, max = 1e12))]
    pub raw_at_0_deg_c: f64,
    /// Change of the reading per °C; not zero.
    #[schemars(range(min = -1e12, max = 1e12))]
    pub raw_per_deg_c: f64,
    /// Standard deviation of the reading's noise (°C, ≥ 0).
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub noise_deg_c: f64,
    /// Step of the reading (raw, ≥ 0; 0 for none).
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub resolution_raw: f64,
}

/// Where a temperature is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Place {
    /// Air of the chamber.
    Chamber,
    /// Housing of the unit, which the orientation follows.
    Housing,
    /// Electronics board.
    Board,
    /// A gyro, by its number from 0; the outermost layer of a fibre coil.
    Gyro(usize),
    /// An accelerometer, by its number from 0.
    Accelerometer(usize),
}

impl Channel {
    /// A channel that reads °C without noise.
    #[must_use]
    pub fn exact(name: &str, place: Place) -> Self {
        Self {
            name: name.into(),
            place,
            raw_at_0_deg_c: 0.0,
            raw_per_deg_c: 1.0,
            noise_deg_c: 0.0,
            resolution_raw: 0.0,
        }
    }
}

/// All channels with their noise.
#[derive(Debug, Clone)]
pub(crate) struct ThermometersState {
    channels: Vec<(Channel, ChannelName, Noise)>,
    period_s: f64,
    readings: f64,
}

impl ThermometersState {
    pub(crate) fn new(thermometers: &Thermometers, seed: u64) -> Self {
        let channel = |(channel, index): (&Channel, u32)| {
            let name = ChannelName::from(&channel.name).unwrap_or_default();
            (channel.clone(), name, Noise::new(seed, Purpose::TemperatureChannel(index)))
        };
        Self {
            channels: thermometers.channels.iter().zip(0..).map(channel).collect(),
            period_s: thermometers.period_s,
            readings: 0.0,
        }
    }

    /// Time of the next reading where it is due by `until_s`.
    pub(crate) fn due(&self, until_s: f64) -> Option<f64> {
        let next_s = self.readings * self.period_s;
        (next_s <= until_s + 1e-12).then_some(next_s)
    }

    /// Reads all channels.
    pub(crate) fn read(&mut self, time: Timestamp, deg_c: impl Fn(Place) -> f64) -> Vec<TemperatureReading> {
        self.readings += 1.0;
        let read = |(channel, name, noise): &mut (Channel, ChannelName, Noise)| {
            let jitter = if channel.noise_deg_c > 0.0 { channel.noise_deg_c * noise.normal() } else { 0.0 };
            let raw = channel.raw_at_0_deg_c + channel.raw_per_deg_c * (deg_c(channel.place) + jitter);
            TemperatureReading { channel: *name, time, raw: rounded(raw, channel.resolution_raw) }
        };
        self.channels.iter_mut().map(read).collect()
    }
}
