//! Time constant of the perimeter servo from the dither frequency behind the switches (models §6).
//!
//! Behind each switch f(k) = f0 − a·q^k, k counting the ticks behind the lost ones and q = e^(−2Δt/τ): a tick's mean of an
//! exponential is again one. f0 and a are different for every switch, q is common to all. For a given q both are linear,
//! so only τ is searched for (separable least squares).
//!
//! Whole half-period counts are no white noise: at rest the counter's fraction creeps, and the frequency jumps by two
//! counts whenever it wraps. So nothing is assumed of that noise but that it is the same behind all switches. The settled
//! half of the ticks behind a switch shows what it looks like in the direction of any decay: as much is taken off the
//! energy that τ is searched by, and as much is in the standard error.

use nalgebra::DVector;

use super::switches::Behind;

use crate::lsq::search::golden;
use crate::numbers::real;

/// Fewest ticks behind a switch, and fewest switches.
const LEAST: [usize; 2] = [24, 8];
/// Standard deviations by which the decay's energy must be above the noise's.
const SEEN: f64 = 5.0;
/// Largest relative standard error with which a time constant is stated.
const COARSEST: f64 = 0.3;

/// A gyro's servo as the switches show it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transient {
    /// τ (s).
    pub time_constant_s: f64,
    /// Its standard error (s).
    pub sigma_s: f64,
    /// Root mean square of f0 − f1, f1 being the frequency in the first tick behind the lost ones (Hz).
    pub loss_hz: f64,
    /// Mean of f0 over the switches (Hz).
    pub rest_hz: f64,
    /// Switches that it rests on.
    pub switches: usize,
}

/// Why there is none.
pub type Reason = String;

/// Fits the servo of one gyro; `lost` ticks behind a command carry nothing.
///
/// # Errors
/// Why it cannot be told.
pub fn fit(behind: &[Behind], sensor: usize, lost: usize) -> Result<Transient, Reason> {
    let rows: Vec<&[f64]> = behind.iter().filter_map(|one| one.dither_hz.get(sensor)?.get(lost..)).collect();
    if rows.len() < LEAST[1] {
        return Err(format!(
            "{} switches are followed by half-period counts, {} are needed for the servo's time constant",
            rows.len(),
            LEAST[1]
        ));
    }
    let length = rows.iter().map(|row| row.len()).min().unwrap_or(0);
    if length < LEAST[0] {
        return Err(format!(
            "{length} ticks lie between the lost ones and the next switch, {} are needed for the servo's time \
             constant",
            LEAST[0]
        ));
    }
    let half = length / 2;
    let tick_s = behind.iter().map(|one| one.tick_s).sum::<f64>() / real(behind.len());
    let rest_of = |row: &[f64]| row[half..length].iter().sum::<f64>() / real(length - half);
    let rest_hz = rows.iter().map(|row| rest_of(row)).sum::<f64>() / real(rows.len());
    let part = |row: &&[f64], from: usize| {
        DVector::from_iterator(half, row[from..from + half].iter().map(|f| f - rest_hz))
    };
    let decays: Vec<DVector<f64>> = rows.iter().map(|row| part(row, 0)).collect();
    let settled: Vec<DVector<f64>> = rows.iter().map(|row| part(row, half)).collect();
    let count = real(rows.len());
    let energy = |direction: &DVector<f64>, of: &[DVector<f64>]| {
        of.iter().map(|row| direction.dot(row).powi(2)).sum::<f64>()
    };
    let signal = |log_tau: f64| {
        let basis = Basis::of(log_tau, tick_s, half);
        energy(&basis.decay, &decays) - energy(&basis.decay, &settled)
    };
    let range = [libm::log(0.7 * tick_s), libm::log(0.4 * real(half) * tick_s)];
    let (log_tau, least) = golden(range, |log_tau| -signal(log_tau));
    let found = Basis::of(log_tau, tick_s, half);
    let noise = energy(&found.decay, &settled) / count;
    // Energies of so many squares scatter by their mean times √(2/n), and there are two sums of them.
    if -least < SEEN * 2.0 * (noise * noise * count).sqrt() {
        return Err("the dither frequency shows no transient after the switches".to_owned());
    }
    let across = energy(&found.turn, &settled) / count;
    let relative = (across / -least).sqrt() / found.bend;
    let inside = log_tau > range[0] + 0.01 && log_tau < range[1] - 0.01;
    if relative.is_nan() || relative >= COARSEST || !inside {
        return Err(format!(
            "{} switches at ticks of {tick_s:.4} s do not determine the servo's time constant",
            rows.len()
        ));
    }
    let time_constant_s = libm::exp(log_tau);
    Ok(Transient {
        time_constant_s,
        sigma_s: relative * time_constant_s,
        loss_hz: (-least / count).sqrt() / found.norm,
        rest_hz,
        switches: rows.len(),
    })
}

/// Directions of the fit for one τ, beside any rest frequency.
struct Basis {
    /// The decay, of length one.
    decay: DVector<f64>,
    /// Size of one Hz of loss in it.
    norm: f64,
    /// Where the decay turns with τ: beside the decay, of length one.
    turn: DVector<f64>,
    /// How much of the unit decay turns there, by ln τ.
    bend: f64,
}

impl Basis {
    fn of(log_tau: f64, tick_s: f64, length: usize) -> Self {
        let per_tick = 2.0 * tick_s / libm::exp(log_tau);
        let beside_level = |f: &dyn Fn(f64) -> f64| {
            let column = DVector::from_fn(length, |row, _| f(real(row)));
            let mean = column.mean();
            column.add_scalar(-mean)
        };
        let decay = beside_level(&|k| libm::exp(-per_tick * k));
        // ∂/∂ln τ of e^(−per_tick·k) is per_tick·k times itself.
        let derivative = beside_level(&|k| per_tick * k * libm::exp(-per_tick * k));
        let norm = decay.norm();
        let decay = decay / norm;
        let along = decay.dot(&derivative);
        let turn = derivative - &decay * along;
        let size = turn.norm();
        Self { decay, norm, turn: turn / size, bend: size / norm }
    }
}
