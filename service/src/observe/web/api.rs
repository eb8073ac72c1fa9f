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

/// There is no other way to ask for what is read.
const READS: Refused = Refused::Method("GET, HEAD");
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

/// What is answered, or why not.
type Made = Result<Answer, Refused>;

/// Why a request is not answered.
enum Refused {
    /// In words.
    Said(StatusCode, String),
    /// It came with another method than there are.
    Method(&'static str),
}

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
        if assets::find(&path).is_none() && !path.starts_with("/api/") {
            return None;
        }
        let mut answer = self.ask(&path, request, local).await.unwrap_or_else(Refused::answer);
        for (name, value) in HEADERS {
            answer.headers_mut().insert(name, HeaderValue::from_static(value));
        }
        Some(answer)
    }

    /// Answers whoever may ask.
    async fn ask(&self, path: &str, request: Request<Incoming>, local: std::net::SocketAddr) -> Made {
        let headers = request.headers().clone();
        let host = self.guard.host(&headers, local)?;
        let reads = [Method::GET, Method::HEAD].contains(request.method());
        if let Some(asset) = assets::find(path) {
            let only_reads = reads.then_some(()).ok_or(READS);
            return only_reads.map(|()| packed(&headers, asset.kind, &asset.text));
        }
        self.guard.caller(&headers, &host)?;
        let route = Route::of(path).ok_or((StatusCode::NOT_FOUND, "not found"))?;
        if route.changes() {
            if request.method() != Method::POST {
                return Err(Refused::Method("POST"));
            }
            Guard::change(&headers, &host)?;
        } else if !reads {
            return Err(READS);
        }
        let (kind, body) = match &route {
            Route::Units => (JSON, self.units()?),
            Route::Unit(serial) => (JSON, self.unit(serial).ok_or_else(|| no_unit(serial))??),
            Route::Live(unit) => (JSON, self.watch(unit).await?),
            Route::History(unit) => {
                let limit = limit(request.uri().query().unwrap_or_default());
                (JSON, self.client.text(&key::history(unit), &format!("limit={limit}"), None).await?)
            }
            Route::Document(unit) => {
                ("text/plain; charset=utf-8", self.client.text(&key::calibration(unit), "", None).await?)
            }
            Route::Bundle(unit) => return self.download(*unit).await,
            Route::Swap(_) | Route::Command(_) => return self.change(&route, request).await,
        };
        Ok(packed(&headers, kind, &body))
    }

    /// Half a second of a unit's ticks.
    async fn watch(&self, unit: &UnitId) -> Result<String, Refused> {
        let Ok(permit) = Arc::clone(&self.live).try_acquire_owned() else {
            return Err((StatusCode::SERVICE_UNAVAILABLE, "too many live charts are open").into());
        };
        let (intake, of) = (Arc::clone(&self.intake), unit.clone());
        let watched = tokio::task::spawn_blocking(move || {
            let _permit = permit;
            live::watch(&intake, &of)
        });
        let Ok(live) = watched.await else {
            return Err((StatusCode::INTERNAL_SERVER_ERROR, "the unit could not be read").into());
        };
        Ok(serde_json::to_string(&live.ok_or_else(|| no_unit(unit.as_str()))?)?)
    }

    async fn download(&self, unit: Option<&str>) -> Made {
        let file = self.bundle(unit).await.map_err(|error| failed(&error))?;
        let mut answer = text(StatusCode::OK, "application/gzip", file);
        let name = HeaderValue::from_static("attachment; filename=\"isotherm-report.tar.gz\"");
        answer.headers_mut().insert(CONTENT_DISPOSITION, name);
        Ok(answer)
    }

    /// Asks on the bus for what may change something, as the commands `swap`, `rollback` and `command` do.
    async fn change(&self, route: &Route<'_>, request: Request<Incoming>) -> Made {
        let Ok(body) = Limited::new(request.into_body(), MAX_BODY).collect().await else {
            let words = "longer than any document, or cut short";
            return Err((StatusCode::PAYLOAD_TOO_LARGE, words).into());
        };
        let (key, parameters, payload) = self.question(route, &body.to_bytes())?;
        Ok(text(StatusCode::OK, JSON, self.client.text(&key, &parameters, Some(&payload)).await?))
    }

    /// The question on the bus that a body stands for: key, parameters, payload.
    fn question(&self, route: &Route<'_>, body: &[u8]) -> Result<(String, String, Vec<u8>), Refused> {
        let bad = |words: String| Refused::Said(StatusCode::BAD_REQUEST, words);
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
            _ => return Err((StatusCode::NOT_FOUND, "not found").into()),
        };
        if dry_run {
            return Ok(question);
        }
        if !self.write {
            let words = "this console is read-only: set write = true in [web], and restart the service";
            return Err((StatusCode::FORBIDDEN, words).into());
        }
        if by.trim().is_empty() || by.chars().count() > MAX_BY {
            return Err(bad(format!("give your name for the audit file, in 1 to {MAX_BY} characters")));
        }
        Ok(question)
    }
}

/// Reads `limit=20`.
fn limit(query: &str) -> usize {
    let limit = query.split('&').find_map(|part| part.strip_prefix("limit=")?.parse().ok());
    limit.unwrap_or(50).clamp(1, MAX_ENTRIES)
}

impl Refused {
    fn answer(self) -> Answer {
        let (status, words, header) = match self {
            Self::Method(methods) => {
                (StatusCode::METHOD_NOT_ALLOWED, format!("only {methods}"), Some((ALLOW, methods)))
            }
            Self::Said(status @ StatusCode::UNAUTHORIZED, words) => {
                (status, words, Some((WWW_AUTHENTICATE, "Bearer")))
            }
            Self::Said(status, words) => (status, words, None),
        };
        let mut answer = text(status, JSON, json!({ "error": words }).to_string());
        if let Some((name, value)) = header {
            answer.headers_mut().insert(name, HeaderValue::from_static(value));
        }
        answer
    }
}

impl From<Refusal> for Refused {
    fn from((status, words): Refusal) -> Self {
        Self::Said(status, words.to_owned())
    }
}

impl From<serde_json::Error> for Refused {
    fn from(error: serde_json::Error) -> Self {
        failed(&error)
    }
}

impl From<ConsoleError> for Refused {
    fn from(error: ConsoleError) -> Self {
        match error {
            ConsoleError::Refused(words) => Self::Said(StatusCode::CONFLICT, words),
            error => Self::Said(StatusCode::GATEWAY_TIMEOUT, error.to_string()),
        }
    }
}

fn failed(error: &impl ToString) -> Refused {
    Refused::Said(StatusCode::INTERNAL_SERVER_ERROR, error.to_string())
}

fn no_unit(serial: &str) -> Refused {
    Refused::Said(StatusCode::NOT_FOUND, format!("this service knows no unit {serial}"))
}
