//! From the topics of ROS 2 to the raw topics of a unit.

use std::sync::Arc;

use isotherm_bus::{BusError, Producer, ProducerOptions};
use isotherm_correction::sample::TemperatureReading;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender};
use zenoh::Session;
use zenoh::bytes::ZBytes;

use super::account::Unit;
use crate::feed::{Feeder, Refusal, Ticks};
use crate::name::Gid;

/// Most messages of a unit that wait for the service; a minute at 1 kHz.
const MOST_WAITING: usize = 1 << 16;

/// A message as it came.
#[derive(Debug)]
pub(super) struct Message {
    pub(super) payload: ZBytes,
    pub(super) attachment: Option<ZBytes>,
}

/// What came for a unit.
#[derive(Debug)]
pub(super) enum Arrived {
    Message(Input, Message),
    /// A publisher has left the graph.
    Left(Gid),
}

/// What a message is for.
#[derive(Debug, Clone, Copy)]
pub(super) enum Input {
    Imu,
    /// By its place in the mapping.
    Temperature(usize),
}

/// Way of what comes to the unit's task; receive threads must not wait.
#[derive(Debug, Clone)]
pub(super) struct Queue {
    sender: UnboundedSender<Arrived>,
    unit: Arc<Unit>,
}

impl Queue {
    pub(super) fn new(sender: UnboundedSender<Arrived>, unit: Arc<Unit>) -> Self {
        Self { sender, unit }
    }

    pub(super) fn push(&self, arrived: Arrived) {
        let waiting = self.unit.wait();
        if let Arrived::Message(input, _) = &arrived
            && waiting > MOST_WAITING
        {
            self.unit.waited();
            self.unit.refuse(*input, &Refusal::QueueFull { waiting: MOST_WAITING });
            return;
        }
        // The task is gone at the end only; then nobody wants it.
        let _ = self.sender.send(arrived);
    }
}

/// Feeds the unit until its end.
pub(super) async fn feed(unit: Arc<Unit>, bus: Session, mut queue: UnboundedReceiver<Arrived>) {
    let mut way = Way { feeder: Feeder::new(&unit.mapping), producer: None, unit, bus };
    let unit = Arc::clone(&way.unit);
    let mut ending = false;
    loop {
        let arrived = if ending {
            // Everything that came before the end is in the queue.
            queue.try_recv().ok()
        } else {
            tokio::select! {
                arrived = queue.recv() => arrived,
                () = unit.end.notified() => {
                    ending = true;
                    continue;
                }
            }
        };
        let Some(arrived) = arrived else { return };
        unit.waited();
        way.take(arrived).await;
    }
}

/// What the task has.
struct Way {
    feeder: Feeder,
    /// One for each run.
    producer: Option<Producer>,
    unit: Arc<Unit>,
    bus: Session,
}

impl Way {
    async fn take(&mut self, arrived: Arrived) {
        let (input, Message { payload, attachment }) = match arrived {
            Arrived::Message(input, message) => (input, message),
            Arrived::Left(gid) => return self.feeder.left(&gid),
        };
        let (payload, attachment) = (payload.to_bytes(), attachment.as_ref().map(ZBytes::to_bytes));
        let attachment = attachment.as_deref();
        let sent = match input {
            Input::Imu => match self.feeder.imu(&payload, attachment) {
                Ok(ticks) => {
                    self.unit.take(&ticks);
                    self.send(ticks).await
                }
                Err(refusal) => return self.unit.refuse(input, &refusal),
            },
            Input::Temperature(index) => match self.feeder.temperature(index, &payload, attachment) {
                Ok(reading) => {
                    self.unit.count(|totals| totals.temperature_in += 1);
                    self.send_temperature(reading).await
                }
                Err(refusal) => return self.unit.refuse(input, &refusal),
            },
        };
        self.judge(sent);
    }

    /// Counts what could not be sent; the first is logged.
    fn judge(&self, sent: Result<(), BusError>) {
        let Err(error) = sent else { return };
        let mut first = false;
        self.unit.count(|totals| {
            totals.unsent += 1;
            first = totals.unsent == 1;
        });
        if first {
            let unit = self.unit.id().as_str();
            tracing::error!(unit, "readings do not reach a service: {error}; further ones are only counted");
        }
    }

    async fn send(&mut self, ticks: Ticks) -> Result<(), BusError> {
        let Ticks { restart, output, gyro, accel, .. } = ticks;
        if restart && let Some(mut producer) = self.producer.take_if(|producer| producer.sent() > 0) {
            // The next one has a series of its own: neither number nor time goes on.
            producer.flush().await?;
        }
        let producer = self.producer().await?;
        if let Some((output, tick)) = accel {
            producer.accel(output, tick).await?;
        }
        producer.gyro(output, gyro).await
    }

    async fn send_temperature(&mut self, reading: Option<TemperatureReading>) -> Result<(), BusError> {
        let Some(reading) = reading else { return Ok(()) };
        self.producer().await?.temperatures(&[reading]).await
    }

    /// The producer of the present run; it waits for a service.
    async fn producer(&mut self) -> Result<&mut Producer, BusError> {
        let producer = match self.producer.take() {
            Some(producer) => producer,
            None => Producer::declare(&self.bus, self.unit.id(), ProducerOptions::default()).await?,
        };
        Ok(self.producer.insert(producer))
    }
}
