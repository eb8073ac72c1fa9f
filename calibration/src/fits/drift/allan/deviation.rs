//! Allan variances over contiguous pieces.
//!
//! With x the running sum of the readings y (so that x/m differences are means over m ticks) and d = x₊₂ₘ − 2x₊ₘ + x:
//!
//! ```text
//! plain, overlapping   σ²(mτ0) = Σ d² / (2m²·M)              every m-th d, or all of them
//! modified             σ²(mτ0) = Σ (Σ over m of d)² / (2m⁴·M)
//! ```
//!
//! A gap in a log ends a piece: no difference reaches over it, and the sums of all pieces are pooled.

use crate::numbers::real;

/// Which variance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimator {
    /// Means of neighbours that share no tick.
    Plain,
    /// Means beginning at every tick.
    Overlapping,
    /// With an average over the phase, which tells quantization from angle random walk.
    Modified,
}

/// The running sums of one sensor: one list per piece without gaps, each beginning with 0.
#[derive(Debug, Clone, Default)]
pub struct Phase {
    pieces: Vec<Vec<f64>>,
}

/// A variance, and how many differences it rests on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variance {
    /// Ticks that were averaged.
    pub ticks: usize,
    /// σ² in the square of the readings' unit of measure.
    pub variance: f64,
    /// Number of differences.
    pub differences: usize,
}

/// Lanes of a sum: they keep the processor busy, and their order is fixed.
const LANES: usize = 8;

impl Phase {
    /// From pieces of readings; `mean` is subtracted from each so that the sums stay small.
    pub fn new<'a>(pieces: impl IntoIterator<Item = &'a [f64]>, mean: f64) -> Self {
        let sums = |piece: &[f64]| {
            let mut sums = Vec::with_capacity(piece.len() + 1);
            let mut sum = 0.0;
            sums.push(sum);
            for reading in piece {
                sum += reading - mean;
                sums.push(sum);
            }
            sums
        };
        Self { pieces: pieces.into_iter().map(sums).collect() }
    }

    /// Readings of the longest piece.
    pub fn longest(&self) -> usize {
        self.pieces.iter().map(|piece| piece.len().saturating_sub(1)).max().unwrap_or(0)
    }

    /// The variance over means of `m` (≥ 1) ticks; `None` where no piece is long enough.
    pub fn variance(&self, estimator: Estimator, m: usize) -> Option<Variance> {
        let m = m.max(1);
        let (mut sum, mut differences) = (0.0, 0);
        for piece in &self.pieces {
            let (of_piece, count) = match estimator {
                Estimator::Plain => plain(piece, m),
                Estimator::Overlapping => overlapping(piece, m),
                Estimator::Modified => modified(piece, m),
            };
            sum += of_piece;
            differences += count;
        }
        if differences == 0 {
            return None;
        }
        let width = real(m);
        let power =
            if estimator == Estimator::Modified { width * width * width * width } else { width * width };
        Some(Variance { ticks: m, variance: sum / (2.0 * power * real(differences)), differences })
    }
}

/// Sum of squares over every m-th difference, and their number.
fn plain(x: &[f64], m: usize) -> (f64, usize) {
    let mut means = x.iter().step_by(m);
    let (Some(mut first), Some(mut second)) = (means.next(), means.next()) else { return (0.0, 0) };
    let (mut sum, mut count) = (0.0, 0);
    for third in means {
        let d = third - 2.0 * second + first;
        sum += d * d;
        count += 1;
        (first, second) = (second, third);
    }
    (sum, count)
}

/// Sum of squares over all differences, and their number.
fn overlapping(x: &[f64], m: usize) -> (f64, usize) {
    let (Some(second), Some(third)) = (x.get(m..), x.get(2 * m..)) else { return (0.0, 0) };
    let count = third.len();
    let (Some(first), Some(second)) = (x.get(..count), second.get(..count)) else { return (0.0, 0) };
    let mut lanes = [0.0; LANES];
    let blocks = first.chunks(LANES).zip(second.chunks(LANES)).zip(third.chunks(LANES));
    for ((first, second), third) in blocks {
        for (((lane, first), second), third) in lanes.iter_mut().zip(first).zip(second).zip(third) {
            let d = third - 2.0 * second + first;
            *lane += d * d;
        }
    }
    (lanes.iter().sum(), count)
}

/// Sum of squares over all sums of m differences, and their number.
fn modified(x: &[f64], m: usize) -> (f64, usize) {
    let Some(last) = x.get(3 * m - 1..) else { return (0.0, 0) };
    let (Some(second), Some(third)) = (x.get(m..), x.get(2 * m..)) else { return (0.0, 0) };
    let mut window: f64 = x
        .iter()
        .zip(second)
        .zip(third)
        .take(m)
        .map(|((first, second), third)| third - 2.0 * second + first)
        .sum();
    let mut sum = window * window;
    let count = last.len();
    // From one window to the next, the first difference leaves and one more joins: the third difference of x.
    let steps = x.iter().zip(second).zip(third).zip(last.get(1..).unwrap_or(&[]));
    for (((first, second), third), last) in steps {
        window += (last - first) - 3.0 * (third - second);
        sum += window * window;
    }
    (sum, count)
}

/// Averaging lengths in octaves, as far as a log of `ticks` allows.
pub fn lengths(ticks: usize) -> Vec<usize> {
    std::iter::successors(Some(1), |m| Some(2 * m)).take_while(|m| 3 * m <= ticks).collect()
}

#[expect(clippy::cast_precision_loss, reason = "numbers of ticks of tests")]
#[cfg(test)]
mod tests {
    use super::*;

    /// The 1000 numbers of NBS Special Publication 1065's test suite.
    fn nbs14() -> Vec<f64> {
        let mut x = 1_234_567_890_u64;
        let mut next = || {
            let y = x as f64 / 2_147_483_647.0;
            x = x * 16_807 % 2_147_483_647;
            y
        };
        (0..1000).map(|_| next()).collect()
    }

    #[test]
    fn the_published_series_gives_the_published_deviations() {
        let readings = nbs14();
        let phase = Phase::new([readings.as_slice()], 0.5);
        let known = [
            (Estimator::Overlapping, [2.922_319e-1, 9.159_953e-2, 3.241_343e-2]),
            (Estimator::Plain, [2.922_319e-1, 9.965_736e-2, 3.897_804e-2]),
            (Estimator::Modified, [2.922_319e-1, 6.172_376e-2, 2.170_921e-2]),
        ];
        for (estimator, deviations) in known {
            for (m, expected) in [1, 10, 100].into_iter().zip(deviations) {
                let got = phase.variance(estimator, m).unwrap().variance.sqrt();
                // The published figures have seven digits.
                assert!((got / expected - 1.0).abs() < 1e-6, "{estimator:?} {m}: {got} {expected}");
            }
        }
        // A mean makes no difference.
        let other = Phase::new([readings.as_slice()], 0.0).variance(Estimator::Modified, 100).unwrap();
        let this = phase.variance(Estimator::Modified, 100).unwrap();
        assert!((other.variance / this.variance - 1.0).abs() < 1e-9);
    }

    #[test]
    fn no_difference_reaches_over_a_gap() {
        let readings = nbs14();
        let (a, b) = readings.split_at(400);
        // A step between the pieces would dominate everything.
        let b: Vec<f64> = b.iter().map(|y| y + 1e6).collect();
        let pooled = Phase::new([a, &b], 0.5).variance(Estimator::Overlapping, 10).unwrap();
        assert_eq!(pooled.differences, 381 + 581);
        assert!((pooled.variance.sqrt() / 9.2e-2 - 1.0).abs() < 0.2, "{pooled:?}");
        assert!(Phase::new([a], 0.0).variance(Estimator::Modified, 134).is_none());
        assert!(Phase::new([a], 0.0).variance(Estimator::Modified, 133).is_some());
        assert!(Phase::new([a], 0.0).variance(Estimator::Plain, 201).is_none());
    }

    #[test]
    fn lengths_go_as_far_as_the_log() {
        assert_eq!(lengths(100), [1, 2, 4, 8, 16, 32]);
        assert!(lengths(2).is_empty());
    }
}
