//! Error equations of an undamped platform inertial system near the Earth's surface, at rest.
//!
//! 002 names its system (a level platform that is turned about the vertical at four times the Earth's rate) and its
//! equations' source, but not the equations. These are the usual ones of a Schuler-tuned system, derived anew. Level frame:
//! north, east, down; φ platform against true level, δv velocity, δL and δλ position, ε drift along the level axes, Ω the
//! Earth's rate, L latitude, R its radius:
//!
//! ```text
//! φ̇_N = −Ω·sin L·φ_E − Ω·sin L·δL + δv_E/R − ε_N
//! φ̇_E =  Ω·sin L·φ_N + Ω·cos L·φ_D − δv_N/R − ε_E
//! φ̇_D = −Ω·cos L·φ_E − Ω·cos L·δL − tan L·δv_E/R − ε_D
//! δv̇_N =  g·φ_E − 2·Ω·sin L·δv_E
//! δv̇_E = −g·φ_N + 2·Ω·sin L·δv_N
//! δL̇ = δv_N/R,    δλ̇ = δv_E/(R·cos L)
//! ```
//!
//! The platform stands at the angle A(t) = k·Ω·t, so its gyros x and y give `ε_N = ε_x·cos A − ε_y·sin A` and
//! `ε_E = ε_x·sin A + ε_y·cos A`; the azimuth gyro's drift enters as it is. That is why a constant drift of x or y does
//! not add up, and one of z does.

use isotherm_correction::earth::EARTH_RATE;
use isotherm_correction::units::STANDARD_GRAVITY_M_PER_S2;
use nalgebra::{SMatrix, SVector};

/// Radius of the Earth (m), that of a sphere of its volume.
pub const EARTH_RADIUS_M: f64 = 6_371_000.8;
/// Rate of the platform about the vertical over the Earth's.
pub const TURN_RATIO: f64 = 4.0;
/// Greatest latitude (°): the longitude has no meaning at the pole.
pub const GREATEST_LATITUDE_DEG: f64 = 85.0;

type State = SVector<f64, 7>;
/// States and the three drifts that are held over a step.
type Augmented = SMatrix<f64, 10, 10>;

/// A system on its way.
#[derive(Debug, Clone)]
pub struct Ins {
    state: State,
    transition: SMatrix<f64, 7, 7>,
    drive: SMatrix<f64, 7, 3>,
    step_s: f64,
    turn_rad_per_s: f64,
    cosine: f64,
    time_s: f64,
}

/// Errors at a time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Errors {
    /// Heading (rad).
    pub heading_rad: f64,
    /// Position along north and east (m).
    pub position_m: [f64; 2],
}

impl Errors {
    /// Distance from the true position (m).
    pub fn radial_m(&self) -> f64 {
        libm::hypot(self.position_m[0], self.position_m[1])
    }

    /// Heading (′).
    pub fn heading_arcmin(&self) -> f64 {
        self.heading_rad.to_degrees() * 60.0
    }
}

impl Ins {
    /// A system without errors at a latitude (°), to be stepped by `step_s`; its platform turns at `turn_ratio` times the
    /// Earth's rate.
    pub fn new(latitude_deg: f64, turn_ratio: f64, step_s: f64) -> Self {
        let rate = EARTH_RATE.as_rad_per_s();
        let (s, c) = libm::sincos(latitude_deg.to_radians());
        let (up, north) = (rate * s, rate * c);
        let (g, r) = (STANDARD_GRAVITY_M_PER_S2, EARTH_RADIUS_M);
        let mut continuous = Augmented::zeros();
        // Order: φ_N, φ_E, φ_D, δv_N, δv_E, δL, δλ; then ε_N, ε_E, ε_D.
        let elements = [
            (0, 1, -up),
            (0, 5, -up),
            (0, 4, 1.0 / r),
            (0, 7, -1.0),
            (1, 0, up),
            (1, 2, north),
            (1, 3, -1.0 / r),
            (1, 8, -1.0),
            (2, 1, -north),
            (2, 5, -north),
            (2, 4, -s / (c * r)),
            (2, 9, -1.0),
            (3, 1, g),
            (3, 4, -2.0 * up),
            (4, 0, -g),
            (4, 3, 2.0 * up),
            (5, 3, 1.0 / r),
            (6, 4, 1.0 / (r * c)),
        ];
        for (row, column, value) in elements {
            continuous[(row, column)] = value;
        }
        let discrete = (continuous * step_s).exp();
        Self {
            state: State::zeros(),
            transition: discrete.fixed_view::<7, 7>(0, 0).into_owned(),
            drive: discrete.fixed_view::<7, 3>(0, 7).into_owned(),
            step_s,
            turn_rad_per_s: turn_ratio * rate,
            cosine: c,
            time_s: 0.0,
        }
    }

    /// One step with the mean drift of the gyros x, y, z of the platform over it (rad/s).
    pub fn step(&mut self, drift: [f64; 3]) {
        let [x, y, z] = drift;
        let (sine, cosine) = libm::sincos(self.turn_rad_per_s * (self.time_s + 0.5 * self.step_s));
        let level = SVector::<f64, 3>::new(x * cosine - y * sine, x * sine + y * cosine, z);
        self.state = self.transition * self.state + self.drive * level;
        self.time_s += self.step_s;
    }

    /// The errors now.
    pub fn errors(&self) -> Errors {
        let east = EARTH_RADIUS_M * self.cosine * self.state[6];
        Errors { heading_rad: self.state[2], position_m: [EARTH_RADIUS_M * self.state[5], east] }
    }
}

#[expect(clippy::cast_precision_loss, reason = "numbers of ticks of tests")]
#[cfg(test)]
mod tests {
    use isotherm_correction::units::AngularRate;

    use super::*;

    const STEP_S: f64 = 60.0;

    fn run(latitude_deg: f64, hours: f64, drift_deg_per_h: impl Fn(f64) -> [f64; 3]) -> Vec<Errors> {
        let mut ins = Ins::new(latitude_deg, TURN_RATIO, STEP_S);
        let mut errors = Vec::new();
        let mut time_s = 0.0;
        while time_s < hours * 3600.0 {
            let middle = (time_s + 0.5 * STEP_S) / 3600.0;
            ins.step(drift_deg_per_h(middle).map(|rate| AngularRate::from_deg_per_h(rate).as_rad_per_s()));
            time_s += STEP_S;
            errors.push(ins.errors());
        }
        errors
    }

    #[test]
    fn a_constant_azimuth_drift_carries_the_position_along_a_parallel() {
        // Over whole days the polar part of the drift adds up: ε·sin L·t of longitude; the rest swings.
        let errors = run(60.0, 48.0, |_| [0.0, 0.0, 0.01]);
        let end = errors.last().unwrap();
        let [s, c] = [60.0_f64.to_radians().sin(), 60.0_f64.to_radians().cos()];
        let east = (0.01_f64 * 48.0).to_radians() * s * c * EARTH_RADIUS_M;
        assert!((end.position_m[1].abs() / east - 1.0).abs() < 0.05, "{end:?} {east}");
    }

    #[test]
    fn a_constant_drift_of_a_level_gyro_does_not_add_up() {
        let largest = |errors: &[Errors]| errors.iter().map(Errors::radial_m).fold(0.0, f64::max);
        let turned = run(60.0, 48.0, |_| [0.01, 0.0, 0.0]);
        let azimuth = run(60.0, 48.0, |_| [0.0, 0.0, 0.01]);
        assert!(largest(&turned) * 5.0 < largest(&azimuth), "{} {}", largest(&turned), largest(&azimuth));
    }

    #[test]
    fn a_tilt_swings_with_the_period_of_schuler() {
        // A short kick of drift about east: latitude swings with 84.4 minutes.
        let errors = run(0.0, 1.5, |t| if t < 0.02 { [0.0, 100.0, 0.0] } else { [0.0; 3] });
        let north: Vec<f64> = errors.iter().map(|e| e.position_m[0]).collect();
        let turn = north.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).unwrap().0;
        assert!((turn as f64 - 42.2).abs() < 3.0, "half a period: {turn}");
    }
}
