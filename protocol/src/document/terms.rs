//! The terms of a document's sensors: read, written and described by their declarations in the core.

mod schema;
mod written;

use std::marker::PhantomData;

use isotherm_correction::calibration::{
    BranchArgument, BranchedParts, CoefficientParts, RegressorParts, Source, TermParts,
};
use isotherm_correction::thermal::{ACCEL_TERMS, Feature, GYRO_TERMS, Makes, Term, TermForm};
use isotherm_document::join;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::curve::Curve;
use super::measure::{Argument, BaseUnit, Unit};

/// A kind of sensor.
pub trait SensorKind: std::fmt::Debug + Clone + PartialEq + Default + 'static {
    /// Its terms, in the order of documents.
    const TERMS: &'static [Term];
    /// What its biases are in, the usual one first.
    const BIAS: &'static [BaseUnit];
}

/// Gyros.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Gyros;

/// Accelerometers, whose biases are in units of their output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Accels;

impl SensorKind for Gyros {
    const TERMS: &'static [Term] = &GYRO_TERMS;
    const BIAS: &'static [BaseUnit] = &[BaseUnit::DegPerH];
}

impl SensorKind for Accels {
    const TERMS: &'static [Term] = &ACCEL_TERMS;
    const BIAS: &'static [BaseUnit] = &[BaseUnit::CountsPerS, BaseUnit::V, BaseUnit::MPerS2];
}

/// The terms that a sensor states, in the order of documents.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Terms<K> {
    stated: Vec<StatedTerm>,
    kind: PhantomData<K>,
}

/// A term that a sensor states.
#[derive(Debug, Clone, PartialEq)]
pub struct StatedTerm {
    /// What its coefficient is multiplied by.
    pub feature: Feature,
    /// τ of a lag (s), half width of a play (°C); 0 for any other.
    pub parameter: f64,
    /// What a regressor is.
    pub regressor: Option<Regressor>,
    /// Its coefficient; of one that is branched, the "+" curve: Ṫ·T̈ > 0.
    pub coefficient: Curve,
    /// The "−" curve of a coefficient that is branched, over the same argument: Ṫ·T̈ < 0.
    pub braking: Option<Curve>,
}

/// What a regressor is but for its gain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub struct Regressor {
    /// x.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub channel: String,
    /// Subtracted channel.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub minus: Option<String>,
    /// Subtracted constant.
    #[serde(default)]
    pub reference: f64,
}

impl StatedTerm {
    /// A term with one curve.
    #[must_use]
    pub fn new(feature: Feature, curve: Curve) -> Self {
        Self { feature, parameter: 0.0, regressor: None, coefficient: curve, braking: None }
    }

    /// A term with a curve for each thermal branch.
    #[must_use]
    pub fn branched(feature: Feature, [run_up, braking]: [Curve; 2]) -> Self {
        Self { braking: Some(braking), ..Self::new(feature, run_up) }
    }

    /// A lag of a time constant (s) or a play of a half width (°C).
    #[must_use]
    pub fn with_parameter(feature: Feature, parameter: f64, gain: Curve) -> Self {
        Self { parameter, ..Self::new(feature, gain) }
    }

    /// A regressor.
    #[must_use]
    pub fn regressor(regressor: Regressor, gain: Curve) -> Self {
        Self { regressor: Some(regressor), ..Self::new(Feature::Regressor, gain) }
    }

    /// Its one curve.
    #[must_use]
    pub fn curve(&self) -> Option<&Curve> {
        self.braking.is_none().then_some(&self.coefficient)
    }

    /// Its curves, in the order of [`TermForm::curves`].
    fn curves(&self) -> impl Iterator<Item = &Curve> {
        std::iter::once(&self.coefficient).chain(&self.braking)
    }

    fn curves_mut(&mut self) -> impl Iterator<Item = &mut Curve> {
        std::iter::once(&mut self.coefficient).chain(&mut self.braking)
    }

    /// What the core gets; `source` gives a channel by its name.
    pub(super) fn to_parts(&self, source: impl Fn(&str) -> Source) -> TermParts {
        let curve = self.coefficient.to_parts(0.0);
        let coefficient = match &self.braking {
            None => CoefficientParts::Curve(curve),
            Some(braking) => CoefficientParts::Branched(BranchedParts {
                argument: match self.coefficient.argument().or(braking.argument()) {
                    None | Some(Argument::DegC) => BranchArgument::Temperature,
                    Some(_) => BranchArgument::Derivative,
                },
                run_up: curve,
                braking: braking.to_parts(0.0),
            }),
        };
        let regressor = self.regressor.as_ref().map(|stated| RegressorParts {
            channel: source(&stated.channel),
            minus: stated.minus.as_deref().map(source),
            reference: stated.reference,
        });
        TermParts { feature: self.feature, parameter: self.parameter, regressor, coefficient }
    }
}

impl<K: SensorKind> Terms<K> {
    fn place(feature: Feature) -> Option<usize> {
        K::TERMS.iter().position(|term| term.feature == feature)
    }

    /// Adds a term in the unit of a sensor whose biases are in `bias`; it replaces one that may stand once only. A term that
    /// the kind of sensor does not have changes nothing.
    pub(super) fn put(&mut self, mut stated: StatedTerm, bias: BaseUnit) {
        let Some(term) = Self::place(stated.feature).and_then(|place| K::TERMS.get(place)) else { return };
        let (unit, arguments) = (unit(term, bias), arguments(term));
        stated.curves_mut().for_each(|curve| curve.fit(unit, &arguments));
        if term.form.most() == 1 {
            self.remove(stated.feature);
        }
        self.stated.push(stated);
        self.stated.sort_by_key(|stated| Self::place(stated.feature));
    }

    /// Sets the term of a feature to a curve, or takes it out.
    pub(super) fn set(&mut self, feature: Feature, curve: Option<Curve>, bias: BaseUnit) {
        self.remove(feature);
        if let Some(curve) = curve {
            self.put(StatedTerm::new(feature, curve), bias);
        }
    }

    /// Takes a term out, all of it where it stands more than once.
    pub fn remove(&mut self, feature: Feature) {
        self.retain(|stated| stated != feature);
    }

    /// Keeps the terms of some features.
    pub fn retain(&mut self, keep: impl Fn(Feature) -> bool) {
        self.stated.retain(|stated| keep(stated.feature));
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &StatedTerm> {
        self.stated.iter()
    }

    /// Those of a feature.
    pub fn of(&self, feature: Feature) -> impl Iterator<Item = &StatedTerm> {
        self.iter().filter(move |stated| stated.feature == feature)
    }

    /// Whether one of a feature is stated.
    #[must_use]
    pub fn has(&self, feature: Feature) -> bool {
        self.of(feature).next().is_some()
    }

    /// The one curve of a feature's term.
    #[must_use]
    pub fn curve(&self, feature: Feature) -> Option<&Curve> {
        self.of(feature).next()?.curve()
    }

    /// All of them, each with its path; `sensor` is that of the sensor's table.
    pub(super) fn keyed(&self, sensor: &str) -> Vec<KeyedTerm<'_>> {
        let of_term = |term: &'static Term| {
            let path = move |i| format!("{sensor}.{}", term.path(i));
            self.of(term.feature).enumerate().map(move |(i, stated)| KeyedTerm {
                term,
                path: path(i),
                stated,
            })
        };
        K::TERMS.iter().flat_map(of_term).collect()
    }
}

/// A term with its declaration and its path.
#[derive(Debug)]
pub(super) struct KeyedTerm<'d> {
    pub(super) term: &'static Term,
    pub(super) path: String,
    pub(super) stated: &'d StatedTerm,
}

impl<'d> KeyedTerm<'d> {
    /// Its curves, each with its path.
    pub(super) fn curves(&self) -> impl Iterator<Item = (String, &'d Curve)> {
        let mut keys = self.term.form.curves().iter();
        self.stated.curves().map(move |curve| {
            let path = &self.path;
            (keys.next().map_or_else(|| path.clone(), |key| join(path, key)), curve)
        })
    }
}

/// Unit of a term's coefficient, of a sensor whose biases are in `bias`.
pub(super) fn unit(term: &Term, bias: BaseUnit) -> Unit {
    let base = match term.makes {
        Makes::Bias => bias,
        Makes::ScaleError => BaseUnit::Ppm,
        Makes::Force => BaseUnit::MicroG,
    };
    base.per(term.per)
}

/// Arguments of a term's curves: temperature, and the feature where the coefficient is branched.
fn arguments(term: &Term) -> Vec<Argument> {
    let feature = Argument::ALL.into_iter().filter(|argument| {
        matches!(term.form, TermForm::Branches)
            && term.per.key.strip_prefix("_per_") == Some(argument.suffix())
    });
    std::iter::once(Argument::DegC).chain(feature).collect()
}
