//! A look as `OpenMetrics` text.

use std::fmt;
use std::io::{self, Write};

use flate2::Compression;
use flate2::write::GzEncoder;
use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, EncodeLabel, EncodeLabelSet, LabelSetEncoder, text};
use prometheus_client::registry::{Registry, Unit};

use super::families::{self, Family, Sample, Value};
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
            let Family { name, help, kind, .. } = *family;
            let mut encoder = encoder.encode_descriptor(name, help, unit.as_ref(), kind)?;
            for Sample { labels, value } in family.samples(self) {
                if matches!(value, Value::Number(number) if !number.is_finite()) {
                    continue;
                }
                if labels.is_empty() {
                    value.encode(kind, &mut encoder)?;
                } else {
                    value.encode(kind, &mut encoder.encode_family(&Labels(family, &labels))?)?;
                }
            }
        }
        Ok(())
    }
}

/// Labels of a metric with their values for one sample.
struct Labels<'l>(&'static Family, &'l [&'l str]);

impl EncodeLabelSet for Labels<'_> {
    fn encode(&self, encoder: &mut LabelSetEncoder<'_>) -> fmt::Result {
        let mut labels = self.0.label_names().zip(self.1);
        labels.try_for_each(|(name, value)| (name, *value).encode(encoder.encode_label()))
    }
}
