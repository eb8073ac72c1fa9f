//! Every metric: name, type, unit of measure, labels, meaning, and where its value comes from.
//!
//! Names follow Prometheus' practice: base units at their end, `_total` behind what only grows. What a unit or channel
//! does not have, it has no sample of.

mod counters;
mod service;
mod unit;

use std::fmt;

use prometheus_client::encoding::{MetricEncoder, NoLabelSet};
pub(super) use prometheus_client::metrics::MetricType as Type;

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
    /// Names of its labels, but for that of the unit.
    pub(super) labels: &'static [&'static str],
    /// What it says.
    pub(super) help: &'static str,
    source: Source,
}

/// What its samples are of.
#[derive(Debug, Clone, Copy)]
enum Source {
    Service(fn(&Look) -> Vec<Sample<'_>>),
    /// Each unit by itself; its serial is the first label.
    Unit(fn(&UnitLook) -> Vec<Sample<'_>>),
}

/// One value of a metric.
#[derive(Debug)]
pub(super) struct Sample<'l> {
    /// Values of the labels, in their order.
    pub(super) labels: Vec<&'l str>,
    pub(super) value: Value,
}

#[derive(Debug)]
pub(super) enum Value {
    /// A number of things, or 1 for yes and 0 for no.
    Whole(u64),
    /// A quantity; what is no finite number is left out.
    Number(f64),
    /// Sum and number of what was counted, upper bounds with the counts from one to the next.
    Histogram(f64, u64, Vec<(f64, u64)>),
}

impl Value {
    pub(super) fn encode(&self, kind: Type, encoder: &mut MetricEncoder<'_>) -> fmt::Result {
        match (self, kind) {
            (Self::Whole(value), Type::Counter) => encoder.encode_counter::<NoLabelSet, _, f64>(value, None),
            (Self::Whole(value), _) => encoder.encode_gauge(value),
            (Self::Number(value), _) => encoder.encode_gauge(value),
            (Self::Histogram(sum, count, buckets), _) => {
                encoder.encode_histogram::<NoLabelSet>(*sum, *count, buckets, None)
            }
        }
    }
}

impl From<u64> for Value {
    fn from(count: u64) -> Self {
        Self::Whole(count)
    }
}

impl From<bool> for Value {
    fn from(flag: bool) -> Self {
        Self::Whole(flag.into())
    }
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

/// A metric without labels of its own, or none where nothing is known.
fn known<'l>(value: Option<impl Into<Value>>) -> Vec<Sample<'l>> {
    value.into_iter().map(|value| Sample { labels: Vec::new(), value: value.into() }).collect()
}

/// A metric without labels of its own.
fn one<'l>(value: impl Into<Value>) -> Vec<Sample<'l>> {
    known(Some(value))
}

/// A value for each value of a label.
fn each<'l, V: Into<Value>>(values: impl IntoIterator<Item = (&'l str, V)>) -> Vec<Sample<'l>> {
    values.into_iter().map(|(label, value)| Sample { labels: vec![label], value: value.into() }).collect()
}

/// Metrics as a table: type, name, unit of measure, labels, what it says, and the samples.
macro_rules! families {
    ($of:ident $prefix:literal: $($kind:ident $name:literal $unit:literal [$($label:literal),*] $help:literal
        |$look:ident| $samples:expr;)+) => {
        pub(super) const FAMILIES: &[Family] = &[$(Family {
            name: concat!($prefix, $name),
            unit: $unit,
            kind: Type::$kind,
            labels: &[$($label),*],
            help: $help,
            source: Source::$of(|$look| $samples),
        },)+];
    };
}
use families;

impl Family {
    /// Names of all labels, in their order.
    pub(super) fn label_names(&self) -> impl Iterator<Item = &'static str> {
        let unit = matches!(self.source, Source::Unit(_)).then_some("unit");
        unit.into_iter().chain(self.labels.iter().copied())
    }

    /// Its samples in a look.
    pub(super) fn samples<'l>(&self, look: &'l Look) -> Vec<Sample<'l>> {
        match self.source {
            Source::Service(samples) => samples(look),
            Source::Unit(samples) => {
                let of_unit = |unit: &'l UnitLook| {
                    samples(unit).into_iter().map(|mut sample| {
                        sample.labels.insert(0, unit.status.unit.as_str());
                        sample
                    })
                };
                look.units.iter().flat_map(of_unit).collect()
            }
        }
    }
}

/// All of them.
pub(super) fn all() -> impl Iterator<Item = &'static Family> {
    service::FAMILIES.iter().chain(unit::FAMILIES).chain(counters::FAMILIES)
}

#[cfg(test)]
mod tests;
