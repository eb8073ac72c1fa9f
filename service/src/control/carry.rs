//! Histories and documents of the instance that speaks, written down here too: a state folder that was looked after by a standby is
//! as complete as the other's.

use std::collections::{BTreeMap, BTreeSet};
use std::time::SystemTime;

use isotherm_correction::operation::Command;
use isotherm_protocol::control::Order;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::{Acceptance, AuditEntry, AuditEvent, CommandRecord, FirstTick, Source};
use isotherm_protocol::journal::{JournalEntry, JournalEvent};
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::overlay::base_of;
use zenoh::bytes::Encoding;
use zenoh::query::Query;

use super::command::{PRE_LAUNCH_ENDED, PreLaunchRun, order_of, words};
use super::manager::Worker;
use super::request::reply;
use super::revision::Record;
use crate::control::store::StoreError;

/// What another instance has written down of a unit.
#[derive(Debug, Clone)]
pub(crate) struct Carried {
    pub(crate) unit: UnitId,
    /// Oldest first.
    pub(crate) entries: Vec<AuditEntry>,
    /// Documents and overlays, by their digests.
    pub(crate) kept: BTreeMap<Digest, Vec<u8>>,
}

impl Worker {
    /// Documents and overlays that entries name and that are neither here nor carried with them.
    pub(super) fn lacking(&self, carried: &Carried) -> Vec<Digest> {
        let Carried { entries, kept, .. } = carried;
        let accepted = entries.iter().filter_map(|entry| match &entry.event {
            AuditEvent::Accepted(accepted) => Some([Some(accepted.digest), accepted.overlay]),
            _ => None,
        });
        let sets = entries.iter().flat_map(|entry| match &entry.event {
            AuditEvent::CarriedUnit(unit) => unit.sets.as_slice(),
            _ => &[],
        });
        let named = accepted.chain(sets.map(|set| [Some(set.digest), set.overlay])).flatten().flatten();
        let below = kept.values().filter_map(|bytes| base_of(bytes));
        let lacking: BTreeSet<Digest> = named.chain(below).collect();
        lacking.into_iter().filter(|digest| !kept.contains_key(digest) && !self.holds(digest)).collect()
    }

    fn holds(&self, digest: &Digest) -> bool {
        let held = |found: Result<Option<Vec<u8>>, StoreError>| found.is_ok_and(|bytes| bytes.is_some());
        held(self.store.document(digest)) || held(self.store.overlay(digest))
    }

    /// Writes down what is not here yet, and has the unit's plan be what it says; nothing of a unit that this instance speaks for. Whether it is
    /// all written down.
    pub(super) fn carry(&mut self, carried: &Carried) -> bool {
        let Carried { unit, entries, kept } = carried;
        if self.intake.speaks_for(unit) {
            return false;
        }
        let done = kept.values().try_for_each(|bytes| {
            let put = if base_of(bytes).is_some() {
                self.store.put_overlay(bytes)
            } else {
                self.store.put_document(bytes)
            };
            put.map(drop)
        });
        let done = done.and_then(|()| self.carry_entries(unit, entries));
        match done {
            Ok(0) => return true,
            Ok(count) => {
                tracing::debug!(%unit, count, "entries of the other instance's audit file are copied");
            }
            Err(error) => {
                tracing::error!(%unit, "the other instance's history is not copied: {error}");
                return false;
            }
        }
        let before = self.records.get(unit);
        let (accepted, refused) = before.map(|record| (record.accepted, record.refused)).unwrap_or_default();
        let pre_launch = running(before.and_then(|record| record.pre_launch.clone()), entries);
        self.plan_again(unit, Record { accepted, refused, pre_launch, ..self.restored(unit) });
        true
    }

    /// Has a unit begin anew with what is written down of it.
    pub(super) fn plan_again(&mut self, unit: &UnitId, record: Record) {
        let plan = record.plan.clone();
        for (_, words) in record.problems() {
            tracing::error!(%unit, "{words}");
        }
        self.records.insert(unit.clone(), record);
        self.intake.plan_again(unit, plan);
    }

    fn carry_entries(&mut self, unit: &UnitId, entries: &[AuditEntry]) -> Result<usize, StoreError> {
        let mut fresh = Vec::new();
        for entry in entries {
            if !self.store.has_written(unit, entry)? && !self.knows(unit, &entry.event) {
                fresh.push(entry);
            }
        }
        // What holds there holds here, whatever was accepted here before.
        let last = entries.iter().rfind(|entry| matches!(entry.event, AuditEvent::Accepted(_)));
        if let Some((entry, AuditEvent::Accepted(accepted))) = last.map(|entry| (entry, &entry.event)) {
            let good = self.store.last_good(unit);
            let same =
                good.is_some_and(|good| (good.revision, good.digest) == (accepted.revision, accepted.digest));
            let comes = fresh.iter().any(|fresh| matches!(fresh.event, AuditEvent::Accepted(_)));
            if !same && !comes {
                fresh.push(entry);
            }
        }
        for entry in &fresh {
            if let AuditEvent::InForce(first) = &entry.event {
                self.unclaimed.retain(|(of, unclaimed)| of != unit || unclaimed.revision != first.revision);
            }
            self.store.append(entry.time.system_time(), Some(unit), &entry.by, entry.event.clone())?;
        }
        Ok(fresh.len())
    }

    /// Whether a set that another instance accepted holds here too: as it was ordered, or from the journal, without the operator's name.
    fn knows(&self, unit: &UnitId, event: &AuditEvent) -> bool {
        let AuditEvent::Accepted(accepted) = event else { return false };
        self.store.by_revision(unit, accepted.revision).is_some_and(|set| set.digest == accepted.digest)
    }

    /// The first tick of a revision, while another instance speaks: that one writes it down, and where it does not any more, this one
    /// does when it speaks.
    pub(super) fn leave_unclaimed(&mut self, unit: &UnitId, first: FirstTick) {
        self.unclaimed.retain(|(of, _)| of != unit);
        self.unclaimed.push((unit.clone(), first));
    }

    /// This instance speaks for a unit from here on.
    pub(super) fn claim(&mut self, unit: &UnitId) {
        let (mine, others) = std::mem::take(&mut self.unclaimed).into_iter().partition(|(of, _)| of == unit);
        self.unclaimed = others;
        let mine: Vec<(UnitId, FirstTick)> = mine;
        for (_, first) in mine {
            self.note(Some(unit), "", AuditEvent::InForce(first), "the first tick");
        }
    }

    /// What another instance was ordered, and this one goes on with: written down where that one's history did not come in time.
    pub(super) fn note_followed(&mut self, unit: &UnitId, entry: &JournalEntry) {
        let (revision, at, slew_ns, document, source) = match &entry.event {
            JournalEvent::Changed { revision, at, slew_ns, document: Some(document), source, .. } => {
                (revision, at, slew_ns, document, source)
            }
            JournalEvent::Commanded { command, words, .. } => {
                return self.note_commanded(unit, command, words, &entry.instance);
            }
            _ => return,
        };
        if revision.counter <= self.store.highest_revision(unit) {
            return;
        }
        let base = self.in_force(unit).and_then(|active| active.document.digest());
        let stored = self.store.put_document(document.as_bytes()).and_then(|digest| {
            let accepted = Acceptance {
                revision: revision.counter,
                digest,
                overlay: None,
                source: Source::Bus,
                base,
                changed: vec![format!(
                    "from the journal of instance {}, which had it from: {source}",
                    entry.instance
                )],
                schedule: *at,
                slew_ms: u64::try_from(slew_ns / 1_000_000).unwrap_or(0),
            };
            self.store.append(SystemTime::now(), Some(unit), "", AuditEvent::Accepted(accepted))
        });
        if let Err(error) = stored {
            tracing::error!(%unit, revision = revision.counter, "the calibration in force is not in the audit file: \
                {error}");
            return;
        }
        self.plan_again(unit, self.restored(unit));
    }

    /// A command that led to a state, unless it is the last that is written down.
    fn note_commanded(&mut self, unit: &UnitId, command: &Command, state: &str, instance: &str) {
        let last = self.store.last_command(unit);
        if last.is_some_and(|last| last.state_after == state && last.command.starts_with(command.name())) {
            return;
        }
        let state_before = last.map_or_else(String::new, |last| last.state_after.clone());
        let order = order_of(command);
        let record = CommandRecord {
            command: order.as_ref().map_or_else(|| command.name().to_owned(), words),
            accepted: true,
            reason: Some(format!("from the journal of instance {instance}")),
            state_before,
            state_after: state.to_owned(),
            last_sequence: None,
            order,
        };
        self.note(Some(unit), "", AuditEvent::Command(record), "a command of another instance");
    }

    /// A query on `isotherm/*/kept/*`: a document or an overlay by its digest; none is no answer.
    pub(super) fn answer_kept(&self, query: &Query) {
        let Some(digest) = key::parse_kept(query.key_expr().as_str()) else { return };
        let found = [self.store.document(&digest), self.store.overlay(&digest)];
        if let Some(bytes) = found.into_iter().find_map(|found| found.ok().flatten()) {
            reply(query, &key::kept(self.intake.instance(), &digest), bytes, Encoding::TEXT_PLAIN);
        }
    }
}

/// A pre-launch calibration that goes on: its result is to be stored as it was asked for, whoever stores it.
fn running(before: Option<PreLaunchRun>, entries: &[AuditEntry]) -> Option<PreLaunchRun> {
    let commands = entries.iter().filter_map(|entry| match &entry.event {
        AuditEvent::Command(record) if record.accepted || record.order.is_none() => Some((entry, record)),
        _ => None,
    });
    commands.fold(before, |run, (entry, record)| match &record.order {
        Some(Order::PreLaunch(order)) => Some(PreLaunchRun { order: *order, by: entry.by.clone() }),
        Some(Order::Abort) => None,
        None if record.command == PRE_LAUNCH_ENDED => None,
        _ => run,
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use isotherm_protocol::control::Schedule;

    use super::*;
    use crate::config::Settings;
    use crate::control::revision::Calibrations;
    use crate::control::store::{Opened, Store};
    use crate::receive::intake::Intake;

    #[test]
    fn a_swap_that_was_taken_from_the_journal_is_not_written_down_again() {
        let (settings, unit) = (Settings::default(), UnitId::new("U").unwrap());
        let outlets = Box::new(|_: &_| Err("there is none".into()));
        let intake = Arc::new(Intake::new(settings.clone(), Calibrations::default(), outlets));
        let mut worker = Worker::new(&settings, intake, Store::in_memory(), &Opened::default());
        let digests = ["one", "other"].map(|text| worker.store.put_document(text.as_bytes()).unwrap());
        let accepted = |digest, changed: &[&str]| {
            let changed = changed.iter().map(|it| (*it).to_owned()).collect();
            AuditEvent::Accepted(Acceptance {
                revision: 6,
                digest,
                overlay: None,
                source: Source::Bus,
                base: None,
                changed,
                schedule: Schedule::NextTick,
                slew_ms: 0,
            })
        };
        worker.append(Some(&unit), "root", accepted(digests[0], &[])).unwrap();
        let mut carried = |digest| {
            let (time, event) = (SystemTime::UNIX_EPOCH.into(), accepted(digest, &["from the journal"]));
            let entry =
                AuditEntry { number: 1, time, unit: Some(unit.to_string()), by: String::new(), event };
            worker.carry_entries(&unit, &[entry]).unwrap()
        };
        assert_eq!(digests.map(&mut carried), [0, 1], "what holds there holds here");
    }
}
