//! Who else is there when an instance starts.

use std::time::{Duration, Instant};

use isotherm_bus::client::Way;
use isotherm_bus::{close, connected};
use isotherm_protocol::key;
use isotherm_protocol::pair::Member;
use zenoh::Session;

use crate::ServiceError;
use crate::config::Settings;
use crate::supervisor;

/// How long other instances may take to show themselves.
const LIMIT: Duration = Duration::from_millis(500);
/// How often it is looked whether the other has connected.
const INTERVAL: Duration = Duration::from_millis(20);
/// How long the other may take to connect before that is reported, and before it is given up.
const LONG: Duration = Duration::from_secs(5);
const TOO_LONG: Duration = Duration::from_secs(80);

/// Other instances of the group that are there.
///
/// One of two connects, never both: where one side of a doubled connection notices its end before the other, what it declares later does
/// not arrive (zenoh#2806). Who waits to be connected to therefore asks at the other's address whether there is something to wait for.
pub(super) async fn others(
    settings: &Settings,
    session: &Session,
    group: &str,
) -> Result<Vec<Member>, ServiceError> {
    connected(session, &settings.zenoh.session, LIMIT).await?;
    let Some(other) = &settings.pair.other else { return members(session, group).await };
    supervisor::waiting_for(&format!("the other instance at {other}"));
    let (start, mut told) = (Instant::now(), false);
    loop {
        let is_there = is_there(settings, other, group).await?;
        let again = Instant::now() + LIMIT;
        loop {
            let members = members(session, group).await?;
            if !is_there || !members.is_empty() {
                return Ok(members);
            }
            if Instant::now() > again {
                break;
            }
            tokio::time::sleep(INTERVAL).await;
        }
        if start.elapsed() > TOO_LONG {
            return Err(ServiceError::NotConnected { other: other.clone() });
        }
        if start.elapsed() > LONG && !std::mem::replace(&mut told, true) {
            tracing::warn!(other, "the other instance is there; waiting for it to connect to this one");
        }
    }
}

/// Whether an instance of the group answers at an address.
async fn is_there(settings: &Settings, address: &str, group: &str) -> Result<bool, ServiceError> {
    let way = Way::to(&settings.zenoh.session, address)?;
    if !way.listens().await {
        return Ok(false);
    }
    let visit = match way.open(LIMIT).await {
        Ok(visit) => visit,
        Err(error) => {
            tracing::warn!(address, "what listens where the other instance may be does not answer: {error}");
            return Ok(false);
        }
    };
    let members = members(&visit, group).await;
    if let Err(error) = close(visit, LIMIT).await {
        tracing::debug!("{error}");
    }
    Ok(!members?.is_empty())
}

/// Instances of the group that a session is connected to.
async fn members(session: &Session, group: &str) -> Result<Vec<Member>, ServiceError> {
    let declare = |source| ServiceError::Declare { key: key::ALL_MEMBERS, source };
    let replies = session.liveliness().get(key::ALL_MEMBERS).timeout(LIMIT).await.map_err(declare)?;
    let mut members = Vec::new();
    while let Ok(reply) = replies.recv_async().await {
        members.extend(reply.into_result().ok().and_then(|sample| Member::parse(sample.key_expr().as_str())));
    }
    members.retain(|member| member.group == group);
    Ok(members)
}
