//! Endpoints as people write them.

use std::net::Ipv6Addr;

/// Where a service listens and a client looks for it if nothing else is said.
pub const DEFAULT_ENDPOINT: &str = "tcp/127.0.0.1:7447";

/// What an endpoint must be.
const MUST_BE: &str = "must be HOST:PORT or PROTOCOL/ADDRESS, such as 127.0.0.1:7447 or tls/imu.example:7447";

/// Links that the programs are built with.
const PROTOCOLS: [&str; 3] = ["tcp", "tls", "unixsock-stream"];

/// Reads an endpoint; `host:port` stands for `tcp/host:port`. What Zenoh puts after the address (`?…`, `#…`) is kept.
///
/// # Errors
/// What it must be, as the second half of a sentence.
pub fn endpoint(text: &str) -> Result<String, String> {
    let text = text.trim();
    let bare = address(text);
    let Some((protocol, address)) = bare.split_once('/') else {
        check_host_and_port(bare)?;
        return Ok(format!("tcp/{text}"));
    };
    if !PROTOCOLS.contains(&protocol) {
        return Err(format!("has the protocol {protocol:?}, must have one of {}", PROTOCOLS.join(", ")));
    }
    match protocol {
        "tcp" | "tls" => check_host_and_port(address)?,
        _ if address.is_empty() => return Err(MUST_BE.to_owned()),
        _ => {}
    }
    Ok(text.to_owned())
}

/// Host and port of an endpoint that has them.
pub(crate) fn host_and_port(endpoint: &str) -> Option<&str> {
    let bare = address(endpoint);
    bare.strip_prefix("tcp/").or_else(|| bare.strip_prefix("tls/"))
}

/// An endpoint without its metadata and options: those of a link with TLS may be the key itself.
#[must_use]
pub fn address(endpoint: &str) -> &str {
    endpoint.split(['?', '#']).next().unwrap_or_default()
}

fn check_host_and_port(text: &str) -> Result<(), String> {
    if text.parse::<Ipv6Addr>().is_ok() {
        return Err(format!("must have its IPv6 address in brackets, and a port: [{text}]:7447"));
    }
    let (host, port) = text.rsplit_once(':').ok_or(MUST_BE)?;
    if host.is_empty() || host.contains(|c: char| c.is_whitespace() || c == '/') {
        return Err(MUST_BE.to_owned());
    }
    if host.contains(':') && !(host.starts_with('[') && host.ends_with(']')) {
        return Err(format!("must have its IPv6 address in brackets: [{host}]:{port}"));
    }
    match port.parse::<u16>() {
        Ok(_) => Ok(()),
        Err(_) => Err(format!("has the port {port:?}, must be 0 to 65535")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_and_a_port_are_tcp_and_what_is_no_endpoint_says_what_one_is() {
        for (text, expected) in [
            ("127.0.0.1:7447", "tcp/127.0.0.1:7447"),
            (" imu.example:1 ", "tcp/imu.example:1"),
            ("[::1]:7447", "tcp/[::1]:7447"),
            (
                "tls/imu.example:7447#verify_name_on_connect=false",
                "tls/imu.example:7447#verify_name_on_connect=false",
            ),
            ("127.0.0.1:7447#iface=lo", "tcp/127.0.0.1:7447#iface=lo"),
            ("unixsock-stream//run/isotherm.sock", "unixsock-stream//run/isotherm.sock"),
        ] {
            assert_eq!(endpoint(text).as_deref(), Ok(expected), "{text}");
        }
        for text in ["", "nonsense", ":7447", "tcp/", "unixsock-stream/"] {
            assert_eq!(endpoint(text).unwrap_err(), MUST_BE, "{text}");
        }
        let wrong = ["127.0.0.1:99999", "tcp/127.0.0.1:", "udp/127.0.0.1:1", "::1", "imu::1:7447"];
        insta::assert_snapshot!(wrong.map(|text| endpoint(text).unwrap_err()).join("\n"));
    }
}
