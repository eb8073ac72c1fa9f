//! Requests that wait for the swap manager: a lane for each unit, served in turn, so that nobody waits for somebody else's flood.
//!
//! A broken document of a megabyte takes milliseconds to refuse, and whoever sends a thousand of them for one unit makes that
//! unit wait, not the others. Units that the service does not know share one lane: anybody can invent a serial. Each lane has a
//! budget of requests and bytes, all of them together have one; what is beyond it is refused at once, so that a flood holds no memory.
//!
//! A lane for each client is not possible: Zenoh says who sent something only where the sender wants it to be known
//! (`source_info`).

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::Bound;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use isotherm_protocol::key::UnitId;

use super::inbox::Request;

/// Most requests of a lane.
pub(super) const MAX_LANE: usize = 64;
/// Most bytes of a lane. One request may have more.
const MAX_LANE_BYTES: usize = 8 << 20;
/// Most bytes of all lanes.
const MAX_BYTES: usize = 64 << 20;

/// Whose requests wait.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Lane {
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
pub(super) enum Refused {
    /// Too much waits in its lane, or in all of them.
    Full,
    /// Nobody works any more.
    Ended,
}

/// Nothing waits any more, and nothing is to come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stopped;

/// A request that is not taken, and why.
type NotTaken = Box<(Request, Refused)>;

/// The lanes.
#[derive(Debug, Default)]
pub(super) struct Queue {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    /// None of them empty.
    lanes: BTreeMap<Lane, VecDeque<(Request, usize)>>,
    bytes: usize,
    /// The lane that was served last.
    served: Option<Lane>,
    known: BTreeSet<UnitId>,
    stopping: bool,
    ended: bool,
}

impl Queue {
    /// Has these units have a lane of their own; the others share one.
    pub(super) fn know<'u>(&self, units: impl Iterator<Item = &'u UnitId> + Clone) {
        let mut state = self.lock();
        // Mostly nothing has changed.
        if !state.known.iter().eq(units.clone()) {
            state.known = units.cloned().collect();
        }
    }

    /// Takes a request of `bytes` bytes for a unit, or for several; gives it back with the reason where it is not taken.
    pub(super) fn push(&self, unit: Option<UnitId>, request: Request, bytes: usize) -> Result<(), NotTaken> {
        let mut state = self.lock();
        let lane = match unit {
            Some(unit) if state.known.contains(&unit) => Lane::Unit(unit),
            Some(_) => Lane::Strangers,
            None => Lane::Several,
        };
        let closed = state.stopping || state.ended;
        self.enter(&mut state, closed, lane, request, bytes)
    }

    /// Takes what the service itself has to tell; gives it back where there is no room.
    pub(super) fn tell(&self, request: Request) -> Result<(), NotTaken> {
        let mut state = self.lock();
        let closed = state.ended;
        self.enter(&mut state, closed, Lane::Own, request, 0)
    }

    fn enter(
        &self,
        state: &mut State,
        closed: bool,
        lane: Lane,
        request: Request,
        bytes: usize,
    ) -> Result<(), NotTaken> {
        if closed {
            return Err(Box::new((request, Refused::Ended)));
        }
        if !state.has_room(&lane, bytes) {
            return Err(Box::new((request, Refused::Full)));
        }
        state.push(lane, request, bytes);
        self.changed.notify_all();
        Ok(())
    }

    /// As [`Self::tell`], and waits for room; given up where nobody works any more.
    pub(super) fn tell_in_turn(&self, request: Request) {
        let full = |state: &mut State| !state.ended && !state.has_room(&Lane::Own, 0);
        let waited = self.changed.wait_while(self.lock(), full);
        let mut state = waited.unwrap_or_else(PoisonError::into_inner);
        if !state.ended {
            state.push(Lane::Own, request, 0);
            self.changed.notify_all();
        }
    }

    /// The next request, of the lane whose turn it is; waits for one, and gives `None` where nothing was asked for.
    pub(super) fn take(&self, limit: Duration) -> Result<Option<Request>, Stopped> {
        let empty = |state: &mut State| state.lanes.is_empty() && !state.stopping;
        let waited = self.changed.wait_timeout_while(self.lock(), limit, empty);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        match state.pop() {
            Some(request) => {
                self.changed.notify_all();
                Ok(Some(request))
            }
            None if state.stopping => Err(Stopped),
            None => Ok(None),
        }
    }

    /// Has what waits finished, and nothing more taken.
    pub(super) fn stop(&self) {
        self.lock().stopping = true;
        self.changed.notify_all();
    }

    /// Nobody works any more.
    pub(super) fn end(&self) {
        let mut state = self.lock();
        state.ended = true;
        state.lanes.clear();
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Whether a lane has room for so many bytes more. An empty one has in any case, unless all of them together have not.
    fn has_room(&self, lane: &Lane, bytes: usize) -> bool {
        let Some(waiting) = self.lanes.get(lane) else { return self.bytes <= MAX_BYTES };
        let lane_bytes: usize = waiting.iter().map(|(_, bytes)| bytes).sum();
        waiting.len() < MAX_LANE && lane_bytes + bytes <= MAX_LANE_BYTES && self.bytes + bytes <= MAX_BYTES
    }

    fn push(&mut self, lane: Lane, request: Request, bytes: usize) {
        self.bytes += bytes;
        self.lanes.entry(lane).or_default().push_back((request, bytes));
    }

    fn pop(&mut self) -> Option<Request> {
        let after = self.served.clone().map_or(Bound::Unbounded, Bound::Excluded);
        let mut later = self.lanes.range((after, Bound::Unbounded));
        let lane = later.next().or_else(|| self.lanes.iter().next()).map(|(lane, _)| lane.clone())?;
        let waiting = self.lanes.get_mut(&lane)?;
        let (request, bytes) = waiting.pop_front()?;
        if waiting.is_empty() {
            self.lanes.remove(&lane);
        }
        self.bytes -= bytes;
        self.served = Some(lane);
        Some(request)
    }
}

#[cfg(test)]
mod tests {
    use super::super::inbox::Notice;
    use super::*;
    use isotherm_protocol::corrected::Revision;
    use isotherm_protocol::stream::InForce;

    fn unit(serial: &str) -> UnitId {
        UnitId::new(serial).unwrap()
    }

    /// A request that is known by its unit.
    fn request(serial: &str) -> Request {
        let revision = Revision::default();
        let first = InForce { revision, series: 0, sequence: 0, end_time_ns: 0 };
        Request::Notice(unit(serial), Notice::InForce(first))
    }

    /// Whose requests come out, in their order.
    fn served(queue: &Queue) -> Vec<String> {
        let mut order = Vec::new();
        while let Ok(Some(Request::Notice(unit, _))) = queue.take(Duration::ZERO) {
            order.push(unit.to_string());
        }
        order
    }

    #[test]
    fn a_flood_for_one_unit_or_for_invented_ones_makes_no_other_wait() {
        let queue = Queue::default();
        queue.know([unit("A"), unit("B")].iter());
        let mut refused = 0;
        for n in 0..1500 {
            refused += usize::from(queue.push(Some(unit("A")), request("A"), 1 << 20).is_err());
            let invented = format!("X{n}");
            refused += usize::from(queue.push(Some(unit(&invented)), request(&invented), 1 << 20).is_err());
        }
        assert_eq!(refused, 3000 - 16, "eight megabytes of each lane");
        queue.push(Some(unit("B")), request("B"), 1 << 20).unwrap();
        queue.push(None, request("all"), 10).unwrap();
        queue.tell(request("own")).unwrap();
        let order = served(&queue);
        assert_eq!(order.len(), 19);
        for serial in ["A", "B", "all", "own"] {
            assert!(order[..5].contains(&serial.to_owned()), "{serial} in {order:?}");
        }
        assert_eq!(order[5..].iter().filter(|serial| *serial == "A").count(), 7, "in turn with the others");
    }

    #[test]
    fn what_waits_is_finished_and_nothing_more_is_taken() {
        let queue = Queue::default();
        queue.push(Some(unit("A")), request("A"), 0).unwrap();
        queue.stop();
        assert_eq!(queue.push(Some(unit("A")), request("A"), 0).unwrap_err().1, Refused::Ended);
        queue.tell(request("own")).unwrap();
        assert_eq!(served(&queue), ["own", "A"]);
        assert_eq!(queue.take(Duration::ZERO).unwrap_err(), Stopped);
        queue.end();
        queue.tell_in_turn(request("own"));
        assert!(queue.tell(request("own")).is_err());
    }
}
