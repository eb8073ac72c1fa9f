//! Collects everything that is wrong.

use alloc::borrow::ToOwned;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::super::defect::{Defect, DefectKind, Section};
use super::super::parts::Source;
use crate::curve::CurveError;
use crate::sample::ChannelName;

/// Collects defects.
pub(super) struct Checker {
    pub(super) defects: Vec<Defect>,
    section: Section,
    /// How many temperature channels there are to be named.
    channels: usize,
    /// How many auxiliary ones.
    auxiliaries: usize,
}

impl Checker {
    pub(super) fn new(channels: usize, auxiliaries: usize) -> Self {
        Self { defects: Vec::new(), section: Section::Filter, channels, auxiliaries }
    }

    /// What is looked at from now on is part of this section.
    pub(super) fn at(&mut self, section: Section) -> &mut Self {
        self.section = section;
        self
    }

    pub(super) fn push(&mut self, field: &str, kind: impl Into<DefectKind>) {
        self.defects.push(Defect { section: self.section, field: field.to_owned(), kind: kind.into() });
    }

    /// What is wrong with a curve, in its place.
    pub(super) fn curve(&mut self, field: &str, error: CurveError) {
        self.push(&format!("{field}{}", error.place()), error);
    }

    pub(super) fn within(&mut self, field: &str, value: f64, low: f64, high: f64) {
        if !(low..=high).contains(&value) {
            self.push(field, DefectKind::OutOfRange { value, low, high });
        }
    }

    pub(super) fn positive(&mut self, field: &str, value: f64) {
        self.within(field, value, f64::MIN_POSITIVE, HUGE);
    }

    pub(super) fn count(&mut self, field: &str, count: usize, low: usize, high: usize) {
        if !(low..=high).contains(&count) {
            self.push(field, DefectKind::Count { count, low, high });
        }
    }

    /// Coefficients of a polynomial, at least one of them.
    pub(super) fn coefficients(&mut self, field: &str, coefficients: &[f64], most: usize) {
        self.count(field, coefficients.len(), 1, most);
        for &coefficient in coefficients {
            self.within(field, coefficient, -HUGE, HUGE);
        }
    }

    /// A range that runs upwards and lies within limits.
    pub(super) fn range(&mut self, field: &str, [from, to]: [f64; 2], low: f64, high: f64) {
        if from >= to {
            self.push(field, DefectKind::InvertedRange { low: from, high: to });
        }
        for end in [from, to] {
            self.within(field, end, low, high);
        }
    }

    pub(super) fn channel(&mut self, field: &str, index: Option<usize>) {
        let channels = self.channels;
        if let Some(index) = index.filter(|index| *index >= channels) {
            self.push(field, DefectKind::NoSuchChannel { index, channels });
        }
    }

    /// A channel of either kind.
    pub(super) fn source(&mut self, field: &str, source: Source) {
        let (index, channels) = match source {
            Source::Temperature(index) => (index, self.channels),
            Source::Auxiliary(index) => (index, self.auxiliaries),
        };
        if index >= channels {
            self.push(field, DefectKind::NoSuchChannel { index, channels });
        }
    }

    /// A name that none of the earlier things has; each of these with what it is, its index and its name.
    pub(super) fn unique(
        &mut self,
        name: ChannelName,
        mut earlier: impl Iterator<Item = (&'static str, usize, ChannelName)>,
    ) {
        if let Some((of, other, _)) = earlier.find(|(.., taken)| *taken == name) {
            self.push("name", DefectKind::DuplicateName { of, other });
        }
    }

    /// What was compiled; its errors otherwise, each with the field that it speaks of.
    pub(super) fn compiled<T, E: Into<DefectKind>>(
        &mut self,
        compiled: Result<T, Vec<E>>,
        field: impl Fn(&E) -> String,
    ) -> Option<T> {
        let errors = compiled.map_err(|errors| {
            for error in errors {
                self.push(&field(&error), error);
            }
        });
        errors.ok()
    }
}

/// Largest finite magnitude that a coefficient may have: far beyond any instrument, safe to multiply.
pub(super) const HUGE: f64 = 1e100;
