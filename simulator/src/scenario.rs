//! A scenario: everything that a simulation follows from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::chamber::Profile;
use crate::failure::Failure;
use crate::instrument::Instrument;
use crate::motion::Motion;

/// Everything that a simulation follows from, to the bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Serial of the unit.
    pub unit: String,
    /// Seed of all noise.
    pub seed: u64,
    /// Start of the first tick on the producer's clock (ns).
    #[serde(default)]
    pub start_ns: i64,
    /// Duration of the run (s, 0…10⁹); whole ticks are simulated.
    #[schemars(range(min = 0.0, max = 1e9))]
    pub duration_s: f64,
    /// Nominal duration of a tick (ns, 10⁵…10⁹).
    #[schemars(range(min = 100_000, max = 1_000_000_000))]
    pub tick_ns: i64,
    /// Largest distance of a tick's end from its nominal time, drawn uniformly (ns, 0…¼ tick).
    #[serde(default)]
    pub tick_jitter_ns: i64,
    /// The chamber.
    pub chamber: Profile,
    /// What the case does.
    pub motion: Motion,
    /// The unit.
    pub instrument: Instrument,
    /// Sensors that fail.
    #[serde(default)]
    pub failures: Vec<Failure>,
}
