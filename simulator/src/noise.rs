//! Seeded random numbers whose bits are the same on every machine.
//!
//! The normal distribution is drawn here and not with `rand_distr`: that crate takes its logarithm and
//! exponential from whatever mathematics library the rest of the build switches on.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::thermal::Interval;

/// What a stream of random numbers is for; each purpose draws from its own, so that switching one source of
/// noise off leaves the others' values as they were.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    Gyro(u32),
    GyroDrift(u32),
    Accelerometer(u32),
    TemperatureChannel(u32),
    ModeSwitch,
    TickLength,
    Perimeter(u32),
}

impl Purpose {
    fn stream(self) -> u64 {
        let (family, index) = match self {
            Self::Gyro(index) => (1, index),
            Self::GyroDrift(index) => (2, index),
            Self::Accelerometer(index) => (3, index),
            Self::TemperatureChannel(index) => (4, index),
            Self::ModeSwitch => (5, 0),
            Self::TickLength => (6, 0),
            Self::Perimeter(index) => (7, index),
        };
        (family << 32) | u64::from(index)
    }
}

/// A seeded source of uniform and normal deviates.
#[derive(Debug, Clone)]
pub(crate) struct Noise {
    generator: Pcg64Mcg,
    spare: Option<f64>,
}

impl Noise {
    pub(crate) fn new(seed: u64, purpose: Purpose) -> Self {
        let mut scramble =
            Pcg64Mcg::seed_from_u64(seed ^ purpose.stream().wrapping_mul(0x9E37_79B9_7F4A_7C15));
        Self { generator: Pcg64Mcg::seed_from_u64(scramble.next_u64()), spare: None }
    }

    /// Uniform on [0, 1), 53 bits.
    #[expect(clippy::cast_precision_loss, reason = "the shift leaves 53 bits, which a double holds exactly")]
    pub(crate) fn uniform(&mut self) -> f64 {
        (self.generator.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// Uniform on [low, high).
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Standard normal, by Marsaglia's polar method.
    pub(crate) fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let (x, y) = (self.between(-1.0, 1.0), self.between(-1.0, 1.0));
            let square = x * x + y * y;
            if square < 1.0 && square > 0.0 {
                let factor = libm::sqrt(-2.0 * libm::log(square) / square);
                self.spare = Some(y * factor);
                return x * factor;
            }
        }
    }

    /// White noise in the mean of a tick, by its random walk; a sensor without draws nothing.
    pub(crate) fn mean(&mut self, random_walk: f64, length_s: f64) -> f64 {
        if random_walk > 0.0 { random_walk * self.normal() / libm::sqrt(length_s) } else { 0.0 }
    }
}

/// Random part of one gyro's drift; all zero makes a noise-free sensor.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GyroNoise {
    /// Angle random walk (rad/√s, ≥ 0); 1 °/√h is 2.9089e-4 rad/√s.
    #[schemars(range(min = 0.0, max = 1e12))]
    pub angle_random_walk_rad_per_sqrt_s: f64,
    /// Standard deviation of a first-order Markov drift (rad/s, ≥ 0). It is part of the true drift.
    #[schemars(range(min = 0.0, max = 1e12))]
    pub markov_drift_rad_per_s: f64,
    /// Correlation time of the Markov drift (s, > 0 where that drift is not zero).
    pub markov_correlation_s: f64,
}

/// First-order Gauss–Markov process, stepped exactly.
#[derive(Debug, Clone)]
pub(crate) struct Markov {
    noise: Noise,
    decay: f64,
    drive: f64,
    /// Its value over the present step.
    pub(crate) value: Interval,
}

impl Markov {
    pub(crate) fn new(mut noise: Noise, parameters: &GyroNoise, step_s: f64) -> Self {
        let sigma = parameters.markov_drift_rad_per_s;
        let decay = if sigma > 0.0 { libm::exp(-step_s / parameters.markov_correlation_s) } else { 0.0 };
        let value = if sigma > 0.0 { sigma * noise.normal() } else { 0.0 };
        let drive = sigma * libm::sqrt(1.0 - decay * decay);
        Self { noise, decay, drive, value: Interval::constant(value) }
    }

    pub(crate) fn step(&mut self) {
        let last = self.value.to;
        let driven = self.drive > 0.0;
        self.value.advance(if driven { self.decay * last + self.drive * self.noise.normal() } else { last });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_deviates_have_zero_mean_unit_variance_and_the_right_tails() {
        let mut noise = Noise::new(7, Purpose::Gyro(0));
        let draws: Vec<f64> = (0..200_000).map(|_| noise.normal()).collect();
        let count = 200_000.0;
        let mean = draws.iter().sum::<f64>() / count;
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / count;
        let beyond_two: f64 = draws.iter().map(|x| if x.abs() > 2.0 { 1.0 / count } else { 0.0 }).sum();
        assert!(mean.abs() < 0.01, "{mean}");
        assert!((variance - 1.0).abs() < 0.015, "{variance}");
        assert!((beyond_two - 0.0455).abs() < 0.002, "{beyond_two}");
    }

    #[test]
    fn streams_of_one_seed_differ_and_a_stream_repeats() {
        let first = |seed, purpose| Noise::new(seed, purpose).normal().to_bits();
        assert_eq!(first(1, Purpose::Gyro(0)), first(1, Purpose::Gyro(0)));
        assert_ne!(first(1, Purpose::Gyro(0)), first(1, Purpose::Gyro(1)));
        assert_ne!(first(1, Purpose::Gyro(0)), first(2, Purpose::Gyro(0)));
    }

    #[test]
    fn markov_drift_keeps_its_standard_deviation() {
        let parameters =
            GyroNoise { markov_drift_rad_per_s: 2.0, markov_correlation_s: 5.0, ..GyroNoise::default() };
        let mut markov = Markov::new(Noise::new(3, Purpose::GyroDrift(0)), &parameters, 1.0);
        let mut sum = 0.0;
        for _ in 0..100_000 {
            markov.step();
            sum += markov.value.to * markov.value.to;
        }
        let deviation = libm::sqrt(sum / 100_000.0);
        assert!((deviation - 2.0).abs() < 0.1, "{deviation}");
    }
}
