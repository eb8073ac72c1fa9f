//! The arguments that say how the unit stands or turns in each log.

use clap::Args;

use crate::error::Error;
use crate::fits::rates::steps::axis;
use crate::fits::thermal::{Site, Stand, Turning};
use crate::limits::within;
use crate::report::counted;

/// Rates of a table that can be used (°/s).
const RATES_DEG_PER_S: [f64; 2] = [1.0, 10_000.0];

/// Place, attitude and turning: each option once for all logs, or once for each.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct StandArgs {
    /// Geodetic latitude (°, north positive): the Earth's rate is removed from the gyros
    #[arg(long, value_name = "DEG", requires = "heading", allow_negative_numbers = true)]
    latitude: Option<f64>,
    /// Heading of the case's x axis from north towards east (°); once for all logs, or for each log in order, then for those of --judge
    #[arg(long, value_name = "DEG", requires = "latitude", allow_negative_numbers = true)]
    heading: Vec<f64>,
    /// Roll about the case's x axis (°), likewise (default: levelled by the accelerometers)
    #[arg(long, value_name = "DEG", requires_all = ["pitch", "latitude"], allow_negative_numbers = true)]
    roll: Vec<f64>,
    /// Pitch of the case's x axis above the horizon (°), likewise (default: levelled by the accelerometers)
    #[arg(long, value_name = "DEG", requires_all = ["roll", "latitude"], allow_negative_numbers = true)]
    pitch: Vec<f64>,
    /// Gravity at the place (m/s²) (default: normal gravity of the latitude)
    #[arg(long, value_name = "M_PER_S2", requires = "roll", value_parser = within(9.7, 9.9))]
    gravity: Option<f64>,
    /// Axis of the rate table in case axes (x, -y, … or 0,0.6,0.8); once for all logs, or once for each
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true, requires = "rate")]
    axis: Vec<String>,
    /// Rate of the table throughout a log (°/s), 0 at rest; likewise
    #[arg(long, value_name = "DEG_PER_S", allow_negative_numbers = true, requires = "axis")]
    rate: Vec<f64>,
    /// Remove the mean of each run (default without --latitude)
    #[arg(long, conflicts_with = "latitude")]
    remove_mean: bool,
}

impl StandArgs {
    /// One for each of so many runs, and then for each of so many that judge; none where nothing is stated.
    pub(in crate::cli) fn stands(&self, runs: usize, judges: usize) -> Result<Vec<Stand>, Error> {
        let all = runs + judges;
        let counts = [
            ("--heading", self.heading.len()),
            ("--roll", self.roll.len()),
            ("--pitch", self.pitch.len()),
            ("--axis", self.axis.len()),
            ("--rate", self.rate.len()),
        ];
        if let Some((name, count)) = counts.into_iter().find(|(_, count)| *count > 1 && *count != all) {
            let judging = if judges > 0 { format!(" and {judges} of --judge") } else { String::new() };
            return Err(Error::Usage(format!(
                "{count} times {name} for {}{judging}: state it once for all, or once for each log in their order, \
                 then for those of --judge",
                counted(runs, "log", "logs")
            )));
        }
        if self.latitude.is_none() && self.rate.is_empty() {
            return Ok(Vec::new());
        }
        (0..all).map(|run| Ok(Stand { site: self.site(run)?, turning: self.turning(run)? })).collect()
    }

    fn site(&self, run: usize) -> Result<Site, Error> {
        let (Some(latitude), Some(heading)) = (self.latitude, of_run(&self.heading, run)) else {
            return Ok(Site::Unknown);
        };
        let tilt = of_run(&self.pitch, run).zip(of_run(&self.roll, run)).map(|(pitch, roll)| [pitch, roll]);
        Ok(Site::at(latitude, heading, tilt, self.gravity)?)
    }

    fn turning(&self, run: usize) -> Result<Option<Turning>, Error> {
        let Some((name, rate_deg_per_s)) = of_run(&self.axis, run).zip(of_run(&self.rate, run)) else {
            return Ok(None);
        };
        let axis = axis(&name).map_err(Error::Usage)?;
        let [low, high] = RATES_DEG_PER_S;
        if rate_deg_per_s == 0.0 {
            return Ok(None);
        }
        if !(low..=high).contains(&rate_deg_per_s.abs()) {
            return Err(Error::Usage(format!(
                "--rate is {rate_deg_per_s} °/s, must be 0 for a log at rest, or from {low} to {high} °/s in size: \
                 slower turns do not determine a scale factor"
            )));
        }
        Ok(Some(Turning { axis, rate_deg_per_s }))
    }
}

/// The value of a run where each has its own, or all have one.
fn of_run<T: Clone>(values: &[T], run: usize) -> Option<T> {
    if values.len() == 1 { values.first() } else { values.get(run) }.cloned()
}
