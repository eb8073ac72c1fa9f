//! `[swap]` and `[folder]`: what speaks against a swap, and how the folder is watched.

use std::path::PathBuf;
use std::time::Duration;

use isotherm_correction::units::Span;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::units::{As, Days, Ms, PathText, Seconds, SomeDegPerH, SomeMilliG};

/// What follows where a policy speaks against a swap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum Severity {
    /// It is accepted, with a warning.
    Warn,
    /// It is refused, unless the operator forces it.
    Refuse,
}

/// What a swap is measured against, beside the validity of the document itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct SwapSettings {
    /// Greatest age of a document by its `created`; 0 for no limit.
    #[serde(rename = "max_age_days", with = "As::<Days>")]
    #[schemars(with = "u32", range(max = 36_500))]
    pub max_age: Option<Duration>,
    /// What follows where it is older.
    pub age: Severity,
    /// What follows where a present temperature of the unit lies outside the document's fitted ranges.
    pub outside_range: Severity,
    /// Greatest jump of the corrected angular rate about an axis of the case (rad/s); 0 for no limit.
    #[serde(rename = "max_jump_deg_per_h", with = "As::<SomeDegPerH>")]
    #[schemars(with = "f64", range(min = 0.0, max = 1e6))]
    pub max_jump_rad_per_s: Option<f64>,
    /// Greatest jump of the corrected specific force along an axis of the case (m/s²); 0 for no limit.
    #[serde(rename = "max_jump_mg", with = "As::<SomeMilliG>")]
    #[schemars(with = "f64", range(min = 0.0, max = 1e6))]
    pub max_jump_m_per_s2: Option<f64>,
    /// What follows where the jump is greater.
    pub jump: Severity,
    /// What follows where the document is of an older schema version than this release writes.
    pub old_schema: Severity,
    /// What follows where the document was created before the one in force.
    pub downgrade: Severity,
    /// Time over which a swap is made where nothing else is asked for.
    #[serde(rename = "slew_ms", with = "As::<Ms>")]
    #[schemars(with = "u32", range(max = 3_600_000))]
    pub slew: Span,
    /// Whether a document without a signature of a trusted key is refused.
    pub require_signature: bool,
    /// Folder of the trusted public keys, `*.pub`.
    #[serde(with = "As::<PathText>")]
    #[schemars(with = "Option<String>", length(min = 1))]
    pub trusted_keys: Option<PathBuf>,
}

impl Default for SwapSettings {
    fn default() -> Self {
        Self {
            max_age: None,
            age: Severity::Warn,
            outside_range: Severity::Warn,
            max_jump_rad_per_s: None,
            max_jump_m_per_s2: None,
            jump: Severity::Refuse,
            old_schema: Severity::Warn,
            downgrade: Severity::Warn,
            slew: Span::ZERO,
            require_signature: false,
            trusted_keys: None,
        }
    }
}

/// How the folder of calibration documents is watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct FolderSettings {
    /// How long a file must have been left alone before it is read.
    #[serde(rename = "settle_ms", with = "As::<Ms>")]
    #[schemars(with = "u32", range(min = 10, max = 60_000))]
    pub settle: Duration,
    /// Interval at which the files are looked at although nothing was heard of them.
    #[serde(rename = "poll_s", with = "As::<Seconds>")]
    #[schemars(with = "f64", range(min = 0.1, max = 600.0))]
    pub poll: Duration,
}

impl Default for FolderSettings {
    fn default() -> Self {
        Self { settle: Duration::from_millis(150), poll: Duration::from_secs(5) }
    }
}
