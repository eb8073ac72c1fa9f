//! What operators see of units and services, as lines: pure, so that `status`, `top` and tests show the same.
//!
//! | module | holds |
//! |---|---|
//! | `remark` | what is to be noticed of a unit, and how grave it is |
//! | `units`, `services`, `pairs` | one line a unit, one a service instance, one an instance of a pair |
//! | `sheet` | everything of one unit |
//! | `grid`, `figure`, `tone`, `chart` | columns, numbers, colours, bars |

mod chart;
mod figure;
mod grid;
mod pairs;
mod remark;
mod services;
mod sheet;
#[cfg(test)]
pub(crate) mod tests;
pub mod tone;
mod units;

use std::time::{Duration, Instant};

use isotherm_correction::sample::ChannelName;
use isotherm_protocol::pair::PairReport;
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::Status;
use ratatui::text::Line;
use serde::Serialize;

pub use figure::fit;
pub(crate) use figure::{deg_per_h, of, short};
pub use pairs::{name, pairs, said as said_of_pairs};
pub(crate) use remark::schedule;
pub use remark::{Level, Remark, knows_rates, state_word};
pub use services::{services, tally};
pub use sheet::sheet;
pub use units::{applied, channel_in_view, range, units};

/// A unit: its status, and what only an onlooker knows.
#[derive(Debug, Clone)]
pub struct Unit<'a> {
    /// Its last status.
    pub status: &'a Status,
    /// How long ago that came.
    pub age: Duration,
    /// How long nobody has answered for the unit; `None` while it is there.
    pub gone: Option<Duration>,
    /// The present time by the service's clock (ms since 1970-01-01 UTC).
    pub now_unix_ms: i64,
    /// What has changed of late; all zero where nobody has looked for long enough.
    pub lately: Lately,
    /// Temperatures as they were, oldest first; empty where nobody has looked.
    pub past: &'a [Past],
}

impl<'a> Unit<'a> {
    /// A unit of which only the status is known, and that it has just come.
    #[must_use]
    pub fn now(status: &'a Status, now_unix_ms: i64) -> Self {
        let (age, lately) = (Duration::ZERO, Lately::default());
        Self { status, age, gone: None, now_unix_ms, lately, past: &[] }
    }
}

/// Counters that stand in the line of a unit: by how much they grew over the last minute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Lately {
    /// Gaps announced.
    pub gaps: u64,
    /// Ticks that had been taken before.
    pub duplicates: u64,
    /// Ticks and readings that came too late.
    pub late: u64,
    /// Frames refused.
    pub bad: u64,
    /// Raw ticks come, the unit is running, and for ten seconds nothing has gone out.
    #[serde(skip)]
    pub stuck: bool,
}

impl Lately {
    /// What the counters of a status have counted since its service started.
    #[must_use]
    pub fn counted(status: &Status) -> Self {
        Self {
            gaps: status.counter("gaps"),
            duplicates: total(status, &["gyro_duplicates", "accel_duplicates"]),
            late: total(status, &["gyro_late", "accel_late", "temperature_late", "references_late"]),
            bad: status.counter("bad_frames"),
            stuck: false,
        }
    }

    /// By how much it has grown since then.
    pub(crate) fn since(&self, before: &Self) -> Self {
        Self {
            gaps: self.gaps.saturating_sub(before.gaps),
            duplicates: self.duplicates.saturating_sub(before.duplicates),
            late: self.late.saturating_sub(before.late),
            bad: self.bad.saturating_sub(before.bad),
            stuck: false,
        }
    }
}

/// Services, instances, and units, a line each.
#[must_use]
pub fn overview(
    services: (&[ServiceStatus], &[String]),
    instances: &[PairReport],
    units: &[Unit<'_>],
    columns: usize,
) -> Vec<Line<'static>> {
    let mut lines = self::services(services, instances, columns);
    lines.extend(pairs(instances, columns));
    lines.push(tally(units, columns));
    if !units.is_empty() {
        lines.push(Line::default());
        lines.extend(self::units(units, columns).lines());
    }
    lines
}

/// Every channel at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Past {
    /// When it was seen.
    pub at: Instant,
    /// Name, temperature (°C), rate (°C/s).
    pub channels: Vec<(ChannelName, f64, f64)>,
}

/// Counters that stand in one column.
fn total(status: &Status, names: &[&str]) -> u64 {
    names.iter().fold(0, |total, name| total.saturating_add(status.counter(name)))
}
