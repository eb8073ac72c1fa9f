//! Mode reversal and slow meander of a Zeeman unit: when the electronics switch, and for how long the light is lost.

use isotherm_correction::sample::LasingMode;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::noise::{Noise, Purpose};

/// Mode reversal of a Zeeman unit, common to its gyros.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reversal {
    /// Time between switches (s, ≥ 0; 0 for a unit that stays in its first mode). The source unit has 120 s.
    pub period_s: f64,
    /// Start in the minus mode instead of the plus mode.
    #[serde(default)]
    pub starts_in_minus: bool,
    /// Shortest time without two-way generation after a switch (s, > 0). The source has 5 ms.
    #[schemars(range(min = 1e-6, max = 1.0))]
    pub lost_min_s: f64,
    /// Longest such time (s). The source has 15 ms. The time is drawn uniformly; a tick that it touches is lost.
    pub lost_max_s: f64,
    /// Time constant τ with which the perimeter servo pulls the miss in (s, > 0).
    #[schemars(range(min = 1e-4, max = 1e3))]
    pub servo_time_constant_s: f64,
    /// Standard deviation of the perimeter's miss after a switch, drawn for each gyro (fraction of a wavelength, ≥ 0).
    #[schemars(range(min = 0.0, max = 1.0))]
    pub miss_rms_wavelengths: f64,
    /// Curvature c of the dither frequency over the miss m: f = f0·(1 − c·m²) (≥ 0). The loss is cut off at ½.
    #[schemars(range(min = 0.0, max = 1e4))]
    pub dither_curvature: f64,
    /// Whether the dither turns with the lasing mode, as a magnetic field's effect on a Zeeman laser does: then the
    /// negative half of a tick comes first in the minus mode. False for electronics that invert the field with the mode, so
    /// that the positive half always comes first.
    #[serde(default)]
    pub dither_turns_with_mode: bool,
    /// Half period of the slow meander (s, ≥ 0); 0 for one that is not reported and has the sign +1 throughout.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1e6))]
    pub meander_half_period_s: f64,
}

/// What the electronics do in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Phase {
    pub(crate) mode: LasingMode,
    pub(crate) commanded: bool,
    /// No two-way generation: the counts carry nothing.
    pub(crate) lost: bool,
    /// A new miss is to be drawn: this is the first tick with the servo on again.
    pub(crate) servo_starts: bool,
    pub(crate) meander: Option<LasingMode>,
}

impl Phase {
    /// Of electronics that switch nothing.
    pub(crate) const UNSWITCHED: Self =
        Self { mode: LasingMode::Plus, commanded: false, lost: false, servo_starts: false, meander: None };
}

/// The electronics' clockwork.
#[derive(Debug, Clone)]
pub(crate) struct Clockwork {
    reversal: Reversal,
    noise: Noise,
    mode: LasingMode,
    switches: f64,
    lost_ticks: u32,
    servo_pending: bool,
}

impl Clockwork {
    pub(crate) fn new(reversal: Reversal, seed: u64) -> Self {
        let mode = if reversal.starts_in_minus { LasingMode::Minus } else { LasingMode::Plus };
        let noise = Noise::new(seed, Purpose::ModeSwitch);
        Self { reversal, noise, mode, switches: 0.0, lost_ticks: 0, servo_pending: false }
    }

    /// What happens in the tick that starts at `start_s`; `nominal_s` is the length of an undisturbed tick.
    pub(crate) fn tick(&mut self, start_s: f64, nominal_s: f64) -> Phase {
        const ROUNDING: f64 = 1e-9;
        let period_s = self.reversal.period_s;
        let commanded = period_s > 0.0 && start_s + 0.5 * nominal_s >= (self.switches + 1.0) * period_s;
        if commanded {
            self.switches += 1.0;
            self.mode = self.mode.reversed();
            let lost_s = self.noise.between(self.reversal.lost_min_s, self.reversal.lost_max_s);
            self.lost_ticks = whole(libm::ceil(lost_s / nominal_s - ROUNDING).max(1.0));
            self.servo_pending = true;
        }
        let lost = self.lost_ticks > 0;
        let servo_starts = !lost && self.servo_pending;
        self.lost_ticks = self.lost_ticks.saturating_sub(1);
        self.servo_pending &= lost;
        Phase {
            mode: self.mode,
            commanded,
            lost,
            servo_starts,
            meander: self.meander(start_s + 0.5 * nominal_s),
        }
    }

    fn meander(&self, time_s: f64) -> Option<LasingMode> {
        let half_s = self.reversal.meander_half_period_s;
        let halves = libm::floor(time_s / half_s);
        let odd = halves - 2.0 * libm::floor(0.5 * halves) > 0.5;
        (half_s > 0.0).then_some(if odd { LasingMode::Minus } else { LasingMode::Plus })
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "`as` saturates; a few ticks at most"
)]
fn whole(ticks: f64) -> u32 {
    ticks as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    const REVERSAL: Reversal = Reversal {
        period_s: 1.0,
        starts_in_minus: false,
        lost_min_s: 0.005,
        lost_max_s: 0.015,
        servo_time_constant_s: 0.04,
        miss_rms_wavelengths: 0.05,
        dither_curvature: 10.0,
        dither_turns_with_mode: false,
        meander_half_period_s: 0.5,
    };

    fn run(reversal: Reversal) -> Vec<Phase> {
        let mut clockwork = Clockwork::new(reversal, 5);
        (0..10_000).map(|tick| clockwork.tick(f64::from(tick) * 0.005, 0.005)).collect()
    }

    #[test]
    fn every_switch_loses_one_to_three_ticks_and_then_starts_the_servo() {
        let phases = run(REVERSAL);
        let switches: Vec<usize> = (0..phases.len()).filter(|&tick| phases[tick].commanded).collect();
        assert_eq!(switches, (1..50).map(|n| n * 200).collect::<Vec<_>>());
        let mut seen = [0; 4];
        for tick in switches {
            let lost = phases[tick..].iter().take_while(|phase| phase.lost).count();
            assert!((1..=3).contains(&lost));
            seen[lost] += 1;
            assert!(phases[tick + lost].servo_starts && !phases[tick + lost + 1].servo_starts);
            assert_eq!(phases[tick].mode, phases[tick - 1].mode.reversed());
        }
        assert!(seen[2] > 10 && seen[3] > 10, "{seen:?}");
    }

    #[test]
    fn a_fixed_lost_time_gives_a_fixed_number_of_ticks() {
        let fixed = Reversal { lost_min_s: 0.015, ..REVERSAL };
        assert_eq!(run(fixed).iter().filter(|phase| phase.lost).count(), 49 * 3);
    }

    #[test]
    fn the_meander_changes_its_sign_every_half_period() {
        let phases = run(REVERSAL);
        assert_eq!(phases[99].meander, Some(LasingMode::Plus));
        assert_eq!(phases[100].meander, Some(LasingMode::Minus));
        assert_eq!(phases[200].meander, Some(LasingMode::Plus));
        assert_eq!(run(Reversal { meander_half_period_s: 0.0, ..REVERSAL })[0].meander, None);
    }
}
