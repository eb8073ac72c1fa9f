//! What may be asked of a thermal fit.

use isotherm_correction::earth::{EARTH_RATE, Place, PlaceError};
use isotherm_protocol::document::Created;

/// How the coefficients are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// 000: the static bias from the plateaus, then the rate's share, then the acceleration's, one after the other.
    Sequential,
    /// All terms at once, lags on a fixed ladder of time constants among them.
    Joint,
    /// Lags whose time constants are searched, with gains that may follow temperature.
    Lag,
}

impl Method {
    /// Its name, in documents and reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sequential => "sequential",
            Self::Joint => "joint",
            Self::Lag => "lag",
        }
    }
}

/// Who chooses the terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Terms {
    /// Cross-validation.
    Auto,
    /// The largest model of the method; it is not asked whether it survives cross-validation.
    All,
}

/// What is known of the unit's place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Site {
    /// Nothing: the mean of each run is removed, and the level of every output stays what it was.
    Unknown,
    /// Latitude and heading: the Earth's rate is removed from the gyros. Where pitch and roll are stated too, gravity is
    /// removed from the accelerometers.
    Known {
        /// Where the unit is and how it stands.
        place: Place,
        /// Specific force at rest in case axes (m/s²), where pitch and roll were stated.
        force_m_per_s2: Option<[f64; 3]>,
    },
}

impl Site {
    /// A place by latitude and heading (°), and pitch and roll (°) where they are known.
    ///
    /// # Errors
    /// Every angle that is no number or outside its range.
    pub fn at(
        latitude_deg: f64,
        heading_deg: f64,
        tilt_deg: Option<[f64; 2]>,
    ) -> Result<Self, Vec<PlaceError>> {
        let place = Place::new(latitude_deg, heading_deg, tilt_deg)?;
        // At the pole the Earth turns about the vertical: where that axis is in the case, there gravity is.
        let up = match tilt_deg {
            Some(tilt) => Place::new(90.0, heading_deg, Some(tilt))?.earth_rate_in_case(None),
            None => None,
        };
        let gravity = normal_gravity(latitude_deg) / EARTH_RATE.as_rad_per_s();
        Ok(Self::Known { place, force_m_per_s2: up.map(|up| up.map(|part| part * gravity)) })
    }
}

/// Normal gravity on the ellipsoid (m/s²): Somigliana's formula, WGS 84.
fn normal_gravity(latitude_deg: f64) -> f64 {
    let sine = libm::sin(latitude_deg.to_radians());
    let square = sine * sine;
    9.780_325_335_9 * (1.0 + 1.931_852_652_41e-3 * square) / libm::sqrt(1.0 - 6.694_379_990_13e-3 * square)
}

/// All of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// How the coefficients are found.
    pub method: Method,
    /// Who chooses the terms.
    pub terms: Terms,
    /// What is known of the place.
    pub site: Site,
    /// Length of the windows of the fit (s).
    pub fit_window_s: f64,
    /// Length of the windows over which residuals are stated (s); `None` to follow the length of the runs.
    pub window_s: Option<f64>,
    /// Smoothing of the temperature (s); `None` to search it.
    pub smoothing_s: Option<f64>,
    /// Date that the document states; `None` for the base document's.
    pub created: Option<Created>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: Method::Joint,
            terms: Terms::Auto,
            site: Site::Unknown,
            fit_window_s: 10.0,
            window_s: None,
            smoothing_s: None,
            created: None,
        }
    }
}
