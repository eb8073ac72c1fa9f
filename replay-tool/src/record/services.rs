//! Services: waiting for one, following which are there, asking each.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use isotherm_bus::{BusError, Role, presence};
use isotherm_protocol::key;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::task::JoinHandle;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;

use super::inquiry::{self, Question};
use super::queue::Queue;
use super::{RecordOptions, RecordReport, ServiceWait};
use crate::error::Error;
use crate::stop::Stop;

/// How long one wait for a service takes where it is repeated.
const ONE_WAIT: Duration = Duration::from_secs(5);
/// A wait that ends by a signal.
const FOREVER: Duration = Duration::from_secs(100 * 365 * 86_400);

/// Opens the session, as a client where it can be one: a peer hears only from those that it is connected to itself, and raw messages
/// come from producers; to a client the service, or a router, passes them on.
pub(super) async fn open(options: &RecordOptions, stop: &mut Stop) -> Result<Session, Error> {
    let way = match options.service {
        ServiceWait::Without => options.session.way_if_stated(Role::Listener)?,
        _ => options.session.way(Role::Listener)?,
    };
    let limit = match options.service {
        ServiceWait::Forever => FOREVER,
        ServiceWait::Within(_) | ServiceWait::Without => options.query_limit,
    };
    tokio::select! {
        opened = way.open_patiently(limit, |_| ()) => Ok(opened?),
        () = stop.asked() => Err(Error::Stopped),
    }
}

/// Waits for a service, as the options say.
pub(super) async fn await_service(
    session: &Session,
    wait: ServiceWait,
    stop: &mut Stop,
) -> Result<(), Error> {
    loop {
        let limit = match wait {
            ServiceWait::Without => return Ok(()),
            ServiceWait::Within(limit) => limit,
            ServiceWait::Forever => ONE_WAIT,
        };
        let found = tokio::select! {
            found = presence::wait_for_service(session, limit) => found,
            () = stop.asked() => return Err(Error::Stopped),
        };
        match found {
            Err(BusError::NoService { .. }) if wait == ServiceWait::Forever => {}
            found => return Ok(found?),
        }
    }
}

/// A service, and whether it has come or gone.
pub(super) type Life = (String, bool);

/// Enters a service; whether it is one that has come.
pub(super) fn note(life: Life, alive: &mut BTreeSet<String>, report: &mut RecordReport) -> bool {
    let (instance, is_alive) = life;
    if is_alive {
        report.services.insert(instance.clone());
        return alive.insert(instance);
    }
    if alive.remove(&instance) {
        report.warnings.push(format!("service {instance} is gone"));
    }
    false
}

/// Follows which services are there.
pub(super) async fn follow_services(
    session: &Session,
    lives: UnboundedSender<Life>,
) -> Result<Subscriber<()>, BusError> {
    session
        .liveliness()
        .declare_subscriber(key::ALL_SERVICES_ALIVE)
        .history(true)
        .callback(move |sample| {
            if let Some(instance) = key::parse_service_alive(sample.key_expr()) {
                let _ = lives.send((instance.to_owned(), sample.kind() == SampleKind::Put));
            }
        })
        .await
        .map_err(|source| BusError::Declare { key: key::ALL_SERVICES_ALIVE.to_owned(), source })
}

/// Starts the task that asks services, once for all questions that have come meanwhile; it ends with the questions.
pub(super) fn start_asker(
    session: &Session,
    options: &RecordOptions,
    queue: &Arc<Queue>,
) -> (JoinHandle<()>, UnboundedSender<Question>, UnboundedReceiver<String>) {
    let (questions, mut asked) = unbounded_channel::<Question>();
    let (answer, answers) = unbounded_channel();
    let (session, queue, units) = (session.clone(), Arc::clone(queue), options.units.clone());
    let (limit, without) = (options.query_limit, options.service == ServiceWait::Without);
    let task = tokio::spawn(async move {
        while let Some(mut question) = asked.recv().await {
            while let Ok(other) = asked.try_recv() {
                question = question.max(other);
            }
            if without {
                continue;
            }
            match inquiry::ask(&session, question, &units, limit, &queue).await {
                Ok(words) => words.into_iter().for_each(|words| drop(answer.send(words))),
                Err(error) => drop(answer.send(error.to_string())),
            }
        }
    });
    (task, questions, answers)
}
