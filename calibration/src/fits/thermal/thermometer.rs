//! The noise of thermometers, taken out of what a fit is made with.
//!
//! A fit to noisy temperatures finds terms that are too small, most of all those that answer fast: the noise is taken for temperature
//! that the sensor did not answer (errors in variables). A fit, other than a service, knows what came later, and can smooth both ways.
//! Here that is a local polynomial of second order [Savitzky and Golay 1964], over the longest of several stretches whose
//! estimate still agrees with those of all shorter ones within the noise [the intersection of confidence intervals, Goldenshluger and
//! Nemirovski 1997]: long on plateaus and ramps, none at all where a ramp begins.

use crate::lsq::local::parabola;
use crate::numbers::{SIGMA_PER_MAD, ends, median, median_if_any, real};

/// Length of the bins whose means are smoothed (s); one reading where they come more seldom.
const BIN_S: f64 = 2.0;
/// Half widths that are tried (s).
const HALF_WIDTHS_S: [f64; 6] = [8.0, 16.0, 32.0, 64.0, 128.0, 192.0];
/// Fewest bins of a stretch.
const FEWEST_BINS: usize = 7;
/// Half width of a confidence interval (standard deviations).
const CONFIDENCE: f64 = 2.5;
/// A distance of bins beyond which nothing is smoothed (bins).
const GAP_BINS: f64 = 4.0;
/// A reading this far from its neighbours is a spike, which the service refuses (robust standard deviations).
const SPIKE: f64 = 8.0;
/// Standard deviation of the third difference of white noise, over that of the noise: √(1 + 9 + 9 + 1).
const THIRD_DIFFERENCE: f64 = 4.472_135_954_999_579;

/// Mean of some readings.
#[derive(Debug, Clone, Copy)]
struct Bin {
    time_s: f64,
    mean: f64,
}

/// A polynomial about the middle of a bin.
#[derive(Debug, Clone, Copy)]
struct Local {
    time_s: f64,
    coefficients: [f64; 3],
}

/// Readings of a thermometer (as it has them: V, counts or °C) at times (s), without their noise. What is no number stays none;
/// spikes, and readings that come again or too late, stay as they are. Beside them the standard deviation of the white noise of a reading,
/// zero for too few.
pub fn without_noise(time_s: &[f64], readings: &[f64]) -> (Vec<f64>, f64) {
    let rows = sound(time_s, readings);
    let bins = bins(&rows, time_s, readings);
    let good: Vec<f64> = rows.iter().map(|&row| readings[row]).collect();
    let Some(sigma) = sigma(&bins, &good) else { return (readings.to_vec(), 0.0) };
    let in_a_bin = real(rows.len()) / real(bins.len().max(1));
    let locals: Vec<Option<Local>> = (0..bins.len()).map(|bin| local(&bins, bin, sigma)).collect();
    let mut smoothed = readings.to_vec();
    let mut behind = 0;
    for row in rows {
        let time = time_s[row];
        while bins.get(behind).is_some_and(|bin| bin.time_s <= time) {
            behind += 1;
        }
        let of =
            |bin: usize| locals.get(bin).copied().flatten().map_or(readings[row], |local| local.at(time));
        let (before, after) = (behind.saturating_sub(1), behind.min(bins.len() - 1));
        // From one bin's polynomial to the next one's without a step.
        let length = bins[after].time_s - bins[before].time_s;
        let share = if length > 0.0 { ((time - bins[before].time_s) / length).clamp(0.0, 1.0) } else { 0.0 };
        smoothed[row] = (1.0 - share) * of(before) + share * of(after);
    }
    (smoothed, sigma * in_a_bin.sqrt())
}

/// Rows of readings that are neither spikes nor repeated.
fn sound(time_s: &[f64], readings: &[f64]) -> Vec<usize> {
    let mut rows: Vec<usize> = Vec::with_capacity(readings.len());
    for row in 0..readings.len().min(time_s.len()) {
        let goes_on = rows.last().is_none_or(|last| time_s[row] > time_s[*last]);
        if goes_on && readings[row].is_finite() && !is_spike(readings, row) {
            rows.push(row);
        }
    }
    rows
}

impl Local {
    fn at(&self, time_s: f64) -> f64 {
        let away = time_s - self.time_s;
        let [a, b, c] = self.coefficients;
        a + away * (b + away * c)
    }
}

/// Whether a reading stands far from those beside it, beyond what they move.
fn is_spike(readings: &[f64], row: usize) -> bool {
    const BESIDE: usize = 3;
    let others: Vec<f64> = (row.saturating_sub(BESIDE)..(row + BESIDE + 1).min(readings.len()))
        .filter(|other| *other != row && readings[*other].is_finite())
        .map(|other| readings[other])
        .collect();
    let Some(middle) = median_if_any(&others) else { return false };
    let [low, high] = ends(others.iter().copied());
    let away = |x: f64| (x - middle).abs();
    away(readings[row]) > SPIKE * SIGMA_PER_MAD * median(&others.iter().map(|x| away(*x)).collect::<Vec<_>>())
        && away(readings[row]) > 2.0 * (high - low)
}

fn bins(rows: &[usize], time_s: &[f64], readings: &[f64]) -> Vec<Bin> {
    let bin = |rows: &[usize]| {
        let count = real(rows.len());
        Bin {
            time_s: rows.iter().map(|&row| time_s[row]).sum::<f64>() / count,
            mean: rows.iter().map(|&row| readings[row]).sum::<f64>() / count,
        }
    };
    let mut bins = Vec::new();
    let mut from = 0;
    for to in 1..=rows.len() {
        let over = |&row: &usize| time_s[row] - time_s[rows[from]] >= BIN_S;
        if rows.get(to).is_none_or(over) {
            bins.push(bin(&rows[from..to]));
            from = to;
        }
    }
    bins
}

/// Standard deviation of a bin's mean: by the middle third difference, and at least by the resolution of the readings; `None` for too
/// few bins.
fn sigma(bins: &[Bin], readings: &[f64]) -> Option<f64> {
    let differences: Vec<f64> = bins
        .windows(4)
        .map(|four| (four[3].mean - 3.0 * four[2].mean + 3.0 * four[1].mean - four[0].mean).abs())
        .collect();
    let noise = SIGMA_PER_MAD * median_if_any(&differences)? / THIRD_DIFFERENCE;
    let steps = readings.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0);
    let resolution = steps.fold(f64::INFINITY, f64::min);
    // Readings that never repeat have none.
    let repeat = readings.windows(2).filter(|pair| (pair[1] - pair[0]).abs() <= 0.0).count();
    let coarse = if 20 * repeat > readings.len() { resolution / 12.0_f64.sqrt() } else { 0.0 };
    Some(noise.max(coarse))
}

/// The polynomial over the longest stretch about a bin that agrees with all shorter ones; `None` where the readings themselves are best.
fn local(bins: &[Bin], at: usize, sigma: f64) -> Option<Local> {
    let middle = bins[at];
    let (mut low, mut high) = (middle.mean - CONFIDENCE * sigma, middle.mean + CONFIDENCE * sigma);
    let mut best = None;
    for half_width_s in HALF_WIDTHS_S {
        let Some((local, share)) = polynomial(bins, at, half_width_s) else { continue };
        let half = CONFIDENCE * sigma * share;
        (low, high) = (low.max(local.coefficients[0] - half), high.min(local.coefficients[0] + half));
        if low > high {
            break;
        }
        best = Some(local);
    }
    best
}

/// A polynomial of second order over a stretch, with the standard deviation of its middle over that of a bin.
fn polynomial(bins: &[Bin], at: usize, half_width_s: f64) -> Option<(Local, f64)> {
    let middle = bins[at].time_s;
    let (from, to) = (reach(bins, at, half_width_s, false), reach(bins, at, half_width_s, true));
    let near = bins.get(from..=to)?;
    // One-sided stretches extrapolate.
    if near.len() < FEWEST_BINS || (at - from).min(to - at) * 4 < near.len() {
        return None;
    }
    let points = near.iter().map(|bin| [bin.time_s - middle, bin.mean]);
    let (coefficients, share) = parabola(points, half_width_s)?;
    Some((Local { time_s: middle, coefficients }, share))
}

/// The last bin of a stretch on one side: within its half width, and not behind a gap.
fn reach(bins: &[Bin], at: usize, half_width_s: f64, forwards: bool) -> usize {
    let mut last = at;
    loop {
        let next = if forwards { last + 1 } else { last.wrapping_sub(1) };
        let Some(bin) = bins.get(next) else { return last };
        let usual = BIN_S.max((bins[at].time_s - bins[at.saturating_sub(1)].time_s).abs());
        let gap = (bin.time_s - bins[last].time_s).abs() > GAP_BINS * usual;
        if gap || (bin.time_s - bins[at].time_s).abs() >= half_width_s {
            return last;
        }
        last = next;
    }
}

#[expect(clippy::cast_precision_loss, reason = "small numbers")]
#[cfg(test)]
mod tests {
    use super::*;

    /// Twenty minutes at 20 °C, 40 °C up within 40 min, and forty minutes there; `noise` and a resolution on top (°C).
    fn chamber(noise: f64, resolution: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let time: Vec<f64> = (0..6000).map(f64::from).collect();
        let truth: Vec<f64> = time.iter().map(|t| 20.0 + ((t - 1200.0) / 60.0).clamp(0.0, 40.0)).collect();
        let mut normal = crate::fixture::noise();
        let shown = truth.iter().map(|truth| {
            let shown = truth + noise * normal();
            if resolution > 0.0 { (shown / resolution).round() * resolution } else { shown }
        });
        let shown = shown.collect();
        (time, truth, shown)
    }

    fn rms(a: &[f64], b: &[f64]) -> f64 {
        (a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / a.len() as f64).sqrt()
    }

    #[test]
    fn noise_goes_and_the_corners_stay() {
        for (noise, resolution) in [(0.004, 0.0), (0.004, 0.01), (0.05, 0.0)] {
            let (time, truth, shown) = chamber(noise, resolution);
            let (smoothed, found) = without_noise(&time, &shown);
            let (before, after) = (rms(&shown, &truth), rms(&smoothed, &truth));
            assert!((found / before - 1.0).abs() < 0.2, "{found} {before}");
            assert!(after < 0.4 * before, "{noise} {resolution}: {before} → {after}");
            let corner = |of: &[f64]| rms(&of[1180..1220], &truth[1180..1220]);
            assert!(corner(&smoothed) < 2.0 * corner(&shown), "{noise}: {}", corner(&smoothed));
        }
    }

    #[test]
    fn what_has_no_noise_or_steps_of_its_own_hardly_changes() {
        for resolution in [0.0, 0.0625] {
            let (time, truth, shown) = chamber(0.0, resolution);
            let (smoothed, _) = without_noise(&time, &shown);
            let (before, after) = (rms(&shown, &truth), rms(&smoothed, &truth));
            assert!(after < before + 1e-3, "{resolution}: {before} → {after}");
        }
    }

    #[test]
    fn spikes_repeats_and_what_is_no_number_stay_and_spoil_nothing() {
        let (mut time, _, mut shown) = chamber(0.004, 0.0);
        let (sound, _) = without_noise(&time, &shown);
        (shown[700], shown[900]) = (85.0, f64::NAN);
        let (smoothed, _) = without_noise(&time, &shown);
        assert!((smoothed[700] - 85.0).abs() < 1e-12 && smoothed[900].is_nan());
        assert!((smoothed[703] - sound[703]).abs() < 0.003, "{} {}", smoothed[703], sound[703]);
        // The same reading once more.
        (shown, time) = (chamber(0.004, 0.0).2, time);
        shown.insert(2001, shown[2000]);
        time.insert(2001, time[2000]);
        let (mut smoothed, _) = without_noise(&time, &shown);
        smoothed.remove(2001);
        assert_eq!(smoothed, sound);
        assert_eq!(without_noise(&[0.0, 1.0], &[20.0, 20.1]).0, [20.0, 20.1], "too few");
    }
}
