//! The service as a whole: start it on a session, stop it within its time.

pub(crate) mod declare;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;

use isotherm_bus::{BoxFuture, receipt};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::status::Status;
use tokio::task::JoinHandle;
use tokio::time::Instant;
use zenoh::Session;

use crate::ServiceError;
use crate::config::Settings;
use crate::control::revision::Calibrations;
use crate::control::store::{Loss, Store};
use crate::control::watch::{Known, Watcher};
use crate::control::{Inbox, Message, SwapManager, Worker};
use crate::observe::instance::Instance;
use crate::observe::metrics::{Endpoint, Source};
use crate::observe::status_publisher::StatusPublisher;
use crate::observe::totals::Totals;
use crate::observe::web::Web;
use crate::pair::{Asker, Pair, Watch};
use crate::receive::intake::Intake;
use crate::receive::pulse::{Pulse, Stuck};
use crate::receive::unit::UnitActor;
use crate::signing::doubts;
use declare::Declared;

/// The part of the time for a stop that is kept for closing the session, one in so many.
const CLOSE_SHARE: u32 = 10;

/// A service at work. Dropping it without [`RunningService::stop`] ends it without flushing.
#[derive(Debug)]
pub struct RunningService {
    session: Session,
    settings: Settings,
    intake: Arc<Intake>,
    pulse: Arc<Pulse>,
    watcher: Option<Watcher>,
    declared: Declared,
    status_publisher: StatusPublisher,
    swap_manager: SwapManager,
    inbox: Inbox,
    pair: Watch,
    metrics: Option<Endpoint>,
    asking: JoinHandle<()>,
}

/// Starts the service on a session, with the last good sets of the state folder and the documents of the configured one.
///
/// Every problem of every bad calibration document is logged.
///
/// # Errors
/// [`ServiceError::State`] where the state folder cannot be used; [`ServiceError::NoCalibrations`] where the
/// folder of calibrations cannot be read and [`ServiceError::BadCalibrations`] where a document is bad;
/// [`ServiceError::Metrics`] where the configured address cannot be had; [`ServiceError::Declare`] and
/// [`ServiceError::Thread`].
#[must_use]
pub fn start(
    settings: Settings,
    session: Session,
) -> BoxFuture<'static, Result<RunningService, ServiceError>> {
    Box::pin(async move {
        tell_state(&settings);
        start_with(settings, Calibrations::default(), session).await
    })
}

/// Starts the service on a session, with calibrations that need not be documents beside those that are.
///
/// # Errors
/// As [`start`].
#[must_use]
pub fn start_with(
    settings: Settings,
    calibrations: Calibrations,
    session: Session,
) -> BoxFuture<'static, Result<RunningService, ServiceError>> {
    Box::pin(async move {
        let (state, metrics) = open_state(&settings, "its units".to_owned()).await?;
        start_on(settings, calibrations, state, metrics, session).await
    })
}

/// Starts the service with a state folder that is open already, what it had lost, and an endpoint that answers already.
pub(crate) async fn start_on(
    settings: Settings,
    calibrations: Calibrations,
    (store, losses): (Store, Vec<Loss>),
    metrics: Option<Endpoint>,
    session: Session,
) -> Result<RunningService, ServiceError> {
    tell_keys(&settings);
    if settings.zenoh.certified_names && !settings.zenoh.session.has_access_control()? {
        tracing::warn!(
            "certified_names is set, but the Zenoh configuration has no access control: anyone who connects may use \
             any name"
        );
    }
    if settings.zenoh.session.uses_tls()? {
        tracing::warn!(
            "over tls/ a connection that carries much both ways may break, or end the service (eclipse-zenoh/zenoh#2557): use \
             a VPN for streams between machines, tls/ for swaps and commands"
        );
    }
    let inbox = Inbox::default();
    let outlets = declare::outlets(session.clone(), settings.congestion);
    let intake = Intake::new(settings.clone(), calibrations.clone(), outlets).reporting_to(inbox.clone());
    let intake = intake.journaling_to(declare::journal(session.clone(), settings.congestion));
    let pair = Arc::new(Pair::join(&settings, &session).await?);
    let intake = Arc::new(intake.paired_with(Arc::clone(&pair)));
    let pulse = Arc::new(Pulse::new(settings.congestion));

    let mut work = Worker::new(&settings, Arc::clone(&intake), store, losses);
    work.take_over(&calibrations);
    work.restore();
    let found = read_folder(&mut work, &settings)?;
    let prepared = intake.prepare();
    tracing::debug!(units = prepared, "publishers and keys of units with a calibration are declared");
    let (of, among) = (Arc::clone(&intake), Arc::clone(&pair));
    let instance = Arc::new(Instance::new(of, among, work.control_status(), settings.digest));
    let swap_manager = SwapManager::start(&inbox, work).map_err(ServiceError::Thread)?;
    let status_publisher = StatusPublisher::start(&session, Arc::clone(&instance), &settings);
    let status_publisher = status_publisher.map_err(ServiceError::Thread)?;
    let watcher = match &settings.calibrations {
        Some(folder) => {
            let inbox = inbox.clone();
            let watcher = Watcher::start(folder, settings.folder, found, move |event| {
                inbox.tell_in_turn(Message::Folder(event));
            });
            Some(watcher.map_err(ServiceError::Thread)?)
        }
        None => None,
    };
    // First to hear the others: what they have published of a tick that comes now is to be known.
    let (questions, _tasks) = Asker::start(&session, &pair, &intake, inbox.clone());
    let watch = Watch::start(&session, &pair, &intake, questions).await?;
    let inputs = (&pair, settings.units.as_slice(), &pulse);
    let declared = Declared::new(&session, &intake, &status_publisher.bell(), &inbox, inputs).await?;
    let web = Web::start(&settings, &session, &intake)?;
    let asking = instance.subscribers.watch(&session);
    if let Some(metrics) = &metrics {
        metrics.open(Source::new(instance, Arc::clone(&pulse)), web);
    }
    Ok(RunningService {
        session,
        settings,
        intake,
        pulse,
        watcher,
        declared,
        status_publisher,
        swap_manager,
        inbox,
        pair: watch,
        metrics,
        asking,
    })
}

/// Opens the state folder, or its stand-in, and answers on the address for metrics as a service that waits for something.
///
/// Who starts a service twice is to read that it runs already, not that a port is taken. No folder is made for a service that cannot
/// have its port.
pub(crate) async fn open_state(
    settings: &Settings,
    waits_for: String,
) -> Result<((Store, Vec<Loss>), Option<Endpoint>), ServiceError> {
    let mut metrics = Endpoint::start(settings, waits_for).await;
    if settings.state.as_deref().is_some_and(|folder| !folder.exists()) {
        metrics = Ok(metrics?);
    }
    let state = open_store(settings.state.as_deref())?;
    Ok((state, metrics?))
}

/// Opens the state folder, or its stand-in.
fn open_store(folder: Option<&Path>) -> Result<(Store, Vec<Loss>), ServiceError> {
    let Some(folder) = folder else { return Ok((Store::in_memory(), Vec::new())) };
    let (store, opened) = Store::open(folder)?;
    for warning in opened.warnings() {
        tracing::warn!("{warning}");
    }
    for loss in &opened.losses {
        tracing::error!("{loss}");
    }
    tracing::info!(folder = %folder.display(), entries = opened.entries, "state folder opened");
    Ok((store, opened.losses))
}

/// Says what a service without a state folder forgets. Who starts one with calibrations of its own, as the demo does, knows it.
pub(crate) fn tell_state(settings: &Settings) {
    if settings.state.is_none() {
        tracing::warn!(
            "no state folder is configured (`state`): swaps and history are lost when the service ends"
        );
    }
}

/// Says what is wrong with the folder of trusted keys: it is read again at each swap, and now is the time to mend it.
fn tell_keys(settings: &Settings) {
    match doubts(&settings.swap) {
        Ok(doubts) => {
            for doubt in &doubts {
                tracing::warn!("{doubt}");
            }
        }
        Err(problems) => {
            for problem in &problems {
                tracing::error!("{problem}");
            }
            tracing::error!("no key is trusted until every *.pub file is valid");
        }
    }
}

/// Reads the configured folder; a bad one is survived, unless a strict start is asked for.
fn read_folder(work: &mut Worker, settings: &Settings) -> Result<Known, ServiceError> {
    let Some(folder) = &settings.calibrations else { return Ok(Known::new()) };
    match work.read_folder() {
        Ok((_, bad)) if settings.strict_start && bad > 0 => Err(ServiceError::BadCalibrations { count: bad }),
        Ok((found, _)) => Ok(found),
        // Without last good sets there is nothing to go on with.
        Err(source) if settings.strict_start || !work.has_units() => {
            Err(ServiceError::NoCalibrations { path: folder.clone(), source })
        }
        Err(error) => {
            work.miss_folder(&error);
            Ok(Known::new())
        }
    }
}

impl RunningService {
    /// Stops receiving, corrects and publishes what was received, waits for the subscribers that give receipts, closes the session; at
    /// most the configured time.
    ///
    /// The session given to [`start`] is closed for whoever else holds it.
    #[must_use]
    pub fn stop(self) -> BoxFuture<'static, Totals> {
        Box::pin(async move {
            let Self {
                session,
                settings,
                intake,
                watcher,
                declared,
                status_publisher,
                swap_manager,
                pair,
                metrics,
                asking,
                ..
            } = self;
            // From here on the stop itself asks.
            asking.abort();
            metrics.iter().for_each(Endpoint::stopping);
            let deadline = Instant::now() + settings.stop_timeout;
            let left = |deadline: Instant| deadline.saturating_duration_since(Instant::now());
            // Each of these may wait: a callback for a slow subscriber, the status publisher for a callback, the swap manager for a disk.
            let units = Arc::clone(&intake);
            let flush = tokio::task::spawn_blocking(move || {
                let (received, alive) = declared.undeclare();
                let paired = pair.stop();
                let kept = status_publisher.stop();
                let watched = watcher.as_ref().is_none_or(Watcher::stop);
                // Last of all: the first ticks of a calibration may have come with the flush.
                let registered = swap_manager.stop();
                units.each_unit(UnitActor::end);
                (received && paired && kept && watched && registered, alive)
            });
            // The token is there until the session is closed: where it goes, nothing more comes.
            let (flushed, _alive) = match tokio::time::timeout_at(deadline, flush).await {
                Ok(Ok((in_order, alive))) => (in_order, Some(alive)),
                Ok(Err(_)) | Err(_) => (false, None),
            };
            let taken = receipt::all_taken(
                &session,
                left(deadline).saturating_sub(settings.stop_timeout / CLOSE_SHARE),
            )
            .await;
            if !flushed {
                tracing::error!("not everything was published within {:?}", settings.stop_timeout);
            }
            let closed = isotherm_bus::close(session, left(deadline)).await;
            for error in [&taken, &closed].into_iter().filter_map(|done| done.as_ref().err()) {
                tracing::error!("{error}");
            }
            if let Some(metrics) = metrics {
                metrics.end().await;
            }
            Totals { stopped_in_time: flushed && taken.is_ok() && closed.is_ok(), ..intake.totals() }
        })
    }

    /// Has the documents of the folder read again, and those judged again that are not taken.
    pub fn reload(&self) {
        tracing::info!("the documents of the folder are read again");
        self.watcher.iter().for_each(Watcher::reread);
        // Where there is no room the documents are judged with what is there.
        let _ = self.inbox.tell(Message::JudgeAgain);
    }

    /// Whether the receive path is alive: messages are done in time, or, where none is there, its threads give signs of life.
    ///
    /// Asks for the sign that the next call will want to see; that no sign comes is noticed 2 s later, 30 s with `congestion = "block"`.
    ///
    /// # Errors
    /// [`Stuck`]: what takes too long.
    pub fn receives(&self) -> Result<(), Stuck> {
        self.pulse.look()
    }

    /// The same, for whoever looks beside the service.
    pub(crate) fn pulse(&self) -> Arc<Pulse> {
        Arc::clone(&self.pulse)
    }

    /// The session that it runs on.
    #[must_use]
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Where metrics and health are served, if they are.
    #[must_use]
    pub fn metrics(&self) -> Option<SocketAddr> {
        self.metrics.as_ref().map(Endpoint::address)
    }

    /// Status of one unit; `None` where it has not appeared.
    #[must_use]
    pub fn status(&self, unit: &UnitId) -> Option<Status> {
        self.intake.status(unit, &self.session.zid().to_string())
    }

    /// The account so far.
    #[must_use]
    pub fn totals(&self) -> Totals {
        self.intake.totals()
    }
}
