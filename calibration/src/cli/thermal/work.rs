//! Units with their documents and runs.

use std::collections::BTreeMap;

use isotherm_correction::units::Span;
use isotherm_protocol::document::Origin;
use isotherm_protocol::key::UnitId;

use super::ThermalArgs;
use crate::cli::runs::Reading;
use crate::error::Error;
use crate::run::{Run, Watch};
use crate::thermal::{Fitted, Settings, fit};
use crate::written::Written;

/// One unit's work.
pub(super) struct Work {
    pub(super) unit: UnitId,
    base: Option<Written>,
    runs: Vec<Run>,
    judges: Vec<Run>,
    settings: Settings,
}

impl Work {
    pub(super) fn fit(&self, origin: Origin, watch: impl Watch) -> Result<Fitted, Error> {
        let base = self.base.as_ref().map(|base| &base.document);
        fit(base, (&self.runs, &self.judges), &self.settings, origin, watch)
    }
}

impl ThermalArgs {
    /// The units with their documents and runs.
    pub(super) fn work(&self, settings: &Settings) -> Result<Vec<Work>, Error> {
        let folder = self.document.as_ref().filter(|path| path.is_dir());
        let single = self
            .document
            .as_ref()
            .filter(|path| !path.is_dir())
            .map(|path| Written::read(path))
            .transpose()?;
        let fallback = single.as_ref().map(|written| written.loaded.unit.clone());
        let units = self.log.reading.runs(&self.log.log, fallback.as_ref())?;
        let judging = Reading {
            start: self.judge_start.map_or(Span::ZERO, Span::from_s),
            duration: self.judge_duration.map(Span::from_s),
            ..self.log.reading.clone()
        };
        let mut judges = if self.judge.is_empty() {
            BTreeMap::default()
        } else {
            judging.runs(&self.judge, fallback.as_ref())?
        };
        let several = units.len() > 1;
        let mut work = Vec::new();
        for (unit, runs) in units {
            let base = match (&single, folder) {
                (Some(single), _) if several && single.loaded.unit != unit => {
                    return Err(Error::Refused(vec![format!(
                        "the log is of several units ({unit} among them), the document is of {}: choose that one with --unit, or give \
                         --document the folder that has UNIT.toml of each",
                        single.loaded.unit
                    )]));
                }
                (Some(single), _) => Some(single.clone()),
                (None, Some(folder)) => Some(Written::read(&folder.join(format!("{unit}.toml")))?),
                (None, None) => None,
            };
            let judges = judges.remove(&unit).unwrap_or_default();
            if judges.is_empty() && !self.judge.is_empty() {
                return Err(Error::Refused(vec![format!("--judge: the logs have nothing of unit {unit}")]));
            }
            let stands = self.stands.stands(runs.len(), judges.len())?;
            let settings = Settings { stands, ..settings.clone() };
            work.push(Work { unit, base, runs, judges, settings });
        }
        if work.is_empty() {
            return Err(Error::Refused(vec![
                "the logs have no raw readings of any unit: give recordings of the bus (isotherm-replay record), or text logs with \
                 --mapping; a ROS 2 bag holds other messages"
                    .to_owned(),
            ]));
        }
        Ok(work)
    }
}
