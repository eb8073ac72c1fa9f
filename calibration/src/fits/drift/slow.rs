//! The slow part of a sensor's readings: means over bins, and their autocorrelation.

use super::HOUR_S;
use crate::numbers::real;

/// Bins that a log is cut into.
pub const BINS: usize = 512;
/// A bin counts where at least this share of its ticks is there.
const LEAST_SHARE: f64 = 0.5;

/// Means over bins of equal width; bins in gaps are left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Slow {
    /// Width of a bin (h).
    pub width_h: f64,
    /// Middles of the bins since the log's beginning (h).
    pub time_h: Vec<f64>,
    /// Means.
    pub mean: Vec<f64>,
}

impl Slow {
    /// Of readings every `tick_s`, with the place of each on a grid of ticks.
    pub fn of(pieces: &[(usize, &[f64])], places: usize, tick_s: f64) -> Self {
        let width = places.div_ceil(BINS).max(1);
        let bins = places.div_ceil(width);
        let mut sums = vec![(0.0, 0_usize); bins];
        for (start, readings) in pieces {
            // A block ends where a bin does.
            let (mut place, mut rest) = (*start, *readings);
            while !rest.is_empty() {
                let take = (width - place % width).min(rest.len());
                let (now, later) = rest.split_at(take);
                if let Some(bin) = sums.get_mut(place / width) {
                    bin.0 += now.iter().sum::<f64>();
                    bin.1 += take;
                }
                (place, rest) = (place + take, later);
            }
        }
        let full = real(width) * LEAST_SHARE;
        let width_h = real(width) * tick_s / HOUR_S;
        let filled = sums.into_iter().enumerate().filter(|(_, (_, count))| real(*count) >= full);
        let (time_h, mean) =
            filled.map(|(bin, (sum, count))| ((real(bin) + 0.5) * width_h, sum / real(count))).unzip();
        Self { width_h, time_h, mean }
    }

    /// Length from the first bin's beginning to the last one's end (h).
    pub fn length_h(&self) -> f64 {
        match (self.time_h.first(), self.time_h.last()) {
            (Some(first), Some(last)) => last - first + self.width_h,
            _ => 0.0,
        }
    }
}

/// Autocorrelation of what is left of the slow part after its trend.
#[derive(Debug, Clone, PartialEq)]
pub struct Autocorrelation {
    /// Lags (h).
    pub lag_h: Vec<f64>,
    /// Correlations, 1 at lag 0.
    pub correlation: Vec<f64>,
    /// Where it first falls to 1/e (h); `None` where it does not, or falls there within the first bin.
    pub correlation_time_h: Option<f64>,
}

impl Autocorrelation {
    /// Of residuals at the times of bins of a width, up to half of the log.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "times of at most 512 bins in widths of one"
    )]
    pub fn of(time_h: &[f64], residual: &[f64], width_h: f64) -> Self {
        let place =
            |time: f64| ((time - time_h.first().copied().unwrap_or(0.0)) / width_h).round().max(0.0) as usize;
        let length = time_h.last().map_or(0, |last| place(*last) + 1);
        let mut grid = vec![None; length];
        for (time, value) in time_h.iter().zip(residual) {
            if let Some(cell) = grid.get_mut(place(*time)) {
                *cell = Some(*value);
            }
        }
        let products = |lag: usize| {
            let pairs = grid.iter().zip(grid.get(lag..).unwrap_or(&[]));
            let (sum, count) = pairs
                .filter_map(|(a, b)| Some(a.as_ref()? * b.as_ref()?))
                .fold((0.0, 0_u32), |(sum, count), product| (sum + product, count + 1));
            if count > 0 { sum / f64::from(count) } else { f64::NAN }
        };
        let variance = products(0);
        let lags = 0..=length / 2;
        let correlation: Vec<f64> = lags.clone().map(|lag| products(lag) / variance).collect();
        let lag_h: Vec<f64> = lags.map(|lag| real(lag) * width_h).collect();
        let limit = libm::exp(-1.0);
        let crossing =
            correlation.iter().zip(correlation.iter().skip(1)).position(|(a, b)| *a >= limit && *b < limit);
        let correlation_time_h = crossing.filter(|lag| *lag > 0).and_then(|lag| {
            let (before, after) = (correlation.get(lag)?, correlation.get(lag + 1)?);
            Some((real(lag) + (before - limit) / (before - after)) * width_h)
        });
        Self { lag_h, correlation, correlation_time_h }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_take_the_mean_and_leave_gaps_out() {
        let first = vec![1.0; 3000];
        let second = vec![3.0; 2000];
        let slow = Slow::of(&[(0, &first), (8240, &second)], 10_240, 1.0);
        assert!((slow.width_h - 20.0 / 3600.0).abs() < 1e-15);
        assert_eq!(slow.mean.len(), 250);
        assert!(slow.mean[..150].iter().all(|mean| (mean - 1.0).abs() < 1e-12));
        assert!(slow.mean[150..].iter().all(|mean| (mean - 3.0).abs() < 1e-12));
        assert!((slow.time_h[150] - 8250.0 / 3600.0).abs() < 1e-9);
        assert!((slow.length_h() - 10_240.0 / 3600.0).abs() < 1e-9);
    }

    #[test]
    fn a_cosine_correlates_as_a_cosine() {
        let time: Vec<f64> = (0..400).map(|k| f64::from(k) * 0.1).collect();
        let residual: Vec<f64> = time.iter().map(|t| (std::f64::consts::TAU * t / 8.0).cos()).collect();
        let auto = Autocorrelation::of(&time, &residual, 0.1);
        assert!((auto.correlation[40] + 1.0).abs() < 0.02, "half a period later");
        let expected = 8.0 * (-1.0_f64).exp().acos() / std::f64::consts::TAU;
        assert!((auto.correlation_time_h.unwrap() - expected).abs() < 0.05);
    }
}
