//! Column mapping: which column of a text log is what, in which unit.
//!
//! A mapping is a small TOML file, described in full by `docs/replay.md` and by the ready ones in
//! `config/mappings`. Parsing reports every problem at once, each with file, line, column, key and value.

mod check;
mod keys;
mod layout;
#[cfg(test)]
mod tests;
mod time;

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use isotherm_correction::sample::{ChannelName, OutputKind};
pub use isotherm_document::Problem;
use isotherm_document::{Form, Reader};
use keys::Output;
pub use keys::{AccelUnit, GyroUnit, SensorUnit, TemperatureUnit};
pub use layout::{DecimalMark, Delimiter, Encoding, Layout, OnBadRow};
use schemars::JsonSchema;
use serde::Deserialize;
use time::TimeKeys;
pub use time::{DurationRule, Marks, TimeColumn, TimeMapping, TimeUnit};

use crate::error::Error;
use crate::file::read_small_text;

/// Version of the mapping format that this program reads.
pub const VERSION: u32 = 1;

static FORM: LazyLock<Form> = LazyLock::new(|| Form::of::<Mapping>().versions("version", [VERSION; 2]));

/// How one log, of one or more files, is read.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Isotherm column mapping")]
pub struct Mapping {
    /// Version of the mapping's form.
    #[schemars(range(min = 1))]
    pub version: u32,
    /// Free text for readers.
    pub description: Option<String>,
    /// Its files, at least one; together they have exactly one gyro stream.
    #[serde(rename = "file")]
    #[schemars(length(min = 1, max = 16))]
    pub files: Vec<FileMapping>,
}

/// How one file of a log is read.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct FileMapping {
    /// Its name inside the log's folder, where the log is a folder.
    pub name: Option<String>,
    /// How bytes become rows and cells.
    #[serde(flatten)]
    pub layout: Layout,
    /// Where the time of a row comes from.
    #[schemars(with = "TimeKeys")]
    pub time: TimeMapping,
    /// The gyros, where the file has them.
    pub gyro: Option<GyroMapping>,
    /// The accelerometers, where the file has them.
    pub accel: Option<TickMapping<AccelUnit>>,
    /// Temperature channels; may be empty.
    #[serde(rename = "temperature", default)]
    pub temperatures: Vec<TemperatureMapping>,
    /// What says of each row whether it holds, where the file has that.
    pub status: Option<StatusMapping>,
    /// Which rows are of the unit, in a file with several.
    pub select: Option<SelectMapping>,
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
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct SensorMapping<U: SensorUnit> {
    /// Which column.
    pub column: Option<Column>,
    /// In place of a column: what a sensor reads that the log does not have.
    pub constant: Option<f64>,
    /// Its unit.
    #[serde(default)]
    pub unit: U,
    /// Direction of the sensor: 1 or −1.
    #[serde(default = "SensorMapping::<U>::along")]
    #[schemars(range(min = -1, max = 1), extend("not" = { "const": 0 }), extend("x-must-be" = "1 or -1"))]
    pub sign: i8,
    /// Units per unit of the column.
    #[serde(default = "SensorMapping::<U>::whole")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: f64,
    /// Raw reading that stands for zero.
    #[serde(default)]
    pub mid_scale: f64,
}

/// Sensors of one kind.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct TickMapping<U: SensorUnit> {
    /// What the readings stand for.
    #[serde(with = "Output")]
    #[schemars(with = "Output")]
    pub output: OutputKind,
    /// One to eight sensors, in the order of the calibration document.
    #[schemars(length(min = 1, max = 8))]
    pub sensors: Vec<SensorMapping<U>>,
    /// Column of sequence numbers; without one, rows are counted.
    #[serde(rename = "sequence_column")]
    pub sequence: Option<Column>,
    /// Column of durations; overrides the file's rule.
    pub duration_column: Option<Column>,
    /// Its unit.
    pub duration_unit: Option<TimeUnit>,
    /// A row whose cells of these sensors are all empty has no tick of them.
    #[serde(default)]
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

/// Rows of one unit among those of several: others are passed over as if they were not there.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct SelectMapping {
    /// Which column.
    pub column: Column,
    /// What it holds in the unit's rows.
    pub value: String,
}

/// Where mode-switch commands come from: either of them.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct SwitchMapping {
    /// A column: 1 in the tick at whose start the switch was commanded, else 0.
    pub column: Option<Column>,
    /// The first tick of the other mode.
    pub from: Option<SwitchFrom>,
}

/// What a switch is known by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum SwitchFrom {
    /// A tick whose mode differs from the last one's.
    ModeChange,
}

/// The gyros of a file.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct GyroMapping {
    /// Sensors and their ticks.
    #[serde(flatten)]
    pub ticks: TickMapping<GyroUnit>,
    /// Lasing mode.
    pub mode: Option<ModeMapping>,
    /// Switch commands.
    pub switch: Option<SwitchMapping>,
    /// Phase of the slow meander.
    pub meander: Option<ModeMapping>,
    /// Half-period counts, positive and negative, one pair per sensor, or none.
    #[serde(default)]
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

impl<U: SensorUnit> SensorMapping<U> {
    fn along() -> i8 {
        1
    }

    fn whole() -> f64 {
        1.0
    }

    /// To counts, rad/s, or m/s² (V or raw for a calibration that takes these).
    #[must_use]
    pub fn conversion(&self) -> Conversion {
        let (unit, per_tick) = self.unit.in_si().unwrap_or((1.0, false));
        Conversion { mid_scale: self.mid_scale, factor: f64::from(self.sign) * self.scale * unit, per_tick }
    }
}

impl<U: SensorUnit> TickMapping<U> {
    /// Column of durations; overrides the file's rule.
    #[must_use]
    pub fn duration(&self) -> Option<TimeColumn> {
        let (column, unit) = self.duration_column.clone().zip(self.duration_unit)?;
        Some(TimeColumn { column, unit, date: None })
    }

    fn columns_mut(&mut self) -> impl Iterator<Item = &mut Column> {
        let sensors = self.sensors.iter_mut().filter_map(|sensor| sensor.column.as_mut());
        sensors.chain(&mut self.sequence).chain(&mut self.duration_column)
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
        let mut reader = Reader::new(text, Some(file));
        let mapping = reader.read(&FORM);
        if let Some(mapping) = &mapping {
            check::check(&mut reader, mapping);
        }
        reader.finish(mapping)
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
    pub(crate) fn columns_mut(&mut self) -> impl Iterator<Item = &mut Column> {
        let Self { time, gyro, accel, temperatures, status, select, .. } = self;
        let stamps = time.stamps.iter_mut();
        let stamps = stamps.flat_map(|stamps| std::iter::once(&mut stamps.column).chain(&mut stamps.date));
        let gyro = gyro.iter_mut().flat_map(|GyroMapping { ticks, mode, switch, meander, half_periods }| {
            let modes = mode.iter_mut().chain(meander).map(|mode| &mut mode.column);
            let switch = switch.iter_mut().filter_map(|switch| switch.column.as_mut());
            let halves = half_periods.iter_mut().flat_map(|half| [&mut half.positive, &mut half.negative]);
            ticks.columns_mut().chain(modes).chain(switch).chain(halves)
        });
        let accel = accel.iter_mut().flat_map(TickMapping::columns_mut);
        let temperatures = temperatures.iter_mut().map(|temperature| &mut temperature.column);
        let status = status.iter_mut().map(|status| &mut status.column);
        let select = select.iter_mut().map(|select| &mut select.column);
        stamps.chain(gyro).chain(accel).chain(temperatures).chain(status).chain(select)
    }
}
