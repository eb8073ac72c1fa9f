//! The time axis of a unit: the producer's clock, with its jumps taken out.

/// A clock that goes back by more than this belongs to another run of the producer (ns).
const BACK_NS: i64 = 10_000_000_000;
/// A clock that goes on by more than this was set (ns).
const FORWARD_NS: i64 = 86_400_000_000_000;
/// Most jumps that are followed; a clock that jumps on and on is drawn as it is from then on.
const MAX_JUMPS: usize = 4096;

/// The streams of a unit, each of which is in the order of its own times.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stream {
    Gyro,
    Accel,
    Temperature,
    Corrected,
}

/// Where a stream is.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    /// The last time of the producer.
    last_ns: Option<i64>,
    /// How many jumps it has followed.
    jumps: usize,
}

/// A producer's clock. Where it jumps, the axis goes on from where it was: a page of fifty years shows nothing.
///
/// The first stream that jumps says by how much; the others follow when their turn comes, so that they stay together.
#[derive(Debug, Clone)]
pub(super) struct Clock {
    /// From the producer's time to the axis (ns), before the first jump and after each.
    shifts_ns: Vec<i64>,
    streams: [Place; 4],
    now_ns: Option<i64>,
}

impl Default for Clock {
    fn default() -> Self {
        Self::moved(0)
    }
}

impl Clock {
    /// A clock whose times are moved by so much (ns).
    pub(super) fn moved(shift_ns: i64) -> Self {
        Self { shifts_ns: vec![shift_ns], streams: [Place::default(); 4], now_ns: None }
    }

    /// Time on the axis of a time of the producer, and by how much its clock has jumped there (ns).
    pub(super) fn axis(&mut self, stream: Stream, event_ns: i64) -> (i64, Option<i64>) {
        let latest = self.shifts_ns.len() - 1;
        let Some(place) = self.streams.get_mut(stream as usize) else { return (event_ns, None) };
        let shift = self.shifts_ns.get(place.jumps).copied().unwrap_or(0);
        let step = place.last_ns.map(|last| event_ns.saturating_sub(last));
        let mut jumped = None;
        match step {
            // A stream that begins late begins with the others.
            None => place.jumps = latest,
            Some(step) if (-BACK_NS..=FORWARD_NS).contains(&step) => {}
            Some(_) if place.jumps < latest => place.jumps += 1,
            Some(step) if latest < MAX_JUMPS => {
                self.shifts_ns.push(shift.saturating_sub(step));
                place.jumps = latest + 1;
                jumped = Some(step);
            }
            Some(_) => {}
        }
        place.last_ns = Some(event_ns);
        let at_ns = event_ns.saturating_add(self.shifts_ns.get(place.jumps).copied().unwrap_or(0));
        self.now_ns = Some(at_ns);
        (at_ns, jumped)
    }

    /// Where the axis is now; `None` before the first time.
    pub(super) fn now(&self) -> Option<i64> {
        self.now_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOUR: i64 = 3_600_000_000_000;

    #[test]
    fn the_axis_goes_on_where_the_clock_jumps() {
        let mut clock = Clock::moved(0);
        let mut gyro = |ns| clock.axis(Stream::Gyro, ns);
        assert_eq!(gyro(5 * HOUR), (5 * HOUR, None));
        assert_eq!(gyro(5 * HOUR - 1_000_000_000), (5 * HOUR - 1_000_000_000, None), "a late message");
        assert_eq!(gyro(17 * HOUR), (17 * HOUR, None), "a gap");
        assert_eq!(gyro(HOUR), (17 * HOUR, Some(-16 * HOUR)), "switched off and on");
        assert_eq!(gyro(HOUR + 7), (17 * HOUR + 7, None));
        let (at, jumped) = gyro(480_000 * HOUR);
        assert!(at == 17 * HOUR + 7 && jumped.is_some(), "set to the time of day");
        assert_eq!(clock.now(), Some(17 * HOUR + 7));
    }

    #[test]
    fn streams_stay_together_over_long_batches_and_jumps() {
        let mut clock = Clock::moved(5);
        // A batch of temperatures of an hour, then the gyro ticks of the same hour.
        assert_eq!(clock.axis(Stream::Temperature, HOUR), (HOUR + 5, None));
        assert_eq!(clock.axis(Stream::Gyro, 1), (6, None));
        assert_eq!(clock.axis(Stream::Gyro, HOUR), (HOUR + 5, None));
        // The producer is switched off and on: the gyro tells first.
        let (at, jumped) = clock.axis(Stream::Gyro, 1000);
        assert_eq!((at, jumped), (HOUR + 5, Some(1000 - HOUR)));
        assert_eq!(
            clock.axis(Stream::Temperature, 2000),
            (HOUR + 1005, None),
            "a tick later is a tick later"
        );
        assert_eq!(clock.axis(Stream::Accel, 3000), (HOUR + 2005, None), "one that begins now");
    }
}
