//! Numbers as somebody states them, and the ranges that they have to be in.

use core::fmt;

use thiserror::Error;

use crate::calibration::EVERYWHERE_DEG_C;
use crate::defect::{Defect, DefectKind};

/// A number in words to people: with an exponent where it would be a row of zeros. Read back, it is the same number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown(pub f64);

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(value) = self;
        let is_plain = *value == 0.0 || !value.is_finite() || (1e-4..1e16).contains(&value.abs());
        if is_plain { write!(f, "{value}") } else { write!(f, "{value:e}") }
    }
}

/// Where over temperature something is, in words: at the ends of the range without limits it is so anywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AtDegC(pub f64);

impl fmt::Display for AtDegC {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(deg_c) = self;
        if EVERYWHERE_DEG_C.contains(deg_c) {
            f.write_str("at any temperature")
        } else {
            write!(f, "at {} °C", Shown(*deg_c))
        }
    }
}

/// A stated number that is outside its range, or not a number.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("{name} is {got}; from {min} to {max} is allowed")]
pub struct OutOfRange {
    /// Field of what was stated; its end says the unit of measure.
    pub name: &'static str,
    /// The number.
    pub got: f64,
    /// Smallest allowed.
    pub min: f64,
    /// Largest allowed.
    pub max: f64,
}

/// At its name without the unit of measure.
impl From<OutOfRange> for Defect {
    fn from(OutOfRange { name, got, min, max }: OutOfRange) -> Self {
        let quantity = name.split("_rad").next().unwrap_or(name).trim_end_matches("_s");
        Self { path: quantity.into(), kind: DefectKind::OutOfRange { value: got, low: min, high: max } }
    }
}

/// Those of the stated numbers, each with its name and its range, that are outside it; what is no number is outside any.
pub(crate) fn outside<const N: usize>(
    stated: [(&'static str, f64, [f64; 2]); N],
) -> impl Iterator<Item = OutOfRange> {
    let wrong = stated.into_iter().filter(|(_, got, [min, max])| !(min..=max).contains(&got));
    wrong.map(|(name, got, [min, max])| OutOfRange { name, got, min, max })
}

#[cfg(test)]
mod tests {
    use alloc::string::ToString;

    use super::{AtDegC, Shown};

    #[test]
    fn a_number_is_shown_without_a_row_of_zeros_and_is_the_same_when_it_is_read() {
        for (value, shown) in
            [(5e-324, "5e-324"), (1e300, "1e300"), (0.0001, "0.0001"), (3.6e7, "36000000"), (-25.0, "-25")]
        {
            assert_eq!(Shown(value).to_string(), shown);
            assert_eq!(shown.parse(), Ok(value));
        }
        assert_eq!([0.0, f64::NAN].map(|value| Shown(value).to_string()), ["0", "NaN"]);
        let places = [1e9, 47.5].map(|deg_c| AtDegC(deg_c).to_string());
        assert_eq!(places, ["at any temperature", "at 47.5 °C"]);
    }
}
