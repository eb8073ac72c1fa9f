//! Parts of a document with nothing in them: what documents that are made begin with.

use isotherm_correction::thermal::Feature;

use super::{AccelSensor, GyroSensor, Orientation};
use crate::document::measure::BaseUnit;
use crate::document::{Curve, StatedTerm};

impl GyroSensor {
    /// A gyro without any term, channel or increment weight.
    #[must_use]
    pub fn bare(name: &str) -> Self {
        Self { name: name.to_owned(), ..Self::default() }
    }

    /// Adds a term, in its unit; it replaces one that may stand once only.
    pub fn put(&mut self, term: StatedTerm) {
        self.terms.put(term, BaseUnit::DegPerH);
    }

    /// Sets the term of a feature to a curve, or takes it out.
    pub fn set(&mut self, feature: Feature, curve: impl Into<Option<Curve>>) {
        self.terms.set(feature, curve.into(), BaseUnit::DegPerH);
    }

    /// The same sensor with a term of one curve.
    #[must_use]
    pub fn with(mut self, feature: Feature, curve: Curve) -> Self {
        self.set(feature, curve);
        self
    }
}

impl AccelSensor {
    /// An accelerometer with a scale factor and nothing else.
    #[must_use]
    pub fn bare(name: &str, scale_factor: Curve) -> Self {
        Self { name: name.to_owned(), scale_factor, ..Self::default() }
    }

    /// Adds a term, in its unit beside that of the scale factor; it replaces one that may stand once only.
    pub fn put(&mut self, term: StatedTerm) {
        self.terms.put(term, self.scale_factor.unit().base);
    }

    /// Sets the term of a feature to a curve, or takes it out.
    pub fn set(&mut self, feature: Feature, curve: impl Into<Option<Curve>>) {
        self.terms.set(feature, curve.into(), self.scale_factor.unit().base);
    }

    /// The same sensor with a term of one curve.
    #[must_use]
    pub fn with(mut self, feature: Feature, curve: Curve) -> Self {
        self.set(feature, curve);
        self
    }
}

impl<P> Orientation<P> {
    /// Three sensors along the case axes.
    #[must_use]
    pub fn along_case_axes() -> Self {
        Self {
            rows: vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            weights: None,
            thermal: None,
            parity: None,
        }
    }
}
