//! Recording what is on the bus.
//!
//! ```text
//! receive threads ──▶ queue (bytes bounded, what is beyond is counted) ──▶ one thread that writes
//!                       ▲
//! answers of services ──┘   memory of units, documents, configuration, history: for every file anew
//! ```

mod files;
mod inquiry;
mod queue;
mod report;
mod services;
mod told;
mod topics;
mod writer;

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use isotherm_bus::receipt::Receipt;
use isotherm_bus::{BusError, ClientOptions};
use isotherm_log::recording::RecordingOptions;
use isotherm_protocol::key::UnitId;
use tokio::signal::unix::SignalKind;
use tokio::sync::mpsc::unbounded_channel;
use tokio::time::{Instant, MissedTickBehavior, interval, timeout};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;

use crate::error::Error;
use crate::stop::Stop;
use files::Files;
use inquiry::Question;
use queue::Queue;
use report::{fill, finish};
use services::{await_service, follow_services, note, open, start_asker};
use writer::{FileWriter, Told};

pub(crate) use queue::TopicCount;
pub(crate) use report::{EndedBy, RecordReport};
pub(crate) use topics::{TopicFilter, is_first, key_expressions};
pub(crate) use writer::Bounds;

/// How often the figures are shown.
const WATCH_INTERVAL: Duration = Duration::from_millis(250);
/// How long after the beginning of a file, or of a service, it is asked for everything once more. Links between producers, service
/// and recorder take up to a second or so; what the first memory had heard before the recorder did is in no file.
const ASK_AGAIN: Duration = Duration::from_secs(2);
/// How long the topics must be silent behind the last service's end.
const SILENCE: Duration = Duration::from_millis(500);
/// How long a session may take to close.
const CLOSE_LIMIT: Duration = Duration::from_secs(5);
/// The signal for a file that would be longer than the system allows. Caught, writing fails as on a full disk.
const SIGXFSZ: SignalKind = SignalKind::from_raw(25);

/// Whether a service is needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ServiceWait {
    /// No: only what comes is recorded.
    Without,
    /// It must answer within this time.
    Within(Duration),
    /// It is waited for, however long.
    Forever,
}

/// What is recorded, and how.
#[derive(Debug, Clone)]
pub(crate) struct RecordOptions {
    /// Where it is written to; with rotation, `-0001` and so on is added to the name.
    pub(crate) out: PathBuf,
    /// How the session is opened.
    pub(crate) session: ClientOptions,
    /// Units to record; all where none is given.
    pub(crate) units: Vec<UnitId>,
    /// Topics to record; every kind where none is given.
    pub(crate) topics: Vec<TopicFilter>,
    /// Whether a service is needed.
    pub(crate) service: ServiceWait,
    /// How long a query may take.
    pub(crate) query_limit: Duration,
    /// How long is recorded; until it is stopped where not given.
    pub(crate) duration: Option<Duration>,
    /// Whether recording ends with the last service.
    pub(crate) until_service_stops: bool,
    /// How files are written.
    pub(crate) writing: RecordingOptions,
    /// When chunks and files end.
    pub(crate) bounds: Bounds,
    /// How many files of a row are kept.
    pub(crate) keep: Option<usize>,
    /// What may wait to be written (bytes).
    pub(crate) queue_bytes: u64,
}

/// Records until it is told to stop.
///
/// `watch` is called several times a second with the figures so far.
///
/// # Errors
/// [`Error::Usage`] and [`Error::Log`] where the file cannot be begun, [`Error::Bus`] where the session cannot be opened or
/// no service answers, [`Error::Stopped`] where it was stopped before it began. A disk that is full later is no error: see
/// [`report::Done::failure`].
pub(crate) async fn record(
    options: &RecordOptions,
    mut watch: impl FnMut(&RecordReport),
) -> Result<RecordReport, Error> {
    let rotates = options.bounds.file_bytes.is_some() || options.bounds.file_time.is_some();
    let files = Files::new(&options.out, rotates, options.keep, options.writing.overwrite)?;
    let mut stop = Stop::on(&[SignalKind::interrupt(), SignalKind::terminate()])?;
    let _too_long = Stop::on(&[SIGXFSZ])?;
    let session = open(options, &mut stop).await?;
    let recorded = on_session(&session, options, files, &mut stop, &mut watch).await;
    let closed = isotherm_bus::close(session, CLOSE_LIMIT).await;
    let mut report = recorded?;
    if let Err(error) = closed {
        report.warnings.push(error.to_string());
    }
    Ok(report)
}

/// Records on an open session.
async fn on_session(
    session: &Session,
    options: &RecordOptions,
    files: Files,
    stop: &mut Stop,
    watch: &mut impl FnMut(&RecordReport),
) -> Result<RecordReport, Error> {
    let queue = Arc::new(Queue::new(options.queue_bytes));
    let (tell, mut lives) = unbounded_channel();
    let _receipt = Receipt::declare(session).await?;
    let subscribers = subscribe(session, options, &queue).await?;
    let life = follow_services(session, tell).await?;
    await_service(session, options.service, stop).await?;

    let (tell, mut told) = unbounded_channel();
    let writer = FileWriter::begin(
        Arc::clone(&queue),
        files,
        options.writing,
        options.bounds,
        described(options),
        tell,
    )?;
    let thread = std::thread::Builder::new().name("recording".to_owned()).spawn(move || writer.run());
    let thread = thread.map_err(Error::Runtime)?;

    let begun = Instant::now();
    let (asker, questions, mut answers) = start_asker(session, options, &queue);
    let mut report = RecordReport::default();
    let mut alive = BTreeSet::new();
    let mut ticks = interval(WATCH_INTERVAL);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut silence = Silence::default();
    let mut repeat_from = None;
    let ask = |repeat_from: &mut Option<Instant>| {
        let _ = questions.send(Question::Everything);
        *repeat_from = Some(Instant::now());
    };
    report.ended_by = loop {
        tokio::select! {
            () = stop.asked() => break EndedBy::Signal,
            () = after(options.duration, Some(begun)) => break EndedBy::Duration,
            () = after(Some(ASK_AGAIN), repeat_from) => {
                let _ = questions.send(Question::Everything);
                repeat_from = None;
            }
            Some(told) = told.recv() => match told {
                Told::Begun => ask(&mut repeat_from),
                Told::Warning(words) => report.warnings.push(words),
                Told::Failed => break EndedBy::Failure,
            },
            Some(life) = lives.recv() => {
                if note(life, &mut alive, &mut report) {
                    // It may not have heard of the subscriptions when its first units began.
                    ask(&mut repeat_from);
                }
            }
            Some(words) = answers.recv() => report.warnings.push(words),
            _ = ticks.tick() => {
                fill(&mut report, &queue, begun);
                watch(&report);
                let over = options.until_service_stops && !report.services.is_empty() && alive.is_empty();
                if over && silence.holds(report.received) {
                    break EndedBy::ServiceStop;
                }
            }
        }
    };
    if report.ended_by != EndedBy::Failure {
        // Proves what was recorded since the last memory, and is all there is of a recording that was shorter than the links took.
        let _ = questions.send(Question::Memory);
    }
    drop((questions, life));
    let finished = async {
        // The last file needs its answers as the others do; and what a memory has heard is recorded with it.
        let _ = timeout(options.query_limit, asker).await;
        // What is on its way to a callback comes in before the subscription has ended.
        for subscriber in subscribers {
            let _ = subscriber.undeclare().await;
        }
        queue.close();
        tokio::task::spawn_blocking(move || thread.join()).await
    };
    let done = tokio::select! {
        done = finished => done,
        // Somebody is in a hurry: the file is left as it is, whole up to its last chunk.
        () = stop.asked() => return Err(Error::Stopped),
    };
    while let Ok(words) = answers.try_recv() {
        report.warnings.push(words);
    }
    fill(&mut report, &queue, begun);
    let lost_thread = || Error::Runtime(std::io::Error::other("the writing thread has ended"));
    let done = done.ok().and_then(Result::ok).ok_or_else(lost_thread)?;
    finish(&mut report, done, options.service != ServiceWait::Without);
    Ok(report)
}

/// Subscribes; receive threads only hand over.
async fn subscribe(
    session: &Session,
    options: &RecordOptions,
    queue: &Arc<Queue>,
) -> Result<Vec<Subscriber<()>>, Error> {
    let expressions = Arc::new(key_expressions(&options.topics, &options.units));
    let mut subscribers = Vec::new();
    for (index, keys) in expressions.iter().enumerate() {
        let (queue, expressions) = (Arc::clone(queue), Arc::clone(&expressions));
        let subscriber = session
            .declare_subscriber(keys)
            .callback(move |sample| {
                // A deletion says nothing on these keys.
                if sample.kind() == SampleKind::Put && is_first(&expressions, index, sample.key_expr()) {
                    let payload = sample.payload();
                    // A copy: a part of Zenoh's buffer would hold the whole of it.
                    queue.message(sample.key_expr(), || payload.to_bytes().into_owned(), payload.len());
                }
            })
            .await
            .map_err(|source| BusError::Declare { key: keys.to_string(), source })?;
        subscribers.push(subscriber);
    }
    Ok(subscribers)
}

/// Ends that long after the beginning; never where one of them is not given.
async fn after(duration: Option<Duration>, begun: Option<Instant>) {
    match duration.zip(begun).and_then(|(duration, begun)| begun.checked_add(duration)) {
        Some(end) => tokio::time::sleep_until(end).await,
        None => std::future::pending().await,
    }
}

/// Since when nothing has come.
#[derive(Debug, Default)]
struct Silence(Option<(u64, Instant)>);

impl Silence {
    /// Whether the number has been the same for long enough.
    fn holds(&mut self, received: u64) -> bool {
        let now = Instant::now();
        let (before, since) = *self.0.get_or_insert((received, now));
        if before != received {
            self.0 = Some((received, now));
        }
        before == received && now - since >= SILENCE
    }
}

/// What a recording says of how it was made; nothing of the computer that it was made on.
fn described(options: &RecordOptions) -> Vec<(&'static str, String)> {
    let join = |texts: Vec<String>| if texts.is_empty() { "all".to_owned() } else { texts.join(" ") };
    let topics = key_expressions(&options.topics, &options.units).iter().map(ToString::to_string).collect();
    let Bounds { chunk, file_bytes, file_time } = options.bounds;
    let mut described = vec![
        ("compression", if options.writing.compress { "zstd" } else { "none" }.to_owned()),
        ("chunk_s", chunk.as_secs_f64().to_string()),
        ("units", join(options.units.iter().map(ToString::to_string).collect())),
        ("topics", join(topics)),
        ("with_service", (options.service != ServiceWait::Without).to_string()),
    ];
    described.extend(file_bytes.map(|bytes| ("max_size_bytes", bytes.to_string())));
    described.extend(file_time.map(|time| ("max_duration_s", time.as_secs_f64().to_string())));
    described
}
