//! Sensors that nothing can be made of.

use super::pose::Pose;
use super::track::Track;
use crate::axes::{each, sensor_name};
use crate::numbers::grouped;
use crate::report::{counted, six};
use crate::runs::faults::{self, Fault};

/// Sensors of runs that read the same in every tick, the same as another one, or too often nothing: what is wrong and what to do.
/// Those with one fault are named together, and so are runs.
pub fn dead(tracks: &[Track]) -> Vec<String> {
    let mut told: Vec<(&str, String)> = Vec::new();
    for track in tracks {
        for (kind, columns) in [("accelerometer", &track.outputs), ("gyro", &track.gyros)] {
            let count = columns.len();
            let fault = |index| Some((index, Fault::among(columns, index)?.words(kind, count)));
            let faults = each(kind, (0..count).filter_map(fault), count);
            told.extend(faults.into_iter().map(|words| (track.run.as_str(), words)));
        }
    }
    grouped(told).into_iter().map(|(words, runs)| format!("{}: {words}", logs(&runs))).collect()
}

/// Names of logs, of many only the first.
pub fn logs(names: &[&str]) -> String {
    match names {
        [first, _, _, _, ..] => {
            format!("{first} and {}", counted(names.len() - 1, "other log", "other logs"))
        }
        few => few.join(", "),
    }
}

/// Accelerometers that read exactly the same throughout some poses and not in others: they are at their limit there.
pub fn clipped(tracks: &[Track], poses: &[&Pose]) -> Vec<String> {
    let sensors = tracks.iter().map(|track| track.outputs.len()).max().unwrap_or(0);
    let of = |sensor: usize| {
        let constant = |pose: &&Pose| {
            let column = tracks.get(pose.run)?.outputs.get(sensor)?;
            faults::dead(column.get(pose.ticks.clone())?)
        };
        let at: Vec<f64> = poses.iter().filter_map(constant).collect();
        let first = at.first().filter(|_| at.len() < poses.len())?;
        Some(format!(
            "accelerometer {} reads exactly {} throughout {} of {} poses: it is at its limit there: use a wider \
             range, or leave these poses out",
            sensor_name(sensor, sensors),
            six(*first),
            at.len(),
            poses.len()
        ))
    };
    (0..sensors).filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_with_one_fault_are_named_together() {
        let wave = |k: i32| libm::sin(f64::from(k));
        let good: Vec<f64> = (0..200).map(wave).collect();
        let track = Track {
            run: "log".to_owned(),
            outputs: vec![vec![0.0; 200]; 3],
            gyros: vec![good.clone(), vec![f64::NAN; 200], good],
            ..Track::default()
        };
        let all = [track.clone(), Track { run: "other".to_owned(), ..track }];
        assert_eq!(logs(&["a", "b", "c", "d"]), "a and 3 other logs");
        insta::assert_snapshot!(dead(&all).join("\n"));
    }
}
