//! Sensors that nothing can be made of.

use super::pose::Pose;
use super::track::Track;
use crate::axes::{sensor_name, several};
use crate::report::{counted, six};
use crate::runs::faults::{self, Fault};

/// Takes another fault of the same kind in; false where it is another one.
fn takes(known: &mut Fault, other: Fault) -> bool {
    match (known, other) {
        (Fault::Dead(one), Fault::Dead(other)) => one.total_cmp(&other).is_eq(),
        (Fault::Twin(one), Fault::Twin(other)) => *one == other,
        (Fault::Missing(one), Fault::Missing(other)) => {
            if other[0] > one[0] {
                *one = other;
            }
            true
        }
        _ => false,
    }
}

/// Sensors of runs that read the same in every tick, the same as another one, or too often nothing: what is wrong and what to do.
/// Those with one fault are named together, and so are runs.
pub fn dead(tracks: &[Track]) -> Vec<String> {
    // Kind and number of sensors, the sensors, the runs, and what is wrong with them.
    type Found<'a> = ((&'a str, usize), Vec<usize>, Vec<&'a str>, Fault);
    let mut faults: Vec<Found<'_>> = Vec::new();
    for track in tracks {
        for (kind, columns) in [("accelerometer", &track.outputs), ("gyro", &track.gyros)] {
            let kind = (kind, columns.len());
            for index in 0..columns.len() {
                let Some(fault) = Fault::among(columns, index) else { continue };
                let known = faults.iter_mut().find_map(|(of, sensors, runs, known)| {
                    (*of == kind && takes(known, fault)).then_some((sensors, runs))
                });
                let Some((sensors, runs)) = known else {
                    faults.push((kind, vec![index], vec![&track.run], fault));
                    continue;
                };
                if !sensors.contains(&index) {
                    sensors.push(index);
                }
                if !runs.contains(&track.run.as_str()) {
                    runs.push(&track.run);
                }
            }
        }
    }
    let words = |((kind, of), mut sensors, runs, fault): ((&str, usize), Vec<usize>, Vec<&str>, Fault)| {
        sensors.sort_unstable();
        format!("{}: {}: {}", logs(&runs), several(kind, &sensors, of), fault.words(kind, of))
    };
    faults.into_iter().map(words).collect()
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
pub fn clipped(tracks: &[Track], poses: &[Pose]) -> Vec<String> {
    let sensors = tracks.iter().map(|track| track.outputs.len()).max().unwrap_or(0);
    let mut reasons = Vec::new();
    for sensor in 0..sensors {
        let constant = |pose: &&Pose| {
            let column = tracks.get(pose.run).and_then(|track| track.outputs.get(sensor));
            column
                .and_then(|column| column.get(pose.interval.first..pose.interval.end))
                .and_then(faults::dead)
                .is_some()
        };
        let value = |pose: &Pose| {
            let column = tracks.get(pose.run).and_then(|track| track.outputs.get(sensor));
            column.and_then(|column| column.get(pose.interval.first)).copied().unwrap_or(f64::NAN)
        };
        let at: Vec<&Pose> = poses.iter().filter(constant).collect();
        if let (Some(first), true) = (at.first(), at.len() < poses.len()) {
            reasons.push(format!(
                "accelerometer {} reads exactly {} throughout {} of {} poses: it is at its limit there: use a wider \
                 range, or leave these poses out",
                sensor_name(sensor, sensors),
                six(value(first)),
                at.len(),
                poses.len()
            ));
        }
    }
    reasons
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
