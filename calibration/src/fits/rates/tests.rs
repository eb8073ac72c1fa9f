//! Simulated rate-table runs through the whole procedure.

mod over_temperature;

use isotherm_cli::Exit;
use isotherm_correction::earth::Place;
use isotherm_correction::thermal::Feature;
use isotherm_log::offline::unit_id;
use isotherm_log::text::LogEvent;
use isotherm_protocol::document::{Document, GyroOutput, GyroSensor, Temperature, Trend};
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::motion::Path;
use isotherm_simulator::presets::mems_chamber;
use isotherm_simulator::{Scenario, Simulation};

use super::fit::{Made, Wanted, make};
use super::steps::{Step, listed};
use crate::document::{constant, plain};
use crate::error::Error;
use crate::finding::{Finding, Kind};
use crate::fixture;
use crate::runs::Run;

/// Rates of the table (°/s): whole turns in ten seconds, so that every step begins as the run did.
const RATES: [f64; 6] = [36.0, -36.0, 72.0, -72.0, 144.0, -144.0];
const STEP_S: f64 = 10.0;

/// The unit in a chamber of this temperature, with a tenth of its noise.
fn quiet(seed: u64, deg_c: f64) -> Scenario {
    let mut scenario =
        Scenario { chamber: Profile::constant(deg_c), duration_s: STEP_S, ..mems_chamber(seed) };
    scenario.instrument.thermal_step_s = 1.0;
    if let Gyros::Mems(gyros) = &mut scenario.instrument.gyros {
        for gyro in gyros {
            gyro.noise.angle_random_walk_rad_per_sqrt_s *= 0.1;
        }
    }
    scenario
}

/// Its gyros alone.
fn scenario(seed: u64) -> Scenario {
    let mut scenario = quiet(seed, 25.0);
    scenario.instrument.accelerometers = None;
    scenario.instrument.thermometers.channels.clear();
    scenario
}

/// A run: rest, then each rate, with a rest between them; `distort` changes the readings.
fn run(seed: u64, axis: [f64; 3], distort: impl Fn(f64) -> f64) -> Run {
    run_of("table", (seed, axis), scenario, distort)
}

/// The same of any scenario that a seed makes, with the readings of its thermometers.
fn run_of(
    name: &str,
    (seed, axis): (u64, [f64; 3]),
    of_seed: impl Fn(u64) -> Scenario,
    distort: impl Fn(f64) -> f64,
) -> Run {
    let mut events = Vec::new();
    let mut offset = 0_u64;
    let rests = RATES.iter().flat_map(|rate| [0.0, *rate]);
    for (number, rate) in rests.enumerate() {
        let mut scenario = of_seed(seed.wrapping_mul(1000) + u64::try_from(number).unwrap());
        scenario.start_ns = i64::try_from(number).unwrap() * 10_000_000_000;
        if rate != 0.0 {
            scenario.motion.path = Path::ConstantRate { axis, rate_deg_per_s: rate };
        }
        let mut ticks = 0;
        for mut event in fixture::events(&scenario) {
            match &mut event {
                LogEvent::Temperature(reading) if number == 0 || reading.time.as_ns() > scenario.start_ns => {
                }
                LogEvent::Temperature(_) | LogEvent::Accel { .. } => continue,
                LogEvent::Gyro { tick, .. } => {
                    tick.sequence += offset;
                    tick.readings.iter_mut().for_each(|reading| *reading = distort(*reading));
                    ticks += 1;
                }
            }
            events.push(event);
        }
        offset += ticks;
    }
    Run::of_events(name.to_owned(), unit_id("MEMS-0001").unwrap(), events)
}

const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn base() -> Document {
    let temperature = Temperature { assumed_deg_c: 20.0, filter: None, channel: Vec::new() };
    plain("MEMS-0001", GyroOutput::Mean, temperature, None)
}

fn place() -> Vec<Place> {
    vec![Place::new(55.75, 30.0, Some([0.0, 0.0])).unwrap()]
}

fn steps(runs: usize) -> Vec<Step> {
    listed(&["x", "y", "z"].map(str::to_owned)[..runs], [&RATES, &[]], [runs, 0]).unwrap()
}

fn made(runs: &[Run], steps: &[Step], place: &[Place]) -> Result<Made, Error> {
    made_from(&base(), runs, steps, place)
}

fn made_from(base: &Document, runs: &[Run], steps: &[Step], place: &[Place]) -> Result<Made, Error> {
    make(&wanted(base, runs, steps, place))
}

fn wanted<'a>(base: &'a Document, runs: &'a [Run], steps: &'a [Step], place: &'a [Place]) -> Wanted<'a> {
    Wanted { runs, judge: &[], steps, scale_known: true, base, place, table_ppm: 0.0, with_bias: false }
}

/// Three runs, one about each axis.
fn table(seed: u64) -> [Run; 3] {
    let of = |axis: usize| run(3 * seed + u64::try_from(axis).unwrap(), AXES[axis], |reading| reading);
    [of(0), of(1), of(2)]
}

#[test]
fn scale_axes_and_bias_are_recovered_within_what_is_stated() {
    let mut errors: Vec<f64> = Vec::new();
    let mut beyond = 0;
    for seed in 0..20 {
        let runs = table(seed);
        let made = made(&runs, &steps(3), &place()).unwrap();
        let scenario = scenario(0);
        let Gyros::Mems(gyros) = &scenario.instrument.gyros else { panic!() };
        let temperatures = Simulation::new(&scenario).unwrap().next().unwrap().truth;
        for (sensor, gyro) in gyros.iter().enumerate() {
            let found = made.gyros[sensor].as_ref().unwrap();
            let away = temperatures.gyro_deg_c[sensor] - gyro.reference_deg_c;
            let scale = gyro.scale * (1.0 + gyro.scale_per_k[0] * away + gyro.scale_per_k[1] * away * away);
            let mut of = vec![(1.0 / found.gain[0] - scale) / (found.gain[1] * scale)];
            let axes = &scenario.instrument.gyro_orientation;
            let warmer = temperatures.housing_deg_c - axes.reference_deg_c;
            for element in (0..3).filter(|element| *element != sensor) {
                let truth = axes.rows[sensor][element] + warmer * axes.rows_per_k[sensor][element];
                of.push((found.axis.unwrap()[element] - truth) / found.axis_sigma[element]);
            }
            let drift = temperatures.gyro_drift_rad_per_s[sensor];
            of.push((found.bias[0] - crate::fits::modes::model::deg_per_h(drift)) / found.bias[1]);
            let [asymmetry, sigma] = found.asymmetry.unwrap();
            of.push(asymmetry / sigma);
            beyond += of.iter().filter(|error| error.abs() > 3.0).count();
            errors.extend(of);
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "few")]
    let rms = (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
    println!("{beyond} of {} beyond three standard errors, rms {rms:.3}", errors.len());
    assert!(beyond * 100 <= errors.len() && (0.7..1.15).contains(&rms), "{beyond} {rms}");
}

#[test]
fn the_written_document_takes_the_errors_away_the_asymmetry_too() {
    // Two parts in ten thousand more with positive input: the asymmetry.
    let distort = |reading: f64| if reading > 0.0 { reading * 1.0002 } else { reading };
    let runs = [0, 1, 2].map(|axis: usize| run(700 + u64::try_from(axis).unwrap(), AXES[axis], distort));
    let made = made(&runs, &steps(3), &place()).unwrap();
    for found in made.gyros.iter().flatten() {
        let [asymmetry, sigma] = found.asymmetry.unwrap();
        assert!((asymmetry - 2e-4).abs() < 3.0 * sigma + 1e-6 && sigma < 5e-6, "{asymmetry} {sigma}");
    }
    let report = made.report();
    println!("{}", report.to_text());
    insta::assert_snapshot!([report.warnings.as_slice(), &report.notes].concat().join("\n"));
    for verdict in &report.verdicts {
        let [before, after] = verdict.in_sample;
        assert!(verdict.accepted && after.rms < 0.01 * before.rms, "{}", verdict.words());
    }
    for sensor in &made.written.document.gyro.sensor {
        let asymmetry = sensor.terms.curve(Feature::RateMagnitude).and_then(|curve| curve.shape().at(25.0));
        assert!((asymmetry.unwrap() + 100.0).abs() < 3.0, "{asymmetry:?} ppm");
    }
    // Once more from there: nothing is left of it, and what is there stays.
    let again = made_from(&made.written.document, &runs, &steps(3), &place()).unwrap();
    assert!(again.gyros.iter().flatten().all(|found| found.weight_asymmetry_ppm().is_none()));
    assert_eq!(
        again.written.document.gyro.sensor[0].terms.curve(Feature::RateMagnitude),
        made.written.document.gyro.sensor[0].terms.curve(Feature::RateMagnitude)
    );
    assert!(report.coefficients_by_name().contains_key("gyro x scale factor asymmetry"));
    assert!(super::document::details(&made)["nonlinearity_deg_per_h"]["x"][0].is_f64());
}

#[test]
fn a_new_weight_takes_the_old_bias_with_it() {
    let runs = [0, 1, 2]
        .map(|axis: usize| run(500 + u64::try_from(axis).unwrap(), AXES[axis], |reading| 0.9 * reading));
    let written = |bias: f64, with_bias: bool| {
        let mut base = base();
        for gyro in &mut base.gyro.sensor {
            gyro.set(Feature::One, constant(bias));
            gyro.trend = Some(Trend { coefficients_deg_per_h: vec![bias], interval_h: [0.0, 1.0] });
        }
        let (steps, place) = (steps(3), place());
        let wanted = Wanted { with_bias, ..wanted(&base, &runs, &steps, &place) };
        make(&wanted).unwrap().written.document.gyro.sensor.remove(0)
    };
    let of = |gyro: &GyroSensor| {
        let bias = gyro.terms.curve(Feature::One).unwrap().shape().at(25.0).unwrap();
        [bias, gyro.trend.as_ref().unwrap().coefficients_deg_per_h[0]]
    };
    let gyro = written(900.0, false);
    let weight = gyro.increment_weight_rad_per_rad.unwrap();
    assert!(
        of(&gyro).iter().all(|bias| (bias / (900.0 * weight) - 1.0).abs() < 1e-9) && weight > 1.1,
        "{gyro:?}"
    );
    // What is found is the same whatever stood there.
    let [one, other] = [0.0, 450.0].map(|bias| of(&written(bias, true)).iter().sum::<f64>());
    assert!((one - other).abs() < 1e-3, "{one} {other}");
}

#[test]
fn a_bent_gyro_is_told_from_noise() {
    let bend = |reading: f64| reading * (1.0 + 3e-5 * reading * reading);
    let runs = [0, 1, 2].map(|axis: usize| run(800 + u64::try_from(axis).unwrap(), AXES[axis], bend));
    let made = made(&runs, &steps(3), &place()).unwrap();
    assert!(made.gyros.iter().flatten().all(|found| found.widened && found.chi_square > 10.0));
    assert!(made.report().warnings.iter().any(|words| words.contains("Nonlinearity")));
}

#[test]
fn one_axis_gives_its_own_gyro_s_weight_and_no_other() {
    let runs = [run(900, AXES[2], |reading| reading)];
    let steps = listed(&["z".to_owned()], [&RATES, &[]], [1, 0]).unwrap();
    let made = made(&runs, &steps, &place()).unwrap();
    assert!(made.gyros[0].is_err() && made.gyros[1].is_err());
    let found = made.gyros[2].as_ref().unwrap();
    assert!(found.axis.is_none());
    let truth = {
        let scenario = scenario(0);
        let Gyros::Mems(gyros) = &scenario.instrument.gyros else { panic!() };
        let away = Simulation::new(&scenario).unwrap().next().unwrap().truth.gyro_deg_c[2]
            - gyros[2].reference_deg_c;
        gyros[2].scale * (1.0 + gyros[2].scale_per_k[0] * away + gyros[2].scale_per_k[1] * away * away)
    };
    let error = (1.0 / found.gain[0] - truth) / (found.gain[1] * truth);
    assert!(error.abs() < 3.0, "{error}");
    let rows = &made.written.document.gyro.orientation.rows;
    assert_eq!(rows[2].map(f64::to_bits), [0.0, 0.0, 1.0].map(f64::to_bits));
}

#[test]
fn without_a_place_whole_turns_hold_the_earth_off() {
    let made = made(&table(950), &steps(3), &[]).unwrap();
    assert!(made.warnings.iter().any(|found| found.kind == Kind::NoAttitude));
    let gyros = {
        let Gyros::Mems(gyros) = scenario(0).instrument.gyros else { panic!() };
        gyros
    };
    for (found, gyro) in made.gyros.iter().zip(gyros) {
        let weight = 1.0 / found.as_ref().unwrap().gain[0];
        // The gyros are some degrees from their reference: 40 ppm/°C.
        assert!((weight - gyro.scale).abs() < 5e-4, "{weight}");
    }
    // Each mounting has another share of the Earth in its bias, and a rest all of what is across the table's axis.
    for found in made.gyros.iter().flatten() {
        let [asymmetry, sigma] = found.asymmetry.unwrap();
        assert!(asymmetry.abs() < 3.0 * sigma && sigma < 1e-5 && !found.widened, "{asymmetry} {sigma}");
    }
}

/// The only finding that something is refused for.
fn only(refused: Result<Vec<Finding>, Error>) -> Finding {
    match refused {
        Err(Error::Found(mut found)) if found.len() == 1 => found.remove(0),
        other => panic!("{other:?}"),
    }
}

#[test]
fn steps_that_are_not_those_of_the_log_are_refused() {
    let runs = [run(1, AXES[0], |reading| reading)];
    let found = |rates: &[f64]| {
        let steps = listed(&["x".to_owned()], [rates, &[]], [1, 0]).unwrap();
        only(made(&runs, &steps, &place()).map(|made| made.warnings))
    };
    let few = found(&[36.0, -36.0]);
    assert_eq!(few.place.log, Some(0));
    let Kind::OtherPlateaus { stated: 2, turning: 3.., found: plateaus } = few.kind else { panic!("{few}") };
    assert!(plateaus.iter().any(|plateau| (plateau.rate[0] / 3600.0 - 36.0).abs() < 0.2), "{plateaus:?}");
    let swapped = found(&[36.0, -36.0, 144.0, -72.0, 72.0, -144.0]);
    assert!(matches!(swapped.kind, Kind::OutOfProportion { .. }), "{swapped}");
    assert!(matches!(listed(&["x".to_owned()], [&[1.0], &[]], [2, 0]), Err(Error::Usage(_))));
}

#[test]
fn weights_far_from_the_old_ones_and_steps_that_overlap_are_told() {
    let runs = [run(5, AXES[0], |reading| 0.6 * reading)];
    let one = listed(&["x".to_owned()], [&RATES, &[]], [1, 0]).unwrap();
    insta::assert_snapshot!(made(&runs, &one, &place()).unwrap().report().warnings.join("\n"));
    let table = table(5);
    let right = made(&table, &steps(3), &place()).unwrap().report().warnings;
    assert_eq!(right, [""; 0]);
    let window = |rate_deg_per_s: f64, from_s: f64| Step {
        run: 0,
        axis: AXES[0],
        rate_deg_per_s,
        window_s: Some([from_s, from_s + 8.0]),
    };
    let twice = [window(36.0, 11.0), window(-36.0, 31.0), window(36.0, 12.0)];
    let refused = only(made(&runs, &twice, &place()).map(|made| made.warnings));
    assert_eq!(refused, Kind::StepsOverlap { windows_s: [[11.0, 19.0], [12.0, 20.0]] }.in_log(0));
}

#[test]
fn tables_of_steps_are_read_or_refused_with_their_line() {
    let folder = tempfile::tempdir().unwrap();
    let read = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        super::steps::read(&path, 2)
    };
    let csv = read("a.csv", "log,axis,rate_deg_per_s,begin_s,end_s\n1,-z,10,1,2\n2,y,-5,,\n").unwrap();
    assert_eq!(
        csv[0],
        Step { run: 0, axis: [0.0, 0.0, -1.0], rate_deg_per_s: 10.0, window_s: Some([1.0, 2.0]) }
    );
    assert_eq!((csv[1].run, csv[1].window_s), (1, None));
    let toml = read("a.toml", "[[step]]\naxis = [0, 3.0, 4.0]\nrate_deg_per_s = 2.5\n").unwrap();
    assert_eq!(toml[0].axis.map(f64::to_bits), [0.0, 0.6, 0.8].map(f64::to_bits));
    let refused = [
        ("b.csv", "axis,rate\nz,1\n"),
        ("c.csv", "axis,rate_deg_per_s\nz,fast\n"),
        ("d.csv", "axis,rate_deg_per_s\nw,1\n"),
        ("e.toml", "[[step]]\naxis = \"z\"\nrate_deg_per_s = 1\nlog = 3\n"),
        ("f.toml", "[[step]]\naxis = \"z\"\nrate_deg_per_s = 1\nbegin_s = 3\n"),
        ("g.csv", ""),
    ]
    .map(|(name, text)| {
        let error = read(name, text).unwrap_err();
        assert_eq!(error.exit(), Exit::Usage);
        error.to_string()
    });
    insta::assert_snapshot!(refused.join("\n").replace(folder.path().to_str().unwrap(), "FOLDER"));
}
