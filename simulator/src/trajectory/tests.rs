use super::*;
use crate::motion::EARTH_RATE_RAD_PER_S;

fn slanted() -> Motion {
    Motion { heading_deg: 30.0, pitch_deg: -12.0, roll_deg: 50.0, ..Motion::rest(55.0) }
}

fn paths() -> Vec<Path> {
    let axis = [1.0, -2.0, 0.5];
    let vibration_axis = [0.3, 0.1, 1.0];
    vec![
        Path::Rest,
        Path::ConstantRate { axis, rate_deg_per_s: 200.0 },
        Path::ConstantRate { axis, rate_deg_per_s: 1e-4 },
        Path::Sine { axis, amplitude_deg: 1.0, frequency_hz: 1.0, phase_deg: 20.0 },
        Path::Sine { axis, amplitude_deg: 120.0, frequency_hz: 35.0, phase_deg: 0.0 },
        Path::Coning { half_angle_deg: 3.0, frequency_hz: 11.0 },
        Path::Coning { half_angle_deg: -60.0, frequency_hz: 1.0 },
        Path::Sculling {
            axis,
            amplitude_deg: 2.0,
            frequency_hz: 9.0,
            vibration_axis,
            vibration_m_per_s2: 30.0,
            vibration_phase_deg: 15.0,
        },
    ]
}

fn conjugate(q: [f64; 4]) -> [f64; 4] {
    [q[0], -q[1], -q[2], -q[3]]
}

fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    let (va, vb) = ([a[1], a[2], a[3]], [b[1], b[2], b[3]]);
    let v = plus(plus(scale(vb, a[0]), scale(va, b[0])), cross(va, vb));
    [a[0] * b[0] - dot(va, vb), v[0], v[1], v[2]]
}

fn about(axis: Vector, angle_rad: f64) -> [f64; 4] {
    let (sine, cosine) = libm::sincos(0.5 * angle_rad);
    [cosine, axis[0] * sine, axis[1] * sine, axis[2] * sine]
}

/// How the case has turned at a time: the quaternion (w, x, y, z) whose rotation takes its axes back to where they were without movement.
fn turned(trajectory: &Trajectory, time_s: f64) -> [f64; 4] {
    match &trajectory.turn {
        Turn::Rest => [1.0, 0.0, 0.0, 0.0],
        Turn::Constant { axis, rate_rad_per_s } => about(*axis, rate_rad_per_s * time_s),
        Turn::Sine { axis, amplitude_rad, pulsation, phase_rad, .. } => {
            about(*axis, amplitude_rad * libm::sin(pulsation * time_s + phase_rad))
        }
        Turn::Coning { half_angle_rad, pulsation } => {
            let (sine, cosine) = libm::sincos(pulsation * time_s);
            about([cosine, sine, 0.0], *half_angle_rad)
        }
    }
}

/// What a turned case sees of a vector in its axes without movement.
fn seen(turned: [f64; 4], v: Vector) -> Vector {
    let [_, x, y, z] = product(product(conjugate(turned), [0.0, v[0], v[1], v[2]]), turned);
    [x, y, z]
}

/// Sums over many short intervals, from attitudes only (and the vibration's formula).
fn by_brute_force(motion: &Motion, middle_s: f64, length_s: f64) -> Increments {
    let trajectory = Trajectory::new(motion);
    let latitude = motion.latitude_deg.to_radians();
    let rows = level_to_case(motion);
    let in_case = |level| rows.map(|row| dot(row, level));
    let earth = in_case(scale([libm::cos(latitude), 0.0, -libm::sin(latitude)], EARTH_RATE_RAD_PER_S));
    let support = in_case([0.0, 0.0, -motion.gravity_m_per_s2]);
    let count = 20_000_u32;
    let part_s = length_s / f64::from(count);
    let mut sum = Increments::default();
    for part in 0..count {
        let from_s = middle_s - 0.5 * length_s + part_s * f64::from(part);
        let centre_s = from_s + 0.5 * part_s;
        let (q0, q1) = (turned(&trajectory, from_s), turned(&trajectory, from_s + part_s));
        let [_, x, y, z] = product(conjugate(q0), q1);
        let middle = turned(&trajectory, centre_s);
        let earth_rad = scale(seen(middle, earth), part_s);
        let mut force = seen(middle, support);
        if let Path::Sculling {
            frequency_hz, vibration_axis, vibration_m_per_s2, vibration_phase_deg, ..
        } = motion.path
        {
            let phase = TURN_RAD * frequency_hz * centre_s + vibration_phase_deg.to_radians();
            force = plus(force, scale(unit(vibration_axis), vibration_m_per_s2 * libm::sin(phase)));
        }
        let sine = crate::vector::norm([x, y, z]);
        let by_rad = scale([x, y, z], if sine > 0.0 { 2.0 * libm::asin(sine) / sine } else { 0.0 });
        let step = Increments { angle: plus(by_rad, earth_rad), velocity: scale(force, part_s) };
        sum = sum.plus(step);
    }
    sum
}

#[test]
fn closed_integrals_agree_with_fine_sums() {
    for path in paths() {
        let motion = slanted().along(path);
        let trajectory = Trajectory::new(&motion);
        for (middle_s, length_s) in [(0.4025, 0.005), (7.3, 0.05)] {
            let exact = trajectory.increments(middle_s, length_s);
            let fine = by_brute_force(&motion, middle_s, length_s);
            for axis in 0..3 {
                let angle = (exact.angle[axis] - fine.angle[axis]).abs();
                let velocity = (exact.velocity[axis] - fine.velocity[axis]).abs();
                let bound = 2e-7 * length_s;
                assert!(angle < bound && velocity < bound, "{:?} {angle:e} {velocity:e}", motion.path);
            }
        }
    }
}

#[test]
fn increments_of_two_halves_are_those_of_the_whole() {
    for path in paths() {
        let trajectory = Trajectory::new(&slanted().along(path));
        let whole = trajectory.increments(2.0, 0.01);
        let halves = trajectory.increments(1.9975, 0.005).plus(trajectory.increments(2.0025, 0.005));
        for axis in 0..3 {
            assert!((whole.angle[axis] - halves.angle[axis]).abs() < 1e-12, "{trajectory:?}");
            assert!((whole.velocity[axis] - halves.velocity[axis]).abs() < 1e-12, "{trajectory:?}");
        }
    }
}

#[test]
fn at_rest_the_case_feels_the_earth_and_the_ground() {
    let latitude = 60.0_f64;
    let increments = Trajectory::new(&Motion::rest(latitude)).increments(100.0, 1.0);
    let expected = [0.5 * EARTH_RATE_RAD_PER_S, 0.0, -libm::sqrt(0.75) * EARTH_RATE_RAD_PER_S];
    for (angle, expected) in increments.angle.iter().zip(expected) {
        assert!((angle - expected).abs() < 1e-18);
    }
    assert!(increments.velocity[2] < -9.8 && increments.velocity[0].abs() < 1e-15);
}

#[test]
fn heading_turns_north_away_from_the_x_axis() {
    let east = Motion { heading_deg: 90.0, ..Motion::rest(0.0) };
    let increments = Trajectory::new(&east).increments(0.0, 1.0);
    assert!((increments.angle[1] + EARTH_RATE_RAD_PER_S).abs() < 1e-18, "north is to the left of east");
}
