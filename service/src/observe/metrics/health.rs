//! What speaks against the service's health, from one look to the next.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use isotherm_correction::unit::UnitSettings;
use serde::Serialize;

use crate::receive::unit::pairing_window;

/// Longest time that a unit may give nothing out while raw ticks come, what it holds back on purpose left out.
const LONGEST_STALL: Duration = Duration::from_secs(10);
/// How long after an alarm the service does not count as healthy.
const ALARM_LASTS: Duration = Duration::from_secs(60);

/// Why a service that is about to end is neither ready nor healthy.
pub(super) const STOPPING: &str = "the service is stopping";

/// Kind of a reason against the service's health.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Kind {
    /// An event thought impossible, not long ago.
    Alarm,
    /// Raw ticks come, and no corrected ones go out.
    NoOutput,
    /// The state folder cannot be written.
    StateFolder,
    /// A document of the folder is good, and could not be written down.
    UnwrittenDocument,
    /// A unit has an older calibration than was accepted last, or none: that one is damaged.
    OlderCalibration,
    /// The service is not at work yet.
    Starting,
    /// The service is about to end.
    Stopping,
    /// Units could not be looked at in time.
    Busy,
}

/// A reason against the service's health.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Reason {
    /// Its kind.
    pub(super) kind: Kind,
    /// The unit that it concerns; `None` where it is the service.
    pub(super) unit: Option<String>,
    /// In words.
    pub(super) words: String,
}

/// What is seen of one unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Seen {
    /// Raw gyro ticks and refused messages so far.
    pub(super) came: u64,
    /// Raw gyro ticks published corrected so far.
    pub(super) went: u64,
    /// Alarms so far.
    pub(super) alarms: u64,
    /// Whether ticks are to go out: the unit runs, and does not hold back for want of a calibration.
    pub(super) runs: bool,
}

/// One unit from look to look.
#[derive(Debug, Clone, Copy)]
struct Progress {
    seen: Seen,
    /// When something last came that had not come before.
    came_at: Instant,
    /// When something last went out, or was not to.
    went_at: Instant,
    /// What had come by then.
    came_then: u64,
    alarm_at: Option<Instant>,
}

/// Remembers the units from look to look.
#[derive(Debug)]
pub(super) struct Watch {
    /// Longest time without output, and most raw ticks in it: what a unit holds back on purpose counts.
    stall: (Duration, u64),
    alarm: Duration,
    units: BTreeMap<String, Progress>,
}

impl Watch {
    /// For units that hold back a navigation step, and what waits for its accelerometer tick.
    pub(super) fn of(settings: &UnitSettings) -> Self {
        let stall = LONGEST_STALL + pairing_window(settings) * 2;
        Self::new((stall, u64::from(settings.navigation.ticks()) * 2), ALARM_LASTS)
    }

    pub(super) fn new(stall: (Duration, u64), alarm: Duration) -> Self {
        Self { stall, alarm, units: BTreeMap::new() }
    }

    /// Forgets the units that are not there any more, or not watched.
    pub(super) fn keep(&mut self, is_watched: impl Fn(&str) -> bool) {
        self.units.retain(|unit, _| is_watched(unit));
    }

    /// Takes in what is seen of a unit.
    pub(super) fn see(&mut self, now: Instant, unit: &str, seen: Seen) {
        let Some(progress) = self.units.get_mut(unit) else {
            let alarm_at = (seen.alarms > 0).then_some(now);
            let progress = Progress { seen, came_at: now, went_at: now, came_then: seen.came, alarm_at };
            self.units.insert(unit.to_owned(), progress);
            return;
        };
        let before = std::mem::replace(&mut progress.seen, seen);
        if seen.came > before.came {
            progress.came_at = now;
        }
        if seen.went > before.went || !seen.runs {
            (progress.went_at, progress.came_then) = (now, seen.came);
        }
        if seen.alarms > before.alarms {
            progress.alarm_at = Some(now);
        }
    }

    /// How many ticks have come since one last went out, and in how long; `None` where ticks go out, are not to, or do not
    /// come.
    pub(super) fn stall(&self, now: Instant, unit: &str) -> Option<(u64, Duration)> {
        let (progress, (longest, most)) = (self.units.get(unit)?, self.stall);
        let since = now.saturating_duration_since(progress.went_at);
        let came = progress.seen.came - progress.came_then.min(progress.seen.came);
        let comes = now.saturating_duration_since(progress.came_at) < longest;
        (since >= longest && comes && came > most).then_some((came, since))
    }

    /// What speaks against each unit.
    pub(super) fn reasons(&self, now: Instant) -> Vec<Reason> {
        let mut reasons = Vec::new();
        for (unit, progress) in &self.units {
            let mut reason = |kind, words| reasons.push(Reason { kind, unit: Some(unit.clone()), words });
            let since = progress.alarm_at.map(|at| now.saturating_duration_since(at));
            if let Some(since) = since.filter(|since| *since < self.alarm) {
                let (alarms, since_s) = (progress.seen.alarms, since.as_secs());
                reason(
                    Kind::Alarm,
                    format!("unit {unit}: an internal fault {since_s} s ago; {alarms} so far"),
                );
            }
            if let Some((ticks, since)) = self.stall(now, unit) {
                let since_s = since.as_secs();
                reason(
                    Kind::NoOutput,
                    format!("unit {unit}: no corrected tick for {since_s} s, but {ticks} raw ones arrived"),
                );
            }
        }
        reasons
    }
}

#[cfg(test)]
mod tests;
