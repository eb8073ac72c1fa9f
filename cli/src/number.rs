//! Numbers of a command line, each within its limits.

use std::ops::RangeInclusive;
use std::time::Duration;

use isotherm_correction::units::Span;

/// For `value_parser`: reads a number; `of` says of what, where that is to be said (" of degrees").
pub fn number(of: &'static str, range: RangeInclusive<f64>) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| format!("must be a number{of} from {} to {}", range.start(), range.end()))
    }
}

/// For `value_parser`: reads a time in seconds, none of them negative.
pub fn duration(range: RangeInclusive<f64>) -> impl Fn(&str) -> Result<Duration, String> + Clone {
    let number = number(" of seconds", range);
    move |text| number(text).map(Duration::from_secs_f64)
}

/// Reads seconds of a log.
///
/// # Errors
/// In words, for what is no number from 0 to 10⁹.
pub fn seconds(text: &str) -> Result<Span, String> {
    number(" of seconds", 0.0..=1e9)(text).map(Span::from_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_numbers_within_the_limits_are_taken() {
        assert_eq!(duration(0.1..=60.0)("0.25"), Ok(Duration::from_millis(250)));
        for text in ["", "0.09", "61", "nan", "inf", "-1", "1 s"] {
            assert_eq!(duration(0.1..=60.0)(text).unwrap_err(), "must be a number of seconds from 0.1 to 60");
        }
        assert_eq!(seconds("1000000000.1").unwrap_err(), "must be a number of seconds from 0 to 1000000000");
    }
}
