use super::*;
use crate::chamber::Profile;
use crate::failure::{FailingSensor, Failure, Fault};
use crate::instrument::Gyros;
use crate::scenario::Scenario;
use crate::simulation::Simulation;
use crate::vector::{norm, plus, scale};

fn all() -> Vec<Scenario> {
    let failure = Failure { sensor: FailingSensor::Gyro(2), at_s: 100.0, fault: Fault::Stuck };
    vec![
        zeeman_rest(1),
        zeeman_sine(1),
        fibre_optic_chamber(1, training_profile()),
        fibre_optic_chamber(1, judging_profile()),
        fibre_optic_chamber(1, paper_profile()),
        mems_chamber(1),
        skewed_six(1, None),
        skewed_six(1, Some(failure)),
    ]
}

#[test]
fn every_preset_is_valid_and_runs() {
    for scenario in all() {
        assert_eq!(scenario.check(), Vec::new(), "{}", scenario.unit);
        let steps: Vec<_> = Simulation::new(&scenario).unwrap().take(300).collect();
        assert_eq!(steps.len(), 300);
        for step in steps {
            assert!(step.gyro.readings.iter().all(|reading| reading.is_finite()));
            assert!(step.accel.unwrap().readings.iter().all(|reading| reading.is_finite()));
        }
    }
}

#[test]
fn every_preset_survives_a_scenario_file() {
    for scenario in all() {
        let text = toml::to_string(&scenario).unwrap();
        assert_eq!(toml::from_str::<Scenario>(&text).unwrap(), scenario, "{text}");
    }
    let unknown = toml::to_string(&zeeman_rest(1)).unwrap().replace("gravity_m_per_s2", "gravity");
    assert!(toml::from_str::<Scenario>(&unknown).is_err());
}

#[test]
fn temperature_changes_the_length_of_a_row_by_less_than_1e_9() {
    for scenario in all() {
        let instrument = scenario.instrument;
        for axes in [instrument.gyro_orientation, instrument.accelerometers.unwrap().orientation] {
            for away_k in [-45.0, 90.0].map(|deg_c| deg_c - axes.reference_deg_c) {
                for (row, per_k) in axes.rows.iter().zip(&axes.rows_per_k) {
                    assert!((norm(plus(*row, scale(*per_k, away_k))) - 1.0).abs() < 1e-9, "{axes:?}");
                }
            }
        }
    }
}

/// Largest Shupe drift of the first gyro (°/h) without static bias, at 1 s ticks.
fn largest_shupe_deg_per_h(profile: Profile, after_s: f64) -> f64 {
    let mut scenario = fibre_optic_chamber(1, profile);
    scenario.tick_ns = 1_000_000_000;
    if let Gyros::FibreOptic(gyros) = &mut scenario.instrument.gyros {
        for gyro in gyros {
            gyro.bias = crate::fibre_optic::OpticsBias::default();
        }
    }
    let drifts = Simulation::new(&scenario).unwrap().filter_map(|step| {
        let time_s = step.gyro.end_time.seconds_from(isotherm_correction::units::Timestamp::from_ns(0));
        (time_s > after_s).then_some(step.truth.gyro_drift_rad_per_s[0])
    });
    drifts.fold(0.0_f64, |largest, drift| largest.max(drift.abs())).to_degrees() * 3600.0
}

#[test]
fn the_fibre_gyros_drift_lives_on_changes_of_temperature() {
    assert!(largest_shupe_deg_per_h(Profile::constant(35.0).hold(60.0), 0.0) < 1e-9);
    let settled = Profile::constant(20.0).ramp(50.0, 1.0).hold(300.0);
    assert!(largest_shupe_deg_per_h(settled, 30.0 * 60.0 + 4.5 * 3600.0) < 1e-5);
    let ramp = largest_shupe_deg_per_h(training_profile(), 0.0);
    assert!((0.4..3.0).contains(&ramp), "{ramp} °/h at 1 °C/min");
}
