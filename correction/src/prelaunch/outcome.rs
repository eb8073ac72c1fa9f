//! What a pre-launch calibration says: progress, constants, reasons for a refusal.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::by_mode::ByMode;
use crate::rest::Moved;
use crate::sample::{LasingMode, Sensors};
use crate::units::{AngularRate, Span};

/// Good ticks of one gyro in one mode.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ModeTotals {
    /// How many.
    pub ticks: u64,
    /// Their duration together (s).
    pub time_s: f64,
    /// Mean temperature that the gyro follows over them (°C); `None` without any.
    pub mean_temperature_deg_c: Option<f64>,
}

/// How far one gyro is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GyroProgress {
    /// Good ticks so far.
    pub modes: ByMode<ModeTotals>,
    /// Standard error that the constants would have now (rad/s); `None` while too little is known.
    pub standard_error_rad_per_s: Option<f64>,
}

/// How far a pre-launch calibration is.
#[derive(Debug, Clone, PartialEq)]
pub struct PreLaunchProgress {
    /// Event time since the start of its first tick.
    pub elapsed: Span,
    /// How long it takes.
    pub duration: Span,
    /// Each gyro.
    pub gyros: Sensors<GyroProgress>,
}

/// What came of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    /// New constants, one set per gyro.
    Accepted(Vec<GyroConstants>),
    /// Every reason for which the old constants stay; at least one.
    Refused(Vec<Refusal>),
}

/// Change of the constants of one gyro: what is to be *added* to the terms that the calibration states.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GyroConstants {
    /// ΔC0: static bias (rad/s).
    pub static_bias_change_rad_per_s: f64,
    /// Its standard error by the noise of the run (rad/s); the errors of place and levelling are not in it.
    pub static_bias_sigma_rad_per_s: f64,
    /// ΔB0: magnetic bias for mode plus (rad/s); `None` for an instrument without modes.
    pub magnetic_bias_change_rad_per_s: Option<f64>,
    /// Its standard error, likewise (rad/s).
    pub magnetic_bias_sigma_rad_per_s: Option<f64>,
    /// Rate of the Earth along the input axis that was subtracted (rad/s).
    pub earth_rate_rad_per_s: f64,
    /// What it rests on.
    pub modes: ByMode<ModeTotals>,
}

/// One of the two constants of a gyro.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Error, Serialize, Deserialize)]
pub enum BiasConstant {
    /// C0, of the static bias.
    #[error("C0 (static bias)")]
    Static,
    /// B0, of the magnetic bias.
    #[error("B0 (magnetic bias)")]
    Magnetic,
}

/// Why the old constants stay.
#[derive(Debug, Clone, Copy, PartialEq, Error, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Refusal {
    /// The unit moved.
    #[error("{0}")]
    Moved(Moved),
    /// Whether the unit stood still could not be seen.
    #[error("too few ticks to judge whether the unit was still")]
    RestNotSeen,
    /// The temperature of a gyro, or of the gyros' axes, left the range that the calibration was fitted over.
    #[error("gyro {gyro} at {temperature_deg_c:.2} °C is outside the temperatures of its calibration")]
    TemperatureOutOfRange {
        /// Index of the gyro.
        gyro: usize,
        /// Its temperature (°C).
        temperature_deg_c: f64,
    },
    /// The producer started anew.
    #[error("the producer restarted: start again")]
    Restarted,
    /// The stream ended before its time.
    #[error("it ended after {:.1} s, {:.1} s are needed", elapsed.as_s(), duration.as_s())]
    TooShort {
        /// How long it lasted.
        elapsed: Span,
        /// How long it should have.
        duration: Span,
    },
    /// A gyro has too little good time in a mode.
    #[error("gyro {gyro} was good for {time_s:.1} s{}, {limit_s:.1} s are needed", of_mode(*mode))]
    TooLittleTime {
        /// Index of the gyro.
        gyro: usize,
        /// The mode; `None` for an instrument without.
        mode: Option<LasingMode>,
        /// Good time (s).
        time_s: f64,
        /// Least that is needed (s).
        limit_s: f64,
    },
    /// A gyro has too few good ticks in all that were produced.
    #[error("{:.1} % of the ticks of gyro {gyro} were good, {:.1} % are needed", good_share * 100.0, limit * 100.0)]
    TooManyBadTicks {
        /// Index of the gyro.
        gyro: usize,
        /// Share of the good ones.
        good_share: f64,
        /// Least that is needed.
        limit: f64,
    },
    /// One mode has many more good ticks than the other.
    #[error(
        "the modes of gyro {gyro} are unbalanced: (n₊ − n₋)/(n₊ + n₋) is {imbalance:.3}, at most {limit:.3} is allowed"
    )]
    ModesUnbalanced {
        /// Index of the gyro.
        gyro: usize,
        /// |n₊ − n₋|/(n₊ + n₋).
        imbalance: f64,
        /// Largest allowed.
        limit: f64,
    },
    /// The mode never stood still long enough for the noise of a gyro to be seen.
    #[error("the noise of gyro {gyro} is not known: leave the mode alone for half a minute at least")]
    NoiseNotSeen {
        /// Index of the gyro.
        gyro: usize,
    },
    /// The mean specific force does not say how the unit stands.
    #[error("the unit cannot be levelled{}", not_levelled(*mean_force_m_per_s2))]
    NotLevelled {
        /// Mean specific force in case axes (m/s²); `None` without any.
        mean_force_m_per_s2: Option<[f64; 3]>,
    },
    /// A constant would change by more than it may.
    #[error(
        "{constant} of gyro {gyro} would change by {:+.4} °/h, at most {:.4} °/h is allowed",
        deg_per_h(*change_rad_per_s), deg_per_h(*limit_rad_per_s)
    )]
    ChangeBeyondLimit {
        /// Index of the gyro.
        gyro: usize,
        /// Which constant.
        constant: BiasConstant,
        /// The change (rad/s).
        change_rad_per_s: f64,
        /// Largest allowed (rad/s).
        limit_rad_per_s: f64,
    },
}

fn deg_per_h(rad_per_s: f64) -> f64 {
    AngularRate::from_rad_per_s(rad_per_s).as_deg_per_h()
}

fn of_mode(mode: Option<LasingMode>) -> &'static str {
    match mode {
        Some(LasingMode::Plus) => " of mode plus",
        Some(LasingMode::Minus) => " of mode minus",
        None => "",
    }
}

/// What a mean force lacks for levelling.
fn not_levelled(mean_force: Option<[f64; 3]>) -> String {
    let Some([x, y, z]) = mean_force else { return ": no accelerometer ticks".into() };
    format!(
        " from its mean force of {x:.3}, {y:.3}, {z:.3} m/s²: it must be within 2 % of 9.807, with x not vertical"
    )
}
