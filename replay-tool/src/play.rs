//! Playing a log to the raw topics.

use std::time::Duration;

use isotherm_bus::{Consumer, Continuity, Producer, ProducerOptions, SessionOptions, presence};
use isotherm_correction::sample::GyroTick;
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::raw::HealthReading;
use serde::Serialize;
use tokio::signal::unix::{SignalKind, signal};
use tokio::time::{Instant, timeout};

use crate::error::Error;
use crate::pace::{Pacer, Speed};
use isotherm_log::text::{LogError, LogEvent};

/// How long a wait for the service, or for the last ticks, may take without progress.
const PATIENCE: Duration = Duration::from_secs(10);
/// How often health readings go out, in event time.
const HEALTH_INTERVAL: Span = Span::from_ms(1000);
/// How long a session may take to close.
const CLOSE_LIMIT: Duration = Duration::from_secs(5);

/// How a log is played.
#[derive(Debug, Clone)]
pub struct PlayOptions {
    /// The unit that the log is played as.
    pub unit: UnitId,
    /// How the session is opened.
    pub session: SessionOptions,
    /// How fast.
    pub speed: Speed,
    /// Gyro ticks in one batch (1…4096).
    pub batch_ticks: usize,
    /// Most gyro ticks sent and not come back; `None` plays without a service that answers.
    pub max_in_flight: Option<u64>,
    /// What the instrument is to report of itself, once a second of event time; a log has no such readings.
    pub health: Vec<HealthReading>,
}

/// What playing came to.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct PlayReport {
    /// Serial of the unit.
    pub unit: String,
    /// Gyro ticks sent.
    pub ticks_sent: u64,
    /// Accelerometer ticks sent.
    pub accel_ticks_sent: u64,
    /// Temperature readings sent.
    pub temperature_readings_sent: u64,
    /// Gyro ticks that the log itself does not have.
    pub log_gaps: u64,
    /// Gyro ticks that came back corrected; `None` without acknowledgement.
    pub ticks_acknowledged: Option<u64>,
    /// Gyro ticks that the service announced as missing, those that the log does not have among them.
    pub ticks_announced_missing: Option<u64>,
    /// Gyro ticks that came back as they were, because the service has no calibration for the unit.
    pub ticks_uncalibrated: Option<u64>,
    /// Gyro ticks sent that did not come back.
    pub ticks_lost: Option<u64>,
    /// Gyro ticks that came back more than once.
    pub ticks_duplicated: Option<u64>,
    /// Times that the unit's corrected stream began anew meanwhile: other than 0 only where somebody else plays the unit.
    pub restarts: Option<u64>,
    /// Time that the played part of the log covers (s).
    pub log_s: f64,
    /// Time that playing it took (s).
    pub elapsed_s: f64,
    /// How many times as fast as recorded.
    pub actual_speed: f64,
    /// The longest that a batch was late (s); 0 at `max`.
    pub latest_s: f64,
    /// Playing was stopped by a signal.
    pub stopped: bool,
}

/// What is known of the sent ticks.
#[derive(Debug, Default)]
struct Sent {
    report: PlayReport,
    last_sequence: Option<u64>,
    beginning: Option<Timestamp>,
}

/// Plays events to the raw topics of a unit.
///
/// `watch` is called after every gyro tick with the report so far.
///
/// # Errors
/// [`Error::Log`] for the first event that cannot be read, [`Error::Bus`] where the service is missing or falls silent.
pub async fn play(
    events: impl Iterator<Item = Result<LogEvent, LogError>>,
    options: &PlayOptions,
    watch: impl FnMut(&PlayReport),
) -> Result<PlayReport, Error> {
    let session = isotherm_bus::open(&options.session).await?;
    let played = play_on(&session, events, options, watch).await;
    let closed = isotherm_bus::close(session, CLOSE_LIMIT).await;
    let report = played?;
    closed?;
    Ok(report)
}

/// Plays on an open session.
async fn play_on(
    session: &zenoh::Session,
    events: impl Iterator<Item = Result<LogEvent, LogError>>,
    options: &PlayOptions,
    mut watch: impl FnMut(&PlayReport),
) -> Result<PlayReport, Error> {
    let mut consumer = match options.max_in_flight {
        Some(_) => Some(Consumer::declare(session, Some(&options.unit)).await?),
        None => None,
    };
    let producer = ProducerOptions {
        batch_ticks: options.batch_ticks,
        max_in_flight: options.max_in_flight,
        match_timeout: PATIENCE,
        acknowledge_timeout: PATIENCE,
    };
    let mut producer = Producer::declare(session, &options.unit, producer).await?;
    if consumer.is_some() {
        // Behind every declaration above: no first tick can come back unseen.
        presence::wait_for_service(session, PATIENCE).await?;
    }
    let mut sent = Sent::default();
    sent.report.unit = options.unit.to_string();
    let mut pacer = Pacer::new(options.speed);
    let mut health_due = None;
    let begun = Instant::now();
    let mut stop = std::pin::pin!(stop_asked()?);
    for event in events {
        match event? {
            LogEvent::Gyro { output, tick } => {
                tokio::select! {
                    biased;
                    () = &mut stop => {
                        sent.report.stopped = true;
                        break;
                    }
                    () = pacer.wait(tick.end_time) => {}
                }
                if !options.health.is_empty() && health_due.is_none_or(|due| tick.end_time >= due) {
                    producer.health(tick.end_time, &options.health).await?;
                    health_due = Some(tick.end_time + HEALTH_INTERVAL);
                }
                sent.note(&tick);
                producer.gyro(output, tick).await?;
                while let Some(consumer) = &mut consumer
                    && consumer.try_next().is_some()
                {}
                sent.report.elapsed_s = begun.elapsed().as_secs_f64();
                watch(&sent.report);
            }
            LogEvent::Accel { output, tick } => {
                sent.report.accel_ticks_sent += 1;
                producer.accel(output, tick).await?;
            }
            LogEvent::Temperature(reading) => {
                sent.report.temperature_readings_sent += 1;
                producer.temperatures(&[reading]).await?;
            }
        }
    }
    producer.flush().await?;
    let elapsed = begun.elapsed();
    if let Some(consumer) = &mut consumer {
        producer.drain().await?;
        collect(consumer, &options.unit, sent.report.ticks_sent).await;
    }
    let account = consumer.as_ref().map(|consumer| consumer.continuity(&options.unit));
    Ok(sent.finish(account.as_ref(), elapsed, pacer.latest()))
}

/// A future that ends with Ctrl-C or a stop signal.
fn stop_asked() -> Result<impl Future<Output = ()>, Error> {
    let listen = |kind| signal(kind).map_err(|source| Error::Runtime { source });
    let (mut interrupt, mut terminate) = (listen(SignalKind::interrupt())?, listen(SignalKind::terminate())?);
    Ok(async move {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
        }
    })
}

/// Takes what has come back and is still queued here.
async fn collect(consumer: &mut Consumer, unit: &UnitId, sent: u64) {
    // Frames that the producer has seen acknowledged are queued here already, or about to be.
    while acknowledged(&consumer.continuity(unit)) < sent {
        match timeout(Duration::from_secs(2), consumer.next()).await {
            Ok(Some(_)) => {}
            Ok(None) | Err(_) => return,
        }
    }
}

/// Ticks that have come back, each counted once.
fn acknowledged(account: &Continuity) -> u64 {
    account.ticks.saturating_sub(account.duplicated)
}

impl Sent {
    /// Notes a gyro tick that is being sent.
    fn note(&mut self, tick: &GyroTick) {
        self.report.ticks_sent += 1;
        if let Some(last) = self.last_sequence.replace(tick.sequence) {
            self.report.log_gaps += tick.sequence.saturating_sub(last.saturating_add(1));
        }
        let beginning = *self.beginning.get_or_insert(tick.end_time - tick.duration);
        self.report.log_s = tick.end_time.seconds_from(beginning);
    }

    /// The report of what was sent and what came back.
    fn finish(self, account: Option<&Continuity>, elapsed: Duration, latest: Duration) -> PlayReport {
        let mut report = self.report;
        report.elapsed_s = elapsed.as_secs_f64();
        report.actual_speed = if report.elapsed_s > 0.0 { report.log_s / report.elapsed_s } else { 0.0 };
        report.latest_s = latest.as_secs_f64();
        if let Some(account) = account {
            let back = acknowledged(account);
            report.ticks_acknowledged = Some(back);
            report.ticks_announced_missing = Some(account.announced_missing);
            report.ticks_duplicated = Some(account.duplicated);
            report.restarts = Some(account.restarts);
            report.ticks_uncalibrated = Some(account.uncalibrated);
            report.ticks_lost = Some(report.ticks_sent.saturating_sub(back));
        }
        report
    }
}

impl PlayReport {
    /// Whether a tick that was sent did not come back.
    #[must_use]
    pub fn lost_data(&self) -> bool {
        self.ticks_lost.is_some_and(|lost| lost > 0)
    }
}
