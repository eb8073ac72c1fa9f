//! What a unit was given.

use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::overlay::Overlay;
use isotherm_protocol::status::Swaps;

use super::command::PreLaunchRun;
use crate::control::compressed::CompressedText;
use crate::receive::unit::SwapAccount;

/// What the swap manager keeps of one unit.
#[derive(Debug, Clone, Default)]
pub(super) struct Record {
    /// Highest revision counter that it was ever given.
    pub(super) counter: u64,
    /// What was accepted last, in force or to follow.
    pub(super) active: Option<Active>,
    /// What is in force while that one waits for its tick.
    pub(super) before: Option<Box<Active>>,
    /// Swaps accepted since the service started: what a unit is given first, from its file, is none.
    pub(super) accepted: u64,
    /// Documents refused since the service started.
    pub(super) refused: u64,
    /// The last refusal in words.
    pub(super) last_refusal: Option<String>,
    /// The pre-launch calibration that was asked for last.
    pub(super) pre_launch: Option<PreLaunchRun>,
    /// The overlay that the last one was stored as.
    pub(super) overlay: Option<Digest>,
    /// Why what was put in force again at the start would be refused today, for want of a signature.
    pub(super) untrusted: Option<String>,
}

/// An accepted calibration with its text.
#[derive(Debug, Clone)]
pub(super) struct Active {
    /// Revision counter.
    pub(super) revision: u64,
    /// When its document was made (s since 1970-01-01 UTC), where that says so.
    pub(super) created_unix_s: Option<i64>,
    /// The compiled calibration.
    pub(super) calibration: Arc<Calibration>,
    /// Document and text; `None` for a calibration that never was a document.
    pub(super) written: Option<Written>,
}

/// A document and its text.
#[derive(Debug, Clone)]
pub(super) struct Written {
    /// SHA-256 of the text.
    pub(super) digest: Digest,
    /// The document's text.
    pub(super) text: CompressedText,
    /// What it was made from, where it is a document with an overlay.
    pub(super) layers: Option<Box<Layers>>,
}

/// A document and the overlay that lies on it.
#[derive(Debug, Clone)]
pub(super) struct Layers {
    /// Text of the document below.
    pub(super) base: CompressedText,
    /// The overlay.
    pub(super) overlay: Overlay,
    /// Its text, as it came.
    pub(super) text: CompressedText,
    /// SHA-256 of the overlay's text.
    pub(super) digest: Digest,
}

impl Record {
    /// What is in force, where `waiting` is the revision that waits for its tick.
    pub(super) fn in_force(&self, waiting: Option<u64>) -> Option<&Active> {
        let active = self.active.as_ref()?;
        let waits = waiting == Some(active.revision);
        self.before.as_deref().filter(|_| waits).or(Some(active))
    }

    /// Document and text of what was accepted last.
    pub(super) fn written(&self) -> Option<&Written> {
        self.active.as_ref()?.written.as_ref()
    }

    /// What the unit's status says of its swaps.
    pub(super) fn account(&self) -> SwapAccount {
        let (accepted, refused) = (self.accepted, self.refused);
        let swaps = Swaps { accepted, refused, last_refusal: self.last_refusal.clone() };
        SwapAccount { swaps, overlay: self.overlay, problem: self.untrusted.clone() }
    }
}

impl Written {
    /// Text of the document that an overlay may lie on, by the digest that the overlay names: the one in force, or the one
    /// below the overlay in force.
    pub(super) fn base(&self, named: &str) -> &CompressedText {
        let below = self.layers.as_ref().filter(|layers| layers.overlay.overlay_of == named);
        below.map_or(&self.text, |layers| &layers.base)
    }
}
