//! A temperature channel of the calibration in force.

use isotherm_correction::sample::ChannelName;
use serde::{Deserialize, Serialize};

/// Where a temperature lies against the calibrated range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// Below its lower end: terms are clamped.
    Below,
    /// Inside, the ends included.
    Inside,
    /// Above its upper end: terms are clamped.
    Above,
}

impl Place {
    /// Where a temperature lies; `None` where it is no number.
    #[must_use]
    pub fn of(temperature_deg_c: f64, [low, high]: [f64; 2]) -> Option<Self> {
        if temperature_deg_c < low {
            Some(Self::Below)
        } else if temperature_deg_c > high {
            Some(Self::Above)
        } else {
            (!temperature_deg_c.is_nan()).then_some(Self::Inside)
        }
    }
}

/// A temperature channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelStatus {
    /// Name.
    pub name: ChannelName,
    /// Smoothed temperature (°C); `None` before the first reading.
    pub temperature_deg_c: Option<f64>,
    /// Its rate (°C/s); `None` before the first reading.
    pub rate_deg_c_per_s: Option<f64>,
    /// Missing, rejected or older than its limit.
    pub stale: bool,
    /// Derivatives do not rest on readings alone yet.
    pub warming_up: bool,
    /// Range that every curve which follows the channel was fitted over (°C); `None` where no curve follows it.
    pub calibrated_range_deg_c: Option<[f64; 2]>,
    /// Where the temperature lies against that range; `None` where one of the two is not known.
    pub place: Option<Place>,
}
