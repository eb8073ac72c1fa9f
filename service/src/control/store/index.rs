//! What the entries of the audit file add up to, unit by unit.

use std::collections::{BTreeMap, VecDeque};

use isotherm_protocol::control::Order;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::{
    AuditEntry, AuditEvent, CarriedFile, CarriedUnit, CommandRecord, GoodSet, Intent, MAX_CARRIED, Source,
};
use isotherm_protocol::key::UnitId;

use super::Store;
use crate::control::command::PRE_LAUNCH_ENDED;

/// Most good sets of one unit that are kept in memory.
const MAX_SETS: usize = 1000;
/// Most files of watched folders that are remembered.
const MAX_FILES: usize = 4096;

/// What holds, by the entries so far.
#[derive(Debug, Default)]
pub(super) struct Index {
    units: BTreeMap<UnitId, OfUnit>,
    /// What was last seen in each file of the watched folder.
    files: BTreeMap<String, Seen>,
    /// What was refused as a rival; not carried over, it would only be told once more.
    rivals: BTreeMap<String, Digest>,
    /// Revisions up to this one were given by an audit file that is lost.
    pub(super) floor: u64,
    /// Number of the last entry; 0 where there is none.
    pub(super) last_number: u64,
}

/// What was last seen in a file of the watched folder.
#[derive(Debug, Clone)]
struct Seen {
    /// Number of the entry that says so.
    number: u64,
    digest: Digest,
    unit: Option<UnitId>,
    refused: bool,
}

/// What holds for one unit.
#[derive(Debug, Default)]
struct OfUnit {
    highest_revision: u64,
    /// In the order in which they were written down: the last one holds.
    sets: VecDeque<GoodSet>,
    /// Of two instances that were apart, each may accept sets: the newest of those that do not hold, until one with a higher number does.
    set_aside: Option<GoodSet>,
    /// What the watched folder said for it last and was taken.
    folder: Option<Digest>,
    /// What an operator wants of it.
    intent: Intent,
    /// The last command that its stream took.
    command: Option<CommandRecord>,
    /// Highest revision that was given and whose acceptance cannot be read.
    lost: Option<u64>,
}

impl Index {
    /// Takes an entry in; entries come in the order of their numbers.
    pub(super) fn apply(&mut self, entry: &AuditEntry) {
        self.last_number = self.last_number.max(entry.number);
        let unit = entry.unit.as_deref().and_then(|unit| UnitId::new(unit).ok());
        match &entry.event {
            AuditEvent::Accepted(accepted) => {
                let file = accepted.source.file();
                if let Some(path) = file {
                    self.see(path, Seen::of(entry.number, accepted.digest, unit.clone(), false));
                }
                let Some(unit) = unit else { return };
                let of_unit = self.units.entry(unit).or_default();
                if file.is_some() {
                    of_unit.folder = Some(accepted.digest);
                }
                of_unit.lost = of_unit.lost.filter(|lost| *lost > accepted.revision);
                of_unit.highest_revision = of_unit.highest_revision.max(accepted.revision);
                of_unit.hold(GoodSet::new(accepted, entry.time));
            }
            AuditEvent::InForce(first) => {
                let Some(of_unit) = unit.map(|unit| self.units.entry(unit).or_default()) else { return };
                // The line of its acceptance may have been damaged: the number is taken all the same.
                of_unit.highest_revision = of_unit.highest_revision.max(first.revision);
                match of_unit.sets.iter_mut().rfind(|set| set.revision == first.revision) {
                    Some(set) => set.in_force = true,
                    None => of_unit.lose(first.revision),
                }
            }
            AuditEvent::Withdrawn(withdrawal) => {
                if let Some(of_unit) = unit.and_then(|unit| self.units.get_mut(&unit)) {
                    of_unit.sets.retain(|set| set.revision != withdrawal.revision);
                    of_unit.set_aside.take_if(|set| set.revision == withdrawal.revision);
                    of_unit.lost = of_unit.lost.filter(|lost| *lost != withdrawal.revision);
                }
            }
            // A rival may be good: it is judged when it is the only one.
            AuditEvent::Refused(refused) => {
                let Some(path) = refused.source.file() else { return };
                if !refused.rival {
                    self.see(path, Seen::of(entry.number, refused.digest, unit, true));
                } else if self.rivals.len() < MAX_FILES {
                    self.rivals.insert(path.to_owned(), refused.digest);
                }
            }
            AuditEvent::CarriedUnit(carried) => {
                let Some(unit) = unit else { return };
                self.units.entry(unit).or_default().carry(carried);
            }
            AuditEvent::Command(record) => {
                let Some(unit) = unit.filter(|_| record.accepted) else { return };
                if record.order == Some(Order::Forget) {
                    self.files.retain(|_, seen| seen.unit.as_ref() != Some(&unit));
                    let of_unit = self.units.entry(unit).or_default();
                    // Its numbers are not given again.
                    *of_unit = OfUnit { highest_revision: of_unit.highest_revision, ..OfUnit::default() };
                } else {
                    let of_unit = self.units.entry(unit).or_default();
                    of_unit.intent.note(record);
                    let is_rollback = matches!(record.order, Some(Order::Rollback { .. }));
                    if !is_rollback && record.command != PRE_LAUNCH_ENDED {
                        of_unit.command = Some(record.clone());
                    }
                }
            }
            AuditEvent::CarriedFile(carried) => {
                if let Some(unit) = unit.clone().filter(|_| !carried.refused) {
                    self.units.entry(unit).or_default().folder = Some(carried.digest);
                }
                self.see(&carried.path, Seen::of(entry.number, carried.digest, unit, carried.refused));
            }
            _ => {}
        }
    }

    /// A line cannot be read: its number, where that much can be, and the unit and the revision where it looks like an
    /// acceptance.
    pub(super) fn skip(&mut self, number: Option<u64>, acceptance: Option<(UnitId, u64)>) {
        // Whatever stood there had a number.
        self.last_number = self.last_number.max(number.unwrap_or(self.next_number()));
        let Some((unit, revision)) = acceptance else { return };
        let of_unit = self.units.entry(unit).or_default();
        of_unit.highest_revision = of_unit.highest_revision.max(revision);
        of_unit.lose(revision);
    }

    /// Number of the next entry.
    pub(super) fn next_number(&self) -> u64 {
        self.last_number.saturating_add(1)
    }

    /// Units whose newest acceptance cannot be read, with its revision.
    pub(super) fn lost(&self) -> impl Iterator<Item = (&UnitId, u64)> {
        self.units.iter().filter_map(|(unit, of_unit)| Some((unit, of_unit.lost?)))
    }

    /// Remembers what a file of the watched folder held.
    fn see(&mut self, path: &str, seen: Seen) {
        self.files.insert(path.to_owned(), seen);
        if self.files.len() > MAX_FILES {
            let oldest = self.files.iter().min_by_key(|(_, seen)| seen.number);
            if let Some(oldest) = oldest.map(|(path, _)| path.clone()) {
                self.files.remove(&oldest);
            }
        }
    }

    /// Whether nothing was taken in that must be carried over.
    pub(super) fn is_empty(&self) -> bool {
        self.units.is_empty() && self.files.is_empty()
    }

    /// Documents and overlays of every revision that can be gone back to.
    pub(super) fn digests(&self) -> impl Iterator<Item = Digest> {
        self.all_sets().flat_map(|(_, set)| [Some(set.digest), set.overlay]).flatten()
    }

    /// Good sets of every unit.
    pub(super) fn all_sets(&self) -> impl Iterator<Item = (&UnitId, &GoodSet)> {
        self.units.iter().flat_map(|(unit, of_unit)| of_unit.sets.iter().map(move |set| (unit, set)))
    }

    /// Good sets of a unit, the newest last.
    pub(super) fn sets(&self, unit: &UnitId) -> impl DoubleEndedIterator<Item = &GoodSet> {
        self.units.get(unit).into_iter().flat_map(|of_unit| &of_unit.sets)
    }

    /// Highest revision counter of all units.
    pub(super) fn highest(&self) -> u64 {
        self.units.values().map(|of_unit| of_unit.highest_revision).max().unwrap_or(0)
    }

    /// Everything that a new file must begin with.
    pub(super) fn carried(&self) -> impl Iterator<Item = (Option<&UnitId>, AuditEvent)> {
        let units = self.units.iter().map(|(unit, of_unit)| {
            let beyond = of_unit.sets.len().saturating_sub(MAX_CARRIED);
            let sets = of_unit.sets.iter().skip(beyond).cloned().collect();
            let (highest_revision, intent) = (of_unit.highest_revision, of_unit.intent.clone());
            let carried = CarriedUnit { highest_revision, sets, intent };
            (Some(unit), AuditEvent::CarriedUnit(carried))
        });
        // The newest last: it is what the folder says for its unit.
        let mut files: Vec<_> = self.files.iter().collect();
        files.sort_by_key(|(_, seen)| seen.number);
        let files = files.into_iter().map(|(path, seen)| {
            let carried = CarriedFile { path: path.clone(), digest: seen.digest, refused: seen.refused };
            (seen.unit.as_ref(), AuditEvent::CarriedFile(carried))
        });
        units.chain(files)
    }
}

/// What holds by the entries so far.
impl Store {
    /// Number of the last entry; 0 where there is none.
    pub(crate) fn last_number(&self) -> u64 {
        self.index.last_number
    }

    /// What an operator wants of a unit, by the commands that were carried out.
    pub(crate) fn intent(&self, unit: &UnitId) -> Option<&Intent> {
        self.index.units.get(unit).map(|of_unit| &of_unit.intent)
    }

    /// Units that were ever given a calibration or a command.
    pub(crate) fn units(&self) -> impl Iterator<Item = &UnitId> {
        self.index.units.iter().filter(|(_, of_unit)| !of_unit.is_forgotten()).map(|(unit, _)| unit)
    }

    /// Units of which nothing holds any more.
    pub(crate) fn forgotten(&self) -> impl Iterator<Item = &UnitId> {
        self.index.units.iter().filter(|(_, of_unit)| of_unit.is_forgotten()).map(|(unit, _)| unit)
    }

    /// Units whose newest accepted set does not hold, because an instance of the pair published without it; with that set.
    pub(crate) fn set_aside(&self) -> impl Iterator<Item = (&UnitId, &GoodSet)> {
        self.index.units.iter().filter_map(|(unit, of_unit)| Some((unit, of_unit.set_aside.as_ref()?)))
    }

    /// The calibration that was accepted last for a unit and not withdrawn: what a restart begins with. It may not have come
    /// in force yet, see [`GoodSet::in_force`].
    #[must_use]
    pub fn last_good(&self, unit: &UnitId) -> Option<&GoodSet> {
        self.index.sets(unit).next_back()
    }

    /// Good sets of a unit, the newest first: at most 1000, and the last eight at least.
    pub fn good_sets(&self, unit: &UnitId) -> impl Iterator<Item = &GoodSet> {
        self.index.sets(unit).rev()
    }

    /// The set that a rollback goes to: the newest before the last good one that corrects otherwise. Rollbacks are followed to
    /// the revision that they went back to, so that a second one goes further back instead of forth again.
    pub(crate) fn previous(&self, unit: &UnitId) -> Option<&GoodSet> {
        let last = self.last_good(unit)?;
        let mut from = last;
        loop {
            while let Source::Rollback { to } = from.source {
                match self.good_sets(unit).find(|set| set.revision == to && to < from.revision) {
                    Some(set) => from = set,
                    None => break,
                }
            }
            from = self.good_sets(unit).find(|set| set.revision < from.revision)?;
            if !from.corrects_as(last) {
                return Some(from);
            }
        }
    }

    /// The last command that a unit's stream took, as far as it stands in this audit file.
    pub(crate) fn last_command(&self, unit: &UnitId) -> Option<&CommandRecord> {
        self.index.units.get(unit)?.command.as_ref()
    }

    /// The good set of a revision.
    #[must_use]
    pub fn by_revision(&self, unit: &UnitId, revision: u64) -> Option<&GoodSet> {
        self.good_sets(unit).find(|set| set.revision == revision)
    }

    /// Highest revision counter that a unit was ever given, withdrawn ones included; 0 where none. The next one is one more.
    #[must_use]
    pub fn highest_revision(&self, unit: &UnitId) -> u64 {
        self.index.units.get(unit).map_or(0, |of_unit| of_unit.highest_revision).max(self.index.floor)
    }

    /// Digest of what was last seen in a file of the watched folder, taken or refused.
    pub(crate) fn seen_in_folder(&self, path: &str) -> Option<Digest> {
        self.index.files.get(path).map(|seen| seen.digest)
    }

    /// Digest of what was last refused in a file of the watched folder, where nothing else was seen in it since.
    pub(crate) fn refused_in_folder(&self, path: &str) -> Option<Digest> {
        self.index.files.get(path).filter(|seen| seen.refused).map(|seen| seen.digest)
    }

    /// Digest of what was last refused in a file of the watched folder because of another one that names its unit.
    pub(crate) fn rival_in_folder(&self, path: &str) -> Option<Digest> {
        self.index.rivals.get(path).copied()
    }

    /// Digest of what the watched folder said for a unit last and was taken, under whatever name: the same again, under
    /// whatever name, is no swap.
    pub(crate) fn said_by_folder(&self, unit: &UnitId) -> Option<Digest> {
        self.index.units.get(unit)?.folder
    }
}

impl Seen {
    fn of(number: u64, digest: Digest, unit: Option<UnitId>, refused: bool) -> Self {
        Self { number, digest, unit, refused }
    }
}

impl OfUnit {
    fn is_forgotten(&self) -> bool {
        self.sets.is_empty() && self.intent.is_empty()
    }

    /// What was carried over says more than the end of the file before it, which may be damaged.
    fn carry(&mut self, carried: &CarriedUnit) {
        self.highest_revision = self.highest_revision.max(carried.highest_revision);
        let first = carried.sets.first().map_or(0, |set| set.revision);
        self.sets.retain(|set| set.revision < first);
        self.set_aside = None;
        carried.sets.iter().for_each(|set| self.hold(set.clone()));
        let from_folder = carried.sets.iter().rfind(|set| set.source.file().is_some());
        self.folder = from_folder.map(|set| set.digest).or(self.folder);
        self.lost = None;
        if !carried.intent.is_empty() {
            self.intent = carried.intent.clone();
        }
    }

    /// Takes in what holds from here on.
    fn hold(&mut self, set: GoodSet) {
        let is_aside = |other: &&GoodSet| {
            other.revision > set.revision || (other.revision == set.revision && !other.corrects_as(&set))
        };
        let aside = self.set_aside.iter().chain(self.sets.back()).filter(is_aside);
        self.set_aside = aside.max_by_key(|other| other.revision).cloned();
        if self.sets.is_empty() {
            // Mostly the only one.
            self.sets.reserve_exact(1);
        }
        self.sets.push_back(set);
        if self.sets.len() > MAX_SETS {
            self.sets.pop_front();
        }
    }

    fn lose(&mut self, revision: u64) {
        let last = self.sets.back().map_or(0, |set| set.revision);
        self.lost = Some(revision).filter(|revision| *revision > last).max(self.lost);
    }
}
