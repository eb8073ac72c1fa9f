//! Numbers and times as people read them.

use std::time::Duration;

use isotherm_correction::units::{AngularRate, STANDARD_GRAVITY_M_PER_S2};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::status::{ActiveCalibration, PreLaunchProgress};
use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};

/// Stands where a value is not known.
pub(super) const NONE: &str = "–";

/// A value in words, or that it is not known.
pub(super) fn or_none<T>(value: Option<T>, words: impl FnOnce(T) -> String) -> String {
    value.map_or_else(|| NONE.to_owned(), words)
}

/// Angular rate (rad/s) in °/h.
pub(crate) fn deg_per_h(rad_per_s: f64) -> f64 {
    AngularRate::from_rad_per_s(rad_per_s).as_deg_per_h()
}

/// Specific force (m/s²) in thousandths of standard gravity.
pub(super) fn milli_g(m_per_s2: f64) -> f64 {
    m_per_s2 / STANDARD_GRAVITY_M_PER_S2 * 1e3
}

/// Seconds in a day.
const DAY_S: u64 = 86_400;

/// A number of things in few characters: to 99 999 as it is, then three digits.
#[expect(clippy::cast_precision_loss, reason = "three digits of it are shown")]
pub(super) fn count(number: u64) -> String {
    if number < 100_000 {
        return number.to_string();
    }
    let mut value = number as f64 / 1e3;
    for unit in ["k", "M", "G", "T"] {
        if value < 999.5 {
            let decimals = if value < 9.995 { 2 } else { usize::from(value < 99.95) };
            return format!("{value:.decimals$}{unit}");
        }
        value /= 1e3;
    }
    format!("{value:.0}P")
}

/// "1 unit", "3 units".
pub(crate) fn of(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

/// About four digits, for what spans decades.
pub(super) fn digits(value: f64) -> String {
    let decimals = match value.abs() {
        size if size >= 999.5 => 0,
        size if size >= 99.95 => 1,
        size if size >= 9.995 => 2,
        _ => 3,
    };
    if value.is_finite() { format!("{value:.decimals$}") } else { NONE.to_owned() }
}

/// As [`digits`], with its sign.
pub(super) fn signed(value: f64) -> String {
    let text = digits(value);
    if value >= 0.0 && value.is_finite() { format!("+{text}") } else { text }
}

/// Temperature (°C).
pub(super) fn temperature(deg_c: Option<f64>) -> String {
    or_none(deg_c.filter(|value| value.is_finite()), |value| format!("{value:.1}"))
}

/// Rate of a temperature (°C/s), shown in °C/min.
pub(super) fn temperature_rate(deg_c_per_s: Option<f64>) -> String {
    let per_min = deg_c_per_s.map(|rate| rate * 60.0).filter(|rate| rate.is_finite());
    // Zero without the sign of what was rounded away.
    or_none(per_min, |rate| format!("{:+.2}", (rate * 100.0).round() / 100.0 + 0.0))
}

/// Frequency (1/s).
pub(super) fn frequency(per_s: f64) -> String {
    if !per_s.is_finite() {
        NONE.to_owned()
    } else if per_s == 0.0 || per_s >= 9.95 {
        format!("{per_s:.0}")
    } else {
        format!("{per_s:.1}")
    }
}

/// Latency (ns).
#[expect(clippy::cast_precision_loss, reason = "three digits of it are shown")]
pub(super) fn latency(ns: u64) -> String {
    let mut value = ns as f64;
    for unit in ["ns", "µs", "ms"] {
        if value < 999.5 {
            let decimals = if unit == "ns" || value >= 99.95 { 0 } else { 1 + usize::from(value < 9.995) };
            return format!("{value:.decimals$} {unit}");
        }
        value /= 1e3;
    }
    format!("{value:.1} s")
}

/// A time that has passed, in its largest unit: "12 s", "5 min", "3 h", "40 d".
pub(crate) fn since(time: Duration) -> String {
    match time.as_secs() {
        s if s < 120 => format!("{s} s"),
        s if s < 7200 => format!("{} min", s / 60),
        s if s < 2 * DAY_S => format!("{} h", s / 3600),
        s => format!("{} d", s / DAY_S),
    }
}

/// Share of a pre-launch calibration that is done (0…1), and the time that is left.
pub(super) fn progress(progress: &PreLaunchProgress) -> (f64, String) {
    let left = Duration::try_from_secs_f64((progress.duration_s - progress.elapsed_s).max(0.0));
    let share = (progress.elapsed_s / progress.duration_s).clamp(0.0, 1.0);
    (share, or_none(left.ok(), since))
}

/// As [`since`], of seconds that may be negative: what lies ahead is "in 3 h".
pub(super) fn since_s(seconds: i64) -> String {
    let words = since(Duration::from_secs(seconds.unsigned_abs()));
    if seconds < 0 { format!("in {words}") } else { words }
}

/// The age of a calibration in days, where its document states a date only: that is midnight, and hours would say too much.
pub(super) fn days(calibration: &ActiveCalibration) -> Option<u64> {
    let dated =
        calibration.created_unix_s.is_some_and(|created| created.unsigned_abs().is_multiple_of(DAY_S));
    let age_s = calibration.age_s.and_then(|age_s| u64::try_from(age_s).ok());
    age_s.filter(|_| dated).map(|age_s| age_s / DAY_S)
}

/// The age of a calibration, in few characters.
pub(super) fn age(calibration: &ActiveCalibration) -> Option<String> {
    days(calibration).map(|days| format!("{days} d")).or(calibration.age_s.map(since_s))
}

/// How long before `now` a time lies (both in ms since 1970-01-01 UTC); zero where it lies ahead.
pub(super) fn ago(unix_ms: i64, now_unix_ms: i64) -> Duration {
    Duration::from_millis(u64::try_from(now_unix_ms.saturating_sub(unix_ms)).unwrap_or(0))
}

/// A digest of which perhaps only the head is known.
pub(super) fn digest(digest: Option<Digest>, head: [u8; 8]) -> String {
    let mut bytes = [0; 32];
    bytes.iter_mut().zip(head).for_each(|(byte, of_head)| *byte = of_head);
    short(&digest.unwrap_or(Digest(bytes)))
}

/// The first twelve hexadecimal digits of a digest.
pub(crate) fn short(digest: &impl ToString) -> String {
    digest.to_string().chars().take(12).collect()
}

/// How many columns a text takes.
pub(super) fn width(text: &str) -> usize {
    text.width()
}

/// The text in at most `width` columns; where something is cut off, `…` stands for it.
#[must_use]
pub fn fit(text: &str, width: usize) -> String {
    if text.width() <= width {
        return text.to_owned();
    }
    let mut fitted = take(text.chars(), width.saturating_sub(1));
    if width > 0 {
        fitted.push('…');
    }
    fitted
}

/// As [`fit`], but cut in the middle: serials differ at their ends.
pub(super) fn fit_middle(text: &str, width: usize) -> String {
    if text.width() <= width {
        return text.to_owned();
    }
    let tail: String = take(text.chars().rev(), width.saturating_sub(1) / 2).chars().rev().collect();
    let head = take(text.chars(), width.saturating_sub(1 + tail.width()));
    if width == 0 { String::new() } else { format!("{head}…{tail}") }
}

/// As many characters as fit in `width` columns.
fn take(text: impl Iterator<Item = char>, width: usize) -> String {
    let mut taken = 0;
    text.take_while(|c| {
        taken += c.width().unwrap_or(0);
        taken <= width
    })
    .collect()
}

/// The text broken at blanks into lines of at most `width` columns; what has no blank is cut.
pub(super) fn wrap(text: &str, width: usize) -> Vec<String> {
    let width = width.max(8);
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let mut word = word;
        if let Some(last) = lines.last_mut()
            && last.width() + 1 + word.width() <= width
        {
            last.push(' ');
            last.push_str(word);
            continue;
        }
        while word.width() > width {
            let part = take(word.chars(), width);
            word = word.get(part.len()..).unwrap_or_default();
            lines.push(part);
        }
        lines.push(word.to_owned());
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_place() {
        let counts = [0, 99_999, 100_000, 999_499, 1_234_567, 12_345_678_901];
        assert_eq!(counts.map(count), ["0", "99999", "100k", "999k", "1.23M", "12.3G"]);
        assert_eq!(count(u64::MAX), "18447P");
        assert_eq!([1234.5, 123.45, 12.345, 0.01234].map(digits), ["1234", "123.5", "12.35", "0.012"]);
        assert_eq!([1.0, -1.0, f64::NAN].map(signed), ["+1.000", "-1.000", NONE]);
        assert_eq!([0.0, 0.4, 9.96, 2000.2].map(frequency), ["0", "0.4", "10", "2000"]);
        let latencies = [0, 999, 1_000, 12_345, 999_999, 1_240_000, 3_200_000_000];
        assert_eq!(
            latencies.map(latency),
            ["0 ns", "999 ns", "1.00 µs", "12.3 µs", "1.00 ms", "1.24 ms", "3.2 s"]
        );
        assert_eq!(temperature_rate(Some(-0.000_01)), "+0.00");
        assert_eq!(temperature(Some(f64::INFINITY)), NONE);
    }

    #[test]
    fn times_are_told_in_their_largest_unit() {
        let times = [0, 119, 120, 7200, 172_799, 172_800].map(|s| since(Duration::from_secs(s)));
        assert_eq!(times, ["0 s", "119 s", "2 min", "2 h", "47 h", "2 d"]);
        assert_eq!((since_s(-7200), ago(5_000, 3_000)), ("in 2 h".to_owned(), Duration::ZERO));
    }

    #[test]
    fn the_age_of_a_date_is_in_days() {
        let of = |created_unix_s, age_s| {
            age(&ActiveCalibration { created_unix_s, age_s: Some(age_s), ..ActiveCalibration::default() })
                .unwrap()
        };
        let (date, time) = (Some(1_795_219_200), Some(1_795_242_600));
        assert_eq!([54_000, 140_000, 4_757_400].map(|age_s| of(date, age_s)), ["0 d", "1 d", "55 d"]);
        assert_eq!((of(time, 54_000), of(date, -7200)), ("15 h".to_owned(), "in 2 h".to_owned()));
    }

    #[test]
    fn texts_fit_their_columns_whatever_they_hold() {
        for text in ["", "short", "ZLG-0001-of-the-north-hall", "水準器水準器水準器", "a\u{301}bc"] {
            for columns in 0..40 {
                assert!(fit(text, columns).width() <= columns, "{text} in {columns}");
                assert!(fit_middle(text, columns).width() <= columns, "{text} in {columns}");
            }
        }
        assert_eq!((fit("abcdef", 4), fit_middle("abcdef", 5)), ("abc…".to_owned(), "ab…ef".to_owned()));
        let text = "one two-three averyveryverylongword";
        assert_eq!(wrap(text, 9), ["one", "two-three", "averyvery", "verylongw", "ord"]);
    }
}
