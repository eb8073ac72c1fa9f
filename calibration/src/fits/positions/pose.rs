//! What a unit put out while it stood still: means over static intervals, and how noisy they are.

use std::collections::BTreeMap;
use std::ops::Range;

use super::track::Track;
use crate::numbers::{mean, real};

/// Means over one static interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Pose {
    /// Which run it is in, by number.
    pub run: usize,
    /// Its ticks.
    pub ticks: Range<usize>,
    /// Start and end since the run's beginning (s).
    pub span_s: [f64; 2],
    /// Time that the means are over (s).
    pub duration_s: f64,
    /// Mean output of each accelerometer (counts/s, V, m/s² or as the log has it).
    pub outputs: Vec<f64>,
    /// Mean output of each gyro (rad/s or counts/s).
    pub gyros: Vec<f64>,
    /// Mean specific force along the case axes with the document at hand (m/s²).
    pub force_m_per_s2: [f64; 3],
    /// Mean smoothed temperature by channel (°C); channels without a number throughout are left out.
    pub temperature_deg_c: BTreeMap<String, f64>,
}

/// Shortest part of an interval that noise is told from (s).
const PART_S: f64 = 1.0;
/// Most parts of an interval.
const MOST_PARTS: usize = 60;

impl Pose {
    /// The poses of a run.
    pub fn of(track: &Track, run: usize, intervals: Vec<Range<usize>>) -> Vec<Self> {
        intervals.into_iter().map(|ticks| Self::over(track, run, ticks)).collect()
    }

    /// Mean output of one accelerometer; no number where there is none.
    pub fn output(&self, index: usize) -> f64 {
        self.outputs.get(index).copied().unwrap_or(f64::NAN)
    }

    /// Mean output of one gyro; no number where there is none.
    pub fn gyro(&self, index: usize) -> f64 {
        self.gyros.get(index).copied().unwrap_or(f64::NAN)
    }

    /// Means over one interval.
    pub fn over(track: &Track, run: usize, ticks: Range<usize>) -> Self {
        let durations = &track.duration_s[ticks.clone()];
        let length: f64 = durations.iter().sum();
        let mean = |column: &Vec<f64>| {
            let parts = column[ticks.clone()].iter().zip(durations);
            parts.map(|(value, duration)| value * duration).sum::<f64>() / length
        };
        let temperature = |(name, column): (&String, &Vec<f64>)| {
            let mean = mean(column);
            mean.is_finite().then(|| (name.clone(), mean))
        };
        let begin = track.start_s(ticks.start);
        Self {
            run,
            span_s: [begin, begin + length],
            duration_s: length,
            outputs: track.outputs.iter().map(mean).collect(),
            gyros: track.gyros.iter().map(mean).collect(),
            force_m_per_s2: track.force_m_per_s2.each_ref().map(mean),
            temperature_deg_c: track.temperature_deg_c.iter().filter_map(temperature).collect(),
            ticks,
        }
    }

    /// Its middle since the run's beginning (s).
    pub fn middle_s(&self) -> f64 {
        0.5 * (self.span_s[0] + self.span_s[1])
    }

    /// Mean temperature of some channels (°C); `None` where there is none of them.
    pub fn mean_temperature(&self, channels: &[String]) -> Option<f64> {
        let of: Vec<f64> =
            channels.iter().filter_map(|name| self.temperature_deg_c.get(name).copied()).collect();
        (!of.is_empty() && of.len() == channels.len()).then(|| mean(&of))
    }
}

/// Intensity of the white noise of each accelerometer (output²·s): a mean over τ seconds has variance Q/τ.
///
/// From differences of neighbouring parts of each interval, so that a slow drift within it does not count; pooled over all
/// intervals, because a single one tells its noise to a fifth at best. NaN where no interval has two parts.
pub fn intensities(tracks: &[Track], poses: &[Pose]) -> Vec<f64> {
    let sensors = tracks.iter().map(|track| track.outputs.len()).max().unwrap_or(0);
    let mut sums = vec![(0.0, 0.0); sensors];
    for pose in poses {
        let Some(track) = tracks.get(pose.run) else { continue };
        let ticks = pose.ticks.len();
        let parts = parts(pose.duration_s).min(ticks);
        if parts < 2 {
            continue;
        }
        let size = ticks / parts;
        let length_s = pose.duration_s * real(size) / real(ticks);
        for (sum, column) in sums.iter_mut().zip(&track.outputs) {
            let means: Vec<f64> = column[pose.ticks.clone()]
                .chunks_exact(size)
                .map(|part| part.iter().sum::<f64>() / real(size))
                .collect();
            for pair in means.windows(2) {
                let difference = pair[1] - pair[0];
                sum.0 += 0.5 * difference * difference * length_s;
                sum.1 += 1.0;
            }
        }
    }
    sums.into_iter().map(|(sum, count)| if count > 0.0 { sum / count } else { f64::NAN }).collect()
}

/// How many parts an interval is cut into.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "float-to-int `as` saturates")]
fn parts(duration_s: f64) -> usize {
    ((duration_s / PART_S) as usize).min(MOST_PARTS)
}
