//! Words on stderr.

use std::fmt::Display;
use std::io::{self, Write};
use std::sync::OnceLock;
use std::time::Duration;

use isotherm_document::escape::{escaped, escaped_lines};

use crate::exit::Exit;
use crate::queue::Queue;

/// How long the end of the program waits for a reader that takes no line.
const PATIENCE: Duration = Duration::from_millis(500);

/// The lines of this process, once they go through a queue.
static QUEUE: OnceLock<Queue> = OnceLock::new();
/// Name of this program, once it has read its command line.
pub(crate) static PROGRAM: OnceLock<String> = OnceLock::new();

/// Puts a line on stderr: through the queue where there is one, else at once.
pub fn to_stderr(line: String) {
    match QUEUE.get() {
        Some(queue) => queue.push(line.into_bytes()),
        // Where stderr is gone or full, the exit code says the rest.
        None => drop(io::stderr().write_all(line.as_bytes())),
    }
}

/// Says a line on stderr.
pub fn say(line: impl Display) {
    to_stderr(format!("{}\n", escaped(&line.to_string())));
}

/// Says what is doubtful, and no reason to stop.
pub fn say_warning(words: impl Display) {
    say(format_args!("{words} (warning)"));
}

/// Says several lines on stderr.
pub fn say_lines(lines: impl Display) {
    to_stderr(format!("{}\n", escaped_lines(&lines.to_string())));
}

/// Says what went wrong, after the name of the program, and gives the exit code.
#[must_use]
pub fn failed(error: impl Display, exit: Exit) -> Exit {
    say(format_args!("{}: {error}", program()));
    exit
}

/// The same of an error that takes several lines.
#[must_use]
pub fn failed_lines(error: impl Display, exit: Exit) -> Exit {
    say_lines(format_args!("{}: {error}", program()));
    exit
}

fn program() -> &'static str {
    PROGRAM.get().map_or("isotherm", String::as_str)
}

/// Lines that were dropped because stderr took none.
#[must_use]
pub fn dropped_lines() -> u64 {
    QUEUE.get().map_or(0, Queue::dropped)
}

/// Waits when it is dropped until the queue is written, unless nobody takes it.
#[derive(Debug)]
pub struct Drained(());

impl Drop for Drained {
    fn drop(&mut self) {
        if let Some(queue) = QUEUE.get() {
            queue.drain(PATIENCE);
        }
    }
}

/// Has lines for stderr go through a queue, and starts the thread that writes it. Where lines were dropped, `report` is called with
/// their number as soon as there is room again.
///
/// # Errors
/// Where the system gives no thread.
pub fn queue_lines(report: impl Fn(u64) + Send + 'static) -> io::Result<Drained> {
    // Before the thread, which would end without it.
    if QUEUE.set(Queue::default()).is_ok() {
        let write = move || {
            if let Some(queue) = QUEUE.get() {
                queue.write_to(io::stderr(), report);
            }
        };
        std::thread::Builder::new().name("isotherm-log".to_owned()).spawn(write)?;
        // A panic is caught where it happens; its words must not wait for stderr either.
        std::panic::set_hook(Box::new(|panic| to_stderr(format!("{}: {panic}\n", program()))));
    }
    Ok(Drained(()))
}
