//! Middle and scatter of numbers among which some may be wrong.

/// Standard deviation of a normal distribution, in medians of absolute deviations.
pub const SIGMA_PER_MAD: f64 = 1.482_602_218_505_602;
/// Median of |a − b| of two normal numbers, in standard deviations of either.
const STEP_PER_SIGMA: f64 = 0.953_9;

/// The middle one, or the mean of the two middle ones; zero without any. What is no number is left out.
#[must_use]
pub fn median(values: &[f64]) -> f64 {
    median_if_any(values).unwrap_or(0.0)
}

/// The same, and `None` without any.
#[must_use]
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

/// Standard deviation by the median of absolute deviations.
#[must_use]
pub fn scatter(values: &[f64]) -> f64 {
    let [_, scatter] = middle_and_scatter(values);
    scatter
}

/// The median, and the standard deviation by the median of absolute deviations from it.
#[must_use]
pub fn middle_and_scatter(values: &[f64]) -> [f64; 2] {
    let middle = median(values);
    let away: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
    [middle, SIGMA_PER_MAD * median(&away)]
}

/// Standard deviation of white noise by the median step from value to value, whatever slow drift is below it.
#[must_use]
pub fn scatter_of_steps(values: &[f64]) -> f64 {
    let steps: Vec<f64> = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    median(&steps) / STEP_PER_SIGMA
}
