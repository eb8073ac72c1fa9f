//! Column mapping: which column of a text log is what, in which unit.
//!
//! A mapping is a small TOML file, described in full by `docs/replay.md` and by the ready ones in
//! `config/mappings`. Parsing reports every problem at once, each with file, line, column, key and value.

mod encoding;
mod keys;
mod meaning;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

pub use encoding::Encoding;
use isotherm_correction::sample::{ChannelName, OutputKind};
use isotherm_correction::units::Span;
pub use isotherm_document::Problem;
pub use keys::{AccelUnit, GyroUnit, TemperatureUnit};
pub use meaning::SensorUnit;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::Error;
use crate::file::read_small_text;

/// Version of the mapping format that this program reads.
pub const VERSION: u32 = 1;

/// How one log, of one or more files, is read.
#[derive(Debug, Clone, PartialEq)]
pub struct Mapping {
    /// Its files, at least one; together they have exactly one gyro stream.
    pub files: Vec<FileMapping>,
}

/// How one file of a log is read.
#[derive(Debug, Clone, PartialEq)]
pub struct FileMapping {
    /// Its name inside the log's folder, where the log is a folder.
    pub name: Option<String>,
    /// How bytes become rows and cells.
    pub layout: Layout,
    /// Where the time of a row comes from.
    pub time: TimeMapping,
    /// The gyros, where the file has them.
    pub gyro: Option<GyroMapping>,
    /// The accelerometers, where the file has them.
    pub accel: Option<TickMapping>,
    /// Temperature channels; may be empty.
    pub temperatures: Vec<TemperatureMapping>,
    /// What says of each row whether it holds, where the file has that.
    pub status: Option<StatusMapping>,
}

/// What stands between two cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(from = "DelimiterWord")]
#[schemars(inline)]
pub enum Delimiter {
    /// Any run of spaces and tabs; leading ones do not count.
    Whitespace,
    /// One ASCII character; cells may be quoted with `"`.
    Character(u8),
}

/// What happens to a row that cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum OnBadRow {
    /// Reading ends with an error.
    #[default]
    Refuse,
    /// The row is passed over and counted; its tick becomes a gap.
    Skip,
}

/// How bytes become rows and cells.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
pub struct Layout {
    /// Encoding of the text.
    #[serde(default)]
    pub encoding: Encoding,
    /// What stands between two cells.
    pub delimiter: Delimiter,
    /// Lines that begin with this are passed over.
    #[schemars(
        regex(pattern = r"^[^0-9\s+\-.]"),
        extend("x-must-be" = "a prefix that no row of numbers begins with, and not empty")
    )]
    pub comment: Option<String>,
    /// Lines in front, neither blank nor comments, that are passed over.
    #[serde(default)]
    #[schemars(range(max = 1_000_000))]
    pub skip_lines: u64,
    /// Whether the next line names the columns.
    #[serde(default)]
    pub header: bool,
    /// Rows of data in front that are passed over.
    #[serde(default)]
    #[schemars(range(max = 1_000_000))]
    pub drop_rows: u64,
    /// Decimal mark.
    #[serde(default)]
    pub decimal_mark: DecimalMark,
    /// What happens to a row that cannot be read.
    #[serde(default)]
    pub on_bad_row: OnBadRow,
}

/// Decimal mark of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[schemars(inline)]
#[repr(u8)]
pub enum DecimalMark {
    /// A point.
    #[default]
    #[serde(rename = ".")]
    Point = b'.',
    /// A comma.
    #[serde(rename = ",")]
    Comma = b',',
}

/// A column, by name or by place.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(from = "ColumnWord")]
#[schemars(inline)]
pub enum Column {
    /// As the header spells it.
    Name(String),
    /// Counted from 0; files count from 1.
    Index(usize),
}

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
    /// None: date and time of ISO 8601, in UTC where they name no offset.
    #[serde(rename = "iso")]
    DateTime,
}

/// A column that holds a time or a duration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimeColumn {
    /// Which column.
    pub column: Column,
    /// Its unit.
    pub unit: TimeUnit,
}

/// Which end of the tick a stamp marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum Marks {
    /// The start.
    Start,
    /// The end.
    End,
}

/// Where the time of a row comes from.
#[derive(Debug, Clone, PartialEq)]
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

/// Conversion of a cell: `(cell − mid_scale) · factor`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conversion {
    /// Raw reading that stands for zero.
    pub mid_scale: f64,
    /// Sign, scale and unit together.
    pub factor: f64,
    /// The result is an increment over the tick, to be divided by its duration.
    pub per_tick: bool,
}

impl Conversion {
    /// The number that a cell stands for.
    #[must_use]
    pub fn of(&self, cell: f64) -> f64 {
        (cell - self.mid_scale) * self.factor
    }
}

/// One sensor's column.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorMapping {
    /// Which column.
    pub column: Column,
    /// To counts, rad/s, or m/s² (V or raw for a calibration that takes these).
    pub conversion: Conversion,
}

/// Sensors of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct TickMapping {
    /// What the readings stand for.
    pub output: OutputKind,
    /// One to eight sensors, in the order of the calibration document.
    pub sensors: Vec<SensorMapping>,
    /// Column of sequence numbers; without one, rows are counted.
    pub sequence: Option<Column>,
    /// Column of durations; overrides the file's rule.
    pub duration: Option<TimeColumn>,
    /// A row whose cells of these sensors are all empty has no tick of them.
    pub may_be_empty: bool,
}

/// A column of two states.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct ModeMapping {
    /// Which column.
    pub column: Column,
    /// Cell that means +1.
    #[serde(default = "ModeMapping::plus")]
    pub plus: String,
    /// Cell that means −1.
    #[serde(default = "ModeMapping::minus")]
    pub minus: String,
    /// An empty cell is no state at all.
    #[serde(default)]
    pub may_be_empty: bool,
}

/// A column that says whether the row's readings hold. A row of which it says otherwise is passed over; its tick becomes a gap.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct StatusMapping {
    /// Which column.
    pub column: Column,
    /// Cells of rows that hold.
    #[serde(default)]
    pub good: Vec<String>,
    /// Bits of the status word of which none is set in a row that holds.
    #[schemars(range(min = 1))]
    pub bad_bits: Option<u64>,
}

/// Where mode-switch commands come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SwitchMapping {
    /// A column: `1` in the tick at whose start the switch was commanded, else `0`.
    Column(Column),
    /// A tick whose mode differs from the last one's.
    ModeChange,
}

/// The gyros of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct GyroMapping {
    /// Sensors and their ticks.
    pub ticks: TickMapping,
    /// Lasing mode.
    pub mode: Option<ModeMapping>,
    /// Switch commands.
    pub switch: Option<SwitchMapping>,
    /// Phase of the slow meander.
    pub meander: Option<ModeMapping>,
    /// Half-period counts, positive and negative, one pair per sensor, or none.
    pub half_periods: Vec<HalfPeriodMapping>,
}

/// Half-period counts of one gyro.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct HalfPeriodMapping {
    /// Column of the positive half.
    pub positive: Column,
    /// Column of the negative half.
    pub negative: Column,
}

/// One temperature channel.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct TemperatureMapping {
    /// Name, as the calibration document spells it.
    #[schemars(
        with = "String",
        length(min = 1, max = 24),
        regex(pattern = r"\S"),
        extend("x-must-be" = "a name of 1 to 24 bytes")
    )]
    pub channel: ChannelName,
    /// Which column.
    pub column: Column,
    /// Its unit.
    pub unit: TemperatureUnit,
    /// Every how many rows a reading is taken, from the first on.
    #[serde(default = "TemperatureMapping::every_row")]
    #[schemars(range(min = 1, max = 1_000_000))]
    pub every_rows: u64,
    /// A row whose cell is empty has no reading.
    #[serde(default)]
    pub may_be_empty: bool,
}

impl TemperatureMapping {
    fn every_row() -> u64 {
        1
    }
}

impl Mapping {
    /// Reads a mapping from a file.
    ///
    /// # Errors
    /// [`Error::File`] where the file cannot be read, [`Error::Mapping`] with all its problems.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let text = read_small_text(path, "read the mapping")?;
        Self::parse(&text, &path.display().to_string()).map_err(Error::Mapping)
    }

    /// Reads a mapping from text; `file` is for messages.
    ///
    /// # Errors
    /// Every problem that the mapping has, in the order of its lines.
    pub fn parse(text: &str, file: &str) -> Result<Self, Vec<Problem>> {
        meaning::parse(text, file)
    }

    /// Where the mapping of a log stands by default: `zeeman.csv.gz` has `zeeman.mapping.toml` beside it.
    #[must_use]
    pub fn path_beside(log: &Path) -> PathBuf {
        let plain = if log.extension().is_some_and(|extension| extension == "gz") {
            log.with_extension("")
        } else {
            log.to_owned()
        };
        plain.with_extension("mapping.toml")
    }

    /// The mapping's file of a text log: the one given, else the one beside the log's first file where there is one.
    #[must_use]
    pub fn path_of(given: Option<&Path>, log: &[PathBuf]) -> Option<PathBuf> {
        given.map(Path::to_owned).or_else(|| {
            let beside = Self::path_beside(log.first()?);
            beside.is_file().then_some(beside)
        })
    }
}

impl ModeMapping {
    fn plus() -> String {
        "1".to_owned()
    }

    fn minus() -> String {
        "-1".to_owned()
    }
}

/// A delimiter by its word.
#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
enum DelimiterWord {
    Comma,
    Semicolon,
    Tab,
    Pipe,
    Whitespace,
}

impl From<DelimiterWord> for Delimiter {
    fn from(word: DelimiterWord) -> Self {
        Self::Character(match word {
            DelimiterWord::Comma => b',',
            DelimiterWord::Semicolon => b';',
            DelimiterWord::Tab => b'\t',
            DelimiterWord::Pipe => b'|',
            DelimiterWord::Whitespace => return Self::Whitespace,
        })
    }
}

/// A column by its name in the header, or by its number from 1.
#[derive(Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline, extend("x-must-be" = "the column's name in the header, or its number from 1"))]
enum ColumnWord {
    Name(
        #[schemars(
            regex(pattern = r"\S"),
            extend("x-must-be" = "the column's name in the header, or its number from 1")
        )]
        String,
    ),
    Number(#[schemars(range(min = 1, max = 4096))] u16),
}

impl From<ColumnWord> for Column {
    fn from(word: ColumnWord) -> Self {
        match word {
            ColumnWord::Name(name) => Self::Name(name.trim().to_owned()),
            ColumnWord::Number(number) => Self::Index(usize::from(number.saturating_sub(1))),
        }
    }
}

impl FileMapping {
    /// All columns that the file must have.
    pub(crate) fn columns(&self) -> impl Iterator<Item = &Column> {
        let gyro = self.gyro.as_ref();
        let ticks = gyro.map(|gyro| &gyro.ticks).into_iter().chain(&self.accel);
        let sensors = ticks.clone().flat_map(|ticks| ticks.sensors.iter().map(|sensor| &sensor.column));
        let numbering =
            ticks.flat_map(|ticks| ticks.sequence.iter().chain(ticks.duration.as_ref().map(|d| &d.column)));
        let modes =
            gyro.into_iter().flat_map(|gyro| gyro.mode.iter().chain(&gyro.meander).map(|mode| &mode.column));
        let switch = gyro.and_then(|gyro| match &gyro.switch {
            Some(SwitchMapping::Column(column)) => Some(column),
            _ => None,
        });
        let halves = gyro
            .into_iter()
            .flat_map(|gyro| gyro.half_periods.iter().flat_map(|half| [&half.positive, &half.negative]));
        let stamps = self.time.stamps.as_ref().map(|stamps| &stamps.column);
        let temperatures = self.temperatures.iter().map(|temperature| &temperature.column);
        let status = self.status.iter().map(|status| &status.column);
        stamps
            .into_iter()
            .chain(sensors)
            .chain(numbering)
            .chain(modes)
            .chain(switch)
            .chain(halves)
            .chain(temperatures)
            .chain(status)
    }
}
