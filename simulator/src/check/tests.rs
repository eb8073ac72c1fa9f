use super::*;
use crate::chamber::Segment;
use crate::presets::{fibre_optic_chamber, mems_chamber, training_profile, zeeman_rest};
use crate::simulation::Simulation;
use crate::temperature::Channel;

#[test]
fn all_errors_are_told_at_once() {
    let mut scenario = mems_chamber(1);
    scenario.tick_ns = 0;
    scenario.motion.latitude_deg = f64::NAN;
    scenario.instrument.gyro_orientation.rows[1] = [2.0, 0.0, 0.0];
    scenario.instrument.thermometers.channels.push(Channel::exact("housing", Place::Gyro(7)));
    scenario.failures.push(Failure {
        sensor: FailingSensor::Accelerometer(0),
        at_s: 1.0,
        fault: Fault::RateJump { rad_per_s: 1.0 },
    });
    let errors = scenario.check();
    let keys: Vec<_> = errors.iter().map(|error| error.key.as_str()).collect();
    let last =
        format!("instrument.thermometers.channels[{}]", scenario.instrument.thermometers.channels.len() - 1);
    for key in [
        "tick_ns",
        "motion.latitude_deg",
        "instrument.gyro_orientation.rows[1]",
        &format!("{last}.name"),
        &format!("{last}.place"),
        "failures[0].fault",
    ] {
        assert!(keys.contains(&key), "{key}: {keys:?}");
    }
    insta::assert_snapshot!(Simulation::new(&scenario).unwrap_err());
}

/// One broken thing at a time, and each is told.
#[test]
fn each_broken_key_is_told() {
    type Break = fn(&mut Scenario);
    let cases: [(&str, Break); 8] = [
        ("no sensors", |s| s.instrument.gyros = Gyros::Mems(Vec::new())),
        ("plane", |s| s.instrument.gyro_orientation.rows[2] = [0.6, 0.8, 0.0]),
        ("thermal step", |s| s.instrument.thermal_step_s = 0.0),
        ("ramp", |s| s.chamber.segments.push(Segment::Ramp { to_deg_c: 0.0, rate_deg_c_per_min: -1.0 })),
        ("axis", |s| s.motion.path = Path::ConstantRate { axis: [0.0; 3], rate_deg_per_s: 1.0 }),
        ("period", |s| s.instrument.thermometers.period_s = 0.0),
        ("infinite", |s| s.duration_s = f64::INFINITY),
        ("name", |s| s.instrument.thermometers.channels[0].name = "x".repeat(25)),
    ];
    let bases = [mems_chamber(1), zeeman_rest(1), fibre_optic_chamber(1, training_profile())];
    for base in bases {
        for (name, break_it) in &cases {
            let mut scenario = base.clone();
            break_it(&mut scenario);
            assert!(!scenario.check().is_empty(), "{name}");
            assert!(Simulation::new(&scenario).is_err(), "{name}");
        }
    }
}
