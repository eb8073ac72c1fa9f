//! Temperatures of positions: which channels they come from, which of them are one level, what the board does at them.

use std::collections::BTreeSet;

use isotherm_protocol::document::Document;

use super::fit::Settings;
use super::pose::Pose;
use crate::axes::{each, several};
use crate::document::{accelerometers, board_ratio_at};
use crate::numbers::{ends, mean, once_each};
use crate::report::fixed;

/// Distance of temperatures that are two (°C).
pub const LEVEL_GAP_DEG_C: f64 = 5.0;

/// Channels that the orientation follows: as stated, as in the document, or those of the accelerometers.
fn channels(document: &Document, settings: &Settings) -> Vec<String> {
    if !settings.channels.is_empty() {
        return settings.channels.clone();
    }
    let thermal = document.accel.as_ref().and_then(|accel| accel.orientation.thermal.as_ref());
    thermal.map_or_else(|| of_accelerometers(document), |thermal| thermal.channels.clone())
}

/// The accelerometers' own channels.
fn of_accelerometers(document: &Document) -> Vec<String> {
    once_each(accelerometers(document).iter().filter_map(|sensor| sensor.channel.clone()))
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
        let channel = accelerometers(document).get(sensor).and_then(|sensor| sensor.channel.as_ref());
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

/// Accelerometers whose own channel does not see that there are several temperatures, in words, those of one channel together.
pub(super) fn blind(document: &Document, own: &[Vec<f64>], levels: usize) -> Vec<String> {
    if levels < 2 {
        return Vec::new();
    }
    let narrow = own.iter().enumerate().filter_map(|(sensor, deg_c)| {
        let [low, high] = ends(deg_c.iter().copied()).map(|deg_c| fixed(deg_c, 1));
        let channel = accelerometers(document).get(sensor).and_then(|sensor| sensor.channel.as_ref());
        let channel = channel.map_or("no channel".to_owned(), |channel| format!("channel {channel:?}"));
        let words = format!(
            "K and S follow {channel}, which goes from {low} to {high} °C over {levels} temperatures of the axes, more than \
             {LEVEL_GAP_DEG_C} °C are needed: name its own channel in the document, or give the logs of one temperature"
        );
        (spread(deg_c) <= LEVEL_GAP_DEG_C).then_some((sensor, words))
    });
    each("accelerometer", narrow, own.len())
}

/// Words where the channels that C follows see one temperature, and those of the accelerometers several.
pub(super) fn stuck(channels: &[String], axes: &[f64], own: &[Vec<f64>]) -> Option<String> {
    let [low, high] = ends(axes.iter().copied());
    let wide = |sensor: &usize| spread(&own[*sensor]) > LEVEL_GAP_DEG_C;
    let sensors: Vec<usize> = (0..own.len()).filter(wide).collect();
    let [from, to] = ends(own[*sensors.first()?].iter().copied());
    (high - low <= LEVEL_GAP_DEG_C).then(|| {
        format!(
            "C follows {}, which goes from {} to {} °C only, but the channel of {} goes from {} to {} °C: is it \
             stuck, or of another unit? Name another channel with --channel",
            names(channels),
            fixed(low, 1),
            fixed(high, 1),
            several("accelerometer", &sensors, own.len()),
            fixed(from, 1),
            fixed(to, 1)
        )
    })
}

fn spread(deg_c: &[f64]) -> f64 {
    let [low, high] = ends(deg_c.iter().copied());
    high - low
}

/// Channels by their names.
fn names(channels: &[String]) -> String {
    let quoted: Vec<String> = channels.iter().map(|channel| format!("{channel:?}")).collect();
    format!("{} {}", if quoted.len() == 1 { "channel" } else { "the mean of channels" }, quoted.join(", "))
}

/// What the orientation follows: its channels, or else the accelerometers' own where those have no readings, and their mean temperature in
/// each pose (°C). No channels where nothing measures it.
///
/// # Errors
/// Channels of --channel that have none.
pub(super) fn followed(
    document: &Document,
    settings: &Settings,
    poses: &[(Pose, usize)],
    warnings: &mut Vec<String>,
) -> Result<(Vec<String>, Vec<f64>), Vec<String>> {
    let of = |channels: &[String]| -> Option<Vec<f64>> {
        poses.iter().map(|(pose, _)| pose.mean_temperature(channels)).collect()
    };
    let stated = channels(document, settings);
    if let Some(deg_c) = of(&stated) {
        return Ok((stated, deg_c));
    }
    let gone =
        |channel: &&String| poses.iter().any(|(pose, _)| !pose.temperature_deg_c.contains_key(*channel));
    let gone: Vec<String> = stated.iter().filter(gone).cloned().collect();
    if !settings.channels.is_empty() {
        return Err(vec![format!(
            "--channel: {} not in every position: name channels of the logs and the document",
            if gone.len() == 1 { format!("{} is", names(&gone)) } else { format!("{} are", names(&gone)) }
        )]);
    }
    let own = of_accelerometers(document);
    if let Some(deg_c) = of(&own) {
        warnings.push(format!(
            "C follows the accelerometers' own channels here: {} has no reading in some position; with several \
             temperatures the new document does the same",
            names(&gone)
        ));
        return Ok((own, deg_c));
    }
    let runs: BTreeSet<usize> = poses.iter().map(|(pose, _)| pose.run).collect();
    if gone.is_empty() && runs.len() > 1 {
        warnings.push(format!(
            "the document names no temperature channel for the accelerometers: all {} logs count as one temperature. \
             If they are not, name the channels in the document",
            runs.len()
        ));
    } else if !gone.is_empty() {
        warnings.push(format!(
            "{} has gaps or is not in the logs: all positions count as one temperature. Cut the logs to the part \
             with readings, or name others with --channel",
            names(&gone)
        ));
    }
    Ok((Vec::new(), vec![document.temperature.assumed_deg_c; poses.len()]))
}

/// Mean temperature of the channels that the slopes of the document's C follow (°C); `None` without slopes or readings.
pub(super) fn slopes_deg_c(document: &Document, poses: &[Pose]) -> Option<f64> {
    let thermal = document.accel.as_ref()?.orientation.thermal.as_ref()?;
    let of: Vec<f64> = poses.iter().filter_map(|pose| pose.mean_temperature(&thermal.channels)).collect();
    (!of.is_empty()).then(|| mean(&of))
}

/// r of the board of an accelerometer in a pose, by the document.
pub(super) fn board_ratio(document: &Document, sensor: usize, pose: &Pose) -> f64 {
    let stated = || {
        let sensor = accelerometers(document).get(sensor)?;
        let t = pose.temperature_deg_c.get(sensor.board_channel.as_ref()?)?;
        Some(board_ratio_at(sensor, *t))
    };
    stated().unwrap_or(1.0)
}

/// Temperatures that are far enough apart to be several: the number of each one's level, and the levels' means.
pub(crate) fn levels(temperatures: &[f64]) -> (Vec<usize>, Vec<f64>) {
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
    (level_of, groups.iter().map(|group| mean(group)).collect())
}

/// A reference in whole degrees: 20 °C where that is in the range, else its middle.
pub(crate) fn reference(low: f64, high: f64) -> f64 {
    if low <= 20.0 && high >= 20.0 { 20.0 } else { (0.5 * (low + high)).round() }
}
