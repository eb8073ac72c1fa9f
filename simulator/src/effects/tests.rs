use super::*;
use crate::chamber::Profile;
use crate::instrument::Gyros;
use crate::motion::{Motion, Path};
use crate::orientation::Orientation;
use crate::presets::{mems_chamber, zeeman_rest};
use crate::scenario::Scenario;
use crate::simulation::Simulation;
use crate::truth::Step;

const G: f64 = 9.8;

/// A unit whose readings are what it senses: no drift, noise or misalignment of its own.
fn plain(motion: Motion) -> Scenario {
    let mut scenario = mems_chamber(1);
    scenario.motion = Motion { earth_rate_rad_per_s: 0.0, gravity_m_per_s2: G, ..motion };
    let instrument = &mut scenario.instrument;
    instrument.gyro_orientation = Orientation::orthogonal();
    if let Gyros::Mems(gyros) = &mut instrument.gyros {
        for gyro in gyros {
            (gyro.scale, gyro.scale_per_k, gyro.bias_rad_per_s) = (1.0, [0.0; 2], [0.0; 4]);
            (gyro.noise, gyro.resolution_rad_per_s) = (crate::noise::GyroNoise::default(), 0.0);
        }
    }
    let block = instrument.accelerometers.as_mut().unwrap();
    block.orientation = Orientation::orthogonal();
    block.output = crate::accelerometer::AccelerometerOutput::Mean;
    for sensor in &mut block.sensors {
        (sensor.scale_v_per_m_per_s2, sensor.bias_v) = ([1.0, 0.0, 0.0], [0.0; 3]);
        sensor.board_ratio = [1.0, 0.0, 0.0];
        sensor.velocity_random_walk_m_per_s_per_sqrt_s = 0.0;
    }
    scenario
}

fn with_gyros(mut scenario: Scenario, effects: &[GyroEffects; 3]) -> Vec<Step> {
    scenario.instrument.effects.gyros = effects.to_vec();
    Simulation::new(&scenario).unwrap().take(400).collect()
}

fn with_accelerometers(mut scenario: Scenario, effects: AccelerometerEffects) -> Vec<Step> {
    scenario.instrument.effects.accelerometers = vec![effects; 3];
    Simulation::new(&scenario).unwrap().take(400).collect()
}

fn turning(axis: [f64; 3], rate_deg_per_s: f64) -> Motion {
    Motion::rest(0.0).along(Path::ConstantRate { axis, rate_deg_per_s })
}

/// Mean specific force of a step (m/s²).
fn force(step: &Step) -> [f64; 3] {
    step.truth.delta_velocity.map(|v| v / step.gyro.duration.as_s())
}

/// Mean over the steps of what an accelerometer reads beside the truth (m/s²).
fn mean_excess(steps: &[Step], sensor: usize) -> f64 {
    let excess = |step: &Step| step.accel.as_ref().unwrap().readings[sensor] - force(step)[sensor];
    steps.iter().map(excess).sum::<f64>() / f64::from(u32::try_from(steps.len()).unwrap())
}

#[test]
fn a_drift_follows_the_specific_force_and_changes_sign_when_the_unit_is_turned_over() {
    let effects =
        GyroEffects { acceleration_rad_per_s_per_m_per_s2: [0.0, 0.0, 2e-6], ..GyroEffects::default() };
    for (roll_deg, force) in [(0.0, -G), (180.0, G), (90.0, 0.0)] {
        let scenario = plain(Motion { roll_deg, ..Motion::rest(0.0) });
        for step in with_gyros(scenario, &[effects, GyroEffects::default(), GyroEffects::default()]) {
            assert!((step.gyro.readings[0] - 2e-6 * force).abs() < 1e-15, "{roll_deg}");
            assert!((step.truth.gyro_drift_rad_per_s[0] - 2e-6 * force).abs() < 1e-15);
            assert!(step.gyro.readings[1].abs() < 1e-15);
        }
    }
    // With temperature, that of the gyro itself.
    let warmer = GyroEffects { acceleration_per_k: [0.0, 0.0, 1e-7], reference_deg_c: 20.0, ..effects };
    for step in with_gyros(plain(Motion::rest(0.0)), &[warmer; 3]) {
        let expected = -G * (2e-6 + 1e-7 * (step.truth.gyro_deg_c[1] - 20.0));
        assert!((step.gyro.readings[1] - expected).abs() < 1e-12);
    }
}

#[test]
fn a_dithered_gyro_drifts_with_the_force_like_any_other() {
    let mut scenario = zeeman_rest(3);
    let Gyros::Zeeman(unit) = &mut scenario.instrument.gyros else { panic!("a Zeeman unit") };
    unit.quantised = false;
    let plain: Vec<Step> = Simulation::new(&scenario).unwrap().take(100).collect();
    let Gyros::Zeeman(unit) = &scenario.instrument.gyros else { panic!("a Zeeman unit") };
    let k = unit.gyros.iter().map(|gyro| gyro.scale_rad_per_count).collect::<Vec<_>>();
    let steps = with_gyros(
        scenario,
        &[GyroEffects { acceleration_rad_per_s_per_m_per_s2: [0.0, 0.0, 1e-6], ..GyroEffects::default() }; 3],
    );
    for (with, without) in steps.iter().zip(&plain) {
        for (gyro, k) in k.iter().enumerate() {
            let more = with.gyro.readings[gyro] - without.gyro.readings[gyro];
            let expected = 1e-6 * with.truth.delta_velocity[2] / k;
            assert!((more / expected - 1.0).abs() < 1e-3, "{more}, {expected}");
        }
    }
}

#[test]
fn a_scale_differs_by_direction_and_bends_with_the_rate() {
    let rate = |deg_per_s: f64| deg_per_s.to_radians();
    for deg_per_s in [-100.0, -20.0, 20.0, 100.0] {
        let asymmetric = GyroEffects { scale_asymmetry: 5e-6, ..GyroEffects::default() };
        let bent = GyroEffects { scale_curvature_s2_per_rad2: 4e-6, ..GyroEffects::default() };
        let both = [asymmetric, bent, GyroEffects::default()];
        let motion = turning([1.0, 1.0, 0.0], deg_per_s * 2.0_f64.sqrt());
        let step = &with_gyros(plain(motion), &both)[10];
        let ratio = |gyro: usize| step.gyro.readings[gyro] / rate(deg_per_s) - 1.0;
        assert!((ratio(0) - 5e-6 * deg_per_s.signum()).abs() < 1e-12, "{deg_per_s}: {}", ratio(0));
        assert!((ratio(1) - 4e-6 * rate(deg_per_s) * rate(deg_per_s)).abs() < 1e-12, "{}", ratio(1));
    }
}

#[test]
fn an_accelerometer_away_from_the_centre_feels_it_turn() {
    // 3 cm at 100 °/s: ω²·r towards the axis, 9.3 mg.
    let away = AccelerometerEffects { position_m: [0.03, 0.0, 0.0], ..AccelerometerEffects::default() };
    let steps = with_accelerometers(plain(turning([0.0, 0.0, 1.0], 100.0)), away);
    let omega = 100.0_f64.to_radians();
    assert!((mean_excess(&steps, 0) + omega * omega * 0.03).abs() < 1e-8);
    assert!((omega * omega * 0.03 / 9.806_65 - 9.3e-3).abs() < 1e-4);
    // Of a swing the tangential part: ω̇·r, which sums to nothing over whole ticks but the change of the rate.
    let path = Path::Sine { axis: [0.0, 0.0, 1.0], amplitude_deg: 2.0, frequency_hz: 1.0, phase_deg: 0.0 };
    let steps = with_accelerometers(plain(Motion::rest(0.0).along(path)), away);
    let mut tangential = 0.0;
    for step in &steps {
        let seconds = step.gyro.duration.as_s();
        tangential += (step.accel.as_ref().unwrap().readings[1] - force(step)[1]) * seconds;
        let end = step.gyro.end_time.as_ns();
        #[expect(clippy::cast_precision_loss, reason = "a few seconds")]
        let rate = |ns: i64| {
            let turn = 2.0 * core::f64::consts::PI;
            2.0_f64.to_radians() * turn * libm::cos(turn * ns as f64 * 1e-9)
        };
        assert!((tangential - 0.03 * (rate(end) - rate(0))).abs() < 1e-8, "{tangential}");
    }
}

#[test]
fn vibration_is_rectified_by_a_square() {
    // 15 µg/g² under a sine of 5 g amplitude across gravity: ½·K2·B² on average.
    let second_order_s2_per_m = 15e-6 / 9.806_65;
    let amplitude = 5.0 * 9.806_65;
    let path = Path::Sculling {
        axis: [0.0, 0.0, 1.0],
        amplitude_deg: 0.0,
        frequency_hz: 100.0,
        vibration_axis: [1.0, 0.0, 0.0],
        vibration_m_per_s2: amplitude,
        vibration_phase_deg: 0.0,
    };
    let scenario = plain(Motion::rest(0.0).along(path));
    let steps = with_accelerometers(
        scenario,
        AccelerometerEffects { second_order_s2_per_m, ..AccelerometerEffects::default() },
    );
    let expected = 0.5 * second_order_s2_per_m * amplitude * amplitude;
    let got = mean_excess(&steps, 0);
    assert!((got / expected - 1.0).abs() < 1e-3, "{got}, {expected}");
    assert!((mean_excess(&steps, 2) - second_order_s2_per_m * G * G).abs() < 1e-9);
}

#[test]
fn what_has_play_is_elsewhere_on_the_way_up_than_on_the_way_down() {
    let play = Play { half_width_k: 4.0, per_k: 1e-7 };
    let mut state = PlayState::default();
    let way = |from: i32, to: i32| {
        let steps: Vec<i32> = if from < to { (from..=to).collect() } else { (to..=from).rev().collect() };
        steps.into_iter().map(f64::from)
    };
    let mut error_at_40 = Vec::new();
    for deg_c in way(20, 60).chain(way(60, 20)).chain(way(20, 60)) {
        state.step(Some(play), deg_c);
        assert!(state.error.to.abs() <= 4.0 * 1e-7 + 1e-20);
        if (deg_c - 40.0).abs() < 0.5 {
            error_at_40.push(state.error.to);
        }
    }
    for (error, expected) in error_at_40.iter().zip([-4e-7, 4e-7, -4e-7]) {
        assert!((error - expected).abs() < 1e-20, "{error_at_40:?}");
    }
    // A small way back stays within the slack: the error follows temperature, the play does not.
    for (deg_c, expected) in [(58.0, -2e-7), (56.0, 0.0), (52.0, 4e-7), (50.0, 4e-7)] {
        state.step(Some(play), deg_c);
        assert!((state.error.to - expected).abs() < 1e-20, "{deg_c}");
    }
    // In the unit it adds to the drift, and to an accelerometer's force.
    let mut scenario = plain(Motion::rest(0.0));
    scenario.chamber = Profile::constant(20.0).ramp(60.0, 2.0).ramp(20.0, 2.0);
    scenario.duration_s = scenario.chamber.duration_s();
    scenario.tick_ns = 1_000_000_000;
    scenario.instrument.effects.gyros = vec![GyroEffects { play: Some(play), ..GyroEffects::default() }; 3];
    scenario.instrument.effects.accelerometers =
        vec![AccelerometerEffects { play: Some(play), ..AccelerometerEffects::default() }; 3];
    let steps: Vec<Step> = Simulation::new(&scenario).unwrap().collect();
    let [mut up, mut down] = [0.0_f64; 2];
    for step in &steps {
        up = up.min(step.gyro.readings[0]);
        down = down.max(step.gyro.readings[0]);
        assert!((step.truth.gyro_drift_rad_per_s[0] - step.gyro.readings[0]).abs() < 1e-18);
    }
    assert!((up + 4e-7).abs() < 1e-15 && (down - 4e-7).abs() < 1e-15, "{up}, {down}");
    let last = steps.last().unwrap();
    assert!((last.accel.as_ref().unwrap().readings[0] - 4e-7).abs() < 1e-12);
}

#[test]
fn a_list_of_another_length_is_refused_and_no_effect_changes_nothing() {
    let mut scenario = zeeman_rest(5);
    let before: Vec<Step> = Simulation::new(&scenario).unwrap().take(500).collect();
    scenario.instrument.effects = Effects {
        gyros: vec![GyroEffects::default(); 3],
        accelerometers: vec![AccelerometerEffects::default(); 3],
        ..Effects::default()
    };
    let after: Vec<Step> = Simulation::new(&scenario).unwrap().take(500).collect();
    assert!(before == after, "effects of nothing");
    scenario.instrument.effects.gyros.pop();
    assert_eq!(Simulation::new(&scenario).unwrap_err().0.len(), 1);
    scenario.instrument.effects = Effects::default();
    scenario.instrument.effects.gyros =
        vec![
            GyroEffects { play: Some(Play { half_width_k: 0.0, per_k: f64::NAN }), ..GyroEffects::default() };
            3
        ];
    assert_eq!(Simulation::new(&scenario).unwrap_err().0.len(), 6);
}
