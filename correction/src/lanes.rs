//! Sensor beside sensor: one number of each in an array of fixed width, so that a tick's arithmetic needs no branch per sensor.

use core::array;

use serde::{Deserialize, Serialize};

use crate::sample::MAX_SENSORS;

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

/// Readings as lanes; 0 where there is none.
#[inline]
pub(crate) fn of_readings<const N: usize>(readings: &[f64]) -> [f64; N] {
    // Mostly there are three.
    if let &[x, y, z] = readings {
        return array::from_fn(|lane| match lane {
            0 => x,
            1 => y,
            2 => z,
            _ => 0.0,
        });
    }
    let mut lanes = [0.0; N];
    lanes.iter_mut().zip(readings).for_each(|(lane, reading)| *lane = *reading);
    lanes
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
