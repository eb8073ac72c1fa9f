//! Gives every unit another calibration each second, beside a chain at work.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use isotherm_bus::SessionOptions;
use isotherm_protocol::key;
use zenoh::Wait;

use super::subject::document;
use crate::clock::{now_ns, sleep_until};
use crate::error::Error;
use crate::part::{Plan, unit_name};

/// Time between two swaps of a unit (ns).
const PERIOD_NS: u64 = 1_000_000_000;
/// What is left alone first, for the check to have ticks of the first calibration (ns).
const FIRST_NS: u64 = 800_000_000;

/// A thread that puts calibration documents.
#[derive(Debug)]
pub(super) struct Swapper {
    ended: Arc<AtomicBool>,
    thread: JoinHandle<Result<(), Error>>,
}

impl Swapper {
    /// Begins: units one after the other, evenly over the second.
    pub(super) fn start(plan: &Plan) -> Result<Self, Error> {
        let options = SessionOptions {
            config: plan.zenoh_config.clone(),
            connect: plan.connect.iter().cloned().collect(),
            ..SessionOptions::default()
        };
        let session = zenoh::open(options.to_config()?).wait();
        let session = session.map_err(|source| Error::Bus(isotherm_bus::BusError::Open(source)))?;
        let ended = Arc::new(AtomicBool::new(false));
        let (asked, units) = (Arc::clone(&ended), plan.units);
        let thread = std::thread::spawn(move || {
            let begin = now_ns() + FIRST_NS;
            for (swap, at) in (0..).zip(0_u64..) {
                sleep_until(begin + at * PERIOD_NS / units as u64);
                if asked.load(Ordering::Relaxed) {
                    break;
                }
                let (unit, edition) = (swap % units, swap / units + 1);
                let put = session.put(key::calibration(&unit_name(unit)?), document(unit, edition)?);
                put.wait().map_err(|error| Error::zenoh("swaps", &error))?;
            }
            // What was put has been written out when the session is closed.
            session.close().wait().map_err(|error| Error::zenoh("swaps", &error))
        });
        Ok(Self { ended, thread })
    }

    /// Ends it; an error where swaps could not be sent.
    pub(super) fn stop(self) -> Result<(), Error> {
        self.ended.store(true, Ordering::Relaxed);
        let gone = |_| Error::Part { part: "swaps", what: "the thread has ended with a panic".to_owned() };
        self.thread.join().map_err(gone)?
    }
}

/// Least number of swaps of each unit in so many seconds of ticks.
pub(super) fn expected(seconds: Duration) -> u64 {
    // The first comes half a second late, the last may be on its way.
    seconds.as_secs().saturating_sub(1)
}
