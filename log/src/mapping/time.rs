//! Where the time of a row comes from.

use isotherm_correction::units::Span;
use schemars::JsonSchema;
use serde::Deserialize;

use super::Column;

/// Unit of a time column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[schemars(inline)]
pub enum TimeUnit {
    /// Nanoseconds.
    #[serde(rename = "ns")]
    Nanoseconds,
    /// Microseconds.
    #[serde(rename = "us")]
    Microseconds,
    /// Milliseconds.
    #[serde(rename = "ms")]
    Milliseconds,
    /// Seconds.
    #[serde(rename = "s")]
    Seconds,
    /// Minutes.
    #[serde(rename = "min")]
    Minutes,
    /// Hours.
    #[serde(rename = "h")]
    Hours,
    /// None: date and time of ISO 8601, in UTC where they name no offset.
    #[serde(rename = "iso")]
    DateTime,
    /// None: date and time, day before month: `31.12.2026 23:59:59.250` (UTC).
    #[serde(rename = "dmy")]
    DayFirst,
    /// None: date and time, month before day: `12/31/2026 11:59:59.250 PM` (UTC).
    #[serde(rename = "mdy")]
    MonthFirst,
    /// None: hours, minutes and seconds since midnight.
    #[serde(rename = "time_of_day")]
    TimeOfDay,
}

impl TimeUnit {
    /// What a number is to be multiplied by to be in ns, as a whole number and a power of ten; `None` where stamps are no numbers.
    #[must_use]
    pub fn scale(self) -> Option<(u8, i32)> {
        match self {
            Self::Nanoseconds => Some((1, 0)),
            Self::Microseconds => Some((1, 3)),
            Self::Milliseconds => Some((1, 6)),
            Self::Seconds => Some((1, 9)),
            Self::Minutes => Some((6, 10)),
            Self::Hours => Some((36, 11)),
            Self::DateTime | Self::DayFirst | Self::MonthFirst | Self::TimeOfDay => None,
        }
    }

    /// Whether stamps have a date, which may stand in a column of its own.
    #[must_use]
    pub fn has_date(self) -> bool {
        matches!(self, Self::DateTime | Self::DayFirst | Self::MonthFirst)
    }
}

/// A column that holds a time or a duration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimeColumn {
    /// Which column.
    pub column: Column,
    /// Its unit.
    pub unit: TimeUnit,
    /// Column of the date, where the other has the time of day alone.
    pub date: Option<Column>,
}

/// Which end of the tick a stamp marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum Marks {
    /// The start.
    Start,
    /// The end.
    #[default]
    End,
}

/// Where the time of a row comes from.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(from = "TimeKeys")]
pub struct TimeMapping {
    /// Column of stamps; without one, rows follow each other by `tick`.
    pub stamps: Option<TimeColumn>,
    /// Which end of the tick a stamp marks.
    pub marks: Marks,
    /// Nominal duration of a tick.
    pub tick: Option<Span>,
    /// Whether a tick's duration is the difference of successive stamps; otherwise it is `tick`.
    pub measured: bool,
    /// More than this many nominal ticks between two stamps are a gap; `None`: there are no gaps.
    pub gap_after_ticks: Option<f64>,
    /// Added to every stamp; without a stamp column, start of the first row's tick (ns).
    pub origin_ns: i64,
}

/// Where the time of a row comes from.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct TimeKeys {
    /// Column of stamps.
    column: Option<Column>,
    /// Unit of the stamps.
    unit: Option<TimeUnit>,
    /// Column of the date, where stamps are the time of day alone.
    date_column: Option<Column>,
    /// Which end of the tick a stamp marks.
    #[serde(default)]
    marks: Marks,
    /// Where a tick's duration comes from: the difference of stamps, or the nominal tick.
    duration: Option<DurationRule>,
    /// More than this many nominal ticks between two stamps are a gap.
    #[schemars(range(min = 1.25), extend("x-must-be" = "1.25 or more, or jitter would count as a gap"))]
    gap_after_ticks: Option<f64>,
    /// Added to every stamp; without stamps, start of the first tick (ns).
    #[serde(default)]
    #[schemars(range(min = -2_305_843_009_213_693_952_i64, max = 2_305_843_009_213_693_951_i64))]
    origin_ns: i64,
    /// Nominal tick (ns).
    #[schemars(range(min = 1.0, max = 3.6e12))]
    tick_ns: Option<f64>,
    /// Nominal tick (µs).
    #[schemars(range(min = 1e-3, max = 3.6e9))]
    tick_us: Option<f64>,
    /// Nominal tick (ms).
    #[schemars(range(min = 1e-6, max = 3.6e6))]
    tick_ms: Option<f64>,
    /// Nominal tick (s).
    #[schemars(range(min = 1e-9, max = 3600.0))]
    tick_s: Option<f64>,
}

/// Where a tick's duration comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum DurationRule {
    /// The difference of successive stamps.
    Measured,
    /// The nominal tick.
    Nominal,
}

impl From<TimeKeys> for TimeMapping {
    fn from(keys: TimeKeys) -> Self {
        let ticks = [(keys.tick_ns, 1.0), (keys.tick_us, 1e3), (keys.tick_ms, 1e6), (keys.tick_s, 1e9)];
        let ns = ticks.into_iter().find_map(|(stated, ns)| Some(stated? * ns));
        Self {
            measured: keys.duration.map_or(keys.column.is_some(), |rule| rule == DurationRule::Measured),
            stamps: (keys.column.zip(keys.unit)).map(|(column, unit)| TimeColumn {
                column,
                unit,
                date: keys.date_column,
            }),
            marks: keys.marks,
            tick: ns.map(|ns| Span::from_s(ns * 1e-9)),
            gap_after_ticks: keys.gap_after_ticks,
            origin_ns: keys.origin_ns,
        }
    }
}
