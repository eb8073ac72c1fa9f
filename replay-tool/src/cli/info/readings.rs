//! Figures of readings, and times as dates.

use comfy_table::{CellAlignment, Table, presets};
use isotherm_log::info::{ReadingInfo, UnitInfo};

/// Smallest, largest and mean of every sensor, temperature and health reading, as they were sent.
pub(super) fn readings(unit: &UnitInfo) -> String {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING);
    table.set_header(["as sent", "readings", "minimum", "maximum", "mean", "missing"]);
    let mut add = |name: String, info: &ReadingInfo| {
        let ReadingInfo { readings, missing, min, max, mean, .. } = info;
        let counts = [readings, missing].map(ToString::to_string);
        let [readings, missing] = counts;
        table.add_row([name, readings, figure(*min), figure(*max), figure(*mean), missing]);
    };
    for (what, sensors) in [("gyro", &unit.gyros), ("accelerometer", &unit.accelerometers)] {
        sensors.iter().zip(1..).for_each(|(info, number)| add(format!("{what} {number}"), info));
    }
    for (what, named) in [("temperature", &unit.temperatures), ("health", &unit.health)] {
        named.by_name.iter().for_each(|(name, info)| add(format!("{what} {name}"), info));
    }
    if table.row_count() == 0 {
        return String::new();
    }
    table.column_iter_mut().skip(1).for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    format!("{table}\n")
}

/// A number in seven digits, without an exponent where it needs none.
fn figure(number: f64) -> String {
    match number.abs() {
        0.0 => "0".to_owned(),
        1e-3..1e9 => {
            let shown = format!("{number:.7}");
            let (whole, fraction) = shown.split_once('.').unwrap_or((&shown, ""));
            let digits = whole.trim_start_matches(['-', '0']).len();
            let kept = fraction.get(..7_usize.saturating_sub(digits)).unwrap_or_default();
            let kept = kept.trim_end_matches('0');
            if kept.is_empty() { whole.to_owned() } else { format!("{whole}.{kept}") }
        }
        _ => format!("{number:.6e}"),
    }
}

/// A time since 1970 as date and time of day (UTC); one outside 1990 to 2100 is the count of a clock that began anywhere.
pub(super) fn date(ns: i128) -> String {
    let seconds = u64::try_from(ns / 1_000_000_000).unwrap_or(0);
    if !(631_152_000..4_102_444_800).contains(&seconds) {
        return format!("{ns} ns on its own clock");
    }
    let time = std::time::UNIX_EPOCH + std::time::Duration::from_secs(seconds);
    humantime::format_rfc3339_seconds(time).to_string().replace('T', " ").replace('Z', " UTC")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_seven_digits_and_times_are_dates() {
        for (number, expected) in [
            (0.0, "0"),
            (9.806_65, "9.80665"),
            (-0.012_345_678_9, "-0.0123457"),
            (123_456_789.0, "123456789"),
            (1.5e-9, "1.500000e-9"),
        ] {
            assert_eq!(figure(number), expected);
        }
        assert_eq!(date(1_763_905_807_000_000_000), "2025-11-23 13:50:07 UTC");
        assert_eq!(date(5_000_000), "5000000 ns on its own clock");
    }
}
