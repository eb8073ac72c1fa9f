//! What the raw topics of a unit say beside their ticks: temperatures, modes, health.

use std::collections::BTreeMap;

use isotherm_correction::sample::LasingMode;
use isotherm_protocol::raw::{GyroBatch, HealthBatch, TemperatureBatch};
use serde::Serialize;

use super::histogram::{Histogram, Spread};

/// Most channels or health readings that are told apart; others are counted.
const MAX_NAMES: usize = 256;

/// Readings of one name.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ReadingInfo {
    /// Unit of measure in which they were sent, as far as it is known; nothing for health readings.
    pub unit: String,
    /// Readings that are numbers.
    pub readings: u64,
    /// Readings that are none.
    pub missing: u64,
    /// The smallest, as it was sent.
    pub min: f64,
    /// The largest, likewise.
    pub max: f64,
    /// Their mean, likewise.
    pub mean: f64,
    /// The first, likewise.
    pub first: f64,
    /// The last, likewise.
    pub last: f64,
}

/// Readings by their name.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Readings {
    /// Each name and its readings.
    #[serde(flatten)]
    pub by_name: BTreeMap<String, ReadingInfo>,
    /// Readings of further names, beyond 256.
    #[serde(skip_serializing_if = "is_zero")]
    pub others: u64,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands a reference over")]
fn is_zero(count: &u64) -> bool {
    *count == 0
}

impl ReadingInfo {
    #[expect(clippy::cast_precision_loss, reason = "readings of a log are far below 2⁵³")]
    fn add(&mut self, value: f64) {
        if !value.is_finite() {
            self.missing += 1;
            return;
        }
        if self.readings == 0 {
            (self.min, self.max, self.first) = (value, value, value);
        }
        self.readings += 1;
        self.mean += (value - self.mean) / self.readings as f64;
        (self.min, self.max, self.last) = (self.min.min(value), self.max.max(value), value);
    }

    /// Notes the readings of ticks, one for each sensor.
    pub(super) fn ticks<'r>(sensors: &mut Vec<Self>, ticks: impl Iterator<Item = &'r [f64]>) {
        for readings in ticks {
            sensors.resize(sensors.len().max(readings.len()), Self::default());
            sensors.iter_mut().zip(readings).for_each(|(sensor, reading)| sensor.add(*reading));
        }
    }
}

impl Readings {
    fn add(&mut self, name: &str, value: f64) {
        if !self.by_name.contains_key(name) {
            if self.by_name.len() == MAX_NAMES {
                self.others += 1;
                return;
            }
            self.by_name.insert(name.to_owned(), ReadingInfo::default());
        }
        if let Some(info) = self.by_name.get_mut(name) {
            info.add(value);
        }
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.by_name.is_empty()
    }

    pub(super) fn temperatures(&mut self, batch: &TemperatureBatch) {
        for reading in &batch.readings {
            self.add(&reading.channel, reading.raw);
        }
    }

    pub(super) fn health(&mut self, batch: &HealthBatch) {
        for reading in batch.ticks.iter().flat_map(|tick| &tick.readings) {
            self.add(&reading.name, reading.value);
        }
    }
}

/// The lasing modes of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct ModeInfo {
    /// Ticks in mode +1.
    pub plus_ticks: u64,
    /// Ticks in mode −1.
    pub minus_ticks: u64,
    /// Ticks in which another mode is commanded than in the one before.
    pub changes: u64,
    /// Ticks at whose start a switch was commanded.
    pub switch_commands: u64,
    /// Time from each change to the next; a whole period is two of them. `None` for fewer than two.
    pub between_changes: Option<Spread>,
}

/// Follows the lasing modes.
#[derive(Debug, Clone, Default)]
pub(super) struct Modes {
    ticks: [u64; 2],
    changes: u64,
    commands: u64,
    mode: Option<LasingMode>,
    changed_ns: Option<i64>,
    between: Histogram,
}

impl Modes {
    /// Takes ticks that go on from those before, or begin anew.
    pub(super) fn take(&mut self, batch: &GyroBatch, anew: bool) {
        if anew {
            (self.mode, self.changed_ns) = (None, None);
        }
        for tick in &batch.ticks {
            self.commands += u64::from(tick.switch_command);
            match tick.mode {
                Some(LasingMode::Plus) => self.ticks[0] += 1,
                Some(LasingMode::Minus) => self.ticks[1] += 1,
                None => continue,
            }
            if self.mode.is_some_and(|mode| Some(mode) != tick.mode) {
                self.changes += 1;
                let end_ns = tick.end_time.as_ns();
                if let Some(before) = self.changed_ns.replace(end_ns) {
                    self.between.add(end_ns.saturating_sub(before).max(0).unsigned_abs());
                }
            }
            self.mode = tick.mode;
        }
    }

    /// What it comes to; `None` for an instrument without modes.
    pub(super) fn finish(self) -> Option<ModeInfo> {
        let [plus_ticks, minus_ticks] = self.ticks;
        (plus_ticks + minus_ticks + self.commands > 0).then(|| ModeInfo {
            plus_ticks,
            minus_ticks,
            changes: self.changes,
            switch_commands: self.commands,
            between_changes: self.between.spread(),
        })
    }
}
