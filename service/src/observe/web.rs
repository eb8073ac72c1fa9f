//! The console in the browser: what `isotherm top` shows, and what `swap`, `rollback` and `command` do, on the server of the metrics.
//!
//! | module | holds |
//! |---|---|
//! | `guard` | who may ask: host, origin, token |
//! | `api` | what is answered to which request |
//! | `view` | units and services as JSON |
//! | `live` | ticks of one unit as they go by |
//! | `bundle` | everything for a fault report, as one file |
//! | `token` | the token and its file; the command `web` |
//! | `assets`, `page/` | page, style and scripts, in the program |
//!
//! It sees units as an operator's commands do: by the statuses that are published anyway, and by the same questions on the bus. So
//! it shows every instance that the bus has, a swap takes the one way that there is, and no unit is locked for it, except
//! the one whose ticks somebody watches. The page and its rules: `docs/adr/0035-console-in-the-browser.md`.

mod api;
mod assets;
mod bundle;
mod guard;
mod live;
mod token;
mod view;

use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use isotherm_bus::DEFAULT_ENDPOINT;
use tokio::sync::Semaphore;
use tokio::task::JoinHandle;
use zenoh::Session;

use crate::ServiceError;
use crate::config::Settings;
use crate::receive::intake::{Intake, lock};
use guard::Guard;
use isotherm_operator::client::Client;
use isotherm_operator::status::unix_ms;
use isotherm_operator::{Feed, Fleet};

pub use token::WebArgs;
pub use token::show;

/// How long an answer on the bus is waited for: shorter than a connection may last.
const ANSWER_LIMIT: Duration = Duration::from_secs(10);
/// How long nothing is asked after the feed could not be had.
const PAUSE: Duration = Duration::from_secs(1);
/// Most charts of live ticks at a time: each holds a thread.
const MAX_LIVE: usize = 16;

/// The console, ready to answer.
#[derive(Debug)]
pub(crate) struct Web {
    guard: Guard,
    write: bool,
    intake: Arc<Intake>,
    client: Arc<Client>,
    fleet: Arc<Mutex<Fleet>>,
    /// This service's name for itself.
    instance: String,
    /// Options with which a command reaches this service; empty where it needs none.
    options: String,
    live: Arc<Semaphore>,
    feeding: JoinHandle<()>,
}

impl Web {
    /// Makes it ready on the session of a service that answers; `None` where it is not configured.
    ///
    /// # Errors
    /// [`ServiceError::Token`] where the file of the token cannot be used.
    pub(crate) fn start(
        settings: &Settings,
        session: &Session,
        intake: &Arc<Intake>,
    ) -> Result<Option<Self>, ServiceError> {
        if !settings.web.enabled {
            return Ok(None);
        }
        if settings.metrics.listen.is_some_and(|address| !address.ip().to_canonical().is_loopback()) {
            tracing::warn!(
                "other machines can reach the console in the browser, and its token is sent unencrypted: listen on \
                 127.0.0.1 behind a proxy with TLS"
            );
        }
        let token = token::of_service(settings)?;
        let client = Arc::new(Client::on(session.clone(), ANSWER_LIMIT));
        let fleet = Arc::default();
        let feeding = tokio::spawn(feed(Arc::clone(&client), Arc::clone(&fleet)));
        Ok(Some(Self {
            guard: Guard::new(&token, &settings.web.hosts),
            write: settings.web.write,
            intake: Arc::clone(intake),
            instance: session.zid().to_string(),
            options: options(&isotherm_bus::locators(session), settings.zenoh.session.namespace.as_deref()),
            client,
            fleet,
            live: Arc::new(Semaphore::new(MAX_LIVE)),
            feeding,
        }))
    }

    fn fleet(&self) -> MutexGuard<'_, Fleet> {
        lock(&self.fleet)
    }
}

impl Drop for Web {
    fn drop(&mut self) {
        self.feeding.abort();
    }
}

/// Takes news of units and services for as long as the session lasts.
async fn feed(client: Arc<Client>, fleet: Arc<Mutex<Fleet>>) {
    while !client.session.is_closed() {
        match Feed::start(&client).await {
            Ok(mut feed) => {
                while let Some(news) = feed.next().await {
                    let now = Instant::now();
                    let mut fleet = lock(&fleet);
                    fleet.take(news, now, unix_ms());
                    fleet.forget(now);
                }
            }
            Err(error) => tracing::debug!("console in the browser: {error}; will retry"),
        }
        tokio::time::sleep(PAUSE).await;
    }
}

/// What a command has to be told to reach a service that listens there.
fn options(locators: &[String], namespace: Option<&str>) -> String {
    let usual = locators.iter().any(|locator| locator == DEFAULT_ENDPOINT);
    let connect = locators.first().filter(|_| !usual).map(|locator| format!(" --connect {locator}"));
    let namespace = namespace.map(|namespace| format!(" --namespace {namespace}"));
    [connect, namespace].into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_told_no_more_than_it_needs() {
        let locators = |of: &[&str]| of.iter().map(ToString::to_string).collect::<Vec<_>>();
        assert_eq!(options(&locators(&["tcp/10.0.0.7:7447", "tcp/127.0.0.1:7447"]), None), "");
        let elsewhere = locators(&["tcp/127.0.0.1:4000"]);
        assert_eq!(options(&elsewhere, Some("a/b")), " --connect tcp/127.0.0.1:4000 --namespace a/b");
        assert_eq!(options(&[], None), "");
    }
}
