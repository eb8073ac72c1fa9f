//! Sensors that nothing can be made of.

use super::pose::Pose;
use super::track::Track;
use crate::drift::figures::six;

/// Share of readings that may be no number.
const NOT_FINITE_SHARE: f64 = 0.01;

/// Sensors that read the same in every tick, the same as another one, or too often nothing: what is wrong and what to do. Those with
/// one fault are named together.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "ticks of a run")]
pub fn dead(track: &Track) -> Vec<String> {
    let mut faults: Vec<(&str, Vec<usize>, String)> = Vec::new();
    let mut add = |kind: &'static str, sensor: usize, fault: String| match faults
        .iter_mut()
        .find(|(of, _, known)| *of == kind && *known == fault)
    {
        Some((_, sensors, _)) => sensors.push(sensor),
        None => faults.push((kind, vec![sensor], fault)),
    };
    for (kind, columns) in [("accelerometer", &track.outputs), ("gyro", &track.gyros)] {
        for (index, column) in columns.iter().enumerate() {
            let missing = column.iter().filter(|value| !value.is_finite()).count();
            if same(column) && missing == 0 {
                add(
                    kind,
                    index,
                    format!(
                        "one value in every tick, {}: dead, or the wrong column; look at the mapping, or replace the sensor",
                        six(column.first().copied().unwrap_or(f64::NAN))
                    ),
                );
            } else if let Some(twin) =
                columns[..index].iter().position(|other| missing == 0 && equal(other, column))
            {
                let fault = format!(
                    "the same in every tick as {kind} {}: does the mapping have a column twice?",
                    name(twin)
                );
                add(kind, index, fault);
            }
            if missing as f64 > NOT_FINITE_SHARE * column.len() as f64 {
                add(
                    kind,
                    index,
                    format!(
                        "{missing} of {} readings are no numbers, at most {} % may be: look at the recording, or cut it with --start \
                         and --duration",
                        column.len(),
                        NOT_FINITE_SHARE * 100.0
                    ),
                );
            }
        }
    }
    let words = |(kind, sensors, fault): (&str, Vec<usize>, String)| {
        format!("{}: {}: {fault}", track.run, several(kind, &sensors))
    };
    faults.into_iter().map(words).collect()
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

/// A number with so many decimals, without the sign of a zero.
#[must_use]
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let digits = text.strip_prefix('-').filter(|digits| digits.chars().all(|c| c == '0' || c == '.'));
    digits.map_or_else(|| text.clone(), str::to_owned)
}

/// So many of something: "1 pose", "2 poses".
#[must_use]
pub fn counted(count: usize, one: &str) -> String {
    if count == 1 { format!("1 {one}") } else { format!("{count} {one}s") }
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
        let [dead, none, twice] = &dead(&track)[..] else { panic!("{:?}", dead(&track)) };
        assert!(dead.starts_with("log: accelerometers x, y and z: one value in every tick, 0: "), "{dead}");
        assert!(none.starts_with("log: gyro y: 200 of 200 readings are no numbers"), "{none}");
        assert!(twice.starts_with("log: gyro z: the same in every tick as gyro x"), "{twice}");
    }

    #[test]
    fn numbers_are_written_as_people_do() {
        assert_eq!([fixed(-0.001, 2), fixed(-0.016, 2), fixed(1.0, 1)], ["0.00", "-0.02", "1.0"]);
        assert_eq!(
            [counted(1, "pose"), counted(0, "pose"), counted(12, "pose")],
            ["1 pose", "0 poses", "12 poses"]
        );
    }
}
