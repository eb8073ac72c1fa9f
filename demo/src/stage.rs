//! The service and the subscriber: what is there before the first tick and after the last one.

use std::sync::Arc;
use std::time::Duration;

use isotherm_bus::{Consumer, SessionOptions, presence};
use isotherm_protocol::codec;
use isotherm_protocol::document::Document;
use isotherm_protocol::key;
use isotherm_protocol::status::Status;
use zenoh::Session;

use isotherm_service::control::revision::Calibrations;
use isotherm_service::{RunningService, Settings, start_with};

use super::fleet::Member;
use super::{CLOSE_LIMIT, DemoError};

/// How long the service may take to answer.
const ANSWER_LIMIT: Duration = Duration::from_secs(5);

/// Service and subscriber, connected.
pub(crate) struct Stage {
    service: RunningService,
    session: Session,
    pub(crate) consumer: Consumer,
}

impl Stage {
    /// Starts the service with the shipped calibrations, and subscribes to all units from a session of its own.
    pub(crate) async fn open(fleet: &[Member]) -> Result<Self, DemoError> {
        let mut calibrations = Calibrations::default();
        for member in fleet {
            let shipped = member.kind.document();
            let parsed = Document::parse(shipped.text, Some(shipped.file)).map_err(DemoError::Document)?;
            let digest = parsed.digest.first_chunk().copied().unwrap_or_default();
            calibrations.insert(member.id.clone(), Arc::new(parsed.calibration), digest);
        }
        let settings = Settings::default();
        let session = isotherm_bus::open(&settings.zenoh.session).await?;
        let service = start_with(settings, calibrations, session).await?;
        let session = isotherm_bus::open(&connect(&service)).await?;
        let consumer = Consumer::declare(&session, None).await?;
        presence::wait_for_service(&session, ANSWER_LIMIT).await?;
        Ok(Self { service, session, consumer })
    }

    /// How a producer reaches the service.
    pub(crate) fn connect(&self) -> SessionOptions {
        connect(&self.service)
    }

    /// Median and 99th percentile of the latency that the service added (ns), from each unit's status.
    pub(crate) async fn added_latencies(&self, fleet: &[Member]) -> Result<Vec<[u64; 2]>, DemoError> {
        let mut latencies = Vec::new();
        for member in fleet {
            let status = self
                .status(member)
                .await
                .map_err(|reason| DemoError::Status { unit: member.id.to_string(), reason })?;
            latencies.push([status.latency.p50_ns, status.latency.p99_ns]);
        }
        Ok(latencies)
    }

    async fn status(&self, member: &Member) -> Result<Status, String> {
        let replies = self
            .session
            .get(key::status(&member.id))
            .timeout(ANSWER_LIMIT)
            .await
            .map_err(|error| error.to_string())?;
        let reply = replies.recv_async().await.map_err(|_| "the service does not answer".to_owned())?;
        let sample = reply.result().map_err(|error| format!("the service refuses: {error}"))?;
        codec::decode(&sample.payload().to_bytes()).map_err(|error| error.to_string())
    }

    /// Ends the subscription, then the service.
    pub(crate) async fn close(self) -> Result<(), DemoError> {
        drop(self.consumer);
        isotherm_bus::close(self.session, CLOSE_LIMIT).await?;
        let totals = self.service.stop().await;
        if totals.stopped_in_time { Ok(()) } else { Err(DemoError::Stop) }
    }
}

/// Connects to the service's own endpoints.
fn connect(service: &RunningService) -> SessionOptions {
    SessionOptions { connect: isotherm_bus::locators(service.session()), ..SessionOptions::default() }
}
