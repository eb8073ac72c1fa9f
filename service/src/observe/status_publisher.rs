//! The one thread beside receive threads and swap manager: tail flush by the clock, status, answers to queries.
//!
//! It may wait for a unit's lock or for a slow subscriber; the receive threads never wait for it.

mod answer;
mod outlets;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use zenoh::Session;
use zenoh::query::Query;

use isotherm_protocol::service_status::ServiceStatus;

use crate::config::Settings;
use crate::observe::instance::Instance;
use crate::receive::unit::UnitActor;
use outlets::Outlets;

/// Requests that may wait for the status publisher; what comes beyond is refused, which a query notices by its missing reply.
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
    /// What the service does for which unit, as one of a pair.
    Pair,
}

/// What the status publisher is asked for.
#[derive(Debug)]
enum Request {
    /// Some unit's status is due.
    Status,
    /// Somebody asks.
    Query(Asked, Query),
    /// Flush every unit, publish its last status, end.
    Stop,
}

/// Asks the status publisher; never waits.
#[derive(Debug, Clone)]
pub(crate) struct Bell {
    requests: SyncSender<Request>,
    /// Rung for a status, and the status publisher has not looked since.
    rung: Arc<AtomicBool>,
}

impl Bell {
    /// Some unit's status is due.
    pub(crate) fn status_due(&self) {
        if !self.rung.swap(true, Ordering::AcqRel) {
            // With so many requests waiting the status publisher is going to look at all units anyhow.
            let _ = self.requests.try_send(Request::Status);
        }
    }

    /// Somebody asks.
    pub(crate) fn ask(&self, asked: Asked, query: Query) {
        if let Err(TrySendError::Full(_)) = self.requests.try_send(Request::Query(asked, query)) {
            tracing::warn!(?asked, "a query is refused: {WAITING_REQUESTS} are waiting");
        }
    }
}

/// The running status publisher.
#[derive(Debug)]
pub(crate) struct StatusPublisher {
    bell: Bell,
    thread: JoinHandle<()>,
}

impl StatusPublisher {
    /// Starts it.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub(crate) fn start(
        session: &Session,
        instance: Arc<Instance>,
        settings: &Settings,
    ) -> std::io::Result<Self> {
        let (requests, receiver) = sync_channel(WAITING_REQUESTS);
        let rung = Arc::new(AtomicBool::new(false));
        let mut work = Work {
            outlets: Outlets::new(session.clone()),
            instance,
            said: None,
            posted: Arc::default(),
            configuration: settings.to_toml(),
            rung: Arc::clone(&rung),
            units_changed: true,
            status_interval: settings.status_interval,
            look_interval: (settings.tail_flush / 4)
                .clamp(Duration::from_millis(5), Duration::from_millis(100)),
        };
        let thread = std::thread::Builder::new()
            .name("isotherm-status".to_owned())
            .spawn(move || work.run(&receiver))?;
        Ok(Self { bell: Bell { requests, rung }, thread })
    }

    /// Where to ask it.
    pub(crate) fn bell(&self) -> Bell {
        self.bell.clone()
    }

    /// Has everything flushed and waits until it is; whether it ended in order.
    pub(crate) fn stop(self) -> bool {
        self.bell.requests.send(Request::Stop).is_ok() & self.thread.join().is_ok()
    }
}

/// What the status publisher works with.
struct Work {
    outlets: Outlets,
    instance: Arc<Instance>,
    /// What was said last of the service, as far as a change of it is news.
    said: Option<ServiceStatus>,
    /// What the swap manager had posted then.
    posted: Arc<ServiceStatus>,
    /// Effective configuration of the service.
    configuration: String,
    rung: Arc<AtomicBool>,
    /// Some unit's status was due since the service's own was looked at.
    units_changed: bool,
    status_interval: Duration,
    look_interval: Duration,
}

impl Work {
    fn run(&mut self, requests: &Receiver<Request>) {
        let start = Instant::now();
        let (mut next_status, mut next_progress) = (start + self.status_interval, start + PROGRESS_INTERVAL);
        let mut next_look = start + self.look_interval;
        self.publish_all();
        loop {
            let wait = next_status.min(next_look).saturating_duration_since(Instant::now());
            match requests.recv_timeout(wait) {
                Ok(Request::Status) => self.publish(UnitActor::take_status_due),
                Ok(Request::Query(asked, query)) => self.answer(asked, &query),
                Ok(Request::Stop) | Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => {}
            }
            let now = Instant::now();
            if now >= next_look {
                // A process that stood still knows nothing of streams that have stopped.
                let still = self.instance.pair.has_stood_still(now).is_some();
                self.publish(|actor| {
                    if !still {
                        actor.tend(now);
                    }
                    actor.take_status_due()
                });
                self.publish_own(false);
                next_look = now + self.look_interval;
            }
            if now >= next_status {
                self.instance.intake.each_unit(|actor| actor.measure_rates(now));
                self.publish_all();
                next_status = now + self.status_interval;
                next_progress = now + PROGRESS_INTERVAL;
            } else if now >= next_progress {
                self.publish(|actor| actor.take_status_due() || actor.is_in_progress());
                next_progress = now + PROGRESS_INTERVAL;
            }
        }
        self.instance.intake.each_unit(UnitActor::flush);
        self.publish_all();
    }

    /// Publishes every status there is.
    fn publish_all(&mut self) {
        self.publish(|actor| {
            actor.take_status_due();
            true
        });
        self.outlets.keep(|unit| self.instance.intake.has(unit));
        self.publish_own(true);
    }

    /// Publishes the status of the units for which `is_due` says so.
    fn publish(&mut self, mut is_due: impl FnMut(&mut UnitActor) -> bool) {
        // Before the look: who rings from here on is heard again.
        self.rung.store(false, Ordering::Release);
        let Self { instance, outlets, .. } = self;
        let name = instance.id();
        // One after the other: the statuses of thousands of units are megabytes.
        let told = instance.intake.one_by_one(
            // The status of a unit is that of the instance that speaks for it.
            |actor| (is_due(actor) && actor.speaks()).then(|| (actor.id().clone(), actor.status(name))),
            |(unit, status)| {
                if let Err(error) = outlets.unit(&unit, &status) {
                    tracing::warn!(%unit, "cannot publish the status: {}", isotherm_bus::words(&error));
                }
            },
        );
        // What the service says of its units changes with a status that is due.
        self.units_changed |= told > 0;
    }

    /// Publishes the service's own status where it has changed, or `always`.
    fn publish_own(&mut self, always: bool) {
        let posted = self.instance.control_status.read();
        let may_be_news = std::mem::take(&mut self.units_changed) || !Arc::ptr_eq(&self.posted, &posted);
        if !(always || may_be_news) {
            return;
        }
        let news = self.instance.news(&posted);
        self.posted = posted;
        if !always && self.said.as_ref() == Some(&news) {
            return;
        }
        self.said = Some(news.clone());
        if let Err(error) = self.outlets.service(&self.instance.complete(news)) {
            tracing::warn!("cannot publish the service's status: {}", isotherm_bus::words(&error));
        }
    }
}
