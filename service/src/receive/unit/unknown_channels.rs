//! Which temperature channels send that the calibration does not have: where one of its own is silent, they are probably meant for it.

use std::time::{Duration, Instant};

use isotherm_correction::sample::ChannelName;
use isotherm_correction::unit::Unit;
use isotherm_protocol::raw::read_temperatures;
use isotherm_protocol::status::{Fault, UNKNOWN_CHANNEL};

use crate::receive::fault::standing;

/// How long a channel is remembered after its last reading.
const REMEMBERED: Duration = Duration::from_secs(120);
/// Most channels that are remembered.
const MOST: usize = 8;

/// Channels without a place in the calibration, and when each was last heard.
#[derive(Debug, Default)]
pub(super) struct UnknownChannels(Vec<(ChannelName, Instant)>);

impl UnknownChannels {
    /// Looks into a temperature frame, if the unit has come across readings of unknown channels at all.
    pub(super) fn heard(&mut self, unit: &Unit, frame: &[u8], now: Instant) {
        if unit.counters().temperature_unknown_channel == 0 {
            return;
        }
        let mut readings = Vec::new();
        if read_temperatures(frame, &mut readings).is_err() {
            return;
        }
        self.0.retain(|(_, at)| now.saturating_duration_since(*at) < REMEMBERED);
        for reading in readings {
            if let Some((_, at)) = self.0.iter_mut().find(|(name, _)| *name == reading.channel) {
                *at = now;
            } else if self.0.len() < MOST && !is_known(unit, &reading.channel) {
                self.0.push((reading.channel, now));
            }
        }
    }

    /// The fault, while channels of the calibration have no reading and others send.
    pub(super) fn fault(&self, unit: &Unit, now: Instant) -> Option<Fault> {
        let unknown = self
            .0
            .iter()
            .filter(|(name, at)| now.saturating_duration_since(*at) < REMEMBERED && !is_known(unit, name));
        let unknown: Vec<_> = unknown.map(|(name, _)| name.to_string()).collect();
        let silent = unit.channels().filter(|channel| channel.stale);
        let silent: Vec<_> = silent.map(|channel| channel.name.to_string()).collect();
        if unknown.is_empty() || silent.is_empty() {
            return None;
        }
        let words = format!(
            "readings of {} arrive, which the calibration does not have; it waits for {}: use one name in the producer \
             and the document",
            unknown.join(", "),
            silent.join(", ")
        );
        Some(standing(UNKNOWN_CHANNEL, unit.counters().temperature_unknown_channel, words))
    }
}

/// Whether the calibration in force has a channel.
fn is_known(unit: &Unit, name: &ChannelName) -> bool {
    unit.channels().chain(unit.auxiliaries()).any(|channel| channel.name == *name)
}
