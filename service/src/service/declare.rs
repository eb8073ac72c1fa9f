//! What the service declares on its session: publishers of units, subscribers, queryables, the token of its life.

use std::sync::Arc;
use std::time::Instant;

use isotherm_bus::DeclaredKeys;
use isotherm_bus::receipt::Receipt;
use isotherm_protocol::key::{self, RawStream, UnitId};
use zenoh::key_expr::OwnedKeyExpr;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::{Query, Queryable};
use zenoh::sample::{Locality, Sample, SampleKind};
use zenoh::{Session, Wait};

use crate::ServiceError;
use crate::config::{chunks, includes};
use crate::control::{Asked as Order, Inbox, Origin};
use crate::observe::status_publisher::{Asked, Bell};
use crate::pair::Pair;
use crate::receive::intake::{Intake, OutletMaker};
use crate::receive::pulse::Pulse;
use crate::receive::unit::{Journal, Outlet};

/// Everything that receives.
#[derive(Debug)]
pub(super) struct Declared {
    subscribers: Vec<Subscriber<()>>,
    queryables: Vec<Queryable<()>>,
    receipt: Receipt,
    alive: [LivelinessToken; 2],
}

impl Declared {
    /// Declares it; the queryable of the status last of all: where it answers, the service receives.
    pub(super) async fn new(
        session: &Session,
        intake: &Arc<Intake>,
        bell: &Bell,
        inbox: &Inbox,
        (pair, taken, pulse): (&Arc<Pair>, &[String], &Arc<Pulse>),
    ) -> Result<Self, ServiceError> {
        let receipt = Receipt::declare(session).await?;
        let mut subscribers = Vec::new();
        for key in [key::ALL_CALIBRATION, key::ALL_CALIBRATION_BY] {
            let put = inbox.clone();
            subscribers.push(subscribe(session, key, move |sample| put.put(sample)).await?);
        }
        subscribers.extend(inputs(session, (intake, bell, pulse), taken, pair).await?);
        let alive = key::service_alive(&session.zid().to_string());
        let own = session.liveliness().declare_token(alive).await;
        let own = own.map_err(|source| ServiceError::Declare { key: key::ALL_SERVICES_ALIVE, source })?;
        let mut queryables = orders(session, inbox).await?;
        for (key, asked) in [
            (key::ALL_CONFIGURATIONS, Asked::Configuration),
            (key::ALL_JOURNALS, Asked::Memory),
            (key::ALL_PAIRS, Asked::Pair),
            (key::ALL_SERVICE_STATUS, Asked::Status),
            (key::ALL_STATUS, Asked::Status),
        ] {
            let bell = bell.clone();
            let take = move |query| bell.ask(asked, query);
            queryables.push(answer(session, key, Locality::Any, take).await?);
        }
        // Whoever sees it may ask.
        let member = session.liveliness().declare_token(pair.me().token()).await;
        let member = member.map_err(|source| ServiceError::Declare { key: key::ALL_MEMBERS, source })?;
        Ok(Self { subscribers, queryables, receipt, alive: [own, member] })
    }

    /// Ends it, and waits for what is being received; whether that went well. The token stays until it is dropped: where it goes,
    /// nothing more comes from this service.
    pub(super) fn undeclare(self) -> (bool, [LivelinessToken; 2]) {
        let Self { subscribers, queryables, receipt, alive } = self;
        // Every one of them, whatever became of the others.
        let received = subscribers.into_iter().map(|it| it.undeclare().wait_callbacks().wait().is_ok());
        let received = received.fold(true, |all, one| all & one);
        drop(receipt);
        let ended = queryables.into_iter().map(|it| it.undeclare().wait().is_ok());
        (ended.fold(received, |all, one| all & one), alive)
    }
}

/// One declared publisher per unit, at one priority, so that its batches stay in order.
///
/// With it the keys of the unit's raw streams and of its journal are declared, for as long as the unit is there.
pub(super) fn outlets(session: Session, congestion: CongestionControl) -> OutletMaker {
    Box::new(move |unit| {
        let keys = RawStream::ALL.into_iter().map(|stream| key::raw(unit, stream));
        let keys = DeclaredKeys::declare(&session, keys.chain([key::journal(unit)]))?;
        let publisher = session
            .declare_publisher(key::corrected(unit))
            .congestion_control(congestion)
            .priority(Priority::RealTime)
            .express(false)
            .wait()?;
        let outlet: Outlet = Box::new(move |frame| {
            // Undeclared where they are dropped.
            let _ = &keys;
            publisher.put(frame).wait()
        });
        Ok(outlet)
    })
}

/// The journals of this instance: entries are few, so that a publisher for each unit would cost more than it saves.
pub(super) fn journal(session: Session, congestion: CongestionControl) -> Journal {
    let instance = session.zid().to_string().into();
    let outlet = Arc::new(move |unit: &UnitId, frame: Vec<u8>| {
        session
            .put(key::journal(unit), frame)
            .congestion_control(congestion)
            .priority(Priority::RealTime)
            .express(false)
            .wait()
    });
    Journal { instance, outlet }
}

/// What the receive thread does with a message: all of it.
fn take(intake: &Arc<Intake>, bell: &Bell, pulse: &Arc<Pulse>) -> impl Fn(Sample) + Send + Sync + 'static {
    let (intake, bell, pulse) = (Arc::clone(intake), bell.clone(), Arc::clone(pulse));
    move |sample| {
        let arrival = Instant::now();
        let _in_hand = pulse.take(arrival);
        let bytes = sample.payload().to_bytes();
        let frame = (sample.kind() == SampleKind::Put).then_some(&*bytes);
        if intake.receive(sample.key_expr().as_str(), frame, arrival) {
            bell.status_due();
        }
    }
}

/// Subscribes to what comes in of the units that are taken. Where those are not all, temperatures are heard of every unit: they come
/// seldom, and tell which units nobody takes.
async fn inputs(
    session: &Session,
    (intake, bell, pulse): (&Arc<Intake>, &Bell, &Arc<Pulse>),
    taken: &[String],
    pair: &Arc<Pair>,
) -> Result<Vec<Subscriber<()>>, ServiceError> {
    let chunks = chunks(taken);
    if chunks.iter().any(|chunk| chunk.as_str() == "*") {
        let raw = subscribe(session, key::ALL_RAW, take(intake, bell, pulse)).await?;
        return Ok(vec![raw, subscribe(session, key::ALL_REFERENCE, take(intake, bell, pulse)).await?]);
    }
    let mut subscribers = Vec::new();
    for (index, chunk) in chunks.iter().enumerate() {
        // Two patterns may take one unit: the first of them does.
        let before = chunks.get(..index).unwrap_or_default();
        for (suffix, all) in [("*/*", key::ALL_RAW), ("reference", key::ALL_REFERENCE)] {
            let (take, before) = (take(intake, bell, pulse), before.to_vec());
            let declare = session.declare_subscriber(format!("imu/{chunk}/{suffix}"));
            let inputs = declare.allowed_origin(Locality::Remote).callback(move |sample| {
                if !is_of(&before, &sample) && key::parse_input(sample.key_expr().as_str()).is_some() {
                    take(sample);
                }
            });
            subscribers.push(inputs.await.map_err(|source| ServiceError::Declare { key: all, source })?);
        }
    }
    let pair = Arc::clone(pair);
    subscribers.push(
        subscribe(session, key::ALL_TEMPERATURES, move |sample| {
            if let Some((serial, _)) = key::parse_raw(sample.key_expr().as_str())
                && !is_of(&chunks, &sample)
            {
                pair.pass_over(serial);
            }
        })
        .await?,
    );
    Ok(subscribers)
}

/// Whether a message is of a unit that one of the patterns takes.
fn is_of(chunks: &[OwnedKeyExpr], sample: &Sample) -> bool {
    key::unit_of(sample.key_expr().as_str()).is_some_and(|serial| includes(chunks, serial))
}

/// Hears what other processes put on a key.
pub(crate) async fn subscribe(
    session: &Session,
    key: &'static str,
    callback: impl Fn(Sample) + Send + Sync + 'static,
) -> Result<Subscriber<()>, ServiceError> {
    let subscriber = session.declare_subscriber(key).allowed_origin(Locality::Remote).callback(callback);
    subscriber.await.map_err(|source| ServiceError::Declare { key, source })
}

/// Takes what the swap manager answers. What may change a unit comes from other processes, on keys with the name of who asks and
/// without, and from the console in this one.
async fn orders(session: &Session, inbox: &Inbox) -> Result<Vec<Queryable<()>>, ServiceError> {
    let (bus, own) = ((Locality::Remote, Origin::Bus), (Locality::SessionLocal, Origin::Console));
    let any = (Locality::Any, Origin::Bus);
    let mut queryables = Vec::new();
    for (key, asked, (from, origin)) in [
        (key::ALL_CALIBRATION, Order::Calibration, bus),
        (key::ALL_CALIBRATION, Order::Calibration, own),
        (key::ALL_CALIBRATION_BY, Order::Calibration, bus),
        (key::ALL_COMMAND, Order::Command, bus),
        (key::ALL_COMMAND, Order::Command, own),
        (key::ALL_COMMAND_BY, Order::Command, bus),
        (key::ALL_HISTORY, Order::History, any),
        (key::ALL_KEPT, Order::Kept, any),
    ] {
        let inbox = inbox.clone();
        let take = move |query| inbox.ask(asked, query, origin);
        queryables.push(answer(session, key, from, take).await?);
    }
    Ok(queryables)
}

async fn answer(
    session: &Session,
    key: &'static str,
    from: Locality,
    callback: impl Fn(Query) + Send + Sync + 'static,
) -> Result<Queryable<()>, ServiceError> {
    let queryable = session.declare_queryable(key).allowed_origin(from).callback(callback);
    queryable.await.map_err(|source| ServiceError::Declare { key, source })
}
