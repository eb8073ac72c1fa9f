//! What may become active: a calibration document, or an overlay on the one in force.

use isotherm_correction::calibration::Calibration;

use super::{Overlay, ParsedOverlay, is_overlay};
use crate::digest::Digest;
use crate::document::{Document, Parsed, Problem};
use isotherm_document::unplaced;

/// A calibration that holds, with the text that it is known by.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// What stands in the document; for an overlay, in its base with the changes made.
    pub document: Document,
    /// What was made of it.
    pub calibration: Calibration,
    /// The text that stands for it: as it came, or written anew for an overlay on its base. The same inputs give the same
    /// bytes.
    pub text: String,
    /// SHA-256 of that text: the digest of the revision.
    pub digest: Digest,
    /// SHA-256 of the document that the constants rest on: the base's for an overlay, else `digest`.
    pub base_digest: Digest,
    /// The overlay, where it is one.
    pub overlay: Option<ParsedOverlay>,
    /// What is doubtful, though valid.
    pub warnings: Vec<Problem>,
}

impl Candidate {
    /// Reads a document of either kind; `file` is the name that problems are to carry, `active_base` the text of the
    /// document that an overlay may be for.
    ///
    /// # Errors
    /// Every [`Problem`], in the order of the text. An overlay is refused where there is no base, where the base is no
    /// valid document, or where it does not fit the base.
    pub fn parse(text: &str, file: Option<&str>, active_base: Option<&str>) -> Result<Self, Vec<Problem>> {
        if !is_overlay(text) {
            let parsed = Document::parse(text, file)?;
            let base_digest = parsed.digest;
            return Ok(Self::new(parsed, text.to_owned(), base_digest, None));
        }
        let overlay = Overlay::parse(text, file)?;
        let Some(base_text) = active_base else {
            let message = "is an overlay, but the unit has no document in force: first put the document of the \
                           overlay in force";
            return Err(vec![overlay.problem(super::OVERLAY_OF, message.to_owned())]);
        };
        let base = Document::parse(base_text, Some("document in force"))?;
        let document = overlay.apply(&base)?;
        let failed =
            |error: String| vec![unplaced(file, format!("cannot be written out on its base: {error}"))];
        let effective = document.to_toml().map_err(|error| failed(error.to_string()))?;
        // Its lines are nobody's: what is said of it is said of the overlay as a whole.
        let on_overlay = |problems: Vec<Problem>| -> Vec<Problem> {
            let place = |problem: Problem| Problem {
                key: problem.key,
                ..unplaced(file, format!("on its base: {}", problem.message))
            };
            problems.into_iter().map(place).collect()
        };
        let mut parsed = Document::parse(&effective, None).map_err(on_overlay)?;
        let new = |warning: &Problem| {
            base.warnings.iter().all(|old| (&old.key, &old.message) != (&warning.key, &warning.message))
        };
        parsed.warnings.retain(new);
        parsed.warnings = on_overlay(parsed.warnings);
        Ok(Self::new(parsed, effective, base.digest, Some(overlay)))
    }

    fn new(parsed: Parsed, text: String, base_digest: Digest, overlay: Option<ParsedOverlay>) -> Self {
        let Parsed { document, calibration, digest, warnings } = parsed;
        Self { document, calibration, text, digest, base_digest, overlay, warnings }
    }
}
