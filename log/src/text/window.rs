//! A part of a log, by time from its beginning.

use isotherm_correction::units::{Span, Timestamp};

use super::{LogError, LogEvent};

/// The events of a log between `start` and `start + duration` after its beginning.
///
/// The beginning is the start of the first tick, or the time of the first temperature reading. A tick belongs to the
/// part when it begins and ends inside.
#[derive(Debug)]
pub struct Window<I> {
    /// The whole log.
    events: I,
    /// From when on, after the beginning.
    start: Span,
    /// How long; `None` is to the end.
    duration: Option<Span>,
    /// When the log begins.
    beginning: Option<Timestamp>,
    /// The part is over.
    over: bool,
}

impl<I> Window<I> {
    /// A part of `events`.
    #[must_use]
    pub fn new(events: I, start: Span, duration: Option<Span>) -> Self {
        Self { events, start, duration, beginning: None, over: false }
    }

    /// The whole log.
    pub fn inner(&self) -> &I {
        &self.events
    }

    /// Whether an event belongs to the part; notes when the part is over.
    fn holds(&mut self, event: &LogEvent) -> bool {
        let began = match event {
            LogEvent::Gyro { tick, .. } => tick.end_time - tick.duration,
            LogEvent::Accel { tick, .. } => tick.end_time - tick.duration,
            LogEvent::Temperature(reading) => reading.time,
        };
        let start = *self.beginning.get_or_insert(began) + self.start;
        self.over = self.duration.is_some_and(|duration| event.time() > start + duration);
        !self.over && (self.start == Span::ZERO || began >= start)
    }
}

impl<I: Iterator<Item = Result<LogEvent, LogError>>> Iterator for Window<I> {
    type Item = Result<LogEvent, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.over {
            match self.events.next()? {
                Ok(event) if self.holds(&event) => return Some(Ok(event)),
                Ok(_) => {}
                Err(error) => return Some(Err(error)),
            }
        }
        None
    }
}
