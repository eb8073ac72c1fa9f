//! Pages of the console in the browser, open beside a chain at work: they ask for what a browser asks for, as often.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::round::joined;
use crate::clock::{now_ns, sleep_until};
use crate::error::Error;
use crate::part::unit_name;

/// Token of the service under test.
pub(super) const TOKEN: &str = "a-token-for-measurements-0123456789";
/// Time between two looks of a page (ns), as in its script.
const LOOK_NS: u64 = 1_000_000_000;
/// How long an answer may take.
const LIMIT: Duration = Duration::from_secs(10);

/// A page of all units, and one of the first unit with its live chart, at the service's address for HTTP: open until `closed`. An error
/// where one was not answered, or never.
pub(super) fn look(address: &str, closed: &AtomicBool) -> Result<(), Error> {
    let host = address.strip_prefix("http://").unwrap_or(address);
    let address: SocketAddr = host.parse().map_err(Error::of("page"))?;
    let unit = unit_name(0)?;
    let asked = [
        ("/api/units".to_owned(), LOOK_NS),
        (format!("/api/unit/{unit}"), LOOK_NS),
        // One answer after the other: each takes half a second.
        (format!("/api/unit/{unit}/live"), 0),
    ];
    std::thread::scope(|scope| {
        let pages = asked.map(|(path, period_ns)| {
            scope.spawn(move || look_at(address, &path, period_ns, closed).map_err(Error::of("page")))
        });
        pages.into_iter().try_for_each(joined)
    })
}

/// Asks until the page is closed.
fn look_at(address: SocketAddr, path: &str, period_ns: u64, closed: &AtomicBool) -> Result<(), String> {
    let mut answers = 0;
    while !closed.load(Ordering::Relaxed) {
        let next = now_ns() + period_ns;
        let answer = ask(address, path).map_err(|error| format!("{path}: {error}"))?;
        if !answer.starts_with(b"HTTP/1.1 200 ") {
            let head = String::from_utf8_lossy(answer.get(..40).unwrap_or(&answer)).into_owned();
            return Err(format!("{path}: {head}"));
        }
        answers += 1;
        sleep_until(next);
    }
    if answers == 0 { Err(format!("{path}: it was never answered")) } else { Ok(()) }
}

fn ask(address: SocketAddr, path: &str) -> std::io::Result<Vec<u8>> {
    let mut stream = TcpStream::connect(address)?;
    stream.set_read_timeout(Some(LIMIT))?;
    write!(
        stream,
        "GET {path} HTTP/1.1\r\nHost: {address}\r\nAuthorization: Bearer {TOKEN}\r\nAccept-Encoding: gzip\r\n\r\n"
    )?;
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer)?;
    Ok(answer)
}
