//! Which topics are recorded.

use std::str::FromStr;

use isotherm_protocol::key::{self, UnitId};
use zenoh::key_expr::OwnedKeyExpr;

/// The topics that every log needs, by their names here.
const KINDS: [(&str, &str); 6] = [
    ("raw", key::ALL_RAW),
    ("reference", key::ALL_REFERENCE),
    ("corrected", key::ALL_CORRECTED),
    ("status", key::ALL_STATUS),
    ("service", key::ALL_SERVICE_STATUS),
    ("journal", key::ALL_JOURNALS),
];

/// Topics of one kind, or of a key expression.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum TopicFilter {
    /// Those of all units, or of the units asked for.
    Kind(&'static str),
    /// Whatever the expression takes in.
    Keys(OwnedKeyExpr),
}

impl FromStr for TopicFilter {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some((_, keys)) = KINDS.iter().find(|(name, _)| *name == text) {
            return Ok(Self::Kind(keys));
        }
        let names: Vec<_> = KINDS.iter().map(|(name, _)| *name).collect();
        let names = names.join(", ");
        if !text.contains('/') {
            return Err(format!("must be one of {names}, or a key expression such as imu/*/corrected"));
        }
        let keys = OwnedKeyExpr::autocanonize(text.to_owned());
        keys.map(Self::Keys)
            .map_err(|error| format!("is not a key expression: {}", isotherm_bus::words(&error)))
    }
}

/// The key expressions to subscribe to; all kinds where no filter is given.
///
/// They may overlap: see [`is_first`].
#[must_use]
pub(crate) fn key_expressions(filters: &[TopicFilter], units: &[UnitId]) -> Vec<OwnedKeyExpr> {
    let all = KINDS.map(|(_, keys)| TopicFilter::Kind(keys));
    let filters = if filters.is_empty() { &all } else { filters };
    let mut expressions = Vec::new();
    for filter in filters {
        match filter {
            TopicFilter::Keys(keys) => expressions.push(keys.clone()),
            TopicFilter::Kind(keys) => expressions.extend(of_units(keys, units)),
        }
    }
    expressions.dedup();
    expressions
}

/// A key expression of all units narrowed to some; as it is where none is named, or where it is of no unit.
pub(super) fn of_units(keys: &str, units: &[UnitId]) -> Vec<OwnedKeyExpr> {
    let narrowed: Vec<_> = if units.is_empty() || !keys.starts_with("imu/") {
        vec![keys.to_owned()]
    } else {
        units.iter().map(|unit| keys.replacen('*', unit.as_str(), 1)).collect()
    };
    // Serials and the constants above make sound expressions.
    narrowed.into_iter().filter_map(|keys| OwnedKeyExpr::new(keys).ok()).collect()
}

/// Whether a key belongs to the expression of this index: to the first that takes it in, so that none is recorded twice.
#[must_use]
pub(crate) fn is_first(expressions: &[OwnedKeyExpr], index: usize, key: &zenoh::key_expr::keyexpr) -> bool {
    expressions.iter().position(|keys| keys.intersects(key)) == Some(index)
}

#[cfg(test)]
mod tests {
    use zenoh::key_expr::keyexpr;

    use super::*;

    #[test]
    fn filters_are_read() {
        assert_eq!("raw".parse(), Ok(TopicFilter::Kind(key::ALL_RAW)));
        assert!(matches!("imu/*/corrected".parse(), Ok(TopicFilter::Keys(_))));
        for text in ["", "gyro", "imu//x", "/x"] {
            assert!(text.parse::<TopicFilter>().is_err(), "{text}");
        }
    }

    #[test]
    fn units_narrow_what_is_of_units() {
        let units = [UnitId::new("A-1").unwrap(), UnitId::new("B-2").unwrap()];
        let filters: Vec<TopicFilter> = ["raw", "service", "x/*"].map(|text| text.parse().unwrap()).to_vec();
        let expressions = key_expressions(&filters, &units);
        let texts: Vec<_> = expressions.iter().map(|keys| keys.as_str()).collect();
        assert_eq!(texts, ["imu/A-1/raw/*", "imu/B-2/raw/*", "isotherm/*/status", "x/*"]);
        assert_eq!(key_expressions(&[], &[]).len(), KINDS.len());
    }

    #[test]
    fn what_two_filters_take_in_belongs_to_the_first() {
        let filters: Vec<TopicFilter> =
            ["imu/A-1/*", "imu/*/corrected"].map(|text| text.parse().unwrap()).to_vec();
        let expressions = key_expressions(&filters, &[]);
        let of = |key: &str| {
            let key = keyexpr::new(key).unwrap();
            (0..2).filter(|index| is_first(&expressions, *index, key)).collect::<Vec<_>>()
        };
        assert_eq!(of("imu/A-1/corrected"), [0]);
        assert_eq!(of("imu/B-2/corrected"), [1]);
        assert!(of("imu/B-2/status").is_empty());
    }
}
