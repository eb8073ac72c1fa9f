//! Who may ask: no page of another site, and nobody without the token. The host is known by then: `metrics::hosts`.

use hyper::StatusCode;
use hyper::header::{AUTHORIZATION, CONTENT_TYPE, HeaderMap, HeaderName, ORIGIN};
use hyper::http::HeaderValue;
use isotherm_protocol::digest::Digest;

use crate::observe::metrics::hosts::{Refusal, one};

/// What browsers say of where a request comes from.
const FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// Tells who may ask from who may not.
pub(super) struct Guard {
    /// Compared instead of the token: how long that takes says nothing of the token.
    token: Digest,
}

impl std::fmt::Debug for Guard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Guard").finish_non_exhaustive()
    }
}

impl Guard {
    pub(super) fn new(token: &str) -> Self {
        Self { token: Digest::of(token.as_bytes()) }
    }

    /// Whether somebody with the token asks, and no page of another site.
    pub(super) fn caller(&self, headers: &HeaderMap, host: &str) -> Result<(), Refusal> {
        let foreign = (StatusCode::FORBIDDEN, "asked by a page of another site");
        if headers.contains_key(&ORIGIN) && !is_own(headers, host) {
            return Err(foreign);
        }
        let site = headers.get_all(&FETCH_SITE).iter();
        if !site.map(HeaderValue::as_bytes).all(|site| [&b"same-origin"[..], b"none"].contains(&site)) {
            return Err(foreign);
        }
        let bearer = one(headers, &AUTHORIZATION).and_then(|value| {
            let (scheme, token) = value.split_once(' ')?;
            scheme.eq_ignore_ascii_case("bearer").then_some(token.trim())
        });
        if bearer.is_some_and(|token| Digest::of(token.as_bytes()) == self.token) {
            Ok(())
        } else {
            Err((StatusCode::UNAUTHORIZED, "the token is missing or wrong: `isotherm web` prints it"))
        }
    }

    /// Whether a request that may change something comes from the console's own page, and in the one form that no other page
    /// can send unasked.
    pub(super) fn change(headers: &HeaderMap, host: &str) -> Result<(), Refusal> {
        if !is_own(headers, host) {
            return Err((
                StatusCode::FORBIDDEN,
                "a change needs the header Origin of the console's own page",
            ));
        }
        let kind = one(headers, &CONTENT_TYPE).map(|kind| kind.split(';').next().unwrap_or_default().trim());
        if kind.is_some_and(|kind| kind.eq_ignore_ascii_case("application/json")) {
            Ok(())
        } else {
            Err((StatusCode::UNSUPPORTED_MEDIA_TYPE, "a change is application/json"))
        }
    }
}

/// Whether the origin is the host that is spoken to, directly or through a proxy with TLS.
fn is_own(headers: &HeaderMap, host: &str) -> bool {
    one(headers, &ORIGIN).is_some_and(|origin| {
        let of = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
        of.is_some_and(|of| of.eq_ignore_ascii_case(host))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOKEN: &str = "0123456789abcdef0123456789abcdef";

    fn headers(lines: &[(&'static str, &str)]) -> HeaderMap {
        let mut headers = HeaderMap::new();
        for (name, value) in lines {
            headers.append(*name, value.parse().unwrap());
        }
        headers
    }

    fn caller(lines: &[(&'static str, &str)]) -> u16 {
        let guard = Guard::new(TOKEN);
        guard.caller(&headers(lines), "localhost:9464").map_or_else(|(status, _)| status.as_u16(), |()| 200)
    }

    #[test]
    fn nobody_asks_without_the_token() {
        let bearer = format!("Bearer {TOKEN}");
        assert_eq!(caller(&[("authorization", &bearer)]), 200);
        assert_eq!(caller(&[("authorization", &format!("bearer {TOKEN}"))]), 200);
        for wrong in
            ["", "Bearer", "Bearer ", TOKEN, &format!("Basic {TOKEN}"), &format!("{bearer}0"), &bearer[..38]]
        {
            assert_eq!(caller(&[("authorization", wrong)]), 401, "{wrong}");
        }
        assert_eq!(
            caller(&[("cookie", &format!("token={TOKEN}"))]),
            401,
            "a cookie goes where nobody sent it"
        );
        assert_eq!(caller(&[("authorization", &bearer), ("authorization", "Bearer x")]), 401);
    }

    #[test]
    fn pages_of_other_sites_are_refused_even_with_the_token() {
        let bearer = format!("Bearer {TOKEN}");
        let with = |name, value| caller(&[("authorization", &bearer), (name, value)]);
        for own in ["http://localhost:9464", "https://localhost:9464", "HTTP://LOCALHOST:9464"] {
            assert_eq!(with("origin", own), if own.starts_with('H') { 403 } else { 200 }, "{own}");
        }
        for strange in [
            "null",
            "",
            "http://evil.example",
            "http://localhost:9464.evil.example",
            "http://localhost",
            "http://localhost:9465",
            "localhost:9464",
            "file://",
        ] {
            assert_eq!(with("origin", strange), 403, "{strange}");
        }
        for (site, status) in
            [("same-origin", 200), ("none", 200), ("same-site", 403), ("cross-site", 403), ("", 403)]
        {
            assert_eq!(with("sec-fetch-site", site), status, "{site}");
        }
    }

    #[test]
    fn a_change_needs_its_own_page_and_json() {
        let change = |lines: &[(&'static str, &str)]| {
            let changed = Guard::change(&headers(lines), "localhost:9464");
            changed.map_or_else(|(status, _)| status.as_u16(), |()| 200)
        };
        let own = ("origin", "http://localhost:9464");
        assert_eq!(change(&[own, ("content-type", "application/json; charset=utf-8")]), 200);
        // What a form of another site can send without being asked.
        for kind in [
            "text/plain",
            "application/x-www-form-urlencoded",
            "multipart/form-data",
            "",
            "application/jsonx",
        ] {
            assert_eq!(change(&[own, ("content-type", kind)]), 415, "{kind}");
        }
        assert_eq!(change(&[("content-type", "application/json")]), 403, "no origin at all");
        assert_eq!(change(&[("origin", "null"), ("content-type", "application/json")]), 403);
    }
}
