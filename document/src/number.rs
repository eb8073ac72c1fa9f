//! Numbers: what a value states, what a schema allows, and how both are said.

use isotherm_correction::stated::Shown;
use serde_json::Value as Json;
use toml::de::DeValue;

/// Largest magnitude of any number: far beyond any instrument, safe to multiply.
const HUGE: f64 = 1e100;

/// Digits that numbers are written with: no conversion of units shows in them, and no fit is as good.
const DIGITS: usize = 12;

/// A number as documents state it: without the dust of unit conversions, in twelve digits.
#[must_use]
pub fn tidy(value: f64) -> f64 {
    format!("{value:.*e}", DIGITS - 1).parse().unwrap_or(value)
}

/// What a schema allows of a number.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    low: f64,
    high: f64,
    above: Option<f64>,
    not_zero: bool,
}

impl Limits {
    pub(crate) fn of(node: &Json) -> Self {
        let bound = |key| node.get(key).and_then(Json::as_f64);
        Self {
            low: bound("minimum").unwrap_or(-HUGE),
            high: bound("maximum").unwrap_or(HUGE),
            above: bound("exclusiveMinimum"),
            not_zero: node.pointer("/not/const").is_some(),
        }
    }

    pub(crate) fn allow(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
            && self.above.is_none_or(|above| value > above)
            && !(self.not_zero && value.abs() <= 0.0)
    }

    /// A number that is allowed.
    pub(crate) fn stand_in(&self) -> f64 {
        if self.allow(1.0) { 1.0 } else { self.low }
    }

    /// What a number must be; the largest magnitude where it is beyond that.
    pub(crate) fn must_be(&self, value: Option<f64>) -> String {
        let huge = value.is_some_and(|value| value.is_finite() && value.abs() > HUGE);
        let (low, high) = (self.low > -HUGE, self.high < HUGE);
        let limits = match (self.above, self.not_zero) {
            (Some(above), _) if high => {
                format!("a number above {}, up to {}", Shown(above), Shown(self.high))
            }
            (Some(above), _) => format!("a number above {}", Shown(above)),
            (None, true) => "a number other than 0".to_owned(),
            (None, false) if low && high => {
                format!("a number from {} to {}", Shown(self.low), Shown(self.high))
            }
            (None, false) if low => format!("a number of {} or more", Shown(self.low)),
            (None, false) if high => format!("a number up to {}", Shown(self.high)),
            (None, false) => return format!("a finite number up to {HUGE:e} in magnitude"),
        };
        if huge && !high { format!("{limits}, up to {HUGE:e} in magnitude") } else { limits }
    }
}

/// Lowest and highest whole number that a schema allows.
pub(crate) fn whole_limits(node: &Json) -> (i64, i64) {
    let (low, high) = match node.get("format").and_then(Json::as_str) {
        Some("uint8") => (0, u8::MAX.into()),
        Some("uint16") => (0, u16::MAX.into()),
        Some("uint32") => (0, u32::MAX.into()),
        Some("uint64" | "uint") => (0, i64::MAX),
        Some("int32") => (i32::MIN.into(), i32::MAX.into()),
        _ => (i64::MIN, i64::MAX),
    };
    #[expect(
        clippy::cast_possible_truncation,
        reason = "limits of whole numbers are whole, and too large ones saturate"
    )]
    let bound = |key| node.get(key).and_then(|bound| bound.as_i64().or_else(|| Some(bound.as_f64()? as i64)));
    (low.max(bound("minimum").unwrap_or(low)), high.min(bound("maximum").unwrap_or(high)))
}

/// The whole number that a value states; `None` for any other.
pub(crate) fn whole(value: &DeValue<'_>) -> Option<i64> {
    match value {
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok(),
        _ => None,
    }
}

/// The number that a value states, whole or not; `None` for any other type.
pub(crate) fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) => {
            #[expect(
                clippy::cast_precision_loss,
                reason = "an integer beyond 2⁵³ is rounded like any other literal"
            )]
            let exact = whole(value).map(|whole| whole as f64);
            // Beyond 64 bits. Digits of another base would be read as decimal ones.
            exact.or_else(|| integer.as_str().parse().ok().filter(|_| integer.radix() == 10))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_what_their_digits_say_in_their_base_or_none() {
        for (text, expected) in [
            ("12", Some(12.0)),
            ("0x1f", Some(31.0)),
            ("10000000000000000000", Some(1e19)),
            ("0x99999999999999999", None),
            ("1e3", Some(1000.0)),
            ("true", None),
        ] {
            assert_eq!(number(DeValue::parse(text).unwrap().get_ref()), expected, "{text}");
        }
    }
}
