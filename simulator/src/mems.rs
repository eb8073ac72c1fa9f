//! Micromechanical gyro with a rate output: bias and scale over its own temperature, noise, resolution.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::noise::{GyroNoise, Markov, Noise, Purpose};
use crate::polynomial;
use crate::thermal::{Node, NodeState};

/// One micromechanical gyro.
///
/// Reading (rad/s, mean over the tick) = (input rate + bias(T))/K(T): K leads from the reading to the rate. T is
/// the gyro's own temperature, which its channel shows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MemsGyro {
    /// Thermal node behind the housing.
    pub node: Node,
    /// Reference temperature T₀ (°C).
    #[schemars(range(min = -100.0, max = 200.0))]
    pub reference_deg_c: f64,
    /// K at the reference temperature: true rate per indicated rate (dimensionless, near 1).
    #[schemars(range(min = 1e-6, max = 1e6))]
    pub scale: f64,
    /// κ1 (1/K) and κ2 (1/K²): K(T) = K0·(1 + κ1·(T − T₀) + κ2·(T − T₀)²).
    #[serde(default)]
    pub scale_per_k: [f64; 2],
    /// Bias (rad/s) by powers of T − T₀, 0…3.
    #[schemars(inner(range(min = -1e12, max = 1e12)))]
    pub bias_rad_per_s: [f64; 4],
    /// Step of the digital output (rad/s, ≥ 0; 0 for none).
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e12))]
    pub resolution_rad_per_s: f64,
    /// Noise.
    #[serde(default)]
    pub noise: GyroNoise,
}

/// One micromechanical gyro with its memory.
#[derive(Debug, Clone)]
pub(crate) struct MemsState {
    gyro: MemsGyro,
    pub(crate) node: NodeState,
    markov: Markov,
    noise: Noise,
}

impl MemsState {
    pub(crate) fn new(gyro: &MemsGyro, seed: u64, index: u32, step_s: f64, deg_c: f64) -> Self {
        Self {
            gyro: gyro.clone(),
            node: NodeState::new(gyro.node, step_s, deg_c),
            markov: Markov::new(Noise::new(seed, Purpose::GyroDrift(index)), &gyro.noise, step_s),
            noise: Noise::new(seed, Purpose::Gyro(index)),
        }
    }

    pub(crate) fn thermal_step(&mut self, from_deg_c: f64, to_deg_c: f64) {
        self.node.step(from_deg_c, to_deg_c);
        self.markov.step();
    }

    /// Reading, true drift and servo transient (rad/s) of a tick.
    pub(crate) fn tick(&mut self, input_rad: f64, length_s: f64, share: f64) -> (f64, f64, f64) {
        let away_k = self.node.deg_c.at(share) - self.gyro.reference_deg_c;
        let drift = polynomial::at(&self.gyro.bias_rad_per_s, away_k) + self.markov.value.at(share);
        let scale = self.gyro.scale * polynomial::scale(self.gyro.scale_per_k, away_k);
        let noise = self.noise.mean(self.gyro.noise.angle_random_walk_rad_per_sqrt_s, length_s);
        let reading = (input_rad / length_s + drift + noise) / scale;
        (polynomial::rounded(reading, self.gyro.resolution_rad_per_s), drift, 0.0)
    }
}
