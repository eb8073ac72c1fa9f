//! A document that was read and holds, as far as a swap needs it.

use std::borrow::Cow;
use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::{Created, Document, Problem};
use isotherm_protocol::overlay::{Candidate, Overlay};
use isotherm_protocol::stream::Label;

use crate::control::compressed::CompressedText;

/// What may become active: a document, or an overlay on the one in force.
#[derive(Debug, Clone)]
pub(super) struct Reading {
    /// Unit that it names.
    pub(super) unit: String,
    /// Version of its form.
    pub(super) schema: u32,
    /// When it was made.
    pub(super) created: Option<Created>,
    /// What the status says of it; where it came from is not known here.
    pub(super) label: Label,
    /// What was compiled from it.
    pub(super) calibration: Arc<Calibration>,
    /// The text that stands for it.
    pub(super) text: CompressedText,
    /// SHA-256 of that text.
    pub(super) digest: Digest,
    /// The overlay, where it is one.
    pub(super) overlay: Option<Overlay>,
    /// What is doubtful, though valid.
    pub(super) warnings: Vec<Problem>,
    /// What stands in it; read again from the text where it is not at hand.
    document: Option<Box<Document>>,
}

impl Reading {
    /// What stands in it.
    pub(super) fn document(&self) -> Option<Cow<'_, Document>> {
        match &self.document {
            Some(document) => Some(Cow::Borrowed(document)),
            None => document_in(&self.text).map(Cow::Owned),
        }
    }

    /// Without what can be read again.
    pub(super) fn small(self) -> Self {
        Self { document: None, ..self }
    }
}

impl From<Candidate> for Reading {
    fn from(candidate: Candidate) -> Self {
        let Candidate { document, calibration, text, digest, overlay, warnings, .. } = candidate;
        let digest = Digest(digest);
        Self {
            unit: document.unit.clone(),
            schema: document.schema,
            created: document.created,
            label: Label::of(&document, digest, ""),
            calibration: shared(&calibration),
            text: CompressedText::new(&text),
            digest,
            overlay: overlay.map(|parsed| parsed.overlay),
            warnings,
            document: Some(Box::new(document)),
        }
    }
}

/// A calibration to be kept: a copy has no more room than it needs.
pub(super) fn shared(calibration: &Calibration) -> Arc<Calibration> {
    Arc::new(calibration.clone())
}

/// What stands in a text that was found valid before.
pub(super) fn document_in(text: &CompressedText) -> Option<Document> {
    Document::parse(&text.read(), None).ok().map(|parsed| parsed.document)
}
