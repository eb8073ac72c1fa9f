//! What a unit is like at this moment, for those who compare calibrations.

use isotherm_correction::calibration::{Calibration, Steady};
use isotherm_correction::channel::ThermalState;
use isotherm_correction::operation::State;
use isotherm_correction::sample::{ChannelName, LasingMode};
use isotherm_correction::unit::{ChannelReport, Unit};

/// Temperatures, lasing mode and state of a unit at its last tick.
#[derive(Debug, Clone)]
pub(crate) struct Present {
    channels: Vec<ChannelReport>,
    auxiliaries: Vec<ChannelReport>,
    /// Lasing mode of the last tick; `None` before the first one, or without modes.
    pub(crate) mode: Option<LasingMode>,
    /// What the unit is doing.
    pub(crate) state: State,
}

impl Present {
    /// Looks at a unit.
    pub(super) fn of(unit: &Unit) -> Self {
        Self {
            channels: unit.channels().collect(),
            auxiliaries: unit.auxiliaries().collect(),
            mode: unit.observation().and_then(|seen| seen.mode),
            state: unit.state(),
        }
    }

    /// Smoothed value of a channel of either kind; `None` where the calibration in force has no such channel, or there was no reading.
    pub(crate) fn thermal(&self, name: &ChannelName) -> Option<ThermalState> {
        self.channels.iter().chain(&self.auxiliaries).find(|channel| channel.name == *name)?.state
    }

    /// The correction of the unit as it is, under a calibration.
    pub(crate) fn steady(&self, calibration: &Calibration) -> Steady {
        calibration.steady(|name| self.thermal(name), self.mode)
    }

    /// The unit under another calibration, once every channel was read again, and the channels that start anew with it: where the
    /// definition or the filter differs, what was made of the readings so far means nothing.
    pub(crate) fn under(&self, before: &Calibration, next: &Calibration) -> (Self, Vec<StartsAnew>) {
        let (mut under, mut anew) = (self.clone(), Vec::new());
        let channels = under.channels.iter_mut().zip(std::iter::repeat(" °C"));
        for (report, unit) in channels.chain(under.auxiliaries.iter_mut().zip(std::iter::repeat(""))) {
            let channel = next.channel(&report.name).filter(|it| next.goes_on_from(before, it).is_none());
            let is_heard = report.state.is_some() || report.raw.is_some();
            let Some(channel) = channel.filter(|_| is_heard) else { continue };
            let [low, high] = channel.range_deg_c();
            let read = report.raw.map(|raw| channel.convert(raw));
            let taken = read.filter(|read| (low..=high).contains(read));
            let was = report.state.map(|state| state.temperature);
            report.state = taken.map(|temperature| ThermalState { temperature, ..ThermalState::default() });
            anew.push(StartsAnew { name: report.name, unit, was, read, range: [low, high] });
        }
        (under, anew)
    }

    /// The unit before these channels were read again.
    pub(crate) fn without(&self, unread: &[StartsAnew]) -> Self {
        let mut without = self.clone();
        for report in without.channels.iter_mut().chain(&mut without.auxiliaries) {
            if unread.iter().any(|anew| anew.name == report.name) {
                report.state = None;
            }
        }
        without
    }

    /// The temperatures, as "name 23.45 °C".
    pub(crate) fn words(&self) -> Vec<String> {
        let known = self.channels.iter().filter_map(|channel| Some((channel.name, channel.state?)));
        known.map(|(name, state)| format!("{name} {:.2} °C", state.temperature)).collect()
    }
}

/// A channel that starts anew with a calibration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StartsAnew {
    pub(crate) name: ChannelName,
    /// What stands behind its numbers.
    unit: &'static str,
    /// Its smoothed value until then; `None` where no reading was taken.
    pub(crate) was: Option<f64>,
    /// Its last reading by the new definition; `None` where that reading is not known.
    pub(crate) read: Option<f64>,
    /// What it is to be within.
    range: [f64; 2],
}

impl StartsAnew {
    /// That it would reject its readings, in words; `None` where it would not, or they are not known.
    pub(crate) fn rejects(&self) -> Option<String> {
        let (Self { name, unit, range: [low, high], .. }, read) = (self, self.read?);
        (!(*low..=*high).contains(&read)).then(|| {
            format!(
                "channel {name} would reject its readings: the last one is {read:.2}{unit} by its new definition, \
                 outside the sensor's range {low} to {high}{unit}"
            )
        })
    }

    /// Its name, with its value now and then.
    pub(crate) fn words(&self) -> String {
        let value = |value: Option<f64>| {
            value.map_or_else(|| "unknown".to_owned(), |value| format!("{value:.2}{}", self.unit))
        };
        format!("{} ({} now, {} then)", self.name, value(self.was), value(self.read))
    }
}
