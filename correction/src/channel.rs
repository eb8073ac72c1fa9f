//! One temperature channel: raw reading → gated, smoothed temperature and its derivatives (models §1).
//!
//! Readings are resampled onto a grid of absolute event time, so that neither the moment at which a unit
//! appears nor the grouping of readings into messages can change a result. Fit and service share the grid, the
//! smoothing and the derivative step, because all three are part of the calibration.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use crate::sample::ChannelName;
use crate::units::{Span, Timestamp};

/// Most grid points over which a channel may be smoothed, or a derivative step may reach.
pub const MAX_GRID_POINTS: usize = 4096;
/// Readings whose median judges the next one.
const MEDIAN_READINGS: usize = 5;

/// Filter and derivative step of a calibration, in seconds of event time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThermalFilterParts {
    /// Step of the grid on which temperature is evaluated (s, 0.001…3600).
    pub grid_step_s: f64,
    /// Length of the causal moving average (s); rounded to whole grid points, at least one.
    pub smoothing_s: f64,
    /// h of the three-point backward differences (s); rounded to whole grid points, at least one.
    pub derivative_step_s: f64,
    /// Age at which a temperature counts as stale (s). A silence that is also longer than h/2 starts the channel anew.
    pub stale_after_s: f64,
    /// Half width of the blend between run-up and braking, in Ṫ·T̈ (°C²/s³).
    pub branch_dead_band: f64,
    /// Temperature that every term assumes before its channel's first reading, or without a channel (°C).
    pub assumed_deg_c: f64,
}

/// The compiled filter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ThermalFilter {
    pub(crate) grid_step: Span,
    pub(crate) smoothing_points: usize,
    pub(crate) derivative_points: usize,
    pub(crate) stale_after: Span,
    pub(crate) branch_dead_band: f64,
    pub(crate) assumed_deg_c: f64,
}

impl ThermalFilter {
    /// Compiles the parts; the caller has checked their ranges.
    pub(crate) fn new(parts: &ThermalFilterParts) -> Self {
        Self {
            grid_step: Span::from_ns(Span::from_s(parts.grid_step_s).as_ns().max(1)),
            smoothing_points: grid_points(parts.smoothing_s, parts.grid_step_s),
            derivative_points: grid_points(parts.derivative_step_s, parts.grid_step_s),
            stale_after: Span::from_s(parts.stale_after_s),
            branch_dead_band: parts.branch_dead_band,
            assumed_deg_c: parts.assumed_deg_c,
        }
    }

    /// h (s): the derivative step in whole grid points.
    fn derivative_step_s(&self) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "at most MAX_GRID_POINTS")]
        let points = self.derivative_points as f64;
        points * self.grid_step.as_s()
    }

    /// Longest silence that a straight line bridges: the stale limit, or h/2 where that is longer.
    ///
    /// Readings on both sides hold the line: over a silence G it errs by at most T̈·G²/8, always to the same side. With G = h/2 that
    /// moves Ṫ by at most T̈·h/16 and T̈ by a quarter. Starting anew would lose both whole, for the warm-up.
    fn longest_bridged(&self) -> Span {
        #[expect(clippy::cast_possible_wrap, reason = "at most MAX_GRID_POINTS")]
        let points = self.derivative_points as i64;
        self.stale_after.max(Span::from_ns(self.grid_step.as_ns().saturating_mul(points) / 2))
    }

    /// Grid points after a (re)start until the second derivative rests on readings alone.
    fn warm_up_points(&self) -> usize {
        self.smoothing_points + 4 * self.derivative_points
    }
}

/// Whole grid points in a length, at least one.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to 1…MAX_GRID_POINTS first"
)]
pub(crate) fn grid_points(length_s: f64, step_s: f64) -> usize {
    #[expect(clippy::cast_precision_loss, reason = "a small constant")]
    let most = MAX_GRID_POINTS as f64;
    libm::round(length_s / step_s).clamp(1.0, most) as usize
}

/// One channel of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelParts {
    /// Name, as on the raw temperature topic.
    pub name: ChannelName,
    /// `a_j` of `T = Σ a_j·Uʲ` (°C per raw unitʲ), one to eight of them.
    pub conversion: Vec<f64>,
    /// Physical range of the sensor (°C); a reading outside is rejected.
    pub range_deg_c: [f64; 2],
    /// Largest distance from the median of the last five readings (°C).
    pub spike_limit_deg_c: f64,
}

/// A compiled channel: it is its parts, once checked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Channel(pub(crate) ChannelParts);

impl Channel {
    /// Name of the channel.
    #[must_use]
    pub fn name(&self) -> &ChannelName {
        &self.0.name
    }

    /// Physical range of the sensor (°C).
    #[must_use]
    pub fn range_deg_c(&self) -> [f64; 2] {
        self.0.range_deg_c
    }

    /// Raw reading → °C, in nested form.
    #[must_use]
    pub fn convert(&self, raw: f64) -> f64 {
        self.0.conversion.iter().rev().fold(0.0, |sum, a| sum * raw + a)
    }
}

/// Temperature and its derivatives at a grid point.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ThermalState {
    /// T̄ (°C).
    pub temperature: f64,
    /// Ṫ (°C/s).
    pub rate: f64,
    /// T̈ (°C/s²).
    pub acceleration: f64,
}

/// What became of a reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Taken; the channel moved on by this many grid points (0 where it lies between two).
    Taken(usize),
    /// Taken as the first of a new series: after turn-on, a restart or a silence that nothing bridges.
    Restarted,
    /// Not finite, out of the sensor's range or a spike: the last value is held.
    Rejected,
    /// Not newer than the last one: ignored.
    OutOfOrder,
}

/// Memory of one channel.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct ChannelMemory {
    /// Last readings within the sensor's range, spikes included, so that a lasting step is believed after three.
    recent: VecDeque<f64>,
    /// Last reading of the present series.
    last: Option<(Timestamp, f64)>,
    /// Whether there was a reading ever, in this series or in one before.
    seen: bool,
    /// Last reading that was taken, as it came; of a channel that never took one, the last of all. No result rests on it.
    #[serde(skip)]
    raw: Option<f64>,
    rejected: bool,
    points_since_restart: usize,
    grid: VecDeque<f64>,
    smoothed: VecDeque<f64>,
    rates: VecDeque<f64>,
    state: ThermalState,
}

impl ChannelMemory {
    /// Makes the memory for a filter: the only place where a channel allocates.
    #[must_use]
    pub fn new(filter: &ThermalFilter) -> Self {
        let reach = 2 * filter.derivative_points + 1;
        Self {
            recent: VecDeque::with_capacity(MEDIAN_READINGS + 1),
            grid: VecDeque::with_capacity(filter.smoothing_points + 1),
            smoothed: VecDeque::with_capacity(reach + 1),
            rates: VecDeque::with_capacity(reach + 1),
            ..Self::default()
        }
    }

    /// The state at the last grid point, held over a restart; `None` before the first reading of all.
    #[must_use]
    pub fn state(&self) -> Option<ThermalState> {
        self.seen.then_some(self.state)
    }

    /// The last reading that was taken, as it came; of a channel that never took one, the last of all. `None` before the first,
    /// and where the memory was taken over from a snapshot.
    #[must_use]
    pub fn raw(&self) -> Option<f64> {
        self.raw
    }

    /// Whether the derivatives still rest on the assumption that nothing moved before the first reading.
    #[must_use]
    pub fn warming_up(&self, filter: &ThermalFilter) -> bool {
        self.points_since_restart < filter.warm_up_points()
    }

    /// Whether the value is missing, held over a rejected reading, or older than its limit at `time`.
    #[must_use]
    pub fn stale(&self, filter: &ThermalFilter, time: Timestamp) -> bool {
        time > self.fresh_until(filter)
    }

    /// The last time at which the value does not count as stale; before all time where it does already.
    #[must_use]
    pub fn fresh_until(&self, filter: &ThermalFilter) -> Timestamp {
        match self.last {
            Some((last, _)) if !self.rejected => last + filter.stale_after,
            _ => Timestamp::from_ns(i64::MIN),
        }
    }

    /// Forgets time, as after a step of the producer's clock.
    pub fn restart(&mut self) {
        self.last = None;
        self.recent.clear();
        self.points_since_restart = 0;
    }

    /// Takes one reading; `on_point` sees the state at each grid point that it completes.
    pub fn read(
        &mut self,
        channel: &Channel,
        filter: &ThermalFilter,
        time: Timestamp,
        raw: f64,
        mut on_point: impl FnMut(&ThermalState),
    ) -> Verdict {
        if self.last.is_some_and(|(last, _)| time <= last) {
            return Verdict::OutOfOrder;
        }
        let temperature = channel.convert(raw);
        let admitted = self.admit(channel, temperature);
        if admitted || !self.seen {
            self.raw = Some(raw);
        }
        self.rejected = !admitted;
        if self.rejected {
            return Verdict::Rejected;
        }
        self.seen = true;

        let step = filter.grid_step.as_ns();
        let last = self.last.replace((time, temperature));
        let last = last.filter(|(last, _)| time.since(*last) <= filter.longest_bridged());
        let Some((last_time, last_temperature)) = last else {
            self.refill(filter, temperature);
            on_point(&self.state);
            return Verdict::Restarted;
        };
        let (from, to) = (last_time.as_ns().div_euclid(step), time.as_ns().div_euclid(step));
        let span_s = time.seconds_from(last_time);
        let mut points = 0;
        for index in from + 1..=to {
            let grid_time = Timestamp::from_ns(index.saturating_mul(step));
            let share = grid_time.seconds_from(last_time) / span_s;
            self.push(filter, last_temperature + (temperature - last_temperature) * share);
            on_point(&self.state);
            points += 1;
        }
        Verdict::Taken(points)
    }

    /// Gates a reading against range and spikes.
    fn admit(&mut self, channel: &Channel, temperature: f64) -> bool {
        let [low, high] = channel.0.range_deg_c;
        if !(low..=high).contains(&temperature) {
            return false;
        }
        let is_far = |other: f64| (temperature - other).abs() > channel.0.spike_limit_deg_c;
        // The median is one of them: it is sought where not all are near.
        let spike = self.recent.iter().copied().any(is_far) && self.median().is_some_and(is_far);
        if self.recent.len() == MEDIAN_READINGS {
            self.recent.pop_front();
        }
        self.recent.push_back(temperature);
        !spike
    }

    /// Median of the last readings; the lower middle one where their number is even.
    fn median(&self) -> Option<f64> {
        let mut sorted: arrayvec::ArrayVec<f64, MEDIAN_READINGS> =
            self.recent.iter().copied().take(MEDIAN_READINGS).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        sorted.get(sorted.len().saturating_sub(1) / 2).copied()
    }

    /// Starts a new series as if the temperature had always been this.
    fn refill(&mut self, filter: &ThermalFilter, temperature: f64) {
        self.points_since_restart = 0;
        self.grid.clear();
        self.grid.resize(filter.smoothing_points, temperature);
        let reach = 2 * filter.derivative_points + 1;
        self.smoothed.clear();
        self.smoothed.resize(reach, temperature);
        self.rates.clear();
        self.rates.resize(reach, 0.0);
        self.state = ThermalState { temperature, rate: 0.0, acceleration: 0.0 };
    }

    /// Moves on by one grid point.
    fn push(&mut self, filter: &ThermalFilter, temperature: f64) {
        self.points_since_restart = self.points_since_restart.saturating_add(1);
        rotate(&mut self.grid, temperature);
        // Summed anew each time: a running sum would keep rounding errors for ever.
        #[expect(clippy::cast_precision_loss, reason = "at most MAX_GRID_POINTS")]
        let mean = self.grid.iter().sum::<f64>() / self.grid.len() as f64;
        rotate(&mut self.smoothed, mean);
        let h = filter.derivative_step_s();
        let rate = backward_difference(&self.smoothed, h);
        rotate(&mut self.rates, rate);
        self.state =
            ThermalState { temperature: mean, rate, acceleration: backward_difference(&self.rates, h) };
    }
}

/// Drops the oldest value and appends the newest.
fn rotate(ring: &mut VecDeque<f64>, value: f64) {
    ring.pop_front();
    ring.push_back(value);
}

/// Three-point backward difference over the whole ring: `(3·x_n − 4·x_{n−1} + x_{n−2})/(2h)` \[000 eq. 2\].
fn backward_difference(ring: &VecDeque<f64>, h: f64) -> f64 {
    match (ring.back(), ring.get(ring.len() / 2), ring.front()) {
        (Some(now), Some(before), Some(first)) => (3.0 * now - 4.0 * before + first) / (2.0 * h),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    fn filter() -> ThermalFilter {
        ThermalFilter::new(&ThermalFilterParts {
            grid_step_s: 1.0,
            smoothing_s: 3.0,
            derivative_step_s: 2.0,
            stale_after_s: 30.0,
            branch_dead_band: 1e-9,
            assumed_deg_c: 20.0,
        })
    }

    fn channel() -> Channel {
        Channel(ChannelParts {
            name: ChannelName::from("t").unwrap(),
            conversion: vec![10.0, 20.0],
            range_deg_c: [-50.0, 90.0],
            spike_limit_deg_c: 2.0,
        })
    }

    fn read(memory: &mut ChannelMemory, seconds: f64, celsius: f64) -> Verdict {
        let time = Timestamp::from_ns(Span::from_s(seconds).as_ns());
        memory.read(&channel(), &filter(), time, (celsius - 10.0) / 20.0, |_| {})
    }

    #[test]
    fn a_parabola_of_time_gives_its_exact_derivatives() {
        let mut memory = ChannelMemory::new(&filter());
        for i in 0..40 {
            let t = f64::from(i);
            read(&mut memory, t, 20.0 + 0.1 * t + 0.005 * t * t);
        }
        let state = memory.state().unwrap();
        // The moving average lags by one grid point; a parabola stays a parabola.
        assert!((state.rate - (0.1 + 0.01 * 38.0)).abs() < 1e-9, "{state:?}");
        assert!((state.acceleration - 0.01).abs() < 1e-9, "{state:?}");
        assert!(!memory.warming_up(&filter()));
    }

    #[test]
    fn spikes_and_non_finite_readings_are_held_and_a_lasting_step_is_believed() {
        let mut memory = ChannelMemory::new(&filter());
        for i in 0..6 {
            read(&mut memory, f64::from(i), 20.0);
        }
        assert_eq!(read(&mut memory, 6.0, 35.0), Verdict::Rejected);
        assert!(memory.stale(&filter(), Timestamp::from_ns(6_000_000_000)));
        assert_eq!(read(&mut memory, 7.0, f64::NAN), Verdict::Rejected);
        assert_eq!(read(&mut memory, 8.0, 20.1), Verdict::Taken(3));
        assert!((memory.state().unwrap().temperature - 20.0).abs() < 0.1);
        let verdicts: Vec<_> = (9..15).map(|i| read(&mut memory, f64::from(i), 30.0)).collect();
        assert_eq!(verdicts.iter().filter(|v| matches!(v, Verdict::Taken(_))).count(), 4, "{verdicts:?}");
    }

    #[test]
    fn the_grid_is_anchored_in_absolute_time() {
        let mut early = ChannelMemory::new(&filter());
        let mut late = ChannelMemory::new(&filter());
        for i in 0..100 {
            let t = 0.3 + 0.7 * f64::from(i);
            let celsius = 20.0 + 0.01 * t;
            read(&mut early, t, celsius);
            if i > 20 {
                read(&mut late, t, celsius);
            }
        }
        assert_eq!(early.state(), late.state());
    }

    /// Stale after 3 s, h = 20 s: 3.5 s without a reading once cost the 85 s of a warm-up.
    #[test]
    fn a_silence_of_half_a_derivative_step_is_bridged_though_stale() {
        let filter = ThermalFilter::new(&ThermalFilterParts {
            grid_step_s: 1.0,
            smoothing_s: 5.0,
            derivative_step_s: 20.0,
            stale_after_s: 3.0,
            branch_dead_band: 1e-9,
            assumed_deg_c: 20.0,
        });
        // A chamber's ramp that bends: 3 °C/min, and 1 °C/min faster each minute.
        let celsius = |t: f64| 20.0 + 0.05 * t + 0.5 * t * t / 3600.0;
        let acceleration = 1.0 / 3600.0;
        let series = |silence: f64| {
            let mut memory = ChannelMemory::new(&filter);
            let mut verdict = Verdict::Restarted;
            for i in 0_u32..300 {
                let t = f64::from(i);
                if t <= 150.0 || t >= 150.0 + silence {
                    let time = Timestamp::from_ns(Span::from_s(t).as_ns());
                    verdict = memory.read(&channel(), &filter, time, (celsius(t) - 10.0) / 20.0, |_| {});
                    if t > 150.0 {
                        return (memory, verdict, i);
                    }
                }
            }
            (memory, verdict, 300)
        };
        for silence in [1.0, 4.0, 10.0] {
            let (memory, verdict, i) = series(silence);
            let state = memory.state().unwrap();
            assert_eq!(verdict, Verdict::Taken(usize::try_from(i - 150).unwrap()));
            assert!(!memory.warming_up(&filter), "{silence} s");
            // Smoothing delays by two points; the line may add T̈·h/16.
            let rate = 0.05 + acceleration * (f64::from(i) - 2.0);
            assert!(
                (state.rate - rate).abs() <= acceleration * 20.0 / 16.0,
                "{silence} s: {state:?}, {rate}"
            );
            let after = Timestamp::from_ns(Span::from_s(150.0 + silence).as_ns());
            let (before, ..) = series(f64::INFINITY);
            assert_eq!(before.stale(&filter, after), silence > 3.0, "{silence} s");
        }
        let (memory, verdict, _) = series(11.0);
        assert_eq!((verdict, memory.warming_up(&filter)), (Verdict::Restarted, true));
    }

    #[test]
    fn a_silence_longer_than_its_limit_starts_anew() {
        let mut memory = ChannelMemory::new(&filter());
        read(&mut memory, 0.0, 20.0);
        read(&mut memory, 1.0, 20.5);
        assert_eq!(read(&mut memory, 1e6, 21.0), Verdict::Restarted);
        assert_eq!(memory.state().unwrap(), ThermalState { temperature: 21.0, rate: 0.0, acceleration: 0.0 });
        assert_eq!(read(&mut memory, 10.0, 21.0), Verdict::OutOfOrder);
    }
}
