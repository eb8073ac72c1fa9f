//! Outputs of a corrected run, averaged over windows of equal length, beside the temperatures of the time.

use std::collections::BTreeMap;

use isotherm_correction::earth::LEVELLING_TOLERANCE;
use isotherm_correction::sample::{CorrectedTick, SensorFlags};
use isotherm_correction::unit::Unit;
use isotherm_correction::units::{AngularRate, STANDARD_GRAVITY_M_PER_S2, Timestamp};
use isotherm_log::offline::Loaded;

use crate::error::Error;
use crate::run::{Run, Troubles, Watch};

/// Mean outputs along the case axes by window. A window without a good tick of a sensor, or with a gap, has no number there.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Means {
    /// Length of a window (s).
    pub window_s: f64,
    /// Middle of each window since the run's first tick (s).
    pub time_s: Vec<f64>,
    /// Mean rate about each axis (°/h).
    pub rate_deg_per_h: [Vec<f64>; 3],
    /// Mean specific force along each axis (m/s²).
    pub force_m_per_s2: [Vec<f64>; 3],
    /// Smoothed temperatures by channel, as they were applied at the window's end (°C).
    pub temperature_deg_c: BTreeMap<String, Vec<f64>>,
    /// What the correction passed over.
    pub troubles: Troubles,
}

/// Whether the mean specific force of a unit at rest has the size of gravity (m/s²), within [`LEVELLING_TOLERANCE`].
#[must_use]
pub fn is_one_g(size: f64) -> bool {
    (size / STANDARD_GRAVITY_M_PER_S2 - 1.0).abs() <= LEVELLING_TOLERANCE
}

/// Length of the windows that what is left is stated over (s), for runs as long as the longest of some: in long runs several of
/// `shortest_s`, so that white noise does not hide what they are about. `thermal` and `validate` have it from here.
#[must_use]
pub fn usual_window_s(longest_run_s: f64, shortest_s: f64) -> f64 {
    const WINDOWS_OF_A_RUN: f64 = 200.0;
    const MOST: f64 = 10.0;
    shortest_s * libm::floor(longest_run_s / (WINDOWS_OF_A_RUN * shortest_s)).clamp(1.0, MOST)
}

/// Size of a set of numbers; those that are no number are left out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Size {
    /// How many there are.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// Standard deviation about the mean.
    pub deviation: f64,
    /// Largest less smallest.
    pub peak_to_peak: f64,
}

impl Size {
    /// Of some values; zero without any.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "windows of a log are far below 2⁵³")]
    pub fn of(values: &[f64]) -> Self {
        let good = || values.iter().copied().filter(|value| value.is_finite());
        let count = good().count();
        if count == 0 {
            return Self::default();
        }
        let mean = good().sum::<f64>() / count as f64;
        let about =
            |centre: f64| (good().map(|x| (x - centre) * (x - centre)).sum::<f64>() / count as f64).sqrt();
        let (low, high) =
            good().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        Self { count, mean, rms: about(0.0), deviation: about(mean), peak_to_peak: high - low }
    }
}

/// What gathers in one window.
#[derive(Debug, Default)]
struct Window {
    begin: Option<Timestamp>,
    filled_s: f64,
    sums: [f64; 6],
    good_s: [f64; 6],
    broken: bool,
}

impl Means {
    /// Corrects a run and averages what comes out.
    ///
    /// # Errors
    /// As [`Run::correct`].
    pub fn of(run: &Run, loaded: &Loaded, window_s: f64, watch: impl Watch) -> Result<Self, Error> {
        let mut means = Self { window_s, ..Self::default() };
        let mut window = Window::default();
        let mut first = None;
        let troubles = run.correct(loaded, watch, |tick, unit| {
            let begin = Timestamp::from_ns(tick.end_time.as_ns().saturating_sub(tick.duration.as_ns()));
            let first = *first.get_or_insert(begin);
            window.take(tick, begin);
            if window.filled_s > window_s - 0.5 * tick.duration.as_s() {
                means.close(&std::mem::take(&mut window), first, unit);
            }
        })?;
        means.troubles = troubles;
        Ok(means)
    }

    /// Axis 0…2.
    #[must_use]
    pub fn rate(&self, axis: usize) -> &[f64] {
        self.rate_deg_per_h.get(axis).map_or(&[], Vec::as_slice)
    }

    /// Axis 0…2.
    #[must_use]
    pub fn force(&self, axis: usize) -> &[f64] {
        self.force_m_per_s2.get(axis).map_or(&[], Vec::as_slice)
    }

    fn close(&mut self, window: &Window, first: Timestamp, unit: &Unit) {
        let Some(begin) = window.begin else { return };
        #[expect(clippy::cast_precision_loss, reason = "a run is far below 2⁵³ ns")]
        let since_s = begin.as_ns().saturating_sub(first.as_ns()) as f64 * 1e-9;
        self.time_s.push(since_s + 0.5 * window.filled_s);
        let columns = self.rate_deg_per_h.iter_mut().chain(&mut self.force_m_per_s2);
        for (index, (column, (sum, good_s))) in
            columns.zip(window.sums.into_iter().zip(window.good_s)).enumerate()
        {
            let whole = !window.broken && good_s > 0.999 * window.filled_s;
            let mean = if whole { sum / good_s } else { f64::NAN };
            column.push(if index < 3 { AngularRate::from_rad_per_s(mean).as_deg_per_h() } else { mean });
        }
        let count = self.time_s.len();
        for channel in unit.channels() {
            let column = self.temperature_deg_c.entry(channel.name.to_string()).or_default();
            column.resize(count - 1, f64::NAN);
            column.push(channel.state.filter(|_| !channel.stale).map_or(f64::NAN, |state| state.temperature));
        }
        // A channel that is no longer there has no number.
        self.temperature_deg_c.values_mut().for_each(|column| column.resize(count, f64::NAN));
    }
}

impl Window {
    fn take(&mut self, tick: &CorrectedTick, begin: Timestamp) {
        let seconds = tick.duration.as_s();
        self.broken |= self.begin.is_some() && tick.missed > 0;
        self.begin.get_or_insert(begin);
        self.filled_s += seconds;
        let increments = tick.delta_angle.into_iter().chain(tick.delta_velocity);
        for (index, increment) in increments.enumerate() {
            let flags = if index < 3 { &tick.gyro_flags } else { &tick.accel_flags };
            let good = !flags.is_empty() && flags.iter().all(|flags| flags.contains(SensorFlags::VALID));
            if let (true, Some(sum), Some(good_s)) =
                (good, self.sums.get_mut(index), self.good_s.get_mut(index))
            {
                *sum += increment;
                *good_s += seconds;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::simulated;
    use crate::written::Written;

    #[test]
    fn windows_hold_the_mean_of_their_ticks() {
        let scenario = isotherm_simulator::presets::mems_chamber(1);
        let scenario = isotherm_simulator::Scenario { duration_s: 60.0, ..scenario };
        let mut truth = [0.0; 3];
        let run = simulated(&scenario, |step| {
            truth.iter_mut().zip(step.truth.delta_velocity).for_each(|(sum, delta)| *sum += delta);
        });
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
        let written = Written::read(path.as_ref()).unwrap();
        let means = Means::of(&run, &written.loaded, 10.0, ()).unwrap();
        let middles = [5.0, 15.0, 25.0, 35.0, 45.0, 55.0];
        assert!(means.time_s.iter().zip(middles).all(|(time, middle)| (time - middle).abs() < 1e-9));
        for (axis, truth) in truth.iter().enumerate() {
            let mean = Size::of(means.force(axis)).mean;
            assert!((mean - truth / 60.0).abs() < 0.02, "axis {axis}: {mean} {}", truth / 60.0);
        }
        assert!(
            means
                .temperature_deg_c
                .values()
                .all(|column| column.len() == 6 && column.iter().all(|t| t.is_finite()))
        );
        let bare = written.document.nominal();
        let before = Means::of(&run, &Written::of(&bare).unwrap().loaded, 10.0, ()).unwrap();
        assert_ne!(before.rate(0), means.rate(0), "the bias is in one of them");
        assert_eq!(run.series(()).unwrap().gyros.len(), 60 * 100);
    }

    #[test]
    fn what_is_no_number_is_no_part_of_a_size() {
        let size = Size::of(&[1.0, f64::NAN, 3.0]);
        assert_eq!((size.count, size.mean, size.deviation, size.peak_to_peak), (2, 2.0, 1.0, 2.0));
        assert_eq!(Size::of(&[]), Size::default());
    }
}
