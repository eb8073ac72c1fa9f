//! The swap manager: the thread that does what is asked for, one message after the other.
//!
//! It owns the state folder, what each unit was given and what the folder of documents holds. It reads, decides, writes to disk
//! and only then touches a unit, for as long as a pointer takes. Receive threads ask and go on: where too much is waiting the
//! asker is told so.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_protocol::document::Problem;
use isotherm_protocol::history::{AuditEvent, FirstTick};
use isotherm_protocol::journal::JournalEntry;
use isotherm_protocol::key::UnitId;

use super::compressed::Compressed;
use super::control_status::ControlStatus;
use super::decision::Decision;
use super::folder::Folder;
use super::queue::{Inbox, Message, Notice, Stopped};
use super::refusals::Refusals;
use super::request::Request;
use super::revision::Record;
use super::store::{Loss, Store, StoreError};
use crate::config::{Settings, SwapSettings};
use crate::receive::intake::Intake;

/// The running swap manager. Dropped without [`SwapManager::stop`] it ends by itself after what waits.
#[derive(Debug)]
pub(crate) struct SwapManager {
    inbox: Inbox,
    thread: Option<JoinHandle<()>>,
}

impl SwapManager {
    /// Starts it, for what is asked for in `inbox`.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub(crate) fn start(inbox: &Inbox, work: Worker) -> std::io::Result<Self> {
        let (inbox, requests) = (inbox.clone(), inbox.clone());
        let thread = std::thread::Builder::new().name("isotherm-control".to_owned()).spawn(move || {
            yield_to_ticks();
            work.run(&requests);
        })?;
        Ok(Self { inbox, thread: Some(thread) })
    }

    /// Has it finish what waits and ends it; whether it ended in order.
    pub(crate) fn stop(mut self) -> bool {
        self.inbox.stop();
        self.thread.take().is_some_and(|thread| thread.join().is_ok())
    }
}

/// How much less this thread is worth than those that receive: a swap takes milliseconds, and ticks must not wait for a core meanwhile.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 10;

/// Has the thread give way to the others where there are too few cores. Only Linux knows priorities of single threads.
fn yield_to_ticks() {
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::process::setpriority_process(None, NICENESS) {
        tracing::debug!("the swap manager keeps its priority: {error}");
    }
}

impl Drop for SwapManager {
    fn drop(&mut self) {
        // Units hold a way to it for as long as it holds them: nothing else would ever end it.
        self.inbox.stop();
    }
}

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
    pub(super) records: BTreeMap<UnitId, Record>,
    pub(super) folder: Folder,
    /// Swaps accepted since the service started, those of units that were forgotten too.
    pub(super) accepted: u64,
    pub(super) refusals: Refusals,
    pub(super) control_status: Arc<ControlStatus>,
    /// Why nothing can be written down.
    pub(super) lost: Option<String>,
    /// What the state folder had lost when it was opened.
    pub(super) losses: Vec<Loss>,
    /// Documents that were found good and are to be written down together; `None` where each goes by itself.
    pub(super) group: Option<Vec<(Request, Decision)>>,
    /// First ticks that another instance is to write down, and has not yet.
    pub(super) unclaimed: BTreeMap<UnitId, FirstTick>,
    /// What other instances were ordered and this one goes on with, and could not write down.
    pub(super) followed: Vec<(UnitId, Box<JournalEntry>)>,
    /// Units whose history at the other instance could not be copied.
    pub(super) uncopied: BTreeSet<UnitId>,
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
    pub(crate) fn new(settings: &Settings, intake: Arc<Intake>, store: Store, losses: Vec<Loss>) -> Self {
        Self {
            swap: settings.swap.clone(),
            pre_launch: settings.pre_launch,
            in_standby: settings.unit.in_standby,
            certified_names: settings.zenoh.certified_names,
            intake,
            store,
            records: BTreeMap::new(),
            folder: Folder::new(settings.calibrations.clone()),
            accepted: 0,
            refusals: Refusals::default(),
            control_status: Arc::default(),
            lost: None,
            losses,
            group: None,
            unclaimed: BTreeMap::new(),
            followed: Vec::new(),
            uncopied: BTreeSet::new(),
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
    pub(super) fn run(mut self, queue: &Inbox) {
        self.show();
        loop {
            queue.know(self.records.keys());
            let message = match queue.take(LOOK_INTERVAL) {
                Ok(message) => message,
                Err(Stopped) => break,
            };
            // Unwind safety: what is kept is changed only after everything that could go wrong has gone well.
            let work = AssertUnwindSafe(|| {
                self.keep_store();
                self.retry_followed();
                if let Some(message) = message {
                    self.take(message);
                }
                self.retry_files(Instant::now());
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
                self.take_notice(&unit, notice);
            }
        }
    }

    /// Sees to it that what is written down is found again, and tells where it is not.
    fn keep_store(&mut self) {
        let revisions = self.records.values().flat_map(|record| record.plan.revisions());
        let kept = revisions.map(|revision| &revision.document);
        let layers = kept.clone().filter_map(|document| document.layers.as_ref());
        let bases = layers.clone().map(|layers| &layers.base);
        let documents = kept.filter_map(|document| document.text.as_ref()).chain(bases);
        let documents = documents.map(Compressed::read);
        let overlays = layers.map(|layers| layers.text.read());
        let lost = match self.store.keep(SystemTime::now(), documents, overlays) {
            // A trial that goes well is less than a document that does not.
            Ok(false) => self
                .store
                .write_failure()
                .map(ToOwned::to_owned)
                .or_else(|| self.lost.clone().filter(|_| !self.folder.unwritten().is_empty())),
            Ok(true) => {
                tracing::warn!(
                    "the state folder was replaced: what is in force was written into the new one; earlier documents \
                     and entries are in the old one"
                );
                // That it can be written is said by that.
                self.lost = None;
                None
            }
            Err(error) => Some(error.to_string()),
        };
        // Told once: what fails first changes by turns.
        if let Some(words) = lost.as_ref().filter(|_| self.lost.is_none()) {
            tracing::error!("swaps are refused, the state folder cannot be written: {words}");
        } else if self.lost.is_some() && lost.is_none() {
            tracing::info!("the state folder can be written: swaps are accepted again");
        }
        self.lost = lost;
    }

    /// Does what is asked for.
    fn take(&mut self, message: Message) {
        match message {
            Message::Query(asked, query, origin) => self.answer(asked, &query, origin),
            Message::Put(sample) => self.take_put(&sample),
            Message::Folder(event) => self.folder_event(event),
            Message::JudgeAgain => self.judge_bad_again(),
            Message::Notice(unit, notice) => self.take_notice(&unit, notice),
            Message::Lacks(carried, answer) => drop(answer.send(self.lacking(&carried))),
            Message::Carry(carried, done) => {
                if self.carry(&carried) {
                    let _ = done.send(());
                }
            }
        }
    }

    /// Takes what a unit has to tell.
    fn take_notice(&mut self, unit: &UnitId, notice: Notice) {
        match notice {
            Notice::InForce(first) => {
                let revision = first.revision.counter;
                let tick = FirstTick {
                    revision,
                    series: first.series,
                    first_sequence: first.sequence,
                    first_end_time_ns: first.end_time_ns,
                };
                if !self.intake.speaks_for(unit) {
                    // That one writes it down, and where it does not any more, this one does when it speaks.
                    self.unclaimed.insert(unit.clone(), tick);
                    return;
                }
                tracing::info!(%unit, revision, sequence = first.sequence, "calibration in force");
                self.note(Some(unit), "", AuditEvent::InForce(tick), "the first tick");
                // It may have appeared only now: what was accepted for it before, it does not know of.
                self.tell_account(unit);
            }
            // Where another instance speaks, that one stores the result.
            Notice::PreLaunch(end) if self.intake.speaks_for(unit) => self.pre_launch_ended(unit, &end),
            Notice::PreLaunch(_) => {}
            Notice::Followed(entry) => self.note_followed(unit, entry),
            Notice::Speaks => self.claim(unit),
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
        self.store.append(SystemTime::now(), unit, by, event).map(drop)
    }

    /// Writes down what happens whether or not it can be written down.
    pub(super) fn note(&mut self, unit: Option<&UnitId>, by: &str, event: AuditEvent, what: &str) {
        let revision = match &event {
            AuditEvent::InForce(first) => Some(first.revision),
            AuditEvent::Withdrawn(withdrawal) => Some(withdrawal.revision),
            _ => None,
        };
        if let Err(error) = self.append(unit, by, event) {
            let unit = unit.map(tracing::field::display);
            tracing::error!(unit, revision, "{what} is not in the audit file: {error}");
        }
    }
}
