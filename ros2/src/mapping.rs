//! Which topics of ROS 2 are which unit: a small TOML file, of which `config/ros2.toml` has every key.

mod keys;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::sync::LazyLock;

use isotherm_correction::sample::{ChannelName, OutputKind};
use isotherm_correction::units::Span;
use isotherm_document::{Form, Problem, Reader, element, join};
use isotherm_log::mapping::{
    AccelUnit, Conversion, GyroUnit, Marks, SensorUnit, TemperatureUnit, TimeMapping,
};
use isotherm_protocol::key::UnitId;

use crate::Error;
use crate::qos::Qos;
use keys::{DurationRule, Keys, TemperatureKeys, TimeKeys, UnitKeys};

/// Version of the mapping's form that this program reads.
pub const VERSION: u32 = 1;

static FORM: LazyLock<Form> = LazyLock::new(|| Form::of::<Keys>().versions("version", [VERSION; 2]));

/// Which topics are which unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Mapping {
    /// Name of the bridge's node.
    pub node: String,
    /// Its namespace: `/`, or a name with a leading slash.
    pub namespace: String,
    /// Topic of the diagnostics.
    pub diagnostics: String,
    /// Units, at least one.
    pub units: Vec<UnitMapping>,
}

/// One unit.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitMapping {
    /// Its serial.
    pub unit: UnitId,
    /// Topic of the raw `sensor_msgs/Imu`.
    pub raw: String,
    /// Topic of the corrected ones.
    pub corrected: String,
    /// Frame of the corrected messages; `None`: that of the raw ones.
    pub frame_id: Option<String>,
    /// What stamps mean.
    pub time: TimeMapping,
    /// Nominal duration of a tick, as in `time`.
    pub tick: Span,
    /// Standard deviation of a stamp (s), as the mapping states it.
    pub stamp_uncertainty_s: Option<f64>,
    /// What the angular velocities are.
    pub gyro: SensorsMapping,
    /// What the linear accelerations are; `None` where they are no readings of the unit.
    pub accel: Option<SensorsMapping>,
    /// Temperature topics.
    pub temperatures: Vec<TemperatureMapping>,
    /// Quality of service of the corrected messages.
    pub output: Qos,
}

/// Readings of one kind in an Imu message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorsMapping {
    /// What they stand for.
    pub output: OutputKind,
    /// Their conversion.
    pub conversion: Conversion,
    /// White noise of the corrected output where the calibration document states none: rad/√s or (m/s)/√s.
    pub random_walk: Option<f64>,
}

/// One temperature channel.
#[derive(Debug, Clone, PartialEq)]
pub struct TemperatureMapping {
    /// Topic of the `sensor_msgs/Temperature`.
    pub topic: String,
    /// Name of the channel, as the calibration document spells it.
    pub channel: ChannelName,
    /// Its unit.
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
        let mapping = reader.read(&FORM).map(|keys| mapping(&mut reader, keys));
        // A serial or channel that is none has been reported.
        reader.finish(mapping.flatten())
    }
}

fn mapping(r: &mut Reader<'_>, keys: Keys) -> Option<Mapping> {
    let Keys { node, namespace, diagnostics, unit: stated, .. } = keys;
    // What each topic is used for: a second use would mix units, or make a loop.
    let mut used: Vec<(String, String)> = vec![(diagnostics.clone(), "diagnostics".to_owned())];
    let mut serials: Vec<String> = Vec::new();
    for (index, keys) in stated.iter().enumerate() {
        let at = element("unit", index);
        if serials.contains(&keys.serial) {
            r.report(
                &join(&at, "serial"),
                format!("is {:?}, which is the serial of an earlier unit", keys.serial),
            );
        }
        serials.push(keys.serial.clone());
        let own = [("raw", keys.raw.clone()), ("corrected", keys.corrected.clone())];
        let own = own.into_iter().map(|(key, topic)| (topic, join(&at, key)));
        let channels = join(&at, "temperature");
        let temperatures = keys.temperature.iter().enumerate();
        let temperatures =
            temperatures.map(|(i, keys)| (keys.topic.clone(), join(&element(&channels, i), "topic")));
        for (topic, path) in own.chain(temperatures) {
            if let Some((_, first)) = used.iter().find(|(other, _)| *other == topic) {
                r.report(&path, format!("is {topic:?}, already the topic of {first}: use another"));
            }
            used.push((topic, path));
        }
        for (i, TemperatureKeys { channel, .. }) in keys.temperature.iter().enumerate() {
            if keys.temperature.iter().take(i).any(|earlier| earlier.channel == *channel) {
                let why = format!("is {channel:?}, which is the channel of an earlier topic");
                r.report(&join(&element(&channels, i), "channel"), why);
            }
        }
    }
    let units = stated.into_iter().enumerate().map(|(index, keys)| unit(r, &element("unit", index), keys));
    let units = units.collect::<Vec<_>>().into_iter().collect::<Option<_>>()?;
    Some(Mapping { node, namespace, diagnostics, units })
}

fn unit(r: &mut Reader<'_>, path: &str, keys: UnitKeys) -> Option<UnitMapping> {
    let tick = Span::from_s(keys.time.tick_ms * 1e-3);
    let stamp_uncertainty_s = keys.time.uncertainty_us.map(|us| us * 1e-6);
    let time = time(r, &join(path, "time"), &keys.time, tick);
    let gyro = sensors(keys.gyro.unit, keys.gyro.angle_random_walk_deg_per_sqrt_h.map(per_sqrt_s_of_deg));
    let accel = keys.accel.map(|keys| {
        sensors(keys.unit, keys.velocity_random_walk_m_per_s_per_sqrt_h.map(|walk| walk / SQRT_HOUR))
    });
    let temperatures = keys.temperature.into_iter().map(|keys| {
        let channel = ChannelName::from(&keys.channel).ok()?;
        Some(TemperatureMapping { topic: keys.topic, channel, unit: keys.unit })
    });
    Some(UnitMapping {
        unit: UnitId::new(&keys.serial).ok()?,
        raw: keys.raw,
        corrected: keys.corrected,
        frame_id: keys.frame_id,
        time,
        tick,
        stamp_uncertainty_s,
        gyro,
        accel,
        temperatures: temperatures.collect::<Option<_>>()?,
        output: keys.output,
    })
}

/// √s in √h.
const SQRT_HOUR: f64 = 60.0;

/// °/√h as rad/√s.
fn per_sqrt_s_of_deg(walk: f64) -> f64 {
    walk.to_radians() / SQRT_HOUR
}

fn time(r: &mut Reader<'_>, path: &str, keys: &TimeKeys, tick: Span) -> TimeMapping {
    let measured = keys.duration.map_or(keys.stamp == Marks::End, |rule| rule == DurationRule::Measured);
    if measured && keys.stamp == Marks::Start {
        let why = "is \"measured\", but with a stamp at the start of a tick its duration is known only with the next \
                   message: set duration = \"nominal\"";
        r.report(&join(path, "duration"), why);
    }
    // A stamp that is off by this much may fall beyond the limit of a gap: three standard deviations at either end.
    let margin_us = (keys.gap_after_ticks - 1.0) * keys.tick_ms * 1e3 / (3.0 * std::f64::consts::SQRT_2);
    if let Some(us) = keys.uncertainty_us.filter(|us| *us > margin_us) {
        let at = join(path, "uncertainty_us");
        r.report(&at, format!("is {us}, must be at most {margin_us:.0}, or jitter would count as a gap: raise gap_after_ticks"));
    }
    TimeMapping {
        stamps: None,
        marks: keys.stamp,
        tick: Some(tick),
        measured,
        gap_after_ticks: Some(keys.gap_after_ticks),
        origin_ns: 0,
    }
}

/// One rule for all three axes of a message.
fn sensors(unit: impl SensorUnit, random_walk: Option<f64>) -> SensorsMapping {
    let (output, factor, per_tick) = match unit.in_si() {
        None => (OutputKind::Counts, 1.0, false),
        Some((factor, per_tick)) => (OutputKind::Mean, factor, per_tick),
    };
    SensorsMapping { output, conversion: Conversion { mid_scale: 0.0, factor, per_tick }, random_walk }
}

/// What REP 103 asks for.
fn rad_per_s() -> GyroUnit {
    GyroUnit::RadPerS
}

/// What REP 103 asks for.
fn m_per_s2() -> AccelUnit {
    AccelUnit::MPerS2
}
