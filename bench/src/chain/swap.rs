//! Gives every unit another calibration each second, beside a chain at work.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use isotherm_protocol::key;
use zenoh::Wait;

use super::subject::{Subject, document};
use crate::clock::{now_ns, sleep_until};
use crate::error::Error;
use crate::part::{Plan, open, unit_name};
use crate::rounds::median;

/// Time between two swaps of a unit (ns).
const PERIOD_NS: u64 = 1_000_000_000;
/// What is left alone first, for the check to have ticks of the first calibration (ns).
const FIRST_NS: u64 = 800_000_000;

/// How long an answer may take.
const LIMIT: Duration = Duration::from_secs(10);

/// Gives every unit another calibration each second, one after the other, until `ended`; an error where swaps could not be sent.
pub(super) fn again_and_again(plan: &Plan, ended: &AtomicBool) -> Result<(), Error> {
    let (session, units) = (open(plan)?, plan.case.units);
    let begin = now_ns() + FIRST_NS;
    for (swap, at) in (0..).zip(0_u64..) {
        sleep_until(begin + at * PERIOD_NS / units as u64);
        if ended.load(Ordering::Relaxed) {
            break;
        }
        let (unit, edition) = (swap % units, swap / units + 1);
        let put = session.put(key::calibration(&unit_name(unit)?), document(unit, edition)?);
        put.wait().map_err(Error::zenoh("swaps"))?;
    }
    // What was put has been written out when the session is closed.
    session.close().wait().map_err(Error::zenoh("swaps"))
}

/// Gives some units another calibration, one after the other, each when the one before has been answered; the median of the times (ms),
/// 0 for none.
pub(super) fn timed(plan: &Plan) -> Result<f64, Error> {
    let units = plan.case.timed_swaps;
    if units == 0 || plan.subject != Subject::Service {
        return Ok(0.0);
    }
    let session = open(plan)?;
    let wrong = Error::of("swaps");
    let mut times = Vec::with_capacity(units);
    for unit in (0..plan.case.units).cycle().take(units) {
        // Other than what the unit has, and than what it had.
        let text = document(unit, 1 + times.len())?;
        let begin = now_ns();
        let replies = session.get(key::calibration(&unit_name(unit)?)).payload(text).timeout(LIMIT).wait();
        let reply = replies.map_err(Error::zenoh("swaps"))?.recv();
        let reply = reply.map_err(|_| wrong("no service answers".to_owned()))?.into_result();
        let sample = reply.map_err(|error| wrong(format!("{error:?}")))?;
        #[expect(clippy::cast_precision_loss, reason = "far below 2⁵³ ns")]
        times.push((now_ns() - begin) as f64 * 1e-6);
        let bytes = sample.payload().to_bytes();
        if !String::from_utf8_lossy(&bytes).contains("\"accepted\"") {
            return Err(wrong(format!("a swap was answered with {}", String::from_utf8_lossy(&bytes))));
        }
    }
    Ok(median(times.into_iter()))
}
