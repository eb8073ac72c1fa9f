//! What one gyro gathers: rate beyond the modelled bias, temperature and noise, per lasing mode.

use serde::{Deserialize, Serialize};

use super::outcome::ModeTotals;
use super::scatter::Scatter;
use crate::by_mode::ByMode;
use crate::sample::LasingMode;

/// Good ticks of one mode.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Gathered {
    pub(super) ticks: u64,
    pub(super) time_s: f64,
    /// ∫(K·P/Δt − Ω) dt (rad): the input and what is wrong with the bias.
    angle_rad: f64,
    /// ∫T dt (°C·s).
    temperature_s: f64,
    /// Stretches of consecutive good ticks: each begins and ends with a broken count.
    stretches: f64,
}

impl Gathered {
    /// Mean rate beyond the modelled bias (rad/s); `None` without a good tick.
    pub(super) fn rate_rad_per_s(&self) -> Option<f64> {
        (self.time_s > 0.0).then(|| self.angle_rad / self.time_s)
    }

    pub(super) fn totals(&self) -> ModeTotals {
        let mean_temperature_deg_c = (self.time_s > 0.0).then(|| self.temperature_s / self.time_s);
        ModeTotals { ticks: self.ticks, time_s: self.time_s, mean_temperature_deg_c }
    }

    /// Variance of the mean rate (rad²/s²): white noise of the rate over the time, and the counts that the stretches cut
    /// in two, each an error within ±1 count with a variance of 1/6.
    fn variance(&self, walk_squared: f64, count_rad: f64) -> Option<f64> {
        let angle = walk_squared * self.time_s + self.stretches * count_rad * count_rad / 6.0;
        (self.time_s > 0.0).then(|| angle / (self.time_s * self.time_s))
    }
}

/// One gyro.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct GyroRun {
    /// What one count is worth (rad); zero for a mean output.
    count_rad: f64,
    pub(super) modes: ByMode<Gathered>,
    scatter: Scatter,
    /// Whether the last tick was good, and its mode.
    last: (bool, Option<LasingMode>),
    pub(super) bad_ticks: u64,
}

impl GyroRun {
    pub(super) fn new(count_rad: f64) -> Self {
        Self { count_rad, ..Self::default() }
    }

    /// Takes a good tick: its rate beyond the modelled bias and its temperature.
    pub(super) fn good(
        &mut self,
        mode: Option<LasingMode>,
        rate_rad_per_s: f64,
        temperature_deg_c: f64,
        duration_s: f64,
    ) {
        let gathered = self.modes.get_mut(mode);
        gathered.ticks += 1;
        gathered.time_s += duration_s;
        gathered.angle_rad += rate_rad_per_s * duration_s;
        gathered.temperature_s += temperature_deg_c * duration_s;
        if core::mem::replace(&mut self.last, (true, mode)) != (true, mode) {
            gathered.stretches += 1.0;
        }
        self.scatter.add(mode, rate_rad_per_s, duration_s);
    }

    /// Takes a tick that says nothing.
    pub(super) fn bad(&mut self) {
        self.bad_ticks += 1;
        self.cut();
    }

    /// The next tick does not continue the last one.
    pub(super) fn cut(&mut self) {
        self.last.0 = false;
    }

    /// Whether it has lasing modes.
    pub(super) fn has_modes(&self) -> bool {
        self.modes.plus.ticks + self.modes.minus.ticks > 0
    }

    /// Standard error of either constant (rad/s); `None` while the noise is not known or a mode is missing.
    ///
    /// With modes C0 is half the sum of two independent means and B0 half their difference: the same error.
    pub(super) fn sigma_rad_per_s(&self) -> Option<f64> {
        let walk_squared = self.scatter.walk_squared_limit()?;
        let variance = |gathered: &Gathered| gathered.variance(walk_squared, self.count_rad);
        let variance = if self.has_modes() {
            0.25 * (variance(&self.modes.plus)? + variance(&self.modes.minus)?)
        } else {
            variance(&self.modes.without)?
        };
        Some(libm::sqrt(variance))
    }
}
