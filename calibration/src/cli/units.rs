//! Runs of the one unit that a fit is about.

use std::path::PathBuf;

use isotherm_protocol::key::UnitId;

use super::runs::Reading;
use crate::error::Error;
use crate::run::Run;

/// The runs of the unit that a document is of, or that --unit names; what the logs have of other units is left alone.
pub(super) fn of_document(reading: &Reading, logs: &[PathBuf], unit: &UnitId) -> Result<Vec<Run>, Error> {
    let mut runs = reading.runs(logs, Some(unit))?;
    let wanted = reading.serial()?.unwrap_or_else(|| unit.clone());
    runs.remove(&wanted).ok_or_else(|| {
        let there: Vec<String> = runs.keys().map(ToString::to_string).collect();
        Error::Refused(vec![format!(
            "the logs are of unit {}, the document is of {unit}: give the document of that unit, or --unit where the serial has changed",
            if there.is_empty() { "none".to_owned() } else { there.join(", ") }
        )])
    })
}

/// The runs of the only unit of some logs.
pub(super) fn of_only(reading: &Reading, logs: &[PathBuf]) -> Result<Vec<Run>, Error> {
    let mut runs = reading.runs(logs, None)?;
    match (runs.pop_first(), runs.pop_first()) {
        (Some((_, own)), None) => Ok(own),
        (Some((first, _)), Some((second, _))) => Err(Error::Refused(vec![format!(
            "the logs are of several units ({first}, {second}, …): choose one with --unit"
        )])),
        (None, _) => Err(Error::Refused(vec!["the logs have no raw readings".to_owned()])),
    }
}
