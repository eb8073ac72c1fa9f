//! Interleaved rounds: every case once in every round, so that what the machine does otherwise falls on all alike.

use std::time::Instant;

use clap::builder::RangedU64ValueParser;

/// For `value_parser`: how many rounds.
pub(crate) fn rounds() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(1..=10_000)
}

/// A quantile (0…1) of sorted figures.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a place among some hundred rounds"
)]
pub(crate) fn quantile(sorted: &[f64], share: f64) -> f64 {
    let last = sorted.len().saturating_sub(1) as f64;
    sorted.get((share * last).round() as usize).copied().unwrap_or(f64::NAN)
}

/// Runs every case once in each of so many rounds, after one that is not counted; the seconds of each, sorted.
pub(crate) fn interleaved<T>(cases: &mut [T], rounds: usize, mut run: impl FnMut(&mut T)) -> Vec<Vec<f64>> {
    let mut times: Vec<Vec<f64>> = cases.iter().map(|_| Vec::with_capacity(rounds)).collect();
    for round in 0..=rounds {
        for (case, times) in cases.iter_mut().zip(&mut times) {
            let begin = Instant::now();
            run(case);
            if round > 0 {
                times.push(begin.elapsed().as_secs_f64());
            }
        }
    }
    for times in &mut times {
        times.sort_by(f64::total_cmp);
    }
    times
}

/// Median of some figures; what is no number is left out, and no figures have none.
pub(crate) fn median(figures: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = figures.filter(|figure| !figure.is_nan()).collect();
    sorted.sort_by(f64::total_cmp);
    let upper = sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN);
    match sorted.len().checked_sub(1) {
        Some(last) if last % 2 == 1 => {
            sorted.get(last / 2).map_or(upper, |lower| f64::midpoint(*lower, upper))
        }
        _ => upper,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(median([3.0, 1.0, 2.0].into_iter()).to_bits(), 2.0_f64.to_bits());
        assert_eq!(median([4.0, 1.0, f64::NAN, 2.0, 3.0].into_iter()).to_bits(), 2.5_f64.to_bits());
        assert!(median(std::iter::empty()).is_nan());
    }
}
