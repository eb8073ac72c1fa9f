//! Micromechanical units: three axes through a chamber, and six skewed axes on a moving case.

use crate::chamber::Profile;
use crate::effects::Effects;
use crate::failure::Failure;
use crate::instrument::{Gyros, Instrument};
use crate::mems::MemsGyro;
use crate::motion::{Motion, Path};
use crate::orientation::Orientation;
use crate::presets::shared::{DEG_PER_H, micromechanical, thermometers, tilted, walk};
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
    Instrument {
        thermal_step_s: 0.25,
        cold_start: false,
        housing: Node { time_constant_s: 90.0, heating_deg_c: 2.0 },
        board: Node { time_constant_s: 20.0, heating_deg_c: 5.0 },
        gyros: Gyros::Mems(senses.into_iter().take(count).map(gyro).collect()),
        gyro_orientation: tilted(orientation.clone(), 1.0),
        accelerometers: Some(micromechanical(orientation)),
        thermometers: thermometers(count, count),
        effects: Effects::default(),
    }
}

/// Micromechanical unit at rest through a chamber cycle +25 → −40 → +80 → +25 °C at 2 °C/min, 100 Hz.
#[must_use]
pub fn mems_chamber(seed: u64) -> Scenario {
    let chamber = Profile::constant(25.0).hold(15.0).ramp(-40.0, 2.0).hold(20.0).ramp(80.0, 2.0).hold(20.0);
    let chamber = chamber.ramp(25.0, 2.0).hold(15.0);
    Scenario {
        unit: "MEMS-0001".into(),
        seed,
        start_ns: 0,
        duration_s: chamber.duration_s(),
        tick_ns: 10_000_000,
        tick_jitter_ns: 0,
        chamber,
        motion: Motion { heading_deg: 30.0, ..Motion::rest(55.75) },
        instrument: unit(Orientation::orthogonal()),
        failures: Vec::new(),
    }
}

/// Unit with six gyros and six accelerometers along the axes of a dodecahedron, swinging by 5° at 0.5 Hz while
/// the chamber warms from +20 to +40 °C, with a sensor that may fail; 100 Hz, 10 min.
#[must_use]
pub fn skewed_six(seed: u64, failure: Option<Failure>) -> Scenario {
    let swing = Path::Sine { axis: [0.5, -1.0, 0.8], amplitude_deg: 5.0, frequency_hz: 0.5, phase_deg: 0.0 };
    Scenario {
        unit: "SKEW-0006".into(),
        seed,
        duration_s: 600.0,
        chamber: Profile::constant(20.0).hold(1.0).ramp(40.0, 3.0),
        motion: Motion { heading_deg: 30.0, ..Motion::rest(55.75) }.along(swing),
        instrument: unit(Orientation::dodecahedron()),
        failures: failure.into_iter().collect(),
        ..mems_chamber(seed)
    }
}
