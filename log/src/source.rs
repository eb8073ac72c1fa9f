//! A log of either kind as messages: recordings as they are, text logs put into batches.

use std::collections::{BTreeSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use arrayvec::ArrayVec;
use isotherm_correction::units::Span;
use isotherm_protocol::codec;
use isotherm_protocol::corrected::{CorrectedBatch, Revision, SigmaRun};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::raw::{Batcher, RawFrame};
use serde::Serialize;

use crate::diff::{CorrectedLog, LogTick, Ticks};
use crate::error::Error;
use crate::file::{begins_with, open_log};
use crate::mapping::Mapping;
use crate::message::{Message, Topic};
use crate::part::Part;
use crate::progress::Progress;
use crate::recording::{self, RecordingReader, RecordingReport};
use crate::text::{LogEvent, LogReader, ReadReport};

/// Whether a file is a recording; what cannot be read is not.
#[must_use]
pub fn is_recording(path: &Path) -> bool {
    open_log(path, "open the log").is_ok_and(|file| begins_with(file, recording::MAGIC))
}

/// What messages are read from, in constant memory.
#[derive(Debug)]
pub(crate) enum Source {
    Recording(Box<RecordingReader>),
    Text(Box<TextLog>),
    Corrected(Box<CorrectedCsv>),
}

/// What reading a log came to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum LogReport {
    /// Of recordings.
    Recording(RecordingReport),
    /// Of a text log.
    Text(ReadReport),
}

impl LogReport {
    /// Whether anything of the log was lost.
    #[must_use]
    pub fn lost_data(&self) -> bool {
        match self {
            Self::Recording(report) => report.lost_data(),
            Self::Text(report) => report.lost_data(),
        }
    }
}

impl Source {
    /// Opens recordings, to be read one behind the other, for who needs no message that was received before a time: see
    /// [`RecordingReader::open_at`].
    ///
    /// # Errors
    /// [`Error::File`].
    pub(crate) fn recordings(paths: &[PathBuf], before_ns: u64) -> Result<(Self, Progress), Error> {
        let mut total = 0;
        for path in paths {
            let length = std::fs::metadata(path).map(|metadata| metadata.len());
            total += length.map_err(|source| Error::file(path, "open the recording", source))?;
        }
        let read = Arc::new(AtomicU64::new(0));
        let reader = RecordingReader::open_at(paths, before_ns, Arc::clone(&read))?;
        Ok((Self::Recording(Box::new(reader)), Progress::new(read, total)))
    }

    /// Opens a part of a text log of a unit, to be put into batches of so many gyro ticks.
    ///
    /// # Errors
    /// As [`LogReader::open`].
    pub(crate) fn text(
        paths: &[PathBuf],
        mapping: &Mapping,
        unit: &UnitId,
        batch_ticks: usize,
        part: &Part,
    ) -> Result<(Self, Progress), Error> {
        let events = LogReader::open(mapping, paths)?.within(part);
        let progress = events.progress();
        // What cannot be read is reported when it is read.
        let beginning = LogReader::beginning(mapping, paths).ok().flatten();
        let received_after = beginning.map_or(Span::ZERO, |(_, later)| later);
        let (unit, batcher) = (unit.clone(), Batcher::new(batch_ticks));
        let text = TextLog { events, unit, batcher, received_after, over: false };
        Ok((Self::Text(Box::new(text)), progress))
    }

    /// Opens a part of a CSV of corrected ticks of a unit.
    ///
    /// # Errors
    /// [`Error::File`].
    pub(crate) fn corrected(path: &Path, unit: &UnitId, part: &Part) -> Result<(Self, Progress), Error> {
        let ticks = CorrectedLog::open(path, &Part { units: BTreeSet::new(), ..part.clone() }, unit)?;
        let progress = ticks.progress();
        let csv = CorrectedCsv { ticks, ready: VecDeque::new(), rows: 0 };
        Ok((Self::Corrected(Box::new(csv)), progress))
    }
}

/// Corrected ticks of a CSV, put into batches of one calibration each.
#[derive(Debug)]
pub(crate) struct CorrectedCsv {
    ticks: CorrectedLog,
    ready: VecDeque<Message>,
    rows: u64,
}

impl CorrectedCsv {
    pub(crate) fn report(&self) -> ReadReport {
        ReadReport { rows: self.rows, ..ReadReport::default() }
    }

    pub(crate) fn next_message(&mut self) -> Result<Option<Message>, Error> {
        while self.ready.is_empty() {
            let Some(Ticks { unit, ticks }) = self.ticks.next_ticks()? else { return Ok(None) };
            self.rows += ticks.len() as u64;
            let of = |tick: &LogTick| (tick.tick.revision, tick.tick.series);
            for same in ticks.chunk_by(|a, b| of(a) == of(b)) {
                let Some(last) = same.last() else { continue };
                let batch = CorrectedBatch {
                    unit: unit.to_string(),
                    series: last.tick.series,
                    revision: Revision {
                        counter: last.tick.revision,
                        digest: last.digest.unwrap_or_default(),
                    },
                    temperatures: ArrayVec::new(),
                    sigmas: SigmaRun::of(same.iter().map(|tick| &tick.tick)),
                    ticks: same.iter().map(|tick| tick.tick.clone()).collect(),
                };
                let frame = codec::encode(&batch)
                    .map_err(|error| Error::Usage(format!("a corrected tick is invalid: {error}")))?;
                let received_ns = u64::try_from(last.tick.end_time.as_ns()).unwrap_or(0);
                self.ready.push_back(Message { topic: Topic::Corrected(unit.clone()), received_ns, frame });
            }
        }
        Ok(self.ready.pop_front())
    }
}

/// A text log, put into batches.
#[derive(Debug)]
pub(crate) struct TextLog {
    events: LogReader,
    unit: UnitId,
    batcher: Batcher,
    /// Time of reception after a tick's own.
    received_after: Span,
    over: bool,
}

impl TextLog {
    pub(crate) fn report(&self) -> ReadReport {
        self.events.report()
    }

    pub(crate) fn next_message(&mut self) -> Result<Option<Message>, Error> {
        loop {
            if let Some(frame) = self.batcher.next_frame() {
                let frame = frame.map_err(|source| Error::Batch { unit: self.unit.clone(), source })?;
                return Ok(Some(self.message(frame)));
            }
            if self.over {
                return Ok(None);
            }
            match self.events.next().transpose()? {
                Some(LogEvent::Gyro { output, tick }) => self.batcher.gyro(output, tick),
                Some(LogEvent::Accel { output, tick }) => self.batcher.accel(output, tick),
                Some(LogEvent::Temperature(reading)) => self.batcher.temperature(reading),
                None => {
                    self.over = true;
                    self.batcher.flush();
                }
            }
        }
    }

    fn message(&self, frame: RawFrame) -> Message {
        let RawFrame { stream, frame, time, .. } = frame;
        let received_ns = u64::try_from((time + self.received_after).as_ns()).unwrap_or(0);
        Message { topic: Topic::Raw(self.unit.clone(), stream), received_ns, frame }
    }
}
