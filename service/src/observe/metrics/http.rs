//! Connections, requests and their limits: HTTP/1.1, one request on each connection.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::header::{
    ACCEPT, ACCEPT_ENCODING, ALLOW, CACHE_CONTROL, CONTENT_ENCODING, CONTENT_TYPE, HeaderMap, HeaderName,
};
use hyper::http::HeaderValue;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use isotherm_protocol::service_status::ServiceStatus;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::{AbortHandle, JoinSet};

use super::health::{Kind, Reason};
use super::page::{pack, page};
use super::source::{Look, Source, Verdict};
use super::{Exporter, NoLook};

/// Most connections at a time; a further one takes the place of the oldest that has not asked for anything yet, else of the oldest that
/// does not take its answer.
pub(super) const MAX_CONNECTIONS: usize = 64;
/// How long an answer may be on its way while others wait for a place.
const TAKEN_WITHIN: Duration = Duration::from_secs(1);
/// Longest head of a request: a scraper needs a few hundred bytes.
pub(super) const MAX_HEAD_BYTES: usize = 8192;
/// Most header fields of a request.
const MAX_HEADERS: usize = 64;
/// How long nothing is accepted after the system could give no connection.
const PAUSE: Duration = Duration::from_millis(100);

/// What the page is, for those who ask for it by its name.
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
/// For all others the same text: it is good Prometheus text too.
const PROMETHEUS: &str = "text/plain; version=0.0.4; charset=utf-8";
pub(crate) const JSON: &str = "application/json";
const PLAIN: &str = "text/plain; charset=utf-8";

/// What is answered.
pub(crate) type Answer = Response<Full<Bytes>>;

/// A connection that is being served.
struct Open {
    progress: Arc<Progress>,
    task: AbortHandle,
}

/// How far a connection is.
#[derive(Default)]
struct Progress {
    /// The head of a request has come.
    asked: AtomicBool,
    /// The answer was made then.
    answered: OnceLock<Instant>,
}

/// Takes connections until it is dropped, and with it every connection.
///
/// Whoever says nothing holds a place only as long as nobody needs it: a request comes with the first packet.
pub(super) async fn serve(listener: TcpListener, exporter: Arc<Exporter>) {
    let mut connections = JoinSet::new();
    let mut open: VecDeque<Open> = VecDeque::new();
    let mut told = false;
    loop {
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            Err(error) => {
                if !std::mem::replace(&mut told, true) {
                    tracing::warn!(
                        "metrics: cannot accept a connection: {error}; further failures are not reported"
                    );
                }
                tokio::time::sleep(PAUSE).await;
                continue;
            }
        };
        while connections.try_join_next().is_some() {}
        open.retain(|connection| !connection.task.is_finished());
        while open.len() >= MAX_CONNECTIONS {
            let idle = open.iter().position(Open::is_silent);
            let idle = idle.or_else(|| open.iter().position(Open::is_stuck));
            if let Some(idle) = idle.and_then(|idle| open.remove(idle)) {
                idle.task.abort();
            } else {
                // Most of them wait for the same look.
                let _ = tokio::time::timeout(PAUSE, connections.join_next()).await;
                open.retain(|connection| !connection.task.is_finished());
            }
        }
        let progress = Arc::<Progress>::default();
        let (exporter, mark) = (Arc::clone(&exporter), Arc::clone(&progress));
        let task = connections.spawn(async move { connection(stream, &exporter, &mark).await });
        open.push_back(Open { progress, task });
    }
}

impl Open {
    /// Nothing was asked for.
    fn is_silent(&self) -> bool {
        !self.progress.asked.load(Ordering::Relaxed)
    }

    /// The answer is not taken.
    fn is_stuck(&self) -> bool {
        self.progress.answered.get().is_some_and(|answered| answered.elapsed() > TAKEN_WITHIN)
    }
}

/// Answers one request within its time.
async fn connection(stream: TcpStream, exporter: &Arc<Exporter>, progress: &Progress) {
    // Whoever has gone already is not answered.
    let Ok(local) = stream.local_addr() else { return };
    let answering = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(exporter.limits.head)
        .max_buf_size(MAX_HEAD_BYTES)
        .max_headers(MAX_HEADERS)
        .keep_alive(false)
        // Who has said everything may still be listening.
        .half_close(true)
        .serve_connection(
            TokioIo::new(stream),
            service_fn(async |request| {
                progress.asked.store(true, Ordering::Relaxed);
                let answer = answer(request, exporter, local).await;
                let _ = progress.answered.set(Instant::now());
                answer
            }),
        );
    // Whoever went away or was too slow need not be told of.
    let _ = tokio::time::timeout(exporter.limits.connection, answering).await;
}

async fn answer(
    request: Request<Incoming>,
    exporter: &Arc<Exporter>,
    local: SocketAddr,
) -> Result<Answer, Infallible> {
    // Of HEAD hyper sends the head alone.
    let reads = [Method::GET, Method::HEAD].contains(request.method());
    let answer = match request.uri().path() {
        "/metrics" if reads => metrics(&request, exporter).await,
        "/healthz" if reads => healthz(exporter).await,
        // Nothing is looked at here: whether the process is worth keeping, and whether the service receives.
        "/livez" if reads => match exporter.source.get().map_or(Ok(()), Source::receives) {
            Ok(()) => text(StatusCode::OK, PLAIN, "alive\n"),
            Err(stuck) => text(StatusCode::SERVICE_UNAVAILABLE, PLAIN, format!("{stuck}\n")),
        },
        // A unit that is held up takes nothing of it.
        "/readyz" if reads => match exporter.not_ready() {
            None => text(StatusCode::OK, PLAIN, "ready\n"),
            Some(words) => text(StatusCode::SERVICE_UNAVAILABLE, PLAIN, words + "\n"),
        },
        "/metrics" | "/healthz" | "/livez" | "/readyz" => {
            let mut answer = text(StatusCode::METHOD_NOT_ALLOWED, PLAIN, "only GET and HEAD\n");
            answer.headers_mut().insert(ALLOW, HeaderValue::from_static("GET, HEAD"));
            answer
        }
        _ => match exporter.web.get() {
            Some(web) => web.answer(request, local).await,
            None => None,
        }
        .unwrap_or_else(|| {
            let words = "not found; there are /metrics, /livez, /readyz and /healthz\n";
            text(StatusCode::NOT_FOUND, PLAIN, words)
        }),
    };
    Ok(answer)
}

async fn metrics(request: &Request<Incoming>, exporter: &Arc<Exporter>) -> Answer {
    let open = takes(request.headers(), &ACCEPT, "application/openmetrics-text");
    let packed = takes(request.headers(), &ACCEPT_ENCODING, "gzip");
    let stopping = exporter.stopping.load(Ordering::Relaxed);
    let write = move |look: Look| {
        let page = page(look)?;
        if packed { pack(&page).map(Bytes::from) } else { Ok(Bytes::from(page)) }
    };
    // Text is made, and packed, on the same thread: it takes longer than the look.
    let made = match exporter.look(move |source, watch| write(source.look(watch, stopping))).await {
        Err(NoLook::Starting) => write(Look::starting(exporter.started.elapsed())),
        Err(NoLook::TooSlow) => {
            return text(StatusCode::SERVICE_UNAVAILABLE, PLAIN, "units could not be read in time\n");
        }
        Ok(made) => made,
    };
    match made {
        Ok(page) => good(packed, if open { OPEN_METRICS } else { PROMETHEUS }, page),
        Err(error) => text(StatusCode::INTERNAL_SERVER_ERROR, PLAIN, format!("{error}\n")),
    }
}

async fn healthz(exporter: &Arc<Exporter>) -> Answer {
    let stopping = exporter.stopping.load(Ordering::Relaxed);
    let uptime_s = exporter.started.elapsed().as_secs_f64();
    let verdict = match exporter.look(move |source, watch| source.judge(watch, stopping)).await {
        Ok(verdict) => verdict,
        Err(why) => {
            let limit_s = exporter.limits.look.as_secs_f64();
            let (kind, words) = match why {
                NoLook::Starting => (Kind::Starting, exporter.not_ready().unwrap_or_default()),
                NoLook::TooSlow => (
                    Kind::Busy,
                    format!(
                        "units or state folder could not be read within {limit_s} s: a slow subscriber or disk \
                         blocks them"
                    ),
                ),
            };
            let service = ServiceStatus { uptime_s, ..ServiceStatus::default() };
            Verdict::new(service, vec![Reason { kind, unit: None, words }])
        }
    };
    let status = if verdict.is_healthy() { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    match serde_json::to_string(&verdict) {
        Ok(json) => text(status, JSON, json + "\n"),
        Err(error) => text(StatusCode::INTERNAL_SERVER_ERROR, PLAIN, format!("{error}\n")),
    }
}

/// Whether a header says that something is taken. "q=0" says that it is not.
fn takes(headers: &HeaderMap, header: &HeaderName, what: &str) -> bool {
    let values = headers.get_all(header).iter().filter_map(|value| value.to_str().ok());
    values.flat_map(|value| value.split(',')).any(|item| {
        let mut parts = item.split(';').map(str::trim);
        let refused = |part: &str| {
            part.strip_prefix("q=")
                .and_then(|weight| weight.parse::<f64>().ok())
                .is_some_and(|weight| weight <= 0.0)
        };
        parts.next().is_some_and(|name| name.eq_ignore_ascii_case(what)) && !parts.any(refused)
    })
}

/// Text in a tenth of its bytes, for those who take it so.
pub(crate) fn packed(headers: &HeaderMap, kind: &'static str, body: &str) -> Answer {
    match takes(headers, &ACCEPT_ENCODING, "gzip").then(|| pack(body)) {
        Some(Ok(body)) => good(true, kind, body),
        _ => good(false, kind, body.to_owned()),
    }
}

/// What was asked for, packed or not.
fn good(packed: bool, kind: &'static str, body: impl Into<Bytes>) -> Answer {
    let mut answer = text(StatusCode::OK, kind, body);
    if packed {
        answer.headers_mut().insert(CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    }
    answer
}

/// Text as it is.
pub(crate) fn text(status: StatusCode, kind: &'static str, body: impl Into<Bytes>) -> Answer {
    let mut answer = Response::new(Full::new(body.into()));
    *answer.status_mut() = status;
    answer.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(kind));
    answer.headers_mut().insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
    answer
}
