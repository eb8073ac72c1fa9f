//! Getting back what is whole of a recording that is cut short or damaged.

mod rescue;
mod scan;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use mcap::records::Record;
use serde::Serialize;

use super::{RecordingOptions, writer};
use crate::error::Error;
use crate::file::{Partial, refuse_overwriting, refuse_replacing};
use crate::progress::Progress;
use rescue::{Definitions, Rescue};
use scan::{Piece, Scanner};

pub use scan::Damage;

/// Damaged places that the report names; the others are counted.
const NAMED_DAMAGE: usize = 1000;

/// What was got back, and what was lost.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct RecoveryReport {
    /// Length of the file (bytes).
    pub bytes: u64,
    /// Whether the data had its end; where it has none, what its recorder had in memory is lost too. A damaged summary behind
    /// it is no loss.
    pub ended: bool,
    /// Chunks that were whole.
    pub chunks: u64,
    /// Messages in them, all written.
    pub messages: u64,
    /// Messages that are known to be lost: by the file's own summary, else by the numbers of those before and behind.
    pub missing: u64,
    /// Messages that were whole but of a channel that nothing in the file names: not written.
    pub nameless: u64,
    /// By key, where messages were written or are known to be lost.
    pub topics: BTreeMap<String, TopicRecovery>,
    /// Attachments that were whole.
    pub attachments: u64,
    /// Calibration documents attached anew, from the journal.
    pub documents_rebuilt: u64,
    /// Metadata records that were whole.
    pub metadata: u64,
    /// Places that were passed over, the first thousand.
    pub damage: Vec<Damage>,
    /// Places that were passed over.
    pub damaged_places: u64,
    /// Their bytes.
    pub damaged_bytes: u64,
}

/// What was got back of a topic.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct TopicRecovery {
    /// Messages written.
    pub messages: u64,
    /// Messages whose numbers were passed over.
    pub missing: u64,
}

impl RecoveryReport {
    /// Whether anything that was in the file is lost.
    #[must_use]
    pub fn lost_data(&self) -> bool {
        self.damaged_places > 0 || self.missing > 0 || self.nameless > 0
    }

    fn note_damage(&mut self, damage: Damage) {
        self.damaged_places += 1;
        self.damaged_bytes += damage.length;
        if self.damage.len() < NAMED_DAMAGE {
            self.damage.push(damage);
        }
    }
}

/// A recording that is to be recovered.
#[derive(Debug)]
pub struct Recovery {
    input: PathBuf,
    read: Arc<AtomicU64>,
    length: u64,
    /// It begins as a recording does.
    begins_well: bool,
}

impl Recovery {
    /// Looks at the file.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be read.
    pub fn open(input: &Path) -> Result<Self, Error> {
        let scanner = Scanner::open(input)?;
        let (length, begins_well) = (scanner.length(), scanner.begins_well());
        Ok(Self { input: input.to_owned(), read: Arc::default(), length, begins_well })
    }

    /// How far it has been read.
    #[must_use]
    pub fn progress(&self) -> Progress {
        Progress::new(Arc::clone(&self.read), self.length)
    }

    /// Writes everything that is whole into a new file, with a summary, which has its name when it is whole; `watch` is called now
    /// and then.
    ///
    /// # Errors
    /// [`Error::Usage`] where the new file, or what it is called before, is the old one, [`Error::File`] where one cannot be read or
    /// the other not be written, and where nothing in the old one is of a recording.
    pub fn run(
        &self,
        output: &Path,
        options: RecordingOptions,
        mut watch: impl FnMut(&RecoveryReport),
    ) -> Result<RecoveryReport, Error> {
        refuse_overwriting(output, &[&self.input])?;
        refuse_replacing(output, options.overwrite)?;
        let options = RecordingOptions { overwrite: true, ..options };
        let partial = Partial::of(output);
        let mut definitions = Definitions::default();
        let mut report = self.pass(partial.writing(), options, &mut definitions, &mut watch)?;
        if report.nameless > 0 && definitions.are_more() {
            // The names stood behind the messages.
            report = self.pass(partial.writing(), options, &mut definitions, &mut watch)?;
        }
        let is_damaged = report.damaged_places > 0 || !self.begins_well;
        if report.chunks + report.attachments == 0 && is_damaged {
            // What was written holds nothing.
            let source = std::io::Error::other("nothing in it is intact, or it is not a recording");
            return Err(Error::file(&self.input, "recover the recording", source));
        }
        partial.keep()?;
        Ok(report)
    }

    /// Goes through the file once.
    fn pass(
        &self,
        output: &Path,
        options: RecordingOptions,
        definitions: &mut Definitions,
        watch: &mut impl FnMut(&RecoveryReport),
    ) -> Result<RecoveryReport, Error> {
        let mut scanner = Scanner::open(&self.input)?;
        let failed = |source| Error::file(&self.input, "read the recording", source);
        let not_written = |source| writer::failed(output, source);
        let mut piece = scanner.next_piece().map_err(failed)?;
        let profile = scan::profile(piece.as_ref()).unwrap_or("isotherm").to_owned();
        let mut rescue = Rescue::create(output, options, &profile, definitions)?;
        let mut report = RecoveryReport { bytes: self.length, ..RecoveryReport::default() };
        while let Some(found) = piece {
            match found {
                // Behind the data only the summary stands, which is made anew.
                Piece::Damage(_) if report.ended => {}
                Piece::Damage(damage) => report.note_damage(damage),
                Piece::Record(Record::DataEnd(_)) => report.ended = true,
                Piece::Chunk(records) => {
                    report.chunks += 1;
                    let taken = records.into_iter().try_for_each(|record| rescue.take(record, &mut report));
                    taken.and_then(|()| rescue.end_chunk()).map_err(not_written)?;
                }
                Piece::Record(record) => rescue.take(record, &mut report).map_err(not_written)?,
            }
            self.read.store(scanner.offset(), Ordering::Relaxed);
            watch(&report);
            piece = scanner.next_piece().map_err(failed)?;
        }
        rescue.finish(&mut report).map_err(not_written)?;
        Ok(report)
    }
}

/// Writes everything that is whole of `input` into `output`.
///
/// # Errors
/// As [`Recovery::open`] and [`Recovery::run`].
pub fn recover(input: &Path, output: &Path, options: RecordingOptions) -> Result<RecoveryReport, Error> {
    Recovery::open(input)?.run(output, options, |_| {})
}
