//! A part of a log: some of its units, some of its time. It can be opened again and again.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::key::UnitId;

use crate::error::Error;
use crate::file::refuse_pipe;
use crate::mapping::Mapping;
use crate::message::Message;
use crate::progress::Progress;
use crate::recording::RecordingReader;
use crate::source::{LogReport, Source, is_recording};
use crate::text::LogReader;

/// The files of a log, and how they are read.
#[derive(Debug, Clone)]
pub enum LogFiles {
    /// Recordings, read one behind the other.
    Recordings(Vec<PathBuf>),
    /// A text log.
    Text {
        /// Its files in the order of the mapping's, or one folder that has them all.
        paths: Vec<PathBuf>,
        /// Which column is what.
        mapping: Box<Mapping>,
        /// The unit that it is of.
        unit: UnitId,
        /// Gyro ticks in one batch (1…4096).
        batch_ticks: usize,
    },
}

/// Which part of a log is taken.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Part {
    /// The units that are taken; all where it is empty. What is of no unit is always taken.
    pub units: BTreeSet<UnitId>,
    /// From this long after the log's beginning on.
    pub start: Span,
    /// Up to this long after the log's beginning; `None` is to the end.
    pub end: Option<Span>,
}

impl Part {
    /// Begin and end of what is not the whole time.
    #[must_use]
    pub fn window(&self) -> Option<(Span, Option<Span>)> {
        (self.start > Span::ZERO || self.end.is_some()).then_some((self.start, self.end))
    }
}

/// Where in the time of a part a log is.
///
/// A log that is taken tick by tick begins with the start of its first tick, or the time of its first temperature reading; a recording
/// with the reception of its first message. A tick belongs to the part that it ends in, a message to the one that it is received in: parts
/// that adjoin share nothing and lack nothing.
#[derive(Debug, Default)]
pub(crate) struct Stretch {
    start: Span,
    /// `None` is the log's end.
    end: Option<Span>,
    /// When the log begins.
    beginning: Option<Timestamp>,
    /// The part is over.
    pub(crate) over: bool,
}

impl Stretch {
    pub(crate) fn of(part: &Part) -> Self {
        Self { start: part.start, end: part.end, ..Self::default() }
    }

    /// Whether what began and ended then belongs to the part; notes when the part is over.
    pub(crate) fn holds(&mut self, began: Timestamp, ended: Timestamp) -> bool {
        let beginning = *self.beginning.get_or_insert(began);
        self.over = self.end.is_some_and(|end| ended > beginning + end);
        !self.over && (self.start == Span::ZERO || ended > beginning + self.start)
    }
}

impl LogFiles {
    /// Opens a part of the log.
    ///
    /// A recording's time is that of reception, counted from its first message, and its messages are taken whole; chunks that
    /// lie before the part are passed over unread. A text log's time is that of its rows, and its ticks are taken one by one: see [`crate::text::LogReader::within`].
    ///
    /// # Errors
    /// [`Error::File`]; for a text log as [`crate::text::LogReader::open`].
    pub fn open(&self, part: &Part) -> Result<Messages, Error> {
        let units = part.units.clone();
        match self {
            Self::Recordings(paths) => {
                let (mut stretch, mut before_ns) = (Stretch::of(part), 0);
                if part.start > Span::ZERO
                    && let Some(beginning) = self.beginning_ns()?
                {
                    stretch.beginning = Some(received(beginning));
                    before_ns = later_ns(beginning, part.start);
                }
                let (source, progress) = Source::recordings(paths, before_ns)?;
                Ok(Messages { source, progress, units, stretch })
            }
            Self::Text { paths, mapping, unit, batch_ticks } => {
                let (source, progress) = Source::text(paths, mapping, unit, *batch_ticks, part)?;
                Ok(Messages { source, progress, units, stretch: Stretch::default() })
            }
        }
    }

    /// Lets a part begin with the log, for who must be given all that came before it; from which time of reception on messages belong
    /// to the part. A text log's messages are then of one tick each, so that none is of both.
    ///
    /// # Errors
    /// As [`LogFiles::open`], and where the first message cannot be read.
    pub fn from_beginning(&mut self, part: &mut Part) -> Result<u64, Error> {
        let start = std::mem::take(&mut part.start);
        if start == Span::ZERO {
            return Ok(0);
        }
        if let Self::Text { batch_ticks, .. } = self {
            *batch_ticks = 1;
        }
        // What ends with the time before the part is of that time.
        Ok(self.beginning_ns()?.map_or(0, |beginning| later_ns(beginning, start).saturating_add(1)))
    }

    /// The last time of reception that belongs to a part; `None` where it goes to the end.
    ///
    /// # Errors
    /// As [`LogFiles::from_beginning`].
    pub fn end_ns(&self, part: &Part) -> Result<Option<u64>, Error> {
        let Some(end) = part.end else { return Ok(None) };
        Ok(self.beginning_ns()?.map(|beginning| later_ns(beginning, end)))
    }

    /// When the log begins: with the reception of its first message, a text log with its first event.
    fn beginning_ns(&self) -> Result<Option<u64>, Error> {
        match self {
            Self::Recordings(paths) => {
                let first = RecordingReader::open(paths, Arc::default())?.next_message()?;
                Ok(first.map(|message| message.received_ns))
            }
            Self::Text { paths, mapping, .. } => {
                let beginning = LogReader::beginning(mapping, paths)?;
                Ok(beginning.map(|(began, later)| u64::try_from((began + later).as_ns()).unwrap_or(0)))
            }
        }
    }
}

/// A time so long after another one (ns).
fn later_ns(time_ns: u64, by: Span) -> u64 {
    time_ns.saturating_add(u64::try_from(by.as_ns()).unwrap_or(0))
}

/// A time of reception.
fn received(ns: u64) -> Timestamp {
    Timestamp::from_ns(i64::try_from(ns).unwrap_or(i64::MAX))
}

/// The messages of a part of a log, one by one in constant memory.
#[derive(Debug)]
pub struct Messages {
    source: Source,
    progress: Progress,
    units: BTreeSet<UnitId>,
    /// Of a recording; another source gives its part alone.
    stretch: Stretch,
}

impl Messages {
    /// A part of a CSV of corrected ticks of a unit, as `isotherm-replay correct` writes it, in batches by the end of the last tick.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn of_corrected(path: &Path, unit: &UnitId, part: &Part) -> Result<Self, Error> {
        let (source, progress) = Source::corrected(path, unit, part)?;
        Ok(Self { source, progress, units: part.units.clone(), stretch: Stretch::default() })
    }

    /// The next message; `None` behind the last.
    ///
    /// # Errors
    /// [`Error::File`] and [`Error::Log`].
    pub fn next_message(&mut self) -> Result<Option<Message>, Error> {
        while !self.stretch.over {
            let next = match &mut self.source {
                Source::Recording(reader) => reader.next_message()?,
                Source::Text(text) => text.next_message()?,
                Source::Corrected(csv) => csv.next_message()?,
            };
            let Some(message) = next else { break };
            let received = received(message.received_ns);
            let is_taken = |unit| self.units.is_empty() || self.units.contains(unit);
            if self.stretch.holds(received, received) && message.topic.unit().is_none_or(is_taken) {
                return Ok(Some(message));
            }
        }
        Ok(None)
    }

    /// How far the log has been read.
    #[must_use]
    pub fn progress(&self) -> Progress {
        self.progress.clone()
    }

    /// What reading came to so far.
    #[must_use]
    pub fn report(&self) -> LogReport {
        match &self.source {
            Source::Recording(reader) => LogReport::Recording(reader.report().clone()),
            Source::Text(text) => LogReport::Text(text.report()),
            Source::Corrected(csv) => LogReport::Text(csv.report()),
        }
    }

    /// The recordings that are read, for what they hold beside messages; `None` for a text log.
    pub fn recording(&mut self) -> Option<&mut RecordingReader> {
        match &mut self.source {
            Source::Recording(reader) => Some(reader),
            Source::Text(_) | Source::Corrected(_) => None,
        }
    }
}

/// Whether these files are recordings; recordings and text logs do not go together.
///
/// # Errors
/// [`Error::Usage`] where some are recordings and others are not, or one is a pipe; [`Error::File`] for one that only its name tells.
pub fn are_recordings(paths: &[PathBuf]) -> Result<bool, Error> {
    paths.iter().try_for_each(|path| refuse_pipe(path))?;
    // An empty one holds nothing to repair.
    let has_bytes = |path: &PathBuf| path.metadata().is_ok_and(|file| file.is_file() && file.len() > 0);
    let named = |path: &&PathBuf| path.extension().is_some_and(|end| end == "mcap") && has_bytes(path);
    if let Some(path) = paths.iter().filter(named).find(|path| !is_recording(path)) {
        let words = "its first bytes are damaged; repair it with `isotherm-replay recover`";
        return Err(Error::file(path, "read the recording", io::Error::other(words)));
    }
    let recording = |path: &PathBuf| is_recording(Path::new(path));
    match (paths.iter().find(|path| recording(path)), paths.iter().find(|path| !recording(path))) {
        (Some(recording), Some(other)) => Err(Error::Usage(format!(
            "{} is a recording, but {} is not (or cannot be read): give recordings only, or the files of one text log",
            recording.display(),
            other.display()
        ))),
        (recording, _) => Ok(recording.is_some()),
    }
}
