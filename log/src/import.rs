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
mod written;

use std::fmt;
use std::path::Path;

use crate::error::Error;
use crate::mapping::{Encoding, TimeUnit};

pub use propose::propose;

/// What somebody says of a log, in place of a guess.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Hints {
    /// What stands between two cells, as the mapping spells it.
    pub delimiter: Option<String>,
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
pub enum Question {
    /// Which columns hold what; the first rows.
    Columns {
        /// The file.
        file: String,
        /// Columns of a row.
        width: usize,
        /// The first row, and the header if there is one.
        rows: Vec<String>,
    },
    /// Of which unit the log is to be.
    Serial {
        /// The file.
        file: String,
        /// The column.
        column: String,
        /// Its cells.
        serials: Vec<String>,
    },
    /// The unit of the gyros.
    GyroUnit {
        /// Their columns.
        columns: String,
        /// What they state, which is no unit of theirs that is known.
        unknown: Option<String>,
        /// Largest reading.
        largest: String,
    },
    /// The unit of the accelerometers.
    AccelUnit {
        /// Their columns.
        columns: String,
        /// What they state, which is no unit of theirs that is known.
        unknown: Option<String>,
        /// Largest reading.
        largest: String,
    },
    /// The unit of the stamps.
    TimeUnit {
        /// Their column.
        column: String,
        /// What it states, which is no unit of time that is known.
        unknown: Option<String>,
        /// The usual step, in that unit.
        step: String,
    },
    /// Whether dates begin with the day or with the month.
    DateOrder {
        /// Their column.
        column: String,
        /// The first one.
        first: String,
    },
    /// Ticks per second.
    Rate {
        /// The file.
        file: String,
        /// Why its time cannot be used, where it has one.
        why: Option<String>,
    },
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

impl Question {
    /// The option that answers it, with what it takes.
    #[must_use]
    pub fn option(&self) -> String {
        match self {
            Self::Columns { .. } => "--columns NAME,NAME,… (such as 'time [s],gx [deg/s],gy,gz,ax [g],ay,az,temp [degC]'; - for others)".to_owned(),
            Self::Serial { serials, .. } => format!("--serial {}", serials.join("|")),
            Self::GyroUnit { .. } => format!("--gyro-unit {}", GYRO_UNITS.join("|")),
            Self::AccelUnit { .. } => format!("--accel-unit {}", ACCEL_UNITS.join("|")),
            Self::TimeUnit { .. } => format!("--time-unit {}", NUMBER_UNITS.join("|")),
            Self::DateOrder { .. } => format!("--time-unit {}", DATE_ORDERS.join("|")),
            Self::Rate { .. } => "--rate-hz HZ".to_owned(),
        }
    }

    /// Takes an answer; what it must be, where it is none.
    ///
    /// # Errors
    /// What the answer must be.
    pub fn answer(&self, text: &str, hints: &mut Hints) -> Result<(), String> {
        let text = text.trim();
        let one_of = |words: &[&str]| match words.iter().find(|word| **word == text) {
            Some(_) => Ok(Some(text.to_owned())),
            None => Err(format!("must be one of {}", words.join(", "))),
        };
        match self {
            Self::Columns { width, .. } => {
                let columns: Vec<_> = text.split(',').map(|name| name.trim().to_owned()).collect();
                if !columns.iter().any(|column| names::is_gyro(column)) {
                    return Err(format!("names no gyro; name the log's {width} columns in order"));
                }
                hints.columns = columns;
            }
            Self::Serial { serials, .. } => {
                let serials: Vec<_> = serials.iter().map(String::as_str).collect();
                hints.serial = one_of(&serials)?;
            }
            Self::GyroUnit { .. } => hints.gyro_unit = one_of(&GYRO_UNITS)?,
            Self::AccelUnit { .. } => hints.accel_unit = one_of(&ACCEL_UNITS)?,
            Self::TimeUnit { .. } => hints.time_unit = one_of(NUMBER_UNITS)?,
            Self::DateOrder { .. } => hints.time_unit = one_of(&DATE_ORDERS)?,
            Self::Rate { .. } => {
                let rate = text.parse().ok().filter(|rate: &f64| (1e-3..=1e6).contains(rate));
                hints.rate_hz = Some(rate.ok_or("must be a number of ticks per second, 0.001 to 1000000")?);
            }
        }
        Ok(())
    }
}

impl fmt::Display for Question {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Columns { file, width, rows } => {
                write!(
                    f,
                    "{file}: which of the {width} columns are gyros, accelerometers, temperatures and the time? "
                )?;
                write!(f, "The first rows: {}", rows.join(" ⏎ "))
            }
            Self::Serial { file, column, serials } => {
                let serials = serials.join(", ");
                write!(f, "{file} has rows of several units, {serials} in column {column}: of which unit?")
            }
            Self::GyroUnit { columns, unknown, largest } => {
                let stated = states(unknown.as_ref(), SCALE);
                write!(f, "what is the unit of the gyros {columns}?{stated} The largest reading is {largest}")
            }
            Self::AccelUnit { columns, unknown, largest } => {
                let stated = states(unknown.as_ref(), SCALE);
                write!(
                    f,
                    "what is the unit of the accelerometers {columns}?{stated} The largest reading is {largest}"
                )
            }
            Self::TimeUnit { column, unknown, step } => {
                let stated = states(unknown.as_ref(), "");
                write!(f, "what is the unit of the time {column}?{stated} It usually grows by {step}")
            }
            Self::DateOrder { column, first } => {
                write!(f, "does {first:?} in {column} begin with the day (dmy) or with the month (mdy)?")
            }
            Self::Rate { file, why } => {
                let why = why.as_ref().map(|why| format!(" ({why})")).unwrap_or_default();
                write!(f, "{file} has no usable time{why}: how many rows per second?")
            }
        }
    }
}

/// What a header states in vain, and what helps.
fn states(unknown: Option<&String>, help: &str) -> String {
    let words = |text| format!(" The header states {text:?}, which import does not know{help}.");
    unknown.map_or_else(String::new, words)
}

/// What helps where a mapping takes a scale.
const SCALE: &str = ": for other units, give the nearest and set `scale` in the mapping";

/// Refuses a log whose form no mapping can describe, in a sentence.
fn refuse(path: &Path, words: impl Into<String>) -> Error {
    Error::Usage(format!("{}: {}", path.display(), words.into()))
}
