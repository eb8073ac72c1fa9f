//! A session to ask a service on.

use std::path::Path;
use std::time::Duration;

use clap::Args;
use isotherm_bus::inquiry::{Unanswered, ask};
use isotherm_bus::{BusError, ClientOptions, Role};
use isotherm_cli::duration;
use isotherm_protocol::codec::{self, Message};
use isotherm_protocol::escape::is_unfit;
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::pair::PairReport;
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::Status;
use serde::de::DeserializeOwned;
use zenoh::Session;

use super::ConsoleError;
use isotherm_document::file::read_bounded;

/// How to reach the service.
#[derive(Debug, Clone, Args)]
pub struct ClientArgs {
    /// How to reach the service
    #[command(flatten)]
    pub session: ClientOptions,
    /// Longest wait for an answer (s)
    #[arg(long, value_name = "SECONDS", default_value = "5", value_parser = duration(0.1..=3600.0), hide_short_help = true)]
    pub timeout: Duration,
}

/// A session to ask on.
#[derive(Debug, Clone)]
pub struct Client {
    /// What is asked on.
    pub session: Session,
    /// How long an answer is waited for.
    pub timeout: Duration,
    tried: String,
    /// Who asks, by the certificate.
    name: Option<String>,
}

impl Client {
    /// On a session that is open.
    #[must_use]
    pub fn on(session: Session, timeout: Duration) -> Self {
        Self { session, timeout, tried: "this service".to_owned(), name: None }
    }

    /// Opens the session.
    pub(super) async fn open(args: &ClientArgs) -> Result<Self, ConsoleError> {
        let way = args.session.way(Role::Peer)?;
        let session = way.open(args.timeout).await?;
        let (tried, name) = (way.tried(), way.name().map(ToOwned::to_owned));
        Ok(Self { session, timeout: args.timeout, tried, name })
    }

    /// Ends the session.
    pub(super) async fn close(self) {
        // Nothing of it is of any more use; what hangs is left to the end of the process.
        let _ = isotherm_bus::close(self.session, Duration::from_secs(1)).await;
    }

    /// Something that could not be declared.
    pub(super) fn declare(key: &str) -> impl Fn(zenoh::Error) -> ConsoleError + use<> {
        let key = key.to_owned();
        move |source| BusError::Declare { key: key.clone(), source }.into()
    }

    /// Key of an order: it ends in the name of the certificate, where there is one, for access control to judge.
    pub(super) fn order(&self, key: String) -> String {
        self.name.as_ref().and_then(|name| key::by(&key, name)).unwrap_or(key)
    }

    async fn no_answer(&self, key: &str) -> ConsoleError {
        let (key, waited, tried) = (key.to_owned(), self.timeout, self.tried.clone());
        match &self.name {
            // Zenoh drops what access control does not allow, and tells nobody.
            Some(name) if self.session.info().links().await.next().is_some() => {
                ConsoleError::NotAllowed { key, waited, tried, name: name.clone() }
            }
            _ => ConsoleError::NoAnswer { key, waited, tried },
        }
    }

    /// Where the service was looked for.
    pub(super) fn tried(&self) -> &str {
        &self.tried
    }

    /// Every answer to a question, once somebody is there to answer it.
    ///
    /// # Errors
    /// Where nobody answers in time, or with what cannot be read.
    pub async fn answers(
        &self,
        key: &str,
        parameters: &str,
        payload: Option<&[u8]>,
    ) -> Result<Vec<Vec<u8>>, ConsoleError> {
        match ask(&self.session, key, parameters, payload, self.timeout).await {
            Ok(answers) => Ok(answers),
            Err(Unanswered::Bus(error)) => Err(error.into()),
            Err(Unanswered::Silence) => Err(self.no_answer(key).await),
            Err(Unanswered::Refused(words)) => Err(ConsoleError::Refused(words)),
        }
    }

    /// The first answer to a question, as text.
    ///
    /// # Errors
    /// Where nobody answers in time, or with what cannot be read.
    pub async fn text(
        &self,
        key: &str,
        parameters: &str,
        payload: Option<&[u8]>,
    ) -> Result<String, ConsoleError> {
        let Some(bytes) = self.answers(key, parameters, payload).await?.into_iter().next() else {
            // imu/{unit}/…
            let unit = key.split('/').nth(1).unwrap_or_default();
            let instances = self.pairs().await.unwrap_or_default();
            return Err(ConsoleError::unanswered(unit, key, payload.is_some(), &self.tried, &instances));
        };
        String::from_utf8(bytes).map_err(unread(key))
    }

    /// The first answer to a question, from JSON.
    pub(super) async fn json<T: DeserializeOwned>(
        &self,
        key: &str,
        parameters: &str,
        payload: Option<&[u8]>,
    ) -> Result<T, ConsoleError> {
        let text = self.text(key, parameters, payload).await?;
        serde_json::from_str(&text).map_err(unread(key))
    }

    /// Every answer to a question, from frames; frames of another version are passed over with a word.
    async fn frames<M: Message>(&self, key: &str) -> Result<Vec<M>, ConsoleError> {
        let answers = self.answers(key, "", None).await?;
        answers.iter().map(|frame| codec::decode(frame).map_err(unread(key))).collect()
    }

    /// Status of every unit, in the order of their serials.
    ///
    /// # Errors
    /// Where nobody answers in time, or with what cannot be read.
    pub async fn statuses(&self) -> Result<Vec<Status>, ConsoleError> {
        let mut statuses: Vec<Status> = self.frames(key::ALL_STATUS).await?;
        statuses.sort_by(|a, b| (&a.unit, &a.instance).cmp(&(&b.unit, &b.instance)));
        Ok(statuses)
    }

    /// Status of every service instance.
    ///
    /// # Errors
    /// Where nobody answers in time, or with what cannot be read.
    pub async fn services(&self) -> Result<Vec<ServiceStatus>, ConsoleError> {
        let mut services: Vec<ServiceStatus> = self.frames(key::ALL_SERVICE_STATUS).await?;
        services.sort_by(|a, b| a.instance.cmp(&b.instance));
        Ok(services)
    }

    /// What every service instance does for which unit.
    pub(super) async fn pairs(&self) -> Result<Vec<PairReport>, ConsoleError> {
        let answers = self.answers(key::ALL_PAIRS, "", None).await?;
        let read = |json: &Vec<u8>| serde_json::from_slice(json).map_err(unread(key::ALL_PAIRS));
        let mut reports = answers.iter().map(read).collect::<Result<Vec<PairReport>, _>>()?;
        reports
            .sort_by(|a, b| (&a.member.name, &a.member.instance).cmp(&(&b.member.name, &b.member.instance)));
        Ok(reports)
    }

    /// Status of one unit; `None` where it has not appeared.
    pub(super) async fn status(&self, unit: &UnitId) -> Result<Option<Status>, ConsoleError> {
        Ok(self.statuses().await?.into_iter().find(|status| status.unit == unit.as_str()))
    }
}

/// For `map_err`: an answer that cannot be read.
fn unread<E: std::fmt::Display>(key: &str) -> impl Fn(E) -> ConsoleError {
    move |error| ConsoleError::Answer { key: key.to_owned(), reason: error.to_string() }
}

/// Reads a file, or standard input where it is `-`, no further than a document may be long.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, ConsoleError> {
    let path = if path.as_os_str() == "-" { Path::new("/dev/stdin") } else { path };
    read_bounded(path).map_err(|source| ConsoleError::Read { path: path.to_owned(), source })
}

/// Who asks: what was said, or the name of the user as far as it may be one.
pub(super) fn by(given: Option<&str>) -> String {
    let named =
        || user().chars().filter(|c| !is_unfit(*c)).take(isotherm_protocol::control::MAX_BY).collect();
    given.map_or_else(named, ToOwned::to_owned)
}

/// Name of the user: as the session says, else as the system knows it, as for a job of cron; its number where the system
/// has no name for it, as in a container.
fn user() -> String {
    let said = ["USER", "LOGNAME"].into_iter().filter_map(|name| std::env::var(name).ok());
    let said = said.map(|name| name.trim().to_owned()).find(|name| !name.is_empty());
    let known = || uzers::get_current_username().map(|name| name.to_string_lossy().into_owned());
    said.or_else(known).unwrap_or_else(|| format!("uid {}", uzers::get_current_uid()))
}
