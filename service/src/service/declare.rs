//! What the service declares on its session: publishers of units, subscribers, queryables, the token of its life.

use std::sync::Arc;
use std::time::Instant;

use isotherm_bus::DeclaredKeys;
use isotherm_bus::receipt::Receipt;
use isotherm_protocol::key::{self, RawStream, UnitId};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::{Query, Queryable};
use zenoh::sample::{Locality, Sample, SampleKind};
use zenoh::{Session, Wait};

use crate::ServiceError;
use crate::intake::{Intake, OutletMaker};
use crate::keeper::{Asked, Bell};
use crate::pulse::Pulse;
use crate::registrar::Desk;
use crate::unit::{Journal, Outlet};

/// Everything that receives.
#[derive(Debug)]
pub(super) struct Declared {
    subscribers: Vec<Subscriber<()>>,
    queryables: Vec<Queryable<()>>,
    receipt: Receipt,
    alive: LivelinessToken,
}

impl Declared {
    /// Declares it; the queryable of the status last of all: where it answers, the service receives.
    pub(super) async fn new(
        session: &Session,
        intake: &Arc<Intake>,
        bell: &Bell,
        desk: &Desk,
        pulse: &Arc<Pulse>,
    ) -> Result<Self, ServiceError> {
        let raw = take(intake, bell, pulse, Intake::receive);
        let reference = take(intake, bell, pulse, Intake::reference);
        let put = desk.clone();
        let receipt = Receipt::declare(session).await?;
        let subscribers = vec![
            subscribe(session, key::ALL_RAW, raw).await?,
            subscribe(session, key::ALL_REFERENCE, reference).await?,
            subscribe(session, key::ALL_CALIBRATION, move |sample| put.put(sample)).await?,
        ];
        let alive = key::service_alive(&session.zid().to_string());
        let token = session.liveliness().declare_token(alive).await;
        let token = token.map_err(|source| ServiceError::Declare { key: key::ALL_SERVICES_ALIVE, source })?;
        let [calibration, command, history] = [(); 3].map(|()| desk.clone());
        let ask = |asked| {
            let bell = bell.clone();
            move |query| bell.ask(asked, query)
        };
        let queryables = vec![
            answer(session, key::ALL_CALIBRATION, move |query| calibration.calibration(query)).await?,
            answer(session, key::ALL_COMMAND, move |query| command.command(query)).await?,
            answer(session, key::ALL_HISTORY, move |query| history.history(query)).await?,
            answer(session, key::ALL_CONFIGURATIONS, ask(Asked::Configuration)).await?,
            answer(session, key::ALL_JOURNALS, ask(Asked::Memory)).await?,
            answer(session, key::ALL_SERVICE_STATUS, ask(Asked::Status)).await?,
            answer(session, key::ALL_STATUS, ask(Asked::Status)).await?,
        ];
        Ok(Self { subscribers, queryables, receipt, alive: token })
    }

    /// Ends it, and waits for what is being received; whether that went well. The token stays until it is dropped: where it goes,
    /// nothing more comes from this service.
    pub(super) fn undeclare(self) -> (bool, LivelinessToken) {
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
fn take(
    intake: &Arc<Intake>,
    bell: &Bell,
    pulse: &Arc<Pulse>,
    receive: fn(&Intake, &str, Option<&[u8]>, Instant) -> bool,
) -> impl Fn(Sample) + Send + Sync + 'static {
    let (intake, bell, pulse) = (Arc::clone(intake), bell.clone(), Arc::clone(pulse));
    move |sample| {
        let arrival = Instant::now();
        let _in_hand = pulse.take(arrival);
        let bytes = sample.payload().to_bytes();
        let frame = (sample.kind() == SampleKind::Put).then_some(&*bytes);
        if receive(&intake, sample.key_expr().as_str(), frame, arrival) {
            bell.status_due();
        }
    }
}

async fn subscribe(
    session: &Session,
    key: &'static str,
    callback: impl Fn(Sample) + Send + Sync + 'static,
) -> Result<Subscriber<()>, ServiceError> {
    let subscriber = session.declare_subscriber(key).allowed_origin(Locality::Remote).callback(callback);
    subscriber.await.map_err(|source| ServiceError::Declare { key, source })
}

async fn answer(
    session: &Session,
    key: &'static str,
    callback: impl Fn(Query) + Send + Sync + 'static,
) -> Result<Queryable<()>, ServiceError> {
    let queryable = session.declare_queryable(key).callback(callback);
    queryable.await.map_err(|source| ServiceError::Declare { key, source })
}
