//! A column mapping proposed for a text log of any maker: from its bytes, its header and its figures.
//!
//! | module | finds |
//! |---|---|
//! | `layout` | encoding, delimiter, decimal mark, comments, header, row of units |
//! | `words` | the words of a column's name, in English |
//! | `names` | what a column holds, along which axis |
//! | `units` | in which unit |
//! | `clock` | units of time, rates |
//! | `figures` | what the rows say: period, gaps, counters, empty cells |
//! | `propose` | the mapping, what it rests on, and what cannot be told |
//!
//! What is proposed is only ever a mapping: the log is read by the one reader of text logs.

mod clock;
mod figures;
mod layout;
mod names;
mod propose;
mod units;
mod words;

use std::fmt;
use std::path::Path;

use crate::error::Error;
use crate::mapping::{Delimiter, Encoding, TimeUnit};

pub use propose::propose;

/// What somebody says of a log, in place of a guess.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Hints {
    /// What stands between two cells.
    pub delimiter: Option<Delimiter>,
    /// Decimal mark, `.` or `,`.
    pub decimal_mark: Option<char>,
    /// Encoding of the text.
    pub encoding: Option<Encoding>,
    /// Names of the columns in place of the header's, each with its unit in brackets; `-` for one that is to be passed over.
    pub columns: Vec<String>,
    /// Unit of the gyros, as the mapping spells it.
    pub gyro_unit: Option<String>,
    /// Unit of the accelerometers, as the mapping spells it.
    pub accel_unit: Option<String>,
    /// Unit of the stamps, as the mapping spells it.
    pub time_unit: Option<String>,
    /// Ticks per second, where the log has no stamps.
    pub rate_hz: Option<f64>,
    /// Of rows of several units, the one whose are taken.
    pub serial: Option<String>,
    /// Rows that cannot be read are passed over.
    pub skip_bad_rows: bool,
}

/// A mapping for a log, as far as it could be found.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// Its text; it can be read where nothing is open.
    pub mapping: String,
    /// What it says and what that rests on, for whoever looks it over.
    pub notes: Vec<String>,
    /// What must be said before it holds.
    pub open: Vec<Question>,
}

/// Something that a log does not say.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Question {
    words: String,
    asked: Asked,
}

/// What an answer says.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Asked {
    /// Which of so many columns hold what.
    Columns(usize),
    /// Of which of these units the log is to be.
    Serial(Vec<String>),
    /// The unit of the gyros.
    GyroUnit,
    /// The unit of the accelerometers.
    AccelUnit,
    /// The unit of the stamps.
    TimeUnit,
    /// Whether dates begin with the day or with the month.
    DateOrder,
    /// Ticks per second.
    Rate,
}

/// Units of gyros, as the mapping spells them.
pub const GYRO_UNITS: [&str; 9] =
    ["deg_per_s", "rad_per_s", "deg_per_h", "raw", "counts", "rad", "deg", "arcsec", "raw_per_tick"];
/// Units of accelerometers, as the mapping spells them.
pub const ACCEL_UNITS: [&str; 8] =
    ["m_per_s2", "g", "mg", "volt", "raw", "counts", "m_per_s", "raw_per_tick"];
/// Units of stamps, as the mapping spells them: numbers, then dates and times of day.
pub const TIME_UNITS: [&str; 10] = ["s", "ms", "us", "ns", "min", "h", "iso", "dmy", "mdy", "time_of_day"];
/// Those of numbers.
const NUMBER_UNITS: &[&str] = TIME_UNITS.split_at(6).0;
/// Those of dates and times of day.
pub(crate) const STAMP_UNITS: [(TimeUnit, &str); 4] = [
    (TimeUnit::DateTime, "iso"),
    (TimeUnit::DayFirst, "dmy"),
    (TimeUnit::MonthFirst, "mdy"),
    (TimeUnit::TimeOfDay, "time_of_day"),
];
/// How dates may begin: with the day, with the month.
const DATE_ORDERS: [&str; 2] = ["dmy", "mdy"];

impl Hints {
    /// Which of day and month is said to stand first.
    pub(crate) fn date_order(&self) -> Option<TimeUnit> {
        let said = self.time_unit.as_deref().filter(|unit| DATE_ORDERS.contains(unit))?;
        STAMP_UNITS.iter().find(|(_, word)| *word == said).map(|(unit, _)| *unit)
    }
}

impl Asked {
    /// The option that answers it, and the words that it takes, where these are few.
    fn option(&self) -> (&'static str, Vec<&str>) {
        match self {
            Self::Columns(_) => ("--columns", Vec::new()),
            Self::Serial(serials) => ("--serial", serials.iter().map(String::as_str).collect()),
            Self::GyroUnit => ("--gyro-unit", GYRO_UNITS.to_vec()),
            Self::AccelUnit => ("--accel-unit", ACCEL_UNITS.to_vec()),
            Self::TimeUnit => ("--time-unit", NUMBER_UNITS.to_vec()),
            Self::DateOrder => ("--time-unit", DATE_ORDERS.to_vec()),
            Self::Rate => ("--rate-hz", Vec::new()),
        }
    }
}

impl Question {
    /// The option that answers it, with what it takes.
    #[must_use]
    pub fn option(&self) -> String {
        let (name, words) = self.asked.option();
        match self.asked {
            Asked::Columns(_) => format!(
                "{name} NAME,NAME,… (such as 'time [s],gx [deg/s],gy,gz,ax [g],ay,az,temp [degC]'; - for others)"
            ),
            Asked::Rate => format!("{name} HZ"),
            _ => format!("{name} {}", words.join("|")),
        }
    }

    /// Takes an answer; what it must be, where it is none.
    ///
    /// # Errors
    /// What the answer must be.
    pub fn answer(&self, text: &str, hints: &mut Hints) -> Result<(), String> {
        let text = text.trim();
        let (_, words) = self.asked.option();
        let word = || match words.iter().find(|word| **word == text) {
            Some(_) => Ok(Some(text.to_owned())),
            None => Err(format!("must be one of {}", words.join(", "))),
        };
        match self.asked {
            Asked::Columns(width) => {
                let columns: Vec<_> = text.split(',').map(|name| name.trim().to_owned()).collect();
                if !columns.iter().any(|column| names::is_gyro(column)) {
                    return Err(format!("names no gyro; name the log's {width} columns in order"));
                }
                hints.columns = columns;
            }
            Asked::Serial(_) => hints.serial = word()?,
            Asked::GyroUnit => hints.gyro_unit = word()?,
            Asked::AccelUnit => hints.accel_unit = word()?,
            Asked::TimeUnit | Asked::DateOrder => hints.time_unit = word()?,
            Asked::Rate => {
                let rate = text.parse().ok().filter(|rate: &f64| (1e-3..=1e6).contains(rate));
                hints.rate_hz = Some(rate.ok_or("must be a number of ticks per second, 0.001 to 1000000")?);
            }
        }
        Ok(())
    }
}

impl fmt::Display for Question {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words)
    }
}

impl Proposal {
    /// Asks something.
    fn ask(&mut self, asked: Asked, words: String) {
        self.open.push(Question { words, asked });
    }
}

/// What a header states in vain, and what helps.
fn states(unknown: Option<&String>, help: &str) -> String {
    let words = |text| format!(" The header states {text:?}, which import does not know{help}.");
    unknown.map_or_else(String::new, words)
}

/// Refuses a log whose form no mapping can describe, in a sentence.
fn refuse(path: &Path, words: impl Into<String>) -> Error {
    Error::Usage(format!("{}: {}", path.display(), words.into()))
}
