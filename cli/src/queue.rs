//! Lines on their way to standard error: who logs never waits for who reads.
//!
//! A terminal that is stopped with Ctrl-S, or a pipe that nobody empties, takes no more bytes, and a write to it does not
//! return. Lines are therefore written by a thread of their own, out of a queue that is bounded in lines and bytes; what
//! comes while it is full is dropped and counted. Why not `tracing-appender`: `docs/adr/0026-log-lines-in-a-queue.md`.

use std::collections::VecDeque;
use std::io::Write;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Most lines that wait.
const MAX_LINES: usize = 4096;
/// Most bytes of lines that wait.
const MAX_BYTES: usize = 4 << 20;

/// Lines that wait to be written.
#[derive(Debug, Default)]
pub(crate) struct Queue {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    lines: VecDeque<Vec<u8>>,
    bytes: usize,
    /// A line has been taken from the queue and is not written yet.
    writing: bool,
    /// Lines written so far.
    written: u64,
    /// Lines dropped so far.
    dropped: u64,
}

impl State {
    fn is_drained(&self) -> bool {
        self.lines.is_empty() && !self.writing
    }
}

impl Queue {
    /// Takes a line, or drops it where too many wait. Never waits for a write.
    pub(crate) fn push(&self, line: Vec<u8>) {
        let mut state = self.lock();
        if state.lines.len() >= MAX_LINES || state.bytes + line.len() > MAX_BYTES {
            state.dropped += 1;
            return;
        }
        state.bytes += line.len();
        state.lines.push_back(line);
        self.changed.notify_all();
    }

    /// Lines dropped so far.
    pub(crate) fn dropped(&self) -> u64 {
        self.lock().dropped
    }

    /// Writes lines for as long as the process lives. Where lines were dropped, `report` is called with their number as soon as
    /// the sink has taken all that waited.
    pub(crate) fn write_to(&self, mut sink: impl Write, report: impl Fn(u64)) {
        let mut reported = 0;
        loop {
            let line = self.next();
            // A sink that is gone or full must not end the service: the line is lost, as it would have been before.
            let _ = sink.write_all(&line).and_then(|()| sink.flush());
            let mut state = self.lock();
            state.writing = false;
            state.written += 1;
            let untold = state.dropped - reported;
            let is_free = state.lines.is_empty();
            reported += if is_free { untold } else { 0 };
            drop(state);
            self.changed.notify_all();
            if is_free && untold > 0 {
                report(untold);
            }
        }
    }

    /// The next line; waits for one.
    fn next(&self) -> Vec<u8> {
        let mut state = self.lock();
        loop {
            if let Some(line) = state.lines.pop_front() {
                state.bytes -= line.len();
                state.writing = true;
                return line;
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Waits until everything is written, for as long as something is: at most `patience` without a line.
    pub(crate) fn drain(&self, patience: Duration) {
        let mut state = self.lock();
        while !state.is_drained() {
            let before = state.written;
            let unchanged = |state: &mut State| state.written == before && !state.is_drained();
            let waited = self.changed.wait_timeout_while(state, patience, unchanged);
            let (now, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
            if timeout.timed_out() {
                return;
            }
            state = now;
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::mpsc::{Receiver, Sender, channel};

    use super::*;

    const LIMIT: Duration = Duration::from_secs(30);

    /// A sink that takes a line when it is told to.
    struct Gate {
        open: Receiver<()>,
        taken: Sender<Vec<u8>>,
    }

    impl Write for Gate {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            // Closed for ever where the test has ended.
            let _ = self.open.recv();
            let _ = self.taken.send(bytes.to_vec());
            Ok(bytes.len())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_blocked_sink_costs_lines_that_are_counted_and_no_time() {
        let queue = Arc::new(Queue::default());
        let ((open, opened), (taken, took), (report, reported)) = (channel(), channel(), channel());
        let writer = Arc::clone(&queue);
        std::thread::spawn(move || {
            let sink = Gate { open: opened, taken };
            writer.write_to(sink, |count| report.send(count).unwrap());
        });
        queue.push(b"first".to_vec());
        // Taken by the writer, and stuck there.
        while !queue.lock().lines.is_empty() {
            std::thread::yield_now();
        }
        for _ in 0..MAX_LINES + 7 {
            queue.push(b"x".to_vec());
        }
        assert_eq!(queue.dropped(), 7);
        queue.push(vec![b'y'; 2 * MAX_BYTES]);
        assert_eq!(queue.dropped(), 8);
        // Ends though nothing is written.
        queue.drain(Duration::from_millis(10));
        assert_eq!(queue.lock().lines.len(), MAX_LINES);
        for _ in 0..=MAX_LINES {
            open.send(()).unwrap();
        }
        queue.drain(LIMIT);
        assert_eq!(took.iter().take(MAX_LINES + 1).count(), MAX_LINES + 1);
        assert_eq!(reported.recv_timeout(LIMIT), Ok(8), "once, when there is room again");
    }

    #[test]
    fn a_few_bytes_too_many_are_dropped_as_lines_are() {
        let queue = Queue::default();
        queue.push(vec![0; MAX_BYTES]);
        queue.push(vec![0]);
        assert_eq!((queue.dropped(), queue.lock().lines.len()), (1, 1));
    }
}
