//! What runs behind a temperature: a low-pass by time, for heat that is conducted (models §8), or a play by the way itself, for parts
//! that stick (models §2).

use serde::{Deserialize, Serialize};

use crate::channel::{ThermalFilter, ThermalState};

/// Most thermal lags of one sensor.
pub const MAX_LAGS: usize = 8;
/// Most plays of one sensor, or of the axes of a kind.
pub const MAX_PLAYS: usize = 8;
/// Least and largest half width of a play (°C).
pub(crate) const PLAY_WIDTHS_DEG_C: [f64; 2] = [1e-3, 1e3];
/// Most of both.
pub(crate) const MAX_TRAILS: usize = MAX_LAGS + MAX_PLAYS;

/// One of them, compiled for the filter's grid step. Its state is a temperature (°C).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) enum Trail {
    /// `L_τ[T]`: e^(−step/τ) and 1/τ (1/s).
    Lag { decay: f64, per_second: f64 },
    /// `p_w[T]`: w (°C).
    Play { half_width_deg_c: f64 },
}

impl Trail {
    pub(super) fn lag(time_constant_s: f64, filter: &ThermalFilter) -> Self {
        let decay = libm::exp(-filter.grid_step.as_s() / time_constant_s);
        Self::Lag { decay, per_second: 1.0 / time_constant_s }
    }

    /// What the state is at the next grid point, at which the temperature is `temperature` (°C).
    fn next(self, state: f64, temperature: f64) -> f64 {
        match self {
            Self::Lag { decay, .. } => temperature + (state - temperature) * decay,
            Self::Play { half_width_deg_c } => drag(state, temperature, half_width_deg_c),
        }
    }

    /// What the state is where the temperature was not seen for a while: time has settled a lag, and nothing but temperature moves a
    /// play.
    fn resumed(self, state: f64, temperature: f64) -> f64 {
        match self {
            Self::Lag { .. } => temperature,
            Self::Play { .. } => self.next(state, temperature),
        }
    }

    /// What a coefficient is multiplied by: `(T − L)/τ` (°C/s) as a temperature and a factor, or `p − T` (°C) likewise.
    pub(super) fn feature(self, state: f64, temperature: f64) -> (f64, f64) {
        match self {
            Self::Lag { per_second, .. } => (temperature - state, per_second),
            Self::Play { .. } => (state - temperature, 1.0),
        }
    }

    /// The state on a ramp that has lasted for long; of a play at rest, amid its slack.
    ///
    /// From one grid point to the next a lag d = T − L becomes (d + Ṫ·step)·decay; it stays where it is at
    /// d = Ṫ·step·decay/(1 − decay), which is τ·Ṫ for a short step.
    fn settled(self, thermal: &ThermalState, filter: &ThermalFilter) -> f64 {
        let behind = match self {
            Self::Lag { decay, .. } => thermal.rate * filter.grid_step.as_s() * decay / (1.0 - decay),
            Self::Play { half_width_deg_c } if thermal.rate != 0.0 => {
                libm::copysign(half_width_deg_c, thermal.rate)
            }
            Self::Play { .. } => 0.0,
        };
        thermal.temperature - behind
    }
}

/// Where a play of half width `half_width_deg_c` (K) is dragged to from `state` (°C): no farther than into T ± w.
pub(crate) fn drag(state: f64, temperature: f64, half_width_deg_c: f64) -> f64 {
    state.max(temperature - half_width_deg_c).min(temperature + half_width_deg_c)
}

/// States of one sensor's (°C).
pub(crate) type Trailed = [f64; MAX_TRAILS];

/// Moves states on by one grid point, at which the temperature is `temperature` (°C).
pub(super) fn advance(trails: &[Trail], states: &mut Trailed, temperature: f64) {
    trails.iter().zip(states).for_each(|(trail, state)| *state = trail.next(*state, temperature));
}

/// Goes on from a temperature (°C) after a silence; `anew`, there is nothing to go on from.
pub(super) fn resume(trails: &[Trail], states: &mut Trailed, temperature: f64, anew: bool) {
    for (trail, state) in trails.iter().zip(states) {
        *state = if anew { temperature } else { trail.resumed(*state, temperature) };
    }
}

/// States on a ramp that has lasted for long.
pub(super) fn settled(trails: &[Trail], thermal: &ThermalState, filter: &ThermalFilter) -> Trailed {
    let mut states = [thermal.temperature; MAX_TRAILS];
    trails.iter().zip(&mut states).for_each(|(trail, state)| *state = trail.settled(thermal, filter));
    states
}
