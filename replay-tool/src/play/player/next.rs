//! What goes out next.

use super::{Leaving, Player, Turn};
use crate::error::Error;

/// Messages that are passed over before others get their turn.
const STRIDE: u32 = 256;

impl Player<'_> {
    /// The next message to go out; `None` at the end of the log.
    pub(super) async fn next_due(&mut self) -> Result<Option<(Turn, Leaving)>, Error> {
        let mut passed_over = 0;
        loop {
            let ready = |(&(at_ns, _), _): (&Turn, _)| self.read_all || at_ns <= self.read_to;
            if self.waiting.first_key_value().is_some_and(ready) {
                return Ok(self.waiting.pop_first());
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
                    if let Some(unit) = self.units.all.get_mut(place) {
                        unit.pass(&cue, &mut self.out);
                    }
                    self.wait(place);
                }
            } else {
                self.read_all = true;
                for place in 0..self.units.all.len() {
                    if let Some(unit) = self.units.all.get_mut(place) {
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
            self.waiting.insert((departure.at_ns, self.order), (place, departure));
            self.order += 1;
        }
    }
}
