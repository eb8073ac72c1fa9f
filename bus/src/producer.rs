//! Publishing raw batches in the order that the service needs, without outrunning it.

use std::time::Duration;

use isotherm_correction::sample::{AccelTick, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::Timestamp;
use isotherm_protocol::codec::{self, MAX_TICKS};
use isotherm_protocol::key::{self, Input, RawStream, UnitId};
use isotherm_protocol::raw::{Batcher, HealthBatch, HealthReading, HealthTick, RawFrame};
use zenoh::Session;

use crate::BusError;
use crate::outlet::{GyroTicks, Outlet, OutletOptions, least_in_flight, new_series};

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
        let min = least_in_flight(batch);
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
    outlet: Outlet,
    batcher: Batcher,
    sent: u64,
    /// Number of this producer's run.
    series: u64,
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
        let ProducerOptions { batch_ticks, max_in_flight, match_timeout, acknowledge_timeout } = options;
        let options = OutletOptions { max_in_flight, match_timeout, acknowledge_timeout };
        let mut outlet = Outlet::declare(session, unit, options).await?;
        for stream in RawStream::ALL {
            outlet.open(Input::Raw(stream)).await?;
        }
        Ok(Self { outlet, batcher: Batcher::new(batch_ticks), sent: 0, series: new_series() })
    }

    /// Takes one gyro tick. It is sent in this producer's own series: what another one of the same unit sent before, in
    /// this process or another, does not go on with it.
    ///
    /// # Errors
    /// [`BusError::Batch`], [`BusError::Put`], [`BusError::NoAcknowledgement`]: what is ready behind it goes out with the next call.
    pub async fn gyro(&mut self, output: OutputKind, mut tick: GyroTick) -> Result<(), BusError> {
        tick.series = self.series;
        self.batcher.gyro(output, tick);
        self.publish_ready().await
    }

    /// Takes one accelerometer tick.
    ///
    /// # Errors
    /// As [`Producer::gyro`].
    pub async fn accel(&mut self, output: OutputKind, tick: AccelTick) -> Result<(), BusError> {
        self.batcher.accel(output, tick);
        self.publish_ready().await
    }

    /// Takes temperature readings.
    ///
    /// # Errors
    /// As [`Producer::gyro`].
    pub async fn temperatures(&mut self, readings: &[TemperatureReading]) -> Result<(), BusError> {
        for reading in readings {
            self.batcher.temperature(*reading);
        }
        self.publish_ready().await
    }

    /// Publishes what the instrument reports of itself at a time, at once: readings have no batch to wait for.
    ///
    /// # Errors
    /// [`BusError::Encode`] and [`BusError::Put`].
    pub async fn health(&mut self, time: Timestamp, readings: &[HealthReading]) -> Result<(), BusError> {
        let tick = HealthTick { time_ns: time.as_ns(), readings: readings.to_vec() };
        let frame = codec::encode(&HealthBatch { ticks: vec![tick] }).map_err(|source| BusError::Encode {
            key: key::raw(self.outlet.unit(), RawStream::Health),
            source,
        })?;
        self.outlet.publish(Input::Raw(RawStream::Health), frame).await
    }

    /// Publishes everything that was handed over, full batch or not.
    ///
    /// # Errors
    /// As [`Producer::gyro`].
    pub async fn flush(&mut self) -> Result<(), BusError> {
        self.batcher.flush();
        self.publish_ready().await
    }

    /// Waits until every tick sent has come back, at most the acknowledge timeout without progress.
    ///
    /// The last ticks come back when the service has noticed by the clock that the stream has stopped. Without
    /// `max_in_flight` there is nothing to wait for.
    ///
    /// # Errors
    /// [`BusError::NoAcknowledgement`].
    pub async fn drain(&mut self) -> Result<(), BusError> {
        self.outlet.drain().await
    }

    /// Gyro ticks published so far.
    #[must_use]
    pub fn sent(&self) -> u64 {
        self.sent
    }

    /// Gyro ticks published and not come back; 0 without `max_in_flight`.
    #[must_use]
    pub fn in_flight(&self) -> u64 {
        self.outlet.in_flight()
    }

    /// Publishes the frames that are ready, up to a batch that cannot be one.
    async fn publish_ready(&mut self) -> Result<(), BusError> {
        while let Some(ready) = self.batcher.next_frame() {
            let refused = |source| BusError::Batch { unit: self.outlet.unit().clone(), source };
            let RawFrame { stream, frame, first_sequence, ticks, .. } = ready.map_err(refused)?;
            if stream == RawStream::Gyro {
                let ticks = GyroTicks { series: self.series, first: first_sequence, count: ticks };
                self.outlet.publish_gyro(frame, ticks).await?;
                self.sent += ticks.count;
            } else {
                self.outlet.publish(Input::Raw(stream), frame).await?;
            }
        }
        Ok(())
    }
}
