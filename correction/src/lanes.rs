//! Sensor beside sensor: one number of each in an array of fixed width, so that a tick's arithmetic needs no branch per sensor.

use core::ops::{Deref, DerefMut};
use core::{array, slice};

use serde::{Deserialize, Serialize};

use crate::sample::{MAX_SENSORS, Sensors};

/// One number of each sensor, in the order of the calibration; 0 where there is no sensor.
pub type Lanes = [f64; MAX_SENSORS];

/// The first `N` lanes, the width that a tick is worked out in.
pub(crate) const fn narrow<const N: usize>(lanes: &Lanes) -> &[f64; N] {
    const { assert!(N <= MAX_SENSORS, "no more lanes than sensors") }
    match lanes.first_chunk() {
        Some(narrow) => narrow,
        // Ruled out above.
        None => &[0.0; N],
    }
}

/// Puts the first `N` lanes in their place among all.
pub(crate) fn put<const N: usize>(lanes: &mut Lanes, values: [f64; N]) {
    if let Some(place) = lanes.first_chunk_mut() {
        *place = values;
    }
}

/// Whether every reading is a number below its sensor's limit.
#[inline]
pub(crate) fn within<const N: usize>(readings: &[f64; N], limits: &[f64; N]) -> bool {
    readings.iter().zip(limits).fold(true, |sound, (reading, limit)| sound & (reading.abs() < *limit))
}

/// What the sensors of a kind read in one tick, in the order of the calibration: a list of at most [`MAX_SENSORS`] numbers that are
/// lanes already.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(into = "Sensors<f64>", from = "Sensors<f64>")]
pub struct Readings {
    /// 0 where there is no sensor.
    lanes: Lanes,
    count: usize,
}

impl Readings {
    /// The first `N` lanes; 0 where there is no sensor.
    pub(crate) const fn lanes<const N: usize>(&self) -> &[f64; N] {
        narrow(&self.lanes)
    }

    /// How many there are; what the slice says of itself it asks of its bounds first.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.count
    }

    /// Whether there is none.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Has so many readings, at most [`MAX_SENSORS`]: those that are new are 0.
    #[inline]
    pub fn resize(&mut self, count: usize) {
        let count = count.min(MAX_SENSORS);
        if count != self.count {
            self.lanes[count..].fill(0.0);
            self.count = count;
        }
    }

    /// One reading more; lost where there are [`MAX_SENSORS`].
    pub fn push(&mut self, reading: f64) {
        if let Some(lane) = self.lanes.get_mut(self.count) {
            *lane = reading;
            self.count += 1;
        }
    }
}

impl Deref for Readings {
    type Target = [f64];

    #[inline]
    fn deref(&self) -> &[f64] {
        self.lanes.get(..self.count).unwrap_or_default()
    }
}

impl DerefMut for Readings {
    #[inline]
    fn deref_mut(&mut self) -> &mut [f64] {
        self.lanes.get_mut(..self.count).unwrap_or_default()
    }
}

/// Those beyond [`MAX_SENSORS`] are lost.
impl FromIterator<f64> for Readings {
    fn from_iter<I: IntoIterator<Item = f64>>(readings: I) -> Self {
        let mut all = Self::default();
        readings.into_iter().for_each(|reading| all.push(reading));
        all
    }
}

impl<'a> IntoIterator for &'a Readings {
    type Item = &'a f64;
    type IntoIter = slice::Iter<'a, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl From<Sensors<f64>> for Readings {
    fn from(readings: Sensors<f64>) -> Self {
        readings.into_iter().collect()
    }
}

impl From<Readings> for Sensors<f64> {
    fn from(readings: Readings) -> Self {
        readings.iter().copied().collect()
    }
}

/// One term of each sensor on a straight line over a share that goes from 0 to 1.
///
/// Aligned so that two lanes can be taken from memory by the instruction that reckons with them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[repr(align(16))]
pub(crate) struct Line {
    from: Lanes,
    step: Lanes,
}

impl Line {
    /// A line of zeros.
    pub(crate) const ZERO: Self = Self { from: [0.0; MAX_SENSORS], step: [0.0; MAX_SENSORS] };

    /// The terms, so far along.
    #[inline]
    pub(crate) fn at<const N: usize>(&self, share: &[f64; N]) -> [f64; N] {
        let (from, step) = (narrow::<N>(&self.from), narrow::<N>(&self.step));
        array::from_fn(|i| from[i] + step[i] * share[i])
    }

    /// One sensor's term, so far along.
    pub(crate) fn lane(&self, lane: usize, share: f64) -> f64 {
        self.from[lane] + self.step[lane] * share
    }

    /// Turns one sensor's term towards `target`, from where it is so far along.
    pub(crate) fn turn(&mut self, lane: usize, share: f64, target: f64) {
        let from = self.lane(lane, share);
        (self.from[lane], self.step[lane]) = (from, target - from);
    }

    /// Puts one sensor's term where it is to stay.
    pub(crate) fn hold(&mut self, lane: usize, value: f64) {
        (self.from[lane], self.step[lane]) = (value, 0.0);
    }

    /// Puts every term at the end of its line.
    pub(crate) fn settle(&mut self) {
        for lane in 0..MAX_SENSORS {
            self.hold(lane, self.lane(lane, 1.0));
        }
    }

    /// Takes one sensor's term over from another line.
    pub(crate) fn copy_lane(&mut self, other: &Self, lane: usize) {
        (self.from[lane], self.step[lane]) = (other.from[lane], other.step[lane]);
    }
}
