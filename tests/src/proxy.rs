//! A TCP proxy whose connections a test can cut, stall, open by half, delay or slow down.

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::time::{Duration, Instant};

/// What is done to every connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// Nothing.
    None,
    /// They are closed, and new ones too.
    Cut,
    /// They stay open, and nothing passes.
    Stall,
    /// They stay open, and nothing passes to the side that is connected to.
    HalfOpen,
    /// They stay open, and nothing passes from the side that is connected to.
    Deaf,
    /// Everything passes 100 ms later, as much as before.
    Delay,
    /// 16 kB/s pass in each direction.
    Throttle,
}

/// How often it is looked whether the fault has changed.
const LOOK: Duration = Duration::from_millis(1);
/// Bytes that pass at once, and the pause behind them where they are slowed down.
const PART: usize = 256;
const PAUSE: Duration = Duration::from_millis(16);
/// How much later everything passes where it is delayed.
const DELAY: Duration = Duration::from_millis(100);

/// What several proxies have in common.
#[derive(Debug, Clone, Default)]
pub struct Switch(Arc<AtomicU8>);

impl Switch {
    /// Does something to every connection from now on.
    pub fn set(&self, fault: Fault) {
        self.0.store(fault as u8, Ordering::SeqCst);
    }

    fn is(&self, fault: Fault) -> bool {
        self.0.load(Ordering::SeqCst) == fault as u8
    }
}

/// One proxy; it takes no more connections when dropped, and closes those that it has.
#[derive(Debug)]
pub struct Proxy {
    /// Where it listens, as an endpoint.
    pub endpoint: String,
    over: Arc<AtomicBool>,
}

impl Proxy {
    /// Starts one on a port of the system's choice.
    ///
    /// # Panics
    /// Where it cannot listen.
    #[must_use]
    pub fn start(to: &str, switch: &Switch) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        listener.set_nonblocking(true).expect("it does not block");
        let endpoint = format!("tcp/{}", listener.local_addr().expect("an address"));
        let over = Arc::new(AtomicBool::new(false));
        let (to, switch, ends) =
            (to.trim_start_matches("tcp/").to_owned(), switch.clone(), Arc::clone(&over));
        std::thread::spawn(move || {
            while !ends.load(Ordering::SeqCst) {
                let Ok((near, _)) = listener.accept() else {
                    std::thread::sleep(LOOK);
                    continue;
                };
                // Where the other side is dead the connection is closed.
                let Some(far) = TcpStream::connect(&to).ok().filter(|_| !switch.is(Fault::Cut)) else {
                    continue;
                };
                for (from, to, inward) in [(&near, &far, true), (&far, &near, false)] {
                    let (from, to) = (from.try_clone().expect("a stream"), to.try_clone().expect("a stream"));
                    let (switch, ends) = (switch.clone(), Arc::clone(&ends));
                    std::thread::spawn(move || pass(&from, &to, inward, &switch, &ends));
                }
            }
        });
        Self { endpoint, over }
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.over.store(true, Ordering::SeqCst);
    }
}

/// Passes bytes on in one direction, until either side or the test ends it.
fn pass(mut from: &TcpStream, mut to: &TcpStream, inward: bool, switch: &Switch, over: &AtomicBool) {
    let prepared = from.set_nonblocking(false).is_ok() && to.set_nodelay(true).is_ok();
    let mut bytes = vec![0; 1 << 16];
    // Read and not written yet, with the time of reading.
    let mut held: VecDeque<(Instant, Vec<u8>)> = VecDeque::new();
    let mut wait = Duration::ZERO;
    let ends = || switch.is(Fault::Cut) || over.load(Ordering::SeqCst);
    let one_way = if inward { Fault::HalfOpen } else { Fault::Deaf };
    while prepared && !ends() {
        let wanted = if held.is_empty() { LOOK * 5 } else { LOOK };
        if wait != wanted && from.set_read_timeout(Some(wanted)).is_err() {
            break;
        }
        wait = wanted;
        let most = if switch.is(Fault::Throttle) { PART } else { bytes.len() };
        match from.read(&mut bytes[..most]) {
            Ok(0) => break,
            Ok(read) => held.push_back((Instant::now(), bytes[..read].to_vec())),
            Err(error)
                if matches!(error.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) => {}
            Err(_) => break,
        }
        while !ends() && (switch.is(Fault::Stall) || switch.is(one_way)) {
            std::thread::sleep(LOOK);
        }
        if !write_due(&mut held, &mut to, switch) {
            break;
        }
    }
    let _ = (from.shutdown(Shutdown::Both), to.shutdown(Shutdown::Both));
}

/// Writes what has been held for long enough; whether that was possible.
fn write_due(held: &mut VecDeque<(Instant, Vec<u8>)>, to: &mut &TcpStream, switch: &Switch) -> bool {
    while held.front().is_some_and(|(at, _)| !switch.is(Fault::Delay) || at.elapsed() >= DELAY) {
        let Some((_, bytes)) = held.pop_front() else { break };
        if switch.is(Fault::Cut) || to.write_all(&bytes).is_err() {
            return false;
        }
        if switch.is(Fault::Throttle) {
            std::thread::sleep(PAUSE);
        }
    }
    true
}
