//! What the corrected topic of a unit says beside its ticks.

use std::collections::BTreeMap;

use isotherm_correction::sigma::Causes;
use isotherm_protocol::corrected::{CorrectedBatch, Revision};
use serde::Serialize;

use super::MAX_LISTED;
use crate::offline::sums::FlagCounts;

/// The first tick of a calibration revision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct RevisionInfo {
    /// The revision.
    #[serde(flatten)]
    pub revision: Revision,
    /// Sequence number of its first tick.
    pub first_sequence: u64,
    /// End of that tick (ns on the producer's clock).
    pub first_end_ns: i64,
}

/// The range of a temperature as it was applied.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AppliedInfo {
    /// The lowest (°C).
    pub min_deg_c: f64,
    /// The highest (°C).
    pub max_deg_c: f64,
    /// The largest magnitude of its rate (°C/s).
    pub max_rate_deg_c_per_s: f64,
}

/// Standard errors of one kind of increment, from all causes together.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct SigmaInfo {
    /// Outputs that state them about or along all three axes.
    pub outputs: u64,
    /// Outputs with an axis whose standard error is unknown.
    pub unknown: u64,
    /// Root of the mean variance of each axis over the first ones (rad or m/s).
    pub rms: [f64; 3],
}

impl SigmaInfo {
    #[expect(clippy::cast_precision_loss, reason = "no log has 2⁵³ outputs")]
    fn take(&mut self, causes: &Causes) {
        let variance = causes.variance();
        if variance.iter().any(|variance| variance.is_nan()) {
            self.unknown += 1;
            return;
        }
        self.outputs += 1;
        let mean = self.rms.iter_mut().zip(variance);
        mean.for_each(|(mean, variance)| *mean += (variance - *mean) / self.outputs as f64);
    }

    /// From mean variances to their roots.
    fn finish(&mut self) {
        self.rms = self.rms.map(f64::sqrt);
    }
}

/// What the corrected ticks come to.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct CorrectedInfo {
    /// Outputs.
    pub outputs: u64,
    /// Raw ticks in them.
    pub ticks: u64,
    /// Outputs that announce a gap before them.
    pub gaps: u64,
    /// Raw ticks announced as missing.
    pub missed_ticks: u64,
    /// Most raw ticks missing in one of these gaps.
    pub longest_gap_ticks: u64,
    /// Outputs with each flag that occurred.
    pub flags: BTreeMap<&'static str, u64>,
    /// Outputs in which any sensor has a flag other than `VALID`, for each that occurred.
    pub sensor_flags: BTreeMap<&'static str, u64>,
    /// Revisions in the order of their first ticks, the first 1024 of them.
    pub revisions: Vec<RevisionInfo>,
    /// Changes from one revision to another.
    pub revision_changes: u64,
    /// Temperatures applied, by channel.
    pub temperatures: BTreeMap<String, AppliedInfo>,
    /// Standard errors of the angle increments (rad), where any are stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angle_sigma_rad: Option<SigmaInfo>,
    /// Of the velocity increments (m/s).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity_sigma_m_per_s: Option<SigmaInfo>,
}

/// Follows the corrected ticks.
#[derive(Debug, Clone, Default)]
pub(super) struct CorrectedSurvey {
    info: CorrectedInfo,
    revision: Option<Revision>,
    flags: FlagCounts,
}

impl CorrectedSurvey {
    pub(super) fn take(&mut self, batch: &CorrectedBatch) {
        let info = &mut self.info;
        if self.revision != Some(batch.revision) {
            info.revision_changes += u64::from(self.revision.is_some());
            self.revision = Some(batch.revision);
            if let Some(first) = batch.ticks.first()
                && info.revisions.len() < MAX_LISTED
            {
                let first_sequence = first.sequence.saturating_sub(u64::from(first.ticks.saturating_sub(1)));
                let first_end_ns = first.end_time.as_ns();
                info.revisions.push(RevisionInfo { revision: batch.revision, first_sequence, first_end_ns });
            }
        }
        for tick in &batch.ticks {
            info.outputs += 1;
            info.ticks += u64::from(tick.ticks);
            info.gaps += u64::from(tick.missed > 0);
            info.missed_ticks = info.missed_ticks.saturating_add(tick.missed);
            info.longest_gap_ticks = info.longest_gap_ticks.max(tick.missed);
            self.flags.add(tick);
            if let Some(sigma) = tick.sigma.as_deref() {
                info.angle_sigma_rad.get_or_insert_default().take(&sigma.angle);
                info.velocity_sigma_m_per_s.get_or_insert_default().take(&sigma.velocity);
            }
        }
        for applied in &batch.temperatures {
            let (value, rate) = (applied.temperature_deg_c, applied.rate_deg_c_per_s.abs());
            let channel = applied.channel.as_str();
            if !info.temperatures.contains_key(channel) && info.temperatures.len() < MAX_LISTED {
                let new = AppliedInfo { min_deg_c: value, max_deg_c: value, max_rate_deg_c_per_s: rate };
                info.temperatures.insert(channel.to_owned(), new);
            }
            if let Some(range) = info.temperatures.get_mut(channel) {
                range.min_deg_c = range.min_deg_c.min(value);
                range.max_deg_c = range.max_deg_c.max(value);
                range.max_rate_deg_c_per_s = range.max_rate_deg_c_per_s.max(rate);
            }
        }
    }

    pub(super) fn finish(self) -> Option<CorrectedInfo> {
        let FlagCounts { ticks, sensors } = self.flags;
        let mut info = CorrectedInfo { flags: ticks, sensor_flags: sensors, ..self.info };
        let sigmas = [&mut info.angle_sigma_rad, &mut info.velocity_sigma_m_per_s];
        sigmas.into_iter().flatten().for_each(SigmaInfo::finish);
        (info.outputs > 0).then_some(info)
    }
}
