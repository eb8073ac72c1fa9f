//! Words and units of a mapping.

use std::f64::consts::PI;

use isotherm_correction::sample::OutputKind;
use isotherm_correction::units::{Angle, AngularRate, SpecificForce};
use schemars::JsonSchema;
use serde::Deserialize;

/// What readings stand for.
#[derive(Deserialize, JsonSchema)]
#[serde(remote = "OutputKind", rename_all = "snake_case")]
#[schemars(inline)]
pub(super) enum Output {
    Counts,
    Mean,
}

/// Unit of a gyro's readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum GyroUnit {
    /// Counts of the tick.
    #[default]
    Counts,
    /// rad/s.
    RadPerS,
    /// °/s.
    DegPerS,
    /// °/h.
    DegPerH,
    /// rad, over the tick.
    Rad,
    /// °, over the tick.
    Deg,
    /// ″, over the tick.
    Arcsec,
    /// Whatever the calibration document takes.
    Raw,
    /// The same, over the tick.
    RawPerTick,
}

/// Unit of an accelerometer's readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[schemars(inline)]
pub enum AccelUnit {
    /// Counts of the tick.
    #[default]
    #[serde(rename = "counts")]
    Counts,
    /// m/s².
    #[serde(rename = "m_per_s2")]
    MPerS2,
    /// Standard gravity.
    #[serde(rename = "g")]
    G,
    /// Thousandth of standard gravity.
    #[serde(rename = "mg")]
    Mg,
    /// m/s, over the tick.
    #[serde(rename = "m_per_s")]
    MPerS,
    /// V.
    #[serde(rename = "volt")]
    Volt,
    /// Whatever the calibration document takes.
    #[serde(rename = "raw")]
    Raw,
    /// The same, over the tick.
    #[serde(rename = "raw_per_tick")]
    RawPerTick,
}

/// The unit of a sensor's column.
pub trait SensorUnit: Copy + Default {
    /// How much it is in SI, and whether it is an increment over the tick; `None` for counts.
    fn in_si(self) -> Option<(f64, bool)>;

    /// What its readings are sent in.
    fn sent(self) -> &'static str;
}

impl SensorUnit for GyroUnit {
    fn in_si(self) -> Option<(f64, bool)> {
        Some(match self {
            Self::Counts => return None,
            Self::RadPerS | Self::Raw => (1.0, false),
            Self::DegPerS => (AngularRate::from_deg_per_s(1.0).as_rad_per_s(), false),
            Self::DegPerH => (AngularRate::from_deg_per_h(1.0).as_rad_per_s(), false),
            Self::Rad | Self::RawPerTick => (1.0, true),
            Self::Deg => (PI / 180.0, true),
            Self::Arcsec => (Angle::from_arcsec(1.0).as_rad(), true),
        })
    }

    fn sent(self) -> &'static str {
        match self {
            Self::Counts => "counts",
            Self::RadPerS | Self::DegPerS | Self::DegPerH | Self::Rad | Self::Deg | Self::Arcsec => "rad/s",
            Self::Raw => "raw",
            Self::RawPerTick => "raw/s",
        }
    }
}

impl SensorUnit for AccelUnit {
    fn in_si(self) -> Option<(f64, bool)> {
        Some(match self {
            Self::Counts => return None,
            Self::MPerS2 | Self::Volt | Self::Raw => (1.0, false),
            Self::G => (SpecificForce::from_g(1.0).as_m_per_s2(), false),
            Self::Mg => (SpecificForce::from_g(0.001).as_m_per_s2(), false),
            Self::MPerS | Self::RawPerTick => (1.0, true),
        })
    }

    fn sent(self) -> &'static str {
        match self {
            Self::Counts => "counts",
            Self::MPerS2 | Self::G | Self::Mg | Self::MPerS => "m/s²",
            Self::Volt => "V",
            Self::Raw => "raw",
            Self::RawPerTick => "raw/s",
        }
    }
}

/// Unit of a temperature channel's readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum TemperatureUnit {
    /// °C.
    DegC,
    /// °F.
    DegF,
    /// K.
    Kelvin,
    /// V.
    Volt,
    /// Whatever the calibration document takes.
    Raw,
}

impl TemperatureUnit {
    /// A reading as it is sent.
    #[must_use]
    pub fn read(self, reading: f64) -> f64 {
        match self {
            Self::Kelvin => reading - 273.15,
            Self::DegF => (reading - 32.0) / 1.8,
            Self::DegC | Self::Volt | Self::Raw => reading,
        }
    }

    /// What its readings are sent in.
    pub(crate) fn sent(self) -> &'static str {
        match self {
            Self::DegC | Self::DegF | Self::Kelvin => "°C",
            Self::Volt => "V",
            Self::Raw => "raw",
        }
    }
}
