//! Publishing one unit's frames as they are, without outrunning what comes back.

mod intervals;
mod tally;
mod under_way;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use isotherm_protocol::key::{self, Input, RawStream, UnitId};
use zenoh::Session;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};

use crate::{BusError, presence};

pub use tally::Sent;
pub use under_way::UnderWay;

/// How the frames of a unit are published.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutletOptions {
    /// Most gyro ticks sent and not yet come back corrected; `None` does not wait for anything to come back.
    ///
    /// It must be well above what a unit holds inside (pairing window, ticks of a mode switch), or the service flushes
    /// by the clock while the sender waits: at least two batches and 256 ticks; a batch that asks for more raises it.
    pub max_in_flight: Option<u64>,
    /// How long to wait for a subscriber of a raw topic.
    pub match_timeout: Duration,
    /// How long nothing may come back while the bound is reached.
    pub acknowledge_timeout: Duration,
}

/// Consecutive gyro ticks of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GyroTicks {
    /// Number of the run; what is sent anew has a larger one.
    pub series: u64,
    /// Sequence number of the first tick.
    pub first: u64,
    /// How many.
    pub count: u64,
}

/// What became of the gyro ticks of a unit. Every tick sent is back, late, lost, or under way.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Account {
    /// Ticks sent, each counted once.
    pub ticks_sent: u64,
    /// Ticks sent that had been sent before.
    pub ticks_sent_again: u64,
    /// Ticks between the first and the last of a run that were never sent: they are to be announced as missing.
    pub ticks_not_sent: u64,
    /// Ticks that came back, each counted once.
    pub ticks_back: u64,
    /// Ticks sent behind later ones, too late to come back.
    pub ticks_late: u64,
    /// Ticks sent in their order that did not come back though later ones did.
    pub ticks_lost: u64,
    /// Ticks that neither came back nor were passed over.
    pub ticks_under_way: u64,
    /// Ticks that the service announced as missing.
    pub ticks_announced_missing: u64,
    /// Ticks that came back more than once.
    pub ticks_duplicated: u64,
    /// Ticks of a series that was not sent here: somebody else plays the unit.
    pub ticks_of_others: u64,
    /// Ticks that came back as they were, because the unit has no calibration.
    pub ticks_uncalibrated: u64,
    /// Times that what came back began anew.
    pub restarts: u64,
    /// Runs sent.
    pub runs: u64,
}

/// Publishes one unit's frames. Congestion blocks: nothing is dropped on the way out.
#[derive(Debug)]
pub struct Outlet {
    session: Session,
    unit: UnitId,
    options: OutletOptions,
    publishers: [Option<Publisher<'static>>; 5],
    under_way: Option<(Arc<UnderWay>, Subscriber<()>)>,
}

impl Outlet {
    /// Subscribes to what comes back, where that is bounded. Topics are declared when they are opened.
    ///
    /// # Errors
    /// [`BusError::Declare`].
    pub async fn declare(session: &Session, unit: &UnitId, options: OutletOptions) -> Result<Self, BusError> {
        let under_way = match options.max_in_flight {
            Some(_) => Some(UnderWay::declare(session, unit).await?),
            None => None,
        };
        let publishers = [const { None }; 5];
        Ok(Self { session: session.clone(), unit: unit.clone(), options, publishers, under_way })
    }

    /// The unit.
    #[must_use]
    pub fn unit(&self) -> &UnitId {
        &self.unit
    }

    /// Whether a topic has been opened.
    #[must_use]
    pub fn is_open(&self, input: Input) -> bool {
        self.publishers.get(input.index()).is_some_and(Option::is_some)
    }

    /// Declares a topic, and waits until it has a subscriber. Health readings and references wait for none: who listens
    /// to ticks need not listen to these.
    ///
    /// # Errors
    /// [`BusError::Declare`], [`BusError::NoSubscriber`].
    pub async fn open(&mut self, input: Input) -> Result<(), BusError> {
        let key = key::input(&self.unit, input);
        let publisher = self
            .session
            .declare_publisher(key.clone())
            .congestion_control(CongestionControl::Block)
            .priority(Priority::RealTime)
            .await
            .map_err(|source| BusError::Declare { key, source })?;
        if !matches!(input, Input::Raw(RawStream::Health) | Input::Reference) {
            presence::wait_for_subscriber(&publisher, self.options.match_timeout).await?;
        }
        if let Some(place) = self.publishers.get_mut(input.index()) {
            *place = Some(publisher);
        }
        Ok(())
    }

    /// Publishes a frame that is not of gyro ticks, or that is none at all.
    ///
    /// # Errors
    /// As [`Outlet::open`], and [`BusError::Put`].
    pub async fn publish(&mut self, input: Input, frame: impl Into<ZBytes>) -> Result<(), BusError> {
        if !self.is_open(input) {
            self.open(input).await?;
        }
        let Some(Some(publisher)) = self.publishers.get(input.index()) else { return Ok(()) };
        let put = publisher.put(frame).await;
        put.map_err(|source| BusError::Put { key: publisher.key_expr().to_string(), source })
    }

    /// Publishes a frame of gyro ticks, as soon as no more are under way than allowed.
    ///
    /// # Errors
    /// As [`Outlet::publish`], and [`BusError::NoAcknowledgement`].
    pub async fn publish_gyro(
        &mut self,
        frame: impl Into<ZBytes>,
        ticks: GyroTicks,
    ) -> Result<Sent, BusError> {
        let input = Input::Raw(RawStream::Gyro);
        if !self.is_open(input) {
            self.open(input).await?;
        }
        if let Some(limit) = self.options.max_in_flight {
            let limit = limit.max(least_in_flight(ticks.count));
            self.wait_below(limit.saturating_add(1).saturating_sub(ticks.count)).await?;
        }
        let sent = match &self.under_way {
            Some((under_way, _)) => under_way.tally().sent(ticks),
            None => Sent { new: ticks.count, again: 0 },
        };
        self.publish(input, frame).await?;
        Ok(sent)
    }

    /// Waits until every tick sent has come back or been passed over, at most the acknowledge timeout without progress.
    ///
    /// The last ticks come back when the service has noticed by the clock that the stream has stopped. Without
    /// `max_in_flight` there is nothing to wait for.
    ///
    /// # Errors
    /// [`BusError::NoAcknowledgement`].
    pub async fn drain(&self) -> Result<(), BusError> {
        self.wait_below(1).await
    }

    /// Lets so many ticks be under way from now on, where that is bounded.
    pub fn allow(&mut self, max_in_flight: u64) {
        if let Some(limit) = &mut self.options.max_in_flight {
            *limit = max_in_flight;
        }
    }

    /// Gyro ticks sent and not come back; 0 without `max_in_flight`.
    #[must_use]
    pub fn in_flight(&self) -> u64 {
        self.under_way.as_ref().map_or(0, |(under_way, _)| under_way.ticks())
    }

    /// What is under way, to be looked at from elsewhere; `None` without `max_in_flight`.
    #[must_use]
    pub fn under_way(&self) -> Option<Arc<UnderWay>> {
        self.under_way.as_ref().map(|(under_way, _)| Arc::clone(under_way))
    }

    /// What became of the ticks; `None` without `max_in_flight`.
    #[must_use]
    pub fn account(&self) -> Option<Account> {
        self.under_way.as_ref().map(|(under_way, _)| under_way.tally().account())
    }

    async fn wait_below(&self, limit: u64) -> Result<(), BusError> {
        let Some((under_way, _)) = &self.under_way else { return Ok(()) };
        let waited = self.options.acknowledge_timeout;
        under_way.wait_below(limit, waited).await.map_err(|in_flight| {
            let (unit, key) = (self.unit.clone(), key::corrected(&self.unit));
            BusError::NoAcknowledgement { unit, key, waited, in_flight }
        })
    }
}

/// Fewest ticks that must be allowed under way where a batch has so many.
#[must_use]
pub fn least_in_flight(batch_ticks: u64) -> u64 {
    batch_ticks.saturating_mul(2).saturating_add(256)
}

/// A number that no run of the unit had before: the time of the start, which reaches no corrected increment, and a
/// count of those of this process.
#[must_use]
pub fn new_series() -> u64 {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let ns = u64::try_from(now.as_nanos()).unwrap_or(u64::MAX);
    ns.wrapping_add(COUNT.fetch_add(1, Ordering::Relaxed))
}
