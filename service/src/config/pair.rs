//! Other instances for the same units, and which units those are.

use std::time::Duration;

use isotherm_protocol::pair::Mode;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use zenoh::key_expr::{OwnedKeyExpr, keyexpr};

use super::units::{As, Ms, OneEndpoint};

/// What an operator can set of a pair.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct PairSettings {
    /// Name of this instance; `None`: the first characters of its Zenoh id.
    pub name: Option<String>,
    /// What it does while another one speaks.
    pub mode: Mode,
    /// Of two that speak the one with the lower priority yields.
    pub priority: u8,
    /// How long the other may be silent; a tick is waited for at least three quarters of it.
    #[serde(rename = "takeover_ms", with = "As::<Ms>")]
    #[schemars(with = "u32", range(min = 5, max = 10_000))]
    pub takeover: Duration,
    /// How long this process may stand still before others close their connections to it, and how long a put of its own may block;
    /// `None`: Zenoh's.
    #[serde(rename = "lease_ms", with = "As::<Ms>")]
    #[schemars(with = "Option<u32>", range(min = 100, max = 60_000))]
    pub lease: Option<Duration>,
    /// Address of the other instance, where it connects to this one: it is asked at the start whether it is there, and then waited for.
    /// `None`: this one connects to the other, or both to a router.
    #[serde(with = "As::<OneEndpoint>")]
    #[schemars(with = "Option<String>")]
    pub other: Option<String>,
}

impl Default for PairSettings {
    fn default() -> Self {
        Self {
            name: None,
            mode: Mode::Standby,
            priority: 0,
            takeover: Duration::from_millis(20),
            lease: None,
            other: None,
        }
    }
}

impl PairSettings {
    /// Whether anything but the default is set: another instance is meant to be there.
    pub(crate) fn is_meant(&self) -> bool {
        *self != Self::default()
    }
}

/// All units.
pub(super) const ALL_UNITS: &str = "*";

/// The chunk of a key for which a pattern of serials stands: `ZLG-*` is `ZLG-$*` in Zenoh; `None` where it is no such pattern.
#[must_use]
pub fn chunk(pattern: &str) -> Option<OwnedKeyExpr> {
    let fits = |c: char| c.is_ascii_alphanumeric() || "._-*".contains(c);
    if pattern.is_empty() || !pattern.chars().all(fits) || pattern.contains("**") {
        return None;
    }
    let chunk = if pattern == ALL_UNITS { pattern.to_owned() } else { pattern.replace('*', "$*") };
    OwnedKeyExpr::new(chunk).ok()
}

/// The chunks for which patterns of serials stand; what is no pattern is left out.
pub(crate) fn chunks(patterns: &[String]) -> Vec<OwnedKeyExpr> {
    patterns.iter().filter_map(|pattern| chunk(pattern)).collect()
}

/// Whether one of the patterns stands for a serial.
pub(crate) fn includes(chunks: &[OwnedKeyExpr], serial: &str) -> bool {
    keyexpr::new(serial).is_ok_and(|serial| chunks.iter().any(|chunk| chunk.intersects(serial)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_stands_for_any_characters_of_a_serial() {
        for (pattern, fits, does_not) in [
            ("ZLG-*", "ZLG-0042", "FOG-0042"),
            ("*-0042", "ZLG-0042", "ZLG-0043"),
            ("ZLG-0042", "ZLG-0042", "ZLG-00421"),
        ] {
            let chunks = chunks(&[pattern.to_owned()]);
            assert!(includes(&chunks, fits) && !includes(&chunks, does_not), "{pattern}");
        }
        assert!(chunk("*").is_some());
        for pattern in ["", "a/b", "**", "a**", "$*", "a b"] {
            assert_eq!(chunk(pattern), None, "{pattern}");
        }
    }
}
