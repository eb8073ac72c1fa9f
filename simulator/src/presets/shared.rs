//! What the ready-made units have in common.

use crate::accelerometer::{Accelerometer, AccelerometerOutput, Accelerometers};
use crate::chamber::Profile;
use crate::effects::Effects;
use crate::instrument::{Gyros, Instrument};
use crate::motion::Motion;
use crate::noise::GyroNoise;
use crate::orientation::Orientation;
use crate::scenario::Scenario;
use crate::temperature::{Channel, Place, Thermometers};
use crate::thermal::Node;

/// rad/s in one °/h.
pub(super) const DEG_PER_H: f64 = core::f64::consts::PI / 180.0 / 3600.0;
/// rad/√s in one °/√h.
pub(super) const DEG_PER_SQRT_H: f64 = core::f64::consts::PI / 180.0 / 60.0;
/// m/s² in one thousandth of a standard gravity.
const MILLI_G: f64 = 9.806_65e-3;

/// A unit, with time constant (s) and heating (°C) of its housing and its board, and axes along `orientation` but for misalignments.
pub(super) fn instrument(
    parts: [(f64, f64); 2],
    gyros: Gyros,
    orientation: Orientation,
    accelerometers: Accelerometers,
) -> Instrument {
    let [housing, board] =
        parts.map(|(time_constant_s, heating_deg_c)| Node { time_constant_s, heating_deg_c });
    Instrument {
        thermal_step_s: 0.25,
        cold_start: false,
        housing,
        board,
        thermometers: thermometers(gyros.count()),
        gyros,
        gyro_orientation: tilted(orientation, 1.0),
        accelerometers: Some(accelerometers),
        effects: Effects::default(),
    }
}

/// The unit at rest through a chamber programme, from its start to its end.
pub(super) fn at_rest(
    unit: &str,
    seed: u64,
    tick_ns: i64,
    chamber: Profile,
    instrument: Instrument,
) -> Scenario {
    Scenario {
        unit: unit.into(),
        seed,
        start_ns: 0,
        duration_s: chamber.duration_s(),
        tick_ns,
        tick_jitter_ns: 0,
        chamber,
        motion: Motion { heading_deg: 30.0, ..Motion::rest(55.75) },
        instrument,
        failures: Vec::new(),
    }
}

/// White noise only.
pub(super) fn walk(deg_per_sqrt_h: f64) -> GyroNoise {
    GyroNoise { angle_random_walk_rad_per_sqrt_s: deg_per_sqrt_h * DEG_PER_SQRT_H, ..GyroNoise::default() }
}

/// Misalignments of some 10″…60″ and 0.1″/K at most, so that a row's length changes by less than 1e-9.
fn tilted(orientation: Orientation, sense: f64) -> Orientation {
    let by_rad = [
        [1.2e-4, -2.1e-4, 0.8e-4],
        [-0.9e-4, 1.4e-4, 2.4e-4],
        [2.0e-4, 0.7e-4, -1.6e-4],
        [-1.1e-4, -0.5e-4, 1.9e-4],
        [0.4e-4, 2.2e-4, -1.3e-4],
        [-1.8e-4, 0.9e-4, 0.6e-4],
    ];
    let by_rad_per_k = [
        [2.0e-7, -3.0e-7, 1.0e-7],
        [-2.5e-7, 1.5e-7, 2.0e-7],
        [1.0e-7, 2.5e-7, -2.0e-7],
        [-1.5e-7, 2.0e-7, 1.5e-7],
        [3.0e-7, -1.0e-7, 1.0e-7],
        [1.0e-7, 1.5e-7, -2.5e-7],
    ];
    orientation.tilted(&by_rad.map(|by| by.map(|x| x * sense)), &by_rad_per_k.map(|by| by.map(|x| x * sense)))
}

/// Three quartz accelerometers of about 1 V/g with a pulse output of about 500 kHz/g.
pub(super) fn quartz() -> Accelerometers {
    let sensor = |bias_milli_g: f64, drift_v_per_k: f64, scale_v: f64, board_per_k: f64| Accelerometer {
        node: Node { time_constant_s: 420.0, heating_deg_c: 2.0 },
        reference_deg_c: 20.0,
        scale_v_per_m_per_s2: [scale_v, scale_v * 1.1e-4, -scale_v * 4.0e-8],
        bias_v: [bias_milli_g * MILLI_G * scale_v, drift_v_per_k, drift_v_per_k * 2.0e-3],
        board_ratio: [1.0, board_per_k, board_per_k * 1.5e-3],
        velocity_random_walk_m_per_s_per_sqrt_s: 3.0e-5,
    };
    Accelerometers {
        output: AccelerometerOutput::Counts { hz_per_v: 5.0e5, quantised: true },
        sensors: vec![
            sensor(3.1, 2.4e-5, 0.1021, 2.2e-5),
            sensor(-4.6, -1.8e-5, 0.1008, -1.7e-5),
            sensor(1.9, 3.3e-5, 0.1034, 2.9e-5),
        ],
        orientation: tilted(Orientation::orthogonal(), -1.0),
    }
}

/// Digital accelerometers in m/s², with scales and biases of the micromechanical kind.
pub(super) fn micromechanical(orientation: Orientation) -> Accelerometers {
    let sensor = |sense: f64| Accelerometer {
        node: Node { time_constant_s: 45.0, heating_deg_c: 4.0 },
        reference_deg_c: 25.0,
        scale_v_per_m_per_s2: [1.0 + 2.0e-3 * sense, 6.0e-5 * sense, 2.0e-7],
        bias_v: [8.0 * MILLI_G * sense, 0.12 * MILLI_G, 1.0e-3 * MILLI_G * sense],
        board_ratio: [1.0, 0.0, 0.0],
        velocity_random_walk_m_per_s_per_sqrt_s: 1.0e-3,
    };
    let senses = [1.0, -0.7, 0.4, -1.1, 0.9, -0.3, 0.6, -0.8];
    Accelerometers {
        output: AccelerometerOutput::Mean,
        sensors: senses.into_iter().take(orientation.rows.len()).map(sensor).collect(),
        orientation: tilted(orientation, 0.5),
    }
}

/// Analogue channels of 10 mV/K through a 16-bit converter: `gyro0`…, `accel0`…, `board`, `housing`.
fn thermometers(sensors: usize) -> Thermometers {
    let channel = |name: String, place| Channel {
        name,
        place,
        raw_at_0_deg_c: 1.5,
        raw_per_deg_c: 0.010,
        noise_deg_c: 0.004,
        resolution_raw: 5.0 / 65_536.0,
    };
    let gyros = (0..sensors).map(|index| channel(format!("gyro{index}"), Place::Gyro(index)));
    let accels = (0..sensors).map(|index| channel(format!("accel{index}"), Place::Accelerometer(index)));
    let others = [channel("board".into(), Place::Board), channel("housing".into(), Place::Housing)];
    Thermometers { period_s: 1.0, channels: gyros.chain(accels).chain(others).collect() }
}
