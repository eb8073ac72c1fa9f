//! Metrics for Prometheus and a verdict on the service's health, over HTTP on an address of the operator's choice.
//!
//! | module | holds |
//! |---|---|
//! | `http` | connections, requests and their limits |
//! | `source` | what is looked at: one look at every unit |
//! | `families` | every metric: name, meaning, and where its value comes from |
//! | `page` | a look as `OpenMetrics` text |
//! | `health` | what speaks against the service's health |
//! | `state_folder` | whether the state folder can be written |
//!
//! A unit's lock is held for as long as its status takes, as it is by whoever asks for that status over the bus; text is
//! made of it afterwards. One look at a time, on a thread where waiting hurts nobody: a unit that is held up by a slow
//! subscriber holds a request up, and no receive thread waits for a request.
//!
//! `docs/metrics.md` lists every metric; a test compares it with [`families`].

mod families;
mod health;
mod http;
mod page;
mod source;
mod state_folder;

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::net::TcpListener;
use tokio::sync::Mutex;
use tokio::task::JoinHandle;

use crate::ServiceError;
use crate::config::MetricsSettings;
pub(crate) use source::Source;

use health::Watch;

/// How long a request, or what hinders it, may take.
#[derive(Debug, Clone, Copy)]
struct Limits {
    /// From the opening of a connection to the end of its request's head.
    head: Duration,
    /// From the opening of a connection to its end.
    connection: Duration,
    /// For one look at every unit.
    look: Duration,
    /// Distance of the looks that nobody asked for: stalls and alarms are noticed by them.
    interval: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            head: Duration::from_secs(5),
            connection: Duration::from_secs(15),
            look: Duration::from_secs(5),
            interval: Duration::from_secs(1),
        }
    }
}

/// An address that is taken and not served yet, so that a port in use is told before anything else is done.
#[derive(Debug)]
pub(crate) struct Taken(TcpListener);

impl Taken {
    /// Takes the configured address; `None` where none is configured.
    ///
    /// # Errors
    /// [`ServiceError::Metrics`] where others could reach it and that is not allowed, or it cannot be had.
    pub(crate) async fn bind(settings: &MetricsSettings) -> Result<Option<Self>, ServiceError> {
        let Some(address) = settings.listen else { return Ok(None) };
        let refused = |source| ServiceError::Metrics { address, source };
        if !settings.admits(address) {
            let words =
                "other machines could reach it; take 127.0.0.1, or set allow_remote = true in [metrics]";
            return Err(refused(io::Error::other(words)));
        }
        TcpListener::bind(address).await.map(|listener| Some(Self(listener))).map_err(refused)
    }

    /// Serves it.
    ///
    /// # Errors
    /// Where the system does not say which address it is.
    pub(crate) fn serve(self, source: Source) -> io::Result<Endpoint> {
        self.serve_within(source, Watch::default(), Limits::default())
    }

    fn serve_within(self, source: Source, watch: Watch, limits: Limits) -> io::Result<Endpoint> {
        let address = self.0.local_addr()?;
        let watch = Arc::new(Mutex::new(watch));
        let desk = Arc::new(Desk { source, watch, stopping: AtomicBool::new(false), limits });
        let tasks = [
            tokio::spawn(http::serve(self.0, Arc::clone(&desk))),
            tokio::spawn(look_now_and_then(Arc::clone(&desk))),
        ];
        tracing::info!("metrics on http://{address}/metrics, health on http://{address}/healthz");
        Ok(Endpoint { address, desk, tasks })
    }
}

/// Looks at the units again and again, so that what has gone on for a while is known as such when somebody asks.
async fn look_now_and_then(desk: Arc<Desk>) {
    let mut interval = tokio::time::interval(desk.limits.interval);
    interval.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        interval.tick().await;
        // A look that takes too long is told to whoever asks for one.
        let _ = desk.look(Source::watch_units).await;
    }
}

/// The running endpoint; it ends soon after it is dropped.
#[derive(Debug)]
pub(crate) struct Endpoint {
    address: SocketAddr,
    desk: Arc<Desk>,
    tasks: [JoinHandle<()>; 2],
}

impl Endpoint {
    /// Where it is.
    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }

    /// From now on the service is not healthy: it is about to end.
    pub(crate) fn stopping(&self) {
        self.desk.stopping.store(true, Ordering::Relaxed);
    }

    /// Ends it, and gives the address back before this returns.
    pub(crate) async fn end(mut self) {
        for task in &mut self.tasks {
            task.abort();
            // Cut off, as it was to be.
            let _ = task.await;
        }
    }
}

impl Drop for Endpoint {
    fn drop(&mut self) {
        self.tasks.iter().for_each(JoinHandle::abort);
    }
}

/// What requests are answered from.
#[derive(Debug)]
struct Desk {
    source: Source,
    watch: Arc<Mutex<Watch>>,
    stopping: AtomicBool,
    limits: Limits,
}

impl Desk {
    /// Has a look taken; `None` where it takes too long.
    async fn look<T: Send + 'static>(
        self: &Arc<Self>,
        look: impl FnOnce(&Source, &mut Watch) -> T + Send + 'static,
    ) -> Option<T> {
        let desk = Arc::clone(self);
        let looked = async move {
            // Goes with the work, not with the request: however often somebody asks, one thread looks.
            let mut watch = Arc::clone(&desk.watch).lock_owned().await;
            tokio::task::spawn_blocking(move || look(&desk.source, &mut watch)).await
        };
        tokio::time::timeout(self.limits.look, looked).await.ok()?.ok()
    }
}

#[cfg(test)]
mod tests;
