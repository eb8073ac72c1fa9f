//! Who may ask: no page of another site, whatever name it has the browser believe, and nobody without the token.

use std::net::{IpAddr, SocketAddr};

use hyper::StatusCode;
use hyper::header::{AUTHORIZATION, CONTENT_TYPE, HOST, HeaderMap, HeaderName, ORIGIN};
use hyper::http::HeaderValue;
use hyper::http::uri::Authority;
use isotherm_protocol::digest::Digest;

/// What browsers say of where a request comes from.
const FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// Why a request is not answered.
pub(super) type Refusal = (StatusCode, &'static str);

/// Tells who may ask from who may not.
pub(super) struct Guard {
    /// Compared instead of the token: how long that takes says nothing of the token.
    token: Digest,
    hosts: Vec<String>,
}

impl std::fmt::Debug for Guard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Guard").field("hosts", &self.hosts).finish_non_exhaustive()
    }
}

impl Guard {
    pub(super) fn new(token: &str, hosts: &[String]) -> Self {
        let hosts = hosts.iter().map(|host| host.to_ascii_lowercase()).collect();
        Self { token: Digest::of(token.as_bytes()), hosts }
    }

    /// The host, with its port, that the asker believes to speak to, where that is this service: a name that somebody else has the
    /// browser resolve to this address (DNS rebinding) is none of it. `local` is the address that was connected to.
    pub(super) fn host(&self, headers: &HeaderMap, local: SocketAddr) -> Result<String, Refusal> {
        let refused = (StatusCode::MISDIRECTED_REQUEST, "this host is not served: add it to [web] hosts");
        let host = one(headers, &HOST).ok_or(refused)?.to_ascii_lowercase();
        let authority: Authority = host.parse().map_err(|_| refused)?;
        let name = authority.host();
        let ip = local.ip().to_canonical();
        let own = match ip {
            IpAddr::V4(ip) => name == ip.to_string(),
            IpAddr::V6(ip) => name == format!("[{ip}]"),
        };
        let loopback = ip.is_loopback() && ["localhost", "127.0.0.1", "[::1]"].contains(&name);
        let known = own || loopback || self.hosts.iter().any(|host| host == name);
        // "name@host" is a host to some and a name to others.
        if known && !host.contains('@') { Ok(host) } else { Err(refused) }
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

/// A header that is there once.
fn one<'h>(headers: &'h HeaderMap, name: &HeaderName) -> Option<&'h str> {
    let mut values = headers.get_all(name).iter();
    let value = values.next()?;
    if values.next().is_some() { None } else { value.to_str().ok() }
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

    fn host(host: &str, local: &str) -> bool {
        let guard = Guard::new(TOKEN, &["Bench.example".to_owned(), "[fd00::7]".to_owned()]);
        guard.host(&headers(&[("host", host)]), local.parse().unwrap()).is_ok()
    }

    #[test]
    fn only_hosts_that_are_known_are_served() {
        for known in
            ["127.0.0.1:9464", "localhost:9000", "LOCALHOST", "[::1]:80", "bench.example", "[FD00::7]:1"]
        {
            assert!(host(known, "127.0.0.1:9464"), "{known}");
            assert!(host(known, "[::1]:9464"), "{known}");
        }
        for strange in [
            "evil.example",
            "127.0.0.1.evil.example:9464",
            "localhost.evil.example",
            "",
            "127.0.0.2:1",
            "0.0.0.0:9464",
            "x@localhost",
            "localhost@evil.example",
            "localhost:80:80",
            "bench.example.",
            "[::2]",
            "2130706433",
        ] {
            assert!(!host(strange, "127.0.0.1:9464"), "{strange}");
        }
        assert!(host("10.0.0.7:9464", "10.0.0.7:9464"));
        assert!(!host("localhost:9464", "10.0.0.7:9464"), "another machine's localhost is not this one");
        assert!(host("10.0.0.7", "[::ffff:10.0.0.7]:9464"));
        let guard = Guard::new(TOKEN, &[]);
        let twice = headers(&[("host", "localhost"), ("host", "evil.example")]);
        assert!(guard.host(&twice, "127.0.0.1:1".parse().unwrap()).is_err());
        assert!(guard.host(&headers(&[]), "127.0.0.1:1".parse().unwrap()).is_err());
    }

    fn caller(lines: &[(&'static str, &str)]) -> u16 {
        let guard = Guard::new(TOKEN, &[]);
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
