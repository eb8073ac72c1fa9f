//! A thermal lag `g(T)·(T − L_τ[T])/τ`: the part of a bias that follows temperature through heat conduction (models §8).

use serde::{Deserialize, Serialize};

use crate::channel::{ThermalFilter, ThermalState};

/// Most thermal lags of one sensor.
pub const MAX_LAGS: usize = 8;

/// A lag's time constant, compiled for the filter's grid step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Lag {
    /// e^(−step/τ).
    pub(super) decay: f64,
    /// 1/τ (1/s).
    pub(super) per_second: f64,
}

impl Lag {
    pub(super) fn new(time_constant_s: f64, filter: &ThermalFilter) -> Self {
        let decay = libm::exp(-filter.grid_step.as_s() / time_constant_s);
        Self { decay, per_second: 1.0 / time_constant_s }
    }
}

/// Moves lags on by one grid point, at which the temperature is `temperature` (°C).
pub(super) fn advance(lags: &[Lag], lagged: &mut [f64; MAX_LAGS], temperature: f64) {
    for (lag, lagged) in lags.iter().zip(lagged) {
        *lagged = temperature + (*lagged - temperature) * lag.decay;
    }
}

/// `L_τ[T]` of each lag on a ramp that has lasted for long.
///
/// From one grid point to the next a lag d = T − L becomes (d + Ṫ·step)·decay; it stays where it is at
/// d = Ṫ·step·decay/(1 − decay), which is τ·Ṫ for a short step.
pub(super) fn settled(lags: &[Lag], thermal: &ThermalState, filter: &ThermalFilter) -> [f64; MAX_LAGS] {
    let mut lagged = [thermal.temperature; MAX_LAGS];
    for (lag, lagged) in lags.iter().zip(&mut lagged) {
        *lagged -= thermal.rate * filter.grid_step.as_s() * lag.decay / (1.0 - lag.decay);
    }
    lagged
}
