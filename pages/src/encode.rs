//! A chart as text: its shape as JSON, its numbers as compressed arrays in base64.

use std::fmt::Write as _;
use std::io::Write as _;

use base64ct::{Base64Unpadded, Encoding};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde_json::{Value, json};

use super::chart::{Chart, Content, Lane, Panel, Places, Samples, Series};

/// The numbers of a page, each list once.
#[derive(Debug, Clone, Default)]
pub(super) struct Store {
    /// Each list: kind of its numbers; they themselves, compressed, as base64.
    lists: Vec<(&'static str, String)>,
}

impl Store {
    /// The chart's shape as JSON that may stand inside a script element; its numbers are taken into the store.
    pub(super) fn chart(&mut self, chart: &Chart) -> String {
        let panels: Vec<_> = chart.panels.iter().map(|panel| self.panel(panel)).collect();
        let shape = json!({ "x": chart.x, "panels": panels, "marks": chart.marks });
        shape.to_string().replace('<', "\\u003c")
    }

    /// The lists, as elements of the page.
    pub(super) fn to_html(&self) -> String {
        let mut html = String::with_capacity(self.lists.iter().map(|(_, list)| list.len() + 80).sum());
        for (index, (kind, list)) in self.lists.iter().enumerate() {
            // Writing to a string cannot fail.
            let _ = writeln!(
                html,
                "<script type=\"text/plain\" id=\"data{index}\" data-type=\"{kind}\">{list}</script>"
            );
        }
        html
    }

    fn panel(&mut self, panel: &Panel) -> Value {
        let (kind, rows): (_, Vec<_>) = match &panel.content {
            Content::Series(series) => ("series", series.iter().map(|series| self.series(series)).collect()),
            Content::Lanes(lanes) => ("lanes", lanes.iter().map(|lane| self.lane(lane)).collect()),
        };
        json!({
            "title": panel.title, "unit": panel.unit, "height": panel.height, "logarithmic": panel.logarithmic,
            kind: rows,
        })
    }

    fn series(&mut self, series: &Series) -> Value {
        let samples = match &series.samples {
            Samples::Points { x, y } => json!({ "x": self.places(x), "y": self.values(y) }),
            Samples::Bins { first, width, min, max, mean } => json!({
                "first": first, "width": width,
                "min": self.values(min), "max": self.values(max), "mean": self.values(mean),
            }),
        };
        json!({ "name": series.name, "ink": series.ink, "form": series.form, "dashes": series.dashes, "samples": samples })
    }

    fn lane(&mut self, lane: &Lane) -> Value {
        match lane {
            Lane::Stretches { name, stretches } => json!({ "name": name, "stretches": stretches }),
            Lane::Bit { name, ink, bit, bits, places } => {
                let list = json!({ "list": self.add("u32", &bits.0.iter().map(|bits| bits.to_le_bytes())) });
                let samples = match places {
                    Places::Points(x) => json!({ "x": self.places(x), "bits": list }),
                    Places::Bins { first, width } => json!({ "first": first, "width": width, "bits": list }),
                };
                json!({ "name": name, "ink": ink, "bit": bit, "samples": samples })
            }
        }
    }

    fn places(&mut self, list: &[f64]) -> Value {
        json!({ "list": self.add("f64", &list.iter().map(|value| value.to_le_bytes())) })
    }

    /// Values as their distances from their median, each to 2·10⁻⁶ of itself: what is left of single precision without its last
    /// four bits, which would be noise that does not compress. A spike, however high, takes nothing from the others' precision.
    fn values(&mut self, list: &[f64]) -> Value {
        let mut finite: Vec<f64> = list.iter().copied().filter(|value| value.is_finite()).collect();
        let half = finite.len() / 2;
        let middle =
            if finite.is_empty() { 0.0 } else { *finite.select_nth_unstable_by(half, f64::total_cmp).1 };
        // Whatever is no finite number is a gap.
        let distance = |value: &f64| if value.is_finite() { value - middle } else { f64::NAN };
        #[expect(clippy::cast_possible_truncation, reason = "single precision is what is wanted")]
        let short = |value| {
            let near = (distance(value) as f32).clamp(f32::MIN, f32::MAX);
            f32::from_bits(near.to_bits() & !0xf)
        };
        let values = list.iter().map(|value| short(value).to_le_bytes());
        json!({ "list": self.add("f32", &values), "middle": middle })
    }

    /// Takes a list of numbers of a kind, in bytes; its index. Equal lists are one.
    ///
    /// First bytes of all numbers stand first, then their second ones, and so on: high bytes vary little and shrink to nothing.
    fn add<const N: usize>(
        &mut self,
        kind: &'static str,
        numbers: &(impl Iterator<Item = [u8; N]> + Clone),
    ) -> usize {
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
        for byte in 0..N {
            let plane: Vec<u8> = numbers.clone().filter_map(|number| number.get(byte).copied()).collect();
            // Writing to memory cannot fail.
            let _ = packed.write_all(&plane);
        }
        let list = (kind, Base64Unpadded::encode_string(&packed.finish().unwrap_or_default()));
        let known = self.lists.iter().position(|known| *known == list);
        known.unwrap_or_else(|| {
            self.lists.push(list);
            self.lists.len() - 1
        })
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    #[test]
    fn a_spike_takes_nothing_from_the_values_beside_it() {
        let values = [9.8065, 9.8066, 1e300, 9.8067, f64::NAN, -1e12, 9.8068];
        let mut store = Store::default();
        let middle = store.values(&values)["middle"].as_f64().unwrap();
        let packed = Base64Unpadded::decode_vec(&store.lists[0].1).unwrap();
        let mut planes = Vec::new();
        flate2::read::ZlibDecoder::new(&packed[..]).read_to_end(&mut planes).unwrap();
        let count = values.len();
        let back = |place| {
            let bytes: [u8; 4] = std::array::from_fn(|byte| planes[byte * count + place]);
            f64::from(f32::from_le_bytes(bytes)) + middle
        };
        for place in [0, 1, 3, 6] {
            assert!((back(place) - values[place]).abs() < 1e-9, "{} for {}", back(place), values[place]);
        }
        assert!(back(4).is_nan() && back(2).is_finite() && back(2) > 1e38 && back(5) < -0.99e12);
    }
}
