//! What an autopilot does with a sample: a cubic bias over temperature, scale and rotation, for gyro and accelerometer.

use super::Kernel;
use crate::error::Error;

/// Samples in a pass.
const SAMPLES: usize = 48_000;
/// Rounding of some ten operations on numbers of order one.
const ROUNDING: f64 = 1e-12;

/// Coefficients of one sensor triad.
#[derive(Debug, Clone)]
struct Triad {
    reference: f32,
    range: [f32; 2],
    /// Bias by power of temperature and axis.
    bias: [[f32; 3]; 4],
    scale: [f32; 3],
    rotation: [[f32; 3]; 3],
}

impl Triad {
    /// One sample, as autopilots have it: temperature clamped to the range of the fit, bias, scale, rotation. A call per
    /// sample, as they come: what follows is not known yet.
    #[inline(never)]
    fn correct(&self, sample: [f32; 3], temperature: f32) -> [f32; 3] {
        let delta = temperature.clamp(self.range[0], self.range[1]) - self.reference;
        let mut scaled = [0.0; 3];
        for (axis, (scaled, sample)) in scaled.iter_mut().zip(sample).enumerate() {
            let bias = self.bias.iter().rev().fold(0.0, |sum, power| sum * delta + power[axis]);
            *scaled = (sample - bias) * self.scale[axis];
        }
        self.rotation.map(|row| row.iter().zip(scaled).map(|(r, s)| r * s).sum())
    }
}

/// The autopilot.
#[derive(Debug)]
pub(crate) struct Peer {
    gyro: Triad,
    accel: Triad,
    samples: Vec<([f32; 3], [f32; 3], f32)>,
}

impl Peer {
    pub(crate) fn new() -> Self {
        let rotation =
            [[0.999_99, 2.0e-3, -1.0e-3], [-2.0e-3, 0.999_99, 3.0e-3], [1.0e-3, -3.0e-3, 0.999_99]];
        let triad = |size: f32| Triad {
            reference: 25.0,
            range: [-40.0, 85.0],
            bias: [[size, -size, 0.5 * size], [1e-2 * size; 3], [1e-4 * size; 3], [1e-6 * size; 3]],
            scale: [1.001, 0.999, 1.000_5],
            rotation,
        };
        #[expect(clippy::cast_precision_loss, reason = "a place among some ten thousand samples")]
        let sample = |index: usize| {
            let phase = index as f32 / SAMPLES as f32;
            ([0.1 * phase, -0.2, 0.3], [0.0, 9.8 * phase, 9.8], 20.0 + 10.0 * phase)
        };
        Self { gyro: triad(1e-3), accel: triad(2e-2), samples: (0..SAMPLES).map(sample).collect() }
    }
}

impl Kernel for Peer {
    fn name(&self) -> &'static str {
        "autopilot: cubic bias, scale, rotation"
    }

    fn ticks(&self) -> usize {
        self.samples.len()
    }

    #[inline(never)]
    fn pass(&mut self) -> f64 {
        let mut sum = 0.0;
        for (rate, force, temperature) in &self.samples {
            let rate = self.gyro.correct(*rate, *temperature);
            let force = self.accel.correct(*force, *temperature);
            let all: f32 = rate.iter().chain(&force).sum();
            sum += f64::from(all);
        }
        sum
    }

    fn check(&mut self) -> Result<(), Error> {
        let found = self.gyro.correct([0.5, 0.0, 0.0], 25.0);
        let expected = [0.5 - 1e-3, 1e-3, -0.5e-3];
        let worst = (0..3).map(|axis| {
            let scaled = expected.iter().zip(self.gyro.scale).map(|(x, s)| *x * f64::from(s));
            let rotated: f64 =
                self.gyro.rotation[axis].iter().zip(scaled).map(|(r, s)| f64::from(*r) * s).sum();
            (rotated - f64::from(found[axis])).abs()
        });
        let value = worst.fold(0.0, f64::max);
        let limit = ROUNDING.max(f64::from(f32::EPSILON));
        if value > limit {
            return Err(Error::Wrong {
                case: self.name().to_owned(),
                what: "error of the corrected rate (rad/s)",
                value,
                limit,
            });
        }
        Ok(())
    }
}
