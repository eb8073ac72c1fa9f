//! What sensors do with the unit's motion: simulated as physics, taken out by the terms of a document.

use isotherm_correction::sample::SensorFlags;
use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{
    Argument, Auxiliary, AxesHysteresis, Curve, Document, Regressor, Shape, StatedTerm,
};
use isotherm_simulator::Scenario;
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::effects::{AccelerometerEffects, AxesPlay, Effects, GyroEffects, Play, Supply};
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::motion::{Motion, Path};
use isotherm_simulator::noise::GyroNoise;
use isotherm_simulator::presets::mems_chamber;
use isotherm_tests::simulated::{Size, run};

use crate::{compile, parsed};

const G: f64 = 9.806_65;
const FORCES: [Feature; 3] = [Feature::ForceX, Feature::ForceY, Feature::ForceZ];
const DEG_PER_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;
/// Tumbling: every axis feels gravity from both sides.
const TUMBLE: Path = Path::ConstantRate { axis: [1.0, 2.0, -0.5], rate_deg_per_s: 40.0 };

/// MEMS-0001 without noise, on a path, while the chamber warms from 20 °C by 2 °C/min.
fn scenario(path: Path, effects: Effects) -> Scenario {
    let mut scenario = mems_chamber(41);
    scenario.chamber = Profile::constant(20.0).ramp(40.0, 2.0);
    scenario.motion = Motion { heading_deg: 30.0, ..Motion::rest(55.75) }.along(path);
    scenario.duration_s = 120.0;
    if let Gyros::Mems(gyros) = &mut scenario.instrument.gyros {
        for gyro in gyros {
            gyro.noise = GyroNoise::default();
        }
    }
    let accelerometers = scenario.instrument.accelerometers.iter_mut().flat_map(|all| &mut all.sensors);
    accelerometers.for_each(|sensor| sensor.velocity_random_walk_m_per_s_per_sqrt_s = 0.0);
    scenario.instrument.effects = effects;
    scenario
}

/// Root mean square error of the rate (°/h) and of the specific force (mg), of single ticks after the filters have settled, worst axis.
fn errors(document: &Document, scenario: &Scenario) -> (f64, f64) {
    let mut errors = [const { Vec::new() }; 6];
    let mut ticks = 0;
    run(&compile(document), scenario, |step, tick| {
        ticks += 1;
        if ticks < 2000 {
            return;
        }
        let duration_s = tick.duration.as_s();
        for axis in 0..3 {
            let angle = tick.delta_angle[axis] - step.truth.delta_angle[axis];
            let velocity = tick.delta_velocity[axis] - step.truth.delta_velocity[axis];
            errors[axis].push(angle / duration_s / DEG_PER_H);
            errors[3 + axis].push(velocity / duration_s / G * 1e3);
        }
    })
    .unwrap();
    let worst = |errors: &[Vec<f64>]| {
        errors.iter().map(|errors| Size::of(errors.iter().copied()).rms).fold(0.0, f64::max)
    };
    (worst(&errors[..3]), worst(&errors[3..]))
}

fn document() -> Document {
    parsed("MEMS-0001.toml").document
}

fn constant(value: f64) -> Shape {
    Shape::Constant { value }
}

fn over_rate(shape: Shape) -> Curve {
    Curve::new(shape).over(Argument::DegPerS)
}

/// The error that an effect makes, and what is left of it with the terms that `state` puts into the document; both beside an instrument
/// without the effect.
fn judged(
    scenario: &Scenario,
    state: impl Fn(&mut Document),
    error: impl Fn(&Document, &Scenario) -> f64,
) -> [f64; 3] {
    let mut without_effect = scenario.clone();
    without_effect.instrument.effects = Effects::default();
    let plain = document();
    let mut with_term = document();
    state(&mut with_term);
    let found = [error(&plain, &without_effect), error(&plain, scenario), error(&with_term, scenario)];
    println!("without the effect {:.4}, with it {:.4}, with its term {:.4}", found[0], found[1], found[2]);
    found
}

#[test]
fn drift_with_acceleration_is_removed_over_temperature() {
    let coefficients = [[12.0, -7.0, 4.0], [3.0, 15.0, -6.0], [-8.0, 2.0, 9.0]];
    let per_k = [0.05, -0.02, 0.03];
    let gyros = coefficients.map(|row| GyroEffects {
        acceleration_rad_per_s_per_m_per_s2: row.map(|c| c * DEG_PER_H / G),
        acceleration_per_k: per_k.map(|c| c * DEG_PER_H / G),
        reference_deg_c: 25.0,
        ..GyroEffects::default()
    });
    let scenario =
        scenario(TUMBLE, Effects { gyros: gyros.to_vec(), accelerometers: Vec::new(), ..Effects::default() });
    let [floor, with, left] = judged(
        &scenario,
        |document| {
            for (sensor, row) in document.gyro.sensor.iter_mut().zip(coefficients) {
                for (axis, feature) in FORCES.into_iter().enumerate() {
                    let coefficients = vec![row[axis], per_k[axis]];
                    let range = [-40.0, 80.0];
                    sensor
                        .set(feature, Curve::new(Shape::Polynomial { reference: 25.0, coefficients, range }));
                }
            }
        },
        |document, scenario| errors(document, scenario).0,
    );
    assert!(with > 5.0 && left < floor + 0.01 * with, "{with} {left} {floor}");
}

#[test]
fn a_scale_that_depends_on_the_rate_is_removed() {
    let (asymmetry, curvature) = (150e-6, 40e-6);
    let gyros = [1.0, -1.0, 0.5].map(|sense| GyroEffects {
        scale_asymmetry: asymmetry * sense,
        scale_curvature_s2_per_rad2: curvature * sense,
        ..GyroEffects::default()
    });
    let sine = Path::Sine { axis: [1.0, -0.8, 0.6], amplitude_deg: 30.0, frequency_hz: 0.5, phase_deg: 0.0 };
    let scenario =
        scenario(sine, Effects { gyros: gyros.to_vec(), accelerometers: Vec::new(), ..Effects::default() });
    let [floor, with, left] = judged(
        &scenario,
        |document| {
            for (sensor, sense) in document.gyro.sensor.iter_mut().zip([1.0, -1.0, 0.5]) {
                // The gyro senses 1 + a of a positive rate: its weight is less there.
                sensor.set(Feature::RateMagnitude, Curve::new(constant(-asymmetry * sense * 1e6)));
                let knot = |step: i32| {
                    let deg_per_s = f64::from(step) * 10.0;
                    let rate = deg_per_s.to_radians();
                    [deg_per_s, (1.0 / (1.0 + curvature * sense * rate * rate) - 1.0) * 1e6]
                };
                let knots = (-12..=12).map(knot).collect();
                sensor.increment_weight_over_rate = Some(over_rate(Shape::Spline { knots }));
            }
        },
        |document, scenario| errors(document, scenario).0,
    );
    assert!(with > 20.0 && left < floor + 0.01 * with, "{with} {left} {floor}");
}

#[test]
fn a_rate_outside_its_curve_is_flagged_as_such() {
    let mut document = document();
    for sensor in &mut document.gyro.sensor {
        let knots = vec![[-10.0, 5.0], [10.0, 5.0]];
        sensor.increment_weight_over_rate = Some(over_rate(Shape::PiecewiseLinear { knots }));
    }
    for (rate_deg_per_s, outside) in [(5.0, false), (40.0, true)] {
        let path = Path::ConstantRate { axis: [1.0, 1.0, -1.0], rate_deg_per_s };
        let scenario = Scenario { duration_s: 5.0, ..scenario(path, Effects::default()) };
        run(&compile(&document), &scenario, |_, tick| {
            for flags in &tick.gyro_flags {
                assert_eq!(
                    flags.contains(SensorFlags::CLAMPED_RATE),
                    outside,
                    "{rate_deg_per_s} °/s: {flags:?}"
                );
                assert!(
                    flags.contains(SensorFlags::VALID) && !flags.contains(SensorFlags::CLAMPED_TEMPERATURE)
                );
            }
        })
        .unwrap();
    }
}

#[test]
fn what_accelerometers_feel_for_sitting_elsewhere_is_removed() {
    let positions = [[0.03, 0.0, -0.01], [-0.01, 0.025, 0.0], [0.0, -0.02, 0.03]];
    let accelerometers =
        positions.map(|position_m| AccelerometerEffects { position_m, ..AccelerometerEffects::default() });
    let sine = Path::Sine { axis: [1.0, -0.8, 0.6], amplitude_deg: 10.0, frequency_hz: 1.0, phase_deg: 0.0 };
    let effects =
        Effects { gyros: Vec::new(), accelerometers: accelerometers.to_vec(), ..Effects::default() };
    let scenario = scenario(sine, effects);
    let [floor, with, left] = judged(
        &scenario,
        |document| {
            let sensors = document.accel.as_mut().unwrap().sensor.iter_mut();
            sensors.zip(positions).for_each(|(sensor, position_m)| sensor.position_m = Some(position_m));
        },
        |document, scenario| errors(document, scenario).1,
    );
    // The acceleration is that of a parabola through three ticks: at 100 ticks a turn it is off by some (2π/100)²/3.
    assert!(with > 5.0 && left < floor + 0.01 * with, "{with} {left} {floor}");
}

#[test]
fn a_square_in_the_force_is_removed() {
    let second_order = [40.0, -25.0, 60.0];
    let accelerometers = second_order.map(|micro_g_per_g2| AccelerometerEffects {
        second_order_s2_per_m: micro_g_per_g2 * 1e-6 / G,
        ..AccelerometerEffects::default()
    });
    let vibration = Path::Sculling {
        axis: [0.0, 1.0, 0.0],
        amplitude_deg: 0.5,
        frequency_hz: 1.0,
        vibration_axis: [1.0, -1.0, 1.0],
        vibration_m_per_s2: 40.0,
        vibration_phase_deg: 20.0,
    };
    let effects =
        Effects { gyros: Vec::new(), accelerometers: accelerometers.to_vec(), ..Effects::default() };
    let scenario = scenario(vibration, effects);
    let [floor, with, left] = judged(
        &scenario,
        |document| {
            let sensors = document.accel.as_mut().unwrap().sensor.iter_mut();
            for (sensor, value) in sensors.zip(second_order) {
                sensor.set(Feature::ForceSquared, Curve::new(constant(value)));
            }
        },
        |document, scenario| errors(document, scenario).1,
    );
    assert!(with > 0.2 && left < floor + 0.01 * with, "{with} {left} {floor}");
}

/// Up and down through a loop, slowly beside the thermometers' filter.
fn thermal_loop(path: Path, effects: Effects) -> Scenario {
    let chamber = Profile::constant(20.0).hold(2.0).ramp(50.0, 2.0).ramp(20.0, 2.0).ramp(45.0, 2.0);
    let scenario = scenario(path, effects);
    Scenario { duration_s: chamber.duration_s(), chamber, tick_ns: 100_000_000, ..scenario }
}

#[test]
fn hysteresis_of_biases_is_removed() {
    // One play of the instrument is two of half its gain for the document: plays add up.
    let (gyro_per_k, accel_per_k) = ([6.0, -4.0, 8.0], [0.3, -0.2, 0.4]);
    let play = |half_width_k, per_k| Some(Play { half_width_k, per_k });
    let gyros = gyro_per_k.map(|g| GyroEffects { play: play(3.0, g * DEG_PER_H), ..GyroEffects::default() });
    let accelerometers = accel_per_k
        .map(|g| AccelerometerEffects { play: play(2.0, g * 1e-3 * G), ..AccelerometerEffects::default() });
    let effects =
        Effects { gyros: gyros.to_vec(), accelerometers: accelerometers.to_vec(), ..Effects::default() };
    let scenario = thermal_loop(TUMBLE, effects);
    let state = |document: &mut Document| {
        for (sensor, g) in document.gyro.sensor.iter_mut().zip(gyro_per_k) {
            let halved = StatedTerm::with_parameter(Feature::Play, 3.0, Curve::new(constant(0.5 * g)));
            for play in [halved.clone(), halved] {
                sensor.put(play);
            }
        }
        for (sensor, g) in document.accel.as_mut().unwrap().sensor.iter_mut().zip(accel_per_k) {
            // The simulated error is a force, the document's an output.
            let scale = sensor.scale_factor.shape().at(25.0).unwrap();
            let gain = Curve::new(constant(g * 1e-3 * G * scale));
            sensor.put(StatedTerm::with_parameter(Feature::Play, 2.0, gain));
        }
    };
    let [floor, with, left] = judged(&scenario, state, |document, scenario| errors(document, scenario).0);
    assert!(with > 10.0 && left < floor + 0.03 * with, "°/h: {with} {left} {floor}");
    let [floor, with, left] = judged(&scenario, state, |document, scenario| errors(document, scenario).1);
    assert!(with > 0.3 && left < floor + 0.03 * with, "mg: {with} {left} {floor}");
}

#[test]
fn hysteresis_of_the_axes_is_removed() {
    let play = Some(AxesPlay { half_width_k: 4.0, share: 0.6 });
    let mut scenario =
        thermal_loop(TUMBLE, Effects { gyro_axes: play, accelerometer_axes: play, ..Effects::default() });
    // Mounts that turn by some 10″/K.
    let turn = |rows: &mut Vec<[f64; 3]>| rows.iter_mut().flatten().for_each(|slope| *slope *= 200.0);
    turn(&mut scenario.instrument.gyro_orientation.rows_per_k);
    turn(&mut scenario.instrument.accelerometers.as_mut().unwrap().orientation.rows_per_k);
    let judged = |error: fn((f64, f64)) -> f64| {
        let mut without_effect = scenario.clone();
        without_effect.instrument.effects = Effects::default();
        let mut plain = document();
        turn(&mut plain.gyro.orientation.thermal.as_mut().unwrap().slopes_arcsec_per_deg_c);
        let accel = plain.accel.as_mut().unwrap();
        turn(&mut accel.orientation.thermal.as_mut().unwrap().slopes_arcsec_per_deg_c);
        let mut with_term = plain.clone();
        let hysteresis = vec![AxesHysteresis { half_width_deg_c: 4.0, share_ratio: 0.6 }];
        with_term.gyro.orientation.thermal.as_mut().unwrap().hysteresis = hysteresis.clone();
        with_term.accel.as_mut().unwrap().orientation.thermal.as_mut().unwrap().hysteresis = hysteresis;
        [(&plain, &without_effect), (&plain, &scenario), (&with_term, &scenario)]
            .map(|(document, scenario)| error(errors(document, scenario)))
    };
    let [floor, with, left] = judged(|errors| errors.0);
    assert!(with > 1.0 && left < floor + 0.03 * with, "°/h: {with} {left} {floor}");
    let [floor, with, left] = judged(|errors| errors.1);
    assert!(with > 0.03 && left < floor + 0.03 * with, "mg: {with} {left} {floor}");
}

/// A gradient from the housing to a channel, and the supply about 5 V.
fn regressors(channel: String) -> [Regressor; 2] {
    [
        Regressor { channel, minus: Some("housing".into()), reference: 0.0 },
        Regressor { channel: "supply".into(), minus: None, reference: 5.0 },
    ]
}

#[test]
fn what_goes_with_a_gradient_and_with_the_supply_is_removed() {
    let (by_gradient, by_supply) = ([3.0, -2.0, 4.0], [25.0, -30.0, 18.0]);
    let gyros = [0, 1, 2].map(|i: usize| GyroEffects {
        gradient_rad_per_s_per_k: by_gradient[i] * DEG_PER_H,
        supply_rad_per_s_per_v: by_supply[i] * DEG_PER_H,
        ..GyroEffects::default()
    });
    let accelerometers = [0, 1, 2].map(|i: usize| AccelerometerEffects {
        gradient_m_per_s2_per_k: 0.05 * by_gradient[i] * 1e-3 * G,
        supply_m_per_s2_per_v: 0.05 * by_supply[i] * 1e-3 * G,
        ..AccelerometerEffects::default()
    });
    let supply = Supply { channel: "supply".into(), nominal_v: 5.0, swing_v: 0.4, period_s: 700.0 };
    let effects = Effects {
        gyros: gyros.to_vec(),
        accelerometers: accelerometers.to_vec(),
        supply: Some(supply),
        ..Effects::default()
    };
    let scenario = thermal_loop(TUMBLE, effects);
    let state = |document: &mut Document| {
        let (name, unit) = ("supply".to_owned(), "V".to_owned());
        let conversion = vec![0.0, 1.0];
        document.auxiliary = vec![Auxiliary { name, unit, conversion, range: [3.0, 7.0], spike_limit: 0.5 }];
        for (i, sensor) in document.gyro.sensor.iter_mut().enumerate() {
            let [gradient, supply] = regressors(format!("gyro{i}"));
            sensor.put(StatedTerm::regressor(gradient, Curve::new(constant(by_gradient[i]))));
            sensor.put(StatedTerm::regressor(supply, Curve::new(constant(by_supply[i]))));
        }
        for (i, sensor) in document.accel.as_mut().unwrap().sensor.iter_mut().enumerate() {
            let scale = sensor.scale_factor.shape().at(25.0).unwrap();
            let gain = |milli_g: f64| Curve::new(constant(0.05 * milli_g * 1e-3 * G * scale));
            let [gradient, supply] = regressors(format!("accel{i}"));
            sensor.put(StatedTerm::regressor(gradient, gain(by_gradient[i])));
            sensor.put(StatedTerm::regressor(supply, gain(by_supply[i])));
        }
    };
    let [floor, with, left] = judged(&scenario, state, |document, scenario| errors(document, scenario).0);
    assert!(with > 10.0 && left < floor + 0.03 * with, "°/h: {with} {left} {floor}");
    let [floor, with, left] = judged(&scenario, state, |document, scenario| errors(document, scenario).1);
    assert!(with > 0.5 && left < floor + 0.03 * with, "mg: {with} {left} {floor}");
}

#[test]
fn what_goes_with_a_gradient_is_removed_by_the_rate_of_one_thermometer() {
    let by_gradient = [1.5, -1.0, 2.0];
    let accelerometers = by_gradient.map(|milli_g| AccelerometerEffects {
        gradient_m_per_s2_per_k: milli_g * 1e-3 * G,
        ..AccelerometerEffects::default()
    });
    let effects = Effects { accelerometers: accelerometers.to_vec(), ..Effects::default() };
    let chamber = Profile::constant(20.0).hold(10.0).ramp(60.0, 1.0).ramp(20.0, 1.0);
    let mut scenario = scenario(TUMBLE, effects);
    scenario = Scenario { duration_s: chamber.duration_s(), chamber, tick_ns: 100_000_000, ..scenario };
    let node = scenario.instrument.accelerometers.as_ref().unwrap().sensors[0].node;
    let state = |document: &mut Document| {
        for (sensor, milli_g) in document.accel.as_mut().unwrap().sensor.iter_mut().zip(by_gradient) {
            let per_k = milli_g * 1e-3 * G * sensor.scale_factor.shape().at(25.0).unwrap();
            // It is warmer than the housing by its own heat, and behind it by its time constant.
            let warmer = sensor.terms.curve(Feature::One).unwrap().plus(per_k * node.heating_deg_c);
            sensor.set(Feature::One, warmer);
            sensor.set(Feature::ThermalRate, Curve::new(constant(-per_k * node.time_constant_s)));
        }
    };
    let [floor, with, left] = judged(&scenario, state, |document, scenario| errors(document, scenario).1);
    assert!(with > 1.0 && left < floor + 0.03 * with, "mg: {with} {left} {floor}");
}

/// Angle and velocity of a tick.
type Increments = [[f64; 3]; 2];

/// Every tick's increments of a simulated unit, after the filters have settled.
fn increments(document: &Document, scenario: &Scenario) -> Vec<Increments> {
    let mut ticks = Vec::new();
    run(&compile(document), scenario, |_, tick| ticks.push([tick.delta_angle, tick.delta_velocity])).unwrap();
    ticks.split_off(2000)
}

#[test]
fn delays_of_sensors_against_one_another_are_removed() {
    let delays_ticks = ([0.2, 0.55, 0.0], [0.7, 0.1, 0.35]);
    let late = |gyros: [f64; 3], accels: [f64; 3]| {
        let gyro = |delay_ticks| GyroEffects { delay_ticks, ..GyroEffects::default() };
        let accel = |delay_ticks| AccelerometerEffects { delay_ticks, ..AccelerometerEffects::default() };
        let (gyros, accelerometers) = (gyros.map(gyro).to_vec(), accels.map(accel).to_vec());
        Effects { gyros, accelerometers, ..Effects::default() }
    };
    let shaken = Path::Sculling {
        axis: [1.0, -0.8, 0.6],
        amplitude_deg: 10.0,
        frequency_hz: 1.0,
        vibration_axis: [1.0, -1.0, 1.0],
        vibration_m_per_s2: 5.0,
        vibration_phase_deg: 20.0,
    };
    let apart = scenario(shaken, late(delays_ticks.0, delays_ticks.1));
    let mut together = apart.clone();
    together.instrument.effects = late([0.7; 3], [0.7; 3]);

    let mut stated = document();
    let accels = &mut stated.accel.as_mut().unwrap().sensor;
    accels.iter_mut().zip(delays_ticks.1).for_each(|(sensor, ticks)| sensor.delay_ticks = Some(ticks));
    let gyros = stated.gyro.sensor.iter_mut().zip(delays_ticks.0);
    gyros.for_each(|(sensor, ticks)| sensor.delay_ticks = Some(ticks));
    let [right, raw, held] =
        [(&document(), &together), (&document(), &apart), (&stated, &apart)].map(|(d, s)| increments(d, s));
    for (part, what) in ["angle (µrad)", "velocity (µm/s)"].into_iter().enumerate() {
        let off = |ticks: &[Increments]| {
            let pairs = ticks.iter().zip(&right);
            let errors = |axis: usize| {
                pairs.clone().map(move |(tick, right)| (tick[part][axis] - right[part][axis]) * 1e6)
            };
            (0..3).map(|axis| Size::of(errors(axis)).rms).fold(0.0, f64::max)
        };
        let (with, left) = (off(&raw), off(&held));
        println!("{what}: as it stands {with:.3}, held back {left:.3}");
        assert!(with > 100.0 && left < 0.01 * with, "{what}: {with} {left}");
    }
}
