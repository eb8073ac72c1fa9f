//! Numbers as somebody states them, and the ranges that they have to be in.

use thiserror::Error;

/// A stated number that is outside its range, or not a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("{name} is {got}; from {min} to {max} is allowed")]
pub struct OutOfRange<T = f64> {
    /// Field of what was stated; its end says the unit of measure.
    pub name: &'static str,
    /// The number.
    pub got: T,
    /// Smallest allowed.
    pub min: T,
    /// Largest allowed.
    pub max: T,
}

/// Those of the stated numbers, each with its name and its range, that are outside it; what is no number is outside any.
pub(crate) fn outside<T: PartialOrd + Copy, const N: usize>(
    stated: [(&'static str, T, [T; 2]); N],
) -> impl Iterator<Item = OutOfRange<T>> {
    let wrong = stated.into_iter().filter(|(_, got, [min, max])| !(min..=max).contains(&got));
    wrong.map(|(name, got, [min, max])| OutOfRange { name, got, min, max })
}
