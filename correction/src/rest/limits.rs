//! What still counts as rest.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use crate::stated::{OutOfRange, outside};
use crate::units::{Angle, AngularRate, SpecificForce};

/// Range of the noise factor.
const SIGMAS_RANGE: [f64; 2] = [3.0, 100.0];

/// Limits of a [`RestMonitor`](super::RestMonitor). Each is the least that counts as motion where the unit's own noise
/// is smaller.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RestLimits {
    /// Angle gathered within a second beyond the mean rate (rad, above 0); default 15″.
    pub turn_rad: f64,
    /// The same for a second with a mode switch in it, over which the angle is that of a fit (rad, above 0); default 60″.
    pub switch_turn_rad: f64,
    /// Angle gathered within a minute beyond the mean rate of the minutes before (rad, above 0); default 0.02°.
    pub slow_turn_rad: f64,
    /// Mean rate of a minute, the Earth's included (rad/s, above 0); default 0.05 °/s.
    pub rate_rad_per_s: f64,
    /// Velocity gathered within a second beyond the mean force (m/s, above 0); default 0.5 mg·s.
    pub push_m_per_s: f64,
    /// Change of the mean force of a minute since the start (m/s², above 0); default 1 mg, a tilt of 0.06°.
    pub force_change_m_per_s2: f64,
    /// Growth of the scatter of the ticks' force within a second (m/s² rms, above 0); default 3 mg.
    pub shake_m_per_s2: f64,
    /// Times the standard deviation of a window up to which noise explains it (3…100); default 7.
    pub sigmas: f64,
    /// The limit that noise makes of `turn_rad` may not exceed this (rad, at least `turn_rad`); default 0.03°, so that
    /// a turn of 0.05° is seen at any time.
    pub turn_ceiling_rad: f64,
    /// The limit that noise makes of `push_m_per_s` may not exceed this (m/s, at least `push_m_per_s`); default
    /// 2 mg·s, so that 20 mg for 0.2 s are seen at any time.
    pub push_ceiling_m_per_s: f64,
}

impl Default for RestLimits {
    fn default() -> Self {
        const fn milli_g(value: f64) -> f64 {
            SpecificForce::from_g(value * 1e-3).as_m_per_s2()
        }
        Self {
            turn_rad: Angle::from_arcsec(15.0).as_rad(),
            switch_turn_rad: Angle::from_arcsec(60.0).as_rad(),
            slow_turn_rad: Angle::from_deg(0.02).as_rad(),
            rate_rad_per_s: AngularRate::from_deg_per_s(0.05).as_rad_per_s(),
            push_m_per_s: milli_g(0.5),
            force_change_m_per_s2: milli_g(1.0),
            shake_m_per_s2: milli_g(3.0),
            sigmas: 7.0,
            turn_ceiling_rad: Angle::from_deg(0.03).as_rad(),
            push_ceiling_m_per_s: milli_g(2.0),
        }
    }
}

impl RestLimits {
    /// Everything that is wrong with the limits, each with the field's name; empty for limits that can be used.
    #[must_use]
    pub fn validate(&self) -> Vec<OutOfRange> {
        let (least, above_zero) = (f64::MIN_POSITIVE, [f64::MIN_POSITIVE, f64::MAX]);
        let outside = outside([
            ("turn_rad", self.turn_rad, above_zero),
            ("switch_turn_rad", self.switch_turn_rad, above_zero),
            ("slow_turn_rad", self.slow_turn_rad, above_zero),
            ("rate_rad_per_s", self.rate_rad_per_s, above_zero),
            ("push_m_per_s", self.push_m_per_s, above_zero),
            ("force_change_m_per_s2", self.force_change_m_per_s2, above_zero),
            ("shake_m_per_s2", self.shake_m_per_s2, above_zero),
            ("sigmas", self.sigmas, SIGMAS_RANGE),
            ("turn_ceiling_rad", self.turn_ceiling_rad, [self.turn_rad.max(least), f64::MAX]),
            ("push_ceiling_m_per_s", self.push_ceiling_m_per_s, [self.push_m_per_s.max(least), f64::MAX]),
        ]);
        outside.collect()
    }
}
