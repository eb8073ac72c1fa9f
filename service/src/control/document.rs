//! A document: a text that was read and holds, with what was compiled from it.

use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_document::{file, unplaced};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::{self, Created, Problem};
use isotherm_protocol::history::GoodSet;
use isotherm_protocol::overlay::{Candidate, Overlay};
use isotherm_protocol::stream::Label;

use super::compressed::Compressed;
use super::store::Store;

/// A calibration document, an overlay on one, or a calibration that never was a document.
#[derive(Debug, Clone)]
pub struct Document {
    /// What was compiled from it.
    pub calibration: Arc<Calibration>,
    /// What the status says of it, but where it came from; without a digest for a calibration that never was a document.
    pub label: Label,
    /// The text that stands for it; `None` for a calibration that never was a document.
    pub text: Option<Compressed>,
    /// What it was made from, where it is a document with an overlay.
    pub(super) layers: Option<Box<Layers>>,
    /// Unit that it names.
    pub(super) unit: String,
    /// Version of its form.
    pub(super) schema: u32,
    /// When it was made.
    pub(super) created: Option<Created>,
    /// What is doubtful, though valid.
    pub(super) warnings: Vec<Problem>,
}

/// A document and the overlay that lies on it.
#[derive(Debug, Clone)]
pub(super) struct Layers {
    /// Text of the document below.
    pub(super) base: Compressed,
    /// The overlay.
    pub(super) overlay: Overlay,
    /// Its text, as it came.
    pub(super) text: Compressed,
    /// SHA-256 of the overlay's text.
    pub(super) digest: Digest,
}

impl Document {
    /// A calibration that never was a document.
    pub(crate) fn plain(calibration: Arc<Calibration>) -> Self {
        Self {
            calibration,
            label: Label::default(),
            text: None,
            layers: None,
            unit: String::new(),
            schema: 0,
            created: None,
            warnings: Vec::new(),
        }
    }

    /// What was compiled from a text, and what the status says of it.
    #[must_use]
    pub fn new(calibration: Arc<Calibration>, label: Label, text: Compressed) -> Self {
        Self { label, text: Some(text), ..Self::plain(calibration) }
    }

    /// A text that was found valid. An overlay lies on the text `base`, and came as `bytes`.
    pub(super) fn of(candidate: Candidate, base: Option<&str>, bytes: &[u8]) -> Self {
        let Candidate { document, calibration, text, digest, overlay, warnings, .. } = candidate;
        let layers = overlay.zip(base).map(|(overlay, base)| Layers {
            base: Compressed::new(base.as_bytes()),
            overlay: overlay.overlay,
            text: Compressed::new(bytes),
            digest: Digest::of(bytes),
        });
        let label = Label::of(&document, digest, "");
        let found = Self::new(shared(&calibration), label, Compressed::new(text.as_bytes()));
        let (unit, schema, created) = (document.unit, document.schema, document.created);
        Self { unit, schema, created, warnings, ..found }.over(layers)
    }

    /// The document of a good set, as the state folder has it.
    ///
    /// # Errors
    /// Why it cannot be put in force again.
    pub(super) fn stored(store: &Store, set: &GoodSet) -> Result<Self, Vec<Problem>> {
        let name = store.document_name(&set.digest, || format!("document {}", set.digest));
        let problem = |message: String| vec![unplaced(Some(&name), message)];
        let bytes = store.document(&set.digest).map_err(|error| problem(error.to_string()))?;
        let bytes = bytes.ok_or_else(|| problem("is no longer in the state folder".to_owned()))?;
        let text = file::text(&bytes, Some(&name))?;
        let parsed = document::Document::parse(text, Some(&name))?;
        let label = Label { overlay: set.overlay, ..Label::of(&parsed.document, set.digest, "") };
        let found = Self::new(shared(&parsed.calibration), label, Compressed::new(text.as_bytes()));
        let layers = set.overlay.and_then(|overlay| Layers::stored(store, overlay)).map(Box::new);
        Ok(Self { layers, ..found })
    }

    /// The same, made from these.
    pub(super) fn over(mut self, layers: Option<Layers>) -> Self {
        self.label.overlay = layers.as_ref().map(|layers| layers.digest);
        Self { layers: layers.map(Box::new), ..self }
    }

    /// SHA-256 of the text; `None` for a calibration that never was a document.
    pub(crate) fn digest(&self) -> Option<Digest> {
        self.label.digest
    }

    /// What stands in it; `None` for a calibration that never was a document.
    pub(super) fn content(&self) -> Option<document::Document> {
        let text = self.text.as_ref()?.text();
        document::Document::parse(&text, None).ok().map(|parsed| parsed.document)
    }

    /// The text that was signed: an overlaid document lost its own signature, what the overlay lies on has one.
    pub(super) fn signed(&self) -> Option<&Compressed> {
        self.layers.as_ref().map(|layers| &layers.base).or(self.text.as_ref())
    }

    /// Text of the document that an overlay may lie on, by the digest that the overlay names: this one, or the one below the
    /// overlay.
    pub(super) fn base(&self, named: &str) -> Option<&Compressed> {
        let below = self.layers.as_ref().filter(|layers| layers.overlay.overlay_of == named);
        below.map(|layers| &layers.base).or(self.text.as_ref())
    }
}

impl Layers {
    /// What a document with an overlay was made from; `None` where that is not kept any more.
    pub(super) fn stored(store: &Store, digest: Digest) -> Option<Self> {
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).ok();
        let overlay_text = store.overlay(&digest).ok().flatten().and_then(text)?;
        let overlay = Overlay::parse(&overlay_text, None).ok()?.overlay;
        let base = store.document(&overlay.overlay_of.parse().ok()?).ok().flatten().and_then(text)?;
        Some(Self {
            base: Compressed::new(base.as_bytes()),
            overlay,
            text: Compressed::new(overlay_text.as_bytes()),
            digest,
        })
    }
}

/// A calibration to be kept: a copy has no more room than it needs.
fn shared(calibration: &Calibration) -> Arc<Calibration> {
    Arc::new(calibration.clone())
}
