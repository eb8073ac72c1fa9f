//! Metrics for Prometheus and verdicts on the service's health, over HTTP on an address of the operator's choice.
//!
//! `/livez`: the process answers. `/readyz`: it receives and corrects. `/healthz`: everything that speaks against its health, as JSON.
//! All of them answer from the moment on at which the address is taken, which is before the Zenoh session is open.
//!
//! | module | holds |
//! |---|---|
//! | `http` | connections, requests and their limits |
//! | `source` | what is looked at: one look at every unit |
//! | `families` | every metric: name, meaning, and where its value comes from |
//! | `page` | a look as `OpenMetrics` text |
//! | `health` | what speaks against the service's health |
//!
//! A unit's lock is held for as long as its status takes, as it is by whoever asks for that status over the bus; text is
//! made of it afterwards. One look at a time, on a thread where waiting hurts nobody: a unit that is held up by a slow
//! subscriber holds a request up, and no receive thread waits for a request.
//!
//! `docs/metrics.md` lists every metric; a test compares it with [`families`].

mod families;
mod health;
pub(crate) mod http;
mod page;
mod source;

use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use tokio::net::TcpListener;
use tokio::sync::Mutex;
use tokio::task::JoinHandle;

use crate::ServiceError;
use crate::config::{MetricsSettings, Settings};
use crate::observe::web::Web;
pub(crate) use source::Source;

use health::{STOPPING, Watch};

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

/// The endpoint at work; it ends soon after it is dropped.
#[derive(Debug)]
pub(crate) struct Endpoint {
    address: SocketAddr,
    exporter: Arc<Exporter>,
    tasks: [JoinHandle<()>; 2],
}

impl Endpoint {
    /// Takes the configured address and answers on it, as a service that waits for `waits_for` until [`Self::open`]; `None` where none
    /// is configured.
    ///
    /// # Errors
    /// [`ServiceError::Metrics`] where others could reach it and that is not allowed, or it cannot be had.
    pub(crate) async fn start(settings: &Settings, waits_for: String) -> Result<Option<Self>, ServiceError> {
        Self::start_within(&settings.metrics, waits_for, Watch::of(&settings.unit), Limits::default()).await
    }

    async fn start_within(
        settings: &MetricsSettings,
        waits_for: String,
        watch: Watch,
        limits: Limits,
    ) -> Result<Option<Self>, ServiceError> {
        let Some(address) = settings.listen else { return Ok(None) };
        let refused = |source| ServiceError::Metrics { address, source };
        if !settings.admits(address) {
            let words =
                "other machines could reach it; use 127.0.0.1, or set allow_remote = true in [metrics]";
            return Err(refused(io::Error::other(words)));
        }
        let listener = TcpListener::bind(address).await.map_err(refused)?;
        let address = listener.local_addr().map_err(refused)?;
        let exporter = Arc::new(Exporter {
            source: OnceLock::new(),
            web: OnceLock::new(),
            waits_for,
            started: Instant::now(),
            watch: Arc::new(Mutex::new(watch)),
            stopping: AtomicBool::new(false),
            limits,
        });
        let tasks = [
            tokio::spawn(http::serve(listener, Arc::clone(&exporter))),
            tokio::spawn(look_now_and_then(Arc::clone(&exporter))),
        ];
        tracing::info!("metrics on http://{address}/metrics, health on http://{address}/healthz");
        Ok(Some(Self { address, exporter, tasks }))
    }

    /// The service is at work: answers are made from this from here on, those of the console in the browser too.
    pub(crate) fn open(&self, source: Source, web: Option<Web>) {
        // Opened once.
        let _ = self.exporter.source.set(source);
        if let Some(web) = web {
            let _ = self.exporter.web.set(web);
        }
    }

    /// Where it is.
    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }

    /// From now on the service is not healthy: it is about to end.
    pub(crate) fn stopping(&self) {
        self.exporter.stopping.store(true, Ordering::Relaxed);
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

/// Looks at the units again and again, so that what has gone on for a while is known as such when somebody asks.
async fn look_now_and_then(exporter: Arc<Exporter>) {
    let mut interval = tokio::time::interval(exporter.limits.interval);
    interval.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        interval.tick().await;
        // A look that takes too long is told to whoever asks for one.
        let _ = exporter.look(Source::watch_units).await;
    }
}

impl Drop for Endpoint {
    fn drop(&mut self) {
        self.tasks.iter().for_each(JoinHandle::abort);
    }
}

/// What requests are answered from.
#[derive(Debug)]
struct Exporter {
    /// Set when the service is at work.
    source: OnceLock<Source>,
    /// The console in the browser, likewise.
    web: OnceLock<Web>,
    /// What it waits for until then.
    waits_for: String,
    started: Instant,
    watch: Arc<Mutex<Watch>>,
    stopping: AtomicBool,
    limits: Limits,
}

/// Why no look was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum NoLook {
    /// The service is not at work yet.
    Starting,
    /// Something holds the units up.
    TooSlow,
}

impl Exporter {
    /// Has a look taken.
    async fn look<T: Send + 'static>(
        self: &Arc<Self>,
        look: impl FnOnce(&Source, &mut Watch) -> T + Send + 'static,
    ) -> Result<T, NoLook> {
        let exporter = Arc::clone(self);
        let looked = async move {
            // Goes with the work, not with the request: however often somebody asks, one thread looks.
            let mut watch = Arc::clone(&exporter.watch).lock_owned().await;
            tokio::task::spawn_blocking(move || exporter.source.get().map(|source| look(source, &mut watch)))
                .await
        };
        match tokio::time::timeout(self.limits.look, looked).await {
            Ok(Ok(looked)) => looked.ok_or(NoLook::Starting),
            Ok(Err(_)) | Err(_) => Err(NoLook::TooSlow),
        }
    }

    /// Why the service does not receive; `None` where it does.
    fn not_ready(&self) -> Option<String> {
        if self.stopping.load(Ordering::Relaxed) {
            return Some(STOPPING.to_owned());
        }
        self.source
            .get()
            .is_none()
            .then(|| format!("the service is starting: it waits for {}", self.waits_for))
    }
}

#[cfg(test)]
mod tests;
