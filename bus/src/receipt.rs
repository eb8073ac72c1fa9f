//! Receipts: proof that subscribers have what was sent to them.
//!
//! Zenoh (1.10) does not write out everything when a session is closed: where a peer is slow to take what is on its way, the batch that
//! is being written is given up, with everything behind it, and the close says that all is well. A query travels behind what was published
//! before it at the same priority; once a subscriber's session has let the query go, it has taken everything.

use std::collections::BTreeMap;
use std::time::Duration;

use isotherm_protocol::key;
use zenoh::handlers::DefaultHandler;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::{ConsolidationMode, QueryTarget, Queryable};
use zenoh::sample::Locality;
use zenoh::session::SessionGetBuilder;
use zenoh::{Session, Wait};

use crate::BusError;

/// Has a session answer that it has taken what was sent to it, for as long as this is kept.
#[derive(Debug)]
pub struct Receipt {
    _queryable: Queryable<()>,
}

impl Receipt {
    /// Begins to give receipts. Declared before the subscriptions: who knows of those is to know of it.
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
/// # Errors
/// [`BusError::NotTaken`] after `limit`; [`BusError::Declare`] where the session is closed.
pub async fn all_taken(session: &Session, limit: Duration) -> Result<(), BusError> {
    let session = session.clone();
    // On a thread of its own: where the queue of a slow subscriber is full, the query itself waits for a place in it.
    let asking = tokio::task::spawn_blocking(move || ask(&session, limit));
    match tokio::time::timeout(limit, asking).await {
        Ok(Ok(taken)) => taken,
        Ok(Err(_)) | Err(_) => Err(not_taken(limit)),
    }
}

/// Asks for the receipts and waits for the end of the query.
fn ask(session: &Session, limit: Duration) -> Result<(), BusError> {
    let replies = question(session, key::ALL_RECEIPTS, limit)
        .congestion_control(CongestionControl::Block)
        .wait()
        .map_err(|source| BusError::Declare { key: key::ALL_RECEIPTS.to_owned(), source })?;
    // It ends once everybody has let it go, or is not there any more. Zenoh itself replies for those who have not in time.
    if replies.into_iter().any(|reply| reply.result().is_err()) { Err(not_taken(limit)) } else { Ok(()) }
}

/// A question that travels behind what was published, to all who give receipts on a key.
fn question<'a>(
    session: &'a Session,
    key: &'a str,
    limit: Duration,
) -> SessionGetBuilder<'a, 'a, DefaultHandler> {
    session
        .get(key)
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .allowed_destination(Locality::Remote)
        .priority(Priority::RealTime)
        .timeout(limit)
}

/// A session that gives receipts and is behind.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Behind {
    /// Its Zenoh id.
    pub session: String,
    /// Where it is: the other end of a link to it.
    pub at: String,
}

/// Who gives receipts, is linked to this session, and has not taken within `limit` what this session has published at
/// [`Priority::RealTime`].
///
/// Zenoh says nothing of what it drops for a subscriber; it drops nothing for one that is not behind. Whoever is behind a router, or gives
/// no receipts, is not noticed.
pub async fn behind(session: &Session, limit: Duration) -> Vec<Behind> {
    let links: Vec<_> = session.info().links().await.collect();
    let mut asked = BTreeMap::new();
    for link in links {
        let name = link.zid().to_string();
        if asked.contains_key(&name) {
            continue;
        }
        // Dropped where its queue is full: then it is behind, and nobody waits for it.
        let key = key::receipt(&name);
        let question = question(session, &key, limit).congestion_control(CongestionControl::Drop);
        // Where the session is closed nobody is asked.
        if let Ok(replies) = question.await {
            asked.insert(name, (link.dst().to_string(), replies));
        }
    }
    let mut behind = Vec::new();
    for (session, (at, replies)) in asked {
        // Each question has a limit of its own, which runs from when it was asked.
        while let Ok(reply) = replies.recv_async().await {
            if reply.result().is_err() {
                behind.push(Behind { session: session.clone(), at: at.clone() });
                break;
            }
        }
    }
    behind
}

fn not_taken(waited: Duration) -> BusError {
    BusError::NotTaken { key: key::ALL_RECEIPTS, waited }
}
