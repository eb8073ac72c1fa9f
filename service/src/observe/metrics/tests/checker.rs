//! A strict reader of `OpenMetrics` text: what it takes, Prometheus takes.

use std::collections::{BTreeMap, BTreeSet};

/// One sample.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sample {
    name: String,
    labels: BTreeMap<String, String>,
    value: f64,
}

/// One metric with all its samples.
#[derive(Debug, Clone, Default)]
pub(crate) struct Family {
    kind: String,
    unit: String,
    help: String,
    samples: Vec<Sample>,
}

/// A page.
#[derive(Debug)]
pub(crate) struct Page(pub(crate) BTreeMap<String, Family>);

impl Page {
    /// Reads a page.
    pub(crate) fn read(text: &str) -> Result<Self, String> {
        let lines = text.strip_suffix("# EOF\n").ok_or("does not end with # EOF")?;
        let mut families: BTreeMap<String, Family> = BTreeMap::new();
        let mut present = String::new();
        for line in lines.lines() {
            let wrong = |what: &str| format!("{what}: {line}");
            if let Some(rest) = line.strip_prefix("# ") {
                let (word, rest) = rest.split_once(' ').ok_or_else(|| wrong("no descriptor"))?;
                let (name, value) = rest.split_once(' ').ok_or_else(|| wrong("no value"))?;
                if word == "HELP" {
                    if !is_name(name) || families.contains_key(name) {
                        return Err(wrong("not a new name"));
                    }
                    name.clone_into(&mut present);
                    families.insert(name.to_owned(), Family { help: value.to_owned(), ..Family::default() });
                    continue;
                }
                let family =
                    families.get_mut(name).filter(|family| name == present && family.samples.is_empty());
                let family = family.ok_or_else(|| wrong("out of place"))?;
                match word {
                    "TYPE" if family.kind.is_empty() => value.clone_into(&mut family.kind),
                    "UNIT" if family.unit.is_empty() && name.ends_with(&format!("_{value}")) => {
                        value.clone_into(&mut family.unit);
                    }
                    _ => return Err(wrong("not a descriptor, or twice")),
                }
            } else {
                let sample = sample(line).ok_or_else(|| wrong("no sample"))?;
                let family = families.get_mut(&present).ok_or_else(|| wrong("no HELP before it"))?;
                let suffix = sample.name.strip_prefix(&present).ok_or_else(|| wrong("of another metric"))?;
                let fits = match family.kind.as_str() {
                    "gauge" => suffix.is_empty(),
                    "counter" => suffix == "_total" && sample.value >= 0.0,
                    "histogram" => ["_bucket", "_sum", "_count"].contains(&suffix),
                    _ => return Err(wrong("no TYPE before it")),
                };
                if !fits {
                    return Err(wrong("does not fit its TYPE"));
                }
                family.samples.push(sample);
            }
        }
        for (name, family) in &families {
            family.check(name).map_err(|what| format!("{name}: {what}"))?;
        }
        Ok(Self(families))
    }

    /// The value of the one sample with these labels, perhaps among others.
    pub(crate) fn value(&self, name: &str, labels: &[(&str, &str)]) -> Option<f64> {
        let samples = self.0.values().flat_map(|family| &family.samples).filter(|sample| sample.name == name);
        let fits = |sample: &&Sample| {
            labels.iter().all(|(key, value)| sample.labels.get(*key).map(String::as_str) == Some(*value))
        };
        let found: Vec<_> = samples.filter(fits).map(|sample| sample.value).collect();
        assert!(found.len() < 2, "{name} {labels:?} is not one sample: {found:?}");
        found.first().copied()
    }
}

impl Family {
    /// Whether it has no sample.
    pub(crate) fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    fn check(&self, name: &str) -> Result<(), String> {
        let mut seen = BTreeSet::new();
        for sample in &self.samples {
            if !seen.insert((&sample.name, &sample.labels)) {
                return Err(format!("twice: {sample:?}"));
            }
        }
        match self.kind.as_str() {
            _ if self.help.is_empty() => Err("no HELP".to_owned()),
            "counter" | "gauge" => Ok(()),
            "histogram" => self.check_histograms(name),
            kind => Err(format!("unknown type {kind:?}")),
        }
    }

    /// Each histogram has rising bounds, cumulative counts, +Inf at its end, and a sum.
    fn check_histograms(&self, name: &str) -> Result<(), String> {
        let mut histograms: BTreeMap<_, Vec<&Sample>> = BTreeMap::new();
        for sample in &self.samples {
            let mut labels = sample.labels.clone();
            labels.remove("le");
            histograms.entry(labels).or_default().push(sample);
        }
        for (labels, samples) in histograms {
            let wrong = |what: &str| Err(format!("{what} {labels:?}"));
            let one = |suffix: &str| {
                samples
                    .iter()
                    .find(|sample| sample.name == format!("{name}{suffix}"))
                    .map(|sample| sample.value)
            };
            let (Some(sum), Some(count)) = (one("_sum"), one("_count")) else {
                return wrong("no sum or count");
            };
            let mut bounds = f64::NEG_INFINITY;
            let mut below = 0.0;
            for bucket in samples.iter().filter(|sample| sample.name.ends_with("_bucket")) {
                let Some(bound) = bucket.labels.get("le").and_then(|le| number(le)) else {
                    return wrong("a bucket without a bound");
                };
                if bound <= bounds || bucket.value < below {
                    return wrong("not cumulative");
                }
                (bounds, below) = (bound, bucket.value);
            }
            let zero = count == 0.0;
            if bounds != f64::INFINITY
                || below.to_bits() != count.to_bits()
                || sum < 0.0
                || (zero && sum > 0.0)
            {
                return wrong("+Inf, count and sum do not go together");
            }
        }
        Ok(())
    }
}

fn is_name(name: &str) -> bool {
    name.starts_with(|first: char| first.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

fn number(text: &str) -> Option<f64> {
    if text == "+Inf" {
        Some(f64::INFINITY)
    } else {
        text.parse().ok().filter(|value: &f64| value.is_finite())
    }
}

/// `name{key="value",…} number`
fn sample(line: &str) -> Option<Sample> {
    let end = line.find(['{', ' '])?;
    let (name, mut rest) = line.split_at(end);
    let mut labels = BTreeMap::new();
    if let Some(inner) = rest.strip_prefix('{') {
        rest = inner;
        loop {
            let (key, behind) = rest.split_once("=\"")?;
            let (value, behind) = quoted(behind)?;
            if !is_name(key) || value.is_empty() || labels.insert(key.to_owned(), value).is_some() {
                return None;
            }
            match behind.strip_prefix(',') {
                Some(next) => rest = next,
                None => break rest = behind.strip_prefix('}')?,
            }
        }
    }
    let value = number(rest.strip_prefix(' ')?)?;
    is_name(name).then(|| Sample { name: name.to_owned(), labels, value })
}

/// Text up to its closing quotation mark, and what follows that.
fn quoted(text: &str) -> Option<(String, &str)> {
    let mut value = String::new();
    let mut characters = text.char_indices();
    while let Some((at, character)) = characters.next() {
        match character {
            '"' => return Some((value, text.get(at + 1..)?)),
            '\\' => value.push(match characters.next()?.1 {
                'n' => '\n',
                same @ ('\\' | '"') => same,
                _ => return None,
            }),
            other => value.push(other),
        }
    }
    None
}

#[test]
fn the_reader_takes_good_pages_and_refuses_bad_ones() {
    let good = "# HELP a_seconds Words.\n# TYPE a_seconds gauge\n# UNIT a_seconds seconds\na_seconds{x=\"q\\\"\\\\\"} 1.5e-6\n\
        # HELP b B\n# TYPE b counter\nb_total 7\n\
        # HELP h H\n# TYPE h histogram\nh_sum 0.5\nh_count 3\nh_bucket{le=\"0.1\"} 2\nh_bucket{le=\"+Inf\"} 3\n# EOF\n";
    let page = Page::read(good).unwrap();
    assert_eq!(page.value("a_seconds", &[("x", "q\"\\")]), Some(1.5e-6));
    assert_eq!(page.value("b_total", &[]), Some(7.0));
    assert_eq!(page.0["a_seconds"].unit, "seconds");
    for (part, instead) in [
        ("# EOF\n", ""),
        ("# HELP b B\n", ""),
        ("# TYPE b counter\n", ""),
        ("# TYPE b counter", "# TYPE b gauge"),
        ("# HELP b B\n# TYPE b counter\nb_total 7\n", "# TYPE b counter\n# HELP b B\nb_total 7\n"),
        ("# UNIT a_seconds seconds", "# UNIT a_seconds meters"),
        ("b_total 7", "b_total 7\nb_total 8"),
        ("b_total 7", "b_total -7"),
        ("b_total 7", "b_total seven"),
        ("b_total 7", "b_total 7\n\n"),
        ("b_total 7", "b_total{} 7"),
        ("b_total 7", "c_total 7"),
        ("x=\"q\\\"\\\\\"", "x=\"q\\t\""),
        ("x=\"q\\\"\\\\\"", "x=\"q\",x=\"r\""),
        ("h_bucket{le=\"+Inf\"} 3", "h_bucket{le=\"+Inf\"} 1"),
        ("h_bucket{le=\"+Inf\"} 3\n", ""),
        ("h_count 3", "h_count 4"),
        ("le=\"0.1\"", "le=\"-Inf\""),
        ("h_sum 0.5\n", ""),
    ] {
        assert!(good.contains(part), "{part}");
        assert!(Page::read(&good.replace(part, instead)).is_err(), "{part} -> {instead}");
    }
}
