//! Calibration documents: on their way to a file, compared, merged, shown.
//!
//! | module | holds |
//! |---|---|
//! | [`written`], [`provenance`] | a document on its way to a file; where its numbers come from |
//! | [`diff`] | what has changed between documents |
//! | [`merge`] | parts of a calibration in one document |
//! | [`show`] | a document in words and curves |

pub mod diff;
pub mod merge;
pub mod plain;
pub mod provenance;
pub mod show;
pub mod written;

use isotherm_protocol::document::{AccelSensor, Document};

/// The accelerometers of a document.
pub fn accelerometers(document: &Document) -> &[AccelSensor] {
    document.accel.as_ref().map_or(&[], |accel| &accel.sensor)
}
