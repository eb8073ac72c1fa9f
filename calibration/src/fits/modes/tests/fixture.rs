//! Simulated runs of the Zeeman unit, and the document that a fit starts from.

use std::path::Path;

use isotherm_correction::earth::Place;
use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::Document;
use isotherm_simulator::Scenario;
use isotherm_simulator::chamber::Profile;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::presets::zeeman_rest;
use isotherm_simulator::zeeman::Zeeman;

use crate::document::Written;
use crate::fits::modes::fit::{Made, Wanted, make};
use crate::fits::modes::model::{Asked, deg_per_h};
use crate::fixture::simulated;
use crate::runs::Run;

/// −40…60 °C and back.
pub(super) fn cycle(rate: f64) -> Profile {
    Profile::constant(60.0).ramp(-40.0, rate).ramp(60.0, rate)
}

/// The preset's unit with another chamber programme, tick and reversal period; no accelerometers, the meander reported.
pub(super) fn scenario(seed: u64, chamber: Profile, tick_s: f64, period_s: f64) -> Scenario {
    let mut scenario = zeeman_rest(seed);
    scenario.duration_s = chamber.duration_s();
    scenario.chamber = chamber;
    #[expect(clippy::cast_possible_truncation, reason = "a tick is below a second")]
    {
        scenario.tick_ns = (tick_s * 1e9) as i64;
    }
    scenario.instrument.accelerometers = None;
    scenario.instrument.thermometers.channels.retain(|channel| is_kept(&channel.name));
    zeeman(&mut scenario).reversal.period_s = period_s;
    zeeman(&mut scenario).reversal.meander_half_period_s = 0.37 * period_s;
    scenario
}

pub(super) fn zeeman(scenario: &mut Scenario) -> &mut Zeeman {
    match &mut scenario.instrument.gyros {
        Gyros::Zeeman(zeeman) => zeeman,
        _ => panic!("a Zeeman unit"),
    }
}

/// The unit's document with scale, axes, channels and filter, and without anything that a fit is to find.
pub(super) fn base() -> Document {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/calibration/ZLG-0001.toml");
    let mut document = Written::read(&path).unwrap().document;
    for sensor in &mut document.gyro.sensor {
        sensor
            .terms
            .retain(|feature| !matches!(feature, Feature::One | Feature::LasingMode | Feature::Meander));
        sensor.servo = None;
    }
    document.mode_reversal = None;
    document.accel = None;
    document.temperature.channel.retain(|channel| is_kept(&channel.name));
    document
}

pub(super) fn place() -> Place {
    Place::new(55.75, 30.0, Some([0.0, 0.0])).unwrap()
}

pub(super) fn run(scenario: &Scenario) -> Run {
    simulated(scenario, |_| {})
}

pub(super) fn wanted<'a>(runs: &'a [Run], base: &'a Document) -> Wanted<'a> {
    Wanted { runs, judge: &[], base, place: Some(place()), asked: Asked::default() }
}

pub(super) fn fitted(scenario: &Scenario, base: &Document) -> Made {
    let runs = [run(scenario)];
    make(&wanted(&runs, base)).unwrap()
}

/// The true constants of a gyro (°/h): term, power, value.
pub(super) fn truth(scenario: &mut Scenario, sensor: usize) -> Vec<(Feature, usize, f64)> {
    let gyro = zeeman(scenario).gyros[sensor];
    let of = |term: Feature, values: &[f64]| {
        values.iter().enumerate().map(|(power, value)| (term, power, deg_per_h(*value))).collect::<Vec<_>>()
    };
    let mut all = of(Feature::One, &gyro.bias_nonmagnetic_rad_per_s);
    all.extend(of(Feature::LasingMode, &gyro.bias_magnetic_rad_per_s));
    all.extend(of(Feature::Meander, &gyro.meander_rad_per_s));
    all
}

/// The channels that gyros and their axes follow.
fn is_kept(channel: &str) -> bool {
    channel.starts_with("gyro") || channel == "housing"
}
