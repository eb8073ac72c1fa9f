//! Exact integrals of body rate and specific force over any interval of a motion.

use crate::motion::{Motion, Path};
use crate::vector::{Vector, cross, dot, minus, plus, scale, unit};

/// Integrals over one interval, in case axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Increments {
    /// ∫ω dt, ω the case's rate relative to the stars (rad).
    pub angle: [f64; 3],
    /// ∫f dt, f the specific force (m/s).
    pub velocity: [f64; 3],
}

impl Increments {
    /// Increments over this interval and the next one together.
    #[must_use]
    pub fn plus(self, next: Self) -> Self {
        Self { angle: plus(self.angle, next.angle), velocity: plus(self.velocity, next.velocity) }
    }
}

/// A motion that is ready to be integrated.
///
/// *Numerics*: closed formulas, except for rotation by a sine of finite amplitude, where the mean cosine and
/// sine of the angle come from five-point Gauss–Legendre panels of at most half a radian (relative error
/// below 1e-15).
#[derive(Debug, Clone)]
pub struct Trajectory {
    /// Earth rate at the attitude without movement, in case axes (rad/s).
    earth_rad_per_s: Vector,
    /// Specific force at the attitude without movement, in case axes (m/s²).
    support_m_per_s2: Vector,
    turn: Turn,
}

#[derive(Debug, Clone)]
enum Turn {
    Rest,
    Constant { axis: Vector, rate_rad_per_s: f64 },
    Sine { axis: Vector, amplitude_rad: f64, pulsation: f64, phase_rad: f64, vibration: Option<Vibration> },
    Coning { half_angle_rad: f64, pulsation: f64 },
}

#[derive(Debug, Clone)]
struct Vibration {
    amplitude_m_per_s2: Vector,
    phase_rad: f64,
}

const TURN_RAD: f64 = 2.0 * core::f64::consts::PI;

impl Trajectory {
    /// Prepares a motion.
    #[must_use]
    pub fn new(motion: &Motion) -> Self {
        let level_to_case = level_to_case(motion);
        let latitude = motion.latitude_deg.to_radians();
        let earth = scale([libm::cos(latitude), 0.0, -libm::sin(latitude)], motion.earth_rate_rad_per_s);
        let support = [0.0, 0.0, -motion.gravity_m_per_s2];
        Self {
            earth_rad_per_s: level_to_case.map(|row| dot(row, earth)),
            support_m_per_s2: level_to_case.map(|row| dot(row, support)),
            turn: Turn::new(&motion.path),
        }
    }

    /// Integrals over the interval of `length_s` around `middle_s`, seconds from the start.
    #[must_use]
    pub fn increments(&self, middle_s: f64, length_s: f64) -> Increments {
        let (earth, support) = (self.earth_rad_per_s, self.support_m_per_s2);
        match &self.turn {
            Turn::Rest => Increments { angle: scale(earth, length_s), velocity: scale(support, length_s) },
            Turn::Constant { axis, rate_rad_per_s } => {
                let flat = sinc(0.5 * rate_rad_per_s * length_s) * length_s;
                let (sine, cosine) = libm::sincos(rate_rad_per_s * middle_s);
                let seen = |v| turned_back(*axis, v, flat * cosine, flat * sine, length_s);
                let own = scale(*axis, rate_rad_per_s * length_s);
                Increments { angle: plus(own, seen(earth)), velocity: seen(support) }
            }
            Turn::Sine { axis, amplitude_rad, pulsation, phase_rad, vibration } => {
                let middle_rad = pulsation * middle_s + phase_rad;
                let angle = |offset_s: f64| amplitude_rad * libm::sin(middle_rad + pulsation * offset_s);
                let bandwidth = pulsation * (1.0 + amplitude_rad.abs());
                let (cosine, sine) = integrate_cos_sin(angle, length_s, bandwidth);
                let seen = |v| turned_back(*axis, v, cosine, sine, length_s);
                let half_rad = 0.5 * pulsation * length_s;
                let turned_rad = 2.0 * amplitude_rad * libm::cos(middle_rad) * libm::sin(half_rad);
                let shaken = vibration.as_ref().map_or([0.0; 3], |vibration| {
                    let mean = libm::sin(middle_rad - phase_rad + vibration.phase_rad) * sinc(half_rad);
                    scale(vibration.amplitude_m_per_s2, mean * length_s)
                });
                Increments {
                    angle: plus(scale(*axis, turned_rad), seen(earth)),
                    velocity: plus(shaken, seen(support)),
                }
            }
            Turn::Coning { half_angle_rad, pulsation } => {
                let cone = Cone::new(*half_angle_rad, *pulsation, middle_s, length_s);
                Increments {
                    angle: plus(cone.own_angle(*pulsation), cone.seen(earth)),
                    velocity: cone.seen(support),
                }
            }
        }
    }
}

impl Turn {
    fn new(path: &Path) -> Self {
        match *path {
            Path::Rest => Self::Rest,
            Path::ConstantRate { axis, rate_deg_per_s } => {
                Self::Constant { axis: unit(axis), rate_rad_per_s: rate_deg_per_s.to_radians() }
            }
            Path::Sine { axis, amplitude_deg, frequency_hz, phase_deg } => Self::Sine {
                axis: unit(axis),
                amplitude_rad: amplitude_deg.to_radians(),
                pulsation: TURN_RAD * frequency_hz,
                phase_rad: phase_deg.to_radians(),
                vibration: None,
            },
            Path::Coning { half_angle_deg, frequency_hz } => Self::Coning {
                half_angle_rad: half_angle_deg.to_radians(),
                pulsation: TURN_RAD * frequency_hz,
            },
            Path::Sculling {
                axis,
                amplitude_deg,
                frequency_hz,
                vibration_axis,
                vibration_m_per_s2,
                vibration_phase_deg,
            } => Self::Sine {
                axis: unit(axis),
                amplitude_rad: amplitude_deg.to_radians(),
                pulsation: TURN_RAD * frequency_hz,
                phase_rad: 0.0,
                vibration: Some(Vibration {
                    amplitude_m_per_s2: scale(unit(vibration_axis), vibration_m_per_s2),
                    phase_rad: vibration_phase_deg.to_radians(),
                }),
            },
        }
    }
}

/// Trigonometric integrals of a coning motion over one interval.
struct Cone {
    sine_half: f64,
    cosine_half: f64,
    length_s: f64,
    /// ∫cos θ, ∫sin θ, θ the angle round the cone.
    first: [f64; 2],
    /// ∫cos 2θ, ∫sin 2θ.
    second: [f64; 2],
}

impl Cone {
    fn new(half_angle_rad: f64, pulsation: f64, middle_s: f64, length_s: f64) -> Self {
        let (sine_half, cosine_half) = libm::sincos(0.5 * half_angle_rad);
        let (sine, cosine) = libm::sincos(pulsation * middle_s);
        let first = sinc(0.5 * pulsation * length_s) * length_s;
        let second = sinc(pulsation * length_s) * length_s;
        Self {
            sine_half,
            cosine_half,
            length_s,
            first: [first * cosine, first * sine],
            second: [second * (cosine * cosine - sine * sine), second * 2.0 * sine * cosine],
        }
    }

    /// ∫ of ω = Ω·(−sin a·sin θ, sin a·cos θ, −2·sin²(a/2)).
    fn own_angle(&self, pulsation: f64) -> Vector {
        let sine = 2.0 * self.sine_half * self.cosine_half;
        scale(
            [
                -sine * self.first[1],
                sine * self.first[0],
                -2.0 * self.sine_half * self.sine_half * self.length_s,
            ],
            pulsation,
        )
    }

    /// ∫ of a level-fixed vector as the case sees it: v − 2c·(u×v) + 2·(u·(u·v) − u²·v), u = s·(cos θ, sin θ, 0).
    fn seen(&self, v: Vector) -> Vector {
        let (s, c) = (self.sine_half, self.cosine_half);
        let axis = [s * self.first[0], s * self.first[1], 0.0];
        let [cos_2, sin_2] = self.second;
        let (cc, ss, cs) = (0.5 * (self.length_s + cos_2), 0.5 * (self.length_s - cos_2), 0.5 * sin_2);
        let along = scale([cc * v[0] + cs * v[1], cs * v[0] + ss * v[1], 0.0], 2.0 * s * s);
        let straight = scale(v, self.length_s * (1.0 - 2.0 * s * s));
        plus(plus(straight, along), scale(cross(axis, v), -2.0 * c))
    }
}

/// Integral of a fixed vector as seen from a case that turns about `axis`, given the integrals of the cosine
/// and sine of its angle.
fn turned_back(axis: Vector, v: Vector, cosine: f64, sine: f64, length_s: f64) -> Vector {
    let along = scale(axis, dot(axis, v));
    let across = minus(v, along);
    plus(plus(scale(along, length_s), scale(across, cosine)), scale(cross(axis, v), -sine))
}

/// ∫cos φ and ∫sin φ over an interval whose middle is offset zero.
fn integrate_cos_sin(angle: impl Fn(f64) -> f64, length_s: f64, bandwidth: f64) -> (f64, f64) {
    const NODES: [(f64, f64); 5] = [
        (0.0, 0.568_888_888_888_888_9),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let mut panels = 1.0;
    while panels < 1024.0 && length_s * bandwidth > 0.5 * panels {
        panels += 1.0;
    }
    let half_s = 0.5 * length_s / panels;
    let (mut cosine, mut sine) = (0.0, 0.0);
    let mut panel = 0.0;
    while panel < panels {
        let centre_s = (2.0 * panel + 1.0 - panels) * half_s;
        for (node, weight) in NODES {
            let (s, c) = libm::sincos(angle(centre_s + node * half_s));
            cosine += weight * c;
            sine += weight * s;
        }
        panel += 1.0;
    }
    (cosine * half_s, sine * half_s)
}

/// sin(x)/x.
fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { libm::sin(x) / x }
}

/// Level frame to case axes without movement, by rows.
fn level_to_case(motion: &Motion) -> [Vector; 3] {
    let (sh, ch) = libm::sincos(motion.heading_deg.to_radians());
    let (sp, cp) = libm::sincos(motion.pitch_deg.to_radians());
    let (sr, cr) = libm::sincos(motion.roll_deg.to_radians());
    [
        [cp * ch, cp * sh, -sp],
        [sr * sp * ch - cr * sh, sr * sp * sh + cr * ch, sr * cp],
        [cr * sp * ch + sr * sh, cr * sp * sh - sr * ch, cr * cp],
    ]
}

#[cfg(test)]
mod tests;
