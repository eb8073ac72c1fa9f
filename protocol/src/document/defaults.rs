//! Defaults that depend on other keys.

use isotherm_correction::reversal::MAX_FIT_READINGS;
use isotherm_document::Reader;

use super::types::{Document, FitWindow};

/// Puts in what a key that is left out means beside the keys that are there.
pub(super) fn complete(r: &Reader<'_>, document: &mut Document) {
    let Some(reversal) = &mut document.mode_reversal else { return };
    if reversal.transition_s.is_some() && !r.has("mode_reversal.transition_ticks") {
        reversal.transition_ticks = None;
    }
    if reversal.fit_window == FitWindow::Adaptive {
        let readings = [
            ("mode_reversal.fit_readings_before", &mut reversal.fit_readings_before),
            ("mode_reversal.fit_readings_after", &mut reversal.fit_readings_after),
        ];
        for (key, readings) in readings {
            if !r.has(key) {
                *readings = MAX_FIT_READINGS;
            }
        }
    }
}
