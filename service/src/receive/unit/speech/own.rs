//! What was ordered here a moment ago: it holds, though the other instance's memory, which is gone on from, was taken before.

use std::time::{Duration, Instant};

use isotherm_protocol::journal::JournalEvent;

use super::UnitActor;
use super::heard::is_of;

/// For how long: a memory that is older is not gone on from.
const A_MOMENT: Duration = Duration::from_secs(3);
/// Most orders.
const MOST: usize = 8;

impl UnitActor {
    /// Notes what was ordered here.
    pub(in crate::receive::unit) fn note_own(&mut self, event: JournalEvent) {
        if !matches!(event, JournalEvent::Commanded { accepted: false, .. }) {
            let own = &mut self.speech.own;
            own.drain(..own.len().saturating_sub(MOST - 1));
            own.push((Instant::now(), event));
        }
    }

    /// Gives up what is older.
    pub(super) fn give_up_own(&mut self, now: Instant) {
        self.speech.own.retain(|(at, _)| now.saturating_duration_since(*at) < A_MOMENT);
    }

    /// Another instance was given a command since.
    pub(super) fn is_commanded_elsewhere(&mut self) {
        self.speech.own.retain(|(_, event)| !matches!(event, JournalEvent::Commanded { .. }));
    }

    /// Another stream has taken the place of the one that was given the orders: what it lacks is done once more and told once more, so
    /// that the instance that speaks does it too.
    pub(super) fn do_own_again(&mut self) {
        let own: Vec<_> = self.speech.own.iter().map(|(_, event)| event.clone()).collect();
        for event in own {
            let lacks = match &event {
                JournalEvent::Changed { revision, .. } => {
                    let given = self.stream.given(|_| None).find(|given| is_number(given, revision.counter));
                    let other = given.is_some_and(|given| !is_of(&given, *revision));
                    other || revision.counter >= self.stream.next_counter()
                }
                JournalEvent::Commanded { words, .. } => self.stream.unit().state().to_string() != *words,
                _ => false,
            };
            if !lacks {
                continue;
            }
            let (unit, name) = (self.stream.id().clone(), event.name());
            match self.stream.carry_out(&event) {
                Ok(()) => {
                    tracing::warn!(%unit, "an order that was taken here ({name}) was not known to the publishing instance: \
                        it holds all the same");
                    self.write_entry(|_| event);
                }
                Err(error) => {
                    tracing::error!(%unit, "an order that was taken here ({name}) does not hold, another instance published \
                        without it: give it again: {error}");
                }
            }
        }
    }
}

fn is_number(event: &JournalEvent, counter: u64) -> bool {
    matches!(event, JournalEvent::Changed { revision, .. } if revision.counter == counter)
}
