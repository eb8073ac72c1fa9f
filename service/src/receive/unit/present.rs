//! What a unit is like at this moment, for those who compare calibrations.

use isotherm_correction::channel::ThermalState;
use isotherm_correction::operation::State;
use isotherm_correction::sample::{ChannelName, LasingMode};
use isotherm_correction::unit::{ChannelReport, Unit};

/// Temperatures, lasing mode and state of a unit at its last tick.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Present {
    channels: Vec<(ChannelName, ThermalState)>,
    auxiliaries: Vec<(ChannelName, ThermalState)>,
    /// Lasing mode of the last tick; `None` before the first one, or without modes.
    pub(crate) mode: Option<LasingMode>,
    /// What the unit is doing.
    pub(crate) state: State,
}

impl Present {
    /// Looks at a unit.
    pub(super) fn of(unit: &Unit) -> Self {
        Self {
            channels: states(unit.channels()),
            auxiliaries: states(unit.auxiliaries()),
            mode: unit.observation().and_then(|seen| seen.mode),
            state: unit.state(),
        }
    }

    /// Smoothed value of a channel of either kind; `None` where the calibration in force has no such channel, or there was no reading.
    pub(crate) fn thermal(&self, name: &ChannelName) -> Option<ThermalState> {
        self.channels
            .iter()
            .chain(&self.auxiliaries)
            .find(|(channel, _)| channel == name)
            .map(|(_, state)| *state)
    }

    /// The temperatures, as "name 23.45 °C".
    pub(crate) fn words(&self) -> Vec<String> {
        self.channels.iter().map(|(name, state)| format!("{name} {:.2} °C", state.temperature)).collect()
    }
}

fn states(channels: impl Iterator<Item = ChannelReport>) -> Vec<(ChannelName, ThermalState)> {
    channels.filter_map(|channel| Some((channel.name, channel.state?))).collect()
}
