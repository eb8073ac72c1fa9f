//! `[swap]` and `[folder]`: what speaks against a swap, and how the folder is watched.

use std::path::{Path, PathBuf};
use std::time::Duration;

use isotherm_correction::units::{AngularRate, Span, SpecificForce};

use super::walk::{Table, Walk};

/// What follows where a policy speaks against a swap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// It is accepted, with a warning.
    Warn,
    /// It is refused, unless the operator forces it.
    Refuse,
}

/// What a swap is measured against, beside the validity of the document itself.
#[derive(Debug, Clone, PartialEq)]
pub struct SwapSettings {
    /// Greatest age of a document by its `created` (1…36500 days); `None` for no limit.
    pub max_age: Option<Duration>,
    /// What follows where it is older.
    pub age: Severity,
    /// What follows where a present temperature of the unit lies outside the document's fitted ranges.
    pub outside_range: Severity,
    /// Greatest jump of the corrected angular rate about an axis of the case (rad/s); `None` for no limit.
    pub max_jump_rad_per_s: Option<f64>,
    /// Greatest jump of the corrected specific force along an axis of the case (m/s²); `None` for no limit.
    pub max_jump_m_per_s2: Option<f64>,
    /// What follows where the jump is greater.
    pub jump: Severity,
    /// What follows where the document is of an older schema version than this release writes.
    pub old_schema: Severity,
    /// Time over which a swap is made where nothing else is asked for (0…1 h).
    pub slew: Span,
    /// Whether a document without a signature of a trusted key is refused.
    pub require_signature: bool,
    /// Folder of the trusted public keys, `*.pub`.
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
            slew: Span::ZERO,
            require_signature: false,
            trusted_keys: None,
        }
    }
}

/// Seconds of a day.
pub(super) const DAY_S: u64 = 86_400;

impl SwapSettings {
    /// Reads `[swap]`.
    pub(super) fn read(walk: &mut Walk<'_>, root: &mut Table<'_>, folder: &Path) -> Self {
        let default = Self::default();
        let mut table = root.table(walk, "swap");
        let age_days = table.integer(walk, "max_age_days", 0, 36_500).filter(|days| *days > 0);
        let age = severity(walk, &mut table, "age", default.age);
        let outside_range = severity(walk, &mut table, "outside_range", default.outside_range);
        let rate = table.number(walk, "max_jump_deg_per_h", 0.0, 1e6).filter(|limit| *limit > 0.0);
        let force = table.number(walk, "max_jump_mg", 0.0, 1e6).filter(|limit| *limit > 0.0);
        let jump = severity(walk, &mut table, "jump", default.jump);
        let old_schema = severity(walk, &mut table, "old_schema", default.old_schema);
        let slew = table.integer(walk, "slew_ms", 0, 3_600_000).map_or(default.slew, Span::from_ms);
        let require_signature = table.boolean(walk, "require_signature").unwrap_or(default.require_signature);
        let trusted_keys = table.path(walk, "trusted_keys", folder, Path::is_dir, "an existing folder");
        if require_signature && !table.has("trusted_keys") {
            table.report(
                walk,
                &"require_signature is set: trusted_keys must name the folder of the public keys",
            );
        }
        table.finish(walk);
        Self {
            max_age: age_days.map(|days| Duration::from_secs(u64::from(days) * DAY_S)),
            age,
            outside_range,
            max_jump_rad_per_s: rate.map(|limit| AngularRate::from_deg_per_h(limit).as_rad_per_s()),
            max_jump_m_per_s2: force.map(|limit| SpecificForce::from_g(limit * 1e-3).as_m_per_s2()),
            jump,
            old_schema,
            slew,
            require_signature,
            trusted_keys,
        }
    }
}

fn severity(walk: &mut Walk<'_>, table: &mut Table<'_>, key: &'static str, default: Severity) -> Severity {
    let choices = [("warn", Severity::Warn), ("refuse", Severity::Refuse)];
    table.choice(walk, key, &choices).unwrap_or(default)
}

/// How the folder of calibration documents is watched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FolderSettings {
    /// How long a file must have been left alone before it is read (10 ms…60 s).
    pub settle: Duration,
    /// Interval at which the files are looked at although nothing was heard of them (100 ms…10 min).
    pub poll: Duration,
}

impl Default for FolderSettings {
    fn default() -> Self {
        Self { settle: Duration::from_millis(150), poll: Duration::from_secs(5) }
    }
}

impl FolderSettings {
    /// Reads `[folder]`.
    pub(super) fn read(walk: &mut Walk<'_>, root: &mut Table<'_>) -> Self {
        let default = Self::default();
        let mut table = root.table(walk, "folder");
        let settle = super::milliseconds(walk, &mut table, "settle_ms", 10, default.settle);
        let poll = table.number(walk, "poll_s", 0.1, 600.0).map_or(default.poll, Duration::from_secs_f64);
        table.finish(walk);
        Self { settle, poll }
    }
}
