//! A survey of coils that the simulator does not have: slabs of many sizes, contacts, windings and thermometers, other ramps and
//! holds, other noise. It is run by hand, docs/calibration/thermal.md sums it up.
//!
//! The coil is a slab of 24 layers, explicit finite volumes, heated through both faces by a housing that follows the chamber. What the
//! gyro shows is a weighted sum of the layers' Ṫ (the weights are what a winding leaves of Shupe's effect: the same for all layers,
//! growing with depth, or changing sign from layer to layer), times a thermo-optic coefficient that grows with temperature, beside a
//! static bias that is no polynomial, and white noise.

use std::fmt::Write as _;

use isotherm_calibration::runs::Run;
use isotherm_calibration::thermal::{Method, Settings, fit};
use isotherm_correction::sample::{ChannelName, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_log::offline::unit_id;
use isotherm_log::text::LogEvent;
use isotherm_protocol::document::Origin;
use isotherm_simulator::Scenario;
use isotherm_simulator::chamber::{Chamber, Profile};
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::noise::GyroNoise;
use isotherm_simulator::presets::{fibre_optic_chamber, judging_profile, training_profile};

use super::{TICK_NS, factors, fitted, together};

const LAYERS: usize = 24;
/// rad/s in one °/h.
const DEG_PER_H: f64 = core::f64::consts::PI / 180.0 / 3600.0;
/// Length of a tick (s).
const TICK_S: f64 = 0.5;
/// Length of the windows that residuals are stated over (s).
const WINDOW_S: f64 = 100.0;

/// One coil with its surroundings.
#[derive(Debug, Clone, Copy)]
struct Coil {
    /// L²/α: how long heat takes through the coil (s); its slowest mode decays with 0.1 to 0.4 of it.
    through_s: f64,
    /// Conductance of the outer and the inner contact, in those of the whole coil.
    contacts: [f64; 2],
    /// Time constant of the housing behind the chamber (s).
    housing_s: f64,
    /// Depth of the thermometer, 0 outside to 1 inside, and its own time constant (s).
    thermometer: (f64, f64),
    /// Growth of the thermo-optic coefficient (1/°C).
    growth: f64,
    /// White noise of a gyro (°/√h).
    walk: f64,
}

const USUAL: Coil = Coil {
    through_s: 600.0,
    contacts: [5.0, 0.5],
    housing_s: 60.0,
    thermometer: (0.0, 0.0),
    growth: 2e-3,
    walk: 0.001,
};

/// Shares of the mean, the gradient and the ripple from layer to layer in what the three gyros show, (°/h)/(°C/s).
const WINDINGS: [[f64; 3]; 3] = [[50.0, 8.0, 4.0], [-42.0, 25.0, -10.0], [28.0, -45.0, 20.0]];

struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / 9_007_199_254_740_992.0
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Static bias of a gyro (°/h).
fn at_rest(gyro: usize, t: f64) -> f64 {
    let phase = [0.3, 1.7, -0.9][gyro];
    0.1 * (t / 35.0 + phase).sin() + [2e-3, -1.5e-3, 1e-3][gyro] * t + 0.05
}

fn simulated(coil: &Coil, profile: &Profile, seed: u64) -> Run {
    let chamber = Chamber::new(profile);
    let width = 1.0 / LAYERS as f64;
    // Conductances between cells and to the housing, per capacity of a cell (1/s).
    let between = 1.0 / (coil.through_s * width * width);
    let face = |contact: f64| {
        if contact > 0.0 { 1.0 / (1.0 / contact + 0.5 * width) / (coil.through_s * width) } else { 0.0 }
    };
    let [outer, inner] = coil.contacts.map(face);
    let fastest = 2.0 * between + outer.max(inner);
    let substeps = (TICK_S * fastest / 0.8).ceil().max(1.0) as usize;
    let step = TICK_S / substeps as f64;
    let mut housing = profile.start_deg_c;
    let mut layers = [housing; LAYERS];
    let mut shown = housing;
    let mut noise = Noise(seed);
    let mut events = Vec::new();
    let channel = ChannelName::from("coil").unwrap();
    for sequence in 0..(profile.duration_s() / TICK_S) as u64 {
        let begin_s = sequence as f64 * TICK_S;
        let mut drifts = [0.0; 3];
        for part in 0..substeps {
            let around = chamber.deg_c(begin_s + part as f64 * step);
            housing += (around - housing) * (1.0 - (-step / coil.housing_s).exp());
            let mut rates = [0.0; LAYERS];
            for (layer, rate) in rates.iter_mut().enumerate() {
                let here = layers[layer];
                let out =
                    if layer == 0 { outer * (housing - here) } else { between * (layers[layer - 1] - here) };
                let within = if layer + 1 == LAYERS {
                    inner * (housing - here)
                } else {
                    between * (layers[layer + 1] - here)
                };
                *rate = out + within;
            }
            let mean = rates.iter().sum::<f64>() / LAYERS as f64;
            let depth = |layer: usize| (layer as f64 + 0.5) * width - 0.5;
            let tilt = (0..LAYERS).map(|l| depth(l) * rates[l]).sum::<f64>() * 12.0 / LAYERS as f64;
            let sign = |layer: usize| if matches!(layer % 4, 0 | 3) { 1.0 } else { -1.0 };
            let ripple = (0..LAYERS).map(|l| sign(l) * (1.0 - l as f64 * width) * rates[l]).sum::<f64>();
            let average = layers.iter().sum::<f64>() / LAYERS as f64;
            let growth = 1.0 + coil.growth * (average - 20.0);
            for (gyro, (drift, [a, b, c])) in drifts.iter_mut().zip(WINDINGS).enumerate() {
                let of_winding = growth * (a * mean + b * tilt + c * ripple);
                *drift += (of_winding + at_rest(gyro, average)) / substeps as f64;
            }
            layers.iter_mut().zip(rates).for_each(|(layer, rate)| *layer += rate * step);
            let (at, own_s) = coil.thermometer;
            let there =
                if at <= 0.0 { housing } else { layers[((at * LAYERS as f64) as usize).min(LAYERS - 1)] };
            shown = if own_s > 0.0 { shown + (there - shown) * (1.0 - (-step / own_s).exp()) } else { there };
        }
        let end_ns = ((begin_s + TICK_S) * 1e9) as i64;
        if sequence % 2 == 0 {
            let raw = ((shown + 0.004 * noise.normal()) / 0.0078).round() * 0.0078;
            events.push(LogEvent::Temperature(TemperatureReading {
                channel,
                time: Timestamp::from_ns(end_ns),
                raw,
            }));
        }
        // °/√h to the standard deviation of a tick in °/h.
        let sigma = coil.walk * (3600.0 / TICK_S).sqrt();
        let readings = drifts.map(|drift| (drift + sigma * noise.normal()) * DEG_PER_H);
        let tick = GyroTick {
            sequence,
            end_time: Timestamp::from_ns(end_ns),
            duration: Span::from_s(TICK_S),
            readings: readings.into_iter().collect(),
            ..GyroTick::default()
        };
        events.push(LogEvent::Gyro { output: OutputKind::Mean, tick });
    }
    Run::of_events("survey".to_owned(), unit_id("COIL").unwrap(), events)
}

/// A programme and another one, as a chamber's operator would write them.
fn programmes(rate: f64, hold: f64) -> [Profile; 2] {
    let first =
        Profile::constant(20.0).hold(0.5 * hold).ramp(-40.0, rate).hold(hold).ramp(60.0, rate).hold(hold);
    let other =
        Profile::constant(20.0).hold(20.0).ramp(45.0, 0.7 * rate).hold(0.5 * hold).ramp(-15.0, 1.3 * rate);
    let other = other
        .ramp(5.0, 0.8 * rate)
        .hold(0.3 * hold)
        .ramp(-30.0, rate)
        .hold(0.7 * hold)
        .ramp(25.0, 1.5 * rate);
    [first.ramp(20.0, rate).hold(0.5 * hold), other.hold(0.5 * hold)]
}

#[test]
#[ignore = "a survey by hand: cargo test --release --workspace --locked --test calibration -- --ignored survey --nocapture"]
fn survey_of_coils() {
    let coil = |change: fn(&mut Coil)| {
        let mut coil = USUAL;
        change(&mut coil);
        coil
    };
    let variants = [
        ("usual", USUAL, 1.0, 60.0),
        ("10 s through", coil(|c| c.through_s = 10.0), 1.0, 60.0),
        ("30 s through", coil(|c| c.through_s = 30.0), 1.0, 60.0),
        ("100 s through", coil(|c| c.through_s = 100.0), 1.0, 60.0),
        ("300 s through", coil(|c| c.through_s = 300.0), 1.0, 60.0),
        ("1000 s through", coil(|c| c.through_s = 1000.0), 1.0, 60.0),
        ("3000 s through", coil(|c| c.through_s = 3000.0), 1.0, 120.0),
        ("3000 s, short holds", coil(|c| c.through_s = 3000.0), 1.0, 40.0),
        ("poor contact", coil(|c| c.contacts = [0.5, 0.1]), 1.0, 90.0),
        ("perfect contact", coil(|c| c.contacts = [1e6, 0.0]), 1.0, 60.0),
        ("both faces", coil(|c| c.contacts = [10.0, 8.0]), 1.0, 60.0),
        ("slow housing", coil(|c| c.housing_s = 400.0), 1.0, 60.0),
        ("fast housing", coil(|c| c.housing_s = 5.0), 1.0, 60.0),
        ("thermometer inside", coil(|c| c.thermometer = (0.5, 0.0)), 1.0, 60.0),
        ("thermometer 60 s late", coil(|c| c.thermometer = (0.0, 60.0)), 1.0, 60.0),
        ("growth 5e-3", coil(|c| c.growth = 5e-3), 1.0, 60.0),
        ("0.5 °C/min", USUAL, 0.5, 60.0),
        ("2 °C/min", USUAL, 2.0, 60.0),
        ("3 °C/min, holds 30 min", USUAL, 3.0, 30.0),
        ("holds 20 min", USUAL, 1.0, 20.0),
        ("0.004 °/√h", coil(|c| c.walk = 0.004), 1.0, 60.0),
        ("0.01 °/√h", coil(|c| c.walk = 0.01), 1.0, 60.0),
        ("no noise", coil(|c| c.walk = 0.0), 1.0, 60.0),
    ];
    let wanted = std::env::var("COIL").unwrap_or_default();
    println!("| coil | raw rms, °/h | noise allows | sequential | joint | lag |\n|---|---|---|---|---|---|");
    for (index, (name, coil, rate, hold)) in variants.iter().enumerate() {
        if !name.contains(&wanted) {
            continue;
        }
        let seed = 100 + 2 * index as u64;
        let [train, judge] = programmes(*rate, *hold);
        let runs = [simulated(coil, &train, seed), simulated(coil, &judge, seed + 1)];
        let mut row = String::new();
        let mut raw = 0.0;
        for method in [Method::Sequential, Method::Joint, Method::Lag] {
            let settings = Settings { method, window_s: Some(WINDOW_S), ..Settings::default() };
            let [train, judge] = &runs;
            let both = (std::slice::from_ref(train), std::slice::from_ref(judge));
            let report = match fit(None, both, &settings, Origin::default(), ()) {
                Ok(made) => made.report,
                Err(error) => {
                    let _ = write!(row, " {error} |");
                    continue;
                }
            };
            let each: Vec<String> = factors(&report).iter().map(|[rms, _]| format!("{rms:.0}")).collect();
            let refused = if report.accepted() { "" } else { " refused" };
            let _ = write!(row, " {:.1} ({}){refused} |", together(&report)[0], each.join(", "));
            let of = |which: usize| -> f64 {
                report.verdicts.iter().map(|v| v.out_of_sample.unwrap()[which].rms.powi(2)).sum::<f64>()
            };
            raw = (of(0) / 3.0).sqrt();
            if std::env::var_os("WORDS").is_some() {
                println!("{name} {method:?}: {}", report.headline());
            }
        }
        let white = coil.walk * (3600.0 / WINDOW_S).sqrt();
        println!("| {name} | {raw:.3} | {:.0} |{row}", raw / white.max(1e-9));
    }
}

#[test]
#[ignore = "by hand: what the models themselves leave of the simulator's unit"]
fn survey_of_the_simulated_unit_without_noise() {
    let runs = [training_profile(), judging_profile()].map(|profile| {
        let mut scenario = Scenario { tick_ns: TICK_NS, ..fibre_optic_chamber(1, profile) };
        if let Gyros::FibreOptic(gyros) = &mut scenario.instrument.gyros {
            for gyro in gyros {
                gyro.noise = GyroNoise::default();
            }
        }
        super::run(&scenario)
    });
    for method in [Method::Sequential, Method::Joint, Method::Lag] {
        let made = fitted(method, &runs);
        println!(
            "{method:?}: {:.1?}\n{}",
            factors(&made.report),
            made.report.headline().replace(". ", ".\n")
        );
    }
}
