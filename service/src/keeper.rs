//! The one thread beside the receive threads: tail flush by the clock, status, answers to queries.
//!
//! It may wait for a unit's lock or for a slow subscriber; the receive threads never wait for it.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use isotherm_protocol::codec;
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::status::Status;
use zenoh::key_expr::keyexpr;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Query;
use zenoh::{Session, Wait};

use crate::config::Settings;
use crate::intake::Intake;

/// Requests that may wait for the keeper; what comes beyond is refused, which a query notices by its missing reply.
const WAITING_REQUESTS: usize = 1024;

/// What the keeper is asked for.
#[derive(Debug)]
enum Request {
    /// Some unit's status is due.
    Status,
    /// Somebody asks for the status of units.
    Query(Query),
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

    /// Somebody asks for the status of units.
    pub(crate) fn query(&self, query: Query) {
        if let Err(TrySendError::Full(_)) = self.0.try_send(Request::Query(query)) {
            tracing::warn!("a status query is refused: {WAITING_REQUESTS} are waiting");
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
    pub(crate) fn start(session: Session, intake: Arc<Intake>, settings: &Settings) -> std::io::Result<Self> {
        let (requests, receiver) = sync_channel(WAITING_REQUESTS);
        let mut work = Work {
            session,
            intake,
            publishers: HashMap::new(),
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

/// What the keeper works with.
struct Work {
    session: Session,
    intake: Arc<Intake>,
    publishers: HashMap<UnitId, Publisher<'static>>,
    status_interval: Duration,
    look_interval: Duration,
}

impl Work {
    fn run(&mut self, requests: &Receiver<Request>) {
        let mut next_status = Instant::now() + self.status_interval;
        let mut next_look = Instant::now() + self.look_interval;
        loop {
            let wait = next_status.min(next_look).saturating_duration_since(Instant::now());
            match requests.recv_timeout(wait) {
                Ok(Request::Status) => self.publish_status(false),
                Ok(Request::Query(query)) => self.answer(&query),
                Ok(Request::Stop) | Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => {}
            }
            let now = Instant::now();
            if now >= next_look {
                self.intake.each_unit(|actor| actor.flush_if_quiet(now));
                next_look = now + self.look_interval;
            }
            if now >= next_status {
                self.publish_status(true);
                next_status = now + self.status_interval;
            }
        }
        self.intake.each_unit(crate::unit::UnitActor::flush);
        self.publish_status(true);
    }

    /// Publishes the status of the units for which it is due, or of all.
    fn publish_status(&mut self, all: bool) {
        let due = self.intake.each_unit(|actor| {
            (actor.take_status_due() || all).then(|| (actor.id().clone(), actor.status()))
        });
        for (unit, status) in due.into_iter().flatten() {
            if let Err(error) = self.publish(&unit, &status) {
                tracing::warn!(%unit, "cannot publish the status: {error}");
            }
        }
    }

    fn publish(&mut self, unit: &UnitId, status: &Status) -> Result<(), zenoh::Error> {
        if !self.publishers.contains_key(unit) {
            let publisher = self
                .session
                .declare_publisher(key::status(unit))
                .congestion_control(CongestionControl::Drop)
                .priority(Priority::DataLow)
                .wait()?;
            self.publishers.insert(unit.clone(), publisher);
        }
        let Some(publisher) = self.publishers.get(unit) else { return Ok(()) };
        publisher.put(codec::encode(status)?).wait()
    }

    /// Replies with the status of every unit that the query's key takes in.
    fn answer(&self, query: &Query) {
        let statuses = self.intake.each_unit(|actor| {
            let key = key::status(actor.id());
            let asked = keyexpr::new(&key).is_ok_and(|key| query.key_expr().intersects(key));
            asked.then(|| (key, actor.status()))
        });
        for (key, status) in statuses.into_iter().flatten() {
            let replied =
                codec::encode(&status).map_err(Into::into).and_then(|frame| query.reply(key, frame).wait());
            if let Err(error) = replied {
                tracing::warn!("cannot answer a status query: {error}");
            }
        }
    }
}
