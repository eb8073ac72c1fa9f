//! How the swap manager is asked.

use std::sync::Arc;

use isotherm_correction::prelaunch::Outcome;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::journal::JournalEntry;
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::stream::InForce;
use tokio::sync::oneshot;
use zenoh::Wait;
use zenoh::query::Query;
use zenoh::sample::Sample;

use super::carry::Carried;
use super::queue::{Queue, Refused};
use crate::control::watch::FolderEvent;

/// What the swap manager is asked for, or told.
#[derive(Debug)]
pub(super) enum Request {
    /// A file of the folder has changed.
    Folder(FolderEvent),
    /// A query on `imu/*/calibration`: a swap, or the active document.
    Calibration(Query, Origin),
    /// A put on `imu/*/calibration`: a swap.
    Put(Sample),
    /// A query on `imu/*/command`.
    Command(Query, Origin),
    /// A query on `imu/*/history`.
    History(Query),
    /// A unit has something to tell.
    Notice(UnitId, Notice),
    /// Judge the documents of the folder again that are not taken.
    JudgeAgain,
    /// A query on `isotherm/*/kept/*`.
    Kept(Query),
    /// What another instance has written down; what of it is lacking here.
    Lacks(Carried, oneshot::Sender<Vec<Digest>>),
    /// What another instance has written down.
    Carry(Carried),
}

/// Where an order comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Origin {
    /// Another process.
    Bus,
    /// This one: the console in the browser, which asks for its token.
    Console,
}

/// What a unit has to tell.
#[derive(Debug, Clone)]
pub(crate) enum Notice {
    /// The first tick of a revision was corrected.
    InForce(InForce),
    /// A pre-launch calibration has ended.
    PreLaunch(PreLaunchEnd),
    /// Another instance, whose place this one has taken, gave the unit a calibration: its journal's entry.
    Followed(Box<JournalEntry>),
    /// This instance speaks for the unit from here on.
    Speaks,
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

/// Asks the swap manager; never waits, except where it says so.
#[derive(Debug, Clone)]
pub(crate) struct Inbox(Arc<Queue>);

impl Inbox {
    pub(super) fn new(queue: Arc<Queue>) -> Self {
        Self(queue)
    }

    /// Hands a query on `imu/*/calibration` over.
    pub(crate) fn calibration(&self, query: Query, origin: Origin) {
        let (unit, bytes) = (unit_of(&query, key::parse_calibration), length(&query));
        self.ask(unit, Request::Calibration(query, origin), bytes);
    }

    /// Hands a put on `imu/*/calibration` over.
    pub(crate) fn put(&self, sample: Sample) {
        let serial = key::parse_calibration(key::asker(sample.key_expr().as_str()).0);
        let unit = serial.and_then(|serial| UnitId::new(serial).ok());
        let bytes = sample.payload().len();
        self.ask(unit, Request::Put(sample), bytes);
    }

    /// Hands a query on `imu/*/command` over.
    pub(crate) fn command(&self, query: Query, origin: Origin) {
        let (unit, bytes) = (unit_of(&query, key::parse_command), length(&query));
        self.ask(unit, Request::Command(query, origin), bytes);
    }

    /// Hands a query on `imu/*/history` over.
    pub(crate) fn history(&self, query: Query) {
        let (unit, bytes) = (unit_of(&query, key::parse_history), length(&query));
        self.ask(unit, Request::History(query), bytes);
    }

    /// Hands a query on `isotherm/*/kept/*` over.
    pub(crate) fn kept(&self, query: Query) {
        let bytes = length(&query);
        self.ask(None, Request::Kept(query), bytes);
    }

    /// Asks which documents are lacking here; where there is no room, no answer comes.
    pub(crate) fn lacks(&self, carried: Carried, answer: oneshot::Sender<Vec<Digest>>) {
        let _ = self.0.tell(Request::Lacks(carried, answer));
    }

    /// Hands over what another instance has written down; where there is no room, it comes again with the next.
    pub(crate) fn carry(&self, carried: Carried) {
        let _ = self.0.tell(Request::Carry(carried));
    }

    /// Hands an event of the folder over; waits for its turn, on the watcher's own thread.
    pub(crate) fn folder(&self, event: FolderEvent) {
        self.0.tell_in_turn(Request::Folder(event));
    }

    /// Has every document of the folder that is not taken judged again.
    pub(crate) fn judge_again(&self) {
        // Where there is no room the documents are judged with what is there.
        let _ = self.0.tell(Request::JudgeAgain);
    }

    /// Hands a unit's notice over; gives it back where too much is waiting.
    pub(crate) fn notice(&self, unit: &UnitId, notice: Notice) -> Result<(), Notice> {
        let Err(not_taken) = self.0.tell(Request::Notice(unit.clone(), notice)) else { return Ok(()) };
        match *not_taken {
            (Request::Notice(_, notice), Refused::Full) => Err(notice),
            // Where the swap manager has ended nobody wants it.
            _ => Ok(()),
        }
    }

    /// Hands a request over, or tells its asker why it is not taken.
    fn ask(&self, unit: Option<UnitId>, request: Request, bytes: usize) {
        let shown = unit.as_ref().map(ToString::to_string).unwrap_or_default();
        let Err(not_taken) = self.0.push(unit, request, bytes) else { return };
        let (request, why) = *not_taken;
        let why = match why {
            Refused::Full => "too many requests are waiting, for this unit or for all",
            Refused::Ended => "the service is ending",
        };
        tracing::warn!(unit = shown, "a swap, command or query is refused: {why}");
        if let Request::Calibration(query, _)
        | Request::Command(query, _)
        | Request::History(query)
        | Request::Kept(query) = request
        {
            let words = format!("refused: {why}; nothing has changed, try again");
            // The asker may have gone.
            let _ = query.reply_err(words).wait();
        }
    }
}

/// The unit that a query names.
fn unit_of(query: &Query, parse: fn(&str) -> Option<&str>) -> Option<UnitId> {
    parse(key::asker(query.key_expr().as_str()).0).and_then(|serial| UnitId::new(serial).ok())
}

fn length(query: &Query) -> usize {
    query.payload().map_or(0, zenoh::bytes::ZBytes::len)
}
