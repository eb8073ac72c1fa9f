//! What holds when the service starts: the last good sets of the state folder, then what has become of the documents since.

use std::path::Path;
use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::units::Span;
use isotherm_protocol::control::Schedule;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::{Document, Problem};
use isotherm_protocol::history::{GoodSet, Intent};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::overlay::Overlay;
use isotherm_protocol::stream::Label;

use super::admit::check_signature;
use super::file::read_all;
use super::reading::shared;
use super::record::{Active, Layers, Record, Written};
use super::worker::Worker;
use crate::control::calibrations::{Calibrations, Change, Installable, Plan};
use crate::control::compressed::CompressedText;
use crate::control::store::Store;
use crate::control::watch::{Known, documents_in};
use isotherm_document::{file, unplaced};

/// How many units a line of the log names.
const NAMED: usize = 8;

/// What was found of each file of the folder, for its watcher.
pub(crate) type Found = std::collections::BTreeMap<std::path::PathBuf, Known>;

impl Worker {
    /// Takes over calibrations that the program itself was started with.
    pub(crate) fn take_over(&mut self, calibrations: &Calibrations) {
        for (unit, plan) in calibrations.iter() {
            let Some(current) = &plan.current else { continue };
            let active = Active {
                revision: current.revision.counter,
                created_unix_s: None,
                calibration: Arc::clone(&current.calibration),
                written: None,
            };
            let counter = active.revision;
            self.records.insert(unit.clone(), Record { counter, active: Some(active), ..Record::default() });
        }
    }

    /// Puts the last good set of every unit of the state folder in force again, under its old revision.
    pub(crate) fn restore(&mut self) {
        let units: Vec<_> = self.store.units().cloned().collect();
        for unit in units {
            let (record, plan) = self.restored(&unit);
            if let Some(active) = &record.active {
                tracing::info!(%unit, revision = active.revision, "last good calibration restored");
            }
            self.intake.restore(&unit, plan);
            self.records.insert(unit, record);
        }
    }

    /// What the state folder says of a unit.
    pub(super) fn restored(&self, unit: &UnitId) -> (Record, Plan) {
        let mut record = Record { counter: self.store.highest_revision(unit), ..Record::default() };
        let orders = self.store.intent(unit).into_iter().flat_map(Intent::orders);
        // What was carried out once is understood.
        let intent = orders.filter_map(|order| self.core_command(&order).ok()).collect();
        let mut plan = Plan { intent, ..Plan::default() };
        for set in self.store.good_sets(unit) {
            let (written, label, calibration) = match written(&self.store, set) {
                Ok(written) => written,
                Err(problems) => {
                    for problem in problems {
                        tracing::error!(%unit, revision = set.revision, "cannot be put in force again: {problem}");
                    }
                    continue;
                }
            };
            let created_unix_s = label.created_unix_s;
            let next = Installable::of_document(
                set.revision,
                Arc::clone(&calibration),
                (label, set.overlay),
                written.text.clone(),
                &set.source,
            );
            let next = Arc::new(next);
            if record.active.is_none() {
                record.untrusted = self.distrust(unit, set.revision, &written);
            }
            record.active.get_or_insert(Active {
                revision: set.revision,
                created_unix_s,
                calibration,
                written: Some(written),
            });
            // One that still waited for its tick goes on waiting, over the one before.
            if !set.in_force && set.schedule != Schedule::NextTick && plan.pending.is_none() {
                let slew = Span::from_ns(i64::try_from(set.slew_ms).unwrap_or(0).saturating_mul(1_000_000));
                plan.pending = Some(Change { next, at: set.schedule, slew });
            } else {
                plan.current = Some(next);
                break;
            }
        }
        (record, plan)
    }

    /// Takes what stands in the folder as far as it has changed since it was last seen. The second value is how many
    /// documents are not taken.
    ///
    /// # Errors
    /// Where the folder itself cannot be read.
    pub(crate) fn read_folder(&mut self) -> std::io::Result<(Found, usize)> {
        let mut found = Found::new();
        let Some(folder) = self.folder.path().map(Path::to_owned) else { return Ok((found, 0)) };
        let mut contents = Vec::new();
        let mut bad = 0;
        for (file, read) in read_all(&documents_in(&folder)?) {
            match read {
                Ok(read) => {
                    found.insert(file.clone(), Known::Content(read.digest.0));
                    self.folder.enter(&file, &read);
                    contents.push((file, read));
                }
                Err(error) => {
                    let problem =
                        unplaced(Some(&file.display().to_string()), format!("cannot be read: {error}"));
                    tracing::error!("{problem}");
                    self.folder.unreadable(&file, problem);
                    found.insert(file, Known::Unreadable);
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
        tracing::info!(
            folder = %folder.display(), count = self.records.len(), units = first_of(self.records.keys()),
            bad_documents = bad, "calibrations read"
        );
        Ok((found, bad))
    }

    /// Whether any unit has been given anything.
    pub(crate) fn has_units(&self) -> bool {
        self.records.values().any(|record| record.active.is_some())
    }

    /// Goes on without a folder that cannot be read, with what the state folder has.
    pub(crate) fn miss_folder(&mut self, error: &std::io::Error) {
        tracing::error!(
            "the folder of calibrations cannot be read: {error}; the last good sets are in force until it is back"
        );
        self.folder.miss(error.to_string());
    }

    /// Why a calibration that is put in force again would be refused today for want of a signature, where signatures are
    /// asked for. It is put in force all the same: a unit does not lose its calibration by a key that was taken away.
    ///
    /// What an overlay lies on is what was signed; the overlay may be the service's own.
    fn distrust(&self, unit: &UnitId, revision: u64, written: &Written) -> Option<String> {
        if !self.swap.require_signature {
            return None;
        }
        let signed = written.layers.as_ref().map_or(&written.text, |layers| &layers.base).read();
        let name = format!("revision {revision}");
        let (mut problems, mut warnings) = (Vec::new(), Vec::new());
        check_signature(&self.swap, &signed, &name, &mut problems, &mut warnings);
        let first = problems.first()?;
        let words = format!(
            "revision {revision} is restored, but would be refused now: {}; it stays in force until you swap to a \
             document signed by a trusted key (`isotherm swap`)",
            first.message
        );
        tracing::error!(%unit, revision, "{words}");
        Some(words)
    }

    /// Warns of units whose document has gone from the folder.
    fn miss_documents(&self) {
        for (unit, record) in &self.records {
            let set = self.store.last_good(unit).filter(|set| !self.folder.holds(&set.digest));
            let file = set.and_then(|set| set.source.file()).filter(|file| !Path::new(file).exists());
            if let (Some(file), Some(active)) = (file, &record.active) {
                tracing::warn!(
                    %unit, revision = active.revision, "{file} is gone; its content is the last good set and is in \
                        force"
                );
            }
        }
    }
}

/// The first few units, and how many more there are.
pub(super) fn first_of<'u>(units: impl ExactSizeIterator<Item = &'u UnitId>) -> String {
    let beyond = units.len().saturating_sub(NAMED);
    let named: Vec<_> = units.take(NAMED).map(UnitId::as_str).collect();
    let more = if beyond > 0 { format!(" and {beyond} more") } else { String::new() };
    named.join(" ") + &more
}

/// Text, label and calibration of a good set.
pub(super) fn written(
    store: &Store,
    set: &GoodSet,
) -> Result<(Written, Label, Arc<Calibration>), Vec<Problem>> {
    let file = store.document_file(&set.digest);
    let name = file.map_or_else(|| format!("document {}", set.digest), |file| file.display().to_string());
    let problem = |message: String| vec![unplaced(Some(&name), message)];
    let bytes = store.document(&set.digest).map_err(|error| problem(error.to_string()))?;
    let bytes = bytes.ok_or_else(|| problem("is no longer in the state folder".to_owned()))?;
    let document_text = file::text(&bytes, &name)?;
    let parsed = Document::parse(document_text, Some(&name))?;
    let written = Written {
        digest: set.digest,
        text: CompressedText::new(document_text),
        layers: set.overlay.and_then(|overlay| layers(store, overlay)).map(Box::new),
    };
    let label = Label::of(&parsed.document, set.digest, "");
    Ok((written, label, shared(&parsed.calibration)))
}

/// What a document with an overlay was made from; `None` where that is not kept any more.
pub(super) fn layers(store: &Store, digest: Digest) -> Option<Layers> {
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).ok();
    let overlay = store.overlay(&digest).ok().flatten().and_then(text)?;
    let (text_of, overlay) = (CompressedText::new(&overlay), Overlay::parse(&overlay, None).ok()?.overlay);
    let base = store.document(&overlay.overlay_of.parse().ok()?).ok().flatten().and_then(text)?;
    Some(Layers { base: CompressedText::new(&base), overlay, text: text_of, digest })
}
