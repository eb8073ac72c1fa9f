//! Every metric: name, type, unit of measure, labels, meaning, and where its value comes from.
//!
//! Names follow Prometheus' practice: base units at their end, `_total` behind what only grows. What a unit or channel
//! does not have, it has no sample of.

mod counters;
mod service;
mod unit;

use std::fmt;

use super::page::{Samples, Type};
use super::source::{Look, UnitLook};

/// A metric, and all its samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Family {
    /// Name, without the unit of measure and `_total`.
    pub(super) name: &'static str,
    /// Unit of measure, as it stands at the end of the name; empty for a number of things.
    pub(super) unit: &'static str,
    /// Type.
    pub(super) kind: Type,
    /// Names of its labels.
    pub(super) labels: &'static [&'static str],
    /// What it says.
    pub(super) help: &'static str,
    source: Source,
}

/// What its samples are of.
#[derive(Debug, Clone, Copy)]
enum Source {
    Service(OfService),
    /// Each unit by itself, with its serial.
    Unit(OfUnit),
}

type OfService = fn(&Look, &mut Samples<'_>) -> fmt::Result;
type OfUnit = fn(&str, &UnitLook, &mut Samples<'_>) -> fmt::Result;

type Text = &'static str;
/// Name and unit of measure, as in [`Family`].
type Name = (Text, Text);
type Labels = &'static [Text];

impl Family {
    /// A gauge of the service.
    const fn gauge((name, unit): Name, labels: Labels, help: Text, samples: OfService) -> Self {
        Self { name, unit, kind: Type::Gauge, labels, help, source: Source::Service(samples) }
    }

    /// A counter of the service.
    const fn counter((name, unit): Name, labels: Labels, help: Text, samples: OfService) -> Self {
        Self { kind: Type::Counter, ..Self::gauge((name, unit), labels, help, samples) }
    }

    /// A gauge of each unit.
    const fn unit_gauge((name, unit): Name, labels: Labels, help: Text, samples: OfUnit) -> Self {
        Self { name, unit, kind: Type::Gauge, labels, help, source: Source::Unit(samples) }
    }

    /// A counter of each unit.
    const fn unit_counter((name, unit): Name, labels: Labels, help: Text, samples: OfUnit) -> Self {
        Self { kind: Type::Counter, ..Self::unit_gauge((name, unit), labels, help, samples) }
    }

    /// A histogram of each unit.
    const fn unit_histogram((name, unit): Name, labels: Labels, help: Text, samples: OfUnit) -> Self {
        Self { kind: Type::Histogram, ..Self::unit_gauge((name, unit), labels, help, samples) }
    }

    /// Gives its samples.
    pub(super) fn give(&self, look: &Look, out: &mut Samples<'_>) -> fmt::Result {
        match self.source {
            Source::Service(samples) => samples(look, out),
            Source::Unit(samples) => {
                look.units.iter().try_for_each(|unit| samples(&unit.status.unit, unit, out))
            }
        }
    }
}

/// Every metric, in the order of the page.
pub(super) fn all() -> impl Iterator<Item = &'static Family> {
    service::FAMILIES.iter().chain(unit::FAMILIES).chain(counters::FAMILIES)
}

#[cfg(test)]
mod tests;
