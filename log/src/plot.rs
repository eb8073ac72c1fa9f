//! A log, or two over one time axis, as one page to look at.
//!
//! [`plot()`] reads the logs once, message by message, and keeps of each quantity at most a stated number of bins with smallest,
//! largest and mean value (see `track`): memory and page are bounded, however long the logs are.
//!
//! | module | holds |
//! |---|---|
//! | `track` | values over time in bounded memory |
//! | `reading` | the logs in step, message by message |
//! | `unit` | what the messages of a unit give to draw |
//! | `time` | the producer's clock with its jumps taken out |
//! | `nominal` | raw readings by nominal scale, where a calibration is known |
//! | `difference` | corrected ticks of two logs subtracted |
//! | `layout` | which panel shows what |

mod difference;
mod layout;
mod nominal;
mod reading;
#[cfg(test)]
mod tests;
mod time;
mod track;
mod unit;

use std::collections::BTreeMap;

use isotherm_protocol::document::Parsed;
use isotherm_protocol::key::UnitId;
use serde::Serialize;

use crate::diff::AXES;
use crate::error::Error;
use crate::part::Messages;
use crate::source::LogReport;

use isotherm_pages::Page;
pub use nominal::nominal_forces;
use reading::Plot;

/// Most units on a page.
pub const MAX_UNITS: usize = 16;

/// A log to plot.
#[derive(Debug)]
pub struct PlotLog {
    /// Its name on the page.
    pub name: String,
    /// Its messages.
    pub messages: Messages,
    /// The serial that its only unit is shown under; `None` leaves all as they are.
    pub shown_as: Option<UnitId>,
    /// Its raw messages are corrected with [`PlotOptions::calibration`], and shown from this time of reception on (ns): for logs that
    /// hold nothing corrected.
    pub correct_from: Option<u64>,
}

/// How logs are plotted.
#[derive(Debug, Clone)]
pub struct PlotOptions {
    /// Most bins of each quantity (2…2²⁰); up to three times as many ticks are shown one by one.
    pub detail: usize,
    /// A calibration document: the nominal scale of raw readings, and what [`PlotLog::correct_from`] corrects with.
    pub calibration: Option<Parsed>,
}

impl Default for PlotOptions {
    fn default() -> Self {
        Self { detail: 1 << 15, calibration: None }
    }
}

/// How two logs of a unit differ.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct DifferenceSummary {
    /// Corrected ticks that both logs have; those without a calibration are not compared.
    pub common_ticks: u64,
    /// Of these, ticks whose increments differ at all.
    pub differing_ticks: u64,
    /// Corrected ticks that only the first has.
    pub only_first: u64,
    /// Corrected ticks that only the second has.
    pub only_second: u64,
}

/// What of a unit in one log is on the page.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct UnitSummary {
    /// Raw gyro ticks.
    pub raw_ticks: u64,
    /// Corrected ticks.
    pub corrected_ticks: u64,
    /// Of these, ticks without a calibration: their values are not drawn, for raw readings pass through them unscaled.
    pub uncalibrated_ticks: u64,
    /// Raw ticks that corrected ones announce as missing.
    pub missed_ticks: u64,
    /// Calibration changes, commands and the like.
    pub marks: u64,
    /// Further ones, beyond 2000.
    pub marks_left_out: u64,
    /// Messages that cannot be read.
    pub unreadable_messages: u64,
}

impl UnitSummary {
    /// How many of the corrected ticks are not drawn, as the end of a clause; empty where all are.
    #[must_use]
    pub fn undrawn(&self) -> String {
        match self.uncalibrated_ticks {
            0 => String::new(),
            ticks => format!(" ({ticks} of them uncalibrated: not drawn)"),
        }
    }
}

/// What is on the page.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct PlotSummary {
    /// Names of the logs.
    pub logs: Vec<String>,
    /// The serial of each log's unit, where it is shown under that of another log.
    #[serde(skip_serializing_if = "none_has_its_own")]
    pub own_serials: Vec<Option<String>>,
    /// What reading each of them came to.
    pub reading: Vec<LogReport>,
    /// Units by their serial, each with what it is in each log; `None` where a log does not have it.
    pub units: BTreeMap<String, Vec<Option<UnitSummary>>>,
    /// How the logs differ, by unit; units that both have corrected.
    pub differences: BTreeMap<String, DifferenceSummary>,
    /// Units that were left out because there are more than 16.
    pub units_left_out: u64,
    /// By how much the second log was moved on the time axis (ns), where the two do not overlap.
    pub second_moved_ns: Option<i64>,
    /// What correcting the logs refused or passed over, in words.
    pub troubles: Vec<String>,
    /// Raw ticks that correcting the logs refused.
    pub refused_ticks: u64,
}

fn none_has_its_own(serials: &[Option<String>]) -> bool {
    serials.iter().all(Option::is_none)
}

impl PlotSummary {
    /// The serial in a log, counted from 0, of what is shown under this one.
    #[must_use]
    pub fn serial_in<'a>(&'a self, log: usize, shown: &'a str) -> &'a str {
        self.own_serials.get(log).and_then(Option::as_deref).unwrap_or(shown)
    }

    /// The serials of what is shown under this one.
    #[must_use]
    pub fn serials(&self, shown: &str) -> String {
        let mut serials: Vec<_> = (0..self.logs.len()).map(|log| self.serial_in(log, shown)).collect();
        serials.dedup();
        serials.join(" and ")
    }
}

/// Reads the logs and draws them.
///
/// `progress` is called now and then with the messages read so far.
///
/// # Errors
/// What reading the logs gives; [`Error::Calibration`] for a document that is not valid; [`Error::Usage`] where there is
/// nothing to draw.
pub fn plot(
    logs: Vec<PlotLog>,
    options: &PlotOptions,
    progress: &mut dyn FnMut(u64),
) -> Result<(Page, PlotSummary), Error> {
    let mut plot = Plot::new(logs, options)?;
    let mut read = 0;
    while plot.step()? {
        read += 1;
        if read % 256 == 0 {
            progress(read);
        }
    }
    plot.finish()
}
