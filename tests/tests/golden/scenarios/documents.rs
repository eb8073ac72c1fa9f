//! Every shipped calibration document, and every preset of the simulator.

use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_protocol::document::Document;
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::failure::{FailingSensor, Failure, Fault};
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::{Scenario as Simulated, presets};
use isotherm_tests::calibrations::{compile, identity, orientation};
use isotherm_tests::data::root;
use isotherm_tests::lives::{FULL_CHANNELS, full};
use isotherm_tests::script::{Scenario, Script};

use crate::plain::told;

fn document(name: &str) -> Arc<Calibration> {
    let text = std::fs::read_to_string(root().join("config/calibration").join(name)).unwrap();
    Arc::new(Document::parse(&text, None).unwrap().calibration)
}

fn simulated(calibration: &Arc<Calibration>, batch: u64, scenario: &Simulated) -> Scenario {
    let mut script = Script::new(scenario.seed, calibration, &[]);
    script.batch = batch;
    script.simulated(scenario);
    told(script)
}

/// The chamber at so quick a pace that a short run shows it.
fn quick(scenario: Simulated, duration_s: f64) -> Simulated {
    let chamber = Profile::constant(20.0).ramp(50.0, 180.0).hold(0.05).ramp(-10.0, 240.0);
    Simulated { duration_s, chamber, ..scenario }
}

/// The instrument's modes at another pace.
fn reversed(mut scenario: Simulated, period_s: f64, meander_half_period_s: f64) -> Simulated {
    if let Gyros::Zeeman(zeeman) = &mut scenario.instrument.gyros {
        zeeman.reversal.period_s = period_s;
        zeeman.reversal.meander_half_period_s = meander_half_period_s;
    }
    scenario
}

pub(crate) fn document_zlg_0001_at_rest() -> Scenario {
    let scenario = reversed(quick(presets::zeeman_rest(31), 15.0), 4.0, 0.0);
    simulated(&document("ZLG-0001.toml"), 5, &scenario)
}

pub(crate) fn document_zlg_0001_swinging() -> Scenario {
    let scenario = reversed(quick(presets::zeeman_sine(32), 12.0), 1.5, 0.7);
    simulated(&document("ZLG-0001.toml"), 1, &scenario)
}

pub(crate) fn document_fog_0001() -> Scenario {
    let scenario = presets::fibre_optic_chamber(33, presets::training_profile());
    simulated(&document("FOG-0001.toml"), 10, &quick(scenario, 25.0))
}

pub(crate) fn document_mems_0001() -> Scenario {
    simulated(&document("MEMS-0001.toml"), 8, &quick(presets::mems_chamber(34), 25.0))
}

/// The same instrument with ticks of uneven length.
pub(crate) fn document_mems_0001_uneven_ticks() -> Scenario {
    let scenario = Simulated { tick_jitter_ns: 2_000_000, ..quick(presets::mems_chamber(35), 8.0) };
    simulated(&document("MEMS-0001.toml"), 3, &scenario)
}

pub(crate) fn preset_skewed_six_of_which_one_fails() -> Scenario {
    let failure =
        Failure { sensor: FailingSensor::Gyro(3), at_s: 6.0, fault: Fault::RateJump { rad_per_s: 0.2 } };
    let scenario = quick(presets::skewed_six(36, Some(failure)), 12.0);
    let mut parts = identity();
    let rows = &scenario.instrument.gyro_orientation.rows;
    let mut watched = orientation(rows);
    (watched.parity_limit, watched.parity_confirm_ticks) = (Some(0.03), 20);
    parts.gyros = vec![parts.gyros[0].clone(); rows.len()];
    parts.accels = vec![parts.accels[0].clone(); rows.len()];
    parts.accel_orientation = Some(orientation(rows));
    parts.gyro_orientation = watched;
    simulated(&compile(&parts), 4, &scenario)
}

pub(crate) fn document_example_full() -> Scenario {
    let mut script = Script::new(37, &full(), &FULL_CHANNELS);
    (script.switches, script.meander, script.swing) = (200, 150, 400.0);
    (script.batch, script.warming) = (10, 2e-3);
    script.ticks(2500);
    told(script)
}

pub(crate) fn document_chamber_mems() -> Scenario {
    let mut script = Script::new(38, &document("chamber-mems.toml"), &[("imu", 31.0)]);
    (script.batch, script.warming, script.swing) = (2, 0.05, 20.0);
    script.ticks(1200);
    told(script)
}

pub(crate) fn document_rlg_static() -> Scenario {
    let mut script = Script::new(39, &document("rlg-static.toml"), &[]);
    (script.batch, script.thermometers) = (6, false);
    script.ticks(600);
    told(script)
}
