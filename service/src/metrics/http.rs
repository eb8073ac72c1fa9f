//! Connections, requests and their limits: HTTP/1.1, one request on each connection.

use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

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
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::task::JoinSet;

use super::Desk;
use super::page::{pack, page};

/// Most connections at a time; further ones wait until one of these is over.
pub(super) const MAX_CONNECTIONS: usize = 16;
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
const JSON: &str = "application/json";
const PLAIN: &str = "text/plain; charset=utf-8";

type Answer = Response<Full<Bytes>>;

/// Takes connections until it is dropped, and with it every connection.
pub(super) async fn serve(listener: TcpListener, desk: Arc<Desk>) {
    let places = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    let mut connections = JoinSet::new();
    let mut told = false;
    while let Ok(place) = Arc::clone(&places).acquire_owned().await {
        while connections.try_join_next().is_some() {}
        match listener.accept().await {
            Ok((stream, _)) => {
                let desk = Arc::clone(&desk);
                connections.spawn(async move {
                    connection(stream, &desk).await;
                    drop(place);
                });
            }
            Err(error) => {
                if !std::mem::replace(&mut told, true) {
                    tracing::warn!("metrics: cannot accept a connection: {error}; further ones are not told");
                }
                tokio::time::sleep(PAUSE).await;
            }
        }
    }
}

/// Answers one request within its time.
async fn connection(stream: TcpStream, desk: &Arc<Desk>) {
    let answering = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(desk.limits.head)
        .max_buf_size(MAX_HEAD_BYTES)
        .max_headers(MAX_HEADERS)
        .keep_alive(false)
        // Who has said everything may still be listening.
        .half_close(true)
        .serve_connection(TokioIo::new(stream), service_fn(|request| answer(request, desk)));
    // Whoever went away or was too slow need not be told of.
    let _ = tokio::time::timeout(desk.limits.connection, answering).await;
}

async fn answer(request: Request<Incoming>, desk: &Arc<Desk>) -> Result<Answer, Infallible> {
    // Of HEAD hyper sends the head alone.
    let reads = [Method::GET, Method::HEAD].contains(request.method());
    let answer = match request.uri().path() {
        "/metrics" if reads => metrics(&request, desk).await,
        "/healthz" if reads => healthz(desk).await,
        "/metrics" | "/healthz" => {
            let mut answer = text(StatusCode::METHOD_NOT_ALLOWED, PLAIN, "only GET and HEAD\n");
            answer.headers_mut().insert(ALLOW, HeaderValue::from_static("GET, HEAD"));
            answer
        }
        _ => text(StatusCode::NOT_FOUND, PLAIN, "not found; there are /metrics and /healthz\n"),
    };
    Ok(answer)
}

async fn metrics(request: &Request<Incoming>, desk: &Arc<Desk>) -> Answer {
    let open = takes(request.headers(), &ACCEPT, "application/openmetrics-text");
    let packed = takes(request.headers(), &ACCEPT_ENCODING, "gzip");
    let stopping = desk.stopping.load(Ordering::Relaxed);
    // Text is made, and packed, on the same thread: it takes longer than the look.
    let made = desk.look(move |source, watch| {
        let page = page(source.look(watch, stopping))?;
        if packed { pack(&page).map(Bytes::from) } else { Ok(Bytes::from(page)) }
    });
    match made.await {
        Some(Ok(page)) => {
            let mut answer = text(StatusCode::OK, if open { OPEN_METRICS } else { PROMETHEUS }, page);
            if packed {
                answer.headers_mut().insert(CONTENT_ENCODING, HeaderValue::from_static("gzip"));
            }
            answer
        }
        Some(Err(error)) => text(StatusCode::INTERNAL_SERVER_ERROR, PLAIN, format!("{error}\n")),
        None => text(StatusCode::SERVICE_UNAVAILABLE, PLAIN, "units could not be looked at in time\n"),
    }
}

async fn healthz(desk: &Arc<Desk>) -> Answer {
    let stopping = desk.stopping.load(Ordering::Relaxed);
    let verdict = desk.look(move |source, watch| source.judge(watch, stopping)).await;
    let verdict = verdict.unwrap_or_else(|| desk.source.too_busy(desk.limits.look));
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

fn text(status: StatusCode, kind: &'static str, body: impl Into<Bytes>) -> Answer {
    let mut answer = Response::new(Full::new(body.into()));
    *answer.status_mut() = status;
    answer.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static(kind));
    answer.headers_mut().insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
    answer
}
