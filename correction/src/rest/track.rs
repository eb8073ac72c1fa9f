//! One kind of window over time: what is usual, and what is not.

use core::f64::consts::SQRT_2;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use crate::recent::Recent;
use crate::vector::{minus, plus};

/// Means of some windows.
type Windows<'a> = &'a [[f64; 3]];

/// Windows from which the first picture of the noise is taken.
const LEARNING: usize = 30;
/// Windows that make the reference later on.
const RECENT: usize = 60;
/// Windows in a block; three blocks are a minute.
const BLOCK: usize = 20;
/// The same as a real number.
const BLOCK_WINDOWS: f64 = 20.0;
/// Blocks that are remembered.
const BLOCKS: usize = 12;
/// Blocks in a minute.
const MINUTE: usize = 3;
/// Windows in a minute.
const MINUTE_WINDOWS: f64 = 60.0;
/// σ from the median of the deviations of normal values.
const SIGMA_PER_MEDIAN: f64 = 1.4826;
/// The first picture of the noise rests on few windows and on their median: how much wider its limits are.
const LEARNING_FACTOR: f64 = 10.0 / 7.0;
/// Windows that can wait until there is something to compare them with.
const HELD: usize = 8;
/// Counts below which nothing is a motion: the counts of a second scatter by half a count at most, seven times which is
/// 3.5.
const COUNTS: f64 = 4.0;

/// What is too much on one axis; value and limit in the unit of measure of the caller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Finding {
    pub(super) axis: usize,
    pub(super) value: f64,
    pub(super) limit: f64,
}

impl Finding {
    /// The axis on which the value is farthest beyond its limit.
    fn worst(values: [f64; 3], limits: [f64; 3]) -> Option<Self> {
        let all = values.into_iter().zip(limits).enumerate();
        // A value that is no number is not known to be small.
        all.filter(|(_, (value, limit))| value.is_nan() || value > limit)
            .max_by(|(_, (a, b)), (_, (c, d))| (a / b).total_cmp(&(c / d)))
            .map(|(axis, (value, limit))| Self { axis, value, limit })
    }
}

/// Limits of one kind of window, for what is gathered in a second.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Scale {
    floor: f64,
    ceiling: f64,
    sigmas: f64,
    /// Whether a fall counts too.
    falls: bool,
}

impl Scale {
    /// Both ways; `quantum` is what one count is worth.
    pub(super) fn new(floor: f64, ceiling: f64, sigmas: f64, quantum: f64) -> Self {
        let floor = floor.max(COUNTS * quantum);
        Self { floor, ceiling: ceiling.max(floor), sigmas, falls: true }
    }

    /// Growth only, and without a ceiling.
    pub(super) fn one_sided(floor: f64, sigmas: f64, quantum: f64) -> Self {
        Self { falls: false, ..Self::new(floor, f64::INFINITY, sigmas, quantum) }
    }

    /// Limit for windows whose standard deviation is `sigma`.
    fn limit(&self, sigma: f64) -> f64 {
        self.floor.max(self.sigmas * sigma)
    }

    /// The same with another floor, where that is higher.
    pub(super) fn at_least(self, floor: f64) -> Self {
        Self { floor: self.floor.max(floor), ..self }
    }

    fn size(&self, deviation: f64) -> f64 {
        if self.falls { deviation.abs() } else { deviation }
    }
}

/// Means of windows in the order in which they came.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Track {
    /// The last windows.
    recent: Recent<[f64; 3], RECENT>,
    learned: bool,
    /// The last window's deviation, times its length.
    last: [f64; 3],
    /// Windows that are no reference themselves, and came before there was one.
    held: ArrayVec<(Scale, [f64; 3], f64), HELD>,
    block: ([f64; 3], usize),
    blocks: ArrayVec<[f64; 3], BLOCKS>,
    first_minute: Option<[f64; 3]>,
}

impl Track {
    pub(super) fn is_empty(&self) -> bool {
        self.recent.is_empty()
    }

    pub(super) fn has_learned(&self) -> bool {
        self.learned
    }

    /// What comes does not continue what came.
    pub(super) fn cut(&mut self) {
        self.last = [0.0; 3];
    }

    /// Takes a window that is no reference for others; says where it does not belong to them.
    pub(super) fn take_aside(&mut self, scale: &Scale, mean: [f64; 3], duration_s: f64) -> Option<Finding> {
        if self.learned {
            return self.judge(scale, mean, duration_s);
        }
        // Beyond a handful the modes change too fast for anything to be learned at all.
        let _ = self.held.try_push((*scale, mean, duration_s));
        None
    }

    /// Takes a full window; says where it does not belong to those before it.
    pub(super) fn take(&mut self, scale: &Scale, mean: [f64; 3], duration_s: f64) -> Option<Finding> {
        if !self.learned {
            self.remember(mean);
            return if self.recent.len() < LEARNING { None } else { self.learn(scale) };
        }
        if let Some(finding) = self.judge(scale, mean, duration_s) {
            return Some(finding);
        }
        let usual = Usual::of(&self.recent);
        self.last = minus(mean, usual.mean).map(|deviation| deviation * duration_s);
        self.remember(mean);
        None
    }

    /// Says where a window, alone or together with the one before it, does not belong to those before it.
    fn judge(&self, scale: &Scale, mean: [f64; 3], duration_s: f64) -> Option<Finding> {
        let usual = Usual::of(&self.recent);
        let own = minus(mean, usual.mean).map(|deviation| deviation * duration_s);
        // The reference has an error too.
        let noise = libm::sqrt(1.0 + 1.0 / usual.count);
        let limits = usual.sigma.map(|sigma| scale.limit(sigma * noise));
        if let Some(finding) = Finding::worst(own.map(|own| scale.size(own)), limits) {
            return Some(finding);
        }
        let both = plus(own, self.last);
        let limits = usual.sigma.map(|sigma| scale.limit(sigma * noise * SQRT_2));
        Finding::worst(both.map(|both| scale.size(both)), limits)
    }

    /// Says on which axis noise hides what must be seen.
    pub(super) fn restless(&self, scale: &Scale) -> Option<Finding> {
        if !self.learned {
            return None;
        }
        let sigma = Usual::of(&self.recent).sigma;
        Finding::worst(sigma.map(|sigma| scale.sigmas * sigma), [scale.ceiling; 3])
    }

    /// Says on which axis the mean itself is too large.
    pub(super) fn large(&self, limit: f64) -> Option<Finding> {
        self.learned.then(|| Finding::worst(Usual::of(&self.recent).mean.map(f64::abs), [limit; 3]))?
    }

    /// Deviation of the last minute from the minutes before, times a minute; looked at whenever a block is complete.
    pub(super) fn drift_since_before(&self, scale: &Scale, floor: f64) -> Option<Finding> {
        let (before, minute) = self.last_minute()?;
        if before.len() < MINUTE {
            return None;
        }
        let change = minus(Usual::of(minute).mean, Usual::of(before).mean);
        self.drift(scale, change.map(|change| change * MINUTE_WINDOWS), floor, MINUTE_WINDOWS)
    }

    /// Deviation of the last minute's mean from that of the first; looked at whenever a block is complete.
    pub(super) fn drift_since_start(&self, scale: &Scale, floor: f64) -> Option<Finding> {
        let (_, minute) = self.last_minute()?;
        self.drift(scale, minus(Usual::of(minute).mean, self.first_minute?), floor, 1.0)
    }

    /// The blocks before the last minute, and those in it; `None` while a block is open.
    fn last_minute(&self) -> Option<(Windows<'_>, Windows<'_>)> {
        let before = self.blocks.len().checked_sub(MINUTE).filter(|_| self.block.1 == 0)?;
        self.blocks.split_at_checked(before)
    }

    /// Judges the change of a minute's mean, which stands `times` that mean's unit of measure.
    fn drift(&self, scale: &Scale, change: [f64; 3], floor: f64, times: f64) -> Option<Finding> {
        // Two means of a minute, each of windows of a second.
        let noise = times * SQRT_2 / libm::sqrt(MINUTE_WINDOWS);
        let limits = Usual::of(&self.recent).sigma.map(|sigma| floor.max(scale.sigmas * sigma * noise));
        Finding::worst(change.map(f64::abs), limits)
    }

    /// Judges the first windows together: by medians, so that one that does not belong to them does not hide itself.
    fn learn(&mut self, scale: &Scale) -> Option<Finding> {
        self.learned = true;
        let axes = [0, 1, 2].map(|axis| {
            let windows = self.recent.iter().take(LEARNING);
            let mut away: ArrayVec<f64, LEARNING> = windows.map(|window| window[axis]).collect();
            let middle = median(&mut away.clone());
            away.iter_mut().for_each(|away| *away -= middle);
            let mut sizes: ArrayVec<f64, LEARNING> = away.iter().map(|away| away.abs()).collect();
            let sigma = LEARNING_FACTOR * SIGMA_PER_MEDIAN * median(&mut sizes);
            let largest = away.iter().map(|away| scale.size(*away)).fold(0.0, f64::max);
            let pairs = away.iter().zip(away.iter().skip(1)).map(|(a, b)| scale.size(a + b));
            (sigma, largest, pairs.fold(0.0, f64::max))
        });
        let limits = |times: f64| axes.map(|(sigma, ..)| scale.limit(sigma * times));
        Finding::worst(axes.map(|(_, single, _)| single), limits(1.0))
            .or_else(|| Finding::worst(axes.map(|(.., pair)| pair), limits(SQRT_2)))
            .or_else(|| {
                self.held.iter().find_map(|(scale, mean, duration_s)| self.judge(scale, *mean, *duration_s))
            })
    }

    fn remember(&mut self, mean: [f64; 3]) {
        self.recent.push(mean);
        let (sum, count) = &mut self.block;
        *sum = plus(*sum, mean);
        *count += 1;
        if *count < BLOCK {
            return;
        }
        let (sum, _) = core::mem::take(&mut self.block);
        if self.blocks.is_full() {
            self.blocks.remove(0);
        }
        self.blocks.push(sum.map(|sum| sum / BLOCK_WINDOWS));
        if self.first_minute.is_none() && self.blocks.len() == MINUTE {
            self.first_minute = Some(Usual::of(&self.blocks).mean);
        }
    }
}

/// Mean and standard deviation per axis.
struct Usual {
    mean: [f64; 3],
    sigma: [f64; 3],
    count: f64,
}

impl Usual {
    fn of(windows: Windows<'_>) -> Self {
        let mut count = 0.0;
        let mut mean = [0.0; 3];
        for window in windows {
            count += 1.0;
            mean = plus(mean, *window);
        }
        mean = mean.map(|sum| sum / count);
        let mut sigma = [0.0; 3];
        for window in windows {
            sigma = plus(sigma, minus(*window, mean).map(|away| away * away));
        }
        Self { mean, sigma: sigma.map(|squares| libm::sqrt(squares / (count - 1.0))), count }
    }
}

/// The middle value; the upper one of two.
fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
