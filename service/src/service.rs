//! The service as a whole: start it on a session, stop it within its time.

use std::sync::Arc;
use std::time::Instant;

use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::status::Status;
use zenoh::pubsub::Subscriber;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::Queryable;
use zenoh::sample::{Locality, SampleKind};
use zenoh::{Session, Wait};

use crate::ServiceError;
use crate::calibrations::Calibrations;
use crate::config::Settings;
use crate::intake::{Intake, OutletMaker};
use crate::keeper::Keeper;
use crate::totals::Totals;
use crate::unit::Outlet;

/// A service at work. Dropping it without [`RunningService::stop`] ends it without flushing.
#[derive(Debug)]
pub struct RunningService {
    session: Session,
    settings: Settings,
    intake: Arc<Intake>,
    subscriber: Subscriber<()>,
    queryable: Queryable<()>,
    keeper: Keeper,
}

/// Starts the service on a session, with the calibrations of the configured folder.
///
/// Every problem of every bad calibration document is logged.
///
/// # Errors
/// [`ServiceError::Read`] where the folder cannot be read, [`ServiceError::BadCalibrations`] where a document is bad and
/// `strict_start` is set, [`ServiceError::Declare`] and [`ServiceError::Thread`].
pub async fn start(settings: Settings, session: Session) -> Result<RunningService, ServiceError> {
    let calibrations = load_calibrations(&settings)?;
    start_with(settings, calibrations, session).await
}

/// Starts the service on a session, with calibrations that need not be files.
///
/// # Errors
/// [`ServiceError::Declare`] and [`ServiceError::Thread`].
pub async fn start_with(
    settings: Settings,
    calibrations: Calibrations,
    session: Session,
) -> Result<RunningService, ServiceError> {
    let outlets = outlets(session.clone(), settings.congestion);
    let intake = Arc::new(Intake::new(settings.clone(), calibrations, outlets));
    let keeper =
        Keeper::start(session.clone(), Arc::clone(&intake), &settings).map_err(ServiceError::Thread)?;

    let (bell, receiving) = (keeper.bell(), Arc::clone(&intake));
    let subscriber = session
        .declare_subscriber(key::ALL_RAW)
        .allowed_origin(Locality::Remote)
        .callback(move |sample| {
            let arrival = Instant::now();
            let bytes = sample.payload().to_bytes();
            let frame = (sample.kind() == SampleKind::Put).then_some(&*bytes);
            if receiving.receive(sample.key_expr().as_str(), frame, arrival) {
                bell.status_due();
            }
        })
        .await
        .map_err(|source| ServiceError::Declare { key: key::ALL_RAW, source })?;

    // The subscription first: where the queryable answers, the service receives.
    let bell = keeper.bell();
    let queryable = session
        .declare_queryable(key::ALL_STATUS)
        .callback(move |query| bell.query(query))
        .await
        .map_err(|source| ServiceError::Declare { key: key::ALL_STATUS, source })?;
    Ok(RunningService { session, settings, intake, subscriber, queryable, keeper })
}

/// Reads the configured folder and logs what is wrong in it.
fn load_calibrations(settings: &Settings) -> Result<Calibrations, ServiceError> {
    let Some(folder) = &settings.calibrations else { return Ok(Calibrations::default()) };
    let (calibrations, bad) = Calibrations::read(folder)?;
    for problem in bad.iter().flat_map(|document| &document.problems) {
        tracing::error!("{problem}");
    }
    if settings.strict_start && !bad.is_empty() {
        return Err(ServiceError::BadCalibrations { count: bad.len() });
    }
    let units: Vec<_> = calibrations.units().map(UnitId::as_str).collect();
    tracing::info!(folder = %folder.display(), units = units.join(" "), bad_documents = bad.len(), "calibrations read");
    Ok(calibrations)
}

/// One declared publisher per unit, at one priority, so that its batches stay in order.
fn outlets(session: Session, congestion: CongestionControl) -> OutletMaker {
    Box::new(move |unit| {
        let publisher = session
            .declare_publisher(key::corrected(unit))
            .congestion_control(congestion)
            .priority(Priority::RealTime)
            .express(false)
            .wait()?;
        let outlet: Outlet = Box::new(move |frame| publisher.put(frame).wait());
        Ok(outlet)
    })
}

impl RunningService {
    /// Stops receiving, corrects and publishes what was received, closes the session; at most the configured time.
    ///
    /// The session given to [`start`] is closed for whoever else holds it.
    pub async fn stop(self) -> Totals {
        let Self { session, settings, intake, subscriber, queryable, keeper } = self;
        let deadline = tokio::time::Instant::now() + settings.stop_timeout;
        // Each of these may wait: a callback for a slow subscriber, the keeper for a callback.
        let flush = tokio::task::spawn_blocking(move || {
            let received = subscriber.undeclare().wait_callbacks().wait();
            let answered = queryable.undeclare().wait();
            let kept = keeper.stop();
            received.is_ok() && answered.is_ok() && kept
        });
        let flushed = matches!(tokio::time::timeout_at(deadline, flush).await, Ok(Ok(true)));
        if !flushed {
            tracing::error!("not everything could be flushed within {:?}", settings.stop_timeout);
        }
        let rest = deadline.saturating_duration_since(tokio::time::Instant::now());
        let closed = isotherm_bus::close(session, rest).await;
        if let Err(error) = &closed {
            tracing::error!("{error}");
        }
        Totals { stopped_in_time: flushed && closed.is_ok(), ..intake.totals() }
    }

    /// The session that it runs on.
    #[must_use]
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Status of one unit; `None` where it has not appeared.
    #[must_use]
    pub fn status(&self, unit: &UnitId) -> Option<Status> {
        self.intake.status(unit)
    }

    /// The account so far.
    #[must_use]
    pub fn totals(&self) -> Totals {
        self.intake.totals()
    }
}
