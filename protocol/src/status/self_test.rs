//! Report of a self-test (models §7).

use serde::{Deserialize, Serialize};

use super::MAX_ENTRIES;
use crate::codec::bounded;

/// One check.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SelfTestItem {
    /// What was checked, in words, such as "gyro x" or "voltage u-half-x".
    pub name: String,
    /// What was measured; `None` where nothing came.
    pub value: Option<f64>,
    /// Smallest good value; `None` where there is no such limit.
    pub at_least: Option<f64>,
    /// Largest good value; `None` where there is no such limit.
    pub at_most: Option<f64>,
    /// Unit of measure of value and limits; empty for plain numbers.
    pub unit_of_measure: String,
    /// Whether it is good.
    pub passed: bool,
}

/// Report of a self-test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SelfTestReport {
    /// Whether every check is good.
    pub passed: bool,
    /// End of its last tick (ns on the producer's clock); `None` where no tick came.
    pub ended_ns: Option<i64>,
    /// Event time that it looked at (s).
    pub length_s: f64,
    /// Every check, in the order of the calibration.
    #[serde(deserialize_with = "bounded::<_, _, MAX_ENTRIES>")]
    pub items: Vec<SelfTestItem>,
}
