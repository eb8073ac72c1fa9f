//! Sensors that nothing can be made of.

use super::pose::Pose;
use super::track::Track;
use crate::drift::figures::{counted, six};

/// Share of readings that may be no number.
const NOT_FINITE_SHARE: f64 = 0.01;

/// What is wrong with a sensor, and what to do. Two are one fault whatever the numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    /// One value in every tick.
    Dead(f64),
    /// The same in every tick as another sensor, by number.
    Twin(usize),
    /// How many readings are no numbers, and of how many.
    Missing([usize; 2]),
}

impl Fault {
    fn of(columns: &[Vec<f64>], index: usize) -> Option<Self> {
        let column = columns.get(index)?;
        let missing = column.iter().filter(|value| !value.is_finite()).count();
        #[expect(clippy::cast_precision_loss, reason = "ticks of a run")]
        if missing as f64 > NOT_FINITE_SHARE * column.len() as f64 {
            return Some(Self::Missing([missing, column.len()]));
        }
        if same(column) {
            return column.first().copied().map(Self::Dead);
        }
        columns[..index].iter().position(|other| equal(other, column)).map(Self::Twin)
    }

    /// Takes another of the same kind in; false where it is another fault.
    fn takes(&mut self, other: Self) -> bool {
        match (self, other) {
            (Self::Dead(one), Self::Dead(other)) => one.total_cmp(&other).is_eq(),
            (Self::Twin(one), Self::Twin(other)) => *one == other,
            (Self::Missing(one), Self::Missing(other)) => {
                if other[0] > one[0] {
                    *one = other;
                }
                true
            }
            _ => false,
        }
    }

    fn words(self, kind: &str) -> String {
        match self {
            Self::Dead(value) => format!(
                "one value in every tick, {}: dead, or the wrong column; check the mapping, or replace the sensor",
                six(value)
            ),
            Self::Twin(twin) => {
                format!(
                    "the same in every tick as {kind} {}: does the mapping have a column twice?",
                    name(twin)
                )
            }
            Self::Missing([missing, all]) => format!(
                "{missing} of {all} readings are not numbers, at most {} % may be: check the recording, or cut it \
                 with --start and --duration",
                NOT_FINITE_SHARE * 100.0
            ),
        }
    }
}

/// Sensors of runs that read the same in every tick, the same as another one, or too often nothing: what is wrong and what to do.
/// Those with one fault are named together, and so are runs.
#[must_use]
pub fn dead(tracks: &[Track]) -> Vec<String> {
    let mut faults: Vec<(&str, Vec<usize>, Vec<&str>, Fault)> = Vec::new();
    for track in tracks {
        for (kind, columns) in [("accelerometer", &track.outputs), ("gyro", &track.gyros)] {
            for index in 0..columns.len() {
                let Some(fault) = Fault::of(columns, index) else { continue };
                let known = faults.iter_mut().find_map(|(of, sensors, runs, known)| {
                    (*of == kind && known.takes(fault)).then_some((sensors, runs))
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
    let words = |(kind, mut sensors, runs, fault): (&str, Vec<usize>, Vec<&str>, Fault)| {
        sensors.sort_unstable();
        format!("{}: {}: {}", logs(&runs), several(kind, &sensors), fault.words(kind))
    };
    faults.into_iter().map(words).collect()
}

/// Names of logs, of many only the first.
#[must_use]
pub fn logs(names: &[&str]) -> String {
    match names {
        [first, _, _, _, ..] => {
            format!("{first} and {}", counted(names.len() - 1, "other log", "other logs"))
        }
        few => few.join(", "),
    }
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
                "accelerometer {} reads exactly {} throughout {} of {} poses: it is at its limit there: use a wider \
                 range, or leave these poses out",
                name(sensor),
                six(value(first)),
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

/// Whether two columns are one.
fn equal(one: &[f64], other: &[f64]) -> bool {
    one.len() == other.len() && one.iter().zip(other).all(|(a, b)| a.total_cmp(b).is_eq())
}

/// Sensors of a kind by their numbers: "gyro x", "gyros x and z", "gyros x, y and z".
#[must_use]
pub fn several(kind: &str, sensors: &[usize]) -> String {
    let names: Vec<String> = sensors.iter().map(|sensor| name(*sensor)).collect();
    match names.as_slice() {
        [] => String::new(),
        [one] => format!("{kind} {one}"),
        [first @ .., last] => format!("{kind}s {} and {last}", first.join(", ")),
    }
}

/// Name of a sensor by its number: x, y, z, then numbers.
#[must_use]
pub fn name(index: usize) -> String {
    ["x", "y", "z"].get(index).map_or_else(|| index.to_string(), |name| (*name).to_owned())
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
        let [dead, none, twice] = &dead(&all)[..] else { panic!("{:?}", dead(&all)) };
        assert!(
            dead.starts_with("log, other: accelerometers x, y and z: one value in every tick, 0: "),
            "{dead}"
        );
        assert!(none.starts_with("log, other: gyro y: 200 of 200 readings are not numbers"), "{none}");
        assert!(twice.starts_with("log, other: gyro z: the same in every tick as gyro x"), "{twice}");
    }
}
