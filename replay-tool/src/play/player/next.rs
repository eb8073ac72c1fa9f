//! What goes out next.

use std::cmp::{Ordering, Reverse};
use std::sync::Arc;

use isotherm_log::faults::Departure;

use super::Player;
use crate::error::Error;
use crate::play::Watch;
use crate::play::playlist::Frame;

/// Messages that are passed over before others get their turn.
const STRIDE: u32 = 256;

/// A message that is to go out.
pub(super) struct Waiting {
    pub(super) at_ns: i64,
    pub(super) order: u64,
    pub(super) place: usize,
    pub(super) departure: Departure<Arc<Frame>>,
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for Waiting {}
impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        (self.at_ns, self.order).cmp(&(other.at_ns, other.order))
    }
}

impl<W: Watch> Player<'_, W> {
    /// The next message to go out; `None` at the end of the log.
    pub(super) async fn next_due(&mut self) -> Result<Option<Waiting>, Error> {
        let mut passed_over = 0;
        loop {
            let ready = |first: &Reverse<Waiting>| self.read_all || first.0.at_ns <= self.read_to;
            if self.waiting.peek().is_some_and(ready) {
                return Ok(self.waiting.pop().map(|Reverse(next)| next));
            }
            if self.read_all {
                return Ok(None);
            }
            if let Some(cue) = self.playlist.next()? {
                if self.from.is_some_and(|from| cue.at_ns < from) {
                    passed_over += 1;
                    if passed_over % STRIDE == 0 {
                        tokio::task::yield_now().await;
                    }
                    continue;
                }
                self.from = None;
                self.read_to = self.read_to.max(cue.at_ns);
                for place in self.units.places(&cue.unit)? {
                    if let Some(unit) = self.units.get_mut(place) {
                        unit.pass(&cue, &mut self.out);
                    }
                    self.wait(place);
                }
            } else {
                self.read_all = true;
                for place in 0..self.units.len() {
                    if let Some(unit) = self.units.get_mut(place) {
                        unit.flush(&mut self.out);
                    }
                    self.wait(place);
                }
            }
        }
    }

    /// Puts what goes out of a unit among what waits.
    fn wait(&mut self, place: usize) {
        for departure in self.out.drain(..) {
            let (at_ns, order) = (departure.at_ns, self.order);
            self.order += 1;
            self.waiting.push(Reverse(Waiting { at_ns, order, place, departure }));
        }
    }
}
