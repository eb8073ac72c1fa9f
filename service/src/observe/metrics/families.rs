//! Every metric: name, type, unit of measure, labels, meaning, and where its value comes from.
//!
//! Names follow Prometheus' practice: base units at their end, `_total` behind what only grows. What a unit or channel
//! does not have, it has no sample of.

mod counters;
mod service;
mod unit;

use std::fmt;

use super::page::{Samples, Type};
use super::source::Look;

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
    /// Gives its samples.
    pub(super) samples: fn(&Look, &mut Samples<'_>) -> fmt::Result,
}

/// Every metric, in the order of the page.
pub(super) fn all() -> impl Iterator<Item = &'static Family> {
    service::FAMILIES.iter().chain(unit::FAMILIES).chain(counters::FAMILIES)
}

#[cfg(test)]
mod tests;
