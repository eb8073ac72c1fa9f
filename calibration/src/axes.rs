//! Case axes, and what sensors are called.

use crate::numbers::grouped;

/// Names of the case axes.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// The name of a sensor that has none of its own: x, y, z for three of a kind, numbers from 1 for others.
pub fn sensor_name(index: usize, of: usize) -> String {
    match AXES.get(index).filter(|_| of == AXES.len()) {
        Some(axis) => (*axis).to_owned(),
        None => (index + 1).to_string(),
    }
}

/// What the output along a case axis is called in reports: "gyro x", "accelerometer z".
pub fn output_name(gyro: bool, axis: usize) -> String {
    let kind = if gyro { "gyro" } else { "accelerometer" };
    format!("{kind} {}", AXES.get(axis).copied().unwrap_or_default())
}

/// Sensors of a kind by their names: "gyro x", "gyros x and z", "gyros x, y and z".
pub fn several(kind: &str, sensors: &[usize], of: usize) -> String {
    let names: Vec<String> = sensors.iter().map(|sensor| sensor_name(*sensor, of)).collect();
    match names.as_slice() {
        [] => String::new(),
        [one] => format!("{kind} {one}"),
        [first @ .., last] => format!("{kind}s {} and {last}", first.join(", ")),
    }
}

/// The case axis (0…2) that an input axis looks along more than along the others.
pub fn main_axis(row: &[f64; 3]) -> usize {
    (0..3).fold(0, |best, axis| if row[axis].abs() > row[best].abs() { axis } else { best })
}

/// What is said of sensors; those of which the same is said are named together.
pub fn each(kind: &str, told: impl IntoIterator<Item = (usize, String)>, of: usize) -> Vec<String> {
    let named = |(words, sensors): (String, Vec<usize>)| format!("{}: {words}", several(kind, &sensors, of));
    grouped(told).into_iter().map(named).collect()
}

/// The two axes beside one.
pub const fn others(axis: usize) -> [usize; 2] {
    match axis {
        0 => [1, 2],
        1 => [0, 2],
        _ => [0, 1],
    }
}

/// The two case axes that an axis is across.
pub fn across(row: &[f64; 3]) -> [usize; 2] {
    others(main_axis(row))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_sensors_are_called_by_their_axes_and_others_by_numbers_from_1() {
        assert_eq!([0, 2].map(|index| sensor_name(index, 3)), ["x", "z"]);
        assert_eq!([0, 3].map(|index| sensor_name(index, 6)), ["1", "4"]);
        assert_eq!(several("gyro", &[0, 1, 2], 3), "gyros x, y and z");
        assert_eq!(several("accelerometer", &[3], 6), "accelerometer 4");
        assert_eq!(main_axis(&[0.1, -0.9, 0.3]), 1);
    }
}
