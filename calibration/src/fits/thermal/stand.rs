//! How a unit stands, or is turned, while a run is taken: what its sensors would read if they were without error.

use isotherm_correction::earth::{EARTH_RATE, Place, PlaceError};

use crate::fits::positions::gravity::normal;

/// What is known of the unit's place.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Site {
    /// Nothing: the mean of each run is removed, and the level of every output stays what it was.
    #[default]
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
    /// A place by latitude and heading (°), and pitch and roll (°) where they are known; gravity (m/s²) is normal gravity of the
    /// latitude where it is not stated.
    ///
    /// # Errors
    /// Every angle that is no number or outside its range.
    pub fn at(
        latitude_deg: f64,
        heading_deg: f64,
        tilt_deg: Option<[f64; 2]>,
        gravity_m_per_s2: Option<f64>,
    ) -> Result<Self, Vec<PlaceError>> {
        let place = Place::new(latitude_deg, heading_deg, tilt_deg)?;
        // At the pole the Earth turns about the vertical: where that axis is in the case, there gravity is.
        let up = match tilt_deg {
            Some(tilt) => Place::new(90.0, heading_deg, Some(tilt))?.earth_rate_in_case(None),
            None => None,
        };
        let gravity =
            gravity_m_per_s2.unwrap_or_else(|| normal(latitude_deg, 0.0)) / EARTH_RATE.as_rad_per_s();
        Ok(Self::Known { place, force_m_per_s2: up.map(|up| up.map(|part| part * gravity)) })
    }
}

/// A turn at a constant rate, as a rate table makes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turning {
    /// Axis in case axes, a unit vector.
    pub axis: [f64; 3],
    /// Rate about it (°/s), not zero.
    pub rate_deg_per_s: f64,
}

impl Turning {
    /// The table's rate in case axes (°/h).
    pub fn rate_deg_per_h(&self) -> [f64; 3] {
        self.axis.map(|part| part * 3600.0 * self.rate_deg_per_s)
    }
}

/// How a unit stands in a run, and how it is turned.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stand {
    /// The place, and the attitude at the beginning of the run.
    pub site: Site,
    /// The turn; `None` at rest.
    pub turning: Option<Turning>,
}

impl Stand {
    /// The shortest windows that are no shorter than so many seconds (s): of a turning run whole turns, over which the horizontal
    /// part of the Earth's rate is nothing.
    pub fn window_s(&self, at_least_s: f64) -> f64 {
        match &self.turning {
            None => at_least_s,
            Some(turning) => {
                let turn_s = 360.0 / turning.rate_deg_per_s.abs();
                libm::ceil(at_least_s / turn_s - 1e-9).max(1.0) * turn_s
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_of_a_turning_run_are_whole_turns() {
        let turning = |rate_deg_per_s| Stand {
            turning: Some(Turning { axis: [0.0, 0.0, 1.0], rate_deg_per_s }),
            ..Stand::default()
        };
        let windows = [(10.0, 36.0), (-50.0, 14.4), (36.0, 10.0), (-360.0, 10.0)];
        for (rate, window) in windows {
            assert!((turning(rate).window_s(10.0) - window).abs() < 1e-9, "{rate}");
        }
        assert!((Stand::default().window_s(10.0) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn gravity_is_normal_gravity_along_the_case() {
        let force = |tilt, gravity| match Site::at(55.75, 30.0, Some(tilt), gravity).unwrap() {
            Site::Known { force_m_per_s2: Some(force), .. } => force,
            other => panic!("{other:?}"),
        };
        let level = force([0.0, 0.0], None);
        assert!((level[2] + normal(55.75, 0.0)).abs() < 1e-9 && level[0].abs() < 1e-9, "{level:?}");
        // Rolled by half a turn z points up; with the nose up x does.
        assert!((force([0.0, 180.0], Some(9.8))[2] - 9.8).abs() < 1e-9);
        assert!((force([90.0, 0.0], Some(9.8))[0] - 9.8).abs() < 1e-9);
    }
}
