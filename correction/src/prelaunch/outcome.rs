//! What a pre-launch calibration says: progress, constants, reasons for a refusal.

use alloc::vec::Vec;
use core::fmt;

use serde::{Deserialize, Serialize};

use crate::rest::Moved;
use crate::sample::{LasingMode, Sensors};
use crate::units::{AngularRate, Span};

/// One value per lasing mode, and one for an instrument without modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ByMode<T> {
    /// Instrument without modes.
    pub without: T,
    /// Mode plus.
    pub plus: T,
    /// Mode minus.
    pub minus: T,
}

impl<T> ByMode<T> {
    /// That of a mode.
    pub fn get(&self, mode: Option<LasingMode>) -> &T {
        match mode {
            None => &self.without,
            Some(LasingMode::Plus) => &self.plus,
            Some(LasingMode::Minus) => &self.minus,
        }
    }

    /// That of a mode.
    pub(super) fn get_mut(&mut self, mode: Option<LasingMode>) -> &mut T {
        match mode {
            None => &mut self.without,
            Some(LasingMode::Plus) => &mut self.plus,
            Some(LasingMode::Minus) => &mut self.minus,
        }
    }

    /// The same of each.
    pub(super) fn map<U>(&self, f: impl Fn(&T) -> U) -> ByMode<U> {
        ByMode { without: f(&self.without), plus: f(&self.plus), minus: f(&self.minus) }
    }
}

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
    /// Mean temperature over all good ticks so far (°C); `None` without any.
    pub mean_temperature_deg_c: Option<f64>,
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum BiasConstant {
    /// C0, of the static bias.
    Static,
    /// B0, of the magnetic bias.
    Magnetic,
}

/// Why the old constants stay.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Refusal {
    /// The unit moved.
    Moved(Moved),
    /// Whether the unit stood still could not be seen.
    RestNotSeen,
    /// The temperature of a gyro, or of the gyros' axes, left the range that the calibration was fitted over.
    TemperatureOutOfRange {
        /// Index of the gyro.
        gyro: usize,
        /// Its temperature (°C).
        temperature_deg_c: f64,
    },
    /// The producer started anew.
    Restarted,
    /// The stream ended before its time.
    TooShort {
        /// How long it lasted.
        elapsed: Span,
        /// How long it should have.
        duration: Span,
    },
    /// A gyro has too little good time in a mode.
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
    TooManyBadTicks {
        /// Index of the gyro.
        gyro: usize,
        /// Share of the good ones.
        good_share: f64,
        /// Least that is needed.
        limit: f64,
    },
    /// One mode has many more good ticks than the other.
    ModesUnbalanced {
        /// Index of the gyro.
        gyro: usize,
        /// |n₊ − n₋|/(n₊ + n₋).
        imbalance: f64,
        /// Largest allowed.
        limit: f64,
    },
    /// The mode never stood still long enough for the noise of a gyro to be seen.
    NoiseNotSeen {
        /// Index of the gyro.
        gyro: usize,
    },
    /// The mean specific force does not say how the unit stands.
    NotLevelled {
        /// Mean specific force in case axes (m/s²); `None` without any.
        mean_force_m_per_s2: Option<[f64; 3]>,
    },
    /// A constant would change by more than it may.
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

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let deg_per_h = |rate| AngularRate::from_rad_per_s(rate).as_deg_per_h();
        match self {
            Self::Moved(moved) => moved.fmt(f),
            Self::RestNotSeen => f.write_str("too little was seen to say that the unit stood still"),
            Self::TemperatureOutOfRange { gyro, temperature_deg_c } => write!(
                f,
                "gyro {gyro} at {temperature_deg_c:.2} °C is outside the temperatures that its calibration was fitted over"
            ),
            Self::Restarted => f.write_str("the producer restarted: begin again"),
            Self::TooShort { elapsed, duration } => {
                write!(f, "it ended after {:.1} s, {:.1} s are needed", elapsed.as_s(), duration.as_s())
            }
            Self::TooLittleTime { gyro, mode, time_s, limit_s } => {
                write!(f, "gyro {gyro} was good for {time_s:.1} s")?;
                match mode {
                    Some(LasingMode::Plus) => f.write_str(" of mode plus")?,
                    Some(LasingMode::Minus) => f.write_str(" of mode minus")?,
                    None => {}
                }
                write!(f, ", {limit_s:.1} s are needed")
            }
            Self::TooManyBadTicks { gyro, good_share, limit } => {
                let (good, least) = (good_share * 100.0, limit * 100.0);
                write!(f, "{good:.1} % of the ticks of gyro {gyro} were good, {least:.1} % are needed")
            }
            Self::ModesUnbalanced { gyro, imbalance, limit } => write!(
                f,
                "the modes of gyro {gyro} are unbalanced: (n₊ − n₋)/(n₊ + n₋) is {imbalance:.3}, at most {limit:.3} is \
                 allowed"
            ),
            Self::NoiseNotSeen { gyro } => {
                write!(
                    f,
                    "the noise of gyro {gyro} is not known: leave the mode alone for half a minute at least"
                )
            }
            Self::NotLevelled { mean_force_m_per_s2: Some([x, y, z]) } => write!(
                f,
                "the unit cannot be levelled from its mean force of {x:.3}, {y:.3}, {z:.3} m/s²: within 2 % of 9.807 is \
                 needed, and x not vertical"
            ),
            Self::NotLevelled { mean_force_m_per_s2: None } => {
                f.write_str("the unit cannot be levelled: no accelerometer tick came")
            }
            Self::ChangeBeyondLimit { gyro, constant, change_rad_per_s, limit_rad_per_s } => {
                let constant = match constant {
                    BiasConstant::Static => "C0 (static bias)",
                    BiasConstant::Magnetic => "B0 (magnetic bias)",
                };
                let (change, limit) = (deg_per_h(*change_rad_per_s), deg_per_h(*limit_rad_per_s));
                write!(
                    f,
                    "{constant} of gyro {gyro} would change by {change:+.4} °/h, at most {limit:.4} °/h is allowed"
                )
            }
        }
    }
}
