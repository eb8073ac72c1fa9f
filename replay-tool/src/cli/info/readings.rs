//! Figures of readings.

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
    show::grid(["as sent", "unit", "readings", "minimum", "maximum", "mean", "missing"], rows, 2..)
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
