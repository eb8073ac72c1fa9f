//! What is physically odd about fits that are good: axes, signs and scale factors far from what the document at hand states.

use isotherm_protocol::document::Document;

use super::Tumble;
use crate::axes::{AXES, several};
use crate::document::scale_at;
use crate::fits::positions::measure;
use crate::fits::positions::sense::{Beside, elsewhere, of_accelerometers, out_of_place, places};
use crate::report::short;

/// Words where gyros lie elsewhere than stated: `Err` where the accelerometers show a mirror image of the case by the fewest mistakes.
///
/// Columns of accelerometers that are swapped, or one with a wrong sign, make a mirror image of the case: |f| is g all the same, and a
/// rotation, which has no mirror image, is seen by the gyros the other way round. A document of that would turn the wrong way round.
fn gyros(sensors: &[Beside]) -> Result<Option<String>, String> {
    let Some(words) = elsewhere("gyro", sensors) else { return Ok(None) };
    let Some((order, same_way)) = places(sensors) else { return Ok(Some(words)) };
    let moved = out_of_place(order);
    let right: Vec<usize> = (0..3).filter(|axis| same_way[*axis]).collect();
    match (moved.len(), right.as_slice()) {
        (0, [_]) => Err(format!(
            "the accelerometers show a mirror image of the case: is the sign of {} missing in the mapping? {words}",
            several("accelerometer", &right, 3)
        )),
        (2, []) => Err(format!(
            "{} look swapped: check the columns in the mapping: they show a mirror image of the case. {words}",
            several("accelerometer", &moved, 3)
        )),
        (0, []) => Ok(Some(format!(
            "{words}. Or are two columns swapped in gyros and accelerometers alike? Then the document is a mirror image of the case"
        ))),
        _ => Ok(Some(words)),
    }
}

/// What is physically odd about fits that are good: axes and scale factors far from what the document at hand states.
///
/// # Errors
/// Where the accelerometers show a mirror image of the case.
pub(in crate::fits::tumble) fn odd(
    base: &Document,
    tumble: &Tumble,
    temperature: &dyn Fn(Option<&String>) -> f64,
) -> Result<Vec<String>, Vec<String>> {
    let mut words = Vec::new();
    if let Some(accel) = &base.accel {
        let stated = accel.sensor.iter().map(|sensor| scale_at(sensor, temperature(sensor.channel.as_ref())));
        let stated: Vec<f64> = stated.collect();
        let (elsewhere, measure) =
            of_accelerometers(accel, [&tumble.accel.scale, &stated], &tumble.accel.rows);
        words.extend(elsewhere.into_iter().chain(measure));
    }
    let Ok(gyro) = &tumble.gyro else { return Ok(words) };
    let stated: Vec<f64> =
        base.gyro.sensor.iter().map(|sensor| sensor.increment_weight_rad_per_rad.unwrap_or(1.0)).collect();
    let found = gyro.weight.iter().zip(&gyro.rows);
    let beside = found
        .zip(stated.iter().zip(&base.gyro.orientation.rows))
        .map(|((weight, row), (old, axis))| Beside::new([*weight, *old], [*row, *axis]));
    words.extend(gyros(&beside.collect::<Vec<_>>()).map_err(|mirrored| vec![mirrored])?);
    words.extend(measure::gyros(&gyro.weight, &stated));
    words.extend(far_from_zero(tumble));
    Ok(words)
}

/// Words where gyros read more at rest than any turn takes them away from that: a converter whose zero is at mid-scale.
fn far_from_zero(tumble: &Tumble) -> Option<String> {
    let gyro = tumble.gyro.as_ref().ok()?;
    let far = |index: &usize| gyro.rest[*index].abs() > tumble.largest_rate[*index];
    let far: Vec<usize> = (0..AXES.len()).filter(far).collect();
    let first = *far.first()?;
    Some(format!(
        "{}: at rest {} reads {} °/s, and no turn takes it further than {} °/s away from that: is its zero at mid-scale? State \
         mid_scale in the mapping",
        several("gyro", &far, AXES.len()),
        if far.len() > 1 { "the first" } else { "it" },
        short(gyro.rest[first].to_degrees()),
        short(tumble.largest_rate[first].to_degrees())
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gyros whose positive outputs point along these axes, all of them stated along their own.
    fn said(senses: [[f64; 3]; 3]) -> Result<String, String> {
        let own = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let sensors: Vec<Beside> =
            senses.into_iter().zip(own).map(|(sense, own)| Beside::new([1.31, 1.0], [sense, own])).collect();
        gyros(&sensors).map(Option::unwrap_or_default)
    }

    #[test]
    fn the_columns_that_are_wrong_are_named() {
        let [x, y, z] = [[1.0, 0.02, 0.0], [0.0, 1.0, -0.001], [0.0, 0.0, 1.0]];
        let back = |v: [f64; 3]| v.map(|c: f64| -c);
        assert_eq!(said([x, y, z]), Ok(String::new()));
        let odd = [
            [y, x, z],
            [z, y, x],
            [back(x), y, z],
            [back(x), back(y), back(z)],
            [y, z, x],
            [y, back(x), z],
            [[0.6, 0.8, 0.0], y, z],
        ];
        insta::assert_snapshot!(odd.map(|senses| said(senses).unwrap()).join("\n"));
    }

    #[test]
    fn a_mirror_image_of_the_case_is_refused() {
        let [x, y, z] = [[1.0, 0.02, 0.0], [0.0, 1.0, -0.001], [0.0, 0.0, 1.0]];
        let back = |v: [f64; 3]| v.map(|c: f64| -c);
        // The turns are seen the other way round.
        let mirrored = [[back(y), back(x), back(z)], [back(x), y, back(z)]];
        insta::assert_snapshot!(mirrored.map(|senses| said(senses).unwrap_err()).join("\n"));
    }
}
