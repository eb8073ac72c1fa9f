use super::*;
use crate::chamber::Profile;
use crate::failure::{Failure, Fault};
use crate::instrument::Gyros;
use crate::motion::{EARTH_RATE_RAD_PER_S, Motion};
use crate::presets::{
    fibre_optic_chamber, mems_chamber, skewed_six, training_profile, zeeman_rest, zeeman_sine,
};

fn bits(scenario: &Scenario) -> Vec<u64> {
    let mut bits = Vec::new();
    for step in Simulation::new(scenario).unwrap().take(3000) {
        bits.extend(step.gyro.readings.iter().chain(&step.accel.unwrap().readings).map(|x| x.to_bits()));
        bits.extend(step.temperatures.iter().map(|reading| reading.raw.to_bits()));
    }
    bits
}

#[test]
fn one_seed_gives_the_same_bits_and_another_seed_others() {
    let presets = [zeeman_sine, mems_chamber, |seed| fibre_optic_chamber(seed, training_profile())];
    for preset in presets {
        assert_eq!(bits(&preset(9)), bits(&preset(9)));
        assert_ne!(bits(&preset(9)), bits(&preset(10)));
    }
}

/// A scenario without drift, noise and misalignment.
fn ideal() -> Scenario {
    let mut scenario = mems_chamber(1);
    scenario.motion = Motion::rest(50.0);
    scenario.instrument.gyro_orientation = Orientation::orthogonal();
    if let Gyros::Mems(gyros) = &mut scenario.instrument.gyros {
        for gyro in gyros {
            (gyro.scale, gyro.scale_per_k, gyro.bias_rad_per_s) = (1.0, [0.0; 2], [0.0; 4]);
            gyro.noise = crate::noise::GyroNoise::default();
        }
    }
    scenario
}

#[test]
fn an_ideal_unit_at_rest_reads_the_rate_of_the_earth() {
    let latitude = 50.0_f64.to_radians();
    let earth = [libm::cos(latitude), 0.0, -libm::sin(latitude)].map(|share| share * EARTH_RATE_RAD_PER_S);
    for step in Simulation::new(&ideal()).unwrap().take(500) {
        for (reading, expected) in step.gyro.readings.iter().zip(earth) {
            assert!((reading - expected).abs() < 1e-18);
        }
    }
}

/// The way back from readings to input by the documented parameters, once per kind of counter.
#[test]
fn counts_and_documented_parameters_give_the_truth_back() {
    let mut scenario = zeeman_sine(3);
    scenario.duration_s = 400.0;
    let Gyros::Zeeman(unit) = &mut scenario.instrument.gyros else { panic!("a Zeeman unit") };
    unit.quantised = false;
    unit.gyros.iter_mut().for_each(|gyro| gyro.noise = crate::noise::GyroNoise::default());
    let unit = unit.clone();
    let orientation = scenario.instrument.gyro_orientation.clone();
    for step in Simulation::new(&scenario).unwrap() {
        let truth = &step.truth;
        let input = orientation.project(truth.delta_angle, truth.housing_deg_c);
        for (index, gyro) in unit.gyros.iter().enumerate() {
            let away_k = truth.gyro_deg_c[index] - gyro.reference_deg_c;
            let [first, second] = gyro.scale_per_k;
            let scale = gyro.scale_rad_per_count * (1.0 + first * away_k + second * away_k * away_k);
            let rate = truth.gyro_drift_rad_per_s[index] + truth.gyro_transient_rad_per_s[index];
            let angle = scale * step.gyro.readings[index] - rate * step.gyro.duration.as_s();
            assert!(truth.lost || (angle - input[index]).abs() < 1e-14, "{}", angle - input[index]);
        }
    }
}

#[test]
fn the_quartz_accelerometers_follow_their_documented_formula() {
    let mut scenario = zeeman_sine(3);
    scenario.duration_s = 300.0;
    let block = scenario.instrument.accelerometers.as_mut().unwrap();
    block.sensors.iter_mut().for_each(|sensor| sensor.velocity_random_walk_m_per_s_per_sqrt_s = 0.0);
    let block = block.clone();
    let mut accumulated = [0.0_f64; 3];
    for step in Simulation::new(&scenario).unwrap() {
        let truth = &step.truth;
        let velocity = block.orientation.project(truth.delta_velocity, truth.housing_deg_c);
        for (index, sensor) in block.sensors.iter().enumerate() {
            let at = |c: [f64; 3], deg_c: f64| {
                let away_k = deg_c - sensor.reference_deg_c;
                c[0] + c[1] * away_k + c[2] * away_k * away_k
            };
            let deg_c = truth.accel_deg_c[index];
            let scale = at(sensor.scale_v_per_m_per_s2, deg_c) / at(sensor.board_ratio, truth.board_deg_c);
            let volts = scale * velocity[index] / step.gyro.duration.as_s() + at(sensor.bias_v, deg_c);
            let readings = &step.accel.as_ref().unwrap().readings;
            accumulated[index] += readings[index] - volts * 5.0e5 * step.gyro.duration.as_s();
            assert!(accumulated[index].abs() < 1.0 + 1e-6, "{accumulated:?}");
        }
    }
}

#[test]
fn mode_commands_and_modes_agree() {
    let mut mode = None;
    let mut commands = 0;
    for step in Simulation::new(&zeeman_rest(1)).unwrap().take(80_000) {
        assert_eq!(step.gyro.switch_command, mode.is_some_and(|last| Some(last) != step.gyro.mode));
        commands += usize::from(step.gyro.switch_command);
        mode = step.gyro.mode;
    }
    assert_eq!(commands, 3, "400 s with a switch every 120 s");
}

#[test]
fn jittered_ticks_stay_contiguous_and_keep_the_truth() {
    let jittered = Scenario { tick_jitter_ns: 1_000_000, duration_s: 60.0, ..skewed_six(1, None) };
    let mut end = Timestamp::from_ns(jittered.start_ns);
    let mut turned = [0.0; 3];
    for step in Simulation::new(&jittered).unwrap() {
        assert_eq!(end + step.gyro.duration, step.gyro.end_time);
        assert!((8_000_000..=12_000_000).contains(&step.gyro.duration.as_ns()));
        end = step.gyro.end_time;
        turned = crate::vector::plus(turned, step.truth.delta_angle);
    }
    let whole = Trajectory::new(&jittered.motion);
    let length_s = end.seconds_from(Timestamp::from_ns(0));
    let mut expected = [0.0; 3];
    for part in 0..6000_u32 {
        let part_s = length_s / 6000.0;
        expected =
            crate::vector::plus(expected, whole.increments((f64::from(part) + 0.5) * part_s, part_s).angle);
    }
    for axis in 0..3 {
        assert!((turned[axis] - expected[axis]).abs() < 1e-11, "{}", turned[axis] - expected[axis]);
    }
}

#[test]
fn a_failing_sensor_fails_when_and_as_it_should() {
    let sensor = FailingSensor::Gyro(1);
    let run = |fault| {
        let failure = Failure { sensor, at_s: 1.0, fault };
        Simulation::new(&skewed_six(1, Some(failure))).unwrap().take(200).collect::<Vec<_>>()
    };
    let sound: Vec<_> = Simulation::new(&skewed_six(1, None)).unwrap().take(200).collect();
    let (stuck, jump) = (run(Fault::Stuck), run(Fault::RateJump { rad_per_s: 0.01 }));
    let missing = run(Fault::NotFinite);
    for tick in 0..200 {
        let (good, failed) = (&sound[tick].gyro.readings, tick >= 100);
        assert_eq!(sound[tick].truth, jump[tick].truth);
        assert_eq!(stuck[tick].gyro.readings[0].to_bits(), good[0].to_bits());
        let expected = if failed { sound[99].gyro.readings[1] } else { good[1] };
        assert_eq!(stuck[tick].gyro.readings[1].to_bits(), expected.to_bits());
        let jumped = jump[tick].gyro.readings[1] - good[1];
        assert!((jumped - if failed { 0.01 } else { 0.0 }).abs() < 1e-4);
        assert_eq!(missing[tick].gyro.readings[1].is_nan(), failed);
    }
}

#[test]
fn thermometers_read_once_a_period_from_the_start_on() {
    let mut scenario = ideal();
    scenario.duration_s = 10.0;
    scenario.chamber = Profile::constant(20.0).ramp(30.0, 60.0);
    scenario.instrument.thermometers.channels =
        vec![crate::temperature::Channel::exact("air", Place::Chamber)];
    let readings: Vec<_> = Simulation::new(&scenario).unwrap().flat_map(|step| step.temperatures).collect();
    assert_eq!(readings.len(), 11);
    for (second, reading) in readings.iter().enumerate() {
        assert_eq!(reading.time.as_ns(), i64::try_from(second).unwrap() * 1_000_000_000);
        assert!((reading.raw - reading.time.seconds_from(Timestamp::from_ns(0)) - 20.0).abs() < 1e-9);
    }
}
