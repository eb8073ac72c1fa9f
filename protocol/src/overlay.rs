//! The overlay: a small document that changes the bias constants of another one, such as the result of a pre-launch
//! calibration (models §7).
//!
//! An overlay names the document that it belongs to by the SHA-256 of its text and is never written over it: to take
//! an overlay back is to put its base in force again. `docs/calibration-document.md` lists its keys,
//! `config/overlay.schema.json` lets editors check them.
//!
//! ```
//! use isotherm_protocol::overlay::Overlay;
//!
//! let text = "schema = 1\noverlay_of = \"27fb\"\nunit = \"ZLG-0001\"\n";
//! let problems = Overlay::parse(text, Some("field.toml")).unwrap_err();
//! let base = problems.iter().find(|problem| problem.key == "overlay_of").unwrap();
//! assert!(base.to_string().starts_with("field.toml:2:14: overlay_of: is \"27fb\" (a string), must be 64"));
//! ```
//!
//! [`Candidate::parse`] takes either kind of document: it is the one way in for everything that may become active.

mod apply;
mod candidate;
mod check;
#[cfg(test)]
mod tests;
mod types;

use std::collections::BTreeMap;
use std::sync::LazyLock;

use isotherm_document::{Form, Reader, parse_toml, published};

pub use candidate::Candidate;
pub use types::{GyroOverlay, Overlay, PreLaunchRecord};

use crate::digest::Digest;
use crate::document::{MAX_DOCUMENT_BYTES, Problem};

/// The version of the overlay's form; the policy is that of [`crate::document::MIN_SCHEMA`].
pub const OVERLAY_SCHEMA: u32 = 1;
static FORM: LazyLock<Form> =
    LazyLock::new(|| Form::of::<Overlay>().versions("schema", [OVERLAY_SCHEMA, OVERLAY_SCHEMA]));
/// The key that makes a document an overlay.
const OVERLAY_OF: &str = "overlay_of";

/// An overlay that holds by itself; whether it fits a base is said by [`ParsedOverlay::apply`].
#[derive(Debug, Clone, PartialEq)]
pub struct ParsedOverlay {
    /// What stands in it.
    pub overlay: Overlay,
    /// SHA-256 of the text's bytes.
    pub digest: Digest,
    /// Where each key stands, for problems that show only against the base.
    places: BTreeMap<String, (usize, usize)>,
    file: Option<String>,
}

/// JSON schema (draft 07) of the overlay, as published in `config/overlay.schema.json`.
#[must_use]
pub fn overlay_schema() -> serde_json::Value {
    published::<Overlay>()
}

/// Whether a text is meant to be an overlay: it has the key `overlay_of` at its top level.
///
/// A text that is no TOML is judged by what of it can be read.
#[must_use]
pub fn is_overlay(text: &str) -> bool {
    text.len() <= MAX_DOCUMENT_BYTES && parse_toml(text).0.get_ref().contains_key(OVERLAY_OF)
}

/// The document that a text lies on, where it is an overlay.
#[must_use]
pub fn base_of(bytes: &[u8]) -> Option<Digest> {
    let text = std::str::from_utf8(bytes).ok().filter(|text| is_overlay(text))?;
    Overlay::parse(text, None).ok()?.overlay.overlay_of.parse().ok()
}

impl Overlay {
    /// Reads an overlay; `file` is the name that its problems are to carry.
    ///
    /// # Errors
    /// Every [`Problem`], in the order of the text.
    pub fn parse(text: &str, file: Option<&str>) -> Result<ParsedOverlay, Vec<Problem>> {
        let mut reader = Reader::new(text, file);
        let overlay: Option<Self> = reader.read(&FORM);
        if let Some(overlay) = &overlay {
            check::check(&mut reader, overlay);
        }
        let places = reader.positions();
        let overlay = reader.finish(overlay)?;
        let digest = Digest::of(text.as_bytes());
        Ok(ParsedOverlay { overlay, digest, places, file: file.map(Into::into) })
    }

    /// Writes the overlay as text that [`Overlay::parse`] reads back as an equal overlay.
    ///
    /// # Errors
    /// What the TOML writer refuses; of what [`Overlay::parse`] has let through, nothing.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(self)
    }
}
