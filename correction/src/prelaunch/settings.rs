//! What a pre-launch calibration is asked to do, and what it may not exceed.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::calibration::Calibration;
use crate::earth::{Place, Tilt};
use crate::rest::RestLimits;
use crate::stated::{OutOfRange, outside};
use crate::units::{AngularRate, Span};

/// Shortest and longest calibration (s).
pub const DURATION_RANGE_S: [f64; 2] = [30.0, 86_400.0];
/// Shortest and longest usable time of a mode that may be asked for (s): the monitor of rest needs half a minute of each.
const MODE_TIME_RANGE_S: [f64; 2] = [30.0, DURATION_RANGE_S[1]];

/// A pre-launch calibration as it is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PreLaunchSettings {
    /// How long it takes, in event time (30 s…24 h, of which a service takes 1 min…2 h); default 10 min.
    pub duration: Span,
    /// Where the unit is and how it stands; there is no default place, and none is refused.
    pub place: Option<Place>,
    /// What leads to a refusal.
    pub limits: PreLaunchLimits,
}

impl Default for PreLaunchSettings {
    fn default() -> Self {
        Self { duration: Span::from_ms(600_000), place: None, limits: PreLaunchLimits::default() }
    }
}

/// What leads to a refusal.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PreLaunchLimits {
    /// Largest change of C0, the constant of the static bias (rad/s, above 0); default 1 °/h.
    pub static_bias_change_rad_per_s: f64,
    /// Largest change of B0, the constant of the magnetic bias (rad/s, above 0); default 1 °/h.
    pub magnetic_bias_change_rad_per_s: f64,
    /// Largest |n₊ − n₋|/(n₊ + n₋), n the good ticks of a mode (0…1); default 0.2.
    pub mode_imbalance: f64,
    /// Shortest good time of each mode, or of all of an instrument without modes (30 s…24 h, of which a service takes 2 h); default 60 s.
    pub time_per_mode: Span,
    /// Smallest share of good ticks in all that were produced, missing ones included (0…1); default 0.9.
    pub good_share: f64,
    /// What still counts as rest.
    pub rest: RestLimits,
}

impl Default for PreLaunchLimits {
    fn default() -> Self {
        Self {
            static_bias_change_rad_per_s: AngularRate::from_deg_per_h(1.0).as_rad_per_s(),
            magnetic_bias_change_rad_per_s: AngularRate::from_deg_per_h(1.0).as_rad_per_s(),
            mode_imbalance: 0.2,
            time_per_mode: Span::from_ms(60_000),
            good_share: 0.9,
            rest: RestLimits::default(),
        }
    }
}

/// One reason why a pre-launch calibration cannot even begin.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum PreLaunchError {
    /// A number, times in seconds, is outside its range, or not a number.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// A limit of the monitor of rest.
    #[error("rest.{0}")]
    Rest(OutOfRange),
    /// Nobody said where the unit is.
    #[error("no place: latitude and heading are needed for the rate of the Earth")]
    NoPlace,
    /// Levelling was asked for.
    #[error("the unit has no accelerometers to be levelled from: give pitch and roll")]
    NoAccelerometers,
}

impl PreLaunchSettings {
    /// Everything that is wrong with the settings for a unit with this calibration; empty where it may begin.
    #[must_use]
    pub fn validate(&self, calibration: &Calibration) -> Vec<PreLaunchError> {
        let limits = &self.limits;
        let above_zero = [f64::MIN_POSITIVE, f64::MAX];
        let outside = outside([
            ("duration_s", self.duration.as_s(), DURATION_RANGE_S),
            ("static_bias_change_rad_per_s", limits.static_bias_change_rad_per_s, above_zero),
            ("magnetic_bias_change_rad_per_s", limits.magnetic_bias_change_rad_per_s, above_zero),
            ("mode_imbalance", limits.mode_imbalance, [0.0, 1.0]),
            ("time_per_mode_s", limits.time_per_mode.as_s(), MODE_TIME_RANGE_S),
            ("good_share", limits.good_share, [0.0, 1.0]),
        ]);
        let mut errors: Vec<PreLaunchError> = outside.map(Into::into).collect();
        errors.extend(limits.rest.validate().into_iter().map(PreLaunchError::Rest));
        match self.place.map(|place| place.tilt()) {
            None => errors.push(PreLaunchError::NoPlace),
            Some(Tilt::Levelled) if calibration.accel_count() == 0 => {
                errors.push(PreLaunchError::NoAccelerometers);
            }
            Some(_) => {}
        }
        errors
    }
}
