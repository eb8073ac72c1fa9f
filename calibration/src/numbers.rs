//! Numbers and lists as every fit needs them: counts and times, ends and means, products and lengths of vectors.

use rustfft::num_traits::AsPrimitive;

/// A count as a number: those of a log are far below 2⁵³.
pub fn real(count: impl AsPrimitive<f64>) -> f64 {
    count.as_()
}

/// Nanoseconds in seconds.
pub fn seconds(ns: i64) -> f64 {
    real(ns) * 1e-9
}

/// Mean; no number without any.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / real(values.len())
}

/// Smallest and largest; what is no number is left out, and without any the ends stand the wrong way round.
pub fn ends(values: impl IntoIterator<Item = f64>) -> [f64; 2] {
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    values.into_iter().fold(none, |[low, high], value| [low.min(value), high.max(value)])
}

/// The smallest range that holds all of some; `None` without any.
pub fn hull(ranges: impl IntoIterator<Item = [f64; 2]>) -> Option<[f64; 2]> {
    ranges.into_iter().reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
}

/// Product of two vectors.
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Root of the sum of the squares: the length of a vector.
pub fn norm(parts: impl IntoIterator<Item = f64>) -> f64 {
    parts.into_iter().map(|part| part * part).sum::<f64>().sqrt()
}

/// A vector's direction, of length one.
pub fn unit(v: [f64; 3]) -> [f64; 3] {
    v.map(|part| part / norm(v))
}

/// Each of some once, in the order of their first appearance.
pub fn once_each<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    items.into_iter().fold(Vec::new(), |mut known, item| {
        if !known.contains(&item) {
            known.push(item);
        }
        known
    })
}
