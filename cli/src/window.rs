//! The part of a log's time that a command reads.

use clap::Args;
use isotherm_correction::units::Span;

use crate::number::seconds;

/// The part of a log's time that is read.
#[derive(Debug, Clone, Default, Args)]
pub struct Window {
    /// Start this long after each log's beginning (s); recordings are cut between messages
    #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = seconds)]
    pub start: Span,
    /// Length of each log to read (s) (default: all)
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub duration: Option<Span>,
    /// Stop this long after each log's beginning (s)
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "duration")]
    pub end: Option<Span>,
}

impl Window {
    /// Start and end since the log's beginning; no end is the log's.
    ///
    /// # Errors
    /// In words, where the end is before the start.
    pub fn limits(&self) -> Result<(Span, Option<Span>), String> {
        let length = |length: Span| Span::from_ns(self.start.as_ns().saturating_add(length.as_ns()));
        let end = self.end.or_else(|| self.duration.map(length));
        match end.filter(|end| *end < self.start) {
            None => Ok((self.start, end)),
            Some(end) => {
                let [end, start] = [end, self.start].map(Span::as_s);
                Err(format!("--end is {end} s, must not be before --start, {start} s"))
            }
        }
    }
}
