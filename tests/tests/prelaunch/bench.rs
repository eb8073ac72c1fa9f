//! Simulated units at rest, and a pre-launch calibration of each.

use std::num::NonZero;
use std::slice;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::earth::Place;
use isotherm_correction::prelaunch::{GyroConstants, Outcome, PreLaunch, PreLaunchSettings, Refusal};
use isotherm_correction::unit::{Event, Unit, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_protocol::document::Document;
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::failure::{FailingSensor, Failure, Fault};
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::motion::Motion;
use isotherm_simulator::presets::{fibre_optic_chamber, mems_chamber, zeeman_rest};
use isotherm_simulator::zeeman::Zeeman;
use isotherm_simulator::{Scenario, Simulation};

/// rad/s in one °/h.
pub(crate) const DEG_PER_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;
/// Latitude of all runs (°).
pub(crate) const LATITUDE_DEG: f64 = 55.0;
/// Heading, pitch and roll of all runs (°).
pub(crate) const ATTITUDE_DEG: [f64; 3] = [30.0, 4.0, -6.0];
/// Ticks of the Zeeman unit (ns): 200 Hz.
const ZEEMAN_TICK_NS: i64 = 5_000_000;
/// Ticks of the other units, and of the Zeeman unit where a run need not be more than seen (ns): 50 Hz.
const COARSE_TICK_NS: i64 = 20_000_000;
/// The unit runs this long before its calibration begins, so that its temperatures are known (s).
pub(crate) const LEAD_S: f64 = 20.0;

/// Calibration of a unit by its shipped document.
pub(crate) fn calibration(serial: &str) -> Arc<Calibration> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration");
    let text = std::fs::read_to_string(format!("{folder}/{serial}.toml")).unwrap();
    let parsed = Document::parse(&text, Some(serial)).unwrap_or_else(|problems| panic!("{problems:?}"));
    Arc::new(Calibration::new(&parsed.document.to_parts()).unwrap())
}

/// A Zeeman unit at rest: Earth rate at 55°, noise, dither, counts of 2″, mode switched every minute, and gyros that
/// warm by 2 °C.
pub(crate) fn zeeman(seed: u64) -> Scenario {
    let mut scenario = at_rest(zeeman_rest(seed));
    scenario.chamber = Profile::constant(20.0).ramp(26.0, 1.0);
    scenario.tick_ns = ZEEMAN_TICK_NS;
    zeeman_unit(&mut scenario).reversal.period_s = 60.0;
    scenario
}

/// The same with ticks of 20 ms.
pub(crate) fn coarse_zeeman(seed: u64) -> Scenario {
    Scenario { tick_ns: COARSE_TICK_NS, ..zeeman(seed) }
}

/// A micromechanical unit at rest that warms by 2 °C.
pub(crate) fn mems(seed: u64) -> Scenario {
    let mut scenario = at_rest(mems_chamber(seed));
    scenario.chamber = Profile::constant(25.0).ramp(28.0, 0.25);
    scenario
}

/// A fibre-optic unit at rest at one temperature.
pub(crate) fn fibre_optic(seed: u64) -> Scenario {
    at_rest(fibre_optic_chamber(seed, Profile::constant(20.0)))
}

fn at_rest(scenario: Scenario) -> Scenario {
    let [heading_deg, pitch_deg, roll_deg] = ATTITUDE_DEG;
    Scenario {
        tick_ns: COARSE_TICK_NS,
        duration_s: LEAD_S + 600.0,
        motion: Motion { heading_deg, pitch_deg, roll_deg, ..Motion::rest(LATITUDE_DEG) },
        ..scenario
    }
}

/// The Zeeman gyros of a scenario.
pub(crate) fn zeeman_unit(scenario: &mut Scenario) -> &mut Zeeman {
    match &mut scenario.instrument.gyros {
        Gyros::Zeeman(zeeman) => zeeman,
        other => panic!("{other:?}"),
    }
}

/// A disturbance of one sensor that lasts from `at_s` for `length_s` seconds of the calibration.
pub(crate) fn pulse(scenario: &mut Scenario, sensor: FailingSensor, at_s: f64, length_s: f64, size: f64) {
    let fault = |size| match sensor {
        FailingSensor::Gyro(_) => Fault::RateJump { rad_per_s: size },
        FailingSensor::Accelerometer(_) => Fault::ForceJump { m_per_s2: size },
    };
    let at_s = LEAD_S + at_s;
    scenario.failures.push(Failure { sensor, at_s, fault: fault(size) });
    scenario.failures.push(Failure { sensor, at_s: at_s + length_s, fault: fault(-size) });
}

/// Shift of a constant in run `seed` (rad/s): another one in each run, gyro and constant, within ±`size`.
pub(crate) fn shift_rad_per_s(seed: u64, gyro: usize, constant: usize, size_deg_per_h: f64) -> f64 {
    let [seed, gyro, constant] =
        [seed, gyro as u64, constant as u64].map(|n| f64::from(u32::try_from(n).unwrap()));
    size_deg_per_h * DEG_PER_H * (2.399_963 * seed + gyro + 1.7 * constant).sin()
}

/// Settings with the given attitude.
pub(crate) fn given() -> PreLaunchSettings {
    let [heading, pitch, roll] = ATTITUDE_DEG;
    let place = Place::new(LATITUDE_DEG, heading, Some([pitch, roll])).unwrap();
    PreLaunchSettings { place: Some(place), ..PreLaunchSettings::default() }
}

/// Settings with the given heading; the unit is levelled.
pub(crate) fn levelled() -> PreLaunchSettings {
    let place = Place::new(LATITUDE_DEG, ATTITUDE_DEG[0], None).unwrap();
    PreLaunchSettings { place: Some(place), ..PreLaunchSettings::default() }
}

/// Runs a scenario through a unit and calibrates it after the lead; what came of it by the end of the stream.
pub(crate) fn run(
    calibration: &Arc<Calibration>,
    scenario: &Scenario,
    settings: &PreLaunchSettings,
) -> Outcome {
    let mut pre_launch = PreLaunch::new(settings, calibration).unwrap();
    let mut unit = Unit::new(UnitSettings::default());
    unit.install(Arc::clone(calibration), 1);
    let mut seen = None;
    for step in Simulation::new(scenario).unwrap() {
        feed(&mut unit, scenario, &step);
        let Some(observation) = unit.observation() else { continue };
        let after_lead = observation.end_time.as_ns() > scenario.start_ns + Span::from_s(LEAD_S).as_ns();
        if after_lead && seen.replace(observation.sequence) != Some(observation.sequence) {
            pre_launch.observe(observation);
        }
        if pre_launch.outcome().is_some() {
            break;
        }
    }
    pre_launch.finish().clone()
}

/// Hands one step over.
pub(crate) fn feed(unit: &mut Unit, scenario: &Scenario, step: &isotherm_simulator::Step) {
    let output = scenario.instrument.gyros.output_kind();
    unit.handle(Event::Temperature(&step.temperatures), &mut |_| {});
    if let (Some(output), Some(tick)) = (scenario.instrument.accel_output_kind(), &step.accel) {
        unit.handle(Event::Accel { output, ticks: slice::from_ref(tick) }, &mut |_| {});
    }
    unit.handle(Event::Gyro { output, ticks: slice::from_ref(&step.gyro) }, &mut |_| {});
}

/// The constants of an accepted calibration.
#[track_caller]
pub(crate) fn accepted(outcome: Outcome) -> Vec<GyroConstants> {
    match outcome {
        Outcome::Accepted(constants) => constants,
        Outcome::Refused(refusals) => panic!("{:?}", words(&refusals)),
    }
}

/// Reasons as a person reads them.
pub(crate) fn words(refusals: &[Refusal]) -> Vec<String> {
    refusals.iter().map(ToString::to_string).collect()
}

/// The reasons of a refusal.
#[track_caller]
pub(crate) fn refused(outcome: Outcome) -> Vec<Refusal> {
    match outcome {
        Outcome::Refused(refusals) => refusals,
        Outcome::Accepted(constants) => panic!("accepted {constants:?}"),
    }
}

/// The same for each seed of 0…count, on all cores, in the order of the seeds.
pub(crate) fn for_seeds<T: Send>(count: u64, run: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let cores = thread::available_parallelism().map_or(2, NonZero::get);
    let (next, done) = (AtomicU64::new(0), Mutex::new(Vec::new()));
    thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= count {
                        break;
                    }
                    let result = run(seed);
                    done.lock().unwrap().push((seed, result));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap();
    done.sort_by_key(|(seed, _)| *seed);
    done.into_iter().map(|(_, result)| result).collect()
}
