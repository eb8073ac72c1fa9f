//! Times of a producer's clock as people read them.

use std::ops::Range;

use isotherm_correction::units;
use jiff::Timestamp;

/// From 1990 to 2100 (s since 1970): an earlier or later time is the count of a clock that began anywhere.
const DATES_S: Range<i64> = 631_152_000..4_102_444_800;

/// A time since 1970 (ns) as date and time of day in UTC, to the second; as seconds where it can be no date.
#[must_use]
pub fn date(ns: i64) -> String {
    let seconds = ns.div_euclid(1_000_000_000);
    match Timestamp::from_second(seconds) {
        Ok(time) if DATES_S.contains(&seconds) => time.to_string().replace('T', " ").replace('Z', " UTC"),
        _ => {
            let (sign, size) = (if ns < 0 { "-" } else { "" }, ns.unsigned_abs() / 1_000_000);
            format!("{sign}{}.{:03} s on its own clock", size / 1000, size % 1000)
        }
    }
}

/// Nanoseconds in seconds, with their sign.
pub(crate) fn seconds(ns: i64) -> f64 {
    units::Timestamp::from_ns(ns).seconds_from(units::Timestamp::from_ns(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_began_anywhere_has_no_dates() {
        assert_eq!(date(1_763_905_807_900_000_000), "2025-11-23 13:50:07 UTC");
        assert_eq!(date(5_000_000), "0.005 s on its own clock");
        assert_eq!(date(-1_020_000_000), "-1.020 s on its own clock");
        assert_eq!(date(i64::MAX), "9223372036.854 s on its own clock");
    }
}
