//! The machine's monotonic clock, which all processes of a chain share.

use std::time::Duration;

use rustix::time::{ClockId, clock_gettime};

/// Nanoseconds since the machine was started.
pub(crate) fn now_ns() -> u64 {
    let time = clock_gettime(ClockId::Monotonic);
    // Neither is ever negative on this clock.
    let (s, ns) = (u64::try_from(time.tv_sec), u64::try_from(time.tv_nsec));
    s.unwrap_or_default() * 1_000_000_000 + ns.unwrap_or_default()
}

/// Sleeps until the clock shows a time; how far it was past that when it looked again (ns).
pub(crate) fn sleep_until(time_ns: u64) -> u64 {
    loop {
        let now = now_ns();
        if now >= time_ns {
            return now - time_ns;
        }
        std::thread::sleep(Duration::from_nanos(time_ns - now));
    }
}
