//! Opening and closing sessions.

use std::net::ToSocketAddrs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use serde_json::Value;
use zenoh::{Config, Session, Wait};

use crate::endpoint::{DEFAULT_ENDPOINT, address, endpoint, host_and_port};
use crate::{BoxFuture, BusError, obstacle};

/// Where a session listens and connects when neither options nor a configuration say so.
const LOOPBACK: &str = "tcp/127.0.0.1:0";

/// How long an endpoint given as an option may stay unreachable before opening fails (ms).
const CONNECT_TIMEOUT_MS: u32 = 10_000;

/// How often it is looked whether a session is connected: Zenoh tells nobody.
const CONNECTED_INTERVAL: Duration = Duration::from_millis(5);

/// Key of the lease (ms).
const LEASE: &str = "transport/link/tx/lease";
/// Key of how often a connection is tried again, and the shortest and longest distance of trials (ms). With Zenoh's own 1 s and 4 s an
/// instance that was restarted would be found seconds after it listens, and a kill of the other one before that loses ticks. The halves
/// of a pair must find each other before a producer finds the one that starts: that one waits for 0.5 s.
const RETRY: &str = "connect/retry";
const RETRY_MS: [u32; 2] = [50, 100];
/// Key of how long a put that blocks may wait before the connection is closed (µs): the lease ends a connection, not the waiting.
const LONGEST_PUT: &str = "transport/link/tx/queue/congestion_control/block/wait_before_close";

/// How long a connection may say nothing before it is let go (ms), and how many may be about to say something: Zenoh's own 10 s and
/// 100 let a few hundred idle connections keep every client out.
const ACCEPT_TIMEOUT_MS: u32 = 2000;
const ACCEPT_PENDING: u32 = 1000;

/// How to open a session.
///
/// Without a configuration file a session is a peer that listens on loopback only, on a port of the system's choice,
/// and finds nobody by itself: no multicast, no gossip. The other options replace what a file says. [`crate::endpoint()`] says how
/// endpoints may be written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct SessionOptions {
    /// Zenoh configuration (JSON5) (default: peer on loopback, no scouting)
    #[cfg_attr(feature = "clap", arg(id = "zenoh_config", long = "zenoh-config", value_name = "FILE"))]
    pub config: Option<PathBuf>,
    /// Address of a router or peer to connect to, repeatable
    #[cfg_attr(feature = "clap", arg(long, value_name = "HOST:PORT", value_parser = endpoint))]
    pub connect: Vec<String>,
    /// Address to listen on, repeatable; port 0: chosen by the system (default: 127.0.0.1:7447 unless --connect or a Zenoh
    /// configuration is given)
    #[cfg_attr(feature = "clap", arg(long, value_name = "HOST:PORT", value_parser = endpoint))]
    pub listen: Vec<String>,
    /// Zenoh namespace, a prefix of every key, e.g. site/a
    #[cfg_attr(feature = "clap", arg(long, value_name = "PREFIX"))]
    pub namespace: Option<String>,
    /// How long others wait for a sign of life before they close the connection, and how long a put with `Block` waits for others,
    /// where a configuration does not say otherwise. `None`: Zenoh's own 10 s and 5 s.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub lease: Option<Duration>,
    /// Whether it opens although nothing answers where it connects, and tries for ever; where a configuration file does not say.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub keeps_trying: bool,
}

impl SessionOptions {
    /// The configuration that these options stand for.
    ///
    /// # Errors
    /// [`BusError::ConfigurationFile`], [`BusError::Configuration`], [`BusError::Endpoint`] and [`BusError::Option`].
    pub fn to_config(&self) -> Result<Config, BusError> {
        let mut config = match &self.config {
            Some(path) => {
                let unreadable = |source| BusError::ConfigurationFile { path: path.clone(), source };
                std::fs::File::open(path).map_err(unreadable)?;
                Config::from_file(path)
                    .map_err(|source| BusError::Configuration { path: path.clone(), source })?
            }
            None => loopback()?,
        };
        if !self.connect.is_empty() {
            set(&mut config, "connect/endpoints", read("connect", &self.connect)?)?;
        }
        if !self.listen.is_empty() {
            set(&mut config, "listen/endpoints", read("listen", &self.listen)?)?;
        }
        if let Some(lease) = self.lease.filter(|_| has_default(&config, LEASE)) {
            set(&mut config, LEASE, u64::try_from(lease.as_millis()).unwrap_or(u64::MAX))?;
            if has_default(&config, LONGEST_PUT) {
                set(&mut config, LONGEST_PUT, i64::try_from(lease.as_micros()).unwrap_or(i64::MAX))?;
            }
        }
        if has_default(&config, RETRY) {
            let [init, max] = RETRY_MS;
            let retry = serde_json::json!({
                "period_init_ms": init, "period_max_ms": max, "period_increase_factor": 2.0,
            });
            set(&mut config, RETRY, retry)?;
        }
        if self.keeps_trying && self.config.is_none() {
            keep_trying(&mut config)?;
        }
        if let Some(namespace) = &self.namespace {
            set(&mut config, "namespace", namespace.as_str())?;
        }
        Ok(config)
    }

    /// Has it listen where clients look for a service, if neither an endpoint nor a configuration is given.
    pub fn listen_by_default(&mut self) {
        if self.config.is_none() && self.connect.is_empty() && self.listen.is_empty() {
            self.listen = vec![DEFAULT_ENDPOINT.to_owned()];
        }
    }

    /// Whether a session with these options lets through only what its access control allows; a client leaves that to its router.
    ///
    /// # Errors
    /// As [`Self::to_config`].
    pub fn has_access_control(&self) -> Result<bool, BusError> {
        let config = self.to_config()?;
        let is_controlled = config.get_json("access_control/enabled").is_ok_and(|found| found == "true");
        Ok(is_controlled || is_client(&config))
    }

    /// Whether a session with these options listens or connects over TLS.
    ///
    /// # Errors
    /// As [`Self::to_config`].
    pub fn uses_tls(&self) -> Result<bool, BusError> {
        let config = self.to_config()?;
        let is_tls = |key| endpoints(&config, key).iter().any(|endpoint| endpoint.starts_with("tls/"));
        Ok(is_tls("listen/endpoints") || is_tls("connect/endpoints"))
    }

    /// The endpoints that a session connects to: the configured ones, and those of the Zenoh configuration.
    ///
    /// # Errors
    /// As [`Self::to_config`].
    pub fn connects_to(&self) -> Result<Vec<String>, BusError> {
        Ok(endpoints(&self.to_config()?, "connect/endpoints"))
    }

    /// The endpoints that it listens on.
    ///
    /// # Errors
    /// As [`Self::to_config`].
    pub fn listens_on(&self) -> Result<Vec<String>, BusError> {
        Ok(endpoints(&self.to_config()?, "listen/endpoints"))
    }

    /// What an opening session may have to wait for, in words: "a router or peer at tcp/127.0.0.1:7447".
    ///
    /// # Errors
    /// As [`Self::to_config`].
    pub fn awaited(&self) -> Result<String, BusError> {
        Ok(match self.connects_to()?.as_slice() {
            [] => "a router or peer that scouting finds (no endpoint to connect to is configured)".to_owned(),
            endpoints => format!("a router or peer at {}", endpoints.join(" or ")),
        })
    }
}

/// Has a session open although nothing answers yet where it connects.
pub(crate) fn keep_trying(config: &mut Config) -> Result<(), BusError> {
    set(config, "connect/timeout_ms", -1)?;
    set(config, "connect/exit_on_failure", false)
}

/// Whether a key of a configuration is what it is where nobody says anything.
fn has_default(config: &Config, key: &str) -> bool {
    config.get_json(key).ok() == Config::default().get_json(key).ok()
}

/// Endpoints as Zenoh takes them.
fn read(option: &'static str, texts: &[String]) -> Result<Vec<String>, BusError> {
    let read = |text: &String| {
        endpoint(text).map_err(|reason| BusError::Endpoint { option, value: text.clone(), reason })
    };
    texts.iter().map(read).collect()
}

/// The endpoints under a key of a configuration, in the mode that it has.
pub(crate) fn endpoints(config: &Config, key: &str) -> Vec<String> {
    let json = |key: &str| -> Value {
        serde_json::from_str(&config.get_json(key).unwrap_or_default()).unwrap_or_default()
    };
    let (endpoints, mode) = (json(key), json("mode"));
    let of_mode = endpoints.get(mode.as_str().unwrap_or("peer")).unwrap_or(&endpoints);
    let mut endpoints: Vec<_> = texts(of_mode).into_iter().map(ToOwned::to_owned).collect();
    endpoints.dedup();
    endpoints
}

/// Every text of a JSON value.
fn texts(value: &Value) -> Vec<&str> {
    match value {
        Value::String(text) => vec![text],
        Value::Array(items) => items.iter().flat_map(texts).collect(),
        Value::Object(entries) => entries.values().flat_map(texts).collect(),
        _ => Vec::new(),
    }
}

/// The configuration without a file; `config/zenoh/peer.json5` says the same, with the reasons.
fn loopback() -> Result<Config, BusError> {
    let mut config = Config::default();
    set(&mut config, "mode", "peer")?;
    set(&mut config, "listen/endpoints", vec![LOOPBACK])?;
    set(&mut config, "connect/timeout_ms", CONNECT_TIMEOUT_MS)?;
    set(&mut config, "connect/exit_on_failure", true)?;
    set(&mut config, "scouting/multicast/enabled", false)?;
    set(&mut config, "scouting/gossip/enabled", false)?;
    set(&mut config, "transport/unicast/accept_timeout", ACCEPT_TIMEOUT_MS)?;
    set(&mut config, "transport/unicast/accept_pending", ACCEPT_PENDING)?;
    set(&mut config, "transport/link/tx/queue/batching/time_limit", 0)?;
    set(&mut config, "transport/link/tx/queue/size/real_time", 16)?;
    Ok(config)
}

/// Sets one value of a configuration.
///
/// # Errors
/// [`BusError::Option`].
pub fn set(config: &mut Config, option: &'static str, value: impl Into<Value>) -> Result<(), BusError> {
    let value = value.into().to_string();
    config.insert_json5(option, &value).map_err(|source| BusError::Option { option, value, source })
}

/// Opens a session.
///
/// Zenoh needs tokio's multi-threaded runtime: a test says `#[tokio::test(flavor = "multi_thread")]`.
///
/// # Errors
/// [`BusError::Configuration`], [`BusError::Endpoint`] and [`BusError::Option`] for what the options say, [`BusError::Listen`]
/// where a port cannot be bound, [`BusError::Unreachable`] where no endpoint can be reached, [`BusError::Open`] for anything else.
#[must_use]
pub fn open(options: &SessionOptions) -> BoxFuture<'_, Result<Session, BusError>> {
    Box::pin(async move { open_config(options.to_config()?).await })
}

/// Opens a session with a configuration.
///
/// # Errors
/// As [`open`].
#[must_use]
pub fn open_config(config: Config) -> BoxFuture<'static, Result<Session, BusError>> {
    Box::pin(async move {
        obstacle::before(&config)?;
        let started = Instant::now();
        match zenoh::open(config.clone()).await {
            Ok(session) => Ok(session),
            Err(source) => Err(obstacle::found(source, config, started.elapsed(), None).await),
        }
    })
}

/// Waits until a session is connected to every endpoint that its options name, a client to one of them; no longer than `limit`. Whether
/// it is.
///
/// # Errors
/// As [`SessionOptions::to_config`].
pub async fn connected(
    session: &Session,
    options: &SessionOptions,
    limit: Duration,
) -> Result<bool, BusError> {
    let config = options.to_config()?;
    let wanted = endpoints(&config, "connect/endpoints");
    let least = if is_client(&config) { wanted.len().min(1) } else { wanted.len() };
    Ok(connected_to(session, &wanted, least, limit).await >= least)
}

fn is_client(config: &Config) -> bool {
    config.get_json("mode").is_ok_and(|mode| mode == "\"client\"")
}

/// Waits until a session is connected to so many of these endpoints; no longer than `limit`. To how many it is.
pub(crate) async fn connected_to(
    session: &Session,
    endpoints: &[String],
    least: usize,
    limit: Duration,
) -> usize {
    let wanted: Vec<_> = endpoints.iter().map(|endpoint| reached(endpoint)).collect();
    let deadline = Instant::now() + limit;
    loop {
        let links: Vec<_> = session.info().links().await.map(|link| link.dst().to_string()).collect();
        // A connection from elsewhere says nothing: producers may find this session before it finds the others.
        let is_there = |any_of: &&Vec<String>| any_of.iter().any(|endpoint| links.contains(endpoint));
        let count = wanted.iter().filter(is_there).count();
        if count >= least || Instant::now() >= deadline {
            return count;
        }
        tokio::time::sleep(CONNECTED_INTERVAL).await;
    }
}

/// What a link to an endpoint may be called: its host name stands for one of these addresses.
fn reached(endpoint: &str) -> Vec<String> {
    let bare = address(endpoint);
    let named = host_and_port(endpoint).zip(bare.split_once('/'));
    let addresses = named.and_then(|(host_and_port, (protocol, _))| {
        Some(host_and_port.to_socket_addrs().ok()?.map(|address| format!("{protocol}/{address}")).collect())
    });
    addresses.unwrap_or_else(|| vec![bare.to_owned()])
}

/// The endpoints that others can connect to, with the ports that the system has chosen.
#[must_use]
pub fn locators(session: &Session) -> Vec<String> {
    session.info().locators().wait().iter().map(ToString::to_string).collect()
}

/// Closes a session, waiting no longer than `limit`.
///
/// What was published before is written out first, as far as the peers take it at once: see [`crate::receipt`]. Zenoh itself may take
/// 10 s where a peer no longer answers; such a session is left to close by itself.
///
/// # Errors
/// [`BusError::CloseTimeout`] and [`BusError::Close`].
#[must_use]
pub fn close(session: Session, limit: Duration) -> BoxFuture<'static, Result<(), BusError>> {
    Box::pin(async move {
        let closing = tokio::spawn(async move { session.close().await });
        match tokio::time::timeout(limit, closing).await {
            Ok(Ok(closed)) => closed.map_err(BusError::Close),
            Ok(Err(join)) => Err(BusError::Close(join.into())),
            Err(_) => Err(BusError::CloseTimeout(limit)),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_service_listens_where_clients_look_for_it_unless_it_is_told_otherwise() {
        let listens = |options: SessionOptions| {
            let mut options = options;
            options.listen_by_default();
            options.listen
        };
        let nothing = SessionOptions::default();
        assert_eq!(listens(nothing.clone()), [DEFAULT_ENDPOINT]);
        let router = SessionOptions { connect: vec!["router:7447".to_owned()], ..nothing.clone() };
        assert_eq!(listens(router), Vec::<String>::new());
        let own = SessionOptions { listen: vec!["127.0.0.1:0".to_owned()], ..nothing.clone() };
        assert_eq!(listens(own.clone()), own.listen);
        let file = SessionOptions { config: Some("peer.json5".into()), ..nothing };
        assert_eq!(listens(file), Vec::<String>::new());
        assert_eq!(endpoints(&own.to_config().unwrap(), "listen/endpoints"), ["tcp/127.0.0.1:0"]);
        let tls = SessionOptions { connect: vec!["tls/router:7447".to_owned()], ..own.clone() };
        assert!(tls.uses_tls().unwrap() && !own.uses_tls().unwrap());
    }

    #[test]
    fn what_is_lost_is_soon_tried_again_unless_a_configuration_says_how_often() {
        let folder = tempfile::tempdir().unwrap();
        for (text, longest) in [("{}", 100), ("{connect: {retry: {period_max_ms: 9000}}}", 9000)] {
            let file = folder.path().join("zenoh.json5");
            std::fs::write(&file, text).unwrap();
            let options = SessionOptions { config: Some(file), ..SessionOptions::default() };
            let retry = options.to_config().unwrap().get_json(RETRY).unwrap();
            let retry: Value = serde_json::from_str(&retry).unwrap();
            assert_eq!(retry["period_max_ms"], longest, "{retry}");
        }
    }
}
