//! Plateaus, ramps between turning points, and the pieces that cross-validation leaves out.

use crate::numbers::{ends, median, percentile, real};

/// Share of the range of temperature by which a turning point must stand out.
const STANDS_OUT: f64 = 0.1;
/// Slowest change that is no plateau (°C/s), 0.1 °C/min, and its share of the fastest.
const PLATEAU_DEG_C_PER_S: f64 = 0.1 / 60.0;
const PLATEAU_SHARE: f64 = 0.06;
/// Shortest plateau (s).
const PLATEAU_S: f64 = 180.0;
/// Windows on either side that a slope is taken over.
const REACH: usize = 6;
/// Pieces of a branch, by temperature.
pub const PIECES: usize = 4;

/// A stretch of nearly constant temperature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plateau {
    /// Mean temperature (°C).
    pub deg_c: f64,
    /// Length (s).
    pub length_s: f64,
}

/// A stretch between two turning points, holds included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    /// First and last temperature (°C).
    pub from_to_deg_c: [f64; 2],
    /// Fastest change in it (°C/min), with its sign.
    pub deg_c_per_min: f64,
}

/// The thermal history of all windows of a fit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct History {
    /// Plateaus, in order of time.
    pub plateaus: Vec<Plateau>,
    /// Ramps, in order of time.
    pub ramps: Vec<Ramp>,
    /// By window: whether it is on a plateau and has been there for two fifths of it.
    pub at_rest: Vec<bool>,
    /// By window: the piece that it belongs to; pieces are numbered from 0.
    pub piece: Vec<usize>,
    /// By window: its ramp.
    pub ramp: Vec<usize>,
    /// Smallest and largest temperature (°C).
    pub range_deg_c: [f64; 2],
    /// Fastest cooling and heating (°C/s).
    pub rate_range_deg_c_per_s: [f64; 2],
}

impl History {
    /// Of runs one after the other: each run's windows with their temperatures (°C).
    pub fn of(runs: &[(&[f64], f64)]) -> Self {
        let all = runs.iter().flat_map(|(t, _)| t.iter().copied()).filter(|t| t.is_finite());
        let mut history = Self { range_deg_c: ends(all), ..Self::default() };
        let slopes: Vec<Vec<f64>> = runs.iter().map(|(t, window)| slopes(t, *window)).collect();
        let fastest = percentile(slopes.iter().flatten().map(|slope| slope.abs()), 98);
        let limit = (PLATEAU_SHARE * fastest).min(PLATEAU_DEG_C_PER_S);
        for ((temperature, window_s), slopes) in runs.iter().zip(&slopes) {
            history.add(temperature, *window_s, slopes, limit);
        }
        let known = slopes.iter().flatten().copied().filter(|slope| slope.is_finite());
        history.rate_range_deg_c_per_s = ends([0.0].into_iter().chain(known));
        history
    }

    fn add(&mut self, temperature: &[f64], window_s: f64, slopes: &[f64], limit: f64) {
        let first = self.at_rest.len();
        self.at_rest.extend(slopes.iter().map(|slope| slope.abs() < limit));
        let mut from = 0;
        while from < temperature.len() {
            let rest = self.at_rest[first + from];
            let mut to = from;
            while to < temperature.len() && self.at_rest[first + to] == rest {
                to += 1;
            }
            let (count, length_s) = (real(to - from), real(to - from) * window_s);
            if rest && length_s >= PLATEAU_S {
                let deg_c = temperature[from..to].iter().sum::<f64>() / count;
                self.plateaus.push(Plateau { deg_c, length_s });
                // The inside of a coil comes to rest long after its thermometer.
                let settling = (to - from) * 2 / 5;
                self.at_rest[first + from..first + from + settling].fill(false);
            } else if rest {
                self.at_rest[first + from..first + to].fill(false);
            }
            from = to;
        }
        let stands_out = (STANDS_OUT * (self.range_deg_c[1] - self.range_deg_c[0])).max(0.5);
        for [from, to] in between_turns(temperature, stands_out) {
            let (index, piece) = (self.ramps.len(), self.ramps.len() * PIECES);
            let part = &temperature[from..to];
            // Before the first reading there is no temperature.
            let known = || part.iter().copied().filter(|t| t.is_finite());
            let [low, high] = ends(known());
            for &t in part {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a share of a few"
                )]
                let third = ((t - low) / (high - low).max(1e-9) * real(PIECES)).clamp(0.0, real(PIECES) - 1.0)
                    as usize;
                self.piece.push(piece + third);
                self.ramp.push(index);
            }
            let steepest = slopes[from..to].iter().copied().filter(|s| s.is_finite());
            let steepest = steepest.fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
            let ends = [known().next(), known().next_back()].map(|t| t.unwrap_or(f64::NAN));
            self.ramps.push(Ramp { from_to_deg_c: ends, deg_c_per_min: steepest * 60.0 });
        }
    }

    /// Number of plateaus whose temperatures differ by a tenth of the range and more.
    pub fn levels(&self) -> usize {
        let apart = (STANDS_OUT * (self.range_deg_c[1] - self.range_deg_c[0])).max(0.5);
        let mut levels: Vec<f64> = Vec::new();
        for plateau in &self.plateaus {
            if levels.iter().all(|level| (level - plateau.deg_c).abs() > apart) {
                levels.push(plateau.deg_c);
            }
        }
        levels.len()
    }

    /// Whether there are ramps upwards and downwards that cross a good part of the range.
    pub fn both_directions(&self) -> bool {
        let span = 0.2 * (self.range_deg_c[1] - self.range_deg_c[0]);
        let moves = |sign: f64| {
            self.ramps.iter().any(|ramp| sign * (ramp.from_to_deg_c[1] - ramp.from_to_deg_c[0]) > span)
        };
        moves(1.0) && moves(-1.0)
    }

    /// Whether the log can tell several lags, and gains that follow temperature, from the static bias: by what stands still at
    /// two levels, or by a third pass. Two passes alone fit any hysteresis with them, and the next run none.
    pub fn tells_dynamics(&self) -> bool {
        self.levels() >= 2 || self.passes() >= 3
    }

    /// How often the middle temperatures were crossed: the median over the range.
    pub fn passes(&self) -> usize {
        let [low, high] = self.range_deg_c;
        let counts: Vec<f64> = (1..10)
            .map(|tenth| {
                let at = low + (high - low) * f64::from(tenth) / 10.0;
                let crossed = self.ramps.iter().filter(|ramp| {
                    let [a, b] = ramp.from_to_deg_c;
                    (a.min(b)..=a.max(b)).contains(&at)
                });
                real(crossed.count())
            })
            .collect();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
        let passes = median(&counts) as usize;
        passes
    }
}

/// Change of temperature at each window (°C/s), over its neighbours.
fn slopes(temperature: &[f64], window_s: f64) -> Vec<f64> {
    let last = temperature.len().saturating_sub(1);
    let slope = |at: usize| {
        let (from, to) = (at.saturating_sub(REACH), (at + REACH).min(last));
        let over = real((to - from).max(1)) * window_s;
        (temperature[to] - temperature[from]) / over
    };
    (0..temperature.len()).map(slope).collect()
}

/// Stretches between turning points that stand out, the first beginning at 0 and the last ending at the end.
fn between_turns(temperature: &[f64], stands_out: f64) -> Vec<[usize; 2]> {
    let mut ends = vec![0];
    let (mut low, mut high) = ((0, f64::INFINITY), (0, f64::NEG_INFINITY));
    let mut upwards: Option<bool> = None;
    for (at, &t) in temperature.iter().enumerate() {
        if t < low.1 {
            low = (at, t);
        }
        if t > high.1 {
            high = (at, t);
        }
        if upwards != Some(false) && t < high.1 - stands_out {
            if upwards == Some(true) {
                ends.push(high.0);
            }
            upwards = Some(false);
            low = (at, t);
        } else if upwards != Some(true) && t > low.1 + stands_out {
            if upwards == Some(false) {
                ends.push(low.0);
            }
            upwards = Some(true);
            high = (at, t);
        }
    }
    ends.push(temperature.len());
    ends.dedup();
    ends.windows(2).map(|pair| [pair[0], pair[1]]).collect()
}

#[expect(clippy::cast_precision_loss, reason = "small numbers")]
#[cfg(test)]
mod tests {
    use super::*;

    fn profile() -> Vec<f64> {
        let mut t = vec![20.0; 60];
        let mut go = |to: f64, windows: usize| {
            let from = *t.last().unwrap();
            t.extend((1..=windows).map(|i| from + (to - from) * i as f64 / windows as f64));
        };
        go(-40.0, 360);
        go(-40.0, 120);
        go(60.0, 600);
        go(60.0, 120);
        go(20.0, 240);
        t
    }

    #[test]
    fn plateaus_and_turning_points_of_a_chamber_cycle_are_found() {
        let t = profile();
        let history = History::of(&[(&t, 10.0)]);
        let levels: Vec<f64> = history.plateaus.iter().map(|plateau| plateau.deg_c.round()).collect();
        assert_eq!(levels, [20.0, -40.0, 60.0], "{:?}", history.plateaus);
        assert_eq!((history.levels(), history.ramps.len()), (3, 3));
        assert!(history.both_directions() && history.passes() == 2, "{}", history.passes());
        assert_eq!(history.piece.len(), t.len());
        assert!((history.ramps[1].deg_c_per_min - 1.0).abs() < 0.02, "{:?}", history.ramps);
    }

    #[test]
    fn one_ramp_is_one_direction() {
        let t: Vec<f64> = (0..300).map(|i| 20.0 + 0.1 * f64::from(i)).collect();
        let history = History::of(&[(&t, 10.0)]);
        assert!(!history.both_directions() && history.plateaus.is_empty() && history.ramps.len() == 1);
    }
}
