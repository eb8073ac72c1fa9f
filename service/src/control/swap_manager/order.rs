//! A swap as it is asked for.

use isotherm_protocol::control::SwapOptions;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::Problem;
use isotherm_protocol::history::Source;
use isotherm_protocol::key::UnitId;

use super::reading::Reading;

/// A document that somebody wants in force.
#[derive(Debug, Clone)]
pub(super) struct Order<'t> {
    /// Whom it is for; `None` for whom it names.
    pub(super) unit: Option<UnitId>,
    /// The document or overlay.
    pub(super) bytes: &'t [u8],
    /// What its problems are to call it.
    pub(super) name: &'t str,
    /// Where it came from.
    pub(super) source: Source,
    /// Overlay that a document was once made with; for a rollback to it.
    pub(super) overlay: Option<Digest>,
    /// What was found in it, where it was read before.
    pub(super) read: Option<&'t Result<Reading, Vec<Problem>>>,
    /// What else was asked for.
    pub(super) options: SwapOptions,
}

impl Order<'_> {
    /// Whether a signature can be asked for: what the service has made itself has none, an overlaid document lost its own.
    pub(super) fn needs_signature(&self) -> bool {
        !matches!(self.source, Source::PreLaunch) && self.overlay.is_none()
    }

    /// Whether its text was judged when it was first accepted, or made by the service itself.
    pub(super) fn is_own(&self) -> bool {
        matches!(self.source, Source::Rollback { .. } | Source::PreLaunch)
    }
}
