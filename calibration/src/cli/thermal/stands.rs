//! The arguments that say how the unit stands or turns in each log.

use clap::Args;

use crate::cli::place::{each_or_one, of_log};
use crate::error::Error;
use crate::fits::rates::steps::axis;
use crate::fits::thermal::{Site, Stand, Turning};
use crate::limits::within;

/// Rates of a table that can be used (°/s).
const RATES_DEG_PER_S: [f64; 2] = [1.0, 10_000.0];

/// Place, attitude and turning: each option once for all logs, or once for each.
#[derive(Debug, Clone, Args)]
pub(in crate::cli) struct StandArgs {
    /// Geodetic latitude (°, north positive): the Earth's rate is removed from the gyros (default: the mean of each run is)
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
}

impl StandArgs {
    /// One for each of so many runs, and then for each of so many that judge; none where nothing is stated.
    pub(in crate::cli) fn stands(&self, runs: usize, judges: usize) -> Result<Vec<Stand>, Error> {
        let counts = [
            ("--heading", self.heading.len()),
            ("--roll", self.roll.len()),
            ("--pitch", self.pitch.len()),
            ("--axis", self.axis.len()),
            ("--rate", self.rate.len()),
        ];
        each_or_one(counts, [runs, judges])?;
        if self.latitude.is_none() && self.rate.is_empty() {
            return Ok(Vec::new());
        }
        (0..runs + judges)
            .map(|run| Ok(Stand { site: self.site(run)?, turning: self.turning(run)? }))
            .collect()
    }

    fn site(&self, run: usize) -> Result<Site, Error> {
        let (Some(latitude), Some(heading)) = (self.latitude, of_log(&self.heading, run)) else {
            return Ok(Site::Unknown);
        };
        let tilt = of_log(&self.pitch, run).zip(of_log(&self.roll, run)).map(|(pitch, roll)| [pitch, roll]);
        Ok(Site::at(latitude, heading, tilt, self.gravity)?)
    }

    fn turning(&self, run: usize) -> Result<Option<Turning>, Error> {
        let Some((name, rate_deg_per_s)) = of_log(&self.axis, run).zip(of_log(&self.rate, run)) else {
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
