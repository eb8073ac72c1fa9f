//! Qualities of service, as the last part of a liveliness token says them.

use std::fmt;

use schemars::JsonSchema;
use serde::Deserialize;
use zenoh::qos::CongestionControl;

/// Whether what is lost would be sent again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum Reliability {
    /// It would.
    #[default]
    Reliable,
    /// It would not.
    BestEffort,
}

/// How much is kept for a subscriber that does not keep up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(inline)]
pub enum History {
    /// The last messages, as many as the depth says.
    #[default]
    KeepLast,
    /// All of them.
    KeepAll,
}

/// Quality of service of a publisher, subscription or service; always volatile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct Qos {
    /// Whether what is lost would be sent again.
    pub reliability: Reliability,
    /// How much is kept.
    pub history: History,
    /// Messages that are kept; says nothing where all are.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub depth: u32,
}

impl Qos {
    /// Of sensor data, as a subscription asks for it.
    pub const SENSOR_DATA: Self =
        Self { reliability: Reliability::BestEffort, history: History::KeepLast, depth: 5 };
    /// Of services, and of corrected messages where nothing else is stated.
    pub const SERVICES: Self =
        Self { reliability: Reliability::Reliable, history: History::KeepLast, depth: 10 };
    /// Of diagnostics.
    pub const DIAGNOSTICS: Self = Self { depth: 1, ..Self::SERVICES };

    /// What becomes of a message where a subscriber does not keep up: the rule of `rmw_zenoh`.
    #[must_use]
    pub fn congestion(self) -> CongestionControl {
        match (self.reliability, self.history) {
            (Reliability::Reliable, History::KeepAll) => CongestionControl::Block,
            _ => CongestionControl::Drop,
        }
    }
}

impl Default for Qos {
    fn default() -> Self {
        Self::SERVICES
    }
}

/// Values are written out where they are the default too: defaults have changed between releases.
impl fmt::Display for Qos {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let reliability = if self.reliability == Reliability::Reliable { 1 } else { 2 };
        write!(f, "{reliability}:2:")?;
        match self.history {
            History::KeepLast => write!(f, "1,{}", self.depth)?,
            History::KeepAll => f.write_str("2,")?,
        }
        f.write_str(":,:,:,,")
    }
}
