//! What is wrong with a log, and where.

use std::io;

use isotherm_document::escape::clipped;
use thiserror::Error;

use crate::mapping::TimeUnit;

/// What of a column's name is shown, in characters.
const LONGEST_NAME: usize = 80;

/// What is wrong with a log; boxed, because it is rare and large.
#[derive(Debug, Error)]
#[error(transparent)]
pub struct LogError(pub Box<LogFault>);

/// What is wrong with a log, and where.
#[derive(Debug, Error)]
#[error("{file}:{line}:{column}: {}{reason}{}{}", self.subject(), self.cut_words(), self.advice())]
pub struct LogFault {
    /// The file.
    pub file: String,
    /// Line, from 1.
    pub line: u64,
    /// Column in bytes, from 1.
    pub column: u32,
    /// Number and name of the cell, where one is to blame.
    pub cell: Option<(usize, Option<String>)>,
    /// The cell as written, shortened.
    pub value: String,
    /// It is the last line and has no line end: what is wrong with it may be that the log was cut off in it.
    pub cut: bool,
    /// What is wrong.
    pub reason: Reason,
}

/// What is wrong with a row, or with a file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Reason {
    /// The row ends before this cell.
    #[error("is missing, the row has only {cells} cells")]
    MissingCell {
        /// How many it has.
        cells: usize,
    },
    /// The row goes on behind the last column.
    #[error("is one too many, {} has only {columns} columns{}", if *.named { "the header" } else { "the first row" }, if *.commas { ": \
        decimal commas and comma delimiters cannot be combined" } else { "" })]
    TooManyCells {
        /// How many columns there are.
        columns: usize,
        /// The header says so; else the first row.
        named: bool,
        /// The delimiter is a comma.
        commas: bool,
    },
    /// Nothing in the cell.
    #[error("is empty")]
    Empty,
    /// Not a number.
    #[error("is not a number{}", if *.comma { " (decimal commas need decimal_mark = \",\" in the mapping)" } else { "" })]
    NotANumber {
        /// It has a comma where the mapping says that decimals have a point.
        comma: bool,
    },
    /// A count that is not whole, or does not fit 32 bits.
    #[error("is not a whole number of 32 bits, as counts must be (for other readings: output = \"mean\")")]
    NotACount,
    /// A sequence number that is none.
    #[error("is not a sequence number, a whole number from 0")]
    NotASequence,
    /// Not a time.
    #[error("is not a time that fits 64 bits of nanoseconds")]
    NotATime,
    /// Neither date nor time.
    #[error("is not a {}", match .unit {
        TimeUnit::DayFirst => "date and time, day before month, such as 23.11.2026 14:05:00.250",
        TimeUnit::MonthFirst => "date and time, month before day, such as 11/23/2026 14:05:00.250",
        TimeUnit::TimeOfDay => "time of day, such as 14:05:00.250",
        _ => "date and time of ISO 8601, such as 2026-11-23T14:05:00.250Z",
    })]
    NotADateTime {
        /// What it must be.
        unit: TimeUnit,
    },
    /// A status word that is none.
    #[error("is not a status word, a whole number from 0 (hexadecimal with 0x)")]
    NotAWord,
    /// A row that does not hold by its status.
    #[error("is not the status of a valid row")]
    BadStatus,
    /// A duration below zero.
    #[error("is a duration below 0")]
    NegativeDuration,
    /// The time does not increase.
    #[error("is {}: time must increase", if *.again { format!("the time of line {line} again, with other values") } else { format!("not after {before:?} of line {line}") })]
    TimeNotIncreasing {
        /// Time of the row before, as it is written.
        before: String,
        /// Its line.
        line: u64,
        /// They are equal.
        again: bool,
    },
    /// A step of time that no tick spans, where the mapping knows of no gaps.
    #[error(
        "is {} s after the row before it, {ticks} nominal ticks: for a log with gaps, set gap_after_ticks in [file.time]",
        (.step * 1e9).round() / 1e9
    )]
    Gap {
        /// The step (s).
        step: f64,
        /// The same in nominal ticks.
        ticks: u64,
    },
    /// A state that the mapping does not name.
    #[error("must be {plus:?} or {minus:?}")]
    UnknownState {
        /// Cell that means +1, or yes.
        plus: String,
        /// Cell that means −1, or no.
        minus: String,
    },
    /// A quoted cell that does not end on its line.
    #[error("opens a quote that is not closed on this line")]
    OpenQuote,
    /// A line that no text log has.
    #[error("line is longer than {limit} bytes: is this a text log?")]
    LineTooLong {
        /// Longest line (bytes).
        limit: usize,
    },
    /// The header does not have a column of the mapping.
    #[error("the header has no column {name:?}, it has {header}")]
    NoSuchColumn {
        /// Name in the mapping.
        name: String,
        /// Names in the header.
        header: String,
    },
    /// The header has a column of the mapping more than once.
    #[error("the header has the column {name:?} more than once: give its number instead")]
    AmbiguousColumn {
        /// Name in the mapping.
        name: String,
    },
    /// A sensor's column is mapped to something else, too.
    #[error("column {column} is mapped twice, as {first} and as {second}: correct the mapping")]
    ColumnTwice {
        /// Which column, from 1.
        column: usize,
        /// What it is mapped to.
        first: String,
        /// What else it is mapped to.
        second: String,
    },
    /// The header line is missing.
    #[error("the file ends before its header")]
    NoHeader,
    /// Text in another encoding.
    #[error("is UTF-16 text: save it as UTF-8")]
    Utf16,
    /// A compressed file ends in the middle.
    #[error("the compressed file is cut short")]
    CutShort,
    /// The file cannot be read on.
    #[error("cannot read on: {0}")]
    Io(io::Error),
}

impl Reason {
    /// Whether passing over the row helps.
    pub(super) fn concerns_one_row(&self) -> bool {
        !matches!(
            self,
            Self::NoSuchColumn { .. }
                | Self::AmbiguousColumn { .. }
                | Self::ColumnTwice { .. }
                | Self::NoHeader
                | Self::Utf16
                | Self::Io(_)
                | Self::CutShort
        )
    }
}

impl LogFault {
    /// The cell that is to blame and its value.
    fn subject(&self) -> String {
        let Some((number, name)) = &self.cell else { return String::new() };
        let name = name.as_ref().map(|name| format!(" \"{}\"", clipped(name, LONGEST_NAME)));
        let name = name.unwrap_or_default();
        let value = match self.reason {
            Reason::MissingCell { .. } | Reason::Empty => String::new(),
            _ => format!("{:?} ", self.value),
        };
        format!("column {number}{name}: {value}")
    }

    /// Why it may be wrong.
    fn cut_words(&self) -> &'static str {
        if self.cut { "; the last line has no line end, so the log was cut off here" } else { "" }
    }

    /// What to do.
    fn advice(&self) -> &'static str {
        match self.reason {
            Reason::CutShort => "; to use the rest, set on_bad_row = \"skip\" in the mapping",
            ref reason if reason.concerns_one_row() => {
                "; correct the row, or set on_bad_row = \"skip\" in the mapping to skip and count such rows"
            }
            _ => "",
        }
    }
}
