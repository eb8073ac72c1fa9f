//! Keeping to a log's time while it is played.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use isotherm_correction::units::Timestamp;
use tokio::time::Instant;

/// How fast a log is played.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// This many times as fast as it was recorded.
    Times(f64),
    /// As fast as the service keeps up.
    Max,
}

impl FromStr for Speed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.eq_ignore_ascii_case("max") {
            return Ok(Self::Max);
        }
        let number = text.strip_suffix(['x', '×']).unwrap_or(text).parse();
        match number {
            Ok(times) if (1e-3..=1e6).contains(&times) => Ok(Self::Times(times)),
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

/// Waits until a tick is due. Every deadline follows from the first, so that nothing adds up.
#[derive(Debug)]
pub struct Pacer {
    /// How fast.
    speed: Speed,
    /// When the first event was due, and its time.
    origin: Option<(Instant, Timestamp)>,
    /// The longest that a tick was late.
    latest: Duration,
}

impl Pacer {
    /// Nothing is due yet.
    #[must_use]
    pub fn new(speed: Speed) -> Self {
        Self { speed, origin: None, latest: Duration::ZERO }
    }

    /// Waits until an event of this time is due.
    pub async fn wait(&mut self, time: Timestamp) {
        let now = Instant::now();
        let (begun, first) = *self.origin.get_or_insert((now, time));
        let Speed::Times(times) = self.speed else { return };
        let Ok(after) = Duration::try_from_secs_f64(time.seconds_from(first) / times) else { return };
        let Some(due) = begun.checked_add(after) else { return };
        if due > now {
            tokio::time::sleep_until(due).await;
        }
        self.latest = self.latest.max(due.elapsed());
    }

    /// The longest that a tick was late; zero at `max`, where nothing is due.
    #[must_use]
    pub fn latest(&self) -> Duration {
        self.latest
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
    }

    #[test]
    fn a_thousand_deadlines_do_not_drift() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
        let begun = Instant::now();
        runtime.block_on(async {
            let mut pacer = Pacer::new(Speed::Times(100.0));
            for tick in 0..=1000 {
                pacer.wait(Timestamp::from_ns(tick * 10_000_000)).await;
            }
        });
        // 10 s of log at 100×: at least 100 ms, and no thousand rounded-up sleeps of a millisecond each.
        let took = begun.elapsed();
        assert!(took >= Duration::from_millis(100) && took < Duration::from_millis(700), "{took:?}");
    }
}
