//! All of it at work: a node of ROS 2 on one session, a client of the service on the other.
//!
//! Receive threads only queue what comes. Each unit has a task that hands ticks to the service, and one that publishes what
//! comes back: a subscriber that makes one of them wait holds up no other unit.

mod account;
mod diagnostics;
mod feeding;
mod publishing;
mod services;

use std::sync::Arc;
use std::time::Duration;

use isotherm_bus::{BoxFuture, BusError, Consumer, presence};
use isotherm_protocol::codec;
use isotherm_protocol::key;
use isotherm_protocol::status::Status;
use tokio::sync::Notify;
use tokio::sync::mpsc::unbounded_channel;
use tokio::task::JoinHandle;
use tokio::time::Instant;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::query::Queryable;
use zenoh::{Session, Wait};

use crate::Error;
use crate::graph::{self, Topics};
use crate::interface::{DIAGNOSTICS, IMU, Interface, TEMPERATURE};
use crate::mapping::{Mapping, UnitMapping};
use crate::name::{self, Kind, Node};
use crate::qos::Qos;
use crate::totals::Totals;
use account::Unit;
use feeding::{Arrived, Input, Queue};
use publishing::Outlet;

/// Longest wait for what is under way when the bridge stops: what a service flushes by the clock comes within it.
const SETTLE: Duration = Duration::from_secs(2);
/// Longest wait of the end for a session that does not close.
const CLOSE: Duration = Duration::from_secs(1);

/// A bridge at work. Dropping it without [`Bridge::stop`] loses what is under way.
#[derive(Debug)]
pub struct Bridge {
    ros: Session,
    bus: Session,
    units: Vec<Arc<Unit>>,
    subscribers: Vec<Subscriber<()>>,
    feeding: Vec<JoinHandle<()>>,
    rest: Vec<JoinHandle<()>>,
    _statuses: Vec<Subscriber<()>>,
    _services: Vec<Queryable<()>>,
    _graph: Subscriber<()>,
    _tokens: Vec<LivelinessToken>,
}

/// Declares what is in the graph, with its tokens.
#[derive(Debug)]
pub(crate) struct Declarer {
    session: Session,
    node: Node,
    /// Number of the last endpoint.
    number: u32,
    tokens: Vec<LivelinessToken>,
}

impl Declarer {
    async fn new(session: &Session, mapping: &Mapping, domain: u32) -> Result<Self, BusError> {
        let node = Node {
            domain,
            session: session.zid().to_string(),
            namespace: mapping.namespace.clone(),
            name: mapping.node.clone(),
        };
        let mut declarer = Self { session: session.clone(), node, number: 0, tokens: Vec::new() };
        declarer.token(declarer.node.token()).await?;
        Ok(declarer)
    }

    async fn token(&mut self, key: String) -> Result<(), BusError> {
        let token = self.session.liveliness().declare_token(&key).await;
        self.tokens.push(token.map_err(|source| BusError::Declare { key, source })?);
        Ok(())
    }

    /// Puts something into the graph; its token.
    async fn endpoint(
        &mut self,
        kind: Kind,
        topic: &str,
        interface: Interface,
        qos: Qos,
    ) -> Result<String, BusError> {
        self.number += 1;
        let token = self.node.endpoint(self.number, kind, topic, interface, qos);
        self.token(token.clone()).await?;
        Ok(token)
    }

    fn key(&self, topic: &str, interface: Interface) -> String {
        name::key(self.node.domain, topic, interface)
    }

    /// A publisher with its place in the graph.
    async fn publisher(&mut self, topic: &str, interface: Interface, qos: Qos) -> Result<Outlet, BusError> {
        let token = self.endpoint(Kind::Publisher, topic, interface, qos).await?;
        Outlet::declare(&self.session, self.key(topic, interface), qos, name::gid(&token)).await
    }

    /// A subscription with its place in the graph.
    async fn subscription(
        &mut self,
        topic: &str,
        interface: Interface,
        queue: Queue,
        input: Input,
    ) -> Result<Subscriber<()>, BusError> {
        self.endpoint(Kind::Subscription, topic, interface, Qos::SENSOR_DATA).await?;
        let key = self.key(topic, interface);
        let subscriber = self.session.declare_subscriber(&key).callback(move |sample| {
            let (payload, attachment) = (sample.payload().clone(), sample.attachment().cloned());
            queue.push(Arrived::Message(input, feeding::Message { payload, attachment }));
        });
        subscriber.await.map_err(|source| BusError::Declare { key, source })
    }
}

impl Bridge {
    /// Starts it between two open sessions: `ros` with the nodes, `bus` with the service.
    ///
    /// It goes on without a service; what comes before there is one waits, within limits.
    ///
    /// # Errors
    /// [`Error::Bus`] where something cannot be declared.
    #[must_use]
    pub fn start(
        mapping: &Mapping,
        domain: u32,
        ros: Session,
        bus: Session,
    ) -> BoxFuture<'_, Result<Self, Error>> {
        Box::pin(async move {
            let mut declarer = Declarer::new(&ros, mapping, domain).await?;
            let (mut units, mut subscribers, mut queues) = (Vec::new(), Vec::new(), Vec::new());
            let (mut feeding, mut rest) = (Vec::new(), Vec::new());
            let (mut statuses, mut answers) = (Vec::new(), Vec::new());
            let tokens: Vec<_> = mapping.units.iter().map(|unit| unit.unit.as_str()).collect();
            let names = isotherm_log::ros2::Names::of(tokens, "unit");
            for mapping in &mapping.units {
                let unit = Arc::new(Unit::new(mapping.clone()));
                statuses.push(hear_status(&bus, &unit).await?);
                // First what comes back, then what is sent.
                let outlet = declarer.publisher(&mapping.corrected, IMU, mapping.output).await?;
                let consumer = Consumer::declare(&bus, Some(&mapping.unit)).await?;
                let documents = Arc::new(Notify::new());
                rest.push(tokio::spawn(publishing::documents(
                    bus.clone(),
                    Arc::clone(&unit),
                    Arc::clone(&documents),
                )));
                rest.push(tokio::spawn(publishing::publish(Arc::clone(&unit), consumer, outlet, documents)));
                let name = names.get(mapping.unit.as_str());
                answers.extend(services::declare(&mut declarer, &bus, mapping, &name).await?);
                let (sender, arrived) = unbounded_channel();
                feeding.push(tokio::spawn(feeding::feed(Arc::clone(&unit), bus.clone(), arrived)));
                let queue = Queue::new(sender, Arc::clone(&unit));
                subscribers.extend(subscribe(&mut declarer, mapping, &queue).await?);
                queues.push(queue);
                units.push(unit);
            }
            let left = move |gid| queues.iter().for_each(|queue| queue.push(Arrived::Left(gid)));
            let graph = graph::watch(&ros, domain, Topics::of(mapping), left).await?;
            let outlet = declarer.publisher(&mapping.diagnostics, DIAGNOSTICS, Qos::DIAGNOSTICS).await?;
            rest.push(tokio::spawn(diagnostics::publish(units.clone(), ros.clone(), outlet)));
            Ok(Self {
                ros,
                bus,
                units,
                subscribers,
                feeding,
                rest,
                _statuses: statuses,
                _services: answers,
                _graph: graph,
                _tokens: declarer.tokens,
            })
        })
    }

    /// Waits until a service answers, and knows what the bridge hears.
    ///
    /// # Errors
    /// [`BusError::NoService`] after `limit`.
    pub async fn wait_for_service(&self, limit: Duration) -> Result<(), BusError> {
        presence::wait_for_service(&self.bus, limit).await?;
        let deadline = Instant::now() + limit;
        // The covariances of the first messages rest on the documents in force.
        for unit in &self.units {
            let left = deadline.saturating_duration_since(Instant::now());
            let _ = tokio::time::timeout(left, publishing::fetch(&self.bus, unit)).await;
        }
        Ok(())
    }

    /// Where the nodes can connect to.
    #[must_use]
    pub fn locators(&self) -> Vec<String> {
        isotherm_bus::locators(&self.ros)
    }

    /// The account so far.
    #[must_use]
    pub fn totals(&self) -> Totals {
        Totals { units: self.units.iter().map(|unit| (unit.id().to_string(), unit.totals())).collect() }
    }

    /// Takes nothing more, waits for what is under way, closes both sessions.
    #[must_use]
    pub fn stop(mut self) -> BoxFuture<'static, Totals> {
        Box::pin(async move {
            for subscriber in self.subscribers.drain(..) {
                let _ = subscriber.undeclare().wait_callbacks().wait();
            }
            let deadline = Instant::now() + SETTLE;
            for (unit, task) in self.units.iter().zip(self.feeding.drain(..)) {
                unit.end.notify_one();
                // One that waits for a service that is not there is given up.
                let abort = task.abort_handle();
                if tokio::time::timeout_at(deadline, task).await.is_err() {
                    abort.abort();
                }
            }
            for unit in &self.units {
                let _ = tokio::time::timeout_at(deadline, unit.settled()).await;
            }
            let totals = self.totals();
            self.rest.iter().for_each(JoinHandle::abort);
            for session in [self.ros, self.bus] {
                if let Err(error) = isotherm_bus::close(session, CLOSE).await {
                    tracing::warn!("{error}");
                }
            }
            totals
        })
    }
}

/// Subscriptions of a unit's topics.
async fn subscribe(
    declarer: &mut Declarer,
    mapping: &UnitMapping,
    queue: &Queue,
) -> Result<Vec<Subscriber<()>>, BusError> {
    let mut subscribers = Vec::new();
    for (index, temperature) in mapping.temperatures.iter().enumerate() {
        let (topic, input) = (&temperature.topic, Input::Temperature(index));
        subscribers.push(declarer.subscription(topic, TEMPERATURE, queue.clone(), input).await?);
    }
    subscribers.push(declarer.subscription(&mapping.raw, IMU, queue.clone(), Input::Imu).await?);
    Ok(subscribers)
}

/// Has a unit know what the service says of it.
async fn hear_status(bus: &Session, unit: &Arc<Unit>) -> Result<Subscriber<()>, BusError> {
    let (key, heard) = (key::status(unit.id()), Arc::clone(unit));
    let subscriber = bus.declare_subscriber(&key).callback(move |sample| {
        if let Ok(status) = codec::decode::<Status>(&sample.payload().to_bytes()) {
            heard.hear(status);
        }
    });
    subscriber.await.map_err(|source| BusError::Declare { key, source })
}
