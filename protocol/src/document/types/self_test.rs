//! The self-test's limits on what the producer reports of itself.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Self-test limits of the producer's voltages and counters on `imu/{unit}/raw/health`; sensors and temperature channels
/// are tested anyway.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Self-test")]
pub struct SelfTest {
    /// Voltages, such as the half-wave voltage `U_λ/2` of a gyro's mode control. Source: models §7, 003.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 32))]
    pub voltage: Vec<SelfTestVoltage>,
    /// Counters, such as the producer's own errors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 32))]
    pub counter: Vec<SelfTestCounter>,
}

/// One voltage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Voltage of the self-test")]
pub struct SelfTestVoltage {
    /// Unique name on the raw health topic, 1 to 24 bytes.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub name: String,
    /// Range of good values.
    #[schemars(extend("x-rising" = true))]
    pub range_v: [f64; 2],
}

/// One counter.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields, title = "Counter of the self-test")]
pub struct SelfTestCounter {
    /// Unique name on the raw health topic, 1 to 24 bytes.
    #[schemars(length(min = 1, max = 24), extend("x-must-be" = "a name of 1 to 24 bytes"))]
    pub name: String,
    /// Largest good increase during the test.
    #[schemars(range(min = 0, max = 1_000_000_000))]
    pub max_increase: u32,
}
