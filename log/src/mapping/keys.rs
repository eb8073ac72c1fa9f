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
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum AccelUnit {
    /// Counts of the tick.
    #[default]
    Counts,
    /// m/s².
    MPerS2,
    /// Standard gravity.
    G,
    /// Thousandth of standard gravity.
    Mg,
    /// m/s, over the tick.
    MPerS,
    /// V.
    Volt,
    /// Whatever the calibration document takes.
    Raw,
    /// The same, over the tick.
    RawPerTick,
}

/// The unit of a sensor's column.
pub trait SensorUnit: Copy + Default {
    /// How much it is in SI, whether it is an increment over the tick, and what its readings are sent in; counts are sent as
    /// they are.
    fn measure(self) -> (f64, bool, &'static str);

    /// How much it is in SI, and whether it is an increment over the tick; `None` for counts.
    fn in_si(self) -> Option<(f64, bool)> {
        let (factor, per_tick, sent) = self.measure();
        (sent != COUNTS).then_some((factor, per_tick))
    }

    /// What its readings are sent in.
    fn sent(self) -> &'static str {
        self.measure().2
    }
}

/// What counts are sent in.
const COUNTS: &str = "counts";

impl SensorUnit for GyroUnit {
    fn measure(self) -> (f64, bool, &'static str) {
        match self {
            Self::Counts => (1.0, false, COUNTS),
            Self::RadPerS => (1.0, false, "rad/s"),
            Self::DegPerS => (AngularRate::from_deg_per_s(1.0).as_rad_per_s(), false, "rad/s"),
            Self::DegPerH => (AngularRate::from_deg_per_h(1.0).as_rad_per_s(), false, "rad/s"),
            Self::Rad => (1.0, true, "rad/s"),
            Self::Deg => (PI / 180.0, true, "rad/s"),
            Self::Arcsec => (Angle::from_arcsec(1.0).as_rad(), true, "rad/s"),
            Self::Raw => (1.0, false, "raw"),
            Self::RawPerTick => (1.0, true, "raw/s"),
        }
    }
}

impl SensorUnit for AccelUnit {
    fn measure(self) -> (f64, bool, &'static str) {
        match self {
            Self::Counts => (1.0, false, COUNTS),
            Self::MPerS2 => (1.0, false, "m/s²"),
            Self::G => (SpecificForce::from_g(1.0).as_m_per_s2(), false, "m/s²"),
            Self::Mg => (SpecificForce::from_g(0.001).as_m_per_s2(), false, "m/s²"),
            Self::MPerS => (1.0, true, "m/s²"),
            Self::Volt => (1.0, false, "V"),
            Self::Raw => (1.0, false, "raw"),
            Self::RawPerTick => (1.0, true, "raw/s"),
        }
    }
}

/// Unit of a temperature channel's readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum TemperatureUnit {
    /// °C.
    #[default]
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
