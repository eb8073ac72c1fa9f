//! How the swap manager is asked, and what waits for it: a lane for each unit, served in turn, so that nobody waits for somebody
//! else's flood.
//!
//! A broken document of a megabyte takes milliseconds to refuse, and whoever sends a thousand of them for one unit makes that
//! unit wait, not the others. Units that the service does not know share one lane: anybody can invent a serial. Each lane has a
//! budget of requests and bytes, all of them together have one; what is beyond it is refused at once, so that a flood holds no memory.
//!
//! A lane for each client is not possible: Zenoh says who sent something only where the sender wants it to be known
//! (`source_info`).

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::Bound;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

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
use super::request::one_unit;
use crate::control::watch::FolderEvent;

/// What the swap manager is asked for, or told.
#[derive(Debug)]
pub(crate) enum Message {
    /// A query.
    Query(Asked, Query, Origin),
    /// A put on `imu/*/calibration`: a swap.
    Put(Sample),
    /// A file of the folder has changed.
    Folder(FolderEvent),
    /// Judge the documents of the folder again that are not taken.
    JudgeAgain,
    /// A unit has something to tell.
    Notice(UnitId, Notice),
    /// What another instance has written down; what of it is lacking here.
    Lacks(Carried, oneshot::Sender<Vec<Digest>>),
    /// What another instance has written down.
    Carry(Carried, oneshot::Sender<()>),
}

/// What a query asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Asked {
    /// On `imu/*/calibration`: a swap, or the active document.
    Calibration,
    /// On `imu/*/command`.
    Command,
    /// On `imu/*/history`.
    History,
    /// On `isotherm/*/kept/*`.
    Kept,
}

impl Asked {
    /// The serial in a key without the name of who asks.
    pub(super) fn serial(self, key: &str) -> Option<&str> {
        match self {
            Self::Calibration => key::parse_calibration(key),
            Self::Command => key::parse_command(key),
            Self::History => key::parse_history(key),
            Self::Kept => None,
        }
    }
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
    /// Another instance, whose place this one has taken, gave the unit a calibration or a command: its journal's entry.
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

/// What waits for the swap manager, started or not. Whoever asks never waits, except where it says so.
#[derive(Debug, Clone, Default)]
pub(crate) struct Inbox(Arc<Queue>);

#[derive(Debug, Default)]
struct Queue {
    state: Mutex<State>,
    changed: Condvar,
}

impl Inbox {
    /// Hands a query over.
    pub(crate) fn ask(&self, asked: Asked, query: Query, origin: Origin) {
        let unit = one_unit(query.key_expr().as_str(), asked).ok();
        let bytes = query.payload().map_or(0, zenoh::bytes::ZBytes::len);
        self.hand_over(unit, Message::Query(asked, query, origin), bytes);
    }

    /// Hands a put on `imu/*/calibration` over.
    pub(crate) fn put(&self, sample: Sample) {
        let unit = one_unit(sample.key_expr().as_str(), Asked::Calibration).ok();
        let bytes = sample.payload().len();
        self.hand_over(unit, Message::Put(sample), bytes);
    }

    /// Hands a unit's notice over; gives it back where too much is waiting.
    pub(crate) fn notice(&self, unit: &UnitId, notice: Notice) -> Result<(), Notice> {
        let Err(not_taken) = self.tell(Message::Notice(unit.clone(), notice)) else { return Ok(()) };
        match *not_taken {
            (Message::Notice(_, notice), Refused::Full) => Err(notice),
            // Where the swap manager has ended nobody wants it.
            _ => Ok(()),
        }
    }

    /// Hands a request over, or tells its asker why it is not taken.
    fn hand_over(&self, unit: Option<UnitId>, message: Message, bytes: usize) {
        let shown = unit.as_ref().map(ToString::to_string).unwrap_or_default();
        let lane = unit.map_or(Lane::Several, Lane::Unit);
        let Err(not_taken) = self.push(lane, message, bytes) else { return };
        let (message, why) = *not_taken;
        let why = match why {
            Refused::Full => "too many requests are waiting, for this unit or for all",
            Refused::Ended => "the service is ending",
        };
        tracing::warn!(unit = shown, "a swap, command or query is refused: {why}");
        if let Message::Query(_, query, _) = message {
            let words = format!("refused: {why}; nothing has changed, try again");
            // The asker may have gone.
            let _ = query.reply_err(words).wait();
        }
    }

    /// Has these units have a lane of their own; the others share one.
    pub(super) fn know<'u>(&self, units: impl Iterator<Item = &'u UnitId> + Clone) {
        let mut state = self.lock();
        // Mostly nothing has changed.
        if !state.known.iter().eq(units.clone()) {
            state.known = units.cloned().collect();
        }
    }

    /// Takes what the service itself has to tell; gives it back where there is no room.
    pub(crate) fn tell(&self, message: Message) -> Result<(), NotTaken> {
        self.push(Lane::Own, message, 0)
    }

    /// Takes a request of `bytes` bytes into a lane; gives it back with the reason where it is not taken.
    fn push(&self, lane: Lane, message: Message, bytes: usize) -> Result<(), NotTaken> {
        let mut state = self.lock();
        let lane = match lane {
            Lane::Unit(unit) if !state.known.contains(&unit) => Lane::Strangers,
            lane => lane,
        };
        if state.ended || (state.stopping && lane != Lane::Own) {
            return Err(Box::new((message, Refused::Ended)));
        }
        if !state.has_room(&lane, bytes) {
            return Err(Box::new((message, Refused::Full)));
        }
        state.push(lane, message, bytes);
        self.0.changed.notify_all();
        Ok(())
    }

    /// As [`Self::tell`], and waits for room; given up where nobody works any more.
    pub(crate) fn tell_in_turn(&self, message: Message) {
        let full = |state: &mut State| !state.ended && !state.has_room(&Lane::Own, 0);
        let waited = self.0.changed.wait_while(self.lock(), full);
        let mut state = waited.unwrap_or_else(PoisonError::into_inner);
        if !state.ended {
            state.push(Lane::Own, message, 0);
            self.0.changed.notify_all();
        }
    }

    /// The next request, of the lane whose turn it is; waits for one, and gives `None` where nothing was asked for.
    pub(super) fn take(&self, limit: Duration) -> Result<Option<Message>, Stopped> {
        let empty = |state: &mut State| state.lanes.is_empty() && !state.stopping;
        let waited = self.0.changed.wait_timeout_while(self.lock(), limit, empty);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        match state.pop() {
            Some(message) => {
                self.0.changed.notify_all();
                Ok(Some(message))
            }
            None if state.stopping => Err(Stopped),
            None => Ok(None),
        }
    }

    /// Has what waits finished, and nothing more taken.
    pub(super) fn stop(&self) {
        self.lock().stopping = true;
        self.0.changed.notify_all();
    }

    /// Nobody works any more.
    pub(super) fn end(&self) {
        let mut state = self.lock();
        state.ended = true;
        state.lanes.clear();
        self.0.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Most requests of a lane.
pub(super) const MAX_LANE: usize = 64;
/// Most bytes of a lane. One request may have more.
const MAX_LANE_BYTES: usize = 8 << 20;
/// Most bytes of all lanes.
const MAX_BYTES: usize = 64 << 20;

/// Whose requests wait.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Lane {
    /// What the service itself has to tell: files of the folder, notices of units.
    Own,
    /// Questions about several units.
    Several,
    /// Units that the service does not know.
    Strangers,
    /// A unit that it knows.
    Unit(UnitId),
}

/// Why a request was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Refused {
    /// Too much waits in its lane, or in all of them.
    Full,
    /// Nobody works any more.
    Ended,
}

/// Nothing waits any more, and nothing is to come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stopped;

/// A request that is not taken, and why.
pub(crate) type NotTaken = Box<(Message, Refused)>;

/// The lanes.
#[derive(Debug, Default)]
struct State {
    /// None of them empty.
    lanes: BTreeMap<Lane, VecDeque<(Message, usize)>>,
    bytes: usize,
    /// The lane that was served last.
    served: Option<Lane>,
    known: BTreeSet<UnitId>,
    stopping: bool,
    ended: bool,
}

impl State {
    /// Whether a lane has room for so many bytes more. An empty one has in any case, unless all of them together have not.
    fn has_room(&self, lane: &Lane, bytes: usize) -> bool {
        let Some(waiting) = self.lanes.get(lane) else { return self.bytes <= MAX_BYTES };
        let lane_bytes: usize = waiting.iter().map(|(_, bytes)| bytes).sum();
        waiting.len() < MAX_LANE && lane_bytes + bytes <= MAX_LANE_BYTES && self.bytes + bytes <= MAX_BYTES
    }

    fn push(&mut self, lane: Lane, message: Message, bytes: usize) {
        self.bytes += bytes;
        self.lanes.entry(lane).or_default().push_back((message, bytes));
    }

    fn pop(&mut self) -> Option<Message> {
        let after = self.served.clone().map_or(Bound::Unbounded, Bound::Excluded);
        let mut later = self.lanes.range((after, Bound::Unbounded));
        let lane = later.next().or_else(|| self.lanes.iter().next()).map(|(lane, _)| lane.clone())?;
        let waiting = self.lanes.get_mut(&lane)?;
        let (message, bytes) = waiting.pop_front()?;
        if waiting.is_empty() {
            self.lanes.remove(&lane);
        }
        self.bytes -= bytes;
        self.served = Some(lane);
        Some(message)
    }
}

#[cfg(test)]
mod tests;
