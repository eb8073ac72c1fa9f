//! A verdict carried out: stored, written down, handed to the unit, answered.

use isotherm_correction::units::Span;
use isotherm_protocol::control::{DocumentChange, Schedule, SwapOutcome, SwapReply};
use isotherm_protocol::corrected::Revision;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::Problem;
use isotherm_protocol::history::{Acceptance, AuditEvent, Withdrawal, Withdrawn};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::overlay::Candidate;
use std::sync::Arc;

use super::admit::Verdict;
use super::order::Order;
use super::record::{Active, Layers, Record, Written};
use super::start;
use super::work::Work;
use crate::calibrations::{Change, Installable};
use crate::store::StoreError;
use crate::text;

impl Work {
    /// Takes an order through the whole path.
    pub(super) fn swap(&mut self, order: &Order<'_>) -> SwapReply {
        let verdict = self.admit(order);
        let slew = order.options.slew_s.map_or(self.swap.slew, Span::from_s);
        let reply = |work: &Self, outcome, verdict: Verdict| {
            let active = verdict.unit.as_ref().and_then(|unit| work.in_force(unit));
            // What has just been accepted is what the answer is about.
            let accepted = |unit| work.records.get(unit)?.active.as_ref();
            let active = match (outcome, &verdict.unit) {
                (SwapOutcome::Accepted, Some(unit)) => accepted(unit),
                _ => active,
            };
            let written = active.and_then(|active| active.written.as_ref());
            SwapReply {
                outcome,
                unit: verdict.unit.as_ref().map(ToString::to_string).unwrap_or_default(),
                revision: active.map_or(0, |active| active.revision),
                digest: written.map(|written| written.digest.to_string()).unwrap_or_default(),
                schedule: order.options.schedule,
                slew_s: slew.as_s(),
                problems: verdict.problems,
                warnings: verdict.warnings,
                difference: verdict.difference,
            }
        };
        let Verdict { unit: Some(unit), candidate: Some(candidate), problems, .. } = &verdict else {
            self.note_refusal(order, &verdict);
            return reply(self, SwapOutcome::Refused, verdict);
        };
        if !problems.is_empty() {
            self.note_refusal(order, &verdict);
            return reply(self, SwapOutcome::Refused, verdict);
        }
        if self.is_unchanged(unit, candidate, order.options.schedule) {
            if order.needs_signature() && !order.options.dry_run {
                self.trust(unit);
            }
            return reply(self, SwapOutcome::Unchanged, verdict);
        }
        if order.options.dry_run {
            let would = Digest(candidate.digest).to_string();
            return SwapReply { digest: would, ..reply(self, SwapOutcome::WouldBeAccepted, verdict) };
        }
        match self.accept(order, unit, candidate, &verdict, slew) {
            Ok(()) => {
                tell_warnings(unit, &verdict.warnings);
                reply(self, SwapOutcome::Accepted, verdict)
            }
            Err(error) => {
                tracing::error!(%unit, "a swap is refused, it cannot be written down: {error}");
                let message = format!("the swap cannot be written down, nothing has changed: {error}");
                let problems = vec![text::whole(order.name, message)];
                let verdict = Verdict { problems, ..verdict };
                self.count_refusal(&verdict);
                reply(self, SwapOutcome::Refused, verdict)
            }
        }
    }

    /// What a unit corrects with at present.
    pub(super) fn in_force(&self, unit: &UnitId) -> Option<&Active> {
        let waiting = self.intake.waiting(unit).map(|(revision, _)| revision);
        self.records.get(unit)?.in_force(waiting)
    }

    /// Whether a candidate is what was accepted last, and nothing else is asked of it.
    fn is_unchanged(&self, unit: &UnitId, candidate: &Candidate, schedule: Schedule) -> bool {
        let record = self.records.get(unit);
        let Some((record, written)) = record.and_then(|record| Some((record, record.written()?))) else {
            return false;
        };
        let waits = self.intake.waiting(unit).filter(|(revision, _)| *revision == record.counter);
        written.digest.0 == candidate.digest && waits.is_none_or(|(_, at)| at == schedule)
    }

    /// Stores, writes down, and only then hands over; on an error nothing has changed.
    fn accept(
        &mut self,
        order: &Order<'_>,
        unit: &UnitId,
        candidate: &Candidate,
        verdict: &Verdict,
        slew: Span,
    ) -> Result<(), StoreError> {
        let digest = self.store.put_document(candidate.text.as_bytes())?;
        let layers = match &candidate.overlay {
            Some(parsed) => {
                // As it came, with its signature.
                let digest = self.store.put_overlay(order.bytes)?;
                let overlay = parsed.overlay.clone();
                let below = self.records.get(unit).and_then(Record::written);
                let text = String::from_utf8_lossy(order.bytes).into();
                below.map(|below| Layers {
                    base: Arc::clone(below.base(&overlay.overlay_of)),
                    overlay,
                    text,
                    digest,
                })
            }
            None => order.overlay.and_then(|overlay| start::layers(&self.store, overlay)),
        };
        let overlay = layers.as_ref().map(|layers| layers.digest);
        let record = self.records.get(unit);
        let highest = record.map_or(0, |record| record.counter).max(self.store.highest_revision(unit));
        let changed = verdict.difference.iter().flat_map(|difference| &difference.document);
        let acceptance = Acceptance {
            revision: highest + 1,
            digest,
            overlay,
            source: order.source.clone(),
            base: self
                .in_force(unit)
                .and_then(|active| active.written.as_ref())
                .map(|written| written.digest),
            changed: changed.map(DocumentChange::words).collect(),
            schedule: order.options.schedule,
            slew_ms: u64::try_from(slew.as_ns() / 1_000_000).unwrap_or(0),
        };
        self.append(Some(unit), &order.options.by, AuditEvent::Accepted(acceptance))?;

        let revision = Revision { counter: highest + 1, digest: digest.head() };
        let (document, calibration) =
            (Arc::new(candidate.document.clone()), Arc::new(candidate.calibration.clone()));
        let text: Arc<str> = candidate.text.as_str().into();
        let written = Written { digest, document: Arc::clone(&document), text: Arc::clone(&text), layers };
        let active = Active {
            revision: revision.counter,
            calibration: Arc::clone(&calibration),
            written: Some(written),
        };
        let before = self.in_force(unit).cloned();
        let record = self.records.entry(unit.clone()).or_default();
        record.before = before.filter(|_| order.options.schedule != Schedule::NextTick);
        (record.counter, record.active) = (revision.counter, Some(active));
        // A rollback to an overlaid document asks for no signature either; a document under it was asked for one.
        record.untrusted = None;
        record.accepted += 1;
        self.losses.retain(|(concerned, _)| concerned.as_ref() != Some(unit));
        let source = Some(order.source.clone());
        let next = Installable {
            revision,
            calibration,
            digest: Some(digest),
            document: Some(document),
            text: Some(text),
            overlay,
            source,
        };
        let account = record.account();
        self.refusals.forget(unit);
        let counter = revision.counter;
        tracing::info!(
            %unit, revision = counter, %digest, source = %order.source, by = order.options.by, "calibration accepted"
        );
        let change = Change { next, at: order.options.schedule, slew };
        if let Some(replaced) = self.intake.change(unit, change, account) {
            self.note_withdrawn(unit, replaced, Withdrawn::Superseded { by_revision: counter });
        }
        Ok(())
    }

    /// What is in force has passed every check of today.
    fn trust(&mut self, unit: &UnitId) {
        let Some(record) = self.records.get_mut(unit).filter(|record| record.untrusted.is_some()) else {
            return;
        };
        record.untrusted = None;
        let account = record.account();
        self.intake.with(unit, |actor| actor.tell_swaps(account));
        tracing::info!(%unit, "the calibration in force is signed by a trusted key");
    }

    /// Writes down that an accepted revision never came in force.
    fn note_withdrawn(&mut self, unit: &UnitId, revision: u64, why: Withdrawn) {
        tracing::info!(%unit, revision, "a change that waited for its tick is withdrawn");
        let event = AuditEvent::Withdrawn(Withdrawal { revision, why });
        if let Err(error) = self.append(Some(unit), "", event) {
            tracing::error!(%unit, revision, "the withdrawal is not in the audit file: {error}");
        }
    }
}

/// Logs what is doubtful about an accepted document.
pub(super) fn tell_warnings(unit: &UnitId, warnings: &[Problem]) {
    for warning in warnings {
        tracing::warn!(%unit, "{warning}");
    }
}
