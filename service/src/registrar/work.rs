//! The registrar's thread: one request after the other.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::SystemTime;

use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_protocol::history::AuditEvent;
use isotherm_protocol::key::UnitId;

use super::board::Board;
use super::desk::Request;
use super::folder::Folder;
use super::record::Record;
use super::refusals::Refusals;
use crate::config::{Settings, SwapSettings};
use crate::intake::Intake;
use crate::store::{Store, StoreError};

/// What the registrar works with.
#[derive(Debug)]
pub(crate) struct Work {
    pub(super) swap: SwapSettings,
    pub(super) pre_launch: PreLaunchSettings,
    pub(super) in_standby: bool,
    pub(super) intake: Arc<Intake>,
    pub(super) store: Store,
    /// Number of the last entry of the audit file.
    pub(super) entries: u64,
    pub(super) records: BTreeMap<UnitId, Record>,
    pub(super) folder: Folder,
    pub(super) refusals: Refusals,
    pub(super) board: Arc<Board>,
}

impl Work {
    /// A registrar that knows nothing yet; [`Work::restore`] and [`Work::read_folder`] tell it what holds.
    pub(crate) fn new(settings: &Settings, intake: Arc<Intake>, store: Store) -> Self {
        let last = store.history(None, 1).unwrap_or_default();
        Self {
            entries: last.last().map_or(0, |entry| entry.number),
            swap: settings.swap.clone(),
            pre_launch: settings.pre_launch,
            in_standby: settings.unit.in_standby,
            intake,
            store,
            records: BTreeMap::new(),
            folder: Folder::new(settings.calibrations.as_deref()),
            refusals: Refusals::default(),
            board: Arc::default(),
        }
    }

    /// What the service's own status shows of the registrar.
    pub(crate) fn board(&self) -> Arc<Board> {
        Arc::clone(&self.board)
    }

    /// Works until it is told to stop, and then finishes what units still have to tell.
    pub(super) fn run(mut self, requests: Receiver<Request>) {
        self.show();
        for request in &requests {
            if matches!(request, Request::Stop) {
                break;
            }
            // Unwind safety: what is kept is changed only after everything that could go wrong has gone well.
            if catch_unwind(AssertUnwindSafe(|| self.take(request))).is_err() {
                tracing::error!(
                    "alarm: a swap, command or question was given up by a panic; what is in force stays"
                );
            }
            self.show();
        }
        // Nobody waits for a registrar that has ended.
        drop(requests);
        let untold = self.intake.each_unit(|actor| (actor.id().clone(), actor.take_untold()));
        for (unit, notices) in untold {
            for notice in notices {
                self.note(&unit, notice);
            }
        }
    }

    /// Does what is asked for.
    fn take(&mut self, request: Request) {
        match request {
            Request::Folder(event) => self.folder_event(event),
            Request::Calibration(query) => self.answer_calibration(&query),
            Request::Put(sample) => self.take_put(&sample),
            Request::Command(query) => self.answer_command(&query),
            Request::History(query) => self.answer_history(&query),
            Request::Notice(unit, notice) => self.note(&unit, notice),
            Request::Stop => {}
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
        self.entries = self.store.append(SystemTime::now(), unit, by, event)?;
        Ok(())
    }
}
