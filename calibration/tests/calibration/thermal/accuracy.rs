//! Accuracy on coils that the simulator does not have, fitted on one chamber programme and judged on another against truth without
//! noise. `just accuracy` prints the whole table; continuous integration asserts a few of its cells.
//!
//! The coil is a slab of 24 layers, explicit finite volumes, heated through both faces by a housing that follows the chamber. What the
//! gyro shows is a weighted sum of the layers' Ṫ (the weights are what a winding leaves of Shupe's effect: the same for all layers,
//! growing with depth, or changing sign from layer to layer), times a thermo-optic coefficient that grows with temperature, beside a
//! static bias that is no polynomial, and white noise of 0.001 °/√h. Sizes, contacts, windings and thermometers differ by seed.

use isotherm_calibration::document::Written;
use isotherm_calibration::fits::thermal::{Method, Settings, fit};
use isotherm_calibration::numbers::Size;
use isotherm_calibration::runs::Run;
use isotherm_calibration::runs::table::Table;
use isotherm_correction::sample::{ChannelName, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_log::offline::unit_id;
use isotherm_log::text::LogEvent;
use isotherm_protocol::document::Document;
use isotherm_simulator::chamber::{Chamber, Profile};

const LAYERS: usize = 24;
/// rad/s in one °/h.
const DEG_PER_H: f64 = core::f64::consts::PI / 180.0 / 3600.0;
/// Length of a tick (s).
const TICK_S: f64 = 1.0;
/// White noise of a gyro in the fitted run (°/√h).
const WALK: f64 = 0.001;
/// Lengths of the means that are judged (s).
const MEANS_S: [f64; 3] = [1.0, 10.0, 100.0];
/// Resolution of a thermometer (°C).
const RESOLUTION: f64 = 0.0078;
const COILS: u64 = 6;

struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / 9_007_199_254_740_992.0
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    /// Equally likely in its logarithm.
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.uniform())
    }
}

/// One coil with its surroundings.
struct Coil {
    /// L²/α: how long heat takes through the coil (s); its slowest mode decays with 0.1 to 0.4 of it.
    through_s: f64,
    /// Conductance of the outer and the inner contact, in those of the whole coil.
    contacts: [f64; 2],
    /// Time constant of the housing behind the chamber, and of the thermometer behind the housing (s).
    housing_s: f64,
    thermometer_s: f64,
    /// Growth of the thermo-optic coefficient (1/°C).
    growth: f64,
    /// Shares of the mean, the gradient and the ripple from layer to layer in what the three gyros show, (°/h)/(°C/s).
    windings: [[f64; 3]; 3],
    /// Phase of the ripple of the static bias, and its slope (°/h/°C), by gyro.
    at_rest: [[f64; 2]; 3],
}

impl Coil {
    fn new(seed: u64) -> Self {
        let mut noise = Noise(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let windings = [[50.0, 8.0, 4.0], [-42.0, 25.0, -10.0], [28.0, -45.0, 20.0]];
        Self {
            through_s: noise.between(150.0, 1500.0),
            contacts: [noise.between(1.0, 15.0), noise.between(0.1, 2.0)],
            housing_s: noise.between(15.0, 200.0),
            thermometer_s: [0.0, 10.0, 30.0][(seed % 3) as usize],
            growth: 1e-3 + 3e-3 * noise.uniform(),
            windings: windings.map(|gyro| gyro.map(|share| share * (0.3 * noise.normal()).exp())),
            at_rest: [0, 1, 2].map(|_| [4.0 * noise.uniform() - 2.0, 2e-3 * noise.normal()]),
        }
    }

    /// Drift of the gyros (°/h) and reading of a noiseless thermometer (°C), by tick.
    fn simulated(&self, profile: &Profile) -> (Vec<[f64; 3]>, Vec<f64>) {
        let chamber = Chamber::new(profile);
        let width = 1.0 / LAYERS as f64;
        // Conductances between cells and to the housing, per capacity of a cell (1/s).
        let between = 1.0 / (self.through_s * width * width);
        let [outer, inner] = self.contacts.map(|c| 1.0 / (1.0 / c + 0.5 * width) / (self.through_s * width));
        let substeps = (TICK_S * (2.0 * between + outer.max(inner)) / 0.8).ceil().max(1.0) as usize;
        let step = TICK_S / substeps as f64;
        let approach = |own_s: f64| if own_s > 0.0 { 1.0 - (-step / own_s).exp() } else { 1.0 };
        let (mut housing, mut shown) = (profile.start_deg_c, profile.start_deg_c);
        let mut layers = [housing; LAYERS];
        let (mut drifts, mut readings) = (Vec::new(), Vec::new());
        for tick in 0..(profile.duration_s() / TICK_S) as u64 {
            let mut drift = [0.0; 3];
            for part in 0..substeps {
                let around = chamber.deg_c(tick as f64 * TICK_S + part as f64 * step);
                housing += (around - housing) * approach(self.housing_s);
                let rates: [f64; LAYERS] = std::array::from_fn(|layer| {
                    let towards = |other: Option<&f64>, face: f64| match other {
                        Some(other) => between * (other - layers[layer]),
                        None => face * (housing - layers[layer]),
                    };
                    let outside = layer.checked_sub(1).and_then(|outside| layers.get(outside));
                    towards(outside, outer) + towards(layers.get(layer + 1), inner)
                });
                let mean = rates.iter().sum::<f64>() * width;
                let depth = |layer: usize| (layer as f64 + 0.5) * width - 0.5;
                let tilt = (0..LAYERS).map(|l| depth(l) * rates[l]).sum::<f64>() * 12.0 * width;
                let sign = |layer: usize| if matches!(layer % 4, 0 | 3) { 1.0 } else { -1.0 };
                let ripple = (0..LAYERS).map(|l| sign(l) * (1.0 - l as f64 * width) * rates[l]).sum::<f64>();
                let average = layers.iter().sum::<f64>() * width;
                let growth = 1.0 + self.growth * (average - 20.0);
                for (drift, ([a, b, c], [phase, slope])) in
                    drift.iter_mut().zip(self.windings.iter().zip(self.at_rest))
                {
                    let static_bias = 0.1 * (average / 35.0 + phase).sin() + slope * average + 0.05;
                    *drift += (growth * (a * mean + b * tilt + c * ripple) + static_bias) / substeps as f64;
                }
                layers.iter_mut().zip(rates).for_each(|(layer, rate)| *layer += rate * step);
                shown += (housing - shown) * approach(self.thermometer_s);
            }
            drifts.push(drift);
            readings.push(shown);
        }
        (drifts, readings)
    }
}

/// How a coil is logged.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    /// Noise of a reading (°C), and seconds from reading to reading.
    reading_noise: f64,
    every_s: u64,
    /// Whether the fitted programme has holds.
    holds: bool,
}

const CASES: [Case; 6] = [
    Case { name: "0.003 °C", reading_noise: 0.003, every_s: 1, holds: true },
    Case { name: "0.01 °C", reading_noise: 0.01, every_s: 1, holds: true },
    Case { name: "0.06 °C", reading_noise: 0.06, every_s: 1, holds: true },
    Case { name: "four ramps, no holds", reading_noise: 0.004, every_s: 1, holds: false },
    Case { name: "every 10 s", reading_noise: 0.004, every_s: 10, holds: true },
    Case { name: "every 30 s", reading_noise: 0.004, every_s: 30, holds: true },
];

/// The fitted programme, and the judging one.
fn programmes(holds: bool) -> [Profile; 2] {
    let start = || Profile::constant(20.0);
    let fitted = if holds {
        let first = start().hold(30.0).ramp(-40.0, 1.0).hold(60.0).ramp(60.0, 1.0).hold(60.0);
        first.ramp(20.0, 1.0).hold(30.0)
    } else {
        start().ramp(-40.0, 1.0).ramp(60.0, 1.0).ramp(-30.0, 1.2).ramp(40.0, 0.8)
    };
    let other = start().hold(20.0).ramp(45.0, 0.7).hold(30.0).ramp(-15.0, 1.3).ramp(5.0, 0.8).hold(18.0);
    [fitted, other.ramp(-30.0, 1.0).hold(42.0).ramp(25.0, 1.5).hold(30.0)]
}

/// A run of a coil; what judges has no noise but that of its thermometer.
fn logged(coil: &Coil, case: Case, profile: &Profile, seed: u64, walk: f64) -> Run {
    let (drifts, shown) = coil.simulated(profile);
    let mut noise = Noise(seed);
    let channel = ChannelName::from("coil").unwrap();
    let mut events = Vec::new();
    for (sequence, (drift, shown)) in (0_u64..).zip(drifts.iter().zip(shown)) {
        let end_time = Timestamp::from_ns(((sequence + 1) as f64 * TICK_S * 1e9) as i64);
        if sequence % case.every_s == 0 {
            let raw = ((shown + case.reading_noise * noise.normal()) / RESOLUTION).round() * RESOLUTION;
            events.push(LogEvent::Temperature(TemperatureReading { channel, time: end_time, raw }));
        }
        // °/√h to the standard deviation of a tick in °/h.
        let sigma = walk * (3600.0 / TICK_S).sqrt();
        let readings = drift.map(|drift| (drift + sigma * noise.normal()) * DEG_PER_H);
        let tick = GyroTick {
            sequence,
            end_time,
            duration: Span::from_s(TICK_S),
            readings: readings.into_iter().collect(),
            ..GyroTick::default()
        };
        events.push(LogEvent::Gyro { output: OutputKind::Mean, tick });
    }
    Run::of_events("coil".to_owned(), unit_id("COIL").unwrap(), events)
}

/// Times by which the deviation of means falls, by gyro and length of the means; ones where the log is refused.
fn gains(coil: u64, case: Case, method: Method) -> [[f64; 3]; 3] {
    let (coil, seed) = (Coil::new(coil), 1000 + 2 * coil);
    let [fitted, judging] = programmes(case.holds);
    let train = logged(&coil, case, &fitted, seed, WALK);
    let judge = logged(&coil, case, &judging, seed + 1, 0.0);
    let settings = Settings { method, ..super::usual() };
    let made = match fit(None, (&[train], &[]), &settings) {
        Ok(made) => made,
        Err(error) => {
            println!("{}: {error}", case.name);
            return [[1.0; 3]; 3];
        }
    };
    let deviations = |document: &Document| {
        let loaded = Written::compiled(document).unwrap();
        MEANS_S.map(|length_s| {
            let table = Table::of(&judge, &loaded, length_s).unwrap();
            [0, 1, 2].map(|gyro| Size::of(table.rate(gyro)).deviation)
        })
    };
    let new = &made.written.document;
    let (before, after) =
        (deviations(&isotherm_calibration::fits::thermal::bare::bare(new)), deviations(new));
    if std::env::var_os("WORDS").is_some() {
        println!("{}: {}", case.name, made.report.headline());
    }
    [0, 1, 2].map(|gyro| [0, 1, 2].map(|length| before[length][gyro] / after[length][gyro]))
}

/// Geometric mean by length of the means.
fn mean(all: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|length| (all.iter().map(|gains| gains[length].ln()).sum::<f64>() / all.len() as f64).exp())
}

#[test]
#[ignore = "minutes: just accuracy"]
fn accuracy_on_simulated_coils() {
    println!(
        "Times by which the rms of means of 1 s / 10 s / 100 s falls: geometric mean of {COILS} coils with three gyros.\n"
    );
    println!("| case | method | all coils | coil by coil, means of 1 s | of 100 s |\n|---|---|---|---|---|");
    let wanted = std::env::var("CASE").unwrap_or_default();
    for case in CASES.into_iter().filter(|case| case.name.contains(&wanted)) {
        for method in [Method::Sequential, Method::Joint] {
            let coils: Vec<[f64; 3]> = (1..=COILS).map(|coil| mean(&gains(coil, case, method))).collect();
            let [a, b, c] = mean(&coils);
            let each = |length: usize| {
                coils.iter().map(|gains| format!("{:.0}", gains[length])).collect::<Vec<_>>().join(" ")
            };
            println!(
                "| {} | {} | {a:.1} / {b:.1} / {c:.1} | {} | {} |",
                case.name,
                method.name(),
                each(0),
                each(2)
            );
        }
    }
}

#[test]
fn a_coil_is_fitted_as_well_as_its_log_allows() {
    // A thermometer with noise, one that is read seldom, and ramps without holds.
    let cells = [(2, 1, [21.0, 21.0, 27.0]), (5, 2, [17.0, 17.0, 24.0]), (3, 3, [75.0, 75.0, 95.0])];
    for (case, coil, least) in cells {
        let reached = mean(&gains(coil, CASES[case], Method::Joint));
        println!("{}: {reached:.1?}", CASES[case].name);
        assert!(reached.iter().zip(least).all(|(reached, least)| *reached > least), "{reached:?}");
    }
}
