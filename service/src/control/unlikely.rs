//! What a document changes so much that hardly anybody means it: told whatever the limits of the configuration are.

use isotherm_correction::calibration::Steady;
use isotherm_protocol::document::turn_rad;

/// Largest turn of an input axis that is nothing special (°).
const LARGEST_TURN_DEG: f64 = 1.0;
/// Largest change of a scale that is nothing special, as a share of it.
const LARGEST_CHANGE: f64 = 0.1;

/// What of the scales and input axes of a unit differs so much before and after, in words; nothing of other sensors.
pub(super) fn unlikely([before, after]: &[Steady; 2]) -> Vec<String> {
    if before.jump(after).is_none() {
        return Vec::new();
    }
    let turns = |what, old: &[[f64; 3]], new: &[[f64; 3]]| {
        let angles = old.iter().zip(new).map(|(old, new)| turn_rad(*old, *new).to_degrees());
        let (numbers, largest) = beyond(angles, LARGEST_TURN_DEG)?;
        Some(format!(
            "turns the input axis of {what} {numbers} by {largest:.1}°: are sensors or axes swapped?"
        ))
    };
    let scales = |what, old: &[f64], new: &[f64]| {
        let changes = old.iter().zip(new).map(|(old, new)| (new / old - 1.0).abs());
        let (numbers, largest) = beyond(changes, LARGEST_CHANGE)?;
        Some(format!(
            "changes the scale of {what} {numbers} by {:.0} %: is the unit of measure right?",
            largest * 100.0
        ))
    };
    let all = [
        scales("gyro", &before.gyro_weight, &after.gyro_weight),
        scales("accelerometer", &before.accel_scale, &after.accel_scale),
        turns("gyro", &before.gyro_axes, &after.gyro_axes),
        turns("accelerometer", &before.accel_axes, &after.accel_axes),
    ];
    all.into_iter().flatten().collect()
}

/// Numbers from 1 of those beyond a limit, and the largest.
fn beyond(values: impl Iterator<Item = f64>, limit: f64) -> Option<(String, f64)> {
    let found: Vec<_> = values.zip(1..).filter(|(value, _)| *value > limit).collect();
    let largest = found.iter().map(|(value, _)| *value).reduce(f64::max)?;
    let numbers: Vec<_> = found.iter().map(|(_, number): &(f64, u32)| number.to_string()).collect();
    Some((numbers.join(", "), largest))
}

#[cfg(test)]
mod tests {
    use isotherm_correction::calibration::Calibration;
    use isotherm_protocol::document::Document;

    use super::*;

    #[test]
    fn swapped_axes_and_wrong_units_are_told_and_a_new_fit_is_not() {
        let text = include_str!("../../../config/calibration/MEMS-0001.toml");
        let of = |change: fn(&mut Document)| {
            let mut document = Document::parse(text, None).unwrap().document;
            change(&mut document);
            Calibration::new(&document.to_parts()).unwrap().steady(|_| None, None)
        };
        let told = |change: fn(&mut Document)| unlikely(&[of(|_| {}), of(change)]).join("\n");
        assert_eq!(told(|document| document.gyro.orientation.rows[0][1] += 1e-4), "");
        let swapped = told(|document| document.gyro.orientation.rows.swap(0, 1));
        let scaled = told(|document| {
            let sensor = &mut document.accel.as_mut().unwrap().sensor[2];
            sensor.scale_factor = sensor.scale_factor.plus(9.0);
        });
        insta::assert_snapshot!([swapped, scaled].join("\n"));
    }
}
