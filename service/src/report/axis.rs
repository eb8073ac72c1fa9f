//! Ranges and tick marks of an axis, and how its numbers are written.

/// Room left at each end of an axis that fits its data, as a share of the data's range.
const MARGIN: f64 = 0.06;

/// Range of an axis that shows all values; `None` where none of them is finite.
pub(super) fn fitted(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let [low, high] = extent(values)?;
    let room = if high > low { MARGIN * (high - low) } else { low.abs().max(1.0) * 0.5 };
    Some([low - room, high + room])
}

/// Smallest and largest finite value.
pub(super) fn extent(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    values.filter(|value| value.is_finite()).fold(None, |range, value| match range {
        Some([low, high]) => Some([value.min(low), value.max(high)]),
        None => Some([value, value]),
    })
}

/// Tick marks of an axis, evenly spaced at 1, 2 or 5 times a power of ten.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ticks {
    pub(super) values: Vec<f64>,
    decimals: usize,
}

impl Ticks {
    /// At most `most` (at least 2) ticks within the range.
    pub(super) fn new([low, high]: [f64; 2], most: u32) -> Self {
        let span = high - low;
        if !(span.is_finite() && span > 0.0) {
            return Self { values: vec![low], decimals: 0 };
        }
        let coarse = span / f64::from(most.max(2));
        let mut exponent = coarse.log10().floor();
        let power = 10_f64.powf(exponent);
        let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= coarse * (1.0 - 1e-9));
        let step = factor.unwrap_or(10.0) * power;
        if factor.is_none() {
            exponent += 1.0;
        }
        let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
        let mut values = Vec::new();
        let mut index = first;
        while index <= last {
            values.push(index * step);
            index += 1.0;
        }
        Self { values, decimals: decimals(exponent) }
    }

    /// The number as it stands beside the tick: with a real minus sign, and no more decimals than the step needs.
    pub(super) fn label(&self, value: f64) -> String {
        let digits = format!("{:.*}", self.decimals, value.abs());
        let is_zero = digits.bytes().all(|byte| byte == b'0' || byte == b'.');
        let sign = if value < 0.0 && !is_zero { "−" } else { "" };
        format!("{sign}{}", grouped(&digits))
    }
}

/// Decimals that a step of this power of ten needs; more than eight would not fit beside an axis.
fn decimals(exponent: f64) -> usize {
    (0..8).find(|&decimals| f64::from(decimals) >= -exponent).unwrap_or(8).try_into().unwrap_or(0)
}

/// Thousands set apart by a narrow space, from five digits on.
fn grouped(digits: &str) -> String {
    let (whole, rest) = digits.split_once('.').map_or((digits, None), |(whole, rest)| (whole, Some(rest)));
    let mut text = String::new();
    for (index, digit) in whole.chars().enumerate() {
        if whole.len() > 4 && index > 0 && (whole.len() - index).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    if let Some(rest) = rest {
        text.push('.');
        text.push_str(rest);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within_the_range() {
        let cases: &[([f64; 2], u32, &[&str])] = &[
            ([0.0, 10.0], 5, &["0", "2", "4", "6", "8", "10"]),
            ([-1.3, 1.1], 5, &["−1.0", "−0.5", "0.0", "0.5", "1.0"]),
            ([0.0, 0.0007], 4, &["0.0000", "0.0002", "0.0004", "0.0006"]),
            ([-30_000.0, 12_000.0], 4, &["−20\u{202f}000", "0"]),
            ([3.0, 3.0], 4, &["3"]),
        ];
        for (range, most, labels) in cases {
            let ticks = Ticks::new(*range, *most);
            let got: Vec<_> = ticks.values.iter().map(|&value| ticks.label(value)).collect();
            assert_eq!(got, *labels, "{range:?}");
        }
    }

    #[test]
    fn a_range_leaves_room_and_survives_equal_and_broken_values() {
        assert_eq!(fitted([0.0, f64::NAN, 100.0].into_iter()), Some([-6.0, 106.0]));
        assert_eq!(fitted([4.0].into_iter()), Some([2.0, 6.0]));
        assert_eq!(fitted([f64::INFINITY].into_iter()), None);
    }
}
