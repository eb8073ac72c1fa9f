//! A change: a decision carried out, on the disk, in the audit file, at the unit.

use std::path::Path;
use std::sync::Arc;
use std::time::SystemTime;

use isotherm_correction::units::Span;
use isotherm_document::unplaced;
use isotherm_protocol::control::{DocumentChange, Schedule, SwapOutcome, SwapReply};
use isotherm_protocol::document::Problem;
use isotherm_protocol::history::{Acceptance, AuditEvent, Source, Withdrawal, Withdrawn};
use isotherm_protocol::key::UnitId;

use super::decision::Decision;
use super::document::Document;
use super::manager::Worker;
use super::request::Request;
use super::revision::{Record, Revision};
use super::store::StoreError;

/// A revision that is to take the place of another.
#[derive(Debug, Clone)]
pub struct Change {
    /// What is to be in force.
    pub next: Arc<Revision>,
    /// From which tick on.
    pub at: Schedule,
    /// Time over which the change is made; zero is at once.
    pub slew: Span,
}

impl Worker {
    /// Takes a request with its document through the whole path; `read` as for [`Worker::decide`].
    pub(super) fn swap(
        &mut self,
        request: &Request,
        bytes: &[u8],
        read: Option<&Result<Document, Vec<Problem>>>,
    ) -> SwapReply {
        let mut decision = self.decide(request, bytes, read);
        let outcome = self.act(request, bytes, &mut decision);
        let unit = decision.unit.as_ref();
        // What has just been accepted is what the answer is about.
        let active = unit.and_then(|unit| match outcome {
            SwapOutcome::Accepted => self.records.get(unit)?.last(),
            _ => self.in_force(unit),
        });
        let would = decision.document.as_ref().filter(|_| outcome == SwapOutcome::WouldBeAccepted);
        let proposed = would.and_then(|document| document.digest()).map(|digest| digest.to_string());
        SwapReply {
            proposed,
            schedule: request.options.schedule,
            slew_s: self.slew(request).as_s(),
            problems: decision.problems,
            warnings: decision.warnings,
            difference: decision.difference,
            ..reply(outcome, unit.map_or("", UnitId::as_str), active)
        }
    }

    /// Does what was decided.
    fn act(&mut self, request: &Request, bytes: &[u8], decision: &mut Decision) -> SwapOutcome {
        let (Some(unit), Some(document), true) =
            (&decision.unit, &decision.document, decision.problems.is_empty())
        else {
            self.note_refusal(request, bytes, decision);
            return SwapOutcome::Refused;
        };
        if self.is_unchanged(unit, document, request.options.schedule) {
            if request.needs_signature() && !request.options.dry_run {
                self.trust(unit);
            }
            return SwapOutcome::Unchanged;
        }
        if request.options.dry_run {
            return SwapOutcome::WouldBeAccepted;
        }
        match self.accept(request, decision) {
            Ok(()) => {
                for warning in &decision.warnings {
                    tracing::warn!(%unit, "{warning}");
                }
                SwapOutcome::Accepted
            }
            Err(error) => {
                decision.problems = vec![self.refuse_unwritten(unit, &request.name, &error)];
                SwapOutcome::Refused
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
            self.count_refusal(Some(unit), Some(&problem));
        }
        problem
    }

    /// What a unit corrects with at present.
    pub(super) fn in_force(&self, unit: &UnitId) -> Option<&Arc<Revision>> {
        let waiting = self.intake.waiting(unit).map(|(revision, _)| revision);
        self.records.get(unit)?.in_force(waiting)
    }

    /// Whether a document is what was accepted last, and nothing else is asked of it.
    fn is_unchanged(&self, unit: &UnitId, document: &Document, schedule: Schedule) -> bool {
        let Some(last) = self.records.get(unit).and_then(Record::last) else { return false };
        let waits = self.intake.waiting(unit).filter(|(revision, _)| *revision == last.number.counter);
        last.document.digest() == document.digest() && waits.is_none_or(|(_, at)| at == schedule)
    }

    fn slew(&self, request: &Request) -> Span {
        request.options.slew_s.map_or(self.swap.slew, Span::from_s)
    }

    /// Stores, writes down, and only then hands over; on an error nothing has changed. In a group that is done when the
    /// group is written.
    fn accept(&mut self, request: &Request, decision: &Decision) -> Result<(), StoreError> {
        if let Some(layers) = decision.document.as_ref().and_then(|document| document.layers.as_ref()) {
            self.store.put_overlay(&layers.text.read())?;
        }
        let accepted = (request.clone(), decision.clone());
        if let Some(group) = &mut self.group {
            group.push(accepted);
            return Ok(());
        }
        self.carry_out(&[accepted])
    }

    /// Writes a group down, and hands it over. Where that fails as a whole it is tried one by one.
    pub(super) fn write_group(&mut self) {
        let group = self.group.as_mut().map(std::mem::take).unwrap_or_default();
        if group.is_empty() || self.carry_out(&group).is_ok() {
            return;
        }
        for accepted in group {
            if let Err(error) = self.carry_out(std::slice::from_ref(&accepted))
                && let (Request { name, .. }, Decision { unit: Some(unit), .. }) = accepted
            {
                let problem = self.refuse_unwritten(&unit, &name, &error);
                self.unwritten.push((name, problem));
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
            self.folder.settle(Path::new(&file), vec![problem]);
        }
        count
    }

    /// Documents first, all of them; then their acceptances; only then the units. On an error nothing has changed.
    ///
    /// Each is of another unit.
    fn carry_out(&mut self, group: &[(Request, Decision)]) -> Result<(), StoreError> {
        let accepted = group.iter().filter_map(|(request, decision)| {
            let (unit, document) = (decision.unit.as_ref()?, decision.document.as_ref()?);
            Some((request, unit, document, self.acceptance(request, decision)?))
        });
        let accepted: Vec<_> = accepted.collect();
        let documents = accepted
            .iter()
            .filter_map(|(.., document, accepted)| Some((accepted.digest, document.text.clone()?)));
        self.store.put_documents(&documents.collect::<Vec<_>>())?;
        let entries = accepted.iter().map(|(request, unit, _, accepted)| {
            (Some(*unit), request.options.by.as_str(), AuditEvent::Accepted(accepted.clone()))
        });
        self.store.append_all(SystemTime::now(), entries)?;
        for (request, unit, document, accepted) in accepted {
            let next = Revision::new(accepted.revision, Arc::clone(document), &accepted.source);
            let (at, slew) = (accepted.schedule, self.slew(request));
            self.hand_over(unit, &request.options.by, &accepted, Change { next: Arc::new(next), at, slew });
        }
        Ok(())
    }

    /// What is written down of a document that was found good.
    fn acceptance(&self, request: &Request, decision: &Decision) -> Option<Acceptance> {
        let (unit, document) = (decision.unit.as_ref()?, decision.document.as_ref()?);
        let last = self.records.get(unit).and_then(Record::last).map_or(0, |last| last.number.counter);
        let highest = last.max(self.store.highest_revision(unit));
        // Another instance may have given the unit more than came here in time.
        let given = self.intake.with(unit, |actor| actor.highest_revision()).unwrap_or(0);
        let changed = decision.difference.iter().flat_map(|difference| &difference.document);
        Some(Acceptance {
            revision: highest.max(given) + 1,
            digest: document.digest()?,
            overlay: document.label.overlay,
            source: request.source.clone(),
            base: self.in_force(unit).and_then(|active| active.document.digest()),
            changed: changed.map(DocumentChange::words).collect(),
            schedule: request.options.schedule,
            slew_ms: u64::try_from(self.slew(request).as_ns() / 1_000_000).unwrap_or(0),
        })
    }

    /// Hands a change that is written down to its unit.
    fn hand_over(&mut self, unit: &UnitId, by: &str, accepted: &Acceptance, change: Change) {
        let Acceptance { revision, digest, source, .. } = accepted;
        let waiting = self.intake.waiting(unit).map(|(revision, _)| revision);
        let record = self.records.entry(unit.clone()).or_default();
        // What a unit is given first, from its file, is no swap.
        let from_file = matches!(source, Source::Start { .. } | Source::Folder { .. });
        let first = record.last().is_none() && from_file;
        if record.plan.waiting().map(|(revision, _)| revision) != waiting {
            record.plan.settle();
        }
        record.plan.change(change.clone());
        // An overlay's own signature says nothing of the document that it lies on; that one's was asked for by a rollback to both.
        let is_overlay = change.next.document.layers.is_some() && !matches!(source, Source::Rollback { .. });
        if !is_overlay {
            record.untrusted = None;
        }
        record.skipped = None;
        record.swaps.accepted += u64::from(!first);
        self.accepted += u64::from(!first);
        let account = record.account();
        self.losses.retain(|loss| loss.unit() != Some(unit));
        self.refusals.forget(unit);
        tracing::info!(%unit, revision, %digest, %source, by, "calibration accepted");
        if let Some(replaced) = self.intake.change(unit, change, account) {
            tracing::info!(%unit, revision = replaced, "a pending change is withdrawn");
            let why = Withdrawn::Superseded { by_revision: *revision };
            let event = AuditEvent::Withdrawn(Withdrawal { revision: replaced, why });
            self.note(Some(unit), "", event, "the withdrawal");
        }
    }

    /// What is in force has passed every check of today.
    fn trust(&mut self, unit: &UnitId) {
        let Some(record) = self.records.get_mut(unit).filter(|record| record.untrusted.is_some()) else {
            return;
        };
        record.untrusted = None;
        self.tell_account(unit);
        tracing::info!(%unit, "the calibration in force is signed by a trusted key");
    }

    /// Tells a unit what its status is to say of its swaps.
    pub(super) fn tell_account(&self, unit: &UnitId) {
        if let Some(account) = self.records.get(unit).map(Record::account) {
            self.intake.with(unit, |actor| actor.tell_swaps(account));
        }
    }
}

/// What is answered of a unit and the revision that it has.
pub(super) fn reply(outcome: SwapOutcome, unit: &str, active: Option<&Arc<Revision>>) -> SwapReply {
    let digest = active.and_then(|active| active.document.digest());
    SwapReply {
        outcome,
        unit: unit.to_owned(),
        revision: active.map_or(0, |active| active.number.counter),
        digest: digest.map(|digest| digest.to_string()).unwrap_or_default(),
        proposed: None,
        schedule: Schedule::NextTick,
        slew_s: 0.0,
        problems: Vec::new(),
        warnings: Vec::new(),
        difference: None,
    }
}
