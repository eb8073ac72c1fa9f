//! Text logs as events in time order, in constant memory.

mod assemble;
mod cells;
mod dates;
mod error;
mod file;
mod input;
mod number;
mod resolve;
mod row;
#[cfg(test)]
mod tests;
pub mod timeline;

use std::path::{Path, PathBuf};
use std::slice;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use isotherm_correction::sample::{AccelTick, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::unit::Event;
use isotherm_correction::units::{Span, Timestamp};
use serde::Serialize;

use crate::error::Error;
use crate::mapping::{Delimiter, Encoding, FileMapping, Mapping};
use crate::part::{Part, Stretch};
use crate::progress::Progress;
use file::FileReader;

pub(crate) use dates::{DAY_NS, is_date, is_next_day, says_order, stamp_ns};
pub(crate) use input::{Source as Bytes, open as open_raw};

pub use error::{LogError, LogFault, Reason};

/// Lines of a file, decompressed and decoded.
pub(crate) fn open_decoded(path: &Path, encoding: Encoding) -> Result<input::Lines, Error> {
    let (source, _) = input::open(path, &Arc::default())?;
    Ok(input::Lines::new(input::decoded(source, encoding)))
}

/// Cells of a line, unquoted; `None` for a quote that does not end on it.
pub(crate) fn split_cells(line: &str, delimiter: Delimiter) -> Option<Vec<String>> {
    let (mut line, mut cells) = (line.as_bytes().to_vec(), Vec::new());
    cells::split(&mut line, delimiter, &mut cells).ok()?;
    let text = |cell: &cells::Cell| line.get(cell.start..cell.end).unwrap_or_default();
    Some(cells.iter().map(|cell| String::from_utf8_lossy(text(cell)).into_owned()).collect())
}

/// A number as the reader of text logs takes it.
pub(crate) fn parse_float(cell: &str, decimal_mark: u8) -> Option<f64> {
    number::float(cell.as_bytes(), decimal_mark)
}

/// One thing that happened in a log.
#[derive(Debug, Clone, PartialEq)]
pub enum LogEvent {
    /// A gyro tick.
    Gyro {
        /// What its readings stand for.
        output: OutputKind,
        /// The tick.
        tick: GyroTick,
    },
    /// An accelerometer tick.
    Accel {
        /// What its readings stand for.
        output: OutputKind,
        /// The tick.
        tick: AccelTick,
    },
    /// A temperature reading.
    Temperature(TemperatureReading),
}

impl LogEvent {
    /// When it happened: the end of a tick, or the time of a reading.
    #[must_use]
    pub fn time(&self) -> Timestamp {
        match self {
            Self::Gyro { tick, .. } => tick.end_time,
            Self::Accel { tick, .. } => tick.end_time,
            Self::Temperature(reading) => reading.time,
        }
    }

    /// When it began: the start of a tick, or the time of a reading.
    pub(crate) fn began(&self) -> Timestamp {
        match self {
            Self::Gyro { tick, .. } => tick.end_time - tick.duration,
            Self::Accel { tick, .. } => tick.end_time - tick.duration,
            Self::Temperature(reading) => reading.time,
        }
    }

    /// Place among events of the same time: temperature, accelerometers, gyros.
    fn rank(&self) -> u8 {
        match self {
            Self::Temperature(_) => 0,
            Self::Accel { .. } => 1,
            Self::Gyro { .. } => 2,
        }
    }

    /// What events are ordered by.
    fn order(&self) -> (Timestamp, u8) {
        (self.time(), self.rank())
    }
}

impl<'e> From<&'e LogEvent> for Event<'e> {
    fn from(event: &'e LogEvent) -> Self {
        match event {
            LogEvent::Gyro { output, tick } => Self::Gyro { output: *output, ticks: slice::from_ref(tick) },
            LogEvent::Accel { output, tick } => Self::Accel { output: *output, ticks: slice::from_ref(tick) },
            LogEvent::Temperature(reading) => Self::Temperature(slice::from_ref(reading)),
        }
    }
}

/// What reading a log came to.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct ReadReport {
    /// Rows that gave events.
    pub rows: u64,
    /// Rows in front that the mapping drops.
    pub dropped_rows: u64,
    /// Rows that could not be read and were passed over.
    pub skipped_rows: u64,
    /// Rows that were passed over because of their status.
    pub bad_status_rows: u64,
    /// Rows that repeat the one before them with its time, passed over.
    pub repeated_rows: u64,
    /// Midnights that times of day without a date have passed.
    pub midnights: u64,
    /// Rows of other units.
    pub rows_of_others: u64,
    /// Why the first of the rows that could not be read could not be.
    pub first_skipped: Option<String>,
    /// A file's last line has no line end: its last cell may be cut.
    pub unterminated_last_line: bool,
    /// A compressed file ends in the middle.
    pub cut_short: bool,
}

impl ReadReport {
    /// Whether anything of the log was lost.
    #[must_use]
    pub fn lost_data(&self) -> bool {
        self.skipped_rows > 0 || self.cut_short
    }

    /// Adds what another file came to.
    fn add(&mut self, other: &Self) {
        self.rows += other.rows;
        self.dropped_rows += other.dropped_rows;
        self.skipped_rows += other.skipped_rows;
        self.bad_status_rows += other.bad_status_rows;
        self.repeated_rows += other.repeated_rows;
        self.midnights += other.midnights;
        self.rows_of_others += other.rows_of_others;
        self.first_skipped = self.first_skipped.take().or_else(|| other.first_skipped.clone());
        self.unterminated_last_line |= other.unterminated_last_line;
        self.cut_short |= other.cut_short;
    }
}

/// Reads a log's events in time order; at equal time temperature, accelerometers, gyros.
///
/// After an error there are no further events.
#[derive(Debug)]
pub struct LogReader {
    /// Its files, each with its next event.
    files: Vec<(FileReader, Option<LogEvent>)>,
    /// Where they are.
    paths: Vec<PathBuf>,
    /// The part of its time that is given.
    part: Stretch,
    /// How far it has been read.
    progress: Progress,
    /// The next events have been asked for.
    primed: bool,
    /// An error was given.
    failed: bool,
}

impl LogReader {
    /// Opens a log: `paths` are its files by the mapping's names or in its order, or one folder that has them all.
    ///
    /// # Errors
    /// [`Error::Usage`] where files and mapping do not go together, [`Error::File`] where one cannot be opened,
    /// [`Error::Log`] where its header does not have the mapping's columns.
    pub fn open(mapping: &Mapping, paths: &[PathBuf]) -> Result<Self, Error> {
        let paths = locate(mapping, paths)?;
        let read = Arc::new(AtomicU64::new(0));
        let mut total = 0;
        let mut files = Vec::with_capacity(paths.len());
        for (path, mapping) in paths.iter().zip(&mapping.files) {
            let (source, size) = input::open(path, &read)?;
            total += size;
            files.push((FileReader::new(path, source, mapping)?, None));
        }
        let (part, progress) = (Stretch::default(), Progress::new(read, total));
        Ok(Self { files, paths, part, progress, primed: false, failed: false })
    }

    /// When a log begins, and what is added to its times so that they are times of reception, which are never before 1970; `None` for
    /// one without events.
    ///
    /// # Errors
    /// As [`Self::open`], and where the first event cannot be read.
    pub(crate) fn beginning(
        mapping: &Mapping,
        paths: &[PathBuf],
    ) -> Result<Option<(Timestamp, Span)>, Error> {
        let first = Self::open(mapping, paths)?.next().transpose()?;
        Ok(first.map(|first| {
            let began = first.began();
            let is_before = first.time() < Timestamp::from_ns(0);
            (began, if is_before { Timestamp::from_ns(0).since(began) } else { Span::ZERO })
        }))
    }

    /// The same log, of which a part of the time is given.
    #[must_use]
    pub fn within(self, part: &Part) -> Self {
        Self { part: Stretch::of(part), ..self }
    }

    /// Its files.
    #[must_use]
    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// How far it has been read.
    #[must_use]
    pub fn progress(&self) -> Progress {
        self.progress.clone()
    }

    /// What reading came to so far.
    #[must_use]
    pub fn report(&self) -> ReadReport {
        let mut report = ReadReport::default();
        for (file, _) in &self.files {
            report.add(file.report());
        }
        report
    }

    /// The next event of whichever file has the earliest.
    fn merge(&mut self) -> Result<Option<LogEvent>, LogError> {
        if let [(file, _)] = self.files.as_mut_slice() {
            return file.next_event();
        }
        if !self.primed {
            for (file, next) in &mut self.files {
                *next = file.next_event()?;
            }
            self.primed = true;
        }
        let earliest = self.files.iter_mut().filter(|(_, next)| next.is_some());
        let Some((file, next)) = earliest.min_by_key(|(_, next)| next.as_ref().map(LogEvent::order)) else {
            return Ok(None);
        };
        let following = file.next_event()?;
        Ok(std::mem::replace(next, following))
    }
}

impl Iterator for LogReader {
    type Item = Result<LogEvent, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        while !self.failed && !self.part.over {
            let event = self.merge();
            self.failed = event.is_err();
            match event.transpose()? {
                Ok(event) if !self.part.holds(event.began(), event.time()) => {}
                event => return Some(event),
            }
        }
        None
    }
}

/// The path of each file of the mapping.
fn locate(mapping: &Mapping, paths: &[PathBuf]) -> Result<Vec<PathBuf>, Error> {
    let need = mapping.files.len();
    if let [folder] = paths
        && folder.is_dir()
    {
        let names: Option<Vec<_>> = mapping.files.iter().map(|file| file.name.as_deref()).collect();
        let names = names.ok_or(Error::Usage(
            "the log is a folder, so every [[file]] of the mapping needs a `name`".into(),
        ))?;
        return Ok(names.into_iter().map(|name| folder.join(name)).collect());
    }
    if paths.len() != need {
        let got = paths.len();
        let list: Vec<_> = mapping.files.iter().filter_map(|file| file.name.as_deref()).collect();
        let names = if list.is_empty() { String::new() } else { format!(" ({})", list.join(", ")) };
        return Err(Error::Usage(format!(
            "{got} log files are given, the mapping describes {need}{names}: give them in its order, or the folder that has them"
        )));
    }
    // Files that have the mapping's names are told by these, in whichever order they are given.
    let has_name = |path: &&PathBuf, name: &str| path.file_name().is_some_and(|own| own == name);
    let named = |file: &FileMapping| {
        let name = file.name.as_deref()?;
        paths.iter().find(|path| has_name(path, name)).cloned()
    };
    let by_name: Option<Vec<_>> = mapping.files.iter().map(named).collect();
    let by_name = by_name.filter(|named| paths.iter().all(|path| named.contains(path)));
    Ok(by_name.unwrap_or_else(|| paths.to_vec()))
}
