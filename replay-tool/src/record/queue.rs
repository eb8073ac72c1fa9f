//! What was received and is not written yet.

use std::collections::{HashMap, VecDeque};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use isotherm_log::message::Topic;
use isotherm_log::recording::Attachment;
use serde::Serialize;

/// Most topics of one recording: the format has 16 bits for them, and a flood of invented keys must not fill the memory.
const MOST_TOPICS: usize = 16_384;
/// What an entry takes beside its bytes.
const ENTRY_BYTES: u64 = 64;
/// Entries that the writer takes at once.
const BATCH: usize = 512;

/// What is to be written.
#[derive(Debug)]
pub(super) enum Item {
    /// A message that came in.
    Message {
        /// Number of its topic.
        topic: usize,
        /// When (ns since 1970-01-01 UTC).
        received_ns: u64,
        /// The frame.
        frame: Vec<u8>,
    },
    /// The parts of one answer on a journal's key, to be written one behind the other.
    Memory {
        /// Number of the topic.
        topic: usize,
        /// When the last of them came.
        received_ns: u64,
        /// The parts' frames.
        frames: Vec<Vec<u8>>,
    },
    /// A file.
    Attachment(Attachment),
}

impl Item {
    /// What it takes in memory (bytes).
    fn bytes(&self) -> u64 {
        let length = match self {
            Self::Message { frame, .. } => frame.len(),
            Self::Memory { frames, .. } => frames.iter().map(Vec::len).sum(),
            Self::Attachment(attachment) => attachment.bytes.len(),
        };
        length as u64 + ENTRY_BYTES
    }
}

/// Messages of one topic.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub(crate) struct TopicCount {
    /// The key, without namespace.
    pub(crate) topic: String,
    /// Messages that came in.
    pub(crate) received: u64,
    /// Of these, in a file.
    pub(crate) written: u64,
    /// Of these, not in a file: the queue was full, or writing failed.
    pub(crate) lost: u64,
    /// Their bytes that came in.
    pub(crate) bytes: u64,
}

/// The queue between the receive threads, which never wait for it, and the thread that writes.
#[derive(Debug)]
pub(super) struct Queue {
    state: Mutex<State>,
    filled: Condvar,
    limit: u64,
}

#[derive(Debug, Default)]
struct State {
    items: VecDeque<Item>,
    /// Bytes that are not written yet.
    bytes: u64,
    places: HashMap<String, usize>,
    counts: Vec<TopicCount>,
    /// Messages of topics beyond the most.
    nameless: u64,
    /// Length of all files so far (bytes).
    file_bytes: u64,
    closed: bool,
    /// Nothing can be written any more.
    failed: bool,
}

/// What the writer has taken.
#[derive(Debug)]
pub(super) struct Taken {
    pub(super) items: VecDeque<Item>,
    /// What they take; to be given back with [`Queue::done`].
    pub(super) bytes: u64,
    /// Nothing more comes.
    pub(super) over: bool,
}

impl Queue {
    /// An empty one that may take so many bytes.
    pub(super) fn new(limit: u64) -> Self {
        Self { state: Mutex::default(), filled: Condvar::new(), limit }
    }

    /// Takes a message in, or counts it as lost; never waits.
    pub(super) fn message(&self, key: &str, frame: impl FnOnce() -> Vec<u8>, length: usize) {
        let limit = self.limit.checked_sub(length as u64 + ENTRY_BYTES);
        let item = |topic, received_ns| Item::Message { topic, received_ns, frame: frame() };
        self.enter(key, (1, length), limit, item);
    }

    /// Takes in the parts of an answer, of which there is always room.
    pub(super) fn memory(&self, key: &str, frames: Vec<Vec<u8>>) {
        let size = (frames.len() as u64, frames.iter().map(Vec::len).sum());
        self.enter(key, size, Some(u64::MAX), |topic, received_ns| Item::Memory {
            topic,
            received_ns,
            frames,
        });
    }

    /// Takes in so many messages of so many bytes, or counts them as lost where more bytes than `limit` wait already, or it is none.
    fn enter(
        &self,
        key: &str,
        (messages, length): (u64, usize),
        limit: Option<u64>,
        item: impl FnOnce(usize, u64) -> Item,
    ) {
        let mut state = self.lock();
        if state.closed {
            return;
        }
        let is_lost = state.failed || limit.is_none_or(|limit| state.bytes > limit);
        let topic = state.place(key);
        let Some((topic, count)) = topic.and_then(|topic| Some((topic, state.counts.get_mut(topic)?))) else {
            state.nameless += messages;
            return;
        };
        count.received += messages;
        count.bytes += length as u64;
        if is_lost {
            count.lost += messages;
            return;
        }
        // By the clock under the lock: messages stand in the file in the order of their times.
        self.push(&mut state, item(topic, now_ns()));
    }

    /// Takes in a file.
    pub(super) fn attachment(&self, attachment: Attachment) {
        let mut state = self.lock();
        if !state.failed && !state.closed {
            self.push(&mut state, Item::Attachment(attachment));
        }
    }

    fn push(&self, state: &mut State, item: Item) {
        state.bytes += item.bytes();
        let was_empty = state.items.is_empty();
        state.items.push_back(item);
        if was_empty {
            // The writer looks again before it waits: one call for a batch is enough.
            self.filled.notify_one();
        }
    }

    /// What waits, a batch of it; waits for something at most so long.
    pub(super) fn take(&self, limit: Duration) -> Taken {
        let state = self.lock();
        let waited =
            self.filled.wait_timeout_while(state, limit, |state| state.items.is_empty() && !state.closed);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let count = state.items.len().min(BATCH);
        let items: VecDeque<_> = state.items.drain(..count).collect();
        let bytes = items.iter().map(Item::bytes).sum();
        Taken { bytes, over: state.closed && state.items.is_empty(), items }
    }

    /// So many bytes of what was taken take no memory any more.
    pub(super) fn done(&self, bytes: u64) {
        let mut state = self.lock();
        state.bytes = state.bytes.saturating_sub(bytes);
    }

    /// So many messages of each topic are in a file, and all files are so long.
    pub(super) fn written(&self, counts: &mut [u64], file_bytes: u64) {
        let mut state = self.lock();
        for (topic, count) in state.counts.iter_mut().zip(counts) {
            topic.written += std::mem::take(count);
        }
        state.file_bytes = file_bytes;
    }

    /// Topics from this number on.
    pub(super) fn topics(&self, from: usize) -> Vec<Topic> {
        self.lock().counts.iter().skip(from).map(|count| Topic::of(&count.topic)).collect()
    }

    /// Nothing more is taken in.
    pub(super) fn close(&self) {
        self.lock().closed = true;
        self.filled.notify_one();
    }

    /// Nothing can be written any more: what waits is lost, and what comes is.
    pub(super) fn fail(&self) {
        let mut state = self.lock();
        state.failed = true;
        state.items.clear();
        state.bytes = 0;
        for count in &mut state.counts {
            count.lost = count.received.saturating_sub(count.written);
        }
    }

    /// The counts by topic in the order of their keys, messages of topics beyond the most, length of all files.
    pub(super) fn counts(&self) -> (Vec<TopicCount>, u64, u64) {
        let state = self.lock();
        let mut counts = state.counts.clone();
        counts.sort_by(|a, b| a.topic.cmp(&b.topic));
        (counts, state.nameless, state.file_bytes)
    }

    /// Messages lost of each topic, by number.
    pub(super) fn lost(&self) -> Vec<u64> {
        self.lock().counts.iter().map(|count| count.lost).collect()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Number of a key's topic; `None` where there are too many.
    fn place(&mut self, key: &str) -> Option<usize> {
        if let Some(place) = self.places.get(key) {
            return Some(*place);
        }
        let place = self.counts.len();
        if place >= MOST_TOPICS {
            return None;
        }
        self.places.insert(key.to_owned(), place);
        self.counts.push(TopicCount { topic: key.to_owned(), ..TopicCount::default() });
        Some(place)
    }
}

/// The time now (ns since 1970-01-01 UTC).
pub(super) fn now_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beyond_the_limit_messages_are_counted_as_lost() {
        let queue = Queue::new(10 * (100 + ENTRY_BYTES));
        for _ in 0..25 {
            queue.message("a", || vec![0; 100], 100);
        }
        queue.message("b", || vec![0; 100], 100);
        let counts = |queue: &Queue| {
            let (counts, ..) = queue.counts();
            counts.iter().map(|count| (count.received, count.written, count.lost)).collect::<Vec<_>>()
        };
        assert_eq!(counts(&queue), [(25, 0, 15), (1, 0, 1)]);
        let taken = queue.take(Duration::ZERO);
        assert_eq!((taken.items.len(), taken.over), (10, false));
        // Taken is not written: there is no room before it is.
        queue.message("b", || vec![0; 100], 100);
        queue.done(taken.bytes);
        queue.message("b", || vec![0; 100], 100);
        queue.written(&mut [10], 5);
        assert_eq!(counts(&queue), [(25, 10, 15), (3, 0, 2)]);
        queue.fail();
        queue.message("b", || vec![0; 100], 100);
        assert_eq!(counts(&queue), [(25, 10, 15), (4, 0, 4)]);
        queue.close();
        assert!(queue.take(Duration::from_secs(1)).over);
    }

    #[test]
    fn a_flood_of_keys_fills_no_memory() {
        let queue = Queue::new(u64::MAX);
        for key in 0..MOST_TOPICS + 10 {
            queue.message(&key.to_string(), Vec::new, 0);
        }
        let (counts, nameless, _) = queue.counts();
        assert_eq!((counts.len(), nameless), (MOST_TOPICS, 10));
    }
}
