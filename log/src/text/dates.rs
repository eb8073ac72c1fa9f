//! Dates and times of day in cells.

use jiff::fmt::strtime::BrokenDownTime;
use jiff::fmt::temporal::DateTimeParser;
use jiff::tz::Offset;

use crate::mapping::TimeUnit;

/// A stamp that is a date and time, or a time of day, as ns since 1970 (UTC); a time of day as ns since midnight. `None` for another
/// text, and for units that are numbers.
pub(crate) fn stamp_ns(cell: &[u8], unit: TimeUnit) -> Option<i64> {
    match unit {
        TimeUnit::DateTime => iso_ns(cell),
        TimeUnit::DayFirst => ordered_ns(cell, "%d/%m"),
        TimeUnit::MonthFirst => ordered_ns(cell, "%m/%d"),
        TimeUnit::TimeOfDay => civil_ns(&format!("1/1/1970 {}", with_point(cell)?), "%d/%m/%Y"),
        _ => None,
    }
}

/// A day of times of day (ns).
pub(crate) const DAY_NS: i64 = 86_400_000_000_000;

/// Whether a time of day is of the day after that of another (ns): it is more than half a day before it.
pub(crate) fn is_next_day(before: i64, now: i64) -> bool {
    before.saturating_sub(now) > DAY_NS / 2
}

/// Whether a cell is a date of numbers without a time.
pub(crate) fn is_date(cell: &str) -> bool {
    numbers(cell).is_some()
}

/// Which of day and month is the first, where a date or a date and time says so: points stand between a day, a month and a year only,
/// and there are twelve months.
pub(crate) fn says_order(cell: &str) -> Option<TimeUnit> {
    let date = cell.split([' ', 'T']).next().unwrap_or_default();
    let [first, second, year] = numbers(date)?;
    match (first, second) {
        (first, _) if first > 31 || year > 9999 => None,
        (first, _) if date.contains('.') || first > 12 => Some(TimeUnit::DayFirst),
        (_, second) => (second > 12).then_some(TimeUnit::MonthFirst),
    }
}

/// The numbers of a date, three with the same mark between them.
fn numbers(date: &str) -> Option<[u32; 3]> {
    let mark = date.chars().find(|c| !c.is_ascii_digit()).filter(|c| matches!(c, '.' | '/' | '-'))?;
    let mut parts = date.split(mark).map(|part| part.parse().ok());
    let found = [parts.next()??, parts.next()??, parts.next()??];
    parts.next().is_none().then_some(found)
}

/// Date and time of ISO 8601, also with strokes in the date; UTC without an offset.
fn iso_ns(cell: &[u8]) -> Option<i64> {
    static PARSER: DateTimeParser = DateTimeParser::new();
    let strokes = cell.contains(&b'/').then(|| String::from_utf8_lossy(cell).replace('/', "-"));
    let cell = strokes.as_ref().map_or(cell, String::as_bytes);
    let time = PARSER.parse_timestamp(cell).ok().or_else(|| {
        let civil = PARSER.parse_datetime(cell).ok()?;
        Offset::UTC.to_timestamp(civil).ok()
    })?;
    i64::try_from(time.as_nanosecond()).ok()
}

/// Date and time whose day and month stand before the year, in this order.
fn ordered_ns(cell: &[u8], order: &str) -> Option<i64> {
    let text = with_point(cell)?;
    let (date, time) = text.split_once([' ', 'T'])?;
    numbers(date)?;
    let date = date.replace(['.', '-'], "/");
    let year = if date.rsplit('/').next()?.len() == 2 { "%y" } else { "%Y" };
    civil_ns(&format!("{date} {}", time.trim_start()), &format!("{order}/{year}"))
}

/// Date and time of day (24 hours, or 12 with AM or PM) by the form of the date.
fn civil_ns(text: &str, date: &str) -> Option<i64> {
    let twelve = text.ends_with(['m', 'M']);
    let time = if twelve { "%I:%M:%S%.f %p" } else { "%H:%M:%S%.f" };
    let civil = BrokenDownTime::parse(format!("{date} {time}"), text).ok()?.to_datetime().ok()?;
    i64::try_from(Offset::UTC.to_timestamp(civil).ok()?.as_nanosecond()).ok()
}

/// The text with a point before the fraction of a second.
fn with_point(cell: &[u8]) -> Option<String> {
    Some(std::str::from_utf8(cell).ok()?.trim().replace(',', "."))
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOON: i64 = 1_700_000_000_000_000_000;

    #[test]
    fn date_times_with_and_without_an_offset() {
        use TimeUnit::{DateTime, DayFirst, MonthFirst, Seconds, TimeOfDay};
        let table: &[(&str, TimeUnit, Option<i64>)] = &[
            ("2023-11-14T22:13:20Z", DateTime, Some(NOON)),
            ("2023-11-14 22:13:20", DateTime, Some(NOON)),
            ("2023/11/14 22:13:20", DateTime, Some(NOON)),
            ("2023-11-14T22:13:20,250", DateTime, Some(NOON + 250_000_000)),
            ("2023-11-14T23:13:20.000000001+01:00", DateTime, Some(NOON + 1)),
            ("2023-11-14T16:13:20-06", DateTime, Some(NOON)),
            ("1969-12-31T23:59:59.5Z", DateTime, Some(-500_000_000)),
            ("2023-02-29T00:00:00", DateTime, None),
            ("14.11.2023 22:13:20", DateTime, None),
            ("22:13:20", DateTime, None),
            ("1700000000", DateTime, None),
            ("14.11.2023 22:13:20", DayFirst, Some(NOON)),
            ("14.11.23 22:13:20,25", DayFirst, Some(NOON + 250_000_000)),
            ("14/11/2023  10:13:20.001 PM", DayFirst, Some(NOON + 1_000_000)),
            ("11-14-2023T22:13:20", MonthFirst, Some(NOON)),
            ("11/14/2023 10:13:20 pm", MonthFirst, Some(NOON)),
            ("1.5.2024 9:03:07", DayFirst, Some(1_714_554_187_000_000_000)),
            ("14.11/2023 22:13:20", DayFirst, None),
            ("14.13.2023 22:13:20", DayFirst, None),
            ("14.11.2023", DayFirst, None),
            ("00:00:01.5", TimeOfDay, Some(1_500_000_000)),
            ("1:00:00,5 PM", TimeOfDay, Some(46_800_500_000_000)),
            ("24:00:00", TimeOfDay, None),
            ("14.11.2023 22:13:20", Seconds, None),
        ];
        for (cell, unit, expected) in table {
            assert_eq!(stamp_ns(cell.as_bytes(), *unit), *expected, "{cell} as {unit:?}");
        }
    }

    #[test]
    fn a_date_says_which_of_day_and_month_is_first_or_does_not() {
        use TimeUnit::{DayFirst, MonthFirst};
        for (cell, expected) in [
            ("01.02.2023 10:00:00", Some(DayFirst)),
            ("13/02/2023", Some(DayFirst)),
            ("02/13/2023 10:00:00 AM", Some(MonthFirst)),
            ("02/12/2023", None),
            ("2023-11-14T10:00:00", None),
            ("10:00:00", None),
            ("12.5", None),
        ] {
            assert_eq!(says_order(cell), expected, "{cell}");
        }
        assert!(is_date("2023-11-14") && is_date("1.2.23") && !is_date("10:00:00") && !is_date("1.2"));
    }
}
