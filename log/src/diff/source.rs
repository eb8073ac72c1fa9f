//! Corrected logs, read tick by tick: recordings, and the CSV and wire files of `correct`.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use isotherm_protocol::codec::{self, MAX_FRAME};
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::journal::{Joiner, JournalEvent};
use isotherm_protocol::key::UnitId;

use super::tick::LogTick;
use crate::error::Error;
use crate::file::begins_with;
use crate::message::{Message, Topic};
use crate::offline::rows::{FIRST_COLUMNS, read_tick};
use crate::offline::unit_id;
use crate::part::{LogFiles, Messages, Part, Stretch};
use crate::progress::Progress;
use crate::recording::RecordingReport;
use crate::replica::{entry_words, join};
use crate::source::{LogReport, is_recording};
use crate::text::{Bytes, open_raw};

/// Rows of a CSV that are read together.
const ROWS: usize = 512;
/// Longest row (bytes).
const LONGEST_ROW: u64 = 1 << 16;

/// Ticks of one unit, in order.
#[derive(Debug)]
pub struct Ticks {
    /// The unit.
    pub unit: UnitId,
    /// Its ticks.
    pub ticks: Vec<LogTick>,
}

/// A log of corrected ticks.
pub struct CorrectedLog {
    path: PathBuf,
    source: Source,
    /// The part of a CSV or wire file that is taken.
    part: Stretch,
    progress: Progress,
}

impl std::fmt::Debug for CorrectedLog {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CorrectedLog").field("path", &self.path).finish_non_exhaustive()
    }
}

enum Source {
    Recording(Box<Recording>),
    Csv { lines: BufReader<Bytes>, unit: UnitId, line: u64 },
    Wire { bytes: BufReader<Bytes>, units: BTreeSet<UnitId>, frame: Vec<u8>, begun: bool },
}

#[derive(Debug)]
struct Recording {
    messages: Messages,
    joiner: Joiner,
    /// What happened since the last tick of a unit.
    events: BTreeMap<UnitId, String>,
    ready: VecDeque<Ticks>,
}

/// Whether a file is a CSV of corrected ticks, which does not say of which unit it is.
#[must_use]
pub fn is_csv(path: &Path) -> bool {
    open_raw(path, &Arc::default()).is_ok_and(|(bytes, _)| begins_with(bytes, FIRST_COLUMNS.as_bytes()))
}

impl CorrectedLog {
    /// Opens a part of a log. A CSV is of the first of its units, or of `unnamed`.
    ///
    /// A recording is cut between messages, a CSV or wire file between ticks.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be opened.
    pub fn open(path: &Path, part: &Part, unnamed: &UnitId) -> Result<Self, Error> {
        let (read, units) = (Arc::default(), &part.units);
        let (source, progress) = if is_recording(path) {
            let messages = LogFiles::Recordings(vec![path.to_owned()]).open(part)?;
            let (progress, joiner) = (messages.progress(), Joiner::new());
            let recording = Recording { messages, joiner, events: BTreeMap::new(), ready: VecDeque::new() };
            (Source::Recording(Box::new(recording)), progress)
        } else {
            let csv = is_csv(path);
            let (bytes, length) = open_raw(path, &read)?;
            let bytes = BufReader::new(bytes);
            let source = if csv {
                Source::Csv { lines: bytes, unit: units.first().unwrap_or(unnamed).clone(), line: 0 }
            } else {
                Source::Wire { bytes, units: units.clone(), frame: Vec::new(), begun: false }
            };
            (source, Progress::new(read, length))
        };
        let part = Stretch::of(part);
        Ok(Self { path: path.to_owned(), source, part, progress })
    }

    /// The next ticks; `None` behind the last.
    ///
    /// # Errors
    /// [`Error::File`], [`Error::NoCorrectedTicks`].
    pub fn next_ticks(&mut self) -> Result<Option<Ticks>, Error> {
        let path = &self.path;
        let failed = |source| Error::file(path, "read the corrected log", source);
        let part = &mut self.part;
        let mut take = |ticks: &mut Vec<LogTick>| {
            ticks.retain(|LogTick { tick, .. }: &LogTick| {
                part.holds(tick.end_time - tick.duration, tick.end_time)
            });
            part.over
        };
        match &mut self.source {
            Source::Recording(recording) => recording.next_ticks(),
            Source::Csv { lines, unit, line } => loop {
                let mut ticks = read_rows(lines, line).map_err(failed)?;
                let over = ticks.is_empty() || take(&mut ticks);
                if over || !ticks.is_empty() {
                    return Ok((!ticks.is_empty()).then(|| Ticks { unit: unit.clone(), ticks }));
                }
            },
            Source::Wire { bytes, units, frame, begun } => loop {
                let read = read_frame(bytes, frame).map_err(|source| match source.kind() {
                    // What does not begin as one is a file of another kind: a CSV of other columns, say.
                    io::ErrorKind::Other | io::ErrorKind::UnexpectedEof if !*begun => {
                        Error::NoCorrectedTicks { path: path.display().to_string() }
                    }
                    _ => failed(source),
                });
                let Some(batch) = read? else { return Ok(None) };
                *begun = true;
                let mut ticks = ticks_of(batch)?;
                take(&mut ticks.ticks);
                if !ticks.ticks.is_empty() && (units.is_empty() || units.contains(&ticks.unit)) {
                    return Ok(Some(ticks));
                }
            },
        }
    }

    /// How far it has been read.
    #[must_use]
    pub fn progress(&self) -> Progress {
        self.progress.clone()
    }

    /// Why it was not read to its end, if it was not.
    #[must_use]
    pub fn cut_short(&self) -> Option<String> {
        match &self.source {
            Source::Recording(recording) => match recording.messages.report() {
                LogReport::Recording(RecordingReport { cut_short, .. }) => cut_short,
                LogReport::Text(_) => None,
            },
            Source::Csv { .. } | Source::Wire { .. } => None,
        }
    }
}

impl Recording {
    fn next_ticks(&mut self) -> Result<Option<Ticks>, Error> {
        while self.ready.is_empty() {
            let Some(Message { topic, frame, .. }) = self.messages.next_message()? else { return Ok(None) };
            match topic {
                Topic::Corrected(unit) => {
                    // A frame that cannot be read is missing: its ticks will be.
                    let Ok(batch) = codec::decode::<CorrectedBatch>(&frame) else { continue };
                    let mut ticks = Ticks { unit, ..ticks_of(batch)? };
                    let event = self.events.remove(&ticks.unit);
                    if let (Some(first), Some(event)) = (ticks.ticks.first_mut(), event) {
                        first.event = Some(event.into());
                    }
                    self.ready.push_back(ticks);
                }
                Topic::Journal(unit) => {
                    if let Ok(Some(entry)) = join(&mut self.joiner, &frame)
                        && !matches!(entry.event, JournalEvent::Memory { .. })
                    {
                        self.events.insert(unit, entry_words(&entry));
                    }
                }
                _ => {}
            }
        }
        Ok(self.ready.pop_front())
    }
}

/// The ticks of a batch.
pub(crate) fn ticks_of(batch: CorrectedBatch) -> Result<Ticks, Error> {
    let CorrectedBatch { unit, revision, ticks, .. } = batch;
    let digest = (revision.counter > 0).then_some(revision.digest);
    let tick = |tick| LogTick { tick, digest, event: None };
    Ok(Ticks { unit: unit_id(&unit)?, ticks: ticks.into_iter().map(tick).collect() })
}

/// The next rows of a CSV.
fn read_rows(lines: &mut impl BufRead, line: &mut u64) -> io::Result<Vec<LogTick>> {
    let mut ticks = Vec::new();
    let mut row = String::new();
    while ticks.len() < ROWS {
        row.clear();
        if lines.by_ref().take(LONGEST_ROW).read_line(&mut row)? == 0 {
            break;
        }
        *line += 1;
        let row = row.trim_end();
        if *line == 1 && row.starts_with(FIRST_COLUMNS) {
            continue;
        }
        let tick = read_tick(row).map_err(|words| io::Error::other(format!("line {line}: {words}")))?;
        ticks.push(LogTick { tick, ..LogTick::default() });
    }
    Ok(ticks)
}

/// The next frame behind its length.
fn read_frame(bytes: &mut impl BufRead, frame: &mut Vec<u8>) -> io::Result<Option<CorrectedBatch>> {
    let other = |words: String| io::Error::other(format!("{words}: the file is damaged there"));
    if bytes.fill_buf()?.is_empty() {
        return Ok(None);
    }
    let mut length = [0; 4];
    bytes.read_exact(&mut length)?;
    let length = u32::from_le_bytes(length);
    if length as usize > MAX_FRAME {
        return Err(other(format!("a frame of {length} bytes, longer than any")));
    }
    frame.clear();
    if bytes.take(u64::from(length)).read_to_end(frame)? < length as usize {
        return Err(other("it ends within a frame".to_owned()));
    }
    codec::decode(frame).map(Some).map_err(|error| other(error.to_string()))
}
