//! Times of a producer's clock as people read them.

use std::ops::Range;

use jiff::Timestamp;

/// From 1990 to 2100 (s since 1970): an earlier or later time is the count of a clock that began anywhere.
const DATES_S: Range<i64> = 631_152_000..4_102_444_800;

/// A time since 1970 (ns) as date and time of day in UTC, to the second; as its count where it can be no date.
#[must_use]
pub fn date(ns: i64) -> String {
    let seconds = ns.div_euclid(1_000_000_000);
    match Timestamp::from_second(seconds) {
        Ok(time) if DATES_S.contains(&seconds) => time.to_string().replace('T', " ").replace('Z', " UTC"),
        _ => format!("{ns} ns on its own clock"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_began_anywhere_has_no_dates() {
        assert_eq!(date(1_763_905_807_900_000_000), "2025-11-23 13:50:07 UTC");
        assert_eq!(date(5_000_000), "5000000 ns on its own clock");
        assert_eq!(date(-1), "-1 ns on its own clock");
        assert_eq!(date(i64::MAX), "9223372036854775807 ns on its own clock");
    }
}
