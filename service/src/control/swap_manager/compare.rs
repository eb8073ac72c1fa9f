//! What a swap changes: in the document, and in the correction at the unit's present temperatures.

use isotherm_protocol::control::Difference;
use isotherm_protocol::document::{self, Side};

use super::reading::{Reading, document_in};
use super::record::Active;
use crate::receive::unit::Present;

/// The difference between what was accepted last and a candidate, and the sections that the candidate does not have any more;
/// `None` where the former never was a document.
///
/// Temperatures and mode are those of the unit; of one that has not appeared the correction is not compared.
pub(super) fn compare(
    active: &Active,
    candidate: &Reading,
    present: Option<&Present>,
) -> Option<(Difference, Vec<String>)> {
    let written = active.written.as_ref()?;
    let (old, new) = (document_in(&written.text)?, candidate.document()?);
    let document = document::difference(&old, &new);
    let before = Side { document: &old, calibration: &active.calibration };
    let after = Side { document: &new, calibration: &candidate.calibration };
    let (correction, temperatures) = present.map_or_else(Default::default, |present| {
        let thermal = |name: &_| present.thermal(name);
        (document::correction_change(before, after, thermal, present.mode), present.words())
    });
    Some((Difference { document, correction, temperatures }, document::lost_sections(&old, &new)))
}
