//! From corrected topics to those of ROS 2.

use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use isotherm_bus::{BusError, Consumer};
use isotherm_log::ros2::to_cdr;
use isotherm_protocol::document::Document;
use isotherm_protocol::key;
use serde::Serialize;
use tokio::sync::Notify;
use zenoh::Session;
use zenoh::pubsub::Publisher;

use super::account::Unit;
use crate::attachment::Attachment;
use crate::name::Gid;
use crate::noise::Noise;
use crate::outgoing::{Unstated, message};
use crate::qos::Qos;

/// How long a service may take to give a document.
const ANSWER: Duration = Duration::from_secs(5);
/// How long to wait until a document is asked for again.
const AGAIN: Duration = Duration::from_secs(1);

/// A publisher of ROS 2.
#[derive(Debug)]
pub(super) struct Outlet {
    publisher: Publisher<'static>,
    gid: Gid,
    sequence: i64,
}

impl Outlet {
    pub(super) async fn declare(
        session: &Session,
        key: String,
        qos: Qos,
        gid: Gid,
    ) -> Result<Self, BusError> {
        let publisher = session.declare_publisher(key.clone()).congestion_control(qos.congestion());
        let publisher = publisher.await.map_err(|source| BusError::Declare { key, source })?;
        Ok(Self { publisher, gid, sequence: 0 })
    }

    /// Publishes a message.
    pub(super) async fn put(&mut self, message: &impl Serialize) -> Result<(), String> {
        let payload = to_cdr(message).map_err(|error| error.to_string())?;
        self.sequence += 1;
        let Self { sequence, gid, .. } = *self;
        let attachment = Attachment { sequence, time_ns: now_ns(), gid };
        let put = self.publisher.put(payload).attachment(attachment.to_bytes()).await;
        put.map_err(|source| isotherm_bus::words(&source))
    }
}

/// Time for ROS: that of the system (ns since 1970-01-01 UTC).
pub(super) fn now_ns() -> i64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(now.as_nanos()).unwrap_or(i64::MAX)
}

/// Publishes what the service has corrected, until the session closes.
pub(super) async fn publish(
    unit: Arc<Unit>,
    mut consumer: Consumer,
    mut outlet: Outlet,
    documents: Arc<Notify>,
) {
    while let Some(batch) = consumer.next().await {
        let (frame_id, mut noise) = unit.outgoing();
        if batch.revision.counter > 0 && noise.digest != batch.revision.digest {
            // Of another calibration: its noise is not known until its document has come.
            noise = Noise::default();
            documents.notify_one();
        }
        for tick in &batch.ticks {
            match message(tick, &unit.mapping, frame_id.clone(), &noise) {
                Ok(imu) => {
                    let put = outlet.put(&imu).await;
                    let mut first = false;
                    unit.count(|totals| {
                        let outcome = if put.is_ok() { &mut totals.imu_out } else { &mut totals.unpublished };
                        *outcome += 1;
                        first = totals.unpublished == 1;
                    });
                    if let Some(error) = put.err().filter(|_| first) {
                        let (unit, topic) = (unit.id().as_str(), &unit.mapping.corrected);
                        tracing::error!(
                            unit,
                            topic,
                            "cannot publish: {error}; further ones are only counted"
                        );
                    }
                }
                Err(Unstated::Uncalibrated) => unit.count(|totals| totals.uncalibrated += 1),
                Err(Unstated::Time) => unit.count(|totals| totals.unpublished += 1),
            }
        }
        if let Some(last) = batch.ticks.last() {
            unit.came_back(last.sequence, &consumer.continuity(unit.id()));
        }
    }
}

/// Asks for the document in force whenever one is wanted.
pub(super) async fn documents(bus: Session, unit: Arc<Unit>, wanted: Arc<Notify>) {
    loop {
        wanted.notified().await;
        if !fetch(&bus, &unit).await {
            tokio::time::sleep(AGAIN).await;
        }
    }
}

/// Learns the noise of the document in force; whether it did.
pub(super) async fn fetch(bus: &Session, unit: &Unit) -> bool {
    let Ok(replies) = bus.get(key::calibration(unit.id())).timeout(ANSWER).await else { return false };
    while let Ok(reply) = replies.recv_async().await {
        let Ok(sample) = reply.into_result() else { continue };
        let Ok(parsed) = Document::parse_bytes(&sample.payload().to_bytes(), None) else { continue };
        unit.know(Noise::of(&parsed.document, parsed.digest.head(), &unit.mapping));
        return true;
    }
    false
}
