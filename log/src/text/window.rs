//! A part of a log, by time from its beginning.

use isotherm_correction::units::{Span, Timestamp};

use super::{LogError, LogEvent};

/// A part of a log, from `start` to `start + duration` after its beginning.
///
/// The beginning is the start of the first tick, or the time of the first temperature reading. A tick belongs to the
/// part when it begins and ends inside.
#[derive(Debug, Default)]
pub(crate) struct Stretch {
    /// From when on, after the beginning.
    start: Span,
    /// How long; `None` is to the end.
    duration: Option<Span>,
    /// When the log begins.
    beginning: Option<Timestamp>,
    /// The part is over.
    pub(crate) over: bool,
}

impl Stretch {
    pub(crate) fn new(start: Span, duration: Option<Span>) -> Self {
        Self { start, duration, ..Self::default() }
    }

    /// Whether what began and ended then belongs to the part; notes when the part is over.
    pub(crate) fn holds(&mut self, began: Timestamp, ended: Timestamp) -> bool {
        let start = *self.beginning.get_or_insert(began) + self.start;
        self.over = self.duration.is_some_and(|duration| ended > start + duration);
        !self.over && (self.start == Span::ZERO || began >= start)
    }
}

/// The events of a part of a log.
#[derive(Debug)]
pub struct Window<I> {
    /// The whole log.
    events: I,
    part: Stretch,
}

impl<I> Window<I> {
    /// The part of `events` from `start` on, of this duration; without one to the end.
    #[must_use]
    pub fn new(events: I, start: Span, duration: Option<Span>) -> Self {
        Self { events, part: Stretch::new(start, duration) }
    }

    /// The whole log.
    pub fn inner(&self) -> &I {
        &self.events
    }

    /// Whether an event belongs to the part.
    fn holds(&mut self, event: &LogEvent) -> bool {
        let began = match event {
            LogEvent::Gyro { tick, .. } => tick.end_time - tick.duration,
            LogEvent::Accel { tick, .. } => tick.end_time - tick.duration,
            LogEvent::Temperature(reading) => reading.time,
        };
        self.part.holds(began, event.time())
    }
}

impl<I: Iterator<Item = Result<LogEvent, LogError>>> Iterator for Window<I> {
    type Item = Result<LogEvent, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.part.over {
            match self.events.next()? {
                Ok(event) if self.holds(&event) => return Some(Ok(event)),
                Ok(_) => {}
                Err(error) => return Some(Err(error)),
            }
        }
        None
    }
}
