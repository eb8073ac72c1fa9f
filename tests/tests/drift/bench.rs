//! A unit of six gyros that drift like those of 002, at rest, with a reference each minute.

use std::num::NonZero;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::drift::{DriftEstimate, DriftParts, Reference};
use isotherm_correction::orientation::Orientation;
use isotherm_correction::sample::{CorrectedTick, GyroTick, OutputKind};
use isotherm_correction::unit::{Event, Unit, UnitSettings};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_tests::calibrations::{compile, identity, orientation};

/// rad/s in one °/h.
pub(crate) const DEG_PER_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;
/// Gyros of the unit.
pub(crate) const GYROS: usize = 6;
/// Rate of the Earth at 55° in case axes that look north, east and down (rad/s).
pub(crate) const EARTH: [f64; 3] = [4.182_6e-5, 0.0, -5.973_3e-5];

/// 002, table 1: sigma over three runs of each gyro (°/h), and the range of its correlation time (h). Gyros 06011,
/// 07612, 08112, 08212, 08612, 08712.
const TABLE_1: [(f64, [f64; 2]); GYROS] = [
    (0.0040, [6.0, 8.0]),
    (0.0030, [6.0, 9.0]),
    (0.0035, [7.0, 12.0]),
    (0.0046, [10.0, 12.0]),
    (0.0029, [8.0, 12.0]),
    (0.0026, [7.0, 13.0]),
];
/// 002, table 1, last column: all runs together.
const TABLE_1_ALL: (f64, [f64; 2]) = (0.0034, [6.0, 13.0]);
/// 002, table 2, row 3: trend of 0.00016·t (°/h per h) over 48 h.
const TREND_DEG_PER_H2: f64 = 1.6e-4;
const TREND_CORRELATION_H: f64 = 48.0;
/// Not in 002, ours: turn-on bias (°/h) and angle random walk (°/√h). Over a minute the latter is 0.0039 °/h: as large
/// as the drift, so that a filter which weighs either wrongly shows it.
pub(crate) const INITIAL_SIGMA_DEG_PER_H: f64 = 0.05;
const ANGLE_RANDOM_WALK_DEG_PER_SQRT_H: f64 = 5e-4;

/// Ticks of 4 s, sent by the minute.
const TICK_S: f64 = 4.0;
const TICKS_PER_MINUTE: u64 = 15;

fn parts((sigma_deg_per_h, [shortest_h, longest_h]): (f64, [f64; 2])) -> DriftParts {
    DriftParts {
        sigma_rad_per_s: sigma_deg_per_h * DEG_PER_H,
        correlation_time_s: 3600.0 * 0.5 * (shortest_h + longest_h),
        trend_sigma_rad_per_s2: TREND_DEG_PER_H2 * DEG_PER_H / 3600.0,
        trend_correlation_time_s: 3600.0 * TREND_CORRELATION_H,
        initial_sigma_rad_per_s: INITIAL_SIGMA_DEG_PER_H * DEG_PER_H,
        angle_random_walk_rad_per_sqrt_s: ANGLE_RANDOM_WALK_DEG_PER_SQRT_H * 60.0 * DEG_PER_H,
    }
}

/// Drift of the six gyros as table 1 has it.
pub(crate) fn table_1() -> [DriftParts; GYROS] {
    TABLE_1.map(parts)
}

/// The same drift for all gyros: the table's last column.
pub(crate) fn all_runs() -> [DriftParts; GYROS] {
    [parts(TABLE_1_ALL); GYROS]
}

/// Normal deviates that are the same on every machine (`SplitMix64`, Marsaglia's polar method).
pub(crate) struct Noise {
    state: u64,
    spare: Option<f64>,
}

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        // The seed is scrambled: streams that start a few steps apart would be the same one.
        Self { state: scrambled(seed ^ 0x5851_F42D_4C95_7F2D), spare: None }
    }

    /// Uniform on −1…1.
    fn uniform(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        (scrambled(self.state) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub(crate) fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let (x, y) = (self.uniform(), self.uniform());
            let square = x * x + y * y;
            if square < 1.0 && square > 0.0 {
                let factor = (-2.0 * square.ln() / square).sqrt();
                self.spare = Some(y * factor);
                return x * factor;
            }
        }
    }
}

fn scrambled(state: u64) -> u64 {
    let z = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// True drift of one gyro, stepped tick by tick: independent of the estimator's formulas for long intervals.
pub(crate) struct Truth {
    parts: DriftParts,
    constant: f64,
    markov: f64,
    pub(crate) trend: f64,
}

impl Truth {
    fn new(parts: DriftParts, noise: &mut Noise) -> Self {
        Self {
            parts,
            constant: parts.initial_sigma_rad_per_s * noise.normal(),
            markov: parts.sigma_rad_per_s * noise.normal(),
            trend: parts.trend_sigma_rad_per_s2 * noise.normal(),
        }
    }

    /// ε now (rad/s).
    pub(crate) fn drift(&self) -> f64 {
        self.constant + self.markov
    }

    /// Goes on by a tick; what the gyro reads beyond its input, mean over the tick (rad/s).
    fn step(&mut self, noise: &mut Noise) -> f64 {
        let before = self.drift();
        let markov = |value: f64, sigma: f64, tau: f64, deviate: f64| {
            let decay = (-TICK_S / tau).exp();
            decay * value + sigma * (1.0 - decay * decay).sqrt() * deviate
        };
        let DriftParts { sigma_rad_per_s, correlation_time_s, .. } = self.parts;
        self.markov = markov(self.markov, sigma_rad_per_s, correlation_time_s, noise.normal());
        let trend = self.trend;
        let DriftParts { trend_sigma_rad_per_s2, trend_correlation_time_s, .. } = self.parts;
        self.trend = markov(trend, trend_sigma_rad_per_s2, trend_correlation_time_s, noise.normal());
        self.constant += 0.5 * (trend + self.trend) * TICK_S;
        let white = self.parts.angle_random_walk_rad_per_sqrt_s / TICK_S.sqrt() * noise.normal();
        0.5 * (before + self.drift()) + white
    }
}

/// Input axes along the six diagonals of an icosahedron: any three resolve the case axes.
const AXES: [[f64; 3]; GYROS] = {
    const S: f64 = 0.525_731_112_119_133_6;
    const C: f64 = 0.850_650_808_352_039_9;
    [[S, 0.0, C], [-S, 0.0, C], [C, S, 0.0], [C, -S, 0.0], [0.0, C, S], [0.0, C, -S]]
};

/// The calibration of a unit whose gyros look along [`AXES`] and state a drift.
pub(crate) fn calibration(stated: &[DriftParts; GYROS]) -> Arc<Calibration> {
    let mut parts = identity();
    parts.gyro_orientation = orientation(&AXES);
    parts.gyros.resize(GYROS, parts.gyros[0].clone());
    for (gyro, drift) in parts.gyros.iter_mut().zip(stated) {
        gyro.channel = None;
        gyro.drift = Some(*drift);
    }
    parts.gyro_orientation_channels.clear();
    parts.accels.clear();
    parts.accel_orientation = None;
    parts.accel_orientation_channels.clear();
    compile(&parts)
}

/// A unit at rest with its true drift.
pub(crate) struct Bench {
    pub(crate) unit: Unit,
    pub(crate) truth: [Truth; GYROS],
    noise: Noise,
    inputs: Vec<f64>,
    ticks: u64,
}

impl Bench {
    /// Gyros that drift by `drifts`, under a calibration that states `stated`.
    pub(crate) fn new(
        seed: u64,
        drifts: &[DriftParts; GYROS],
        stated: &[DriftParts; GYROS],
        subtract: bool,
    ) -> Self {
        let calibration = calibration(stated);
        let settings = UnitSettings { subtract_drift: subtract, ..UnitSettings::default() };
        let mut unit = Unit::new(settings);
        let axes = Orientation::new(&orientation(&AXES)).unwrap();
        let inputs = axes.forward(20.0, EARTH).to_vec();
        unit.install(calibration, 1);
        let mut noise = Noise::new(seed);
        let truth = drifts.map(|parts| Truth::new(parts, &mut noise));
        Self { unit, truth, noise, inputs, ticks: 0 }
    }

    /// As it should be: the calibration states the drift that is there, and nothing is subtracted.
    pub(crate) fn sound(seed: u64) -> Self {
        Self::new(seed, &table_1(), &table_1(), false)
    }

    pub(crate) fn now(&self) -> Timestamp {
        Timestamp::default() + Span::from_s(self.ticks as f64 * TICK_S)
    }

    /// One minute of ticks.
    pub(crate) fn tick_on(&mut self, emit: &mut dyn FnMut(&CorrectedTick)) {
        let ticks = self.minute();
        self.unit.handle(Event::Gyro { output: OutputKind::Mean, ticks: &ticks }, emit);
    }

    /// The raw ticks of one minute.
    pub(crate) fn minute(&mut self) -> Vec<GyroTick> {
        let tick = |bench: &mut Self| {
            bench.ticks += 1;
            let noise = &mut bench.noise;
            let readings = bench.truth.iter_mut().zip(&bench.inputs).map(|(t, input)| input + t.step(noise));
            GyroTick {
                sequence: bench.ticks,
                readings: readings.collect(),
                duration: Span::from_s(TICK_S),
                ..GyroTick::default()
            }
        };
        (0..TICKS_PER_MINUTE)
            .map(|_| GyroTick { end_time: self.now() + Span::from_s(TICK_S), ..tick(self) })
            .collect()
    }

    /// The reference of the last minute.
    pub(crate) fn reference(&self) -> Reference {
        let end = self.now();
        Reference { start: end - Span::from_ms(60_000), end, angular_rate: EARTH, sigma: 0.0 }
    }

    /// One minute with its reference, which takes effect in the next one.
    pub(crate) fn fed_minute(&mut self) {
        self.tick_on(&mut |_| {});
        let reference = self.reference();
        self.unit.handle(Event::Reference(&reference), &mut |_| {});
    }

    pub(crate) fn fed_hours(&mut self, hours: u32) {
        (0..60 * hours).for_each(|_| self.fed_minute());
    }

    pub(crate) fn blind_hours(&mut self, hours: u32) {
        (0..60 * hours).for_each(|_| self.tick_on(&mut |_| {}));
    }

    pub(crate) fn estimates(&self) -> [DriftEstimate; GYROS] {
        let all = self.unit.drift();
        std::array::from_fn(|i| all[i].unwrap())
    }

    /// Error of each estimate in its own sigmas.
    pub(crate) fn errors(&self) -> [f64; GYROS] {
        let estimates = self.estimates();
        std::array::from_fn(|i| (estimates[i].rate - self.truth[i].drift()) / estimates[i].sigma)
    }
}

/// Runs all seeds on all cores; results in the order of the seeds.
pub(crate) fn for_seeds<T: Send>(seeds: u64, run: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let (next, results) = (AtomicU64::new(0), Mutex::new(Vec::new()));
    let workers = thread::available_parallelism().map_or(1, NonZero::get);
    thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= seeds {
                        return;
                    }
                    let result = run(seed + 1);
                    results.lock().unwrap().push((seed, result));
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap();
    results.sort_by_key(|(seed, _)| *seed);
    results.into_iter().map(|(_, result)| result).collect()
}

/// Mean of numbers, and how many.
pub(crate) fn mean(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let (sum, count) = values.into_iter().fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
    (sum / count, count)
}

/// Share of numbers for which something holds, and how many there are.
pub(crate) fn share(values: &[f64], holds: impl Fn(f64) -> bool) -> (f64, f64) {
    mean(values.iter().map(|value| f64::from(u8::from(holds(*value)))))
}
