//! Receiving corrected batches.

use std::collections::BTreeMap;

use isotherm_protocol::codec;
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::key::{self, UnitId};
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};
use zenoh::Session;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Subscriber;

use crate::receipt::Receipt;
use crate::{BusError, Continuity, DeclaredKeys};

/// Receives the corrected batches of one unit or of all, and keeps the account of each unit.
///
/// The receive thread only hands frames over; they are decoded where [`Consumer::next`] is called. The queue between the
/// two has no bound: a consumer that stops calling grows, it never slows the session down.
#[derive(Debug)]
pub struct Consumer {
    frames: UnboundedReceiver<(String, ZBytes)>,
    accounts: BTreeMap<UnitId, Continuity>,
    rejected: u64,
    session: Session,
    // One for each unit heard of.
    keys: DeclaredKeys,
    // A service that stops hears from it that everything has come.
    _receipt: Receipt,
    // Dropping it ends the subscription.
    _subscriber: Subscriber<()>,
}

impl Consumer {
    /// Subscribes to the corrected increments of `unit`, or of all units.
    ///
    /// The subscription takes a moment to reach the service. Who must not miss a first tick calls
    /// [`crate::presence::wait_for_service`] on the same session afterwards: once the service has answered, it knows of
    /// every subscription made before.
    ///
    /// # Errors
    /// [`BusError::Declare`].
    pub async fn declare(session: &Session, unit: Option<&UnitId>) -> Result<Self, BusError> {
        let key = unit.map_or_else(|| key::ALL_CORRECTED.to_owned(), key::corrected);
        let (sender, frames) = unbounded_channel();
        // First: who knows of the subscription knows of the receipt.
        let receipt = Receipt::declare(session).await?;
        let subscriber = session
            .declare_subscriber(&key)
            .callback(move |sample| {
                // The receiver may be gone while the subscription is being ended; then nobody wants the frame.
                let _ = sender.send((sample.key_expr().as_str().to_owned(), sample.payload().clone()));
            })
            .await
            .map_err(|source| BusError::Declare { key, source })?;
        Ok(Self {
            frames,
            accounts: BTreeMap::new(),
            rejected: 0,
            session: session.clone(),
            keys: DeclaredKeys::default(),
            _receipt: receipt,
            _subscriber: subscriber,
        })
    }

    /// The next batch; `None` once the session is closed and everything received before has been taken.
    ///
    /// What is no corrected batch is counted ([`Consumer::rejected`]) and passed over. May be cancelled without losing
    /// a batch.
    pub async fn next(&mut self) -> Option<CorrectedBatch> {
        loop {
            let (key, frame) = self.frames.recv().await?;
            if let Some(batch) = self.take(&key, &frame) {
                return Some(batch);
            }
        }
    }

    /// The next batch that has arrived already, or `None`.
    pub fn try_next(&mut self) -> Option<CorrectedBatch> {
        loop {
            let (key, frame) = self.frames.try_recv().ok()?;
            if let Some(batch) = self.take(&key, &frame) {
                return Some(batch);
            }
        }
    }

    /// Decodes a frame and enters its ticks.
    fn take(&mut self, key: &str, frame: &ZBytes) -> Option<CorrectedBatch> {
        let unit = key::parse_corrected(key).and_then(|serial| UnitId::new(serial).ok());
        let batch = codec::decode::<CorrectedBatch>(&frame.to_bytes()).ok();
        match (unit, batch) {
            (Some(unit), Some(batch)) if batch.unit == unit.as_str() => {
                if !self.accounts.contains_key(&unit) {
                    // Slower without, and nothing else.
                    let _ = self.keys.add(&self.session, key.to_owned());
                }
                let account = self.accounts.entry(unit).or_default();
                batch.ticks.iter().for_each(|tick| account.feed(tick));
                Some(batch)
            }
            _ => {
                self.rejected += 1;
                None
            }
        }
    }

    /// The account of every unit heard of.
    #[must_use]
    pub fn accounts(&self) -> &BTreeMap<UnitId, Continuity> {
        &self.accounts
    }

    /// The account of one unit; empty where nothing came.
    #[must_use]
    pub fn continuity(&self, unit: &UnitId) -> Continuity {
        self.accounts.get(unit).cloned().unwrap_or_default()
    }

    /// Messages that were no corrected batch of the unit that their key names.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }
}
