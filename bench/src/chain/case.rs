//! What a chain is put under.

use std::path::Path;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::subject::Subject;
use crate::part::Plan;

/// When the source publishes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Pace {
    /// All units at the same moment, one after the other.
    #[default]
    Burst,
    /// As fast as it can be done, for so long at most (ms).
    Saturated {
        /// How long (ms).
        limit_ms: u64,
    },
}

/// What goes on beside the ticks: compared with the same without it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Beside {
    /// Every unit is given another calibration each second.
    Swaps,
    /// A second service stands by.
    Standby,
    /// Pages of the console in the browser are open.
    Pages,
}

/// A load.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Case {
    /// Units.
    pub(crate) units: usize,
    /// Ticks per second of each.
    pub(crate) rate_hz: u32,
    /// Ticks in a message.
    pub(crate) batch: usize,
    /// When messages go out.
    pub(crate) pace: Pace,
    /// How long is measured (s).
    pub(crate) seconds: f64,
    /// Ticks of each unit where there is no pace.
    pub(crate) ticks: usize,
    /// What goes on beside the ticks.
    pub(crate) beside: Option<Beside>,
    /// Whether the service has a state folder, in which it writes down every calibration.
    pub(crate) state: bool,
    /// Units that are given another calibration afterwards, one after the other, to see how long that takes.
    pub(crate) timed_swaps: usize,
}

/// What is not measured at the start, where caches are cold (s).
const WARM_UP_S: f64 = 0.5;
/// What goes out before, longer than the window in which a first tick waits for an earlier one (s).
const PRELUDE_S: f64 = 0.06;
/// Ticks of each unit that are checked, and of all units that are kept for it.
const CHECKED: usize = 100;
const KEPT: usize = 200_000;

impl Case {
    /// Units at a rate, for so many seconds.
    pub(crate) fn paced(units: usize, rate_hz: u32, batch: usize, seconds: f64) -> Self {
        Self { units, rate_hz, batch, seconds, state: true, ..Self::default() }
    }

    /// As much as will go through, at most so many ticks of all units in so many seconds.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some seconds")]
    pub(crate) fn saturated(units: usize, batch: usize, ticks: usize, seconds: f64) -> Self {
        let pace = Pace::Saturated { limit_ms: (seconds * 1000.0) as u64 };
        Self { pace, ticks: ticks / units, ..Self::paced(units, 1000, batch, seconds) }
    }

    /// In words.
    pub(crate) fn words(&self) -> String {
        let units = if self.units == 1 { "unit" } else { "units" };
        let batch = match self.batch {
            1 => String::new(),
            batch => format!(", batches of {batch}"),
        };
        let beside = match self.beside {
            Some(Beside::Swaps) => ", a swap each second",
            Some(Beside::Standby) => ", a standby beside it",
            Some(Beside::Pages) => ", pages open",
            None => "",
        };
        match self.pace {
            Pace::Saturated { .. } => format!("{} {units}, saturated, batches of {}", self.units, self.batch),
            Pace::Burst => format!("{} {units} × {} Hz{batch}{beside}", self.units, self.rate_hz),
        }
    }

    /// How long it takes at most, once all is ready.
    pub(crate) fn limit(&self) -> Duration {
        Duration::from_secs_f64(4.0 * (self.seconds + WARM_UP_S) + 10.0)
    }

    /// Whether as much is sent as will go through.
    pub(crate) fn is_saturated(&self) -> bool {
        self.pace != Pace::Burst
    }

    /// Duration of a tick (ns).
    pub(crate) fn tick_ns(&self) -> u64 {
        1_000_000_000 / u64::from(self.rate_hz)
    }

    /// Time between two messages of a unit (ns).
    pub(crate) fn period_ns(&self) -> u64 {
        self.tick_ns() * self.batch as u64
    }

    /// Messages of each unit that are sent before latency counts.
    pub(crate) fn warm_up_messages(&self) -> usize {
        if self.is_saturated() { 0 } else { self.messages_in(WARM_UP_S) }
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "some seconds"
    )]
    fn messages_in(&self, seconds: f64) -> usize {
        (seconds * f64::from(self.rate_hz) / self.batch as f64).ceil() as usize
    }

    /// What the parts are to do.
    pub(crate) fn plan(&self, folder: &Path, subject: Subject) -> Plan {
        let messages = if self.is_saturated() {
            self.ticks / self.batch
        } else {
            self.messages_in(WARM_UP_S + self.seconds)
        };
        let prelude = self.messages_in(PRELUDE_S) + 1;
        Plan {
            case: self.clone(),
            subject,
            messages: prelude + messages.max(1),
            prelude,
            connect: Vec::new(),
            folder: folder.to_owned(),
            keep: CHECKED.min(KEPT.div_ceil(self.units)),
        }
    }
}
