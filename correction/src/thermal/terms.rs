//! The terms of the sensors' models, evaluated.
//!
//! A coefficient is a curve over the sensor's temperature, or one for either thermal branch over temperature or the feature
//! itself. Terms of one line are added up at each thermal evaluation; a tick multiplies the lines, not the terms.

use alloc::format;
use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use super::declared::{Feature, Term};
use super::trail::{Trail, Trailed};
use crate::calibration::{BranchArgument, CoefficientParts, RegressorParts, Source, TermParts};
use crate::channel::{ThermalFilter, ThermalState};
use crate::curve::{Curve, CurveParts};
use crate::defect::Checker;

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
    /// Compiles the terms whose features follow motion, or the others, in the order of the features.
    pub(crate) fn new(
        declared: &[Term],
        parts: &[TermParts],
        follow_motion: bool,
        filter: &ThermalFilter,
        checker: &mut Checker,
    ) -> Option<Self> {
        let mut compiled = Self::default();
        let mut sound = true;
        let mut among: Vec<_> =
            parts.iter().filter(|part| part.feature.follows_motion() == follow_motion).collect();
        among.sort_by_key(|part| part.feature);
        let (mut last, mut index) = (None, 0);
        for part in among {
            let Some(term) = declared.iter().find(|term| term.feature == part.feature) else { continue };
            index = if last == Some(part.feature) { index + 1 } else { 0 };
            last = Some(part.feature);
            let mut keys = term.form.curves().iter();
            let mut curve = |parts: &CurveParts| {
                let path = term.path(index);
                let made =
                    checker.curve(&keys.next().map_or(path.clone(), |key| format!("{path}.{key}")), parts);
                sound &= made.is_some();
                made
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
            compiled.coefficients.extend(coefficient.map(|coefficient| (part.feature, coefficient)));
            compiled.regressors.extend(part.regressor.filter(|_| part.feature == Feature::Regressor));
            compiled.trails.extend(match part.feature {
                Feature::Lag => Some(Trail::lag(part.parameter, filter)),
                Feature::Play => Some(Trail::Play { half_width_deg_c: part.parameter }),
                _ => None,
            });
        }
        sound.then_some(compiled)
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.coefficients.is_empty()
    }

    /// Whether one is multiplied by the specific force along a case axis.
    pub(crate) fn feel_force(&self) -> bool {
        self.coefficients.iter().any(|(feature, _)| feature.is_force())
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
