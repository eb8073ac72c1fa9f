//! The terms of the sensors' models: each is a coefficient times a feature. Which there are is said here and nowhere else.
//!
//! A coefficient is a curve over the sensor's temperature, or one for either thermal branch over temperature or the feature
//! itself. Terms of one line are added up at each thermal evaluation; a tick multiplies the lines, not the terms.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use super::trail::{Trail, Trailed};
use crate::calibration::{BranchArgument, CoefficientParts, RegressorParts, Source, TermParts};
use crate::channel::{ThermalFilter, ThermalState};
use crate::curve::{Curve, CurveError, CurveParts};

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
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Term {
    /// What its coefficient is multiplied by; no two terms of a kind of sensor have the same.
    pub feature: Feature,
    /// Its key in a document; a part of a table after a full stop.
    pub key: &'static str,
}

/// Terms of a gyro (models §2): all but the first add to its bias Ω (rad/s).
pub const GYRO_TERMS: [Term; 13] = [
    Term { feature: Feature::Reading, key: "increment_weight_error" },
    Term { feature: Feature::One, key: "static_bias" },
    Term { feature: Feature::LasingMode, key: "magnetic_bias" },
    Term { feature: Feature::Meander, key: "slow_meander" },
    Term { feature: Feature::Lag, key: "lag" },
    Term { feature: Feature::Play, key: "hysteresis" },
    Term { feature: Feature::Regressor, key: "regressor" },
    Term { feature: Feature::ThermalRate, key: "thermal_rate" },
    Term { feature: Feature::ThermalAcceleration, key: "thermal_acceleration" },
    Term { feature: Feature::ForceX, key: "acceleration_sensitive_drift.x" },
    Term { feature: Feature::ForceY, key: "acceleration_sensitive_drift.y" },
    Term { feature: Feature::ForceZ, key: "acceleration_sensitive_drift.z" },
    Term { feature: Feature::RateMagnitude, key: "increment_weight_asymmetry" },
];

/// Terms of an accelerometer (models §3): they add to its bias S (output units), the last one to what remains of it as a force.
pub const ACCEL_TERMS: [Term; 5] = [
    Term { feature: Feature::One, key: "bias" },
    Term { feature: Feature::Lag, key: "lag" },
    Term { feature: Feature::Play, key: "hysteresis" },
    Term { feature: Feature::Regressor, key: "regressor" },
    Term { feature: Feature::ForceSquared, key: "second_order" },
];

impl Feature {
    /// Whether it changes from tick to tick with the unit's motion: its line is kept apart, where only units with such terms have it.
    #[must_use]
    pub const fn follows_motion(self) -> bool {
        matches!(self, Self::ForceX | Self::ForceY | Self::ForceZ | Self::RateMagnitude | Self::ForceSquared)
    }

    /// Line that its term is added to, among those of the features that follow motion or among the others.
    const fn line(self) -> usize {
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

/// A coefficient, compiled.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
enum Coefficient {
    Curve(Curve),
    Branched { argument: BranchArgument, run_up: Curve, braking: Curve },
}

impl Coefficient {
    /// Its value at a thermal state, and whether an argument was clamped; `feature` is what it is multiplied by.
    ///
    /// The sign of Ṫ·T̈ chatters where either is near zero; over the dead band the two curves are blended with a
    /// weight that is continuous in the product, so that no branch change makes a step.
    fn at(&self, thermal: &ThermalState, feature: f64, dead_band: f64) -> (f64, bool) {
        match self {
            Self::Curve(curve) => {
                let at = curve.at(thermal.temperature);
                (at.value, at.clamped)
            }
            Self::Branched { argument, run_up, braking } => {
                let argument = match argument {
                    BranchArgument::Temperature => thermal.temperature,
                    BranchArgument::Derivative => feature,
                };
                let product = thermal.rate * thermal.acceleration;
                let weight = 0.5 + 0.5 * (product / dead_band).clamp(-1.0, 1.0);
                let (up, down) = (run_up.at(argument), braking.at(argument));
                let value = weight * up.value + (1.0 - weight) * down.value;
                (value, (up.clamped && weight > 0.0) || (down.clamped && weight < 1.0))
            }
        }
    }

    /// Curves whose argument is temperature.
    fn curves_over_temperature(&self) -> impl Iterator<Item = &Curve> {
        let curves = match self {
            Self::Curve(curve) => [Some(curve), None],
            Self::Branched { argument: BranchArgument::Temperature, run_up, braking } => {
                [Some(run_up), Some(braking)]
            }
            Self::Branched { .. } => [None, None],
        };
        curves.into_iter().flatten()
    }
}

/// Terms of one sensor, compiled.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Terms {
    coefficients: Vec<(Feature, Coefficient)>,
    /// Of the terms that trail behind the temperature, in their order.
    trails: Vec<Trail>,
    /// Of the terms that other channels enter.
    regressors: Vec<RegressorParts>,
}

/// Most regressors of one sensor.
pub const MAX_REGRESSORS: usize = 8;

/// Smoothed value of any channel, where it was read.
pub(crate) type Others<'a> = &'a dyn Fn(Source) -> Option<f64>;

/// What the terms of a sensor are evaluated in.
pub(crate) struct SensorState<'a> {
    /// Its own temperature.
    pub(crate) thermal: &'a ThermalState,
    /// States of what trails behind it (°C).
    pub(crate) trailed: &'a Trailed,
    /// The other channels.
    pub(crate) others: Others<'a>,
}

impl Terms {
    /// Compiles the terms whose features follow motion, or the others; `report` hears of every one that is wrong, by its key.
    pub(crate) fn new(
        declared: &[Term],
        parts: &[TermParts],
        follow_motion: bool,
        filter: &ThermalFilter,
        report: &mut dyn FnMut(&'static str, CurveError),
    ) -> Option<Self> {
        let mut compiled = Self::default();
        let mut sound = true;
        let among = parts.iter().filter(|part| part.feature.follows_motion() == follow_motion);
        for term in declared {
            for part in among.clone().filter(|part| part.feature == term.feature) {
                let mut curve = |parts: &CurveParts| {
                    let made = Curve::new(parts).map_err(|error| report(term.key, error));
                    sound &= made.is_ok();
                    made.ok()
                };
                let coefficient = match &part.coefficient {
                    CoefficientParts::Curve(parts) => curve(parts).map(Coefficient::Curve),
                    CoefficientParts::Branched(parts) => {
                        let curves = (curve(&parts.run_up), curve(&parts.braking));
                        let argument = parts.argument;
                        let (Some(run_up), Some(braking)) = curves else { continue };
                        Some(Coefficient::Branched { argument, run_up, braking })
                    }
                };
                compiled.coefficients.extend(coefficient.map(|coefficient| (term.feature, coefficient)));
                compiled.regressors.extend(part.regressor.filter(|_| term.feature == Feature::Regressor));
                compiled.trails.extend(match term.feature {
                    Feature::Lag => Some(Trail::lag(part.parameter, filter)),
                    Feature::Play => Some(Trail::Play { half_width_deg_c: part.parameter }),
                    _ => None,
                });
            }
        }
        sound.then_some(compiled)
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.coefficients.is_empty()
    }

    /// Whether one is multiplied by the specific force along a case axis.
    pub(crate) fn feel_force(&self) -> bool {
        self.coefficients
            .iter()
            .any(|(feature, _)| matches!(feature, Feature::ForceX | Feature::ForceY | Feature::ForceZ))
    }

    /// What trails behind the temperature.
    pub(crate) fn trails(&self) -> &[Trail] {
        &self.trails
    }

    /// What other channels say.
    pub(crate) fn regressors(&self) -> &[RegressorParts] {
        &self.regressors
    }

    /// The sum of each line in a state, and whether an argument was clamped to its fitted range. A feature that changes from tick to
    /// tick counts as 1.
    pub(crate) fn lines<const T: usize>(
        &self,
        SensorState { thermal, trailed, others }: &SensorState<'_>,
        filter: &ThermalFilter,
    ) -> ([f64; T], bool) {
        let mut sums = [0.0; T];
        let mut any_clamped = false;
        let mut trails = self.trails.iter().zip(trailed.iter());
        let mut regressors = self.regressors.iter();
        for (feature, coefficient) in &self.coefficients {
            let (value, factor) = match feature {
                Feature::Lag | Feature::Play => trails
                    .next()
                    .map_or((0.0, 0.0), |(trail, state)| trail.feature(*state, thermal.temperature)),
                Feature::Regressor => {
                    (regressors.next().map_or(0.0, |regressor| regressor.value(*others)), 1.0)
                }
                Feature::ThermalRate => (thermal.rate, 1.0),
                Feature::ThermalAcceleration => (thermal.acceleration, 1.0),
                _ => (1.0, 1.0),
            };
            let (coefficient, clamped) = coefficient.at(thermal, value, filter.branch_dead_band);
            any_clamped |= clamped;
            if let Some(sum) = sums.get_mut(feature.line()) {
                *sum += coefficient * value * factor;
            }
        }
        (sums, any_clamped)
    }

    /// Every curve whose argument is temperature and which flags the sensor outside its fitted range.
    pub(crate) fn curves_over_temperature(&self) -> impl Iterator<Item = &Curve> {
        self.coefficients.iter().flat_map(|(_, coefficient)| coefficient.curves_over_temperature())
    }
}
