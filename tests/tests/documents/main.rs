//! The shipped calibration documents: each is valid, and each does what it says of itself.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod effects;
mod fibre_optic;
mod mems;
mod real_logs;
mod shipped;
mod sigma;
mod zeeman;

use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_protocol::document::{Document, Parsed};
use isotherm_tests::data::root;

/// A shipped document by its file name.
#[track_caller]
fn parsed(name: &str) -> Parsed {
    let text = std::fs::read_to_string(root().join("config/calibration").join(name)).unwrap();
    Document::parse(&text, Some(name)).unwrap_or_else(|problems| {
        panic!("{}", problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
    })
}

/// A document as a calibration.
#[track_caller]
fn compile(document: &Document) -> Arc<Calibration> {
    Arc::new(Calibration::new(&document.to_parts()).unwrap())
}
