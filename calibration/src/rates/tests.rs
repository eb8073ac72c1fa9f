//! Simulated rate-table runs through the whole procedure.

use isotherm_correction::earth::Place;
use isotherm_log::offline::unit_id;
use isotherm_log::text::LogEvent;
use isotherm_protocol::document::{Document, GyroOutput};
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::motion::Path;
use isotherm_simulator::presets::mems_chamber;
use isotherm_simulator::{Scenario, Simulation};

use super::document::nominal;
use super::make::{Made, Wanted, make};
use super::steps::{Step, listed};
use crate::error::Error;
use crate::run::Run;

/// Rates of the table (°/s): whole turns in ten seconds, so that every step begins as the run did.
const RATES: [f64; 6] = [36.0, -36.0, 72.0, -72.0, 144.0, -144.0];
const STEP_S: f64 = 10.0;

fn scenario(seed: u64) -> Scenario {
    let mut scenario = mems_chamber(seed);
    scenario.chamber = Profile::constant(25.0);
    scenario.duration_s = STEP_S;
    scenario.instrument.accelerometers = None;
    scenario.instrument.thermometers.channels.clear();
    scenario.instrument.thermal_step_s = 1.0;
    if let Gyros::Mems(gyros) = &mut scenario.instrument.gyros {
        for gyro in gyros {
            gyro.noise.angle_random_walk_rad_per_sqrt_s *= 0.1;
        }
    }
    scenario
}

/// A run: rest, then each rate, with a rest between them; `distort` changes the readings.
fn run(seed: u64, axis: [f64; 3], distort: impl Fn(f64) -> f64) -> Run {
    let mut events = Vec::new();
    let mut offset = 0_u64;
    let rests = RATES.iter().flat_map(|rate| [0.0, *rate]);
    for (number, rate) in rests.enumerate() {
        let mut scenario = scenario(seed.wrapping_mul(1000) + u64::try_from(number).unwrap());
        scenario.start_ns = i64::try_from(number).unwrap() * 10_000_000_000;
        if rate != 0.0 {
            scenario.motion.path = Path::ConstantRate { axis, rate_deg_per_s: rate };
        }
        let mut last = 0;
        for step in Simulation::new(&scenario).unwrap() {
            let mut tick = step.gyro;
            last = tick.sequence + 1;
            tick.sequence += offset;
            tick.readings.iter_mut().for_each(|reading| *reading = distort(*reading));
            events.push(LogEvent::Gyro { output: scenario.instrument.gyros.output_kind(), tick });
        }
        offset += last;
    }
    Run::of_events("table".to_owned(), unit_id("MEMS-0001").unwrap(), events)
}

const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

fn base() -> Document {
    nominal("MEMS-0001", GyroOutput::Mean)
}

fn place() -> Vec<Place> {
    vec![Place::new(55.75, 30.0, Some([0.0, 0.0])).unwrap()]
}

fn steps(runs: usize) -> Vec<Step> {
    listed(&["x", "y", "z"].map(str::to_owned)[..runs], &RATES, runs).unwrap()
}

fn made(runs: &[Run], steps: &[Step], place: &[Place]) -> Result<Made, Error> {
    make(&Wanted { runs, steps, base: &base(), place, table_ppm: 0.0, with_bias: false }, || ())
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
            of.push((found.bias[0] - crate::modes::fit::deg_per_h(drift)) / found.bias[1]);
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
