//! The arguments that say where a unit is, how it stands at rest, and how strong gravity is there.

use clap::Args;
use isotherm_correction::earth::Place;

use crate::error::Error;
use crate::fits::positions::gravity;
use crate::limits::within;
use crate::report::counted;

/// Place and attitude, for the Earth rate.
#[derive(Debug, Clone, Args)]
pub(crate) struct PlaceArgs {
    /// Geodetic latitude (°, north positive)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    latitude: Option<f64>,
    /// Heading of the case's x axis from north (°); rates: once for all logs, or for each log in order, then for those of --judge
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, requires = "latitude")]
    heading: Vec<f64>,
    /// Pitch of the case's x axis above the horizon (°), likewise (default: levelled by the accelerometers)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, requires_all = ["latitude", "roll"])]
    pitch: Vec<f64>,
    /// Roll about the case's x axis (°), likewise (default: levelled by the accelerometers)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, requires_all = ["latitude", "pitch"])]
    roll: Vec<f64>,
    /// Remove the mean instead of the Earth's rate: the attitude is unknown
    #[arg(long, conflicts_with = "latitude")]
    remove_mean: bool,
}

/// Gravity at the place of a calibration.
#[derive(Debug, Clone, Args)]
pub(crate) struct GravityArgs {
    /// Gravity at the place (m/s²)
    #[arg(long, value_name = "M_PER_S2", value_parser = within(9.7, 9.9))]
    gravity: Option<f64>,
    /// Latitude of the place (°), for normal gravity; tumble: for the Earth's rate too
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, value_parser = within(-90.0, 90.0))]
    latitude: Option<f64>,
    /// Height of the place above the sea (m), for normal gravity
    #[arg(long, value_name = "M", default_value_t = 0.0, allow_hyphen_values = true, value_parser = within(-1000.0, 20_000.0))]
    height: f64,
}

impl GravityArgs {
    /// Latitude of the place (°).
    pub(crate) const fn latitude_deg(&self) -> Option<f64> {
        self.latitude
    }

    /// Gravity (m/s²), and a warning where nothing is said of it.
    pub(crate) fn stated(&self) -> (f64, Option<String>) {
        gravity::stated(self.gravity, self.latitude, self.height)
    }
}

impl PlaceArgs {
    /// The place, where it must be known; `None` where it is said not to be.
    pub(crate) fn place(&self) -> Result<Option<Place>, Error> {
        Ok(self.places([1, 0])?.pop())
    }

    /// The places of so many logs, and of so many that judge, which must be known: one for all or one for each; none where they are said not to be.
    pub(crate) fn places(&self, counts: [usize; 2]) -> Result<Vec<Place>, Error> {
        if self.latitude.is_none() || self.heading.is_empty() {
            if self.remove_mean {
                return Ok(Vec::new());
            }
            let missing = if self.latitude.is_none() { "--latitude and --heading" } else { "--heading" };
            return Err(Error::Usage(format!(
                "to remove the Earth's rate, give {missing} (and --pitch and --roll without accelerometers); if the \
                 attitude is unknown, --remove-mean"
            )));
        }
        self.known(counts)
    }

    /// The places of so many logs, and of so many that judge, where they are said: one for all, one for each, or none; half a place is none.
    pub(crate) fn known(&self, counts: [usize; 2]) -> Result<Vec<Place>, Error> {
        let Some(latitude) = self.latitude else { return Ok(Vec::new()) };
        let angles = [("--heading", &self.heading), ("--pitch", &self.pitch), ("--roll", &self.roll)];
        each_or_one(angles.map(|(name, given)| (name, given.len())), counts)?;
        if self.heading.is_empty() {
            return Err(Error::Usage("--latitude goes with --heading: give both, or neither".to_owned()));
        }
        let places = angles.iter().map(|(_, given)| given.len()).max().unwrap_or(1);
        let place = |log: usize| {
            let tilt =
                of_log(&self.pitch, log).zip(of_log(&self.roll, log)).map(|(pitch, roll)| [pitch, roll]);
            Ok(Place::new(latitude, of_log(&self.heading, log).unwrap_or_default(), tilt)?)
        };
        (0..places).map(place).collect()
    }
}

/// Refuses options that are stated more than once, but not once for each log and then for each that judges.
pub(super) fn each_or_one<const N: usize>(
    counts: [(&str, usize); N],
    [logs, judges]: [usize; 2],
) -> Result<(), Error> {
    let Some((name, count)) = counts.into_iter().find(|(_, count)| *count > 1 && *count != logs + judges)
    else {
        return Ok(());
    };
    let judging = if judges > 0 { format!(" and {judges} of --judge") } else { String::new() };
    Err(Error::Usage(format!(
        "{count} times {name} for {}{judging}: state it once for all, or once for each log in their order, then for those \
         of --judge",
        counted(logs, "log", "logs")
    )))
}

/// The value of a log where each has its own, or all have one.
pub(super) fn of_log<T: Clone>(values: &[T], log: usize) -> Option<T> {
    if values.len() == 1 { values.first() } else { values.get(log) }.cloned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_one_for_all_logs_or_one_for_each() {
        let args = |heading: &[f64]| PlaceArgs {
            latitude: Some(55.75),
            heading: heading.to_vec(),
            pitch: vec![0.0],
            roll: vec![0.0],
            remove_mean: false,
        };
        let places =
            |heading: &[f64], counts| args(heading).places(counts).map_err(|error| error.to_string());
        assert_eq!(places(&[30.0], [2, 1]).unwrap().len(), 1);
        let each = places(&[30.0, 120.0, 210.0], [2, 1]).unwrap();
        let rate = |place: &Place| place.earth_rate_in_case(None).unwrap().map(f64::to_bits);
        assert!(each.len() == 3 && rate(&each[0]) != rate(&each[1]) && rate(&each[1]) != rate(&each[2]));
        insta::assert_snapshot!(places(&[30.0, 120.0], [2, 1]).unwrap_err());
        assert!(args(&[30.0, 120.0]).place().is_err());
    }
}
