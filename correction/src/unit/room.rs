//! Room for ticks that wait, shared by many units: in most of them nothing waits most of the time.

use alloc::collections::VecDeque;
use alloc::vec::Vec;

use super::{Unit, accel_intake, gyro_intake};

/// Most queues of a kind that are kept.
const MOST_QUEUES: usize = 16;
/// Longest queue that is kept, in ticks: what a burst has needed beyond it goes.
const LONGEST_QUEUE: usize = 256;

/// Queues that no unit needs at present. A unit without one makes its own, and keeps it unless it is asked to give it back.
#[derive(Debug, Default)]
pub struct Room {
    gyros: Vec<VecDeque<gyro_intake::Pending>>,
    accels: Vec<VecDeque<accel_intake::Pending>>,
}

impl Unit {
    /// Gives the unit queues to let ticks wait in, where it has none: call it before [`Unit::handle`].
    pub fn borrow_room(&mut self, room: &mut Room) {
        lend(&mut room.gyros, self.gyros.queue());
        lend(&mut room.accels, self.accels.queue());
    }

    /// Takes the queues back in which nothing waits: call it behind [`Unit::handle`].
    pub fn return_room(&mut self, room: &mut Room) {
        take_back(&mut room.gyros, self.gyros.queue());
        take_back(&mut room.accels, self.accels.queue());
    }
}

/// Lends a queue, if there is one.
fn lend<T>(from: &mut Vec<VecDeque<T>>, to: &mut VecDeque<T>) {
    if to.capacity() == 0
        && let Some(queue) = from.pop()
    {
        *to = queue;
    }
}

/// Takes a queue back, if it is empty.
fn take_back<T>(to: &mut Vec<VecDeque<T>>, from: &mut VecDeque<T>) {
    if from.is_empty() && from.capacity() > 0 {
        let queue = core::mem::take(from);
        if queue.capacity() <= LONGEST_QUEUE && to.len() < MOST_QUEUES {
            to.push(queue);
        }
    }
}
