//! A service on loopback, in this process, with sessions around it as a bench would have them.

use std::sync::Arc;
use std::time::Duration;

use isotherm_bus::presence::ServiceWatch;
use isotherm_bus::{Consumer, SessionOptions, close, locators, open, presence};
use isotherm_correction::calibration::Calibration;
use isotherm_protocol::corrected::CorrectedTick;
use isotherm_protocol::key::UnitId;
use isotherm_service::control::revision::Calibrations;
use isotherm_service::{RunningService, Settings, Stuck, Totals, start_with};
use zenoh::Session;
use zenoh::qos::CongestionControl;

/// Every wait of a system test ends here at the latest.
pub const LIMIT: Duration = Duration::from_secs(60);

/// A running service, its address, and a consumer of everything it publishes.
#[derive(Debug)]
pub struct Bench {
    service: RunningService,
    consumer_session: Session,
    /// Receives every corrected batch.
    pub consumer: Consumer,
    /// Tells when the service has gone.
    watch: ServiceWatch,
    /// Options with which a further session reaches the service.
    pub options: SessionOptions,
}

impl Bench {
    /// Starts a service with the calibrations given, and subscribes to everything.
    ///
    /// # Panics
    /// Where a session cannot be opened.
    pub async fn start(calibrations: &[(&str, Arc<Calibration>)]) -> Self {
        Self::start_with(Settings::default(), calibrations).await
    }

    /// The same, with these settings.
    ///
    /// # Panics
    /// Where a session cannot be opened.
    pub async fn start_with(settings: Settings, calibrations: &[(&str, Arc<Calibration>)]) -> Self {
        // Nothing may be dropped on the way to this consumer: the tests judge the service, not the loopback.
        Self::start_as(Settings { congestion: CongestionControl::Block, ..settings }, calibrations).await
    }

    /// One that waits for no subscriber, as a service does that corrects live.
    ///
    /// # Panics
    /// Where a session cannot be opened.
    pub async fn start_live(calibrations: &[(&str, Arc<Calibration>)]) -> Self {
        Self::start_as(Settings::default(), calibrations).await
    }

    async fn start_as(settings: Settings, calibrations: &[(&str, Arc<Calibration>)]) -> Self {
        let session = open(&SessionOptions::default()).await.expect("a session on loopback");
        let options = SessionOptions { connect: locators(&session), ..SessionOptions::default() };
        let mut set = Calibrations::default();
        for (unit, calibration) in calibrations {
            set.insert(UnitId::new(unit).expect("a serial"), Arc::clone(calibration), [7; 8]);
        }
        let service = start_with(settings, set, session).await.expect("the service starts");
        let consumer_session = open(&options).await.expect("a session on loopback");
        let consumer = Consumer::declare(&consumer_session, None).await.expect("a subscription");
        presence::wait_for_service(&consumer_session, LIMIT).await.expect("the service is there");
        let watch = ServiceWatch::declare(&consumer_session).await.expect("a watch");
        Self { service, consumer_session, consumer, watch, options }
    }

    /// Receives until `unit` has given out `count` raw ticks.
    ///
    /// # Panics
    /// Where that takes longer than [`LIMIT`].
    pub async fn receive(&mut self, unit: &str, count: u64) -> Vec<CorrectedTick> {
        let mut ticks = Vec::new();
        let receive = async {
            let mut received = 0;
            while received < count {
                let batch = self.consumer.next().await.expect("the session is open");
                if batch.unit == unit {
                    received += batch.ticks.iter().map(|tick| u64::from(tick.ticks)).sum::<u64>();
                    ticks.extend(batch.ticks);
                }
            }
        };
        let in_time = tokio::time::timeout(LIMIT, receive).await;
        assert!(in_time.is_ok(), "{unit}: {} of {count} ticks within {LIMIT:?}", ticks.len());
        ticks
    }

    /// Whether the service's receive path is alive.
    ///
    /// # Errors
    /// What takes too long.
    pub fn receives(&self) -> Result<(), Stuck> {
        self.service.receives()
    }

    /// Stops the service; its totals, and what the consumer received since: all of it, for the service's token goes behind
    /// everything that it has sent.
    ///
    /// # Panics
    /// Where the service does not go, or a session does not close.
    pub async fn stop(mut self) -> (Totals, Vec<(String, CorrectedTick)>) {
        let totals = self.service.stop().await;
        tokio::time::timeout(LIMIT, self.watch.gone()).await.expect("the service goes");
        let mut rest = Vec::new();
        while let Some(batch) = self.consumer.try_next() {
            rest.extend(batch.ticks.into_iter().map(|tick| (batch.unit.clone(), tick)));
        }
        close(self.consumer_session, LIMIT).await.expect("the session closes");
        (totals, rest)
    }
}
