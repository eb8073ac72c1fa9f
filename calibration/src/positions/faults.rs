//! Sensors that nothing can be made of.

use super::pose::Pose;
use super::track::Track;

/// Share of readings that may be no number.
const NOT_FINITE_SHARE: f64 = 0.01;

/// Sensors that read the same in every tick, or too often nothing: what is wrong and what to do.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "ticks of a run")]
pub fn dead(track: &Track) -> Vec<String> {
    let mut reasons = Vec::new();
    for (kind, columns) in [("accelerometer", &track.outputs), ("gyro", &track.gyros)] {
        for (index, column) in columns.iter().enumerate() {
            let name = name(index);
            if same(column) {
                let value = column.first().copied().unwrap_or(f64::NAN);
                reasons.push(format!(
                    "{}: {kind} {name} reads {value} in every tick: it is dead or its column is the wrong one; look at the mapping, \
                     or replace the sensor",
                    track.run
                ));
            }
            let missing = column.iter().filter(|value| !value.is_finite()).count();
            if missing as f64 > NOT_FINITE_SHARE * column.len() as f64 {
                reasons.push(format!(
                    "{}: {kind} {name}: {missing} of {} readings are no numbers, at most {} % may be: look at the recording, or \
                     cut it with --start and --duration",
                    track.run,
                    column.len(),
                    NOT_FINITE_SHARE * 100.0
                ));
            }
        }
    }
    reasons
}

/// Accelerometers that read exactly the same throughout some poses and not in others: they are at their limit there.
#[must_use]
pub fn clipped(tracks: &[Track], poses: &[Pose]) -> Vec<String> {
    let sensors = tracks.iter().map(|track| track.outputs.len()).max().unwrap_or(0);
    let mut reasons = Vec::new();
    for sensor in 0..sensors {
        let constant = |pose: &&Pose| {
            let column = tracks.get(pose.run).and_then(|track| track.outputs.get(sensor));
            column.and_then(|column| column.get(pose.interval.first..pose.interval.end)).is_some_and(same)
        };
        let value = |pose: &Pose| {
            let column = tracks.get(pose.run).and_then(|track| track.outputs.get(sensor));
            column.and_then(|column| column.get(pose.interval.first)).copied().unwrap_or(f64::NAN)
        };
        let at: Vec<&Pose> = poses.iter().filter(constant).collect();
        if let (Some(first), true) = (at.first(), at.len() < poses.len()) {
            reasons.push(format!(
                "accelerometer {} reads exactly {} throughout {} of {} poses: it is at its limit there; use a wider range, or leave \
                 these poses out",
                name(sensor),
                value(first),
                at.len(),
                poses.len()
            ));
        }
    }
    reasons
}

/// Whether all values are one.
fn same(column: &[f64]) -> bool {
    column.first().is_some_and(|first| column.iter().all(|value| value.total_cmp(first).is_eq()))
}

/// Name of a sensor by its number: x, y, z, then numbers.
#[must_use]
pub fn name(index: usize) -> String {
    ["x", "y", "z"].get(index).map_or_else(|| index.to_string(), |name| (*name).to_owned())
}
