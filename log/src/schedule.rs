//! When the messages of a log are to go out again.

use std::collections::BTreeMap;

use isotherm_correction::units::Timestamp;
use isotherm_protocol::key::UnitId;

/// By which clock a log is played.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Clock {
    /// The producers' clock: the ends of ticks. What had been delayed on its way to the recorder no longer is.
    Event,
    /// The recorder's clock: the moments of reception.
    Receive,
}

/// A unit's event time that goes this far off its time of reception is tied to it anew (ns): its producer was restarted.
const TIED_NS: i64 = 10_000_000_000;

/// Times of a log's messages from its first one on (ns).
#[derive(Debug)]
pub struct Schedule {
    clock: Clock,
    /// Times of reception say nothing: a text log has none.
    untied: bool,
    /// Time of reception of the first message.
    beginning_ns: Option<i64>,
    /// Event time less the schedule's, by unit.
    ties: BTreeMap<UnitId, i64>,
    /// What was given last.
    last_ns: i64,
}

impl Schedule {
    /// Of recordings, by a clock.
    #[must_use]
    pub fn of_recordings(clock: Clock) -> Self {
        Self { clock, untied: false, beginning_ns: None, ties: BTreeMap::new(), last_ns: 0 }
    }

    /// Of a text log, whose times are all of its producer's clock.
    #[must_use]
    pub fn of_text() -> Self {
        Self { untied: true, ..Self::of_recordings(Clock::Event) }
    }

    /// When a message is due, after the first one (ns, from 0). `time` is its event time, where it has one.
    pub fn due(&mut self, unit: Option<&UnitId>, received_ns: u64, time: Option<Timestamp>) -> i64 {
        let received_ns = i64::try_from(received_ns).unwrap_or(i64::MAX);
        let received = received_ns.saturating_sub(*self.beginning_ns.get_or_insert(received_ns));
        let due = match (self.clock, unit, time) {
            (Clock::Receive, ..) => received,
            (Clock::Event, Some(unit), Some(time)) => self.by_event(unit, time.as_ns(), received),
            // Right behind what came before it.
            (Clock::Event, ..) => self.last_ns,
        };
        self.last_ns = due.max(0);
        self.last_ns
    }

    fn by_event(&mut self, unit: &UnitId, time_ns: i64, received: i64) -> i64 {
        if self.untied {
            // One clock for all: the first message begins.
            let first = *self.ties.entry(unit.clone()).or_insert(time_ns);
            return time_ns.saturating_sub(first);
        }
        let due = self.ties.get(unit).map(|tie| time_ns.saturating_sub(*tie));
        if let Some(due) = due.filter(|due| due.saturating_sub(received).abs() <= TIED_NS) {
            return due;
        }
        self.ties.insert(unit.clone(), time_ns.saturating_sub(received));
        received
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Due times (ms) of messages: unit, received (ms), event time (ms).
    fn due(mut schedule: Schedule, messages: &[(&str, u64, Option<i64>)]) -> Vec<i64> {
        let ms = |(unit, received, time): &(&str, u64, Option<i64>)| {
            let unit = UnitId::new(unit).unwrap();
            let time = time.map(|ms| Timestamp::from_ns(ms * 1_000_000));
            schedule.due(Some(&unit), received * 1_000_000, time) / 1_000_000
        };
        messages.iter().map(ms).collect()
    }

    #[test]
    fn by_reception_or_by_event() {
        let messages = [
            ("A", 1000, Some(70)),
            ("B", 1005, Some(900_000)),
            ("A", 1013, Some(80)),
            ("A", 1014, None),
            ("A", 1015, Some(90)),
            ("B", 1019, Some(900_010)),
            // The producer of A was switched off and on; then a message with a time of its past.
            ("A", 1040, Some(-50_000)),
            ("A", 1052, Some(-49_990)),
        ];
        let by = |clock| due(Schedule::of_recordings(clock), &messages);
        assert_eq!(by(Clock::Receive), [0, 5, 13, 14, 15, 19, 40, 52]);
        assert_eq!(by(Clock::Event), [0, 5, 10, 10, 20, 15, 40, 50]);
    }

    #[test]
    fn a_text_log_has_its_own_time_also_before_the_clocks_zero() {
        let messages = [("A", 0, Some(-30_000)), ("A", 0, Some(-29_990)), ("A", 0, Some(100_000))];
        assert_eq!(due(Schedule::of_text(), &messages), [0, 10, 130_000]);
    }
}
