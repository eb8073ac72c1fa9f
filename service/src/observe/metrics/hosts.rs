//! Under which names the server may be asked for, so that no page of another site reads figures or the console by having its own name
//! resolve to this address (DNS rebinding).

use std::net::{IpAddr, SocketAddr};

use hyper::StatusCode;
use hyper::header::{HOST, HeaderMap, HeaderName};
use hyper::http::uri::Authority;

/// Why a request is not answered.
pub(crate) type Refusal = (StatusCode, &'static str);

/// The names beside the address itself, in small letters.
#[derive(Debug)]
pub(super) struct Hosts(Vec<String>);

impl Hosts {
    pub(super) fn new(hosts: &[String]) -> Self {
        Self(hosts.iter().map(|host| host.to_ascii_lowercase()).collect())
    }

    /// The host, with its port, that the asker believes to speak to, where that is this service: a name that somebody else has the
    /// browser resolve to this address (DNS rebinding) is none of it. `local` is the address that was connected to.
    pub(super) fn asked(&self, headers: &HeaderMap, local: SocketAddr) -> Result<String, Refusal> {
        let refused = (StatusCode::MISDIRECTED_REQUEST, "this host is not served: [web] hosts can name it");
        let host = one(headers, &HOST).ok_or(refused)?.to_ascii_lowercase();
        let authority: Authority = host.parse().map_err(|_| refused)?;
        let name = authority.host();
        let ip = local.ip().to_canonical();
        let own = match ip {
            IpAddr::V4(ip) => name == ip.to_string(),
            IpAddr::V6(ip) => name == format!("[{ip}]"),
        };
        let loopback = ip.is_loopback() && ["localhost", "127.0.0.1", "[::1]"].contains(&name);
        let known = own || loopback || self.0.iter().any(|host| host == name);
        // "name@host" is a host to some and a name to others.
        if known && !host.contains('@') { Ok(host) } else { Err(refused) }
    }
}

/// A header that is there once.
pub(crate) fn one<'h>(headers: &'h HeaderMap, name: &HeaderName) -> Option<&'h str> {
    let mut values = headers.get_all(name).iter();
    let value = values.next()?;
    if values.next().is_some() { None } else { value.to_str().ok() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(lines: &[(&'static str, &str)]) -> HeaderMap {
        let mut headers = HeaderMap::new();
        for (name, value) in lines {
            headers.append(*name, value.parse().unwrap());
        }
        headers
    }

    fn host(host: &str, local: &str) -> bool {
        let hosts = Hosts::new(&["Bench.example".to_owned(), "[fd00::7]".to_owned()]);
        hosts.asked(&headers(&[("host", host)]), local.parse().unwrap()).is_ok()
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
        let hosts = Hosts::new(&[]);
        let twice = headers(&[("host", "localhost"), ("host", "evil.example")]);
        assert!(hosts.asked(&twice, "127.0.0.1:1".parse().unwrap()).is_err());
        assert!(hosts.asked(&headers(&[]), "127.0.0.1:1".parse().unwrap()).is_err());
    }
}
