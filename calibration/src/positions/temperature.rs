//! Temperatures of positions: which channels they come from, which of them are one level, what the board does at them.

use isotherm_protocol::document::Document;

use super::analysis::Settings;
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

/// The channel of each accelerometer.
pub(super) fn own_channels(document: &Document, sensors: usize) -> Vec<Option<String>> {
    let of = |sensor: usize| document.accel.as_ref()?.sensor.get(sensor)?.channel.clone();
    (0..sensors).map(of).collect()
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
