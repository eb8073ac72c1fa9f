//! The mapping as types: key for key what stands in the file.

use isotherm_correction::sample::OutputKind;
use schemars::JsonSchema;
use serde::Deserialize;

use super::{
    Column, HalfPeriodMapping, Layout, Marks, ModeMapping, StatusMapping, TemperatureMapping, TimeUnit,
};

/// How a text log is read.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Isotherm column mapping")]
pub(super) struct MappingKeys {
    /// Version of the mapping's form.
    #[schemars(range(min = 1))]
    #[expect(dead_code, reason = "checked before anything else is read")]
    pub(super) version: u32,
    /// Free text for readers.
    #[expect(dead_code, reason = "for readers only")]
    pub(super) description: Option<String>,
    /// The files of the log; exactly one has gyros.
    #[schemars(length(min = 1, max = 16))]
    pub(super) file: Vec<FileKeys>,
}

/// One file.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct FileKeys {
    /// Its name inside the log's folder, where the log is a folder.
    pub(super) name: Option<String>,
    #[serde(flatten)]
    pub(super) layout: Layout,
    /// Where the time of a row comes from.
    pub(super) time: TimeKeys,
    /// The gyros.
    pub(super) gyro: Option<GyroKeys>,
    /// The accelerometers.
    pub(super) accel: Option<TickKeys<AccelUnit>>,
    /// Temperature channels.
    #[serde(default)]
    pub(super) temperature: Vec<TemperatureMapping>,
    /// What says of each row whether it holds.
    pub(super) status: Option<StatusMapping>,
}

/// Where the time of a row comes from.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct TimeKeys {
    /// Column of stamps.
    pub(super) column: Option<Column>,
    /// Unit of the stamps.
    pub(super) unit: Option<TimeUnit>,
    /// Which end of the tick a stamp marks.
    pub(super) marks: Option<Marks>,
    /// Where a tick's duration comes from: the difference of stamps, or the nominal tick.
    pub(super) duration: Option<DurationRule>,
    /// More than this many nominal ticks between two stamps are a gap.
    #[schemars(range(min = 1.25), extend("x-must-be" = "1.25 or more, or jitter would count as a gap"))]
    pub(super) gap_after_ticks: Option<f64>,
    /// Added to every stamp; without stamps, start of the first tick (ns).
    #[serde(default)]
    #[schemars(range(min = -2_305_843_009_213_693_952_i64, max = 2_305_843_009_213_693_951_i64))]
    pub(super) origin_ns: i64,
    /// Nominal tick (ns).
    #[schemars(range(min = 1.0, max = 3.6e12))]
    pub(super) tick_ns: Option<f64>,
    /// Nominal tick (µs).
    #[schemars(range(min = 1e-3, max = 3.6e9))]
    pub(super) tick_us: Option<f64>,
    /// Nominal tick (ms).
    #[schemars(range(min = 1e-6, max = 3.6e6))]
    pub(super) tick_ms: Option<f64>,
    /// Nominal tick (s).
    #[schemars(range(min = 1e-9, max = 3600.0))]
    pub(super) tick_s: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub(super) enum DurationRule {
    Measured,
    Nominal,
}

/// The sensors of one kind.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct TickKeys<U> {
    /// What the readings stand for.
    pub(super) output: Output,
    /// One to eight sensors, in the order of the calibration document.
    #[schemars(length(min = 1, max = 8))]
    pub(super) sensors: Vec<SensorKeys<U>>,
    /// Column of sequence numbers.
    pub(super) sequence_column: Option<Column>,
    /// Column of durations.
    pub(super) duration_column: Option<Column>,
    /// Its unit.
    pub(super) duration_unit: Option<TimeUnit>,
    /// A row whose cells of these sensors are all empty has no tick of them.
    #[serde(default)]
    pub(super) may_be_empty: bool,
}

/// The gyros of a file.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct GyroKeys {
    #[serde(flatten)]
    pub(super) ticks: TickKeys<GyroUnit>,
    /// Lasing mode.
    pub(super) mode: Option<ModeMapping>,
    /// Switch commands.
    pub(super) switch: Option<SwitchKeys>,
    /// Phase of the slow meander.
    pub(super) meander: Option<ModeMapping>,
    /// Half-period counts, one pair per gyro.
    #[serde(default)]
    pub(super) half_periods: Vec<HalfPeriodMapping>,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub(super) enum Output {
    Counts,
    Mean,
}

impl From<Output> for OutputKind {
    fn from(output: Output) -> Self {
        match output {
            Output::Counts => Self::Counts,
            Output::Mean => Self::Mean,
        }
    }
}

/// One sensor's column.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct SensorKeys<U> {
    /// Which column.
    pub(super) column: Column,
    /// Its unit.
    pub(super) unit: Option<U>,
    /// Direction of the sensor: 1 or −1.
    #[schemars(range(min = -1, max = 1), extend("not" = { "const": 0 }), extend("x-must-be" = "1 or -1"))]
    pub(super) sign: Option<i8>,
    /// Units per unit of the column.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(super) scale: Option<f64>,
    /// Raw reading that stands for zero.
    pub(super) mid_scale: Option<f64>,
}

/// Unit of a gyro's readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum GyroUnit {
    /// Counts of the tick.
    Counts,
    /// rad/s.
    RadPerS,
    /// °/s.
    DegPerS,
    /// °/h.
    DegPerH,
    /// rad, over the tick.
    Rad,
    /// °, over the tick.
    Deg,
    /// ″, over the tick.
    Arcsec,
    /// Whatever the calibration document takes.
    Raw,
    /// The same, over the tick.
    RawPerTick,
}

/// Unit of an accelerometer's readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[schemars(inline)]
pub enum AccelUnit {
    /// Counts of the tick.
    #[serde(rename = "counts")]
    Counts,
    /// m/s².
    #[serde(rename = "m_per_s2")]
    MPerS2,
    /// Standard gravity.
    #[serde(rename = "g")]
    G,
    /// Thousandth of standard gravity.
    #[serde(rename = "mg")]
    Mg,
    /// m/s, over the tick.
    #[serde(rename = "m_per_s")]
    MPerS,
    /// V.
    #[serde(rename = "volt")]
    Volt,
    /// Whatever the calibration document takes.
    #[serde(rename = "raw")]
    Raw,
    /// The same, over the tick.
    #[serde(rename = "raw_per_tick")]
    RawPerTick,
}

/// Where mode-switch commands come from.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct SwitchKeys {
    /// A column: 1 in the tick at whose start the switch was commanded, else 0.
    pub(super) column: Option<Column>,
    /// The first tick of the other mode.
    pub(super) from: Option<SwitchFrom>,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub(super) enum SwitchFrom {
    ModeChange,
}

/// Unit of a temperature channel's readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum TemperatureUnit {
    /// °C.
    DegC,
    /// K.
    Kelvin,
    /// V.
    Volt,
    /// Whatever the calibration document takes.
    Raw,
}

impl TemperatureUnit {
    /// What is added to a reading; −0 changes none.
    #[must_use]
    pub fn shift(self) -> f64 {
        if self == Self::Kelvin { -273.15 } else { -0.0 }
    }
}
