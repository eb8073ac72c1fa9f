//! Which request is answered with what.

use std::sync::Arc;

use http_body_util::{BodyExt, Limited};
use hyper::body::Incoming;
use hyper::header::{ALLOW, CONTENT_DISPOSITION, HeaderName, WWW_AUTHENTICATE};
use hyper::http::HeaderValue;
use hyper::{Method, Request, StatusCode};
use isotherm_protocol::control::{CommandOrder, MAX_BY, Order, Schedule, SwapOptions};
use isotherm_protocol::document::MAX_DOCUMENT_BYTES;
use isotherm_protocol::key::{self, UnitId};
use serde::Deserialize;
use serde_json::json;

use super::guard::{Guard, Refusal};
use super::{Web, assets, live};
use crate::observe::metrics::http::{Answer, JSON, packed, text};
use isotherm_operator::ConsoleError;

/// Longest body of a request: a document, each of its characters written in JSON.
const MAX_BODY: usize = 6 * MAX_DOCUMENT_BYTES + 4096;
/// Entries of a history that can be asked for.
const MAX_ENTRIES: usize = 1000;

/// What browsers are told to keep to.
const HEADERS: [(HeaderName, &str); 6] = [
    (
        HeaderName::from_static("content-security-policy"),
        "default-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'; object-src 'none'",
    ),
    (HeaderName::from_static("x-frame-options"), "DENY"),
    (HeaderName::from_static("x-content-type-options"), "nosniff"),
    (HeaderName::from_static("referrer-policy"), "no-referrer"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
];

/// What there is to say: its kind and itself; or why there is nothing.
type Made = Result<(&'static str, String), (StatusCode, String)>;

/// A swap, as the page asks for it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SwapRequest {
    document: String,
    #[serde(default)]
    by: String,
    #[serde(default)]
    dry_run: bool,
    #[serde(default)]
    force: bool,
    #[serde(default)]
    any_serial: bool,
    slew_s: Option<f64>,
    at_sequence: Option<u64>,
}

/// What is asked for.
enum Route<'p> {
    Units,
    Bundle(Option<&'p str>),
    Unit(&'p str),
    Live(UnitId),
    History(UnitId),
    Document(UnitId),
    Swap(UnitId),
    Command(UnitId),
}

impl<'p> Route<'p> {
    fn of(path: &'p str) -> Option<Self> {
        let parts: Vec<_> = path.strip_prefix("/api/")?.split('/').collect();
        // Serials hold none of the characters that a path has to write otherwise; another one is no unit's.
        let id = |serial: &str| UnitId::new(serial).ok();
        Some(match *parts.as_slice() {
            ["units"] => Self::Units,
            ["bundle"] => Self::Bundle(None),
            ["unit", serial] => Self::Unit(serial),
            ["unit", serial, "bundle"] => Self::Bundle(Some(serial)),
            ["unit", serial, "live"] => Self::Live(id(serial)?),
            ["unit", serial, "history"] => Self::History(id(serial)?),
            ["unit", serial, "document"] => Self::Document(id(serial)?),
            ["unit", serial, "swap"] => Self::Swap(id(serial)?),
            ["unit", serial, "command"] => Self::Command(id(serial)?),
            _ => return None,
        })
    }

    fn changes(&self) -> bool {
        matches!(self, Self::Swap(_) | Self::Command(_))
    }
}

impl Web {
    /// Answers a request that came to the address `local`; `None` for what is not the console's.
    pub(crate) async fn answer(
        &self,
        request: Request<Incoming>,
        local: std::net::SocketAddr,
    ) -> Option<Answer> {
        let path = request.uri().path().to_owned();
        let asset = assets::find(&path);
        let route = Route::of(&path);
        if asset.is_none() && !path.starts_with("/api/") {
            return None;
        }
        let mut answer = match self.guard.host(request.headers(), local) {
            Err(refusal) => refused(refusal),
            Ok(host) => match (asset, route) {
                (Some(asset), _) if is_read(request.method()) => {
                    packed(request.headers(), asset.kind, &asset.text)
                }
                (Some(_), _) => not_allowed("GET, HEAD"),
                (None, route) => match self.guard.caller(request.headers(), &host) {
                    Err(refusal) => refused(refusal),
                    Ok(()) => self.ask(route, request, &host).await,
                },
            },
        };
        for (name, value) in HEADERS {
            answer.headers_mut().insert(name, HeaderValue::from_static(value));
        }
        Some(answer)
    }

    /// Answers somebody who may ask.
    async fn ask(&self, route: Option<Route<'_>>, request: Request<Incoming>, host: &str) -> Answer {
        let Some(route) = route else { return refused((StatusCode::NOT_FOUND, "not found")) };
        if route.changes() {
            if request.method() != Method::POST {
                return not_allowed("POST");
            }
            return match Guard::change(request.headers(), host) {
                Err(refusal) => refused(refusal),
                Ok(()) => self.change(route, request).await,
            };
        }
        if !is_read(request.method()) {
            return not_allowed("GET, HEAD");
        }
        let headers = request.headers().clone();
        let made = match route {
            Route::Units => of_json(self.units()),
            Route::Unit(serial) => self.unit(serial).map_or_else(|| Err(no_unit(serial)), of_json),
            Route::Live(unit) => self.watch(unit).await,
            Route::History(unit) => {
                let limit = limit(request.uri().query().unwrap_or_default());
                let parameters = format!("limit={limit}");
                of_bus(self.client.text(&key::history(&unit), &parameters, None).await, JSON)
            }
            Route::Document(unit) => {
                let document = self.client.text(&key::calibration(&unit), "", None).await;
                of_bus(document, "text/plain; charset=utf-8")
            }
            Route::Bundle(unit) => return self.download(unit).await,
            Route::Swap(_) | Route::Command(_) => {
                Err((StatusCode::METHOD_NOT_ALLOWED, "only POST".to_owned()))
            }
        };
        match made {
            Ok((kind, body)) => packed(&headers, kind, &body),
            Err((status, words)) => said(status, &words),
        }
    }

    /// Half a second of a unit's ticks.
    async fn watch(&self, unit: UnitId) -> Made {
        let Ok(permit) = Arc::clone(&self.live).try_acquire_owned() else {
            return Err((StatusCode::SERVICE_UNAVAILABLE, "too many live charts are open".to_owned()));
        };
        let intake = Arc::clone(&self.intake);
        let watched = tokio::task::spawn_blocking(move || {
            let _permit = permit;
            live::watch(&intake, &unit).map(|live| serde_json::to_string(&live)).ok_or(unit)
        });
        match watched.await {
            Ok(Ok(live)) => of_json(live),
            Ok(Err(unit)) => Err(no_unit(unit.as_str())),
            Err(_) => Err((StatusCode::INTERNAL_SERVER_ERROR, "the unit could not be read".to_owned())),
        }
    }

    async fn download(&self, unit: Option<&str>) -> Answer {
        match self.bundle(unit).await {
            Ok(file) => {
                let mut answer = text(StatusCode::OK, "application/gzip", file);
                let name = HeaderValue::from_static("attachment; filename=\"isotherm-report.tar.gz\"");
                answer.headers_mut().insert(CONTENT_DISPOSITION, name);
                answer
            }
            Err(error) => said(StatusCode::INTERNAL_SERVER_ERROR, &error.to_string()),
        }
    }

    /// Asks on the bus for what may change something, as the commands `swap`, `rollback` and `command` do.
    async fn change(&self, route: Route<'_>, request: Request<Incoming>) -> Answer {
        let body = match Limited::new(request.into_body(), MAX_BODY).collect().await {
            Ok(body) => body.to_bytes(),
            Err(_) => {
                return refused((StatusCode::PAYLOAD_TOO_LARGE, "longer than any document, or cut short"));
            }
        };
        match self.question(&route, &body) {
            Ok((key, parameters, payload)) => {
                match of_bus(self.client.text(&key, &parameters, Some(&payload)).await, JSON) {
                    Ok((kind, body)) => text(StatusCode::OK, kind, body),
                    Err((status, words)) => said(status, &words),
                }
            }
            Err((status, words)) => said(status, &words),
        }
    }

    /// The question on the bus that a body stands for: key, parameters, payload.
    fn question(
        &self,
        route: &Route<'_>,
        body: &[u8],
    ) -> Result<(String, String, Vec<u8>), (StatusCode, String)> {
        let bad = |words: String| (StatusCode::BAD_REQUEST, words);
        let (by, dry_run, question) = match route {
            Route::Swap(unit) => {
                let asked: SwapRequest = serde_json::from_slice(body)
                    .map_err(|error| bad(format!("the swap cannot be read: {error}")))?;
                let options = SwapOptions {
                    by: asked.by,
                    dry_run: asked.dry_run,
                    schedule: asked.at_sequence.map_or(Schedule::NextTick, Schedule::Sequence),
                    slew_s: asked.slew_s,
                    any_serial: asked.any_serial,
                    force: asked.force,
                };
                let parameters = options.to_parameters();
                SwapOptions::parse(&parameters).map_err(|error| bad(error.to_string()))?;
                let question = (key::calibration(unit), parameters, asked.document.into_bytes());
                (options.by, options.dry_run, question)
            }
            Route::Command(unit) => {
                let order = CommandOrder::read(body).map_err(bad)?;
                let dry_run = matches!(order.order, Order::Rollback { dry_run: true, .. });
                (order.by, dry_run, (key::command(unit), String::new(), body.to_vec()))
            }
            _ => return Err((StatusCode::NOT_FOUND, "not found".to_owned())),
        };
        if dry_run {
            return Ok(question);
        }
        if !self.write {
            let words = "this console is read-only: set write = true in [web], and restart the service";
            return Err((StatusCode::FORBIDDEN, words.to_owned()));
        }
        if by.trim().is_empty() || by.chars().count() > MAX_BY {
            return Err(bad(format!("give your name for the audit file, in 1 to {MAX_BY} characters")));
        }
        Ok(question)
    }
}

fn is_read(method: &Method) -> bool {
    [Method::GET, Method::HEAD].contains(method)
}

/// Reads `limit=20`.
fn limit(query: &str) -> usize {
    let limit = query.split('&').find_map(|part| part.strip_prefix("limit=")?.parse().ok());
    limit.unwrap_or(50).clamp(1, MAX_ENTRIES)
}

fn of_json(json: serde_json::Result<String>) -> Made {
    json.map(|json| (JSON, json)).map_err(|error| (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()))
}

fn of_bus(answer: Result<String, ConsoleError>, kind: &'static str) -> Made {
    answer.map(|body| (kind, body)).map_err(|error| match error {
        ConsoleError::Refused(words) => (StatusCode::CONFLICT, words),
        error => (StatusCode::GATEWAY_TIMEOUT, error.to_string()),
    })
}

fn no_unit(serial: &str) -> (StatusCode, String) {
    (StatusCode::NOT_FOUND, format!("this service knows no unit {serial}"))
}

fn refused((status, words): Refusal) -> Answer {
    let mut answer = said(status, words);
    if status == StatusCode::UNAUTHORIZED {
        answer.headers_mut().insert(WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
    }
    answer
}

fn not_allowed(methods: &'static str) -> Answer {
    let mut answer = said(StatusCode::METHOD_NOT_ALLOWED, &format!("only {methods}"));
    answer.headers_mut().insert(ALLOW, HeaderValue::from_static(methods));
    answer
}

/// Words, as JSON.
fn said(status: StatusCode, words: &str) -> Answer {
    text(status, JSON, json!({ "error": words }).to_string())
}
