//! The terms of the sensors' models: each is a coefficient times a feature. All that is said of a term but its mathematics is said here:
//! documents, their schema and its pages, checks, comparisons and fits go through these tables.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;

use serde::{Deserialize, Serialize};

use super::terms::MAX_REGRESSORS;
use super::trail::{MAX_LAGS, MAX_PLAYS, PLAY_WIDTHS_DEG_C};
use crate::units::STANDARD_GRAVITY_M_PER_S2;

/// What a coefficient is multiplied by. Terms are added up in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Feature {
    /// What the sensor reads: the coefficient is a relative error of its scale.
    Reading,
    /// 1.
    One,
    /// Sign of the lasing mode.
    LasingMode,
    /// Sign of the slow meander's phase.
    Meander,
    /// `(T − L_τ[T])/τ`, `L_τ` a first-order low-pass (°C/s).
    Lag,
    /// `p_w[T] − T`, `p_w` a play of half width w: what sticks, and is dragged along by temperature (°C).
    Play,
    /// `x − x₀`: what another channel says, less what a third one does and a constant (the channel's unit).
    Regressor,
    /// Ṫ (°C/s).
    ThermalRate,
    /// T̈ (°C/s²).
    ThermalAcceleration,
    /// Specific force along case axis x (m/s²).
    ForceX,
    /// Along y.
    ForceY,
    /// Along z.
    ForceZ,
    /// Magnitude of the rate that the gyro reads (rad/s): the coefficient is an asymmetry of its scale.
    RateMagnitude,
    /// Square of the specific force along the input axis (m²/s⁴).
    ForceSquared,
}

/// A term as it is declared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Term {
    /// What its coefficient is multiplied by; no two terms of a kind of sensor have the same.
    pub feature: Feature,
    /// Its key in a document; a part of a table after a full stop.
    pub key: &'static str,
    /// How a document states its coefficient.
    pub form: TermForm,
    /// What the coefficient makes of the feature.
    pub makes: Makes,
    /// Unit of the feature.
    pub per: Per,
    /// What it is, for readers of documents; "Source:" names the paper or section that it comes from.
    pub meaning: &'static str,
}

/// How a document states a coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TermForm {
    /// A curve over temperature.
    Curve,
    /// A curve over temperature or the feature for each thermal branch.
    Branches,
    /// A curve over temperature in a table with others, of which this is the meaning.
    PartOf(&'static str),
    /// Tables, each with a gain over temperature and a parameter.
    Each(Parameter),
    /// Tables, up to so many, each with a gain over temperature and the channels of a regressor.
    Regressors(usize),
}

/// A parameter of a term that may stand more than once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Its key, with its unit of measure.
    pub key: &'static str,
    /// What it is, for readers of documents.
    pub meaning: &'static str,
    /// Smallest and largest.
    pub range: [f64; 2],
    /// How often its term may stand.
    pub most: usize,
}

/// What a coefficient makes of a feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Makes {
    /// A bias: rad/s of a gyro, output units of an accelerometer.
    Bias,
    /// A relative error of the scale.
    ScaleError,
    /// A specific force (m/s²).
    Force,
}

/// Unit of a feature, as documents state what is per it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Per {
    /// Its spelling at the end of a key.
    pub key: &'static str,
    /// Its symbol.
    pub symbol: &'static str,
    /// How much of the core's unit it is (°C, °C/s, °C/s², m/s²).
    pub size: f64,
}

impl Per {
    /// None.
    pub const ONE: Self = Self { key: "", symbol: "", size: 1.0 };
    /// °C.
    pub const DEG_C: Self = Self { key: "_per_deg_c", symbol: "°C", size: 1.0 };
    /// °C/s.
    pub const DEG_C_PER_S: Self = Self { key: "_per_deg_c_per_s", symbol: "°C/s", size: 1.0 };
    /// °C/s².
    pub const DEG_C_PER_S2: Self = Self { key: "_per_deg_c_per_s2", symbol: "°C/s²", size: 1.0 };
    /// m/s².
    pub const M_PER_S2: Self = Self { key: "_per_m_per_s2", symbol: "m/s²", size: 1.0 };
    /// Standard gravity.
    pub const G: Self = Self { key: "_per_g", symbol: "g", size: STANDARD_GRAVITY_M_PER_S2 };
    /// Its square. What is multiplied by it is a force in standard gravities: of both, one remains.
    pub const G2: Self = Self { key: "_per_g2", symbol: "g²", size: STANDARD_GRAVITY_M_PER_S2 };
    /// Whatever a channel's unit is.
    pub const UNIT: Self = Self { key: "_per_unit", symbol: "unit", size: 1.0 };
}

impl TermForm {
    /// How often a term may stand.
    #[must_use]
    pub const fn most(&self) -> usize {
        match self {
            Self::Curve | Self::Branches | Self::PartOf(_) => 1,
            Self::Each(Parameter { most, .. }) | Self::Regressors(most) => *most,
        }
    }

    /// Keys of its curves, in the table at its own key; none for a curve that stands there by itself.
    #[must_use]
    pub const fn curves(&self) -> &'static [&'static str] {
        match self {
            Self::Curve | Self::PartOf(_) => &[],
            Self::Branches => &["run_up", "braking"],
            Self::Each(_) | Self::Regressors(_) => &["gain"],
        }
    }
}

impl Term {
    /// Its path in the table of a sensor, where it is the one of this index of its feature.
    #[must_use]
    pub fn path(&self, index: usize) -> String {
        if self.form.most() > 1 { format!("{}[{index}]", self.key) } else { self.key.to_owned() }
    }
}

const LAG: TermForm = TermForm::Each(Parameter {
    key: "time_constant_s",
    meaning: "τ, at least `grid_step_s`.",
    range: [1e-3, 1e7],
    most: MAX_LAGS,
});
const PLAY: TermForm = TermForm::Each(Parameter {
    key: "half_width_deg_c",
    meaning: "w.",
    range: PLAY_WIDTHS_DEG_C,
    most: MAX_PLAYS,
});
const FORCE: TermForm = TermForm::PartOf(
    "Drift by specific force along the case axes; needs `[accel]`. Source: models §2, IEEE 528.",
);
const REGRESSORS: TermForm = TermForm::Regressors(MAX_REGRESSORS);

const fn term(
    feature: Feature,
    (key, form): (&'static str, TermForm),
    (makes, per): (Makes, Per),
    meaning: &'static str,
) -> Term {
    Term { feature, key, form, makes, per, meaning }
}

/// Terms of a gyro (models §2): all but the errors of the scale add to its bias Ω. In the order of documents.
pub const GYRO_TERMS: [Term; 13] = [
    term(
        Feature::Reading,
        ("increment_weight_error", TermForm::Curve),
        (Makes::ScaleError, Per::ONE),
        "K(T)/K0 − 1. Source: models §2, 003.",
    ),
    term(
        Feature::One,
        ("static_bias", TermForm::Curve),
        (Makes::Bias, Per::ONE),
        "Static (non-magnetic) bias. Source: 003; K0(T) of 000; 001.",
    ),
    term(
        Feature::LasingMode,
        ("magnetic_bias", TermForm::Curve),
        (Makes::Bias, Per::ONE),
        "Bias with the sign of the lasing mode. Source: 003.",
    ),
    term(
        Feature::Meander,
        ("slow_meander", TermForm::Curve),
        (Makes::Bias, Per::ONE),
        "Bias with the sign of the meander's phase, if reported, else +. Source: 003.",
    ),
    term(
        Feature::ThermalRate,
        ("thermal_rate", TermForm::Branches),
        (Makes::Bias, Per::DEG_C_PER_S),
        "K1±, multiplies Ṫ; over T or Ṫ. Source: 000; 001 (x3).",
    ),
    term(
        Feature::ThermalAcceleration,
        ("thermal_acceleration", TermForm::Branches),
        (Makes::Bias, Per::DEG_C_PER_S2),
        "K2±, multiplies T̈; over T or T̈. Source: 000.",
    ),
    term(
        Feature::Lag,
        ("lag", LAG),
        (Makes::Bias, Per::DEG_C_PER_S),
        "Thermal lags `Σ g(T)·(T − L_τ[T])/τ`, `L_τ` a first-order low-pass. Source: models §2, §8.",
    ),
    term(
        Feature::Play,
        ("hysteresis", PLAY),
        (Makes::Bias, Per::DEG_C),
        "Hysteresis `Σ g(T)·(p_w[T] − T)`, `p_w` a play. Source: models §2.",
    ),
    term(
        Feature::Regressor,
        ("regressor", REGRESSORS),
        (Makes::Bias, Per::UNIT),
        "Bias by other channels `Σ g(T)·(x − x₀)`; needs `channel`. Source: models §2.",
    ),
    term(Feature::ForceX, ("acceleration_sensitive_drift.x", FORCE), (Makes::Bias, Per::G), "Along x."),
    term(Feature::ForceY, ("acceleration_sensitive_drift.y", FORCE), (Makes::Bias, Per::G), "Along y."),
    term(Feature::ForceZ, ("acceleration_sensitive_drift.z", FORCE), (Makes::Bias, Per::G), "Along z."),
    term(
        Feature::RateMagnitude,
        ("increment_weight_asymmetry", TermForm::Curve),
        (Makes::ScaleError, Per::ONE),
        "Half the difference of K between positive and negative rates, over their mean. Source: models §2, IEEE 528.",
    ),
];

/// Terms of an accelerometer (models §3): they add to its bias S, the last one to what remains of it as a force. In the order of
/// documents.
pub const ACCEL_TERMS: [Term; 6] = [
    term(
        Feature::One,
        ("bias", TermForm::Curve),
        (Makes::Bias, Per::ONE),
        "S(T): output at zero specific force. Source: models §3, 001 (z1…z3).",
    ),
    term(
        Feature::ThermalRate,
        ("thermal_rate", TermForm::Curve),
        (Makes::Bias, Per::DEG_C_PER_S),
        "K1, multiplies Ṫ, as for gyros. Source: models §3.",
    ),
    term(
        Feature::Lag,
        ("lag", LAG),
        (Makes::Bias, Per::DEG_C_PER_S),
        "Thermal lags of the bias, as for gyros. Source: models §2, §8.",
    ),
    term(Feature::Play, ("hysteresis", PLAY), (Makes::Bias, Per::DEG_C), "As for gyros. Source: models §2."),
    term(
        Feature::Regressor,
        ("regressor", REGRESSORS),
        (Makes::Bias, Per::UNIT),
        "As for gyros. Source: models §2.",
    ),
    term(
        Feature::ForceSquared,
        ("second_order", TermForm::Curve),
        (Makes::Force, Per::G2),
        "K2: error per f², f along its input axis. Source: models §3, IEEE 528.",
    ),
];

impl Feature {
    /// Whether it changes from tick to tick with the unit's motion: its line is kept apart, where only units with such terms have it.
    #[must_use]
    pub const fn follows_motion(self) -> bool {
        matches!(self, Self::ForceX | Self::ForceY | Self::ForceZ | Self::RateMagnitude | Self::ForceSquared)
    }

    /// Whether it is the specific force along a case axis.
    #[must_use]
    pub const fn is_force(self) -> bool {
        matches!(self, Self::ForceX | Self::ForceY | Self::ForceZ)
    }

    /// Line that its term is added to, among those of the features that follow motion or among the others.
    pub(super) const fn line(self) -> usize {
        match self {
            Self::Reading | Self::ForceX | Self::ForceSquared => 0,
            Self::One
            | Self::Lag
            | Self::Play
            | Self::Regressor
            | Self::ThermalRate
            | Self::ThermalAcceleration
            | Self::ForceY => 1,
            Self::LasingMode | Self::ForceZ => 2,
            Self::Meander | Self::RateMagnitude => 3,
        }
    }
}
