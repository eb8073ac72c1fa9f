//! What units have to tell, written down.

use isotherm_protocol::history::{AuditEvent, FirstTick};
use isotherm_protocol::key::UnitId;

use super::desk::Notice;
use super::record::Record;
use super::work::Work;

impl Work {
    /// Takes what a unit has to tell.
    pub(super) fn note(&mut self, unit: &UnitId, notice: Notice) {
        match notice {
            Notice::InForce(first) => {
                let revision = first.revision.counter;
                let tick = FirstTick {
                    revision,
                    series: first.series,
                    first_sequence: first.sequence,
                    first_end_time_ns: first.end_time_ns,
                };
                if !self.intake.speaks_for(unit) {
                    self.leave_unclaimed(unit, tick);
                    return;
                }
                tracing::info!(%unit, revision, sequence = first.sequence, "calibration in force");
                let event = AuditEvent::InForce(tick);
                if let Err(error) = self.append(Some(unit), "", event) {
                    tracing::error!(%unit, revision, "the first tick is not in the audit file: {error}");
                }
                // It may have appeared only now: what was accepted for it before, it does not know of.
                if let Some(account) = self.records.get(unit).map(Record::account) {
                    self.intake.with(unit, |actor| actor.tell_swaps(account));
                }
            }
            // Where another instance speaks, that one stores the result.
            Notice::PreLaunch(end) if self.intake.speaks_for(unit) => self.pre_launch_ended(unit, &end),
            Notice::PreLaunch(_) => {}
            Notice::Followed(entry) => self.note_followed(unit, &entry),
            Notice::Speaks => self.claim(unit),
        }
    }
}
