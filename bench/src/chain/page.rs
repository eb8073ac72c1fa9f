//! Pages of the console in the browser, open beside a chain at work: they ask for what a browser asks for, as often.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::clock::{now_ns, sleep_until};
use crate::error::Error;
use crate::part::unit_name;

/// Token of the service under test.
pub(super) const TOKEN: &str = "a-token-for-measurements-0123456789";
/// Time between two looks of a page (ns), as in its script.
const LOOK_NS: u64 = 1_000_000_000;
/// How long an answer may take.
const LIMIT: Duration = Duration::from_secs(10);

/// A page of all units, and one of the first unit with its live chart.
#[derive(Debug)]
pub(super) struct Pages {
    closed: Arc<AtomicBool>,
    threads: Vec<JoinHandle<Result<u64, Error>>>,
}

impl Pages {
    /// Opens them at the service's address for HTTP.
    pub(super) fn open(address: &str) -> Result<Self, Error> {
        let wrong = |what: String| Error::Part { part: "page", what };
        let host = address.strip_prefix("http://").unwrap_or(address);
        let address: SocketAddr = host.parse().map_err(|error| wrong(format!("{address}: {error}")))?;
        let unit = unit_name(0)?;
        let closed = Arc::new(AtomicBool::new(false));
        let asked = [
            ("/api/units".to_owned(), LOOK_NS),
            (format!("/api/unit/{unit}"), LOOK_NS),
            // One answer after the other: each takes half a second.
            (format!("/api/unit/{unit}/live"), 0),
        ];
        let threads = asked.map(|(path, period_ns)| {
            let closed = Arc::clone(&closed);
            std::thread::spawn(move || look(address, &path, period_ns, &closed))
        });
        Ok(Self { closed, threads: threads.into() })
    }

    /// Closes them; an error where one was not answered, or not often enough to count.
    pub(super) fn close(self) -> Result<(), Error> {
        self.closed.store(true, Ordering::Relaxed);
        for thread in self.threads {
            let gone = |_| Error::Part { part: "page", what: "the thread has ended with a panic".to_owned() };
            if thread.join().map_err(gone)?? == 0 {
                return Err(Error::Part { part: "page", what: "it was never answered".to_owned() });
            }
        }
        Ok(())
    }
}

/// Asks until the page is closed; how many answers came.
fn look(address: SocketAddr, path: &str, period_ns: u64, closed: &AtomicBool) -> Result<u64, Error> {
    let mut answers = 0;
    while !closed.load(Ordering::Relaxed) {
        let next = now_ns() + period_ns;
        let answer = ask(address, path)
            .map_err(|error| Error::Part { part: "page", what: format!("{path}: {error}") })?;
        if !answer.starts_with(b"HTTP/1.1 200 ") {
            let head = String::from_utf8_lossy(answer.get(..40).unwrap_or(&answer)).into_owned();
            return Err(Error::Part { part: "page", what: format!("{path}: {head}") });
        }
        answers += 1;
        sleep_until(next);
    }
    Ok(answers)
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
