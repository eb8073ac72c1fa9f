//! Where the table turned steadily: runs of bins between which no gyro changes by more than noise.

use super::bins::Bin;
use crate::numbers::{norm, scatter_of_steps};

/// Standard deviations, and share of the rate, by which two neighbouring bins may differ.
const SIGMAS: f64 = 8.0;
const SHARE: f64 = 1e-3;
/// Share of the rate by which the ends of a plateau may differ.
const SLOPE: f64 = 2e-3;
/// Time that is left out at either end of a plateau (s).
const EDGE_S: f64 = 1.0;
/// Shortest plateau that is left (s).
const SHORTEST_S: f64 = 3.0;

/// A stretch of steady rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Plateau {
    /// Its first bin, and the one behind its last.
    pub bins: [usize; 2],
    /// When, since the beginning of the run (s).
    pub window_s: [f64; 2],
    /// Mean rate of each gyro (°/h).
    pub rate: Vec<f64>,
}

impl Plateau {
    /// Length of what the gyros show in it (°/h).
    pub fn size(&self) -> f64 {
        norm(self.rate.iter().copied())
    }

    /// Its bins.
    pub fn own<'a>(&self, bins: &'a [Bin]) -> &'a [Bin] {
        bins.get(self.bins[0]..self.bins[1]).unwrap_or_default()
    }
}

/// Standard deviation of a bin's rate by gyro (°/h), from the differences of neighbours; most of a run is steady.
pub fn scatter(bins: &[Bin]) -> Vec<f64> {
    let sensors = bins.first().map_or(0, |bin| bin.rate.len());
    (0..sensors)
        .map(|sensor| scatter_of_steps(&bins.iter().map(|bin| bin.rate[sensor]).collect::<Vec<f64>>()))
        .collect()
}

/// The plateaus of a run; `count_deg_per_h` is what one count in a bin makes of each gyro's rate.
pub fn find(bins: &[Bin], count_deg_per_h: &[f64]) -> Vec<Plateau> {
    let sigma: Vec<f64> =
        scatter(bins).iter().zip(count_deg_per_h).map(|(sigma, count)| sigma.max(0.3 * count)).collect();
    let size = |rate: &[f64]| norm(rate.iter().copied());
    let near = |a: &[f64], b: &[f64], share: f64| {
        let slack = share * size(a).max(size(b));
        a.iter().zip(b).zip(&sigma).all(|((a, b), sigma)| (a - b).abs() <= slack + SIGMAS * sigma)
    };
    let goes_on = |last: &Bin, now: &Bin| {
        !now.broken && now.good_s > 0.0 && last.good_s > 0.0 && near(&last.rate, &now.rate, SHARE)
    };
    let mut end = 0;
    let plateau = |steady: &[Bin]| {
        let begin = end;
        end += steady.len();
        let third = steady.len() / 3;
        let [first, last] = [&steady[..third], &steady[steady.len() - third..]].map(mean);
        let is_level = third > 0 && near(&first, &last, SLOPE);
        is_level.then(|| cut(bins, begin, end)).flatten()
    };
    bins.chunk_by(goes_on).filter_map(plateau).collect()
}

/// A stretch of bins less its edges.
fn cut(bins: &[Bin], begin: usize, end: usize) -> Option<Plateau> {
    let [from_s, to_s] = [bins.get(begin)?.begin_s + EDGE_S, behind(bins.get(end.checked_sub(1)?)?) - EDGE_S];
    within(bins, [from_s, to_s]).filter(|plateau| plateau.window_s[1] - plateau.window_s[0] >= SHORTEST_S)
}

/// The bins that lie within a window.
pub fn within(bins: &[Bin], [from_s, to_s]: [f64; 2]) -> Option<Plateau> {
    const ROUNDING_S: f64 = 1e-6;
    let begin = bins.iter().position(|bin| bin.begin_s >= from_s - ROUNDING_S)?;
    let end = bins.iter().rposition(|bin| behind(bin) <= to_s + ROUNDING_S)? + 1;
    let inside = bins.get(begin..end).filter(|inside| !inside.is_empty())?;
    let window_s = [inside.first()?.begin_s, behind(inside.last()?)];
    Some(Plateau { bins: [begin, end], window_s, rate: mean(inside) })
}

fn behind(bin: &Bin) -> f64 {
    bin.begin_s + bin.length_s
}

/// Mean rates over some bins, by their good time.
pub fn mean(bins: &[Bin]) -> Vec<f64> {
    let sensors = bins.first().map_or(0, |bin| bin.rate.len());
    let good: f64 = bins.iter().filter(|bin| bin.good_s > 0.0).map(|bin| bin.good_s).sum();
    let sum = |sensor: usize| -> f64 {
        bins.iter().filter(|bin| bin.good_s > 0.0).map(|bin| bin.rate[sensor] * bin.good_s).sum()
    };
    (0..sensors).map(|sensor| sum(sensor) / good).collect()
}
