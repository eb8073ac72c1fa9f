//! Recordings: MCAP files that hold every message as it was on the bus.
//!
//! | in the file | is |
//! |---|---|
//! | channel | a key, without namespace; encoding [`MESSAGE_ENCODING`], metadata `unit` where it has one |
//! | schema | kind of the frame, by name (`isotherm/raw_gyro`); encoding [`SCHEMA_ENCODING`], whose text says where the bytes are described |
//! | channel `…/json` | on request, ticks and readings once more as JSON with a JSON Schema, for viewers; passed over here |
//! | log time | when it was received (ns since 1970-01-01 UTC) |
//! | publish time | end of its last tick on the producer's clock (ns); the log time where it has none |
//! | attachment | calibration documents by digest, the service's configuration |
//! | metadata | [`METADATA`]: versions, when and how it was recorded, counts at its end; [`CHANNELS`]: keys by channel |
//!
//! Chunks end by size and by time, so that what a kill can cost is bounded. A file is read to the last whole chunk;
//! [`recover()`] gets back what stands behind a damaged one too.

mod documents;
mod ending;
mod reader;
mod record;
pub mod recover;
mod schema;
mod view;
pub(crate) mod walk;
mod writer;

#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde::Serialize;

pub use documents::{Documents, JournalAccount};
pub use reader::{RecordingReader, RecordingReport};
pub(crate) use record::chunk_records;
pub use recover::recover;
pub use writer::{RecordingOptions, RecordingWriter, io_error};

/// Encoding of the messages: frames of `docs/wire.md`.
pub const MESSAGE_ENCODING: &str = "isotherm";
/// Encoding of the schemas: plain words.
pub const SCHEMA_ENCODING: &str = "isotherm-wire";
/// Name of the metadata records that the recorder writes.
pub const METADATA: &str = "isotherm";
/// Name of the metadata records that say which channel is which key: once more, for a file that has lost the chunk with the
/// channel's own record, and its summary.
pub const CHANNELS: &str = "isotherm-channels";
/// What every MCAP file begins with.
pub const MAGIC: &[u8] = mcap::MAGIC;

/// A file inside a recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Attachment {
    /// Its name.
    pub name: String,
    /// Its media type.
    pub media_type: String,
    /// When it was attached (ns since 1970-01-01 UTC).
    pub attached_ns: u64,
    /// What it holds.
    #[serde(skip)]
    pub bytes: Vec<u8>,
}

impl Attachment {
    fn read(header: mcap::records::AttachmentHeader, data: Cow<'_, [u8]>) -> Self {
        let mcap::records::AttachmentHeader { name, media_type, log_time, .. } = header;
        Self { name, media_type, attached_ns: log_time, bytes: data.into_owned() }
    }

    fn as_written(&self) -> mcap::Attachment<'_> {
        mcap::Attachment {
            log_time: self.attached_ns,
            create_time: self.attached_ns,
            name: self.name.clone(),
            media_type: self.media_type.clone(),
            data: self.bytes.as_slice().into(),
        }
    }
}

/// A record of names and values inside a recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Metadata {
    /// Its name.
    pub name: String,
    /// What it says.
    pub values: BTreeMap<String, String>,
}

impl Metadata {
    /// What a program of this project says of a recording.
    #[must_use]
    pub fn of<N: Into<String>>(values: impl IntoIterator<Item = (N, String)>) -> Self {
        let values = values.into_iter().map(|(name, value)| (name.into(), value)).collect();
        Self { name: METADATA.to_owned(), values }
    }
}
