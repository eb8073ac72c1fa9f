//! The one thread beside receive threads and registrar: tail flush by the clock, status, answers to queries.
//!
//! It may wait for a unit's lock or for a slow subscriber; the receive threads never wait for it.

mod answer;
mod instance;
mod outlets;

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use zenoh::Session;
use zenoh::query::Query;

use crate::config::Settings;
use crate::intake::Intake;
use crate::registrar::Board;
use instance::{Instance, Look};
use outlets::Outlets;

/// Requests that may wait for the keeper; what comes beyond is refused, which a query notices by its missing reply.
const WAITING_REQUESTS: usize = 1024;
/// Interval of the status of units whose progress is followed.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(500);

/// What somebody asks of the service, by the queryable that heard it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Asked {
    /// Status of units or of the service.
    Status,
    /// Memory of units.
    Memory,
    /// Configuration of the service.
    Configuration,
}

/// What the keeper is asked for.
#[derive(Debug)]
enum Request {
    /// Some unit's status is due.
    Status,
    /// Somebody asks.
    Query(Asked, Query),
    /// Flush every unit, publish its last status, end.
    Stop,
}

/// Asks the keeper; never waits.
#[derive(Debug, Clone)]
pub(crate) struct Bell(SyncSender<Request>);

impl Bell {
    /// Some unit's status is due.
    pub(crate) fn status_due(&self) {
        // With so many requests waiting the keeper is going to look at all units anyhow.
        let _ = self.0.try_send(Request::Status);
    }

    /// Somebody asks.
    pub(crate) fn ask(&self, asked: Asked, query: Query) {
        if let Err(TrySendError::Full(_)) = self.0.try_send(Request::Query(asked, query)) {
            tracing::warn!(?asked, "a query is refused: {WAITING_REQUESTS} are waiting");
        }
    }
}

/// The running keeper.
#[derive(Debug)]
pub(crate) struct Keeper {
    requests: SyncSender<Request>,
    thread: JoinHandle<()>,
}

impl Keeper {
    /// Starts it.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub(crate) fn start(
        session: &Session,
        intake: Arc<Intake>,
        board: Arc<Board>,
        settings: &Settings,
    ) -> std::io::Result<Self> {
        let (requests, receiver) = sync_channel(WAITING_REQUESTS);
        let instance = Instance::new(session, settings.digest, board);
        let mut work = Work {
            outlets: Outlets::new(session.clone()),
            instance,
            configuration: settings.to_toml(),
            intake,
            status_interval: settings.status_interval,
            look_interval: (settings.tail_flush / 4)
                .clamp(Duration::from_millis(5), Duration::from_millis(100)),
        };
        let thread = std::thread::Builder::new()
            .name("isotherm-keeper".to_owned())
            .spawn(move || work.run(&receiver))?;
        Ok(Self { requests, thread })
    }

    /// Where to ask it.
    pub(crate) fn bell(&self) -> Bell {
        Bell(self.requests.clone())
    }

    /// Has everything flushed and waits until it is; whether it ended in order.
    pub(crate) fn stop(self) -> bool {
        self.requests.send(Request::Stop).is_ok() & self.thread.join().is_ok()
    }
}

/// Which units' status is published.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Which {
    /// Where something has changed.
    Due,
    /// And where something is in progress.
    InProgress,
    /// Every one.
    All,
}

/// What the keeper works with.
struct Work {
    outlets: Outlets,
    instance: Instance,
    /// Effective configuration of the service.
    configuration: String,
    intake: Arc<Intake>,
    status_interval: Duration,
    look_interval: Duration,
}

impl Work {
    fn run(&mut self, requests: &Receiver<Request>) {
        let start = Instant::now();
        let (mut next_status, mut next_progress) = (start + self.status_interval, start + PROGRESS_INTERVAL);
        let mut next_look = start + self.look_interval;
        self.publish(Which::All);
        loop {
            let wait = next_status.min(next_look).saturating_duration_since(Instant::now());
            match requests.recv_timeout(wait) {
                Ok(Request::Status) => self.publish(Which::Due),
                Ok(Request::Query(asked, query)) => self.answer(asked, &query),
                Ok(Request::Stop) | Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => {}
            }
            let now = Instant::now();
            if now >= next_look {
                self.intake.each_unit(|actor| actor.tend(now));
                self.publish(Which::Due);
                next_look = now + self.look_interval;
            }
            if now >= next_status {
                self.intake.each_unit(|actor| actor.measure_rates(now));
                self.publish(Which::All);
                next_status = now + self.status_interval;
                next_progress = now + PROGRESS_INTERVAL;
            } else if now >= next_progress {
                self.publish(Which::InProgress);
                next_progress = now + PROGRESS_INTERVAL;
            }
        }
        self.intake.each_unit(crate::unit::UnitActor::flush);
        self.publish(Which::All);
    }

    /// Publishes the status of units, and the service's own where it has changed or all are asked for.
    fn publish(&mut self, which: Which) {
        let Self { instance, intake, outlets, .. } = self;
        let name = instance.name();
        // One after the other: the statuses of thousands of units are megabytes.
        let told = intake.one_by_one(
            |actor| {
                let progress = which == Which::InProgress && actor.is_in_progress();
                let publish = actor.take_status_due() || which == Which::All || progress;
                publish.then(|| (actor.id().clone(), actor.status(name)))
            },
            |(unit, status)| {
                if let Err(error) = outlets.unit(&unit, &status) {
                    tracing::warn!(%unit, "cannot publish the status: {}", isotherm_bus::words(&error));
                }
            },
        );
        let look = match which {
            Which::All => Look::Always,
            // What the service says of its units changes with a status that is due.
            Which::Due | Which::InProgress if told > 0 => Look::IfNews,
            Which::Due | Which::InProgress => Look::IfPosted,
        };
        if let Some(status) = self.instance.status(&self.intake, look)
            && let Err(error) = self.outlets.service(&status)
        {
            tracing::warn!("cannot publish the service's status: {}", isotherm_bus::words(&error));
        }
    }
}
