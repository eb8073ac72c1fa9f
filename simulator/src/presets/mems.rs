//! Micromechanical units: three axes through a chamber, and six skewed axes on a moving case.

use crate::chamber::Profile;
use crate::failure::Failure;
use crate::instrument::{Gyros, Instrument};
use crate::mems::MemsGyro;
use crate::motion::Path;
use crate::orientation::Orientation;
use crate::presets::shared::{DEG_PER_H, at_rest, instrument, micromechanical, walk};
use crate::scenario::Scenario;
use crate::thermal::Node;

fn gyro(sense: f64) -> MemsGyro {
    MemsGyro {
        node: Node { time_constant_s: 40.0, heating_deg_c: 4.0 },
        reference_deg_c: 25.0,
        scale: 1.0 + 1.5e-3 * sense,
        scale_per_k: [4.0e-5 * sense, 1.5e-7],
        bias_rad_per_s: [90.0, 4.0, 0.03 * sense, -4.0e-4].map(|bias| bias * sense * DEG_PER_H),
        resolution_rad_per_s: 0.0,
        noise: walk(0.15),
    }
}

fn unit(orientation: Orientation) -> Instrument {
    let count = orientation.rows.len();
    let senses = [1.0, -0.8, 0.5, -1.2, 0.7, -0.4, 1.1, -0.9];
    let gyros = Gyros::Mems(senses.into_iter().take(count).map(gyro).collect());
    instrument([(90.0, 2.0), (20.0, 5.0)], gyros, orientation.clone(), micromechanical(orientation))
}

/// Micromechanical unit at rest through a chamber cycle +25 → −40 → +80 → +25 °C at 2 °C/min, 100 Hz.
#[must_use]
pub fn mems_chamber(seed: u64) -> Scenario {
    let chamber = Profile::constant(25.0).hold(15.0).ramp(-40.0, 2.0).hold(20.0).ramp(80.0, 2.0).hold(20.0);
    let chamber = chamber.ramp(25.0, 2.0).hold(15.0);
    at_rest("MEMS-0001", seed, 10_000_000, chamber, unit(Orientation::orthogonal()))
}

/// Unit with six gyros and six accelerometers along the axes of a dodecahedron, swinging by 5° at 0.5 Hz while
/// the chamber warms from +20 to +40 °C, with a sensor that may fail; 100 Hz, 10 min.
#[must_use]
pub fn skewed_six(seed: u64, failure: Option<Failure>) -> Scenario {
    let swing = Path::Sine { axis: [0.5, -1.0, 0.8], amplitude_deg: 5.0, frequency_hz: 0.5, phase_deg: 0.0 };
    let chamber = Profile::constant(20.0).hold(1.0).ramp(40.0, 3.0);
    let rest = at_rest("SKEW-0006", seed, 10_000_000, chamber, unit(Orientation::dodecahedron()));
    let failures = failure.into_iter().collect();
    Scenario { duration_s: 600.0, motion: rest.motion.clone().along(swing), failures, ..rest }
}
