//! Publishing raw batches in the order that the service needs, without outrunning it.

mod in_flight;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use isotherm_correction::sample::{AccelTick, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::Timestamp;
use isotherm_protocol::codec::{self, MAX_TICKS};
use isotherm_protocol::key::{self, RawStream, UnitId};
use isotherm_protocol::raw::{BatchError, Batcher, HealthBatch, HealthReading, HealthTick, RawFrame};
use zenoh::Session;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};

use crate::{BusError, presence};
use in_flight::InFlight;

/// How a producer publishes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProducerOptions {
    /// Gyro ticks in one batch (1…4096). Default 1.
    pub batch_ticks: usize,
    /// Most gyro ticks sent and not yet come back corrected; `None` does not wait for anything to come back.
    ///
    /// It must be well above what a unit holds inside (pairing window, ticks of a mode switch), or the service flushes
    /// by the clock while the producer waits: at least two batches and 256 ticks. Default `None`.
    pub max_in_flight: Option<u64>,
    /// How long to wait for a subscriber of every raw topic. Default 10 s.
    pub match_timeout: Duration,
    /// How long nothing may come back while the bound is reached. Default 10 s.
    pub acknowledge_timeout: Duration,
}

impl Default for ProducerOptions {
    fn default() -> Self {
        Self {
            batch_ticks: 1,
            max_in_flight: None,
            match_timeout: Duration::from_secs(10),
            acknowledge_timeout: Duration::from_secs(10),
        }
    }
}

impl ProducerOptions {
    /// Checks the ranges.
    fn check(&self) -> Result<(), BusError> {
        let batch = self.batch_ticks as u64;
        if !(1..=MAX_TICKS as u64).contains(&batch) {
            return Err(BusError::Range { option: "batch_ticks", got: batch, min: 1, max: MAX_TICKS as u64 });
        }
        let min = 2 * batch + 256;
        match self.max_in_flight {
            Some(got) if got < min => {
                Err(BusError::Range { option: "max_in_flight", got, min, max: u64::MAX })
            }
            _ => Ok(()),
        }
    }
}

/// Publishes one unit's raw ticks.
///
/// Ticks and readings are handed over in the order of their times, at equal times temperatures before accelerometer before
/// gyro ticks. A gyro batch goes out when it is full; the temperatures and accelerometer ticks handed over before it go
/// out first. Congestion blocks: nothing is dropped on the way out.
#[derive(Debug)]
pub struct Producer {
    unit: UnitId,
    options: ProducerOptions,
    gyro: Publisher<'static>,
    accel: Publisher<'static>,
    temperature: Publisher<'static>,
    health: Publisher<'static>,
    batcher: Batcher,
    sent: u64,
    /// Number of this producer's run.
    series: u64,
    in_flight: Option<(Arc<InFlight>, Subscriber<()>)>,
}

impl Producer {
    /// Declares the raw topics of `unit` and waits until each has a subscriber.
    ///
    /// # Errors
    /// [`BusError::Range`], [`BusError::Declare`], [`BusError::NoSubscriber`].
    pub async fn declare(
        session: &Session,
        unit: &UnitId,
        options: ProducerOptions,
    ) -> Result<Self, BusError> {
        options.check()?;
        let unheard = async |stream| {
            let key = key::raw(unit, stream);
            session
                .declare_publisher(key.clone())
                .congestion_control(CongestionControl::Block)
                .priority(Priority::RealTime)
                .await
                .map_err(|source| BusError::Declare { key, source })
        };
        let publisher = async |stream| {
            let publisher = unheard(stream).await?;
            presence::wait_for_subscriber(&publisher, options.match_timeout).await?;
            Ok::<_, BusError>(publisher)
        };
        let in_flight = if options.max_in_flight.is_some() {
            Some(InFlight::declare(session, unit).await?)
        } else {
            None
        };
        Ok(Self {
            unit: unit.clone(),
            gyro: publisher(RawStream::Gyro).await?,
            accel: publisher(RawStream::Accel).await?,
            temperature: publisher(RawStream::Temperature).await?,
            // Who listens to ticks need not listen to this.
            health: unheard(RawStream::Health).await?,
            batcher: Batcher::new(options.batch_ticks),
            sent: 0,
            series: new_series(),
            in_flight,
            options,
        })
    }

    /// Takes one gyro tick. It is sent in this producer's own series: what another one of the same unit sent before, in
    /// this process or another, does not go on with it.
    ///
    /// # Errors
    /// [`BusError::NotCounts`], [`BusError::Encode`], [`BusError::Put`], [`BusError::NoAcknowledgement`].
    pub async fn gyro(&mut self, output: OutputKind, mut tick: GyroTick) -> Result<(), BusError> {
        tick.series = self.series;
        let taken = self.batcher.gyro(output, tick);
        self.publish_ready(taken).await
    }

    /// Takes one accelerometer tick.
    ///
    /// # Errors
    /// As [`Producer::gyro`].
    pub async fn accel(&mut self, output: OutputKind, tick: AccelTick) -> Result<(), BusError> {
        let taken = self.batcher.accel(output, tick);
        self.publish_ready(taken).await
    }

    /// Takes temperature readings.
    ///
    /// # Errors
    /// As [`Producer::gyro`].
    pub async fn temperatures(&mut self, readings: &[TemperatureReading]) -> Result<(), BusError> {
        let taken = readings.iter().try_for_each(|reading| self.batcher.temperature(*reading));
        self.publish_ready(taken).await
    }

    /// Publishes what the instrument reports of itself at a time, at once: readings have no batch to wait for.
    ///
    /// # Errors
    /// As [`Producer::gyro`].
    pub async fn health(&mut self, time: Timestamp, readings: &[HealthReading]) -> Result<(), BusError> {
        let tick = HealthTick { time_ns: time.as_ns(), readings: readings.to_vec() };
        let frame = codec::encode(&HealthBatch { ticks: vec![tick] });
        let frame =
            frame.map_err(|source| BusError::Encode { key: self.health.key_expr().to_string(), source })?;
        publish(&self.health, frame).await
    }

    /// Publishes everything that was handed over, full batch or not.
    ///
    /// # Errors
    /// As [`Producer::gyro`].
    pub async fn flush(&mut self) -> Result<(), BusError> {
        let flushed = self.batcher.flush();
        self.publish_ready(flushed).await
    }

    /// Waits until every tick sent has come back, at most the acknowledge timeout without progress.
    ///
    /// The last ticks come back when the service has noticed by the clock that the stream has stopped. Without
    /// `max_in_flight` there is nothing to wait for.
    ///
    /// # Errors
    /// [`BusError::NoAcknowledgement`].
    pub async fn drain(&mut self) -> Result<(), BusError> {
        self.wait_below(1).await
    }

    /// Gyro ticks published so far.
    #[must_use]
    pub fn sent(&self) -> u64 {
        self.sent
    }

    /// Gyro ticks published and not come back; 0 without `max_in_flight`.
    #[must_use]
    pub fn in_flight(&self) -> u64 {
        self.in_flight.as_ref().map_or(0, |(in_flight, _)| in_flight.ticks())
    }

    /// Publishes the frames that are ready, and then tells what was wrong with a tick.
    async fn publish_ready(&mut self, taken: Result<(), BatchError>) -> Result<(), BusError> {
        while let Some(RawFrame { stream, frame, first_sequence, ticks, .. }) = self.batcher.next_frame() {
            match stream {
                RawStream::Gyro => {
                    self.gyro_frame(frame, first_sequence, ticks).await?;
                }
                RawStream::Accel => publish(&self.accel, frame).await?,
                RawStream::Temperature => publish(&self.temperature, frame).await?,
                RawStream::Health => publish(&self.health, frame).await?,
            }
        }
        taken.map_err(|error| match error {
            BatchError::NotCounts { sequence } => BusError::NotCounts { unit: self.unit.clone(), sequence },
            BatchError::Codec(source) => {
                BusError::Encode { key: key::raw(&self.unit, RawStream::Gyro), source }
            }
        })
    }

    async fn gyro_frame(&mut self, frame: Vec<u8>, first: u64, count: u64) -> Result<(), BusError> {
        if let Some(limit) = self.options.max_in_flight {
            self.wait_below(limit.saturating_add(1).saturating_sub(count)).await?;
        }
        if let Some((in_flight, _)) = &self.in_flight {
            in_flight.sent(first, count);
        }
        publish(&self.gyro, frame).await?;
        self.sent += count;
        Ok(())
    }

    async fn wait_below(&self, limit: u64) -> Result<(), BusError> {
        let Some((in_flight, _)) = &self.in_flight else {
            return Ok(());
        };
        in_flight.wait_below(limit, self.options.acknowledge_timeout).await.map_err(|in_flight| {
            BusError::NoAcknowledgement {
                unit: self.unit.clone(),
                key: key::corrected(&self.unit),
                waited: self.options.acknowledge_timeout,
                in_flight,
            }
        })
    }
}

/// A number that no producer of the unit had before: the time of the start, which reaches no corrected increment, and a
/// count of the producers of this process.
fn new_series() -> u64 {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let ns = u64::try_from(now.as_nanos()).unwrap_or(u64::MAX);
    ns.wrapping_add(COUNT.fetch_add(1, Ordering::Relaxed))
}

/// Publishes one frame.
async fn publish(publisher: &Publisher<'_>, frame: Vec<u8>) -> Result<(), BusError> {
    let put = publisher.put(frame).await;
    put.map_err(|source| BusError::Put { key: publisher.key_expr().to_string(), source })
}
