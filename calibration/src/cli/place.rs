//! The arguments that say where a unit at rest is and how it stands.

use clap::Args;
use isotherm_correction::earth::Place;

use crate::error::Error;

/// Place and attitude, for the Earth rate.
#[derive(Debug, Clone, Args)]
pub(crate) struct PlaceArgs {
    /// Geodetic latitude (°, north positive)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    latitude: Option<f64>,
    /// Heading of the case's x axis from north (°)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, requires = "latitude")]
    heading: Option<f64>,
    /// Pitch of the case's x axis above the horizon (°); without it the unit is levelled by its accelerometers
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, requires_all = ["latitude", "roll"])]
    pitch: Option<f64>,
    /// Roll about the case's x axis (°)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, requires_all = ["latitude", "pitch"])]
    roll: Option<f64>,
    /// Do not remove the Earth rate: the attitude is not known
    #[arg(long, conflicts_with = "latitude")]
    remove_mean: bool,
}

impl PlaceArgs {
    /// The place; `None` where it is said not to be known.
    pub(crate) fn place(&self) -> Result<Option<Place>, Error> {
        let (Some(latitude), Some(heading)) = (self.latitude, self.heading) else {
            if self.remove_mean {
                return Ok(None);
            }
            let missing = if self.latitude.is_none() { "--latitude and --heading" } else { "--heading" };
            return Err(Error::Usage(format!(
                "the Earth rate is to be removed: give {missing} (and --pitch and --roll where there are no accelerometers to level \
                 with), or --remove-mean where the attitude is not known"
            )));
        };
        let tilt = self.pitch.zip(self.roll).map(|(pitch, roll)| [pitch, roll]);
        let place = Place::new(latitude, heading, tilt).map_err(|errors| {
            Error::Usage(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))
        })?;
        Ok(Some(place))
    }
}
