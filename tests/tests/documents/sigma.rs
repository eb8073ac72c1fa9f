//! σ of the outputs: (output − truth)/σ has the χ² of what it says it is, in every kind of tick.

use isotherm_correction::sample::{CorrectedTick, SensorFlags, TickFlags};
use isotherm_correction::sigma::Causes;
use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{
    AccelBiasSigma, AccelSigma, Curve, Document, GyroBiasSigma, GyroSensor, GyroSigma, Shape,
};
use isotherm_simulator::Scenario;
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::failure::{FailingSensor, Failure, Fault};
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::motion::{Motion, Path};
use isotherm_simulator::noise::GyroNoise;
use isotherm_simulator::presets::{mems_chamber, skewed_six, zeeman_sine};
use isotherm_tests::dice::Dice;
use isotherm_tests::simulated::run;

use crate::{compile, parsed};

const TUMBLE: Path = Path::ConstantRate { axis: [1.0, 2.0, -0.5], rate_deg_per_s: 40.0 };
const DEG_PER_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;
const ARCSEC: f64 = DEG_PER_H;

/// Squares of errors by their σ.
#[derive(Default)]
struct Squares {
    sum: f64,
    count: f64,
}

impl Squares {
    fn add(&mut self, errors: [f64; 3], of: &Causes) {
        for (error, variance) in errors.into_iter().zip(of.variance()) {
            self.sum += error * error / variance;
            self.count += 1.0;
        }
    }

    /// Inside of the bounds that χ² keeps to 95 times in 100.
    #[track_caller]
    fn judge(&self, what: &str) {
        let Self { sum, count } = self;
        let bound = 1.96 * (2.0 / count).sqrt();
        println!("{what}: χ²/n = {:.3}, bounds 1 ± {bound:.3}, n = {count}", sum / count);
        assert!(*count >= 90.0 && (sum / count - 1.0).abs() < bound, "{what}: {}", sum / count);
    }
}

fn error(out: [f64; 3], truth: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| out[axis] - truth[axis])
}

/// A standard normal number, near enough: the sum of twelve even ones.
fn normal(dice: &mut Dice) -> f64 {
    (0..12).map(|_| 0.5 * dice.between_minus_one_and_one()).sum()
}

fn gyro_sigma() -> GyroSigma {
    GyroSigma {
        angle_random_walk_deg_per_sqrt_h: Some(0.15),
        bias: Some(GyroBiasSigma {
            reference_deg_c: 25.0,
            sigma_deg_per_h: vec![0.0],
            correlation_ratio: Vec::new(),
        }),
        increment_weight_ppm: Some(0.0),
        misalignment_arcsec: Some(0.0),
        clamping_deg_per_h_per_deg_c: Some(0.0),
        ..GyroSigma::default()
    }
}

fn accel_sigma(walk_m_per_s_per_sqrt_s: f64) -> AccelSigma {
    AccelSigma {
        velocity_random_walk_m_per_s_per_sqrt_h: Some(walk_m_per_s_per_sqrt_s * 60.0),
        bias: Some(AccelBiasSigma {
            reference_deg_c: 25.0,
            sigma_m_per_s2: vec![0.0],
            correlation_ratio: Vec::new(),
        }),
        scale_factor_ppm: Some(0.0),
        misalignment_arcsec: Some(0.0),
        ..AccelSigma::default()
    }
}

/// MEMS-0001, moved and at one temperature, with nothing but white noise.
fn mems(seed: u64, deg_c: f64, duration_s: f64) -> Scenario {
    let mut scenario = mems_chamber(seed);
    scenario.chamber = Profile::constant(deg_c);
    scenario.motion = Motion { heading_deg: 30.0, ..Motion::rest(55.75) }.along(TUMBLE);
    Scenario { duration_s, ..scenario }
}

fn silence(scenario: &mut Scenario) {
    if let Gyros::Mems(gyros) = &mut scenario.instrument.gyros {
        for gyro in gyros {
            gyro.noise = GyroNoise::default();
        }
    }
    let sensors = scenario.instrument.accelerometers.iter_mut().flat_map(|all| &mut all.sensors);
    sensors.for_each(|sensor| sensor.velocity_random_walk_m_per_s_per_sqrt_s = 0.0);
    scenario.instrument.thermometers.channels.iter_mut().for_each(|channel| channel.noise_deg_c = 0.0);
}

fn settled(tick: &CorrectedTick) -> bool {
    !tick.flags.contains(TickFlags::WARM_UP)
}

#[test]
fn plain_ticks_scatter_as_sigma_says() {
    let mut document = parsed("MEMS-0001.toml").document;
    let scenario = mems(7, 25.0, 60.0);
    let walk = scenario.instrument.accelerometers.as_ref().unwrap().sensors[0]
        .velocity_random_walk_m_per_s_per_sqrt_s;
    document.gyro.sensor.iter_mut().for_each(|gyro| gyro.sigma = Some(gyro_sigma()));
    let accels = document.accel.as_mut().unwrap().sensor.iter_mut();
    accels.for_each(|accel| accel.sigma = Some(accel_sigma(walk)));
    let (mut angle, mut velocity) = (Squares::default(), Squares::default());
    run(&compile(&document), &scenario, |step, tick| {
        let sigma = tick.sigma.as_deref().unwrap();
        assert_eq!(settled(tick), sigma.angle.calibration.iter().all(|sigma| !sigma.is_nan()));
        if settled(tick) {
            assert_eq!(sigma.angle.restoration.map(f64::to_bits), [0; 3]);
            angle.add(error(tick.delta_angle, step.truth.delta_angle), &sigma.angle);
            velocity.add(error(tick.delta_velocity, step.truth.delta_velocity), &sigma.velocity);
        }
    })
    .unwrap();
    angle.judge("angle of plain ticks");
    velocity.judge("velocity of plain ticks");
}

/// ZLG-0001 on a swinging stand, one switch a second, with white noise only or with counts.
fn switching(walk_deg_per_sqrt_h: f64, quantised: bool) -> (Document, Scenario) {
    let mut document = parsed("ZLG-0001.toml").document;
    for gyro in &mut document.gyro.sensor {
        gyro.sigma = Some(GyroSigma {
            angle_random_walk_deg_per_sqrt_h: Some(walk_deg_per_sqrt_h),
            // That of a count, where nothing is stated.
            quantisation_arcsec: (!quantised).then_some(0.0),
            ..gyro_sigma()
        });
    }
    let mut scenario = zeeman_sine(3);
    scenario.duration_s = 400.0;
    scenario.chamber = Profile::constant(20.0);
    // At no rate for long, so that counts are rounded by anything.
    let swing =
        Path::Sine { axis: [1.0, 1.0, -1.0], amplitude_deg: 4.0, frequency_hz: 0.9137, phase_deg: 0.0 };
    scenario.motion = Motion { heading_deg: 30.0, ..Motion::rest(55.75) }.along(swing);
    if let Gyros::Zeeman(zeeman) = &mut scenario.instrument.gyros {
        (zeeman.reversal.period_s, zeeman.quantised) = (1.0, quantised);
        for gyro in &mut zeeman.gyros {
            gyro.noise.angle_random_walk_rad_per_sqrt_s = walk_deg_per_sqrt_h * DEG_PER_H * 60.0;
        }
    }
    (document, scenario)
}

#[test]
fn ticks_over_a_mode_switch_scatter_as_sigma_says() {
    let (document, scenario) = switching(1.0, false);
    let mut kinds: [(&str, TickFlags, Squares); 4] = [
        ("plain ticks", TickFlags::empty(), Squares::default()),
        ("interpolated ticks", TickFlags::INTERPOLATED, Squares::default()),
        ("restored ticks", TickFlags::ANGLE_RESTORED, Squares::default()),
        ("servo transients", TickFlags::SERVO_TRANSIENT, Squares::default()),
    ];
    let seen = TickFlags::INTERPOLATED | TickFlags::ANGLE_RESTORED | TickFlags::SERVO_TRANSIENT;
    let mut lost_before = false;
    run(&compile(&document), &scenario, |step, tick| {
        let found = tick.flags & seen;
        let found = if found.contains(TickFlags::ANGLE_RESTORED) { TickFlags::ANGLE_RESTORED } else { found };
        let lost = found.contains(TickFlags::INTERPOLATED);
        // The ticks of one switch are predicted from the same readings: the first stands for them.
        let counts = settled(tick) && !(lost && lost_before);
        lost_before = lost;
        if let Some((_, _, squares)) = kinds.iter_mut().find(|(_, flags, _)| counts && *flags == found) {
            let sigma = tick.sigma.as_deref().unwrap();
            squares.add(error(tick.delta_angle, step.truth.delta_angle), &sigma.angle);
        }
    })
    .unwrap();
    for (what, _, squares) in &kinds {
        squares.judge(what);
    }
}

#[test]
fn counts_scatter_as_sigma_says() {
    let (document, scenario) = switching(0.002, true);
    let mut squares = Squares::default();
    run(&compile(&document), &scenario, |step, tick| {
        let plain = settled(tick) && (tick.flags & !TickFlags::GAP).is_empty();
        // Neighbours share what their readings were rounded by.
        if plain && tick.sequence.is_multiple_of(8) {
            let sigma = tick.sigma.as_deref().unwrap();
            squares.add(error(tick.delta_angle, step.truth.delta_angle), &sigma.angle);
        }
    })
    .unwrap();
    squares.judge("counts");
}

#[test]
fn six_gyros_of_which_one_says_nothing_scatter_as_sigma_says() {
    let failure = Failure { sensor: FailingSensor::Gyro(2), at_s: 30.0, fault: Fault::NotFinite };
    let mut scenario = Scenario { duration_s: 60.0, ..skewed_six(5, Some(failure)) };
    scenario.instrument.accelerometers = None;
    scenario.instrument.thermometers.channels.clear();
    scenario.instrument.gyro_orientation.rows_per_k.clear();
    if let Gyros::Mems(gyros) = &mut scenario.instrument.gyros {
        for gyro in gyros {
            (gyro.scale, gyro.scale_per_k, gyro.bias_rad_per_s) = (1.0, [0.0; 2], [0.0; 4]);
        }
    }
    let mut document = parsed("MEMS-0001.toml").document;
    document.accel = None;
    document.gyro.orientation.thermal = None;
    document.gyro.orientation.rows.clone_from(&scenario.instrument.gyro_orientation.rows);
    document.temperature.channel.clear();
    document.temperature.filter = None;
    let bare = |lane: usize| GyroSensor {
        increment_weight_rad_per_rad: Some(1.0),
        sigma: Some(gyro_sigma()),
        ..GyroSensor::bare(&lane.to_string())
    };
    document.gyro.sensor = (0..6).map(bare).collect();
    let (mut six, mut five) = (Squares::default(), Squares::default());
    let mut noise = [[0.0; 3]; 2];
    run(&compile(&document), &scenario, |step, tick| {
        let sigma = tick.sigma.as_deref().unwrap();
        let substituted = tick.gyro_flags[2].contains(SensorFlags::NOT_FINITE);
        let squares = if substituted { &mut five } else { &mut six };
        squares.add(error(tick.delta_angle, step.truth.delta_angle), &sigma.angle);
        noise[usize::from(substituted)] = sigma.angle.noise;
    })
    .unwrap();
    six.judge("six gyros");
    five.judge("five gyros");
    assert!(noise[1].iter().sum::<f64>() > noise[0].iter().sum::<f64>(), "{noise:?}");
}

#[test]
fn errors_of_the_calibration_scatter_as_sigma_says() {
    let mut dice = Dice::new(12);
    let (mut angle, mut velocity) = (Squares::default(), Squares::default());
    let correlation = vec![vec![1.0, -0.6], vec![-0.6, 1.0]];
    let mut scenario = mems(1, 35.0, 25.0);
    scenario.tick_ns = 50_000_000;
    silence(&mut scenario);
    for _ in 0..60 {
        let mut document = parsed("MEMS-0001.toml").document;
        for gyro in &mut document.gyro.sensor {
            let bias = GyroBiasSigma {
                reference_deg_c: 25.0,
                sigma_deg_per_h: vec![8.0, 1.0],
                correlation_ratio: correlation.clone(),
            };
            gyro.sigma = Some(GyroSigma {
                angle_random_walk_deg_per_sqrt_h: Some(0.0),
                bias: Some(bias),
                increment_weight_ppm: Some(200.0),
                misalignment_arcsec: Some(40.0),
                ..gyro_sigma()
            });
            let (a, b) = (normal(&mut dice), normal(&mut dice));
            let errors = [8.0 * a, -0.6 * a + 0.8 * b];
            let bias = gyro.terms.curve(Feature::One).unwrap().shape().clone();
            let Shape::Polynomial { reference, mut coefficients, range } = bias else { panic!("{bias:?}") };
            assert!((reference - 25.0).abs() < 1e-9);
            coefficients.iter_mut().zip(errors).for_each(|(c, error)| *c += error);
            gyro.set(Feature::One, Curve::new(Shape::Polynomial { reference, coefficients, range }));
            let weight = gyro.increment_weight_rad_per_rad.as_mut().unwrap();
            *weight *= 1.0 + 200e-6 * normal(&mut dice);
        }
        turn(&mut document.gyro.orientation.rows, 40.0 * ARCSEC, &mut dice);
        let accel = document.accel.as_mut().unwrap();
        for sensor in &mut accel.sensor {
            let scale = sensor.scale_factor.shape().at(35.0).unwrap();
            sensor.sigma = Some(AccelSigma {
                velocity_random_walk_m_per_s_per_sqrt_h: Some(0.0),
                bias: Some(AccelBiasSigma {
                    reference_deg_c: 25.0,
                    sigma_m_per_s2: vec![3e-3],
                    correlation_ratio: Vec::new(),
                }),
                misalignment_arcsec: Some(40.0),
                ..accel_sigma(0.0)
            });
            let shape = sensor.terms.curve(Feature::One).unwrap().shape().clone();
            let Shape::Polynomial { reference, mut coefficients, range } = shape else { panic!("{shape:?}") };
            coefficients[0] += 3e-3 * scale * normal(&mut dice);
            sensor.set(Feature::One, Curve::new(Shape::Polynomial { reference, coefficients, range }));
        }
        turn(&mut accel.orientation.rows, 40.0 * ARCSEC, &mut dice);
        let mut last = None;
        run(&compile(&document), &scenario, |step, tick| last = Some((step.clone(), tick.clone()))).unwrap();
        let (step, tick) = last.unwrap();
        let sigma = tick.sigma.as_deref().unwrap();
        assert_eq!((sigma.angle.noise, sigma.angle.clamping), ([0.0; 3], [0.0; 3]));
        angle.add(error(tick.delta_angle, step.truth.delta_angle), &sigma.angle);
        velocity.add(error(tick.delta_velocity, step.truth.delta_velocity), &sigma.velocity);
    }
    angle.judge("angle by its calibration");
    velocity.judge("velocity by its calibration");
}

/// Turns each row about both axes across it, by a normal angle (rad).
fn turn(rows: &mut [[f64; 3]], sigma: f64, dice: &mut Dice) {
    for row in rows {
        // The rows are along the case axes but for minutes of arc.
        let along = (0..3).find(|axis| row[*axis].abs() > 0.9).unwrap();
        for axis in (0..3).filter(|axis| *axis != along) {
            row[axis] += sigma * normal(dice);
        }
    }
}

#[test]
fn clamped_temperatures_scatter_as_sigma_says() {
    let mut dice = Dice::new(4);
    let mut angle = Squares::default();
    let mut scenario = mems(1, 40.0, 25.0);
    scenario.tick_ns = 50_000_000;
    silence(&mut scenario);
    for _ in 0..60 {
        let mut document = parsed("MEMS-0001.toml").document;
        let mut instrument = scenario.clone();
        let Gyros::Mems(gyros) = &mut instrument.instrument.gyros else { panic!("a MEMS unit") };
        for (gyro, sensor) in gyros.iter_mut().zip(&mut document.gyro.sensor) {
            // What the bias does beyond 30 °C, nobody has seen: here it goes on with any slope.
            let slope = 5.0 * normal(&mut dice);
            gyro.bias_rad_per_s = [0.0; 4];
            gyro.bias_rad_per_s[1] = slope * DEG_PER_H;
            gyro.reference_deg_c = 30.0;
            (gyro.scale, gyro.scale_per_k) = (1.0, [0.0; 2]);
            sensor.set(Feature::Reading, None);
            sensor.increment_weight_rad_per_rad = Some(1.0);
            let range = [20.0, 30.0];
            let bias = Shape::Polynomial { reference: 30.0, coefficients: vec![0.0, slope], range };
            sensor.set(Feature::One, Curve::new(bias));
            sensor.sigma = Some(GyroSigma {
                angle_random_walk_deg_per_sqrt_h: Some(0.0),
                clamping_deg_per_h_per_deg_c: Some(5.0),
                ..gyro_sigma()
            });
        }
        let mut last = None;
        run(&compile(&document), &instrument, |step, tick| last = Some((step.clone(), tick.clone())))
            .unwrap();
        let (step, tick) = last.unwrap();
        assert!(tick.gyro_flags[0].contains(SensorFlags::CLAMPED_TEMPERATURE));
        angle.add(error(tick.delta_angle, step.truth.delta_angle), &tick.sigma.as_deref().unwrap().angle);
    }
    angle.judge("angle at clamped temperatures");
}

#[test]
fn what_is_not_stated_is_unknown_and_without_the_table_nothing_is_said() {
    let scenario = mems(2, 25.0, 25.0);
    let last = |document: &Document| {
        let mut last = None;
        run(&compile(document), &scenario, |_, tick| last = Some(tick.clone())).unwrap();
        last.unwrap().sigma
    };
    let mut document = parsed("MEMS-0001.toml").document;
    assert_eq!(last(&document), None);
    document.gyro.sensor[0].sigma = Some(GyroSigma::default());
    let sigma = *last(&document).unwrap();
    for cause in [sigma.angle.noise, sigma.angle.calibration, sigma.velocity.noise] {
        assert!(cause.iter().all(|sigma| sigma.is_nan()), "{sigma:?}");
    }
    // That nothing was bridged or clamped is known.
    assert_eq!((sigma.angle.restoration, sigma.angle.clamping), ([0.0; 3], [0.0; 3]));
    document.gyro.sensor.iter_mut().for_each(|gyro| gyro.sigma = Some(gyro_sigma()));
    assert!(last(&document).unwrap().angle.noise.iter().all(|sigma| *sigma > 0.0));
}

#[test]
fn no_increment_depends_on_it() {
    let (mut document, mut scenario) = switching(1.0, true);
    scenario.duration_s = 30.0;
    let told = |document: &Document| {
        let mut ticks = Vec::new();
        run(&compile(document), &scenario, |_, tick| ticks.push(tick.clone())).unwrap();
        ticks
    };
    let with = told(&document);
    document.gyro.sensor.iter_mut().for_each(|gyro| gyro.sigma = None);
    let without: Vec<_> = with.iter().map(|tick| CorrectedTick { sigma: None, ..tick.clone() }).collect();
    assert!(with.iter().all(|tick| tick.sigma.is_some()));
    assert!(told(&document) == without, "an output differs without its σ");
}
