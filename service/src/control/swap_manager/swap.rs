//! A verdict carried out: stored, written down, handed to the unit, answered.

use std::path::Path;
use std::sync::Arc;
use std::time::SystemTime;

use isotherm_correction::units::Span;
use isotherm_protocol::control::{DocumentChange, Schedule, SwapOutcome, SwapReply};
use isotherm_protocol::document::Problem;
use isotherm_protocol::history::{Acceptance, AuditEvent, Source, Withdrawal, Withdrawn};
use isotherm_protocol::key::UnitId;

use super::admit::{Verdict, refused};
use super::order::Order;
use super::reading::Reading;
use super::record::{Active, Layers, Record, Written};
use super::start;
use super::worker::Worker;
use crate::control::calibrations::{Change, Installable};
use crate::control::compressed::CompressedText;
use crate::control::store::StoreError;
use isotherm_document::unplaced;

/// A document that was found good, before it is written down.
#[derive(Debug)]
pub(super) struct Judged {
    /// What its problems are to call it.
    name: String,
    unit: UnitId,
    source: Source,
    by: String,
    schedule: Schedule,
    slew: Span,
    /// What it changes, in words.
    changed: Vec<String>,
    layers: Option<Box<Layers>>,
    reading: Reading,
}

impl Worker {
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
                proposed: None,
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
            let proposed = Some(candidate.digest.to_string());
            return SwapReply { proposed, ..reply(self, SwapOutcome::WouldBeAccepted, verdict) };
        }
        match self.accept(order, unit, candidate, &verdict, slew) {
            Ok(()) => {
                tell_warnings(unit, &verdict.warnings);
                reply(self, SwapOutcome::Accepted, verdict)
            }
            Err(error) => {
                let problems = vec![self.refuse_unwritten(unit, order.name, &error)];
                reply(self, SwapOutcome::Refused, Verdict { problems, ..verdict })
            }
        }
    }

    /// Tells and counts that a document is refused because it cannot be written down.
    fn refuse_unwritten(&mut self, unit: &UnitId, name: &str, error: &StoreError) -> Problem {
        let message = format!("the swap cannot be written to the state folder, nothing has changed: {error}");
        let problem = unplaced(Some(name), message);
        self.folder.note_unwritten(Path::new(name));
        if !self.retrying {
            tracing::error!(%unit, "a swap is refused, it cannot be written to the state folder: {error}");
            self.count_refusal(&refused(Some(unit.clone()), vec![problem.clone()]));
        }
        problem
    }

    /// What a unit corrects with at present.
    pub(super) fn in_force(&self, unit: &UnitId) -> Option<&Active> {
        let waiting = self.intake.waiting(unit).map(|(revision, _)| revision);
        self.records.get(unit)?.in_force(waiting)
    }

    /// Whether a candidate is what was accepted last, and nothing else is asked of it.
    fn is_unchanged(&self, unit: &UnitId, candidate: &Reading, schedule: Schedule) -> bool {
        let record = self.records.get(unit);
        let Some((record, written)) = record.and_then(|record| Some((record, record.written()?))) else {
            return false;
        };
        let waits = self.intake.waiting(unit).filter(|(revision, _)| *revision == record.counter);
        written.digest == candidate.digest && waits.is_none_or(|(_, at)| at == schedule)
    }

    /// Stores, writes down, and only then hands over; on an error nothing has changed. In a group that is done when the
    /// group is written.
    fn accept(
        &mut self,
        order: &Order<'_>,
        unit: &UnitId,
        candidate: &Reading,
        verdict: &Verdict,
        slew: Span,
    ) -> Result<(), StoreError> {
        let layers = match &candidate.overlay {
            Some(overlay) => {
                // As it came, with its signature.
                let digest = self.store.put_overlay(order.bytes)?;
                let below = self.records.get(unit).and_then(Record::written);
                let text = CompressedText::new(&String::from_utf8_lossy(order.bytes));
                let overlay = overlay.clone();
                below.map(|below| Layers {
                    base: below.base(&overlay.overlay_of).clone(),
                    overlay,
                    text,
                    digest,
                })
            }
            None => order.overlay.and_then(|overlay| start::layers(&self.store, overlay)),
        };
        let changed = verdict.difference.iter().flat_map(|difference| &difference.document);
        let judged = Judged {
            name: order.name.to_owned(),
            unit: unit.clone(),
            source: order.source.clone(),
            by: order.options.by.clone(),
            schedule: order.options.schedule,
            slew,
            changed: changed.map(DocumentChange::words).collect(),
            layers: layers.map(Box::new),
            reading: candidate.clone().small(),
        };
        if let Some(group) = &mut self.group {
            group.push(judged);
            return Ok(());
        }
        self.carry_out(&[judged])
    }

    /// Writes a group down, and hands it over. Where that fails as a whole it is tried one by one.
    pub(super) fn write_group(&mut self) {
        let group = self.group.as_mut().map(std::mem::take).unwrap_or_default();
        if group.is_empty() || self.carry_out(&group).is_ok() {
            return;
        }
        for judged in group {
            if let Err(error) = self.carry_out(std::slice::from_ref(&judged)) {
                let problem = self.refuse_unwritten(&judged.unit, &judged.name, &error);
                self.unwritten.push((judged.name, problem));
            }
        }
    }

    /// Writes the group down, and ends it: how many documents of files could not be.
    pub(super) fn end_group(&mut self) -> usize {
        self.write_group();
        self.group = None;
        let unwritten = std::mem::take(&mut self.unwritten);
        let count = unwritten.len();
        for (file, problem) in unwritten {
            self.folder.refuse(Path::new(&file), problem);
        }
        count
    }

    /// Documents first, all of them; then their acceptances; only then the units. On an error nothing has changed.
    ///
    /// Each is of another unit.
    fn carry_out(&mut self, group: &[Judged]) -> Result<(), StoreError> {
        let documents: Vec<_> =
            group.iter().map(|judged| (judged.reading.digest, judged.reading.text.bytes().clone())).collect();
        self.store.put_documents(&documents)?;
        let accepted: Vec<_> = group.iter().map(|judged| self.acceptance(judged)).collect();
        let entries = group.iter().zip(&accepted).map(|(judged, acceptance)| {
            (Some(&judged.unit), judged.by.as_str(), AuditEvent::Accepted(acceptance.clone()))
        });
        self.entries = self.store.append_all(SystemTime::now(), entries)?;
        for (judged, acceptance) in group.iter().zip(accepted) {
            self.hand_over(judged, acceptance.revision);
        }
        Ok(())
    }

    fn acceptance(&self, judged: &Judged) -> Acceptance {
        let Judged { unit, reading, layers, source, changed, schedule, slew, .. } = judged;
        let record = self.records.get(unit);
        let highest = record.map_or(0, |record| record.counter).max(self.store.highest_revision(unit));
        // Another instance may have given the unit more than came here in time.
        let given = self.intake.with(unit, |actor| actor.highest_revision()).unwrap_or(0);
        let highest = highest.max(given);
        let base = self.in_force(unit).and_then(|active| active.written.as_ref());
        Acceptance {
            revision: highest + 1,
            digest: reading.digest,
            overlay: layers.as_ref().map(|layers| layers.digest),
            source: source.clone(),
            base: base.map(|written| written.digest),
            changed: changed.clone(),
            schedule: *schedule,
            slew_ms: u64::try_from(slew.as_ns() / 1_000_000).unwrap_or(0),
        }
    }

    /// Hands a calibration that is written down to its unit.
    fn hand_over(&mut self, judged: &Judged, counter: u64) {
        let Judged { unit, reading, layers, source, by, schedule, slew, .. } = judged;
        let digest = reading.digest;
        let overlay = layers.as_ref().map(|layers| layers.digest);
        let calibration = Arc::clone(&reading.calibration);
        let next = Installable::of_document(
            counter,
            Arc::clone(&calibration),
            (reading.label.clone(), overlay),
            reading.text.clone(),
            source,
        );
        let written = Written { digest, text: reading.text.clone(), layers: layers.clone() };
        let created_unix_s = reading.label.created_unix_s;
        let active = Active { revision: counter, created_unix_s, calibration, written: Some(written) };
        let before = self.in_force(unit).cloned();
        let record = self.records.entry(unit.clone()).or_default();
        // What a unit is given first, from its file, is no swap.
        let first = before.is_none() && matches!(source, Source::Start { .. } | Source::Folder { .. });
        record.before = before.filter(|_| *schedule != Schedule::NextTick).map(Box::new);
        (record.counter, record.active) = (counter, Some(active));
        // A rollback to an overlaid document asks for no signature either; a document under it was asked for one.
        record.untrusted = None;
        record.accepted += u64::from(!first);
        let account = record.account();
        self.losses.retain(|(concerned, _)| concerned.as_ref() != Some(unit));
        self.refusals.forget(unit);
        tracing::info!(%unit, revision = counter, %digest, %source, by, "calibration accepted");
        let change = Change { next: Arc::new(next), at: *schedule, slew: *slew };
        if let Some(replaced) = self.intake.change(unit, change, account) {
            self.note_withdrawn(unit, replaced, Withdrawn::Superseded { by_revision: counter });
        }
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
        tracing::info!(%unit, revision, "a pending change is withdrawn");
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
