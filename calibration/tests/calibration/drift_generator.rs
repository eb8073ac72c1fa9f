//! Known noise, and recordings of it.

use std::path::Path;

use isotherm_correction::sample::{GyroTick, OutputKind};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_log::text::LogEvent;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use crate::simulated_logs::record_events;

/// Normal deviates.
pub(crate) struct Normal {
    generator: Pcg64Mcg,
}

impl Normal {
    pub(crate) fn new(seed: u64) -> Self {
        Self { generator: Pcg64Mcg::seed_from_u64(seed) }
    }

    fn uniform(&mut self) -> f64 {
        (self.generator.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// By Box and Muller.
    pub(crate) fn next(&mut self) -> f64 {
        let (u, v) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    pub(crate) fn white(&mut self, count: usize, sigma: f64) -> Vec<f64> {
        (0..count).map(|_| sigma * self.next()).collect()
    }

    pub(crate) fn random_walk(&mut self, count: usize, step: f64) -> Vec<f64> {
        let mut sum = 0.0;
        let mut next = || {
            sum += step * self.next();
            sum
        };
        (0..count).map(|_| next()).collect()
    }

    /// Means over ticks of flicker of bias instability `b`: a sum of Markov processes, two per octave, whose densities add
    /// up to b²/(2πf).
    pub(crate) fn flicker(&mut self, count: usize, b: f64) -> Vec<f64> {
        // A process of variance v has the two-sided density 2vτ/(1 + ω²τ²); one per factor r of τ add up to
        // v/(2f·ln r), so v = b²·ln r/π. What is quicker than a tick is not nothing: in means over ticks it is white noise.
        let ratio = 2.0_f64.sqrt();
        let sigma = b * (ratio.ln() / std::f64::consts::PI).sqrt();
        let mut sum = vec![0.0; count];
        let mut tau = 1.0 / 32.0;
        while tau < 10.0 * count as f64 {
            let mut markov = Markov::new(self, sigma, 1.0 / tau);
            for value in &mut sum {
                *value += markov.next_mean(self);
            }
            tau *= ratio;
        }
        sum
    }
}

/// First-order Markov process, stepped exactly.
pub(crate) struct Markov {
    value: f64,
    decay: f64,
    drive: f64,
    /// Share of the values at a step's ends in the mean over it, and what the mean has beside them.
    ends: f64,
    between: f64,
}

impl Markov {
    /// Of stationary sigma, `step` correlation times per step.
    pub(crate) fn new(normal: &mut Normal, sigma: f64, step: f64) -> Self {
        let decay = (-step).exp();
        // Given both ends, the integral over a step is normal about τ·tanh(step/2) of their sum.
        let half = (0.5 * step).tanh();
        Self {
            value: sigma * normal.next(),
            decay,
            drive: sigma * (1.0 - decay * decay).sqrt(),
            ends: half / step,
            between: sigma * (2.0 * (step - 2.0 * half)).max(0.0).sqrt() / step,
        }
    }

    pub(crate) fn next(&mut self, normal: &mut Normal) -> f64 {
        self.value = self.decay * self.value + self.drive * normal.next();
        self.value
    }

    /// As [`next`](Self::next), but the mean over the step.
    pub(crate) fn next_mean(&mut self, normal: &mut Normal) -> f64 {
        let before = self.value;
        self.ends * (before + self.next(normal)) + self.between * normal.next()
    }
}

/// Writes rates (°/h) of three gyros as a recording; only ticks that `keep` holds for.
pub(crate) fn recording(
    path: &Path,
    serial: &str,
    columns: &[Vec<f64>; 3],
    tick_ns: i64,
    keep: impl Fn(usize) -> bool,
) {
    let tick = |index: usize| GyroTick {
        sequence: index as u64,
        end_time: Timestamp::from_ns((index as i64 + 1) * tick_ns),
        duration: Span::from_ns(tick_ns),
        readings: columns
            .iter()
            .map(|column| column[index] * (std::f64::consts::PI / 180.0 / 3600.0))
            .collect(),
        ..GyroTick::default()
    };
    let kept = (0..columns[0].len()).filter(|index| keep(*index));
    record_events(
        path,
        serial,
        kept.map(|index| LogEvent::Gyro { output: OutputKind::Mean, tick: tick(index) }),
    );
}
