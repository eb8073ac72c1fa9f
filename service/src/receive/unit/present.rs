//! What a unit is like at this moment, for those who compare calibrations.

use isotherm_correction::channel::ThermalState;
use isotherm_correction::operation::State;
use isotherm_correction::sample::{ChannelName, LasingMode};
use isotherm_correction::unit::{ChannelReport, Unit};

/// Temperatures, lasing mode and state of a unit at its last tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Present {
    channels: Vec<(ChannelName, ThermalState)>,
    auxiliaries: Vec<(ChannelName, ThermalState)>,
    /// Lasing mode of the last tick; `None` before the first one, or without modes.
    pub mode: Option<LasingMode>,
    /// What the unit is doing.
    pub state: State,
    /// Revision counter of the calibration in force; 0 without one.
    pub revision: u64,
    /// Revision counter of a change that waits for its tick.
    pub pending: Option<u64>,
}

impl Present {
    /// Looks at a unit.
    pub(super) fn of(unit: &Unit) -> Self {
        Self {
            channels: states(unit.channels()),
            auxiliaries: states(unit.auxiliaries()),
            mode: unit.observation().and_then(|seen| seen.mode),
            state: unit.state(),
            revision: unit.calibration().map_or(0, |(_, counter)| counter),
            pending: unit.pending().map(|(counter, _)| counter),
        }
    }

    /// Smoothed value of a channel of either kind; `None` where the calibration in force has no such channel, or there was no reading.
    #[must_use]
    pub fn thermal(&self, name: &ChannelName) -> Option<ThermalState> {
        self.channels
            .iter()
            .chain(&self.auxiliaries)
            .find(|(channel, _)| channel == name)
            .map(|(_, state)| *state)
    }

    /// The temperatures, as "name 23.45 °C".
    #[must_use]
    pub fn words(&self) -> Vec<String> {
        self.channels.iter().map(|(name, state)| format!("{name} {:.2} °C", state.temperature)).collect()
    }
}

fn states(channels: impl Iterator<Item = ChannelReport>) -> Vec<(ChannelName, ThermalState)> {
    channels.filter_map(|channel| Some((channel.name, channel.state?))).collect()
}
