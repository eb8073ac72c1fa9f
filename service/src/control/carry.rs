//! Histories and documents of the other instance, written down here too: a state folder that was looked after by a standby is as
//! complete as the other's.
//!
//! One rule says which set is the last good one: the last that is written down. What the instance that speaks has accepted last is
//! therefore written last in both audit files, once more where something older was copied behind it. What the other one had accepted
//! while the two were apart comes before it, so that no number is used twice and nothing is gone without a word
//! (`Store::set_aside`).

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use isotherm_correction::operation::Command;
use isotherm_correction::units::Span;
use isotherm_protocol::control::Order;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::{Acceptance, AuditEntry, AuditEvent, CommandRecord, Source};
use isotherm_protocol::journal::{JournalEntry, JournalEvent};
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::overlay::{Candidate, base_of};
use zenoh::bytes::Encoding;
use zenoh::query::Query;

use super::change::Change;
use super::command::{PRE_LAUNCH_ENDED, PreLaunchRun, order_of, words};
use super::document::Document;
use super::manager::Worker;
use super::request::reply;
use super::revision::{Record, Revision};
use crate::control::store::StoreError;

/// What another instance has written down of a unit.
#[derive(Debug, Clone)]
pub(crate) struct Carried {
    pub(crate) unit: UnitId,
    /// Whether that one speaks for the unit, so that it holds here; else this one does, and takes in what was accepted there.
    pub(crate) holds: bool,
    /// Oldest first.
    pub(crate) entries: Vec<AuditEntry>,
    /// Documents and overlays, by their digests.
    pub(crate) kept: BTreeMap<Digest, Vec<u8>>,
}

impl Worker {
    /// Documents and overlays that entries name and that are neither here nor carried with them.
    pub(super) fn lacking(&self, carried: &Carried) -> Vec<Digest> {
        let Carried { entries, kept, .. } = carried;
        let accepted = entries.iter().filter_map(acceptance);
        let accepted = accepted.map(|(_, accepted)| [Some(accepted.digest), accepted.overlay]);
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

    /// Writes down what is not here yet, and has the unit's plan be what holds there. Whether it is all written down.
    pub(super) fn carry(&mut self, carried: &Carried) -> bool {
        let Carried { unit, holds, entries, kept } = carried;
        if self.intake.speaks_for(unit) == *holds {
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
        let count = match done.and_then(|()| self.carry_entries(carried)) {
            Ok(count) => count,
            Err(error) => {
                // Tried again until it is done: told once.
                if self.uncopied.insert(unit.clone()) {
                    tracing::error!(%unit, "the other instance's history is not copied: {error}");
                }
                return false;
            }
        };
        self.uncopied.remove(unit);
        if count == 0 {
            return true;
        }
        tracing::debug!(%unit, count, "entries of the other instance's audit file are copied");
        if let Some((_, set)) = self.store.set_aside().find(|(of, _)| *of == unit) {
            tracing::error!("{}", self.aside(unit, set));
        }
        self.say_again(unit);
        if !holds {
            return true;
        }
        if is_forgotten(entries) {
            self.let_go(unit);
            tracing::info!(%unit, "forgotten, as the other instance was told to");
            return true;
        }
        let record = self.records.entry(unit.clone()).or_default();
        record.pre_launch = running(record.pre_launch.take(), entries);
        self.plan_again(unit, self.restored(unit));
        true
    }

    /// Has a unit begin anew with what is written down of it; what was counted of it and asked for stays.
    pub(super) fn plan_again(&mut self, unit: &UnitId, restored: Record) {
        let plan = restored.plan.clone();
        for (_, words) in restored.problems() {
            tracing::error!(%unit, "{words}");
        }
        let before = self.records.remove(unit).unwrap_or_default();
        let Record { swaps, pre_launch, overlay, .. } = before;
        self.records.insert(unit.clone(), Record { swaps, pre_launch, overlay, ..restored });
        self.intake.plan_again(unit, plan);
    }

    fn carry_entries(&mut self, carried: &Carried) -> Result<usize, StoreError> {
        let Carried { unit, holds, entries, .. } = carried;
        let own = if *holds { Vec::new() } else { self.store.history(Some(unit), usize::MAX)? };
        let holding = if *holds { entries } else { &own };
        let begin = holding.iter().rposition(is_forget).map_or(0, |place| place + 1);
        let last = holding.iter().skip(begin).filter_map(acceptance).next_back();
        if !holds && last.is_none() {
            // Nothing to put them before.
            return Ok(0);
        }
        let mut fresh = Vec::new();
        for entry in entries.iter().filter(|entry| is_copied(&entry.event, *holds)) {
            if !self.store.has_written(unit, entry)? && !self.knows(unit, &entry.event) {
                fresh.push(entry);
            }
        }
        if let Some((entry, set)) = last {
            let written = fresh.iter().copied().filter_map(acceptance).next_back();
            let written = written.map(|(_, written)| (written.revision, written.digest));
            let good = || self.store.last_good(unit).map(|good| (good.revision, good.digest));
            if written.or_else(good) != Some((set.revision, set.digest)) {
                // With its first tick: one that waited for its own does not wait again.
                let of_set = |other: &&AuditEntry| match &other.event {
                    AuditEvent::InForce(first) => first.revision == set.revision,
                    _ => std::ptr::eq(*other, entry),
                };
                let again: Vec<_> =
                    holding.iter().skip_while(|other| !std::ptr::eq(*other, entry)).filter(of_set).collect();
                fresh.retain(|entry| !again.iter().any(|again| std::ptr::eq(*again, *entry)));
                fresh.extend(again);
            }
        }
        if *holds {
            let mut intent = self.store.intent(unit).cloned().unwrap_or_default();
            fresh.iter().filter_map(|entry| command(entry)).for_each(|record| intent.note(record));
            for is_of_kind in [is_of_state, is_of_rest] {
                let of_kind = |entry: &&AuditEntry| {
                    command(entry).and_then(|it| it.order.as_ref()).is_some_and(is_of_kind)
                };
                let wanted = entries.iter().skip(begin).rfind(of_kind);
                let mut then = intent.clone();
                wanted.and_then(command).into_iter().for_each(|record| then.note(record));
                fresh.extend(wanted.filter(|_| then != intent));
                intent = then;
            }
        }
        for entry in &fresh {
            if let AuditEvent::InForce(first) = &entry.event
                && self.unclaimed.get(unit).is_some_and(|unclaimed| unclaimed.revision == first.revision)
            {
                self.unclaimed.remove(unit);
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

    /// This instance speaks for a unit from here on.
    pub(super) fn claim(&mut self, unit: &UnitId) {
        let Some(first) = self.unclaimed.remove(unit) else { return };
        // What this one computed before it was in step with the other was published by nobody.
        if self.store.by_revision(unit, first.revision).is_some_and(|set| !set.in_force) {
            self.note(Some(unit), "", AuditEvent::InForce(first), "the first tick");
        }
    }

    /// What another instance was ordered, and this one goes on with: written down where that one's history did not come in time. What
    /// cannot be written is in force all the same, and is tried again.
    pub(super) fn note_followed(&mut self, unit: &UnitId, entry: Box<JournalEntry>) {
        let Err(error) = self.write_followed(unit, &entry) else { return };
        if let JournalEvent::Changed { revision, at, slew_ns, document: Some(text), .. } = &entry.event {
            tracing::error!(%unit, revision = revision.counter, "the calibration in force is not in the audit file: {error}");
            let mut record = self.records.get(unit).cloned().unwrap_or_default();
            if let Ok(candidate) = Candidate::parse(text, None, None) {
                let document = Arc::new(Document::of(candidate, None, text.as_bytes()));
                let next = Arc::new(Revision::new(revision.counter, document, &Source::Bus));
                record.plan.change(Change { next, at: *at, slew: Span::from_ns(*slew_ns) });
                self.plan_again(unit, record);
            }
        } else {
            tracing::error!(%unit, "a command of another instance is not in the audit file: {error}");
        }
        self.followed.push((unit.clone(), entry));
    }

    /// Tries to write down what could not be.
    pub(super) fn retry_followed(&mut self) {
        for (unit, entry) in std::mem::take(&mut self.followed) {
            // One behind the other.
            let waits = self.followed.iter().any(|(of, _)| *of == unit);
            if waits || self.write_followed(&unit, &entry).is_err() {
                self.followed.push((unit, entry));
            }
        }
    }

    fn write_followed(&mut self, unit: &UnitId, entry: &JournalEntry) -> Result<(), StoreError> {
        let (revision, at, slew_ns, document, source) = match &entry.event {
            JournalEvent::Changed { revision, at, slew_ns, document: Some(document), source, .. } => {
                (revision, at, slew_ns, document, source)
            }
            JournalEvent::Commanded { command, words, .. } => {
                return self.write_commanded(unit, command, words, &entry.instance);
            }
            _ => return Ok(()),
        };
        let good = self.store.last_good(unit).map(|good| good.revision);
        if revision.counter <= good.unwrap_or_else(|| self.store.highest_revision(unit)) {
            return Ok(());
        }
        let base = self.store.last_good(unit).map(|good| good.digest);
        let digest = self.store.put_document(document.as_bytes())?;
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
        self.append(Some(unit), "", AuditEvent::Accepted(accepted))?;
        self.plan_again(unit, self.restored(unit));
        Ok(())
    }

    /// A command that led to a state, unless it is the last that is written down.
    fn write_commanded(
        &mut self,
        unit: &UnitId,
        command: &Command,
        state: &str,
        instance: &str,
    ) -> Result<(), StoreError> {
        let last = self.store.last_command(unit);
        if last.is_some_and(|last| last.state_after == state && last.command.starts_with(command.name())) {
            return Ok(());
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
        self.append(Some(unit), "", AuditEvent::Command(record))
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

/// Whether an entry is copied: what a folder holds is each instance's own; of one that does not speak, what it accepted.
fn is_copied(event: &AuditEvent, holds: bool) -> bool {
    match event {
        AuditEvent::CarriedFile(_) => false,
        AuditEvent::Accepted(_) | AuditEvent::InForce(_) | AuditEvent::Withdrawn(_) => true,
        _ => holds,
    }
}

/// An entry with the acceptance that it is.
fn acceptance(entry: &AuditEntry) -> Option<(&AuditEntry, &Acceptance)> {
    match &entry.event {
        AuditEvent::Accepted(accepted) => Some((entry, accepted)),
        _ => None,
    }
}

/// The command of an entry that was carried out.
fn command(entry: &AuditEntry) -> Option<&CommandRecord> {
    match &entry.event {
        AuditEvent::Command(record) if record.accepted => Some(record),
        _ => None,
    }
}

fn is_of_state(order: &Order) -> bool {
    matches!(order, Order::Standby | Order::Run { .. })
}

fn is_of_rest(order: &Order) -> bool {
    matches!(order, Order::Rest(_) | Order::EndRest)
}

fn is_forget(entry: &AuditEntry) -> bool {
    command(entry).is_some_and(|record| record.order == Some(Order::Forget))
}

/// Whether the unit was forgotten, and given nothing since.
fn is_forgotten(entries: &[AuditEntry]) -> bool {
    let given =
        |entry: &&AuditEntry| matches!(entry.event, AuditEvent::Accepted(_)) || command(entry).is_some();
    entries.iter().rfind(given).is_some_and(is_forget)
}

#[cfg(test)]
mod tests {
    use std::time::SystemTime;

    use isotherm_protocol::control::Schedule;
    use isotherm_protocol::corrected;
    use isotherm_protocol::status::Swaps;

    use super::*;
    use crate::control::fixture::worker;

    fn unit() -> UnitId {
        UnitId::new("U").unwrap()
    }

    /// A set, of which the text says which it is.
    fn accepted(worker: &mut Worker, (revision, text): (u64, &str)) -> AuditEvent {
        AuditEvent::Accepted(Acceptance {
            revision,
            digest: worker.store.put_document(text.as_bytes()).unwrap(),
            overlay: None,
            source: Source::Bus,
            base: None,
            changed: Vec::new(),
            schedule: Schedule::NextTick,
            slew_ms: 0,
        })
    }

    fn ordered(order: Order) -> AuditEvent {
        AuditEvent::Command(CommandRecord {
            command: words(&order),
            accepted: true,
            reason: None,
            state_before: String::new(),
            state_after: String::new(),
            last_sequence: None,
            order: Some(order),
        })
    }

    /// What another instance has written down.
    fn theirs(holds: bool, events: Vec<AuditEvent>) -> Carried {
        let entries = (1..).zip(events).map(|(number, event)| {
            let time = SystemTime::UNIX_EPOCH.into();
            AuditEntry { number, time, unit: Some("U".to_owned()), by: String::new(), event }
        });
        Carried { unit: unit(), holds, entries: entries.collect(), kept: BTreeMap::new() }
    }

    #[test]
    fn what_was_counted_of_a_unit_outlives_what_another_instance_was_ordered() {
        let mut worker = worker();
        let swaps = Swaps { accepted: 2, refused: 1, last_refusal: Some("too old".to_owned()) };
        worker.records.insert(unit(), Record { swaps: swaps.clone(), ..Record::default() });
        let document = include_str!("../../../config/calibration/ZLG-0001.toml").to_owned();
        let event = JournalEvent::Changed {
            revision: corrected::Revision { counter: 7, digest: Digest::of(document.as_bytes()).head() },
            at: Schedule::NextTick,
            slew_ns: 0,
            document: Some(document),
            overlay: None,
            source: "bus".to_owned(),
        };
        let (name, instance) = ("U".to_owned(), "other".to_owned());
        let entry = JournalEntry { unit: name, instance, number: 1, heard: Default::default(), event };
        worker.note_followed(&unit(), Box::new(entry));
        let record = &worker.records[&unit()];
        assert_eq!((record.last().unwrap().number.counter, &record.swaps), (7, &swaps));
    }

    #[test]
    fn a_swap_that_was_taken_from_the_journal_is_not_written_down_again() {
        let mut worker = worker();
        let event = accepted(&mut worker, (6, "one"));
        worker.append(Some(&unit()), "root", event).unwrap();
        let counts = ["one", "other"].map(|text| {
            let carried = theirs(true, vec![accepted(&mut worker, (6, text))]);
            worker.carry_entries(&carried).unwrap()
        });
        assert_eq!(counts, [0, 1], "what holds there holds here");
    }

    /// Own sets, those of the other instance, what is written down then, and what is set aside; for a standby, and for one that speaks.
    #[test]
    fn the_set_that_the_speaking_instance_accepted_last_is_written_last() {
        type Sets<'s> = &'s [(u64, &'s str)];
        let cases: [(bool, Sets<'_>, Sets<'_>, Sets<'_>, Option<u64>); 7] = [
            (true, &[(1, "a")], &[(1, "a"), (2, "b")], &[(1, "a"), (2, "b")], None),
            (
                true,
                &[(1, "a"), (2, "c")],
                &[(1, "a"), (2, "b"), (3, "d"), (2, "c")],
                &[(1, "a"), (2, "c"), (2, "b"), (3, "d"), (2, "c")],
                Some(3),
            ),
            (
                true,
                &[(1, "a"), (2, "b"), (3, "d")],
                &[(1, "a")],
                &[(1, "a"), (2, "b"), (3, "d"), (1, "a")],
                Some(3),
            ),
            (true, &[(1, "a"), (2, "b")], &[(1, "a"), (2, "c")], &[(1, "a"), (2, "b"), (2, "c")], Some(2)),
            (
                false,
                &[(1, "a")],
                &[(1, "a"), (2, "b"), (3, "d")],
                &[(1, "a"), (2, "b"), (3, "d"), (1, "a")],
                Some(3),
            ),
            (false, &[(1, "a"), (2, "b")], &[(1, "a")], &[(1, "a"), (2, "b")], None),
            (false, &[], &[(1, "a")], &[], None),
        ];
        for (holds, own, other, written, aside) in cases {
            let mut worker = worker();
            for set in own {
                let event = accepted(&mut worker, *set);
                worker.append(Some(&unit()), "", event).unwrap();
            }
            let events = other.iter().map(|set| accepted(&mut worker, *set)).collect();
            let carried = theirs(holds, events);
            worker.carry_entries(&carried).unwrap();
            assert_eq!(worker.carry_entries(&carried).unwrap(), 0, "once");
            let mut sets: Vec<_> =
                worker.store.good_sets(&unit()).map(|set| (set.revision, set.digest)).collect();
            sets.reverse();
            let written = written.iter().map(|(revision, text)| (*revision, Digest::of(text.as_bytes())));
            assert_eq!(sets, written.collect::<Vec<_>>(), "{own:?}, {other:?}");
            assert_eq!(
                worker.store.set_aside().next().map(|(_, set)| set.revision),
                aside,
                "{own:?}, {other:?}"
            );
            let next = worker.store.highest_revision(&unit()) + 1;
            let event = accepted(&mut worker, (next, "next"));
            worker.append(Some(&unit()), "", event).unwrap();
            assert_eq!(worker.store.set_aside().count(), 0);
        }
    }

    #[test]
    fn the_state_that_was_ordered_last_where_the_unit_is_published_holds() {
        let (mut worker, run) = (worker(), Order::Run { reversal: None });
        let orders = [run.clone(), Order::Standby];
        for order in [Order::Standby, run.clone(), Order::Standby] {
            worker.append(Some(&unit()), "", ordered(order)).unwrap();
        }
        worker.carry_entries(&theirs(true, orders.map(ordered).into())).unwrap();
        assert_eq!(worker.store.intent(&unit()).unwrap().state, Some(Order::Standby));
        let carried = theirs(true, vec![ordered(Order::Standby), ordered(run.clone())]);
        worker.carry_entries(&carried).unwrap();
        assert_eq!(worker.store.intent(&unit()).unwrap().state, Some(run));
        assert_eq!(worker.carry_entries(&carried).unwrap(), 0);
        worker.carry_entries(&theirs(false, vec![ordered(Order::Forget)])).unwrap();
        assert!(worker.store.intent(&unit()).unwrap().state.is_some(), "orders there are none here");
        let forget = theirs(true, vec![ordered(Order::Forget)]);
        assert!(is_forgotten(&forget.entries) && worker.carry_entries(&forget).unwrap() == 1);
        assert_eq!(worker.store.forgotten().collect::<Vec<_>>(), [&unit()]);
        worker.uncopied.insert(unit());
        worker.let_go(&unit());
        assert!(worker.uncopied.is_empty(), "nothing is wrong with a unit that is forgotten");
    }
}
