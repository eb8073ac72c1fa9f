//! Why a session cannot be opened, found out by trying the same addresses without Zenoh, whose own words name places in its source.

use std::io::ErrorKind;
use std::net::{SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::time::Duration;

use zenoh::Config;

use crate::BusError;
use crate::client::from;
use crate::endpoint::{address, host_and_port};
use crate::error::seconds;
use crate::session::endpoints;

/// Longest trial of one address.
const TRIAL: Duration = Duration::from_secs(1);
const UNKNOWN_HOST: &str = "the host name is not known";

/// What keeps a session from listening, tried before it is opened: the ports are free again afterwards.
pub(crate) fn before(config: &Config) -> Result<(), BusError> {
    // A session that goes on without its listeners, or waits for them, is not held up.
    if !matches!(config.get_json("listen/timeout_ms").as_deref(), Ok("0" | "null") | Err(_)) {
        return Ok(());
    }
    endpoints(config, "listen/endpoints").iter().try_for_each(|endpoint| listen(endpoint))
}

fn listen(endpoint: &str) -> Result<(), BusError> {
    let Some(host_and_port) = host_and_port(endpoint) else { return Ok(()) };
    let Err(error) = TcpListener::bind(host_and_port) else { return Ok(()) };
    let reason = match error.kind() {
        ErrorKind::AddrInUse => {
            "another program listens there, perhaps a service: stop it, or give another address with --listen \
             HOST:PORT".to_owned()
        }
        ErrorKind::AddrNotAvailable => {
            "this machine does not have that address: give one that it has with --listen HOST:PORT".to_owned()
        }
        ErrorKind::PermissionDenied => {
            "this user may not use that port: give one above 1023 with --listen HOST:PORT".to_owned()
        }
        _ if host_and_port.to_socket_addrs().is_err() => {
            format!("{UNKNOWN_HOST}; give another address with --listen HOST:PORT")
        }
        _ => format!("{error}; give another address with --listen HOST:PORT"),
    };
    Err(BusError::Listen { endpoint: address(endpoint).to_owned(), reason })
}

/// What has kept a session from opening: what is found, else what Zenoh says.
pub(crate) async fn found(
    source: zenoh::Error,
    config: Config,
    limit: Duration,
    said_by: Option<String>,
) -> BusError {
    let known = tokio::task::spawn_blocking(move || after(&config, limit, said_by.as_deref())).await;
    known.ok().flatten().unwrap_or(BusError::Open(source))
}

/// What has kept a session from connecting within `limit`, to endpoints that `said_by` has named.
fn after(config: &Config, limit: Duration, said_by: Option<&str>) -> Option<BusError> {
    let endpoints = endpoints(config, "connect/endpoints");
    let (mut reasons, mut steps) = (Vec::new(), Vec::new());
    for endpoint in endpoints {
        let Some((why, step)) = silent(&endpoint, limit) else { continue };
        reasons.push(format!("{}{}: {why}", address(&endpoint), from(said_by)));
        steps.extend(step.filter(|step| !steps.contains(step)));
    }
    steps.push("give the service's address: --connect HOST:PORT or ISOTHERM_CONNECT");
    (!reasons.is_empty()).then(|| BusError::Unreachable { reasons, next: steps.join(", or ") })
}

/// Whether something listens at an endpoint, or that cannot be known.
pub(crate) fn listens(endpoint: &str) -> bool {
    let Some(addresses) = host_and_port(endpoint).map(ToSocketAddrs::to_socket_addrs) else { return true };
    addresses.is_ok_and(|mut all| all.any(|address| TcpStream::connect_timeout(&address, TRIAL).is_ok()))
}

/// Why nothing came of an endpoint, and what else to do than to give another.
fn silent(endpoint: &str, limit: Duration) -> Option<(String, Option<&'static str>)> {
    let address = host_and_port(endpoint)?;
    let addresses: Vec<SocketAddr> = match address.to_socket_addrs() {
        Ok(addresses) => addresses.collect(),
        Err(_) => return Some((UNKNOWN_HOST.to_owned(), None)),
    };
    let mut last = None;
    for address in addresses {
        match TcpStream::connect_timeout(&address, TRIAL) {
            Ok(_) => {
                let why = format!(
                    "something listens there but does not answer within {} (another program, a stopped service, or \
                     one with other certificates)",
                    seconds(limit)
                );
                return Some((why, None));
            }
            Err(error) => last = Some(error),
        }
    }
    let error = last?;
    Some(match error.kind() {
        ErrorKind::ConnectionRefused => {
            ("nothing listens there".to_owned(), Some("start one with `isotherm serve`"))
        }
        ErrorKind::TimedOut => ("the machine does not answer".to_owned(), Some("check network and firewall")),
        _ => (error.to_string(), None),
    })
}
