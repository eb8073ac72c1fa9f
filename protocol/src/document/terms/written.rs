//! A sensor's terms as they stand in its table.

use isotherm_correction::thermal::{Term, TermForm};
use serde::de::{Deserialize, Deserializer, Error as _};
use serde::ser::{Serialize, Serializer};
use toml::Value;

use super::super::curve::Curve;
use super::{KeyedTerm, Regressor, SensorKind, StatedTerm, Terms};

/// Something that is written.
enum Node<'d> {
    Number(f64),
    Text(&'d str),
    Curve(&'d Curve),
    Table(Vec<(&'d str, Self)>),
    List(Vec<Self>),
}

impl Serialize for Node<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Number(number) => number.serialize(serializer),
            Self::Text(text) => text.serialize(serializer),
            Self::Curve(curve) => curve.serialize(serializer),
            Self::Table(entries) => serializer.collect_map(entries.iter().map(|(key, node)| (key, node))),
            Self::List(items) => items.serialize(serializer),
        }
    }
}

impl<'d> From<&KeyedTerm<'d>> for Node<'d> {
    fn from(KeyedTerm { term, stated, .. }: &KeyedTerm<'d>) -> Self {
        let mut entries = Vec::new();
        if let TermForm::Each(parameter) = term.form {
            entries.push((parameter.key, Self::Number(stated.parameter)));
        }
        if let Some(Regressor { channel, minus, reference }) = &stated.regressor {
            entries.push(("channel", Self::Text(channel)));
            entries.extend(minus.as_deref().map(|minus| ("minus", Self::Text(minus))));
            entries.push(("reference", Self::Number(*reference)));
        }
        let mut keys = term.form.curves().iter();
        for curve in stated.curves() {
            let Some(key) = keys.next() else { return Self::Curve(curve) };
            entries.push((key, Self::Curve(curve)));
        }
        Self::Table(entries)
    }
}

impl<K: SensorKind> Serialize for Terms<K> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut entries: Vec<(&str, Node<'_>)> = Vec::new();
        for stated in &self.keyed("") {
            let (key, part) = parts(stated.term);
            let node = Node::from(stated);
            match (entries.last_mut(), part) {
                (Some((last, Node::List(items))), None) if *last == key => items.push(node),
                (Some((last, Node::Table(table))), Some(part)) if *last == key => table.push((part, node)),
                (_, Some(part)) => entries.push((key, Node::Table(vec![(part, node)]))),
                (_, None) if stated.term.form.most() > 1 => entries.push((key, Node::List(vec![node]))),
                (_, None) => entries.push((key, node)),
            }
        }
        Node::Table(entries).serialize(serializer)
    }
}

/// Key of a term, and what it is within a table.
fn parts(term: &'static Term) -> (&'static str, Option<&'static str>) {
    term.key.split_once('.').map_or((term.key, None), |(table, part)| (table, Some(part)))
}

impl<'de, K: SensorKind> Deserialize<'de> for Terms<K> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let table = toml::Table::deserialize(deserializer)?;
        let mut terms = Self::default();
        for term in K::TERMS {
            let (key, part) = parts(term);
            let there = table.get(key);
            let there = part.map_or(there, |part| there?.get(part));
            let all = match there {
                Some(Value::Array(items)) => items.iter().collect(),
                there => Vec::from_iter(there),
            };
            for value in all {
                let wrong = || D::Error::custom(format!("{} must have one of its forms", term.key));
                terms.stated.push(stated(term, value).ok_or_else(wrong)?);
            }
        }
        Ok(terms)
    }
}

/// The term that a value states.
fn stated(term: &Term, value: &Value) -> Option<StatedTerm> {
    let curve = |value: &Value| Curve::deserialize(value.clone()).ok();
    let feature = term.feature;
    Some(match term.form {
        TermForm::Curve | TermForm::PartOf(_) => StatedTerm::new(feature, curve(value)?),
        TermForm::Branches => {
            let (run_up, braking) = (curve(value.get("run_up")?)?, curve(value.get("braking")?)?);
            StatedTerm::branched(feature, [run_up, braking])
        }
        TermForm::Each(parameter) => {
            let number = value.get(parameter.key)?.as_float()?;
            StatedTerm::with_parameter(feature, number, curve(value.get("gain")?)?)
        }
        TermForm::Regressors(_) => {
            StatedTerm::regressor(Regressor::deserialize(value.clone()).ok()?, curve(value.get("gain")?)?)
        }
    })
}
