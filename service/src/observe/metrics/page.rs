//! A look as `OpenMetrics` text.

use std::fmt;
use std::io::{self, Write};

use flate2::Compression;
use flate2::write::GzEncoder;
use prometheus_client::collector::Collector;
use prometheus_client::encoding::{
    DescriptorEncoder, EncodeLabel, EncodeLabelSet, LabelSetEncoder, MetricEncoder, NoLabelSet, text,
};
use prometheus_client::metrics::MetricType;
use prometheus_client::registry::{Registry, Unit};

use super::families;
use super::source::Look;

/// Every metric of a look.
///
/// # Errors
/// None that is known of: writing to a string does not fail.
pub(super) fn page(look: Look) -> io::Result<String> {
    let mut registry = Registry::default();
    registry.register_collector(Box::new(look));
    let mut page = String::new();
    text::encode(&mut page, &registry).map_err(io::Error::other)?;
    Ok(page)
}

/// A page in a tenth of its bytes, for those who take it so.
///
/// # Errors
/// None that is known of, likewise.
pub(super) fn pack(page: &str) -> io::Result<Vec<u8>> {
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(page.as_bytes())?;
    packed.finish()
}

impl Collector for Look {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> fmt::Result {
        for family in families::all() {
            let unit = (!family.unit.is_empty()).then(|| Unit::Other(family.unit.to_owned()));
            let kind = match family.kind {
                Type::Counter => MetricType::Counter,
                Type::Gauge => MetricType::Gauge,
                Type::Histogram => MetricType::Histogram,
            };
            let encoder = encoder.encode_descriptor(family.name, family.help, unit.as_ref(), kind)?;
            family.give(self, &mut Samples { encoder, labels: family.labels })?;
        }
        Ok(())
    }
}

/// Type of a metric.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Type {
    /// Only grows, except over a restart.
    Counter,
    /// The present value of something.
    Gauge,
    /// Cumulative counts below bounds.
    Histogram,
}

/// Where the samples of one family go.
#[derive(Debug)]
pub(super) struct Samples<'p> {
    encoder: MetricEncoder<'p>,
    labels: &'static [&'static str],
}

impl Samples<'_> {
    /// A counter's value; `labels` are the values of the family's labels, in their order.
    pub(super) fn counter(&mut self, labels: &[&str], value: u64) -> fmt::Result {
        self.with(labels, |encoder| encoder.encode_counter::<NoLabelSet, _, f64>(&value, None))
    }

    /// A gauge's value; what is no finite number is left out.
    pub(super) fn gauge(&mut self, labels: &[&str], value: f64) -> fmt::Result {
        if value.is_finite() { self.with(labels, |encoder| encoder.encode_gauge(&value)) } else { Ok(()) }
    }

    /// A gauge's value that is a whole number.
    pub(super) fn whole(&mut self, labels: &[&str], value: u64) -> fmt::Result {
        self.with(labels, |encoder| encoder.encode_gauge(&value))
    }

    /// 1 for yes, 0 for no.
    pub(super) fn flag(&mut self, labels: &[&str], value: bool) -> fmt::Result {
        self.whole(labels, value.into())
    }

    /// A histogram: sum and number of what was counted, upper bounds with the counts from one to the next.
    pub(super) fn histogram(
        &mut self,
        labels: &[&str],
        sum: f64,
        count: u64,
        buckets: &[(f64, u64)],
    ) -> fmt::Result {
        self.with(labels, |encoder| encoder.encode_histogram::<NoLabelSet>(sum, count, buckets, None))
    }

    fn with(
        &mut self,
        values: &[&str],
        encode: impl FnOnce(&mut MetricEncoder<'_>) -> fmt::Result,
    ) -> fmt::Result {
        if values.is_empty() {
            return encode(&mut self.encoder);
        }
        let labels = Labels { names: self.labels, values };
        encode(&mut self.encoder.encode_family(&labels)?)
    }
}

/// Names of labels, and their values for one sample.
struct Labels<'l> {
    names: &'static [&'static str],
    values: &'l [&'l str],
}

impl EncodeLabelSet for Labels<'_> {
    fn encode(&self, encoder: &mut LabelSetEncoder<'_>) -> fmt::Result {
        let mut labels = self.names.iter().zip(self.values);
        labels.try_for_each(|(name, value)| (*name, *value).encode(encoder.encode_label()))
    }
}
