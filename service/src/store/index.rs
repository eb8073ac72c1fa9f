//! What the entries of the audit file add up to, unit by unit.

use std::collections::{BTreeMap, VecDeque};

use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::{
    AuditEntry, AuditEvent, CarriedFile, CarriedUnit, GoodSet, MAX_CARRIED, Source,
};
use isotherm_protocol::key::UnitId;

/// Most good sets of one unit that are kept in memory.
const MAX_SETS: usize = 1000;
/// Most files of watched folders that are remembered.
const MAX_FILES: usize = 4096;

/// What holds, by the entries so far.
#[derive(Debug, Default)]
pub(super) struct Index {
    units: BTreeMap<UnitId, OfUnit>,
    /// Digest last seen in each file of the watched folder, with the number of the entry that says so.
    files: BTreeMap<String, (u64, Digest)>,
}

/// What holds for one unit.
#[derive(Debug, Default)]
struct OfUnit {
    highest_revision: u64,
    /// In the order of their revisions.
    sets: VecDeque<GoodSet>,
}

impl Index {
    /// Takes an entry in; entries come in the order of their numbers.
    pub(super) fn apply(&mut self, entry: &AuditEntry) {
        let unit = entry.unit.as_deref().and_then(|unit| UnitId::new(unit).ok());
        match &entry.event {
            AuditEvent::Accepted(accepted) => {
                self.see(entry.number, &accepted.source, accepted.digest);
                let Some(unit) = unit else { return };
                let of_unit = self.units.entry(unit).or_default();
                of_unit.highest_revision = of_unit.highest_revision.max(accepted.revision);
                of_unit.sets.push_back(GoodSet::new(accepted, entry.time));
                if of_unit.sets.len() > MAX_SETS {
                    of_unit.sets.pop_front();
                }
            }
            AuditEvent::InForce(first) => {
                let Some(of_unit) = unit.map(|unit| self.units.entry(unit).or_default()) else { return };
                // The line of its acceptance may have been damaged: the number is taken all the same.
                of_unit.highest_revision = of_unit.highest_revision.max(first.revision);
                if let Some(set) = of_unit.sets.iter_mut().rfind(|set| set.revision == first.revision) {
                    set.in_force = true;
                }
            }
            AuditEvent::Withdrawn(withdrawal) => {
                if let Some(of_unit) = unit.and_then(|unit| self.units.get_mut(&unit)) {
                    of_unit.sets.retain(|set| set.revision != withdrawal.revision);
                }
            }
            AuditEvent::Refused(refused) => self.see(entry.number, &refused.source, refused.digest),
            AuditEvent::CarriedUnit(carried) => {
                let Some(unit) = unit else { return };
                self.units.entry(unit).or_default().carry(carried);
            }
            AuditEvent::CarriedFile(carried) => self.see_file(entry.number, &carried.path, carried.digest),
            _ => {}
        }
    }

    /// Remembers what a file of the watched folder held.
    fn see(&mut self, number: u64, source: &Source, digest: Digest) {
        if let Some(path) = source.file() {
            self.see_file(number, path, digest);
        }
    }

    fn see_file(&mut self, number: u64, path: &str, digest: Digest) {
        self.files.insert(path.to_owned(), (number, digest));
        if self.files.len() > MAX_FILES {
            let oldest = self.files.iter().min_by_key(|(_, (number, _))| *number);
            if let Some(oldest) = oldest.map(|(path, _)| path.clone()) {
                self.files.remove(&oldest);
            }
        }
    }

    /// Whether nothing was taken in that must be carried over.
    pub(super) fn is_empty(&self) -> bool {
        self.units.is_empty() && self.files.is_empty()
    }

    /// The units that were ever given a calibration.
    pub(super) fn units(&self) -> impl Iterator<Item = &UnitId> {
        self.units.keys()
    }

    /// Good sets of a unit, the newest last.
    pub(super) fn sets(&self, unit: &UnitId) -> impl DoubleEndedIterator<Item = &GoodSet> {
        self.units.get(unit).into_iter().flat_map(|of_unit| &of_unit.sets)
    }

    /// Highest revision counter that a unit was given; 0 where none.
    pub(super) fn highest_revision(&self, unit: &UnitId) -> u64 {
        self.units.get(unit).map_or(0, |of_unit| of_unit.highest_revision)
    }

    /// Digest last seen in a file of the watched folder.
    pub(super) fn seen(&self, path: &str) -> Option<Digest> {
        self.files.get(path).map(|(_, digest)| *digest)
    }

    /// The set that a rollback goes to: the newest before the last one that corrects otherwise. Rollbacks are followed to
    /// the revision that they went back to, so that a second one goes further back instead of forth again.
    pub(super) fn previous(&self, unit: &UnitId) -> Option<&GoodSet> {
        let last = self.sets(unit).next_back()?;
        let mut from = last;
        loop {
            while let Source::Rollback { to } = from.source {
                match self.sets(unit).rfind(|set| set.revision == to && to < from.revision) {
                    Some(set) => from = set,
                    None => break,
                }
            }
            from = self.sets(unit).rfind(|set| set.revision < from.revision)?;
            if !from.corrects_as(last) {
                return Some(from);
            }
        }
    }

    /// Everything that a new file must begin with.
    pub(super) fn carried(&self) -> impl Iterator<Item = (Option<&UnitId>, AuditEvent)> {
        let units = self.units.iter().map(|(unit, of_unit)| {
            let beyond = of_unit.sets.len().saturating_sub(MAX_CARRIED);
            let sets = of_unit.sets.iter().skip(beyond).cloned().collect();
            let carried = CarriedUnit { highest_revision: of_unit.highest_revision, sets };
            (Some(unit), AuditEvent::CarriedUnit(carried))
        });
        let files = self.files.iter().map(|(path, (_, digest))| {
            (None, AuditEvent::CarriedFile(CarriedFile { path: path.clone(), digest: *digest }))
        });
        units.chain(files)
    }
}

impl OfUnit {
    /// What was carried over says more than the end of the file before it, which may be damaged.
    fn carry(&mut self, carried: &CarriedUnit) {
        self.highest_revision = self.highest_revision.max(carried.highest_revision);
        let first = carried.sets.first().map_or(0, |set| set.revision);
        self.sets.retain(|set| set.revision < first);
        self.sets.extend(carried.sets.iter().cloned());
    }
}
