//! What holds when the service starts: the last good sets of the state folder, then what has become of the documents since.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use isotherm_correction::units::Span;
use isotherm_document::few;
use isotherm_protocol::control::Schedule;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::Problem;
use isotherm_protocol::history::{GoodSet, Intent};
use isotherm_protocol::key::UnitId;

use super::change::Change;
use super::document::Document;
use super::file::read_all;
use super::manager::Worker;
use super::revision::{Calibrations, Record, Revision, Skipped};
use super::store::instead;
use crate::control::watch::{Known, files_in};
use crate::signing::check_signature;

impl Worker {
    /// Takes over calibrations that the program itself was started with.
    pub(crate) fn take_over(&mut self, calibrations: &Calibrations) {
        for (unit, plan) in &calibrations.plans {
            self.records.insert(unit.clone(), Record { plan: plan.clone(), ..Record::default() });
        }
    }

    /// Puts the last good set of every unit of the state folder in force again, under its old revision.
    pub(crate) fn restore(&mut self) {
        let units: Vec<_> = self.store.units().cloned().collect();
        let restored = units.into_iter().map(|unit| (self.restored(&unit), unit));
        let mut restored: Vec<_> = restored.collect();
        let skipped = restored.iter().filter_map(|(record, _)| record.skipped.as_ref());
        let lacking: BTreeSet<_> = skipped.flat_map(|skipped| skipped.digests.iter().copied()).collect();
        if self.fetch_from_folder(&lacking) {
            let damaged = restored.iter_mut().filter(|(record, _)| record.skipped.is_some());
            damaged.for_each(|(record, unit)| *record = self.restored(unit));
        }
        for (record, unit) in restored {
            if let Some(current) = &record.plan.current {
                tracing::info!(%unit, revision = current.number.counter, "last good calibration restored");
            }
            if let Some((revision, at)) = record.plan.waiting() {
                tracing::info!(%unit, revision, ?at, "accepted calibration restored, it waits for its tick");
            }
            self.plan_again(&unit, record);
        }
    }

    /// Writes documents that are damaged in the state folder anew, as far as the folder of calibrations has them; whether it had any.
    fn fetch_from_folder(&mut self, lacking: &BTreeSet<Digest>) -> bool {
        let Some(folder) = self.folder.path.as_ref().filter(|_| !lacking.is_empty()) else { return false };
        // Where it cannot be read, that is told when it is read for its own sake.
        let files = files_in(folder, "toml").unwrap_or_default();
        let read = read_all(&files).into_iter().filter_map(|(file, read)| Some((file, read.ok()?)));
        let mut found = false;
        for (file, read) in read.filter(|(_, read)| lacking.contains(&read.digest)) {
            match self.store.put_document(&read.bytes()) {
                Ok(digest) => {
                    found = true;
                    tracing::warn!(
                        "document {digest} of the state folder is damaged: restored from {}",
                        file.display()
                    );
                }
                Err(error) => tracing::error!("a damaged document cannot be written anew: {error}"),
            }
        }
        found
    }

    /// What the state folder says of a unit.
    pub(super) fn restored(&self, unit: &UnitId) -> Record {
        let mut record = Record::default();
        let mut skipped: Vec<(&GoodSet, Vec<Problem>)> = Vec::new();
        let orders = self.store.intent(unit).into_iter().flat_map(Intent::orders);
        // What was carried out once is understood.
        record.plan.intent = orders.filter_map(|order| self.core_command(&order).ok()).collect();
        for set in self.store.good_sets(unit) {
            let document = match Document::stored(&self.store, set) {
                Ok(document) => Arc::new(document),
                Err(problems) => {
                    skipped.push((set, problems));
                    continue;
                }
            };
            if record.last().is_none() {
                record.untrusted = self.distrust(set.revision, &document);
            }
            let next = Arc::new(Revision::new(set.revision, document, &set.source));
            // One that still waited for its tick goes on waiting, over the one before.
            if !set.in_force && set.schedule != Schedule::NextTick && record.plan.pending.is_none() {
                let slew = Span::from_ns(i64::try_from(set.slew_ms).unwrap_or(0).saturating_mul(1_000_000));
                record.plan.pending = Some(Change { next, at: set.schedule, slew });
            } else {
                record.plan.current = Some(next);
                break;
            }
        }
        record.skipped = skipped.first().map(|(_, problems)| Skipped {
            digests: skipped.iter().map(|(set, _)| set.digest).collect(),
            words: format!(
                "revision {} cannot be put in force again: {}; {}; put the newer document in force with `isotherm swap`",
                few(skipped.iter().map(|(set, _)| set.revision.to_string())),
                problems.first().map(ToString::to_string).unwrap_or_default(),
                instead(record.plan.current.as_ref().map(|current| current.number.counter)),
            ),
        });
        record
    }

    /// Takes what stands in the folder as far as it has changed since it was last seen. The second value is how many
    /// documents are not taken.
    ///
    /// # Errors
    /// Where the folder itself cannot be read.
    pub(crate) fn read_folder(&mut self) -> std::io::Result<(Known, usize)> {
        let mut found = Known::new();
        let Some(folder) = self.folder.path.clone() else { return Ok((found, 0)) };
        let mut contents = Vec::new();
        let mut bad = 0;
        for (file, read) in read_all(&files_in(&folder, "toml")?) {
            match read {
                Ok(read) => {
                    found.insert(file.clone(), Some(read.digest));
                    self.folder.enter(&file, &read);
                    contents.push((file, read));
                }
                Err(error) => {
                    let problem = self.folder.unreadable(&file, &error.to_string());
                    tracing::error!("{problem}");
                    found.insert(file, None);
                    bad += 1;
                }
            }
        }
        // All of them are entered by now: rivals know of each other. What is accepted goes to the disk together.
        self.group = Some(Vec::new());
        for (file, read) in contents {
            bad += usize::from(!self.take_file(&file, &read, true));
        }
        bad += self.end_group();
        self.miss_documents();
        let (count, units) = (self.records.len(), few(self.records.keys().map(UnitId::as_str)));
        tracing::info!(folder = %folder.display(), count, units, bad_documents = bad, "calibrations read");
        Ok((found, bad))
    }

    /// Whether any unit has been given anything.
    pub(crate) fn has_units(&self) -> bool {
        self.records.values().any(|record| record.last().is_some())
    }

    /// Goes on without a folder that cannot be read, with what the state folder has.
    pub(crate) fn miss_folder(&mut self, error: &std::io::Error) {
        tracing::error!(
            "the folder of calibrations cannot be read: {error}; the last good sets are in force until it is back"
        );
        self.folder.gone = Some(error.to_string());
    }

    /// Why a calibration that is put in force again would be refused today for want of a signature, where signatures are
    /// asked for. It is put in force all the same: a unit does not lose its calibration by a key that was taken away.
    fn distrust(&self, revision: u64, document: &Document) -> Option<String> {
        if !self.swap.require_signature {
            return None;
        }
        let signed = document.signed()?.text();
        let name = format!("revision {revision}");
        let (mut problems, mut warnings) = (Vec::new(), Vec::new());
        check_signature(&self.swap, &signed, &name, &mut problems, &mut warnings);
        let first = problems.first()?;
        Some(format!(
            "revision {revision} is restored, but would be refused now: {}; it stays in force until you swap to a \
             document signed by a trusted key (`isotherm swap`)",
            first.message
        ))
    }

    /// Warns of units whose document has gone from the folder.
    fn miss_documents(&self) {
        // What could not be put in force again is told by itself.
        for (unit, record) in self.records.iter().filter(|(_, record)| record.skipped.is_none()) {
            let set = self.store.last_good(unit).filter(|set| !self.folder.holds(&set.digest));
            let file = set.and_then(|set| set.source.file()).filter(|file| !Path::new(file).exists());
            if let (Some(file), Some(last)) = (file, record.last()) {
                tracing::warn!(
                    %unit, revision = last.number.counter, "{file} is gone; its content is the last good set and is in \
                        force"
                );
            }
        }
    }
}
