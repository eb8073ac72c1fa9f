//! Units of time and rates that a log does not state with its columns.

/// Nanoseconds in the units of time; the first four may be told by the steps.
pub(super) const UNITS_NS: [(&str, f64); 6] =
    [("s", 1e9), ("ms", 1e6), ("us", 1e3), ("ns", 1.0), ("min", 6e10), ("h", 3.6e12)];
/// Ticks that are likely (ns).
const LIKELY_TICK_NS: std::ops::RangeInclusive<f64> = 1e6..=1e9;
/// Ticks that are possible (ns).
const POSSIBLE_TICK_NS: std::ops::RangeInclusive<f64> = 5e4..=6e10;

/// Rows per second, where the lines before the data say so: `// Update Rate: 100.0Hz`, `# Config: data_rate = 2000.0 Hz`.
pub(super) fn rate_in(lines: &[String]) -> Option<f64> {
    lines.iter().find_map(|line| {
        let line = line.to_lowercase();
        let (head, rest) = line.split_once("rate")?;
        let begins =
            head.ends_with(|c: char| !c.is_alphabetic()) || head.is_empty() || head.ends_with("output");
        let is_digit = |c: char| c.is_ascii_digit();
        let (before, rest) = rest.split_at(rest.find(is_digit)?);
        let end = rest.find(|c: char| !is_digit(c) && c != '.').unwrap_or(rest.len());
        let (number, behind) = rest.split_at(end);
        let kilo = before.contains("khz") || behind.trim_start().starts_with("khz");
        let rate = number.parse::<f64>().ok()? * if kilo { 1e3 } else { 1.0 };
        // "1,000 Hz" is one or a thousand.
        let is_clear = !behind.strip_prefix(',').is_some_and(|behind| behind.starts_with(is_digit));
        (begins && is_clear && line.contains("hz") && (1e-3..=1e6).contains(&rate)).then_some(rate)
    })
}

/// The unit of stamps by their usual step: the only one that gives the stated rate, a time of this century, or a likely tick.
pub(super) fn unit_of(step: f64, largest: f64, stated_hz: Option<f64>) -> Option<String> {
    let only = |fits: &dyn Fn(f64) -> bool| {
        let mut units = UNITS_NS.iter().take(4).filter(|(_, ns)| fits(*ns));
        match (units.next(), units.next()) {
            (Some((unit, _)), None) => Some((*unit).to_owned()),
            _ => None,
        }
    };
    let rate = stated_hz.and_then(|rate| only(&|ns| (step * ns * rate / 1e9 - 1.0).abs() < 0.1));
    // From 2001 to 2096.
    let century =
        || only(&|ns| (1e18..4e18).contains(&(largest * ns)) && POSSIBLE_TICK_NS.contains(&(step * ns)));
    let likely = || only(&|ns| LIKELY_TICK_NS.contains(&(step * ns)));
    rate.or_else(century).or_else(likely)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_time_and_rates_that_logs_state() {
        for (step, largest, rate, expected) in [
            (0.01, 60.0, None, Some("s")),
            (10.0, 60_000.0, None, Some("ms")),
            (5000.0, 6e7, None, Some("us")),
            (5e6, 1.4e18, None, Some("ns")),
            (1000.0, 1.7e15, None, Some("us")),
            (1000.0, 1e6, None, None),
            (1000.0, 1e6, Some(1000.0), Some("us")),
        ] {
            assert_eq!(unit_of(step, largest, rate).as_deref(), expected, "{step}");
        }
        for (line, expected) in [
            ("// Update Rate: 100.0Hz", Some(100.0)),
            ("# Config: data_rate = 2000.0 Hz, filter = 488 Hz", Some(2000.0)),
            ("Sample Rate (Hz),125", Some(125.0)),
            ("OutputRate:,60 Hz", Some(60.0)),
            ("# calibrated at 20 Hz", None),
            ("# data rate = 2 kHz", Some(2000.0)),
            ("Rate (kHz): 0.5", Some(500.0)),
            ("# Sample rate: 1,000 Hz", None),
        ] {
            assert_eq!(rate_in(&[line.to_owned()]), expected, "{line}");
        }
    }
}
