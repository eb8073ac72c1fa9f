//! A log in another form: recordings as text, ROS 2 bags and Parquet files, text logs as recordings.
//!
//! What this crate refuses to do: decode a log by itself (`isotherm-log` does), or leave a message out without counting it.
//!
//! A conversion reads its log twice. The first reading finds the units, their sensors and their channels, so that every output knows
//! its columns before the first row; then the messages are written out one by one. Memory depends on the number of units, not on
//! the length of the log.

mod bag;
mod outcome;
mod output;
mod parquet;
mod recording;
mod ros2;
mod text;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use isotherm_cli::Bar;
use isotherm_log::error::Error;
use isotherm_log::message::Message;
use isotherm_log::part::{LogFiles, Part};
use isotherm_log::recording::{Attachment, RecordingReader};
use isotherm_log::source::LogReport;
use isotherm_log::streams::contents::Contents;
use isotherm_log::streams::decoded::{Decoded, decode};
use isotherm_protocol::document::Document;
use isotherm_protocol::key::UnitId;
use serde::Serialize;

pub use bag::BagTopic;
pub use outcome::{Converted, Outcome, Written};
pub use output::Place;
pub use ros2::Ros2Options;

/// What a log is converted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Target {
    /// Recording (MCAP) with the raw messages of a text log
    Mcap,
    /// Text: raw streams as CSV with a mapping, corrected ticks as CSV
    Text,
    /// ROS 2 bag: a folder with metadata.yaml and an MCAP file
    Ros2,
    /// Parquet: one file per unit and stream
    Parquet,
}

impl Target {
    /// What the name of a file says; `None` for a folder, or a name that says nothing.
    #[must_use]
    pub fn by_name(out: &Path) -> Option<Self> {
        let ends = |path: &Path, in_what: &str| {
            path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(in_what))
        };
        let plain = if ends(out, "gz") { out.with_extension("") } else { out.to_owned() };
        if ends(&plain, "csv") {
            Some(Self::Text)
        } else if ends(out, "mcap") {
            Some(Self::Mcap)
        } else {
            None
        }
    }
}

/// A conversion that is to be done.
#[derive(Debug)]
pub struct Conversion {
    /// The log.
    pub files: LogFiles,
    /// The part of it.
    pub part: Part,
    /// What it is converted to.
    pub target: Target,
    /// Where that goes.
    pub out: PathBuf,
    /// How files are created.
    pub place: Place,
    /// Whether chunks of a recording are compressed.
    pub compress: bool,
    /// Whether ticks and readings are in a recording once more as JSON, for viewers.
    pub json: bool,
    /// Names of the log's files and of its mapping, for the provenance.
    pub sources: Vec<(String, String)>,
    /// For ROS 2 bags.
    pub ros2: Ros2Options,
}

/// What the first reading of a log found.
#[derive(Debug)]
struct Found {
    contents: Contents,
    /// Calibration documents in recordings, in their order.
    documents: Vec<Document>,
}

impl Conversion {
    /// Does it. Files appear under their names when everything is written; after an error there are none.
    ///
    /// # Errors
    /// Those of the log and of the outputs.
    pub fn run(&self) -> Result<Outcome, Error> {
        match self.target {
            Target::Mcap => recording::convert(self),
            Target::Text => text::convert(self, &self.look()?),
            Target::Ros2 => ros2::convert(self, &self.look()?),
            Target::Parquet => parquet::convert(self, &self.look()?),
        }
    }

    /// Finds out what the log holds.
    fn look(&self) -> Result<Found, Error> {
        let mut contents = Contents::default();
        let (_, documents) = self.read("looking", |message| {
            contents.add(message);
            Ok(())
        })?;
        if contents.units.is_empty() {
            Err(Error::Nothing("convert"))
        } else {
            Ok(Found { contents, documents })
        }
    }

    /// Reads the log's part, of which `each` gets every message; what reading came to, and the calibration documents in recordings.
    fn read(
        &self,
        words: &'static str,
        mut each: impl FnMut(&Message) -> Result<(), Error>,
    ) -> Result<(LogReport, Vec<Document>), Error> {
        let mut messages = self.files.open(&self.part)?;
        let mut bar = Bar::over_logs(words);
        bar.begin(messages.progress().watch());
        let mut documents = Vec::new();
        loop {
            let message = messages.next_message()?;
            // They may stand behind the last message.
            let attached = messages.recording().map(RecordingReader::take_attachments).unwrap_or_default();
            documents.extend(attached.iter().filter_map(document));
            let Some(message) = message else { break };
            each(&message)?;
            bar.step();
        }
        bar.finish();
        Ok((messages.report(), documents))
    }

    /// Reads the log's part into its units; what is of none, or cannot be read, is counted.
    fn read_units<U>(
        &self,
        units: &mut BTreeMap<UnitId, U>,
        converted: &mut Converted,
        mut take: impl FnMut(&mut U, u64, &Decoded, &mut Converted) -> Result<(), Error>,
    ) -> Result<LogReport, Error> {
        let (report, _) = self.read("writing", |message| {
            let Ok(decoded) = decode(message) else {
                converted.lose("frames that cannot be read", 1);
                return Ok(());
            };
            match decoded.and_then(|(unit, decoded)| Some((units.get_mut(unit)?, decoded))) {
                Some((unit, decoded)) => take(unit, message.received_ns, &decoded, converted)?,
                None => converted.leave_out("messages of no unit", 1),
            }
            Ok(())
        })?;
        Ok(report)
    }

    /// Names and values that every output carries.
    fn provenance(&self) -> Vec<(String, String)> {
        let mut words = vec![("isotherm".to_owned(), env!("CARGO_PKG_VERSION").to_owned())];
        words.extend(self.sources.iter().cloned());
        if let Some((start, end)) = self.part.window() {
            words.push(("start_s".to_owned(), start.as_s().to_string()));
            words.extend(end.map(|end| ("end_s".to_owned(), end.as_s().to_string())));
        }
        words
    }
}

/// A calibration document in a recording; what is none is passed over.
fn document(attachment: &Attachment) -> Option<Document> {
    Document::parse_bytes(&attachment.bytes, None).ok().map(|parsed| parsed.document)
}
