//! The swap manager's thread: one request after the other.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_protocol::document::Problem;
use isotherm_protocol::history::{AuditEvent, FirstTick};
use isotherm_protocol::key::UnitId;

use super::control_status::ControlStatus;
use super::folder::Folder;
use super::inbox::Request;
use super::queue::{Queue, Stopped};
use super::record::Record;
use super::refusals::Refusals;
use super::swap::Judged;
use crate::config::{Settings, SwapSettings};
use crate::control::store::{Opened, Store, StoreError};
use crate::receive::intake::Intake;

/// What the swap manager works with.
#[derive(Debug)]
pub(crate) struct Worker {
    pub(super) swap: SwapSettings,
    pub(super) pre_launch: PreLaunchSettings,
    pub(super) in_standby: bool,
    /// Whether who asks is who a certificate says.
    pub(super) certified_names: bool,
    pub(super) intake: Arc<Intake>,
    pub(super) store: Store,
    /// Number of the last entry of the audit file.
    pub(super) entries: u64,
    pub(super) records: BTreeMap<UnitId, Record>,
    pub(super) folder: Folder,
    pub(super) refusals: Refusals,
    pub(super) control_status: Arc<ControlStatus>,
    /// Why nothing can be written down.
    pub(super) lost: Option<String>,
    /// What the state folder had lost when it was opened, with the unit that it concerns.
    pub(super) losses: Vec<(Option<UnitId>, String)>,
    /// Documents that were found good and are to be written down together; `None` where each goes by itself.
    pub(super) group: Option<Vec<Judged>>,
    /// First ticks that another instance is to write down, and has not yet.
    pub(super) unclaimed: Vec<(UnitId, FirstTick)>,
    /// Files whose documents could not be written down, and why.
    pub(super) unwritten: Vec<(String, Problem)>,
    /// When such a file is tried again.
    pub(super) next_retry: Instant,
    /// One is being tried again: that it fails once more is no news.
    pub(super) retrying: bool,
}

/// How often the state folder is looked at where nothing is asked for.
const LOOK_INTERVAL: Duration = Duration::from_secs(1);

impl Worker {
    /// A swap manager that knows nothing yet; [`Worker::restore`] and [`Worker::read_folder`] tell it what holds.
    pub(crate) fn new(settings: &Settings, intake: Arc<Intake>, store: Store, opened: &Opened) -> Self {
        let last = store.history(None, 1).unwrap_or_default();
        Self {
            entries: last.last().map_or(0, |entry| entry.number),
            swap: settings.swap.clone(),
            pre_launch: settings.pre_launch,
            in_standby: settings.unit.in_standby,
            certified_names: settings.certified_names,
            intake,
            store,
            records: BTreeMap::new(),
            folder: Folder::new(settings.calibrations.as_deref()),
            refusals: Refusals::default(),
            control_status: Arc::default(),
            lost: None,
            losses: losses(opened),
            group: None,
            unclaimed: Vec::new(),
            unwritten: Vec::new(),
            next_retry: Instant::now(),
            retrying: false,
        }
    }

    /// What the service's own status shows of the swap manager.
    pub(crate) fn control_status(&self) -> Arc<ControlStatus> {
        // Whoever looks finds something, however late the thread begins.
        self.show();
        Arc::clone(&self.control_status)
    }

    /// Works until it is told to stop, and then finishes what units still have to tell.
    pub(super) fn run(mut self, queue: &Queue) {
        self.show();
        loop {
            queue.know(self.records.keys());
            let request = match queue.take(LOOK_INTERVAL) {
                Ok(request) => request,
                Err(Stopped) => break,
            };
            // Unwind safety: what is kept is changed only after everything that could go wrong has gone well.
            let work = AssertUnwindSafe(|| {
                self.keep_store();
                if let Some(request) = request {
                    self.take(request);
                }
                self.retry_unwritten(Instant::now());
            });
            if catch_unwind(work).is_err() {
                tracing::error!(
                    "alarm: a swap, command or query ended in a panic; the calibration in force stays"
                );
            }
            self.show();
        }
        // Nobody waits for a swap manager that has ended.
        queue.end();
        let untold = self.intake.each_unit(|actor| (actor.id().clone(), actor.take_untold()));
        for (unit, notices) in untold {
            for notice in notices {
                self.note(&unit, notice);
            }
        }
    }

    /// Sees to it that what is written down is found again, and tells where it is not.
    fn keep_store(&mut self) {
        let actives =
            self.records.values().flat_map(|record| record.active.iter().chain(record.before.as_deref()));
        let written = actives.filter_map(|active| active.written.as_ref());
        let layers = written.clone().filter_map(|written| written.layers.as_ref());
        let bases = layers.clone().map(|layers| layers.base.read());
        let documents = written.map(|written| written.text.read()).chain(bases);
        let overlays = layers.map(|layers| layers.text.read());
        match self.store.keep(SystemTime::now(), documents, overlays) {
            Ok(false) => {
                if self.lost.take().is_some() {
                    tracing::info!("the state folder is back: swaps are accepted again");
                }
            }
            Ok(true) => {
                self.lost = None;
                tracing::warn!(
                    "the state folder was replaced: what is in force was written into the new one; earlier documents \
                     and entries are in the old one"
                );
            }
            Err(error) => {
                let words = error.to_string();
                if self.lost.as_ref() != Some(&words) {
                    tracing::error!("swaps are refused, the state folder cannot be written: {words}");
                }
                self.lost = Some(words);
            }
        }
    }

    /// Does what is asked for.
    fn take(&mut self, request: Request) {
        match request {
            Request::Folder(event) => self.folder_event(event),
            Request::Calibration(query, origin) => self.answer_calibration(&query, origin),
            Request::Put(sample) => self.take_put(&sample),
            Request::Command(query, origin) => self.answer_command(&query, origin),
            Request::History(query) => self.answer_history(&query),
            Request::Notice(unit, notice) => self.note(&unit, notice),
            Request::JudgeAgain => self.judge_bad_again(),
            Request::Kept(query) => self.answer_kept(&query),
            Request::Lacks(carried, answer) => drop(answer.send(self.lacking(&carried))),
            Request::Carry(carried) => self.carry(&carried),
        }
    }

    /// Writes an entry down.
    ///
    /// # Errors
    /// Where it cannot be written: nothing is, then.
    pub(super) fn append(
        &mut self,
        unit: Option<&UnitId>,
        by: &str,
        event: AuditEvent,
    ) -> Result<(), StoreError> {
        // What was accepted before comes before.
        self.write_group();
        self.entries = self.store.append(SystemTime::now(), unit, by, event)?;
        Ok(())
    }
}

/// What was lost, in words, with the unit that it concerns.
fn losses(opened: &Opened) -> Vec<(Option<UnitId>, String)> {
    let lost = opened.lost.iter().map(|lost| (UnitId::new(&lost.unit).ok(), lost.to_string()));
    lost.chain(opened.emptied.iter().map(|emptied| (None, emptied.to_string()))).collect()
}
