//! Where a unit stood still: static intervals of a run.
//!
//! A tick is still where the outputs of the accelerometers vary little over a window around it (Tedaldi, Pretto and Menegatti
//! 2014), and the rates are near those of the still ticks: accelerometers do not feel a turn about the vertical. The window
//! keeps half its length away from every motion.

use std::ops::Range;

use clap::Args;

use super::track::{Track, quantile};
use crate::limits::{above_0, from_0};
use crate::numbers::{norm, real};
use crate::report::short;

/// What counts as still; the defaults are those of a stand.
#[derive(Debug, Clone, Copy, PartialEq, Args)]
pub struct StillLimits {
    /// Window of the search for still poses (s)
    #[arg(long = "window", hide_short_help = true, value_name = "SECONDS", default_value_t = 1.0, value_parser = above_0)]
    pub window_s: f64,
    /// Largest variance of a still window, relative to the log's quietest fifth
    #[arg(long = "threshold", hide_short_help = true, value_name = "FACTOR", default_value_t = 4.0, value_parser = above_0)]
    pub factor: f64,
    /// Rate above which the unit turns (°/s)
    #[arg(long = "still-rate", hide_short_help = true, value_name = "DEG_PER_S", default_value_t = 0.2, value_parser = above_0)]
    pub rate_deg_per_s: f64,
    /// Time to leave out at the beginning of each pose (s)
    #[arg(long = "settle", hide_short_help = true, value_name = "SECONDS", default_value_t = 2.0, value_parser = from_0)]
    pub settle_s: f64,
    /// Shortest pose (s)
    #[arg(long = "least", hide_short_help = true, value_name = "SECONDS", default_value_t = 10.0, value_parser = above_0)]
    pub least_s: f64,
}

/// Fewest ticks of a window.
const FEWEST_TICKS: usize = 8;
/// Standard deviations of noise that a still rate or force may be away.
const RATE_SIGMAS: f64 = 6.0;
/// Share of the run that is taken to be still where nothing is known.
const QUIET_SHARE: f64 = 0.2;

/// The still intervals of a run, in ticks. `rest` is a stretch from its beginning (s) that is known to be still.
pub fn still(track: &Track, limits: &StillLimits, rest: Option<f64>) -> Vec<Range<usize>> {
    let tick_s = track.tick_s();
    let half = half_window(limits.window_s, tick_s);
    let mut variance = vec![0.0; track.len()];
    for column in &track.outputs {
        let (_, own) = spread(column, half);
        variance.iter_mut().zip(own).for_each(|(sum, value)| *sum += value);
    }
    let in_rest = |values: &[f64]| -> f64 {
        match rest {
            Some(length_s) => {
                let count = (0..values.len()).take_while(|tick| track.start_s(*tick) < length_s).count();
                quantile(&values[..count.max(1).min(values.len())], 0.5)
            }
            None => quantile(values, QUIET_SHARE),
        }
    };
    let limit = limits.factor * in_rest(&variance).max(least_variance(&track.outputs));
    // False for no number too.
    let calm: Vec<bool> = variance.iter().map(|value| *value <= limit).collect();
    let turning = turning(track, limits, half, &calm);
    let gap =
        |tick: usize| track.start_s(tick) - track.start_s(tick - 1) > 1.5 * track.duration_s[tick - 1] + 1e-6;
    let still: Vec<usize> = (0..track.len()).filter(|tick| calm[*tick] && !turning[*tick]).collect();
    let together = still.chunk_by(|last, tick| *tick == last + 1 && !gap(*tick));
    let intervals = together.map(|ticks| ticks[0]..ticks[0] + ticks.len());
    intervals.filter_map(|ticks| settled(track, ticks, limits)).collect()
}

/// How a unit moves in ticks that are said to be a pose, in words: by means over windows that lie within them. `rest` are the rates about
/// the case axes at rest (°/s). `None` where it is still.
pub fn moves(track: &Track, ticks: &Range<usize>, limits: &StillLimits, rest: [f64; 3]) -> Option<String> {
    let half = half_window(limits.window_s, track.tick_s()).min(ticks.len().saturating_sub(1) / 2);
    // Means over whole windows, and what noise may do to one.
    let windows = |column: &Vec<f64>| {
        let (mean, variance) = spread(&column[ticks.clone()], half);
        let noise = RATE_SIGMAS * (quantile(&variance, 0.5) / real(2 * half + 1)).max(0.0).sqrt();
        (mean[half..mean.len() - half].to_vec(), noise)
    };
    for (column, rest) in track.rate_deg_per_s.iter().zip(rest) {
        let (mean, noise) = windows(column);
        let limit = limits.rate_deg_per_s.max(noise);
        let away = mean.into_iter().map(|rate| (rate - rest).abs()).fold(0.0, f64::max);
        if away > limit {
            return Some(format!(
                "the unit turns by up to {} °/s, at most {} °/s are still (--still-rate)",
                short(away),
                short(limit)
            ));
        }
    }
    let [x, y, z] = track.force_m_per_s2.each_ref().map(windows);
    let middle = [&x, &y, &z].map(|(mean, _)| quantile(mean, 0.5));
    let noise = norm([x.1, y.1, z.1]) / norm(middle);
    let limit_deg = (limits.rate_deg_per_s * limits.window_s).max(noise.to_degrees());
    let away = x.0.iter().zip(&y.0).zip(&z.0);
    let away = away.map(|((x, y), z)| norm([x - middle[0], y - middle[1], z - middle[2]]) / norm(middle));
    let away_deg = away.fold(0.0, f64::max).to_degrees();
    (away_deg > limit_deg).then(|| {
        format!(
            "the specific force turns by {} °, at most {} ° are still (--still-rate times --window)",
            short(away_deg),
            short(limit_deg)
        )
    })
}

/// The interval without the time that the unit takes to settle; `None` where what is left is too short.
fn settled(track: &Track, ticks: Range<usize>, limits: &StillLimits) -> Option<Range<usize>> {
    let begin = track.start_s(ticks.start);
    let is_settling = |tick: &usize| track.start_s(*tick) < begin + limits.settle_s - 1e-9;
    let settled = ticks.start + ticks.clone().take_while(is_settling).count()..ticks.end;
    let length = track.duration_s[settled.clone()].iter().sum::<f64>();
    (length >= limits.least_s - 1e-9).then_some(settled)
}

/// Ticks to either side of a window's middle.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "float-to-int `as` saturates")]
fn half_window(window_s: f64, tick_s: f64) -> usize {
    ((0.5 * window_s / tick_s).round() as usize).max(FEWEST_TICKS / 2)
}

/// Ticks at which the rate is not that of rest.
fn turning(track: &Track, limits: &StillLimits, half: usize, calm: &[bool]) -> Vec<bool> {
    let mut turning = vec![false; track.len()];
    for column in &track.rate_deg_per_s {
        let (mean, variance) = spread(column, half);
        let of_calm = |values: &[f64]| -> Vec<f64> {
            values.iter().zip(calm).filter(|(_, calm)| **calm).map(|(value, _)| *value).collect()
        };
        let rest = quantile(&of_calm(&mean), 0.5);
        let ticks = real(2 * half + 1);
        let noise = (quantile(&of_calm(&variance), QUIET_SHARE) / ticks).max(0.0).sqrt();
        let limit = limits.rate_deg_per_s.max(RATE_SIGMAS * noise);
        for (turns, mean) in turning.iter_mut().zip(&mean) {
            *turns |= (mean - rest).abs() > limit;
        }
    }
    turning
}

/// Mean and variance of a column over a window around each tick; where the window is cut by the run's end, over what is there.
fn spread(column: &[f64], half: usize) -> (Vec<f64>, Vec<f64>) {
    // Sums of squares would lose the variance beside a large mean.
    let about = quantile(column, 0.5);
    // Up to each tick: sums of both powers, and how many readings are not numbers.
    let (mut first, mut second, mut broken) = (0.0, 0.0, 0_usize);
    let mut sums = vec![(first, second, broken)];
    for value in column {
        let away = value - about;
        if away.is_finite() {
            first += away;
            second += away * away;
        } else {
            broken += 1;
        }
        sums.push((first, second, broken));
    }
    let of = |tick: usize| {
        let (low, high) = (tick.saturating_sub(half), (tick + half + 1).min(column.len()));
        if sums[high].2 > sums[low].2 {
            return (f64::NAN, f64::NAN);
        }
        let count = real(high - low);
        let mean = (sums[high].0 - sums[low].0) / count;
        let square = (sums[high].1 - sums[low].1) / count;
        (about + mean, (square - mean * mean).max(0.0) * count / (count - 1.0).max(1.0))
    };
    (0..column.len()).map(of).unzip()
}

/// Variance that is still whatever the noise: a hundred-thousandth of the range that the outputs go through.
fn least_variance(columns: &[Vec<f64>]) -> f64 {
    let range = |column: &Vec<f64>| quantile(column, 0.99) - quantile(column, 0.01);
    let widest = columns.iter().map(range).fold(0.0, f64::max);
    1e-10 * widest * widest
}
