//! What an operator does over the bus, and the files that a service leaves behind.

use std::path::Path;
use std::time::Duration;

use isotherm_protocol::codec::{self, Message};
use isotherm_protocol::control::{CommandOrder, CommandReply, SwapOptions, SwapReply};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::AuditEntry;
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::Status;
use isotherm_service::control::store::verify;
use serde_json::Value;
use zenoh::Session;

use crate::bench::LIMIT;

/// Distance of two looks while something is waited for.
const LOOK: Duration = Duration::from_millis(3);

/// Somebody with a session who asks and looks.
#[derive(Debug, Clone)]
pub struct Operator {
    session: Session,
}

impl Operator {
    /// On a session that reaches the service.
    #[must_use]
    pub fn new(session: Session) -> Self {
        Self { session }
    }

    /// The session.
    #[must_use]
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Asks for a document to be put in force.
    ///
    /// # Errors
    /// What the service answers instead of a reply.
    ///
    /// # Panics
    /// Where it does not answer.
    pub async fn swap(
        &self,
        unit: &str,
        document: &[u8],
        options: &SwapOptions,
    ) -> Result<SwapReply, String> {
        let selector = format!("{}?{}", key::calibration(&id(unit)), options.to_parameters());
        self.ask(&selector, Some(document.to_vec())).await.map(|json| read(&json))
    }

    /// Puts a document on its topic; nobody answers.
    ///
    /// # Panics
    /// Where it cannot be sent.
    pub async fn put(&self, unit: &str, document: &[u8], options: &SwapOptions) {
        let put = self.session.put(key::calibration(&id(unit)), document.to_vec());
        put.attachment(options.to_parameters()).await.expect("sent");
    }

    /// The text of the active document.
    ///
    /// # Errors
    /// What the service answers where there is none.
    ///
    /// # Panics
    /// Where it does not answer.
    pub async fn active(&self, unit: &str) -> Result<String, String> {
        let text = self.ask(&key::calibration(&id(unit)), None).await?;
        Ok(String::from_utf8(text).expect("a document is text"))
    }

    /// Gives a command, as JSON.
    ///
    /// # Errors
    /// What the service answers instead of a reply.
    ///
    /// # Panics
    /// Where the order is none, or the service does not answer.
    pub async fn command(&self, unit: &str, order: Value) -> Result<CommandReply, String> {
        // What the tests order must be what the programs could order.
        let order: CommandOrder = serde_json::from_value(order).expect("an order");
        let json = serde_json::to_vec(&order).expect("an order can be written");
        self.ask(&key::command(&id(unit)), Some(json)).await.map(|json| read(&json))
    }

    /// The newest entries of a unit's history, the oldest of them first.
    ///
    /// # Panics
    /// Where the service does not answer.
    pub async fn history(&self, unit: &str, limit: usize) -> Vec<AuditEntry> {
        let selector = format!("{}?limit={limit}", key::history(&id(unit)));
        read(&self.ask(&selector, None).await.expect("a history"))
    }

    /// The unit's status.
    ///
    /// # Panics
    /// Where there is none.
    pub async fn status(&self, unit: &str) -> Status {
        self.decoded(&key::status(&id(unit))).await
    }

    /// The service's own status.
    ///
    /// # Panics
    /// Where there is none.
    pub async fn service(&self) -> ServiceStatus {
        self.decoded(key::ALL_SERVICE_STATUS).await
    }

    async fn decoded<T: Message>(&self, selector: &str) -> T {
        let frame = self.ask(selector, None).await.expect("a status");
        codec::decode(&frame).expect("a status")
    }

    /// Waits until a unit's status says something.
    ///
    /// # Panics
    /// Where it does not within the limit.
    pub async fn until<T>(&self, unit: &str, mut said: impl FnMut(&Status) -> Option<T>) -> T {
        let deadline = tokio::time::Instant::now() + LIMIT;
        let key = key::status(&id(unit));
        loop {
            // Nobody answers for a unit that has not appeared yet.
            let frame = self.ask(&key, None).await.ok();
            let status: Option<Status> = frame.map(|frame| codec::decode(&frame).expect("a status"));
            if let Some(said) = status.as_ref().and_then(&mut said) {
                return said;
            }
            assert!(tokio::time::Instant::now() < deadline, "not within {LIMIT:?}: {status:#?}");
            tokio::time::sleep(LOOK).await;
        }
    }

    /// Waits until the service's own status says something.
    ///
    /// # Panics
    /// Where it does not within the limit.
    pub async fn until_service<T>(&self, mut said: impl FnMut(&ServiceStatus) -> Option<T>) -> T {
        let deadline = tokio::time::Instant::now() + LIMIT;
        loop {
            let status = self.service().await;
            if let Some(said) = said(&status) {
                return said;
            }
            assert!(tokio::time::Instant::now() < deadline, "not within {LIMIT:?}: {status:#?}");
            tokio::time::sleep(LOOK).await;
        }
    }

    /// Asks, and takes the one reply.
    async fn ask(&self, selector: &str, payload: Option<Vec<u8>>) -> Result<Vec<u8>, String> {
        let mut getter = self.session.get(selector).timeout(LIMIT);
        if let Some(payload) = payload {
            getter = getter.payload(payload);
        }
        let replies = getter.await.expect("the query is sent");
        let reply = replies.recv_async().await.map_err(|_| format!("nobody answers {selector}"))?;
        match reply.into_result() {
            Ok(sample) => Ok(sample.payload().to_bytes().into_owned()),
            Err(error) => Err(String::from_utf8_lossy(&error.payload().to_bytes()).into_owned()),
        }
    }
}

/// Every entry of an audit file that was begun with the state folder. A line that the service is writing in this moment
/// does not count: a file system may show half of a write where it goes over a page. Were such a half left by a crash, then
/// the next line would go on in it and not be readable.
///
/// # Panics
/// Where a line cannot be read, or the numbers are not consecutive from 1.
#[must_use]
pub fn audit(state: &Path) -> Vec<AuditEntry> {
    let bytes = std::fs::read(state.join("audit.jsonl")).expect("the audit file is there");
    let lines = bytes.split_inclusive(|byte| *byte == b'\n').filter_map(|line| line.strip_suffix(b"\n"));
    let read = |line: &[u8]| {
        AuditEntry::from_line(line).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(line)))
    };
    let entries: Vec<_> = lines.map(read).collect();
    for (number, entry) in (1..).zip(&entries) {
        assert_eq!(entry.number, number, "numbers are consecutive");
    }
    let chain = verify(state, None).expect("the audit file is there");
    assert!(chain.holds && chain.entries >= entries.len() as u64, "{:?}", chain.breaks);
    entries
}

/// The text of a document that the state folder keeps, checked against its digest.
///
/// # Panics
/// Where it is not there, or another one.
#[must_use]
pub fn kept(state: &Path, digest: &Digest) -> String {
    let path = state.join("documents").join(format!("{digest}.toml"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    assert_eq!(Digest::of(text.as_bytes()), *digest, "{}", path.display());
    text
}

fn id(unit: &str) -> UnitId {
    UnitId::new(unit).expect("a serial")
}

fn read<T: serde::de::DeserializeOwned>(json: &[u8]) -> T {
    serde_json::from_slice(json).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(json)))
}
