//! The terms of a document's sensors, one list for all who go through them: checks, warnings, and what the core gets.

use isotherm_correction::calibration::{
    BranchArgument, BranchedParts, CoefficientParts, RegressorParts, Source, TermParts,
};
use isotherm_correction::thermal::{ACCEL_TERMS, Feature, GYRO_TERMS, Term};
use isotherm_document::{element, join};

use super::curve::{Curve, CurveForm, Quantity};
use super::measure::Argument;
use super::types::{AccelRegressor, AccelSensor, AlongAxes, Branches, GyroSensor, Regressor};

/// A term that a sensor states.
#[derive(Debug)]
pub(super) struct StatedTerm<'d> {
    pub(super) feature: Feature,
    /// Its key in the sensor's table.
    pub(super) key: String,
    /// τ of a lag (s), half width of a play (°C).
    pub(super) parameter: Option<f64>,
    /// What a regressor is.
    pub(super) regressor: Option<StatedRegressor<'d>>,
    pub(super) coefficient: StatedCoefficient<'d>,
}

/// Names of a regressor's channels, and its constant.
#[derive(Debug, Clone, Copy)]
pub(super) struct StatedRegressor<'d> {
    pub(super) channel: &'d str,
    pub(super) minus: Option<&'d str>,
    pub(super) reference: f64,
}

/// Its coefficient.
#[derive(Debug, Clone, Copy)]
pub(super) enum StatedCoefficient<'d> {
    Curve(&'d CurveForm),
    Branched { run_up: &'d CurveForm, braking: &'d CurveForm },
}

impl<'d> StatedTerm<'d> {
    /// Its curves, each with its path in the sensor's table.
    pub(super) fn curves(&self) -> Vec<(String, &'d CurveForm)> {
        match self.coefficient {
            StatedCoefficient::Curve(curve) if self.parameter.is_some() || self.regressor.is_some() => {
                vec![(join(&self.key, "gain"), curve)]
            }
            StatedCoefficient::Curve(curve) => vec![(self.key.clone(), curve)],
            StatedCoefficient::Branched { run_up, braking } => {
                vec![(join(&self.key, "run_up"), run_up), (join(&self.key, "braking"), braking)]
            }
        }
    }

    /// What the core gets; `source` gives a channel by its name.
    pub(super) fn to_parts(&self, source: impl Fn(&str) -> Source) -> TermParts {
        let coefficient = match self.coefficient {
            StatedCoefficient::Curve(curve) => CoefficientParts::Curve(curve.to_parts(0.0)),
            StatedCoefficient::Branched { run_up, braking } => CoefficientParts::Branched(BranchedParts {
                argument: match run_up.argument().or(braking.argument()) {
                    None | Some(Argument::DegC) => BranchArgument::Temperature,
                    Some(_) => BranchArgument::Derivative,
                },
                run_up: run_up.to_parts(0.0),
                braking: braking.to_parts(0.0),
            }),
        };
        let parameter = self.parameter.unwrap_or_default();
        let regressor = self.regressor.map(|StatedRegressor { channel, minus, reference }| RegressorParts {
            channel: source(channel),
            minus: minus.map(source),
            reference,
        });
        TermParts { feature: self.feature, parameter, regressor, coefficient }
    }
}

impl<'d> From<&'d Regressor> for StatedRegressor<'d> {
    fn from(Regressor { channel, minus, reference, .. }: &'d Regressor) -> Self {
        Self { channel, minus: minus.as_deref(), reference: *reference }
    }
}

impl<'d> From<&'d AccelRegressor> for StatedRegressor<'d> {
    fn from(AccelRegressor { channel, minus, reference, .. }: &'d AccelRegressor) -> Self {
        Self { channel, minus: minus.as_deref(), reference: *reference }
    }
}

/// Terms found so far, of one kind of sensor.
struct Terms<'d> {
    declared: &'static [Term],
    found: Vec<StatedTerm<'d>>,
}

impl<'d> Terms<'d> {
    fn key(&self, feature: Feature) -> &'static str {
        self.declared.iter().find(|term| term.feature == feature).map_or("", |term| term.key)
    }

    fn curve<Q: Quantity>(&mut self, feature: Feature, curve: Option<&'d Curve<Q>>) {
        let key = self.key(feature).to_owned();
        let coefficient = curve.map(|curve| StatedCoefficient::Curve(curve));
        let term = |coefficient| StatedTerm { feature, key, parameter: None, regressor: None, coefficient };
        self.found.extend(coefficient.map(term));
    }

    fn branches<Q: Quantity>(&mut self, feature: Feature, branches: Option<&'d Branches<Curve<Q>>>) {
        let Some(Branches { run_up, braking }) = branches else { return };
        let coefficient = StatedCoefficient::Branched { run_up, braking };
        let key = self.key(feature).to_owned();
        self.found.push(StatedTerm { feature, key, parameter: None, regressor: None, coefficient });
    }

    /// Terms that may stand more than once, each with its parameter.
    fn list<Q: Quantity>(&mut self, feature: Feature, stated: impl Iterator<Item = (f64, &'d Curve<Q>)>) {
        let key = self.key(feature);
        for (i, (parameter, gain)) in stated.enumerate() {
            self.found.push(StatedTerm {
                feature,
                key: element(key, i),
                parameter: Some(parameter),
                regressor: None,
                coefficient: StatedCoefficient::Curve(gain),
            });
        }
    }

    fn regressors<Q: Quantity>(&mut self, stated: impl Iterator<Item = (StatedRegressor<'d>, &'d Curve<Q>)>) {
        let key = self.key(Feature::Regressor);
        for (i, (regressor, gain)) in stated.enumerate() {
            self.found.push(StatedTerm {
                feature: Feature::Regressor,
                key: element(key, i),
                parameter: None,
                regressor: Some(regressor),
                coefficient: StatedCoefficient::Curve(gain),
            });
        }
    }

    fn along_axes<Q: Quantity>(&mut self, features: [Feature; 3], curves: Option<&'d AlongAxes<Curve<Q>>>) {
        let Some(AlongAxes { x, y, z }) = curves else { return };
        for (feature, curve) in features.into_iter().zip([x, y, z]) {
            self.curve(feature, curve.as_ref());
        }
    }
}

impl GyroSensor {
    /// Every term that it states.
    pub(super) fn terms(&self) -> Vec<StatedTerm<'_>> {
        let mut terms = Terms { declared: &GYRO_TERMS, found: Vec::new() };
        terms.curve(Feature::Reading, self.increment_weight_error.as_ref());
        terms.curve(Feature::One, self.static_bias.as_ref());
        terms.curve(Feature::LasingMode, self.magnetic_bias.as_ref());
        terms.curve(Feature::Meander, self.slow_meander.as_ref());
        terms.branches(Feature::ThermalRate, self.thermal_rate.as_ref());
        terms.branches(Feature::ThermalAcceleration, self.thermal_acceleration.as_ref());
        terms.list(Feature::Lag, self.lag.iter().map(|lag| (lag.time_constant_s, &lag.gain)));
        let plays = self.hysteresis.iter().map(|play| (play.half_width_deg_c, &play.gain));
        terms.list(Feature::Play, plays);
        terms.regressors(self.regressor.iter().map(|stated| (stated.into(), &stated.gain)));
        terms.curve(Feature::RateMagnitude, self.increment_weight_asymmetry.as_ref());
        let axes = [Feature::ForceX, Feature::ForceY, Feature::ForceZ];
        terms.along_axes(axes, self.acceleration_sensitive_drift.as_ref());
        terms.found
    }
}

impl AccelSensor {
    /// Every term that it states.
    pub(super) fn terms(&self) -> Vec<StatedTerm<'_>> {
        let mut terms = Terms { declared: &ACCEL_TERMS, found: Vec::new() };
        terms.curve(Feature::One, self.bias.as_ref());
        terms.list(Feature::Lag, self.lag.iter().map(|lag| (lag.time_constant_s, &lag.gain)));
        let plays = self.hysteresis.iter().map(|play| (play.half_width_deg_c, &play.gain));
        terms.list(Feature::Play, plays);
        terms.regressors(self.regressor.iter().map(|stated| (stated.into(), &stated.gain)));
        terms.curve(Feature::ForceSquared, self.second_order.as_ref());
        terms.found
    }
}
