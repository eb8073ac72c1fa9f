//! The one path by which a unit gets another calibration, whoever asks: folder, bus, rollback, pre-launch calibration.
//!
//! A thread of its own owns the state folder, what each unit was given and what the folder of documents holds. It parses,
//! judges, writes to disk and only then touches a unit, for as long as a pointer takes. Receive threads ask and go on:
//! where too much is waiting the asker is told so.
//!
//! | module | holds |
//! |---|---|
//! | `inbox` | how to ask, without waiting |
//! | `queue` | requests that wait, unit by unit |
//! | `worker` | the thread |
//! | `order` | what a swap is asked for with |
//! | `reading` | a document that was read and holds |
//! | `file` | files of the folder, read |
//! | `admit` | text in; verdict, problems and warnings out |
//! | `policy` | age, temperature range, jump, schema version |
//! | `compare` | what a swap changes |
//! | `swap` | a verdict carried out: stored, written down, handed to the unit |
//! | `record` | what a unit was given |
//! | `refusals` | refused documents, written down once |
//! | `start` | what holds when the service starts |
//! | `folder` | documents of the folder, and two that name one unit |
//! | `rollback` | back to an earlier revision |
//! | `command` | commands to a unit |
//! | `notice` | what units have to tell |
//! | `pre_launch` | the result of a pre-launch calibration as an overlay |
//! | `answer` | queries and their replies |
//! | `carry` | what another instance has written down, written down here too |
//! | `control_status` | what the service's own status shows |

mod admit;
mod answer;
mod carry;
mod command;
mod compare;
mod control_status;
mod file;
mod folder;
mod inbox;
mod notice;
mod order;
mod policy;
mod pre_launch;
mod queue;
mod reading;
mod record;
mod refusals;
mod rollback;
mod start;
mod swap;
mod worker;

use std::sync::Arc;
use std::thread::JoinHandle;

pub(crate) use carry::Carried;
pub(crate) use control_status::{ControlStatus, Posted, UNWRITTEN};
pub(crate) use inbox::{Inbox, Notice, Origin, PreLaunchEnd};

use queue::Queue;
pub(crate) use start::Found;
pub(crate) use worker::Worker;

/// The way to a swap manager that has not started yet, so that units can be told of it before.
#[derive(Debug)]
pub(crate) struct Opening(Arc<Queue>);

impl Opening {
    /// A way with nothing on it.
    pub(crate) fn new() -> Self {
        Self(Arc::default())
    }

    /// Where to ask.
    pub(crate) fn inbox(&self) -> Inbox {
        Inbox::new(Arc::clone(&self.0))
    }
}

/// The running swap manager. Dropped without [`SwapManager::stop`] it ends by itself after what waits.
#[derive(Debug)]
pub(crate) struct SwapManager {
    queue: Arc<Queue>,
    thread: Option<JoinHandle<()>>,
}

impl SwapManager {
    /// Starts it.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub(crate) fn start(Opening(queue): Opening, work: Worker) -> std::io::Result<Self> {
        let requests = Arc::clone(&queue);
        let thread = std::thread::Builder::new().name("isotherm-control".to_owned()).spawn(move || {
            yield_to_ticks();
            work.run(&requests);
        })?;
        Ok(Self { queue, thread: Some(thread) })
    }

    /// Has it finish what waits and ends it; whether it ended in order.
    pub(crate) fn stop(mut self) -> bool {
        self.queue.stop();
        self.thread.take().is_some_and(|thread| thread.join().is_ok())
    }
}

/// How much less this thread is worth than those that receive: a swap takes milliseconds, and ticks must not wait for a core meanwhile.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 10;

/// Has the thread give way to the others where there are too few cores. Only Linux knows priorities of single threads.
fn yield_to_ticks() {
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::process::setpriority_process(None, NICENESS) {
        tracing::debug!("the swap manager keeps its priority: {error}");
    }
}

impl Drop for SwapManager {
    fn drop(&mut self) {
        // Units hold a way to it for as long as it holds them: nothing else would ever end it.
        self.queue.stop();
    }
}
