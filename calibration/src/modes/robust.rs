//! Middle and scatter of numbers among which some may be wrong.

/// Standard deviation of a normal distribution, in medians of absolute deviations.
const SIGMA_PER_MAD: f64 = 1.482_602_218_505_602;

/// The middle one; zero without any. What is no number is left out.
#[must_use]
pub fn median(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match (sorted.get(middle), middle.checked_sub(1).and_then(|below| sorted.get(below))) {
        (Some(upper), Some(lower)) if sorted.len().is_multiple_of(2) => 0.5 * (lower + upper),
        (Some(middle), _) => *middle,
        _ => 0.0,
    }
}

/// Standard deviation by the median of absolute deviations.
#[must_use]
pub fn scatter(values: &[f64]) -> f64 {
    let middle = median(values);
    let away: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
    SIGMA_PER_MAD * median(&away)
}
