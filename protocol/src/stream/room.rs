//! Room to work in, one for each thread: a message is dealt with by one thread from its first byte to its last corrected
//! tick, so that units need none of their own. What waits from one message to the next waits in the unit.

use std::cell::RefCell;
use std::collections::VecDeque;

use isotherm_correction::operation::HealthReading;
use isotherm_correction::sample::{AccelTick, CorrectedTick, GyroTick, TemperatureReading};

/// Most ready ticks for which room is kept.
const MOST_READY: usize = 256;

/// What a message is read into, and queues.
#[derive(Debug, Default)]
pub(super) struct Room {
    pub(super) gyro_ticks: Vec<GyroTick>,
    pub(super) accel_ticks: Vec<AccelTick>,
    pub(super) readings: Vec<TemperatureReading>,
    pub(super) health: Vec<HealthReading>,
    pub(super) queues: Queues,
}

/// Queues that no unit needs at present.
#[derive(Debug, Default)]
pub(super) struct Queues {
    ready: VecDeque<CorrectedTick>,
}

thread_local! {
    static ROOM: RefCell<Room> = RefCell::default();
}

/// Does something in the room of this thread; in a new one where that is being used.
pub(super) fn with<T>(work: impl FnOnce(&mut Room) -> T) -> T {
    ROOM.with(|room| match room.try_borrow_mut() {
        Ok(mut room) => work(&mut room),
        Err(_) => work(&mut Room::default()),
    })
}

impl Queues {
    /// Lends a unit what it may need for an event.
    pub(super) fn lend(&mut self, ready: &mut VecDeque<CorrectedTick>) {
        if ready.capacity() == 0 {
            std::mem::swap(ready, &mut self.ready);
        }
    }

    /// Takes back what it does not need any more.
    pub(super) fn take_back(&mut self, ready: &mut VecDeque<CorrectedTick>) {
        self.take_ready(ready);
    }

    /// Takes the queue of ready ticks back, if it is empty.
    pub(super) fn take_ready(&mut self, ready: &mut VecDeque<CorrectedTick>) {
        if ready.is_empty() && ready.capacity() > 0 {
            let queue = std::mem::take(ready);
            if queue.capacity() <= MOST_READY {
                self.ready = queue;
            }
        }
    }
}
