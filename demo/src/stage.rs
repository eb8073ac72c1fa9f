//! The service and the subscriber: what is there before the first tick and after the last one.

use std::sync::Arc;
use std::time::Duration;

use isotherm_bus::{Consumer, SessionOptions, presence};
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
            calibrations.insert(member.id.clone(), Arc::clone(&member.calibration), member.digest);
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
            let status = presence::status(&self.session, &member.id, ANSWER_LIMIT).await;
            let status = status.ok_or_else(|| DemoError::Status(member.id.clone()))?;
            latencies.push([status.latency.p50_ns, status.latency.p99_ns]);
        }
        Ok(latencies)
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
