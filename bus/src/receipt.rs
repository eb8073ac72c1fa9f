//! Receipts: proof that subscribers have what was sent to them.
//!
//! Zenoh (1.10) does not write out everything when a session is closed: where a peer is slow to take what is on its way, the batch that
//! is being written is given up, with everything behind it, and the close says that all is well. A query travels behind what was published
//! before it at the same priority; once a subscriber's session has let the query go, it has taken everything.

use std::time::{Duration, Instant};

use isotherm_protocol::key;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::{ConsolidationMode, QueryTarget, Queryable};
use zenoh::sample::Locality;
use zenoh::{Session, Wait};

use crate::BusError;

/// What a session answers with that it has taken what was sent to it; for as long as this is kept.
#[derive(Debug)]
pub struct Receipt {
    _queryable: Queryable<()>,
}

impl Receipt {
    /// Has a session that subscribes give receipts.
    ///
    /// # Errors
    /// [`BusError::Declare`].
    pub async fn declare(session: &Session) -> Result<Self, BusError> {
        let key = key::receipt(&session.zid().to_string());
        // Letting a query go ends it: that is the whole answer. The thread that receives has come this far.
        let queryable = session.declare_queryable(&key).callback(drop).await;
        let queryable = queryable.map_err(|source| BusError::Declare { key, source })?;
        Ok(Self { _queryable: queryable })
    }
}

/// Waits until every subscriber that gives receipts has taken what this session has published at [`Priority::RealTime`].
///
/// Blocks the thread: the queue of a subscriber that is slow may be full.
///
/// # Errors
/// [`BusError::NotTaken`] after `limit`; [`BusError::Declare`] where the session is closed.
pub fn all_taken(session: &Session, limit: Duration) -> Result<(), BusError> {
    let end = Instant::now() + limit;
    let replies = session
        .get(key::ALL_RECEIPTS)
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .allowed_destination(Locality::Remote)
        .congestion_control(CongestionControl::Block)
        .priority(Priority::RealTime)
        .timeout(limit)
        .wait()
        .map_err(|source| BusError::Declare { key: key::ALL_RECEIPTS.to_owned(), source })?;
    loop {
        match replies.recv_deadline(end) {
            // Every one of them has let the query go, or is not there any more.
            Err(_) => return Ok(()),
            Ok(Some(reply)) if reply.result().is_ok() => {}
            // Zenoh itself says that somebody has not answered in time.
            Ok(_) => return Err(BusError::NotTaken { key: key::ALL_RECEIPTS, waited: limit }),
        }
    }
}
