//! The arguments that say where a unit is, how it stands at rest, and how strong gravity is there.

use clap::Args;
use isotherm_correction::earth::Place;

use crate::error::Error;
use crate::fits::positions::gravity;
use crate::limits::within;

/// Place and attitude, for the Earth rate.
#[derive(Debug, Clone, Args)]
pub(crate) struct PlaceArgs {
    /// Geodetic latitude (°, north positive)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    latitude: Option<f64>,
    /// Heading of the case's x axis from north (°)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, requires = "latitude")]
    heading: Option<f64>,
    /// Pitch of the case's x axis above the horizon (°) (default: levelled by the accelerometers)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, requires_all = ["latitude", "roll"])]
    pitch: Option<f64>,
    /// Roll about the case's x axis (°) (default: levelled by the accelerometers)
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, requires_all = ["latitude", "pitch"])]
    roll: Option<f64>,
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
    /// Latitude of the place (°), for normal gravity
    #[arg(long, value_name = "DEG", allow_hyphen_values = true, value_parser = within(-90.0, 90.0))]
    latitude: Option<f64>,
    /// Height of the place above the sea (m), for normal gravity
    #[arg(long, value_name = "M", default_value_t = 0.0, allow_hyphen_values = true, value_parser = within(-1000.0, 20_000.0))]
    height: f64,
}

impl GravityArgs {
    /// Gravity (m/s²), and a warning where nothing is said of it.
    pub(crate) fn stated(&self) -> (f64, Option<String>) {
        gravity::stated(self.gravity, self.latitude, self.height)
    }
}

impl PlaceArgs {
    /// The place, where it must be known; `None` where it is said not to be.
    pub(crate) fn place(&self) -> Result<Option<Place>, Error> {
        if self.latitude.is_none() || self.heading.is_none() {
            if self.remove_mean {
                return Ok(None);
            }
            let missing = if self.latitude.is_none() { "--latitude and --heading" } else { "--heading" };
            return Err(Error::Usage(format!(
                "to remove the Earth's rate, give {missing} (and --pitch and --roll without accelerometers); if the \
                 attitude is unknown, --remove-mean"
            )));
        }
        self.known()
    }

    /// The place, where it is said; half a place is none.
    pub(crate) fn known(&self) -> Result<Option<Place>, Error> {
        let (Some(latitude), Some(heading)) = (self.latitude, self.heading) else {
            return match self.latitude {
                Some(_) => {
                    Err(Error::Usage("--latitude goes with --heading: give both, or neither".to_owned()))
                }
                None => Ok(None),
            };
        };
        let tilt = self.pitch.zip(self.roll).map(|(pitch, roll)| [pitch, roll]);
        Ok(Some(Place::new(latitude, heading, tilt)?))
    }
}
