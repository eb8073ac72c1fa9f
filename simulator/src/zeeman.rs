//! Zeeman laser gyro: a dithered counter, two lasing modes, and a perimeter servo.
//!
//! The counter's frequency is ±f(t) + Ω/K: the dither f has one sign in the first half of each tick and the other in the
//! second, Ω is input rate plus bias. Which sign comes first is a matter of wiring: the dither is a magnetic field, whose
//! effect turns with the lasing mode unless the electronics invert it with the mode. While the servo pulls the perimeter in, f grows to its rest value and
//! the halves do not cancel; the tick then carries an apparent rate, which is integrated here in closed form.

use isotherm_correction::sample::{HalfPeriodCounts, LasingMode};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::counter::Counter;
use crate::noise::{GyroNoise, Markov, Noise, Purpose};
use crate::polynomial;
use crate::reversal::{Phase, Reversal};
use crate::thermal::{Node, NodeState};

/// Temperature to which the slow meander's coefficients refer (°C).
pub const MEANDER_REFERENCE_DEG_C: f64 = 25.0;

/// All gyros of a Zeeman unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Zeeman {
    /// Whole counts, with the fraction carried over; otherwise exact reals (half-period counts are then rounded).
    pub quantised: bool,
    /// Mode reversal.
    pub reversal: Reversal,
    /// The gyros, 3…8.
    pub gyros: Vec<ZeemanGyro>,
}

/// One Zeeman laser gyro.
///
/// Counts of a tick = ∫(input rate + drift) dt/K(T): K is the angle per count and leads from the counts to the angle.
/// T is the gyro's own temperature, which its channel shows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ZeemanGyro {
    /// Thermal node behind the housing.
    pub node: Node,
    /// Reference temperature T₀ of all coefficients but the meander's (°C).
    #[schemars(range(min = -100.0, max = 200.0))]
    pub reference_deg_c: f64,
    /// K0: angle per count at the reference temperature (rad, > 0).
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub scale_rad_per_count: f64,
    /// κ1 (1/K) and κ2 (1/K²): K(T) = K0·(1 + κ1·(T − T₀) + κ2·(T − T₀)²).
    #[serde(default)]
    pub scale_per_k: [f64; 2],
    /// Non-magnetic bias C0, C1, C2 (rad/s) by powers of T − T₀; adds to the input rate.
    #[schemars(inner(range(min = -1e12, max = 1e12)))]
    pub bias_nonmagnetic_rad_per_s: [f64; 3],
    /// Magnetic bias B0, B1, B2 (rad/s) by powers of T − T₀; adds to the input rate with the mode's sign.
    #[schemars(inner(range(min = -1e12, max = 1e12)))]
    pub bias_magnetic_rad_per_s: [f64; 3],
    /// Slow meander D1, D0 (rad/s) by powers of T − 25 °C; adds to the input rate with the meander's sign.
    #[serde(default)]
    #[schemars(inner(range(min = -1e12, max = 1e12)))]
    pub meander_rad_per_s: [f64; 2],
    /// Rest value f0 of the dither frequency (Hz) by powers of T − T₀.
    #[schemars(inner(range(min = -1e7, max = 1e7)))]
    pub dither_hz: [f64; 3],
    /// Static lock-in rate L (rad/s, ≥ 0): below it the counter stands still, above it counts √(R² − L²) of a rate R, dither
    /// included. So the scale bends where the input comes near the dither's amplitude.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub lock_in_rad_per_s: f64,
    /// Noise.
    #[serde(default)]
    pub noise: GyroNoise,
}

/// A tick of one gyro.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ZeemanTick {
    pub(crate) counts: f64,
    pub(crate) halves: HalfPeriodCounts,
    pub(crate) drift_rad_per_s: f64,
    pub(crate) transient_rad_per_s: f64,
}

/// One gyro with its memory.
#[derive(Debug, Clone)]
pub(crate) struct ZeemanState {
    gyro: ZeemanGyro,
    quantised: bool,
    reversal: Reversal,
    pub(crate) node: NodeState,
    markov: Markov,
    noise: Noise,
    switches: Noise,
    counter: Counter,
    /// Relative loss of dither frequency when the servo came on, and the time since.
    dither_loss: f64,
    servo_age_s: f64,
}

impl ZeemanState {
    pub(crate) fn new(
        unit: &Zeeman,
        gyro: &ZeemanGyro,
        seed: u64,
        index: u32,
        step_s: f64,
        deg_c: f64,
    ) -> Self {
        let mut noise = Noise::new(seed, Purpose::Gyro(index));
        Self {
            gyro: *gyro,
            quantised: unit.quantised,
            reversal: unit.reversal,
            node: NodeState::new(gyro.node, step_s, deg_c),
            markov: Markov::new(Noise::new(seed, Purpose::GyroDrift(index)), &gyro.noise, step_s),
            counter: Counter::starting_at(noise.uniform()),
            noise,
            switches: Noise::new(seed, Purpose::Perimeter(index)),
            dither_loss: 0.0,
            servo_age_s: 0.0,
        }
    }

    pub(crate) fn thermal_step(&mut self, from_deg_c: f64, to_deg_c: f64) {
        self.node.step(from_deg_c, to_deg_c);
        self.markov.step();
    }

    fn drift_rad_per_s(&self, deg_c: f64, share: f64, phase: Phase) -> f64 {
        let away_k = deg_c - self.gyro.reference_deg_c;
        let meander_sign = phase.meander.map_or(1.0, LasingMode::sign);
        polynomial::at(&self.gyro.bias_nonmagnetic_rad_per_s, away_k)
            + phase.mode.sign() * polynomial::at(&self.gyro.bias_magnetic_rad_per_s, away_k)
            + meander_sign * polynomial::at(&self.gyro.meander_rad_per_s, deg_c - MEANDER_REFERENCE_DEG_C)
            + self.markov.value.at(share)
    }

    /// Counts of a tick from the input angle of its two halves.
    pub(crate) fn tick(
        &mut self,
        halves_rad: [f64; 2],
        length_s: f64,
        share: f64,
        phase: Phase,
    ) -> ZeemanTick {
        let deg_c = self.node.deg_c.at(share);
        let away_k = deg_c - self.gyro.reference_deg_c;
        let scale_rad = self.gyro.scale_rad_per_count * polynomial::scale(self.gyro.scale_per_k, away_k);
        let dither_hz = polynomial::at(&self.gyro.dither_hz, away_k);
        let drift_rad_per_s = self.drift_rad_per_s(deg_c, share, phase);
        let walk = self.gyro.noise.angle_random_walk_rad_per_sqrt_s;
        let noise_rad = if walk > 0.0 { walk * libm::sqrt(length_s) * self.noise.normal() } else { 0.0 };
        if phase.lost {
            return self.rubbish(dither_hz * 0.5 * length_s, drift_rad_per_s);
        }
        let turned = self.reversal.dither_turns_with_mode && phase.mode == LasingMode::Minus;
        let sign = if turned { -1.0 } else { 1.0 };
        let dither_counts =
            self.dither_counts(dither_hz, length_s, phase.servo_starts).map(|counts| sign * counts);
        let own_rad = 0.5 * (drift_rad_per_s * length_s + noise_rad);
        let lock_in = self.gyro.lock_in_rad_per_s * 0.5 * length_s / scale_rad;
        let first = beat((halves_rad[0] + own_rad) / scale_rad + dither_counts[0], lock_in);
        let second = beat((halves_rad[1] + own_rad) / scale_rad - dither_counts[1], lock_in);
        let positive = self.counter.count(first, self.quantised);
        let negative = self.counter.count(second, self.quantised);
        ZeemanTick {
            counts: positive + negative,
            halves: HalfPeriodCounts { positive: whole(positive), negative: whole(negative) },
            drift_rad_per_s,
            transient_rad_per_s: scale_rad * (dither_counts[0] - dither_counts[1]) / length_s,
        }
    }

    /// Counts without two-way generation: anything up to what the dither alone would give.
    fn rubbish(&mut self, limit: f64, drift_rad_per_s: f64) -> ZeemanTick {
        let positive = libm::round(self.switches.between(-limit, limit));
        let negative = libm::round(self.switches.between(-limit, limit));
        self.counter = Counter::starting_at(self.switches.uniform());
        ZeemanTick {
            counts: positive + negative,
            halves: HalfPeriodCounts { positive: whole(positive), negative: whole(negative) },
            drift_rad_per_s,
            transient_rad_per_s: 0.0,
        }
    }

    /// ∫f dt over each half of the tick, f = f0·(1 − loss·e^(−2t/τ)), t from the moment the servo came on.
    fn dither_counts(&mut self, rest_hz: f64, length_s: f64, servo_starts: bool) -> [f64; 2] {
        if servo_starts {
            let miss = self.reversal.miss_rms_wavelengths * self.switches.normal();
            self.dither_loss = (self.reversal.dither_curvature * miss * miss).min(0.5);
            self.servo_age_s = 0.0;
        }
        let rest = rest_hz * 0.5 * length_s;
        let rate_per_s = 2.0 / self.reversal.servo_time_constant_s;
        let begin = libm::exp(-rate_per_s * self.servo_age_s);
        self.servo_age_s += length_s;
        if self.dither_loss * begin < 1e-18 {
            self.dither_loss = 0.0;
            return [rest, rest];
        }
        let half = libm::exp(-rate_per_s * 0.5 * length_s);
        let first = self.dither_loss * begin * (1.0 - half) * rest_hz / rate_per_s;
        [rest - first, rest - first * half]
    }
}

/// Counts of a half period at a constant rate that would give `counts` without lock-in, which holds up to `lock_in` of them: the
/// mean of Adler's equation.
fn beat(counts: f64, lock_in: f64) -> f64 {
    if lock_in <= 0.0 {
        return counts;
    }
    libm::copysign(libm::sqrt((counts * counts - lock_in * lock_in).max(0.0)), counts)
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "float-to-int `as` saturates, as the counter's register does"
)]
fn whole(counts: f64) -> i32 {
    libm::round(counts) as i32
}

#[cfg(test)]
mod tests;
