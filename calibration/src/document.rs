//! Calibration documents: on their way to a file, compared, merged, shown.
//!
//! | module | holds |
//! |---|---|
//! | `written`, `provenance`, `plain` | a document on its way to a file; where its numbers come from; the first of a unit |
//! | [`diff`] | what has changed between documents |
//! | [`merge`] | parts of a calibration in one document |
//! | [`show`] | a document in words and curves |

pub mod diff;
pub mod merge;
mod plain;
mod provenance;
pub mod show;
mod written;

use isotherm_protocol::document::{AccelSensor, Document};

pub(crate) use plain::{follows, plain};
pub(crate) use provenance::files_of;
pub use provenance::{TOOL, command_line, origin, recordings_in};
pub use written::{Written, matrix, name_of, numbers, tidy, write_file};

/// The accelerometers of a document.
pub fn accelerometers(document: &Document) -> &[AccelSensor] {
    document.accel.as_ref().map_or(&[], |accel| &accel.sensor)
}
