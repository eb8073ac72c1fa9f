//! Fibre-optic gyro: Sagnac rate, thermal drift of its coil, static bias of its optics.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::coil::{Conduction, Slab};
use crate::noise::{GyroNoise, Markov, Noise, Purpose};
use crate::polynomial;
use crate::thermal::Interval;
use crate::winding::{Fibre, Shupe};

/// One fibre-optic gyro.
///
/// Reading (rad/s, mean over the tick) = (input rate + drift)/K(T): K leads from the reading to the rate. T is
/// the coil's mean temperature; the gyro's temperature channel shows that of the outermost layer, which leads it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FibreOpticGyro {
    /// The coil as a heat conductor.
    pub coil: Slab,
    /// The fibre in it.
    pub fibre: Fibre,
    /// Reference temperature T₀ of scale, static bias and thermo-optic coefficient (°C).
    #[schemars(range(min = -100.0, max = 200.0))]
    pub reference_deg_c: f64,
    /// K at the reference temperature: true rate per indicated rate (dimensionless, near 1).
    #[schemars(range(min = 1e-6, max = 1e6))]
    pub scale: f64,
    /// κ1 (1/K) and κ2 (1/K²): K(T) = K0·(1 + κ1·(T − T₀) + κ2·(T − T₀)²).
    #[serde(default)]
    pub scale_per_k: [f64; 2],
    /// Static bias of the optics.
    #[serde(default)]
    pub bias: OpticsBias,
    /// Noise.
    #[serde(default)]
    pub noise: GyroNoise,
}

/// Static bias of a fibre gyro's optics: an offset and the ripple of a parasitic interferometer whose path
/// difference grows with temperature, b + a·sin(2π·(T − T₀)/P + p).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OpticsBias {
    /// Offset b (rad/s).
    #[schemars(range(min = -1e12, max = 1e12))]
    pub offset_rad_per_s: f64,
    /// Amplitude a of the ripple (rad/s).
    #[schemars(range(min = -1e12, max = 1e12))]
    pub ripple_rad_per_s: f64,
    /// Change of temperature P for one fringe (K, > 0).
    #[schemars(range(min = 1e-3, max = 1e6))]
    pub ripple_period_k: f64,
    /// Phase p at the reference temperature (rad).
    #[schemars(range(min = -1e12, max = 1e12))]
    pub ripple_phase_rad: f64,
}

impl Default for OpticsBias {
    fn default() -> Self {
        Self { offset_rad_per_s: 0.0, ripple_rad_per_s: 0.0, ripple_period_k: 100.0, ripple_phase_rad: 0.0 }
    }
}

impl OpticsBias {
    /// Bias at a distance from the reference temperature (rad/s).
    #[must_use]
    pub fn rad_per_s(&self, away_k: f64) -> f64 {
        let phase_rad = 2.0 * core::f64::consts::PI * away_k / self.ripple_period_k + self.ripple_phase_rad;
        self.offset_rad_per_s + self.ripple_rad_per_s * libm::sin(phase_rad)
    }
}

/// One fibre-optic gyro with its memory.
#[derive(Debug, Clone)]
pub(crate) struct FibreOpticState {
    gyro: FibreOpticGyro,
    conduction: Conduction,
    shupe: Shupe,
    markov: Markov,
    noise: Noise,
    pub(crate) sensor_deg_c: Interval,
    mean_deg_c: Interval,
    drift_rad_per_s: Interval,
}

impl FibreOpticState {
    pub(crate) fn new(gyro: &FibreOpticGyro, seed: u64, index: u32, step_s: f64, housing_deg_c: f64) -> Self {
        let mut state = Self {
            gyro: gyro.clone(),
            conduction: Conduction::new(&gyro.coil, step_s, housing_deg_c),
            shupe: Shupe::new(&gyro.fibre, gyro.coil.layers, gyro.coil.layer_thickness_m),
            markov: Markov::new(Noise::new(seed, Purpose::GyroDrift(index)), &gyro.noise, step_s),
            noise: Noise::new(seed, Purpose::Gyro(index)),
            sensor_deg_c: Interval::constant(housing_deg_c),
            mean_deg_c: Interval::constant(housing_deg_c),
            drift_rad_per_s: Interval::default(),
        };
        state.drift_rad_per_s = Interval::constant(state.slow_drift(housing_deg_c));
        state
    }

    fn slow_drift(&self, housing_deg_c: f64) -> f64 {
        let reference = self.gyro.reference_deg_c;
        let layers = self.conduction.layers(housing_deg_c).map(|(deg_c, rate)| (deg_c - reference, rate));
        let optics = self.gyro.bias.rad_per_s(self.mean_deg_c.to - reference);
        self.shupe.rad_per_s(layers) + optics + self.markov.value.to
    }

    pub(crate) fn thermal_step(&mut self, from_deg_c: f64, to_deg_c: f64) {
        self.conduction.step(from_deg_c, to_deg_c);
        self.markov.step();
        let (mut sum, mut outermost) = (0.0, to_deg_c);
        for (deg_c, _) in self.conduction.layers(to_deg_c) {
            sum += deg_c;
            outermost = deg_c;
        }
        self.mean_deg_c.advance(sum / f64::from(self.gyro.coil.layers.max(1)));
        self.sensor_deg_c.advance(outermost);
        let drift = self.slow_drift(to_deg_c);
        self.drift_rad_per_s.advance(drift);
    }

    /// Reading, true drift and servo transient (rad/s) of a tick.
    pub(crate) fn tick(&mut self, input_rad: f64, length_s: f64, share: f64) -> (f64, f64, f64) {
        let drift = self.drift_rad_per_s.at(share);
        let away_k = self.mean_deg_c.at(share) - self.gyro.reference_deg_c;
        let scale = self.gyro.scale * polynomial::scale(self.gyro.scale_per_k, away_k);
        let noise = self.noise.mean(self.gyro.noise.angle_random_walk_rad_per_sqrt_s, length_s);
        ((input_rad / length_s + drift + noise) / scale, drift, 0.0)
    }
}
