//! Calibration documents: on their way to a file, compared, merged, shown.
//!
//! | module | holds |
//! |---|---|
//! | `written`, `provenance`, `plain` | a document on its way to a file; where its numbers come from; the first of a unit |
//! | [`diff`] | what has changed between documents |
//! | [`merge`] | parts of a calibration in one document |
//! | [`show`] | a document in words and curves |

pub mod diff;
mod fitted;
pub mod merge;
mod plain;
mod provenance;
pub mod show;
mod written;

use isotherm_protocol::document::{AccelSensor, Document};

pub use fitted::{About, Fitted};
pub(crate) use fitted::{by_name, rows};
pub use isotherm_document::tidy;
pub(crate) use plain::{channels, faults, follows, plain};
pub(crate) use provenance::files_of;
pub use provenance::{TOOL, command_line, origin, recordings_in};
pub use written::{Written, name_of, write_file};

/// The accelerometers of a document.
pub fn accelerometers(document: &Document) -> &[AccelSensor] {
    document.accel.as_ref().map_or(&[], |accel| &accel.sensor)
}
