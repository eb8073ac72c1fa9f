//! Figures of readings.

use isotherm_correction::units::SpecificForce;
use isotherm_log::info::{ReadingInfo, UnitInfo};

use crate::cli::show;

/// Smallest, largest and mean of every sensor, temperature and health reading, as they were sent.
pub(super) fn readings(unit: &UnitInfo) -> String {
    let mut rows = Vec::new();
    let mut add = |name: String, info: &ReadingInfo| {
        let ReadingInfo { unit, readings, missing, min, max, mean, .. } = info;
        let counts = [readings, missing].map(ToString::to_string);
        let [readings, missing] = counts;
        rows.push([name, unit.clone(), readings, figure(*min), figure(*max), figure(*mean), missing]);
    };
    for (what, sensors) in [("gyro", &unit.gyros), ("accelerometer", &unit.accelerometers)] {
        sensors.iter().zip(1..).for_each(|(info, number)| add(format!("{what} {number}"), info));
    }
    for (what, named) in [("temperature", &unit.temperatures), ("health", &unit.health)] {
        named.by_name.iter().for_each(|(name, info)| add(format!("{what} {name}"), info));
    }
    if rows.is_empty() {
        return String::new();
    }
    let table =
        show::grid(["as sent", "unit", "readings", "minimum", "maximum", "mean", "missing"], rows, 2..);
    table + &wrong_unit(&unit.accelerometers).unwrap_or_default()
}

/// That three accelerometers in m/s² mean something else than the gravity in which instruments mostly rest.
fn wrong_unit(accelerometers: &[ReadingInfo]) -> Option<String> {
    let [x, y, z] = accelerometers else { return None };
    if [x, y, z].iter().any(|sensor| sensor.unit != "m/s²" || sensor.readings == 0) {
        return None;
    }
    let mean = (x.mean * x.mean + y.mean * y.mean + z.mean * z.mean).sqrt();
    let gravities = SpecificForce::from_m_per_s2(mean).as_g();
    (!(0.5..2.0).contains(&gravities)).then(|| {
        format!(
            "accelerometers: {mean:.2} m/s² in the mean is {gravities:.2} g: check their unit of measure\n"
        )
    })
}

/// A number in seven digits, without an exponent where it needs none.
fn figure(number: f64) -> String {
    match number.abs() {
        0.0 => "0".to_owned(),
        1e-3..1e9 => {
            let whole = format!("{:.0}", number.abs().trunc());
            let digits = whole.trim_start_matches('0').len();
            let shown = format!("{number:.*}", 7_usize.saturating_sub(digits));
            if shown.contains('.') {
                shown.trim_end_matches('0').trim_end_matches('.').to_owned()
            } else {
                shown
            }
        }
        _ => format!("{number:.6e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_that_is_not_gravity_has_another_unit() {
        let of = |unit: &str, z: f64| {
            let sensor =
                |mean| ReadingInfo { unit: unit.to_owned(), readings: 1, mean, ..ReadingInfo::default() };
            wrong_unit(&[0.1, -0.2, z].map(sensor))
        };
        for (unit, z, is_wrong) in
            [("m/s²", -9.81, false), ("m/s²", 93.3, true), ("m/s²", 1.0, true), ("V", 1.0, false)]
        {
            assert_eq!(of(unit, z).is_some(), is_wrong, "{z} {unit}");
        }
    }

    #[test]
    fn numbers_keep_seven_digits() {
        for (number, expected) in [
            (0.0, "0"),
            (9.806_65, "9.80665"),
            (std::f64::consts::PI, "3.141593"),
            (999.999_99, "1000"),
            (-120.0, "-120"),
            (-0.012_345_678_9, "-0.0123457"),
            (123_456_789.0, "123456789"),
            (1.5e-9, "1.500000e-9"),
        ] {
            assert_eq!(figure(number), expected);
        }
    }
}
