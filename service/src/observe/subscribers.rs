//! Subscribers that are behind: Zenoh drops what they have no room for, and tells nobody.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use isotherm_bus::receipt::{Behind, behind};
use isotherm_protocol::status::Fault;
use tokio::task::JoinHandle;
use tokio::time::{MissedTickBehavior, interval};
use zenoh::Session;

use crate::receive::fault::standing;
use crate::receive::intake::lock;

/// How often receipts are asked for.
const INTERVAL: Duration = Duration::from_secs(2);
/// Who has not taken within this what was published is behind.
const LIMIT: Duration = Duration::from_secs(1);

/// Kind of the fault of a subscriber that is behind.
pub(super) const BEHIND: &str = "subscriber_behind";

/// The subscriber that was behind last, in words, with the number of all receipts that came late.
#[derive(Debug, Default)]
pub(crate) struct Subscribers(Mutex<Option<Fault>>);

impl Subscribers {
    /// Asks for receipts for as long as the task lives.
    pub(crate) fn watch(self: &Arc<Self>, session: &Session) -> JoinHandle<()> {
        let (subscribers, session) = (Arc::clone(self), session.clone());
        tokio::spawn(async move {
            let mut told = BTreeSet::new();
            let mut ticks = interval(INTERVAL);
            ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
            while !session.is_closed() {
                ticks.tick().await;
                let late = behind(&session, LIMIT).await;
                for of in late.iter().filter(|of| !told.contains(&of.session)) {
                    tracing::warn!("{}", words(of));
                }
                told = late.iter().map(|of| of.session.clone()).collect();
                subscribers.note(&late);
            }
        })
    }

    fn note(&self, behind: &[Behind]) {
        let mut latest = lock(&self.0);
        for of in behind {
            let receipts = latest.as_ref().map_or(0, |fault| fault.count) + 1;
            *latest = Some(standing(BEHIND, receipts, words(of)));
        }
    }

    /// The subscriber that was behind last, if there was one.
    pub(crate) fn fault(&self) -> Option<Fault> {
        lock(&self.0).clone()
    }
}

fn words(behind: &Behind) -> String {
    format!(
        "subscriber {} at {} has not read everything within {} s: until it catches up ticks are dropped for it, or \
         with `congestion = \"block\"` its connection is closed; check its sequence numbers, its load and its link",
        behind.session,
        behind.at,
        LIMIT.as_secs()
    )
}
