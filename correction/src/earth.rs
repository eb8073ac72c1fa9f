//! Rate of the Earth in case axes: where the unit is and how it stands (models §7).
//!
//! Frames: the level frame is north, east, down. The case comes from it by the heading about down, the pitch about
//! the new east axis and the roll about the case's x axis, each positive by the right-hand rule. With L the matrix of
//! that rotation,
//!
//! ```text
//! ω_E = L·Ω·(cos φ, 0, −sin φ)        φ geodetic latitude
//! ```
//!
//! A unit at rest feels f = L·(0, 0, −g), which says pitch and roll but not the heading:
//!
//! ```text
//! pitch = atan2(f_x, √(f_y² + f_z²)),    roll = atan2(−f_y, −f_z)
//! ```

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::stated::Shown;
use crate::units::{Angle, AngularRate, STANDARD_GRAVITY_M_PER_S2};

/// Rate of rotation of the Earth relative to the stars, WGS 84.
pub const EARTH_RATE: AngularRate = AngularRate::from_rad_per_s(7.292_115e-5);
/// How far the mean specific force may be from one standard gravity for levelling (a fraction of it).
///
/// Gravity itself differs from it by 0.3 % at most on the ground.
pub const LEVELLING_TOLERANCE: f64 = 0.02;
/// Smallest cosine of the pitch for levelling: nearer to the vertical the x axis has no heading.
const SMALLEST_COSINE: f64 = 0.02;

/// How the case stands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Tilt {
    /// Known beforehand.
    Given {
        /// Pitch of the case's x axis above the horizon (rad, −π/2…π/2).
        pitch_rad: f64,
        /// Roll about the case's x axis (rad, −π…π).
        roll_rad: f64,
    },
    /// From the mean specific force of the run.
    Levelled,
}

/// Where a unit at rest is and how it stands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Place {
    latitude_rad: f64,
    heading_rad: f64,
    tilt: Tilt,
}

/// A stated angle that is no number or outside its range.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("{name} is {}°, must be from {low}° to {high}°", Shown(*got))]
pub struct PlaceError {
    /// Which angle.
    pub name: &'static str,
    /// The angle (°).
    pub got: f64,
    /// Smallest allowed (°).
    pub low: f64,
    /// Largest allowed (°).
    pub high: f64,
}

impl Place {
    /// From geodetic latitude (°, −90…90, north positive), heading of the case's x axis from north towards east (°,
    /// −360…360), and pitch (°, −90…90) and roll (°, −180…180) where they are known; without them the unit is levelled.
    ///
    /// # Errors
    /// Every angle that is no number or outside its range.
    pub fn new(
        latitude_deg: f64,
        heading_deg: f64,
        pitch_roll_deg: Option<[f64; 2]>,
    ) -> Result<Self, Vec<PlaceError>> {
        let mut errors = Vec::new();
        let mut checked = |name, got: f64, limit: f64| {
            // False for NaN too.
            if !(-limit..=limit).contains(&got) {
                errors.push(PlaceError { name, got, low: -limit, high: limit });
            }
            Angle::from_deg(got).as_rad()
        };
        let place = Self {
            latitude_rad: checked("latitude", latitude_deg, 90.0),
            heading_rad: checked("heading", heading_deg, 360.0),
            tilt: pitch_roll_deg.map_or(Tilt::Levelled, |[pitch_deg, roll_deg]| Tilt::Given {
                pitch_rad: checked("pitch", pitch_deg, 90.0),
                roll_rad: checked("roll", roll_deg, 180.0),
            }),
        };
        if errors.is_empty() { Ok(place) } else { Err(errors) }
    }

    /// How the case stands.
    #[must_use]
    pub const fn tilt(&self) -> Tilt {
        self.tilt
    }

    /// Rate of the Earth in case axes (rad/s).
    ///
    /// `mean_force` is the mean specific force in case axes (m/s²); only levelling looks at it. `None` where levelling
    /// has no force, or one farther than [`LEVELLING_TOLERANCE`] from standard gravity, or an x axis within about 1° of
    /// the vertical, which has no heading.
    #[must_use]
    pub fn earth_rate_in_case(&self, mean_force: Option<[f64; 3]>) -> Option<[f64; 3]> {
        let (pitch_rad, roll_rad) = match self.tilt {
            Tilt::Given { pitch_rad, roll_rad } => (pitch_rad, roll_rad),
            Tilt::Levelled => levelled(mean_force?)?,
        };
        let rate = EARTH_RATE.as_rad_per_s();
        let (sine, cosine) = libm::sincos(self.latitude_rad);
        let (north, down) = (rate * cosine, -rate * sine);
        let case = level_to_case(self.heading_rad, pitch_rad, roll_rad);
        Some(case.map(|[along_north, _, along_down]| along_north * north + along_down * down))
    }
}

/// Pitch and roll (rad) of a case that feels `force` (m/s²).
fn levelled(force: [f64; 3]) -> Option<(f64, f64)> {
    let [x, y, z] = force;
    let level = libm::hypot(y, z);
    let excess = libm::hypot(x, level) / STANDARD_GRAVITY_M_PER_S2 - 1.0;
    // False for NaN too.
    let usable = excess.abs() <= LEVELLING_TOLERANCE && level >= SMALLEST_COSINE * STANDARD_GRAVITY_M_PER_S2;
    usable.then(|| (libm::atan2(x, level), libm::atan2(-y, -z)))
}

/// L: level frame to case axes, by rows.
fn level_to_case(heading_rad: f64, pitch_rad: f64, roll_rad: f64) -> [[f64; 3]; 3] {
    let (sh, ch) = libm::sincos(heading_rad);
    let (sp, cp) = libm::sincos(pitch_rad);
    let (sr, cr) = libm::sincos(roll_rad);
    [
        [cp * ch, cp * sh, -sp],
        [sr * sp * ch - cr * sh, sr * sp * sh + cr * ch, sr * cp],
        [cr * sp * ch + sr * sh, cr * sp * sh - sr * ch, cr * cp],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::{cross, dot};

    fn rate_deg_per_h(place: &Place, force: Option<[f64; 3]>) -> [f64; 3] {
        let rate = place.earth_rate_in_case(force).unwrap();
        rate.map(|rate| AngularRate::from_rad_per_s(rate).as_deg_per_h())
    }

    #[track_caller]
    fn close(got: [f64; 3], expected: [f64; 3]) {
        for (got, expected) in got.iter().zip(expected) {
            assert!((got - expected).abs() < 1e-3, "{got} is not {expected}");
        }
    }

    #[test]
    fn the_earth_turns_about_the_axis_that_points_north_or_up() {
        let level = Some([0.0, 0.0]);
        // 15.041 °/h about the pole.
        close(rate_deg_per_h(&Place::new(0.0, 0.0, level).unwrap(), None), [15.041, 0.0, 0.0]);
        close(rate_deg_per_h(&Place::new(90.0, 0.0, level).unwrap(), None), [0.0, 0.0, -15.041]);
        // x to the east: north is along −y.
        close(rate_deg_per_h(&Place::new(0.0, 90.0, level).unwrap(), None), [0.0, -15.041, 0.0]);
        // x up at the north pole.
        let upright = Place::new(90.0, 0.0, Some([90.0, 0.0])).unwrap();
        close(rate_deg_per_h(&upright, None), [15.041, 0.0, 0.0]);
        // Rolled by a quarter turn, y points down.
        let rolled = Place::new(90.0, 0.0, Some([0.0, 90.0])).unwrap();
        close(rate_deg_per_h(&rolled, None), [0.0, -15.041, 0.0]);
    }

    #[test]
    fn levelling_finds_the_attitude_that_the_force_was_made_with() {
        for (heading, pitch, roll) in
            [(0.0, 0.0, 0.0), (30.0, 12.0, -7.0), (-200.0, -60.0, 170.0), (10.0, 80.0, 100.0)]
        {
            let given = Place::new(55.0, heading, Some([pitch, roll])).unwrap();
            let [h, p, r] = [heading, pitch, roll].map(f64::to_radians);
            let force = level_to_case(h, p, r).map(|row| row[2] * -9.81);
            let levelled = Place::new(55.0, heading, None).unwrap();
            close(rate_deg_per_h(&levelled, Some(force)), rate_deg_per_h(&given, None));
        }
    }

    #[test]
    fn the_case_axes_are_those_of_a_body_in_every_attitude() {
        for (heading, pitch, roll) in [(0.0, 0.0, 0.0), (0.5, 0.2, -0.1), (-3.0, -1.0, 2.9), (0.2, 1.4, 1.7)]
        {
            let [x, y, z] = level_to_case(heading, pitch, roll);
            // Of length one, perpendicular, right-handed.
            for (got, expected) in
                [(dot(x, x), 1.0), (dot(y, y), 1.0), (dot(x, y), 0.0), (dot(cross(x, y), z), 1.0)]
            {
                assert!(
                    (got - expected).abs() < 1e-15 * 4.0,
                    "{heading} {pitch} {roll}: {got} is not {expected}"
                );
            }
            close(z, cross(x, y));
        }
    }

    #[test]
    fn levelling_wants_about_one_g_and_an_x_axis_that_has_a_heading() {
        let place = Place::new(55.0, 0.0, None).unwrap();
        let without = [
            None,
            Some([0.0, 0.0, -9.0]),
            Some([0.0, 0.0, -10.1]),
            Some([9.81, 0.0, -0.1]),
            Some([f64::NAN, 0.0, -9.81]),
        ];
        for force in without {
            assert_eq!(place.earth_rate_in_case(force), None, "{force:?}");
        }
        assert!(place.earth_rate_in_case(Some([0.1, 0.0, -9.83])).is_some());
    }

    #[test]
    fn every_angle_outside_its_range_is_named() {
        let errors = Place::new(90.5, f64::NAN, Some([-91.0, 181.0])).unwrap_err();
        let names: Vec<_> = errors.iter().map(|error| error.name).collect();
        assert_eq!(names, ["latitude", "heading", "pitch", "roll"]);
        assert!(Place::new(-90.0, 359.0, None).is_ok());
    }
}
