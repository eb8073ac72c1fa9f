//! How the registrar is asked.

use std::sync::mpsc::{SyncSender, TrySendError};

use isotherm_correction::prelaunch::Outcome;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::stream::InForce;
use zenoh::Wait;
use zenoh::query::Query;
use zenoh::sample::Sample;

use super::WAITING_REQUESTS;
use crate::watch::FolderEvent;

/// What the registrar is asked for, or told.
#[derive(Debug)]
pub(super) enum Request {
    /// A file of the folder has changed.
    Folder(FolderEvent),
    /// A query on `imu/*/calibration`: a swap, or the active document.
    Calibration(Query),
    /// A put on `imu/*/calibration`: a swap.
    Put(Sample),
    /// A query on `imu/*/command`.
    Command(Query),
    /// A query on `imu/*/history`.
    History(Query),
    /// A unit has something to tell.
    Notice(UnitId, Notice),
    /// Finish and end.
    Stop,
}

/// What a unit has to tell.
#[derive(Debug, Clone)]
pub(crate) enum Notice {
    /// The first tick of a revision was corrected.
    InForce(InForce),
    /// A pre-launch calibration has ended.
    PreLaunch(PreLaunchEnd),
}

/// A pre-launch calibration that has ended.
#[derive(Debug, Clone)]
pub(crate) struct PreLaunchEnd {
    /// What came of it; `None` where it was given up.
    pub(crate) outcome: Option<Outcome>,
    /// What it was given up for, where no command did it.
    pub(crate) given_up: Option<String>,
    /// Revision counter of the calibration that it was made with.
    pub(crate) revision: u64,
    /// When it began (ns on the producer's clock).
    pub(crate) start_ns: i64,
    /// End of its last tick (ns on the producer's clock).
    pub(crate) end_ns: i64,
}

/// Asks the registrar; never waits, except where it says so.
#[derive(Debug, Clone)]
pub(crate) struct Desk(SyncSender<Request>);

impl Desk {
    pub(super) fn new(requests: SyncSender<Request>) -> Self {
        Self(requests)
    }

    /// Hands a query on `imu/*/calibration` over.
    pub(crate) fn calibration(&self, query: Query) {
        self.ask(Request::Calibration(query));
    }

    /// Hands a put on `imu/*/calibration` over.
    pub(crate) fn put(&self, sample: Sample) {
        self.ask(Request::Put(sample));
    }

    /// Hands a query on `imu/*/command` over.
    pub(crate) fn command(&self, query: Query) {
        self.ask(Request::Command(query));
    }

    /// Hands a query on `imu/*/history` over.
    pub(crate) fn history(&self, query: Query) {
        self.ask(Request::History(query));
    }

    /// Hands an event of the folder over; waits for its turn, on the watcher's own thread.
    pub(crate) fn folder(&self, event: FolderEvent) {
        // Fails where the registrar has ended: then nobody wants it.
        let _ = self.0.send(Request::Folder(event));
    }

    /// Hands a unit's notice over; gives it back where too much is waiting.
    pub(crate) fn notice(&self, unit: &UnitId, notice: Notice) -> Result<(), Notice> {
        match self.0.try_send(Request::Notice(unit.clone(), notice)) {
            Err(TrySendError::Full(Request::Notice(_, notice))) => Err(notice),
            // Where the registrar has ended nobody wants it.
            _ => Ok(()),
        }
    }

    /// Hands a request over, or tells its asker that too much is waiting.
    fn ask(&self, request: Request) {
        let (request, why) = match self.0.try_send(request) {
            Ok(()) => return,
            Err(TrySendError::Full(request)) => (request, format!("{WAITING_REQUESTS} requests are waiting")),
            Err(TrySendError::Disconnected(request)) => (request, "the service is ending".to_owned()),
        };
        tracing::warn!("a swap, command or question is refused: {why}");
        if let Request::Calibration(query) | Request::Command(query) | Request::History(query) = request {
            let words = format!("refused: {why}; nothing has changed, try again");
            // The asker may have gone.
            let _ = query.reply_err(words).wait();
        }
    }
}
