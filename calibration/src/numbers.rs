//! Numbers and lists as every fit needs them: counts and times, ends and means, products and lengths of vectors, how large a set of
//! numbers is; middle and scatter of numbers among which some may be wrong.

pub use isotherm_correction::vector::dot;
use rustfft::num_traits::AsPrimitive;

/// A count as a number: those of a log are far below 2⁵³.
pub fn real(count: impl AsPrimitive<f64>) -> f64 {
    count.as_()
}

/// ″ in one radian.
pub const ARCSEC_PER_RAD: f64 = 206_264.806_247_096_36;

/// Nanoseconds in seconds.
pub fn seconds(ns: i64) -> f64 {
    real(ns) * 1e-9
}

/// Mean; no number without any.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / real(values.len())
}

/// Mean of what is a number; `None` without any.
pub fn mean_if_any(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let known = values.into_iter().filter(|value| value.is_finite());
    let (sum, count) = known.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    (count > 0.0).then(|| sum / count)
}

/// So many places from one end to the other.
pub fn places([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    let step = (high - low) / real(count.max(2) - 1);
    (0..count).map(|index| low + step * real(index)).collect()
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

/// Root of the sum of the squares: the length of a vector.
pub fn norm(parts: impl IntoIterator<Item = f64>) -> f64 {
    parts.into_iter().map(|part| part * part).sum::<f64>().sqrt()
}

/// A vector's direction, of length one.
pub fn unit(v: [f64; 3]) -> [f64; 3] {
    v.map(|part| part / norm(v))
}

/// The same; `None` where it has none.
pub fn direction(v: [f64; 3]) -> Option<[f64; 3]> {
    let size = norm(v);
    (size.is_finite() && size > 0.0).then(|| unit(v))
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

/// What is said of some things, each once with all that it holds of, in the order of the first.
pub fn grouped<T, W: PartialEq>(told: impl IntoIterator<Item = (T, W)>) -> Vec<(W, Vec<T>)> {
    let mut groups: Vec<(W, Vec<T>)> = Vec::new();
    for (of, words) in told {
        match groups.iter_mut().find(|(said, _)| *said == words) {
            Some((_, all)) => all.push(of),
            None => groups.push((words, vec![of])),
        }
    }
    groups
}

/// Size of a set of numbers; those that are no number are left out.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Size {
    /// How many there are.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// Standard deviation about the mean.
    #[serde(rename = "standard_deviation")]
    pub deviation: f64,
    /// Largest less smallest.
    pub peak_to_peak: f64,
}

impl Size {
    /// Of some values; zero without any.
    pub fn of(values: &[f64]) -> Self {
        let good = || values.iter().copied().filter(|value| value.is_finite());
        let count = good().count();
        if count == 0 {
            return Self::default();
        }
        let mean = good().sum::<f64>() / real(count);
        let about =
            |centre: f64| (good().map(|x| (x - centre) * (x - centre)).sum::<f64>() / real(count)).sqrt();
        let [low, high] = ends(good());
        Self { count, mean, rms: about(0.0), deviation: about(mean), peak_to_peak: high - low }
    }
}

/// Values less their mean.
pub fn about_mean(values: &[f64]) -> Vec<f64> {
    let mean = Size::of(values).mean;
    values.iter().map(|value| value - mean).collect()
}

/// Standard deviation of a normal distribution, in medians of absolute deviations.
pub const SIGMA_PER_MAD: f64 = 1.482_602_218_505_602;
/// Median of |a − b| of two normal numbers, in standard deviations of either.
const STEP_PER_SIGMA: f64 = 0.953_9;

/// The middle one, or the mean of the two middle ones; zero without any. What is no number is left out.
pub fn median(values: &[f64]) -> f64 {
    median_if_any(values).unwrap_or(0.0)
}

/// The same, and `None` without any.
pub fn median_if_any(values: &[f64]) -> Option<f64> {
    let mut good: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let count = good.len();
    if count == 0 {
        return None;
    }
    // Columns may have millions of readings: nothing is sorted that need not be.
    let (below, upper, _) = good.select_nth_unstable_by(count / 2, f64::total_cmp);
    Some(match below.iter().copied().max_by(f64::total_cmp) {
        Some(lower) if count.is_multiple_of(2) => 0.5 * (lower + *upper),
        _ => *upper,
    })
}

/// The value that so many percent of some lie below; zero without any. What is no number is left out.
pub fn percentile(values: impl IntoIterator<Item = f64>, percent: usize) -> f64 {
    let mut good: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
    let place = (good.len() * percent / 100).min(good.len().saturating_sub(1));
    if good.is_empty() { 0.0 } else { *good.select_nth_unstable_by(place, f64::total_cmp).1 }
}

/// Standard deviation by the median of absolute deviations.
pub fn scatter(values: &[f64]) -> f64 {
    let [_, scatter] = middle_and_scatter(values);
    scatter
}

/// The median, and the standard deviation by the median of absolute deviations from it.
pub fn middle_and_scatter(values: &[f64]) -> [f64; 2] {
    let middle = median(values);
    let away: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
    [middle, SIGMA_PER_MAD * median(&away)]
}

/// Standard deviation of white noise by the median step from value to value, whatever slow drift is below it.
pub fn scatter_of_steps(values: &[f64]) -> f64 {
    let steps: Vec<f64> = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    median(&steps) / STEP_PER_SIGMA
}

/// Windows of a log for each block that is averaged over, and the most that a block may have.
const WINDOWS_PER_BLOCK: usize = 200;
const LONGEST_BLOCK: usize = 10;

/// Length of the blocks that so many windows are averaged over before something slow is looked for in them: white noise no longer hides it.
pub fn block_length(windows: usize) -> usize {
    (windows / WINDOWS_PER_BLOCK).clamp(1, LONGEST_BLOCK)
}

/// Whether windows scatter about their mean as white noise does, block by block: neighbours then differ by as much as any two
/// (von Neumann 1941: half the mean square step over the variance is 1 ± 1/√n). Windows that are no number are left out; fewer than
/// twenty blocks tell nothing.
pub fn is_white(windows: &[f64]) -> bool {
    const FEWEST: usize = 20;
    const SIGMAS: f64 = 3.0;
    let good: Vec<f64> = windows.iter().copied().filter(|value| value.is_finite()).collect();

    let blocks: Vec<f64> = good.chunks_exact(block_length(good.len())).map(mean).collect();
    let middle = mean(&blocks);
    let square: f64 = blocks.iter().map(|block| (block - middle) * (block - middle)).sum();
    let steps: f64 = blocks.windows(2).map(|pair| (pair[1] - pair[0]) * (pair[1] - pair[0])).sum();
    blocks.len() >= FEWEST && 0.5 * steps / square > 1.0 - SIGMAS / real(blocks.len()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::noise;

    #[test]
    fn what_is_no_number_is_no_part_of_a_size() {
        let size = Size::of(&[1.0, f64::NAN, 3.0]);
        assert_eq!((size.count, size.mean, size.deviation, size.peak_to_peak), (2, 2.0, 1.0, 2.0));
        assert_eq!(Size::of(&[]), Size::default());
    }

    #[test]
    fn noise_is_white_and_what_moves_below_it_is_not() {
        let mut noise = noise();
        for count in [60, 300, 5000] {
            let white: Vec<f64> = (0..count).map(|_| 5.0 + noise()).collect();
            assert!(is_white(&white), "{count}");
            let slow = white
                .iter()
                .zip(0..)
                .map(|(x, k)| x + 2.0 * libm::sin(f64::from(k) * 6.0 / f64::from(count)));
            assert!(!is_white(&slow.collect::<Vec<_>>()), "{count}");
        }
        assert!(!is_white(&[1.0; 100]) && !is_white(&[1.0, -1.0, 1.0]));
    }
}
