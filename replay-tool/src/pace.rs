//! Keeping to a log's time while it is played.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use hdrhistogram::Histogram;
use serde::Serialize;
use tokio::time::Instant;

/// A message that goes out later than this has missed its deadline.
pub(crate) const DEADLINE: Duration = Duration::from_millis(5);
/// Slowest and fastest.
const RANGE: std::ops::RangeInclusive<f64> = 1e-3..=1e6;

/// How fast a log is played.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Speed {
    /// This many times as fast as it was recorded.
    Times(f64),
    /// As fast as the service keeps up.
    Max,
}

impl Speed {
    /// Twice as fast; from 1024 on, as fast as the service keeps up.
    #[must_use]
    pub(crate) fn faster(self) -> Self {
        match self {
            Self::Times(times) if times < 1024.0 => Self::Times(times * 2.0),
            _ => Self::Max,
        }
    }

    /// Half as fast.
    #[must_use]
    pub(crate) fn slower(self) -> Self {
        match self {
            Self::Times(times) => Self::Times((times / 2.0).max(*RANGE.start())),
            Self::Max => Self::Times(1024.0),
        }
    }
}

impl FromStr for Speed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.eq_ignore_ascii_case("max") {
            return Ok(Self::Max);
        }
        let number = text.strip_suffix(['x', '×']).unwrap_or(text).parse();
        match number {
            Ok(times) if RANGE.contains(&times) => Ok(Self::Times(times)),
            _ => Err("must be max, or a number from 0.001 to 1000000".into()),
        }
    }
}

impl fmt::Display for Speed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Times(times) => write!(f, "{times}"),
            Self::Max => f.write_str("max"),
        }
    }
}

/// Says when a message is due. Every deadline follows from one origin, so that nothing adds up.
#[derive(Debug)]
pub(crate) struct Pacer {
    /// How fast.
    speed: Speed,
    /// When a message was due, and its time in the log (ns).
    origin: Option<(Instant, i64)>,
    /// How late messages were; nothing at `max`, where none is due.
    pub(crate) late: Late,
}

impl Pacer {
    /// Nothing is due yet.
    #[must_use]
    pub(crate) fn new(speed: Speed) -> Self {
        Self { speed, origin: None, late: Late::default() }
    }

    /// How fast.
    #[must_use]
    pub(crate) fn speed(&self) -> Speed {
        self.speed
    }

    /// Goes on at another speed.
    pub(crate) fn set_speed(&mut self, speed: Speed) {
        self.speed = speed;
        self.restart();
    }

    /// The next message is due at once, and the others after it.
    pub(crate) fn restart(&mut self) {
        self.origin = None;
    }

    /// Everything is due this much later.
    pub(crate) fn hold(&mut self, duration: Duration) {
        if let Some((begun, _)) = &mut self.origin {
            *begun += duration;
        }
    }

    /// When a message of this time in the log (ns) is due; `None` is at once, at any time.
    pub(crate) fn due(&mut self, at_ns: i64) -> Option<Instant> {
        let Speed::Times(times) = self.speed else { return None };
        let (begun, first) = *self.origin.get_or_insert_with(|| (Instant::now(), at_ns));
        #[expect(clippy::cast_precision_loss, reason = "exact below 100 days, and no result rests on it")]
        let after = at_ns.saturating_sub(first).max(0) as f64 * 1e-9 / times;
        begun.checked_add(Duration::try_from_secs_f64(after).ok()?)
    }

    /// Notes that a message goes out now.
    pub(crate) fn note(&mut self, due: Option<Instant>) {
        if let Some(due) = due {
            self.late.note(due.elapsed());
        }
    }
}

/// How late messages went out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub(crate) struct Lateness {
    /// Messages that were due at a moment.
    pub(crate) messages: u64,
    /// What counts as too late (ms).
    pub(crate) deadline_ms: f64,
    /// Messages that went out later than that.
    pub(crate) misses: u64,
    /// Half of them were not later than this (ms).
    pub(crate) p50_ms: f64,
    /// 99 % of them were not later than this (ms).
    pub(crate) p99_ms: f64,
    /// The latest (ms).
    pub(crate) max_ms: f64,
}

/// Counts latenesses.
#[derive(Debug)]
pub(crate) struct Late {
    /// In µs, to 1 %.
    counts: Option<Histogram<u64>>,
    misses: u64,
    latest: Duration,
}

impl Default for Late {
    fn default() -> Self {
        // Up to a day; the bounds are sound, so that it is always there.
        let counts = Histogram::new_with_bounds(1, 86_400_000_000, 2).ok();
        Self { counts, misses: 0, latest: Duration::ZERO }
    }
}

impl Late {
    fn note(&mut self, late: Duration) {
        if let Some(counts) = &mut self.counts {
            counts.saturating_record(u64::try_from(late.as_micros()).unwrap_or(u64::MAX));
        }
        self.misses += u64::from(late > DEADLINE);
        self.latest = self.latest.max(late);
    }

    pub(crate) fn lateness(&self) -> Lateness {
        #[expect(clippy::cast_precision_loss, reason = "a day has 8.64e10 µs")]
        let at = |quantile| {
            self.counts.as_ref().map_or(0.0, |counts| counts.value_at_quantile(quantile) as f64 * 1e-3)
        };
        let max_ms = self.latest.as_secs_f64() * 1e3;
        Lateness {
            messages: self.counts.as_ref().map_or(0, Histogram::len),
            deadline_ms: DEADLINE.as_secs_f64() * 1e3,
            misses: self.misses,
            // A step of the scale may reach beyond the latest of all.
            p50_ms: at(0.5).min(max_ms),
            p99_ms: at(0.99).min(max_ms),
            max_ms,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds() {
        assert_eq!("max".parse(), Ok(Speed::Max));
        assert_eq!("50x".parse(), Ok(Speed::Times(50.0)));
        assert_eq!("0.5".parse(), Ok(Speed::Times(0.5)));
        for text in ["", "0", "-1", "fast", "nan", "inf", "x"] {
            assert!(text.parse::<Speed>().is_err(), "{text}");
        }
        assert_eq!(Speed::Times(3.0).faster(), Speed::Times(6.0));
        assert_eq!(Speed::Times(3.0).slower(), Speed::Times(1.5));
        assert_eq!((Speed::Times(1024.0).faster(), Speed::Max.slower()), (Speed::Max, Speed::Times(1024.0)));
    }

    #[test]
    fn a_thousand_deadlines_do_not_drift() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
        let begun = Instant::now();
        let mut pacer = Pacer::new(Speed::Times(100.0));
        runtime.block_on(async {
            for tick in 0..=1000 {
                let due = pacer.due(tick * 10_000_000);
                tokio::time::sleep_until(due.unwrap()).await;
                pacer.note(due);
            }
        });
        // 10 s of log at 100×: at least 100 ms, and no thousand rounded-up sleeps of a millisecond each.
        let took = begun.elapsed();
        assert!(took >= Duration::from_millis(100) && took < Duration::from_millis(700), "{took:?}");
        let late = pacer.late.lateness();
        assert_eq!(late.messages, 1001);
        assert!(late.p50_ms <= late.p99_ms && late.p99_ms <= late.max_ms, "{late:?}");
    }

    #[test]
    fn misses_and_quantiles_are_those_of_the_messages() {
        let mut late = Late::default();
        (1..=100).for_each(|ms| late.note(Duration::from_millis(ms)));
        let late = late.lateness();
        assert_eq!((late.messages, late.misses), (100, 95));
        for (got, expected) in [(late.p50_ms, 50.0), (late.p99_ms, 99.0), (late.max_ms, 100.0)] {
            assert!((got - expected).abs() <= 0.01 * expected, "{late:?}");
        }
    }

    #[test]
    fn holding_and_another_speed_move_the_deadlines() {
        let mut pacer = Pacer::new(Speed::Times(2.0));
        let begun = pacer.due(0).unwrap();
        assert_eq!(pacer.due(1_000_000_000), Some(begun + Duration::from_millis(500)));
        pacer.hold(Duration::from_millis(7));
        assert_eq!(pacer.due(1_000_000_000), Some(begun + Duration::from_millis(507)));
        pacer.set_speed(Speed::Times(4.0));
        let at_once = pacer.due(1_000_000_000).unwrap();
        assert!(at_once >= begun);
        assert_eq!(pacer.due(2_000_000_000), Some(at_once + Duration::from_millis(250)));
        pacer.set_speed(Speed::Max);
        assert_eq!(pacer.due(2_000_000_000), None);
    }
}
