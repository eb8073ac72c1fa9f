//! Temperatures of positions: which channels they come from, which of them are one level, what the board does at them.

use isotherm_protocol::document::Document;

use super::analysis::Settings;
use super::faults;
use super::pose::Pose;

/// Distance of temperatures that are two (°C).
pub const LEVEL_GAP_DEG_C: f64 = 5.0;

/// Channels that the orientation follows: as stated, as in the document, or those of the accelerometers.
pub(super) fn channels(document: &Document, settings: &Settings) -> Vec<String> {
    if !settings.channels.is_empty() {
        return settings.channels.clone();
    }
    let accel = document.accel.as_ref();
    if let Some(thermal) = accel.and_then(|accel| accel.orientation.thermal.as_ref()) {
        return thermal.channels.clone();
    }
    let mut own: Vec<String> = Vec::new();
    for channel in accel.iter().flat_map(|accel| &accel.sensor).filter_map(|sensor| sensor.channel.as_ref()) {
        if !own.contains(channel) {
            own.push(channel.clone());
        }
    }
    own
}

/// Temperatures that something was taken at (°C).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Temperatures {
    /// Their mean.
    pub mean: f64,
    /// Lowest and highest.
    pub range: [f64; 2],
}

impl Temperatures {
    /// Of some temperatures.
    #[expect(clippy::cast_precision_loss, reason = "positions")]
    pub(super) fn of(deg_c: &[f64]) -> Self {
        let ends = |[low, high]: [f64; 2], t: &f64| [low.min(*t), high.max(*t)];
        Self {
            mean: deg_c.iter().sum::<f64>() / deg_c.len() as f64,
            range: deg_c.iter().fold([f64::INFINITY, f64::NEG_INFINITY], ends),
        }
    }
}

/// The temperature of each accelerometer in each pose (°C), as the service has it: that of its own channel, that of the axes
/// (`axes`) where the channel has gaps, the assumed one without a channel or without any reading.
pub(super) fn own_deg_c(
    document: &Document,
    poses: &[(Pose, usize)],
    axes: &[f64],
    sensors: usize,
) -> Vec<Vec<f64>> {
    let of = |sensor: usize| -> Vec<f64> {
        let channel = document.accel.as_ref().and_then(|accel| accel.sensor.get(sensor)?.channel.as_ref());
        let in_pose = |pose: &Pose| channel.and_then(|name| pose.temperature_deg_c.get(name).copied());
        let reads = poses.iter().any(|(pose, _)| in_pose(pose).is_some());
        let without = |axes: f64| if reads { axes } else { document.temperature.assumed_deg_c };
        poses
            .iter()
            .zip(axes)
            .map(|((pose, _), axes)| in_pose(pose).unwrap_or_else(|| without(*axes)))
            .collect()
    };
    (0..sensors).map(of).collect()
}

/// Accelerometers whose own channel does not see that there are several temperatures, in words.
pub(super) fn blind(document: &Document, own: &[Vec<f64>], levels: usize) -> Vec<String> {
    let of = |(sensor, deg_c): (usize, &Vec<f64>)| {
        let [low, high] = Temperatures::of(deg_c).range;
        let known = document.accel.as_ref().and_then(|accel| accel.sensor.get(sensor));
        let name = known.map_or_else(|| faults::name(sensor), |sensor| sensor.name.clone());
        let channel = known
            .and_then(|sensor| sensor.channel.as_deref())
            .map_or("no channel".to_owned(), |channel| format!("channel {channel:?}"));
        (high - low <= LEVEL_GAP_DEG_C).then(|| {
            format!(
                "accelerometer {name}: it follows {channel}, which goes from {low:.1} to {high:.1} °C over {levels} temperatures of the \
                 axes, more than {LEVEL_GAP_DEG_C} °C are needed: name the channel that measures it in the document, or give the logs \
                 of one temperature"
            )
        })
    };
    if levels > 1 { own.iter().enumerate().filter_map(of).collect() } else { Vec::new() }
}

/// Mean temperature of the channels that the slopes of the document's C follow (°C); `None` without slopes or readings.
pub(super) fn slopes_deg_c(document: &Document, poses: &[Pose]) -> Option<f64> {
    let thermal = document.accel.as_ref()?.orientation.thermal.as_ref()?;
    let of: Vec<f64> = poses.iter().filter_map(|pose| pose.mean_temperature(&thermal.channels)).collect();
    (!of.is_empty()).then(|| Temperatures::of(&of).mean)
}

/// r of the board of an accelerometer in a pose, by the document.
pub(super) fn board_ratio(document: &Document, sensor: usize, pose: &Pose) -> f64 {
    let stated = || {
        let sensor = document.accel.as_ref()?.sensor.get(sensor)?;
        let t = pose.temperature_deg_c.get(sensor.board_channel.as_ref()?)?;
        sensor.board_ratio_error.as_ref()?.shape().at(*t)
    };
    1.0 + stated().unwrap_or(0.0) * 1e-6
}

/// Temperatures that are far enough apart to be several: the number of each one's level, and the levels' means.
#[expect(clippy::cast_precision_loss, reason = "positions")]
pub(super) fn levels(temperatures: &[f64]) -> (Vec<usize>, Vec<f64>) {
    let mut order: Vec<usize> = (0..temperatures.len()).collect();
    order.sort_by(|a, b| temperatures[*a].total_cmp(&temperatures[*b]));
    let mut level_of = vec![0; temperatures.len()];
    let mut groups: Vec<Vec<f64>> = Vec::new();
    let mut last = f64::NEG_INFINITY;
    for index in order {
        let t = temperatures[index];
        if t - last > LEVEL_GAP_DEG_C {
            groups.push(Vec::new());
        }
        last = t;
        level_of[index] = groups.len() - 1;
        if let Some(group) = groups.last_mut() {
            group.push(t);
        }
    }
    (level_of, groups.iter().map(|group| group.iter().sum::<f64>() / group.len() as f64).collect())
}

/// A reference in whole degrees: 20 °C where that is in the range, else its middle.
pub(super) fn reference(low: f64, high: f64) -> f64 {
    if low <= 20.0 && high >= 20.0 { 20.0 } else { (0.5 * (low + high)).round() }
}
