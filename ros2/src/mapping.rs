//! Which topics of ROS 2 are which unit: a small TOML file, of which `config/ros2.toml` has every key.

#[cfg(test)]
mod tests;

use std::path::Path;
use std::sync::LazyLock;

use isotherm_correction::sample::ChannelName;
use isotherm_correction::units::Span;
use isotherm_document::{Form, Problem, Reader, element, join};
use isotherm_log::mapping::{AccelUnit, DurationRule, GyroUnit, Marks, TemperatureUnit, TimeMapping};
use isotherm_protocol::key::UnitId;
use schemars::JsonSchema;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

use crate::Error;
use crate::name::{MUST_BE, PATTERN};
use crate::qos::Qos;

/// Version of the mapping's form that this program reads.
pub const VERSION: u32 = 1;

static FORM: LazyLock<Form> = LazyLock::new(|| Form::of::<Mapping>().versions("version", [VERSION; 2]));

/// Which topics are which unit.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Isotherm ROS 2 mapping")]
pub struct Mapping {
    /// Version of the mapping's form.
    #[schemars(range(min = 1))]
    pub version: u32,
    /// Name of the bridge's node.
    #[serde(default = "node")]
    #[schemars(
        regex(pattern = r"^_?[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*$"),
        extend("x-must-be" = "letters, digits and single underscores, not beginning with a digit")
    )]
    pub node: String,
    /// Its namespace: `/`, or a name with a leading slash.
    #[serde(default = "root")]
    #[schemars(
        regex(pattern = r"^(/|(/_?[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*_?)+)$"),
        extend("x-must-be" = "/, or a name with its leading slash, such as /vehicle")
    )]
    pub namespace: String,
    /// Topic of the diagnostics.
    #[serde(default = "diagnostics")]
    #[schemars(regex(pattern = PATTERN), extend("x-must-be" = MUST_BE))]
    pub diagnostics: String,
    /// Units, at least one.
    #[serde(rename = "unit")]
    #[schemars(length(min = 1, max = 64))]
    pub units: Vec<UnitMapping>,
}

fn node() -> String {
    "isotherm".to_owned()
}

fn root() -> String {
    "/".to_owned()
}

fn diagnostics() -> String {
    "/diagnostics".to_owned()
}

/// One unit.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct UnitMapping {
    /// Its serial, as the calibration document has it.
    #[serde(rename = "serial", deserialize_with = "serial")]
    #[schemars(
        with = "String",
        regex(pattern = "^[A-Za-z0-9._-]{1,64}$"),
        extend("x-must-be" = "1 to 64 letters A-Z a-z, digits, '.', '_' or '-'")
    )]
    pub unit: UnitId,
    /// Topic of the raw `sensor_msgs/Imu`.
    #[schemars(regex(pattern = PATTERN), extend("x-must-be" = MUST_BE))]
    pub raw: String,
    /// Topic of the corrected ones.
    #[schemars(regex(pattern = PATTERN), extend("x-must-be" = MUST_BE))]
    pub corrected: String,
    /// Frame of the corrected messages; `None`: that of the raw ones.
    #[schemars(length(min = 1, max = 255))]
    pub frame_id: Option<String>,
    /// What stamps mean.
    pub time: StampMapping,
    /// What the angular velocities are.
    #[serde(default)]
    pub gyro: GyroMapping,
    /// What the linear accelerations are; `None` where they are no readings of the unit.
    pub accel: Option<AccelMapping>,
    /// Temperature topics.
    #[serde(rename = "temperature", default)]
    #[schemars(length(max = 16))]
    pub temperatures: Vec<TemperatureMapping>,
    /// Quality of service of the corrected messages.
    #[serde(default)]
    pub output: Qos,
}

/// A serial; in the place of one that has been refused, any.
fn serial<'de, D: Deserializer<'de>>(deserializer: D) -> Result<UnitId, D::Error> {
    let serial = String::deserialize(deserializer)?;
    let serial = if serial.is_empty() { "refused" } else { &serial };
    UnitId::new(serial).map_err(D::Error::custom)
}

/// What stamps mean.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct StampMapping {
    /// Nominal duration of a tick.
    #[schemars(range(min = 0.01, max = 9500.0))]
    tick_ms: f64,
    /// Which end of its tick a stamp marks.
    #[serde(default)]
    pub stamp: Marks,
    /// Where a tick's duration comes from.
    duration: Option<DurationRule>,
    /// More than this many nominal ticks between two stamps are a gap.
    #[serde(default = "one_and_a_half")]
    #[schemars(range(min = 1.25, max = 1e6), extend("x-must-be" = "1.25 to 1000000, or jitter would count as a gap"))]
    gap_after_ticks: f64,
    /// Standard deviation of a stamp.
    #[schemars(range(min = 0.0, max = 1e6))]
    uncertainty_us: Option<f64>,
}

fn one_and_a_half() -> f64 {
    1.5
}

impl StampMapping {
    /// Nominal duration of a tick.
    #[must_use]
    pub fn tick(&self) -> Span {
        Span::from_s(self.tick_ms * 1e-3)
    }

    /// Standard deviation of a stamp (s), as the mapping states it.
    #[must_use]
    pub fn uncertainty_s(&self) -> Option<f64> {
        self.uncertainty_us.map(|us| us * 1e-6)
    }

    fn is_measured(&self) -> bool {
        self.duration.map_or(self.stamp == Marks::End, |rule| rule == DurationRule::Measured)
    }

    /// How ticks get their times.
    #[must_use]
    pub fn to_time(&self) -> TimeMapping {
        TimeMapping {
            stamps: None,
            marks: self.stamp,
            tick: Some(self.tick()),
            measured: self.is_measured(),
            gap_after_ticks: Some(self.gap_after_ticks),
            origin_ns: 0,
        }
    }
}

/// What the angular velocities of an Imu message are.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct GyroMapping {
    /// Their unit.
    pub unit: GyroUnit,
    /// White noise of the corrected rate, where the calibration document states none.
    #[schemars(range(min = 1e-8, max = 3000.0))]
    pub angle_random_walk_deg_per_sqrt_h: Option<f64>,
}

/// What REP 103 asks for.
impl Default for GyroMapping {
    fn default() -> Self {
        Self { unit: GyroUnit::RadPerS, angle_random_walk_deg_per_sqrt_h: None }
    }
}

/// What the linear accelerations of an Imu message are.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct AccelMapping {
    /// Their unit.
    pub unit: AccelUnit,
    /// White noise of the corrected specific force.
    #[schemars(range(min = 1e-8, max = 3000.0))]
    pub velocity_random_walk_m_per_s_per_sqrt_h: Option<f64>,
}

/// What REP 103 asks for.
impl Default for AccelMapping {
    fn default() -> Self {
        Self { unit: AccelUnit::MPerS2, velocity_random_walk_m_per_s_per_sqrt_h: None }
    }
}

/// √s in √h.
const SQRT_HOUR: f64 = 60.0;

impl GyroMapping {
    /// White noise of the corrected rate (rad/√s), where the mapping states it.
    #[must_use]
    pub fn random_walk(&self) -> Option<f64> {
        self.angle_random_walk_deg_per_sqrt_h.map(|walk| walk.to_radians() / SQRT_HOUR)
    }
}

impl AccelMapping {
    /// White noise of the corrected specific force ((m/s)/√s), likewise.
    #[must_use]
    pub fn random_walk(&self) -> Option<f64> {
        self.velocity_random_walk_m_per_s_per_sqrt_h.map(|walk| walk / SQRT_HOUR)
    }
}

/// One temperature channel.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct TemperatureMapping {
    /// Topic of the `sensor_msgs/Temperature`.
    #[schemars(regex(pattern = PATTERN), extend("x-must-be" = MUST_BE))]
    pub topic: String,
    /// Name of the channel, as the calibration document spells it.
    #[schemars(
        with = "String",
        length(min = 1, max = 24),
        regex(pattern = r"\S"),
        extend("x-must-be" = "a name of 1 to 24 bytes")
    )]
    pub channel: ChannelName,
    /// Unit of its readings.
    #[serde(default)]
    pub unit: TemperatureUnit,
}

impl Mapping {
    /// Reads a mapping from a file.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be read, [`Error::Mapping`] with all its problems.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let text = isotherm_log::file::read_small_text(path, "read the mapping")?;
        Self::parse(&text, &path.display().to_string()).map_err(Error::Mapping)
    }

    /// Reads a mapping from text; `file` is for messages.
    ///
    /// # Errors
    /// Every problem, in the order of the text.
    pub fn parse(text: &str, file: &str) -> Result<Self, Vec<Problem>> {
        let mut reader = Reader::new(text, Some(file));
        let mapping = reader.read(&FORM);
        if let Some(mapping) = &mapping {
            check(&mut reader, mapping);
        }
        reader.finish(mapping)
    }
}

/// What must hold between the keys.
fn check(r: &mut Reader<'_>, Mapping { diagnostics, units, .. }: &Mapping) {
    // What each topic is used for: a second use would mix units, or make a loop.
    let mut used: Vec<(&str, String)> = vec![(diagnostics.as_str(), "diagnostics".to_owned())];
    for (index, UnitMapping { unit, raw, corrected, time, temperatures, .. }) in units.iter().enumerate() {
        let at = element("unit", index);
        if units.iter().take(index).any(|earlier| earlier.unit == *unit) {
            let why = format!("is {:?}, which is the serial of an earlier unit", unit.as_str());
            r.report(&join(&at, "serial"), why);
        }
        let own = [("raw", raw.as_str()), ("corrected", corrected.as_str())];
        let own = own.into_iter().map(|(key, topic)| (topic, join(&at, key)));
        let channels = join(&at, "temperature");
        let of_channels = temperatures.iter().enumerate();
        let of_channels = of_channels.map(|(i, of)| (&*of.topic, join(&element(&channels, i), "topic")));
        for (topic, path) in own.chain(of_channels) {
            if let Some((_, first)) = used.iter().find(|(other, _)| *other == topic) {
                r.report(&path, format!("is {topic:?}, already the topic of {first}: use another"));
            }
            used.push((topic, path));
        }
        for (i, TemperatureMapping { channel, .. }) in temperatures.iter().enumerate() {
            if temperatures.iter().take(i).any(|earlier| earlier.channel == *channel) {
                let why = format!("is {channel:?}, which is the channel of an earlier topic");
                r.report(&join(&element(&channels, i), "channel"), why);
            }
        }
        check_time(r, &join(&at, "time"), time);
    }
}

fn check_time(r: &mut Reader<'_>, path: &str, time: &StampMapping) {
    if time.is_measured() && time.stamp == Marks::Start {
        let why = "is \"measured\", but with a stamp at the start of a tick its duration is known only with the next \
                   message: set duration = \"nominal\"";
        r.report(&join(path, "duration"), why);
    }
    // A stamp that is off by this much may fall beyond the limit of a gap: three standard deviations at either end.
    let margin_us = (time.gap_after_ticks - 1.0) * time.tick_ms * 1e3 / (3.0 * std::f64::consts::SQRT_2);
    if let Some(us) = time.uncertainty_us.filter(|us| *us > margin_us) {
        let at = join(path, "uncertainty_us");
        r.report(&at, format!("is {us}, must be at most {margin_us:.0}, or jitter would count as a gap: raise gap_after_ticks"));
    }
}
