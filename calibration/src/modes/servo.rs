//! Time constant of the perimeter servo from the dither frequency behind the switches (models §6).
//!
//! Behind each switch f_k = f0 − a·q^k, k counting the ticks behind the lost ones and q = e^(−2Δt/τ): a tick's mean of an
//! exponential is again one. f0 and a are different for every switch, q is common to all. For a given q both are linear,
//! so only τ is searched for (separable least squares). Whole counts make neighbouring frequencies correlated: the noise is
//! whitened by its own autocovariance, taken from the ticks where the servo has settled.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::minimum::golden;
use super::noise::real;
use super::switches::Behind;

/// Lags of the noise's autocovariance that are used.
const LAGS: usize = 3;
/// Fewest ticks behind a switch, and fewest switches.
const LEAST: [usize; 2] = [12, 4];
/// Most ticks behind a switch that are used.
const MOST: usize = 200;
/// Gain of χ² at which a transient is believed to be there.
const SEEN: f64 = 30.0;
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
    let rows: Vec<&[f64]> =
        behind.iter().filter_map(|one| one.dither_hz.get(sensor)?.get(lost..)).collect();
    if rows.len() < LEAST[1] {
        return Err(format!(
            "{} switches have half-period counts behind them, {} are needed to tell the servo's time constant",
            rows.len(),
            LEAST[1]
        ));
    }
    let length = rows.iter().map(|row| row.len()).min().unwrap_or(0).min(MOST);
    if length < LEAST[0] {
        return Err(format!(
            "{length} ticks lie between the lost ones and the next switch, {} are needed to tell the servo's time constant",
            LEAST[0]
        ));
    }
    let tick_s = behind.iter().map(|one| one.tick_s).sum::<f64>() / real(behind.len());
    let rows: Vec<DVector<f64>> = rows.iter().map(|row| DVector::from_column_slice(&row[..length])).collect();
    let whitener = whitener(&rows, length).ok_or("the dither frequency does not scatter at all")?;
    let white: Vec<DVector<f64>> = rows.iter().filter_map(|row| whitener.l().solve_lower_triangular(row)).collect();
    let basis = |log_tau: f64| Basis::of(&whitener, log_tau, tick_s, length);
    let explained = |log_tau: f64| -> f64 {
        basis(log_tau).map_or(0.0, |basis| white.iter().map(|row| basis.decay.dot(row).powi(2)).sum())
    };
    let range = [libm::log(0.7 * tick_s), libm::log(0.5 * real(length) * tick_s)];
    let (log_tau, least) = golden(range, |log_tau| -explained(log_tau));
    let null = real(white.len());
    if -least < null + SEEN.max(5.0 * (2.0 * null).sqrt()) {
        return Err("no transient of the dither frequency shows behind the switches".to_owned());
    }
    let found = basis(log_tau).ok_or("the transient is no exponential")?;
    // Information about ln τ: the derivative of the decay that neither its size nor the rest frequency can imitate.
    let sizes: f64 = white.iter().map(|row| found.decay.dot(row).powi(2)).sum();
    let freedom = real(white.len() * (length - 2) - 1);
    let left: f64 = white
        .iter()
        .map(|row| row.norm_squared() - found.decay.dot(row).powi(2) - found.level.dot(row).powi(2))
        .sum();
    let excess = (left / freedom).max(1.0);
    let information = (sizes - null * excess).max(0.0) * found.turn * found.turn / excess;
    let relative = 1.0 / information.sqrt();
    if !(relative < COARSEST) || log_tau < range[0] + 0.01 || log_tau > range[1] - 0.01 {
        return Err(format!(
            "the servo's time constant cannot be told from {} switches at ticks of {tick_s:.4} s",
            white.len()
        ));
    }
    let time_constant_s = libm::exp(log_tau);
    // The sizes' own noise is in their squares.
    let loss = (sizes - null * excess).max(0.0) / null;
    let rest = rows.iter().map(|row| row.rows(length / 2, length - length / 2).mean()).sum::<f64>() / null;
    Ok(Transient {
        time_constant_s,
        sigma_s: relative * time_constant_s,
        loss_hz: loss.sqrt() / found.norm,
        rest_hz: rest,
        switches: white.len(),
    })
}

/// Orthonormal columns of the fit for one τ, whitened.
struct Basis {
    level: DVector<f64>,
    decay: DVector<f64>,
    /// Length of the whitened decay beside the level: size of one Hz of loss.
    norm: f64,
    /// Length of the derivative of the unit decay by ln τ, beside both.
    turn: f64,
}

impl Basis {
    fn of(whitener: &Cholesky<f64, Dyn>, log_tau: f64, tick_s: f64, length: usize) -> Option<Self> {
        let per_tick = 2.0 * tick_s / libm::exp(log_tau);
        let white = |f: &dyn Fn(f64) -> f64| {
            let column = DVector::from_fn(length, |row, _| f(real(row)));
            whitener.l().solve_lower_triangular(&column)
        };
        let level = white(&|_| 1.0)?.normalize();
        let beside = |column: DVector<f64>| {
            let along = level.dot(&column);
            column - &level * along
        };
        let decay = beside(white(&|k| libm::exp(-per_tick * k))?);
        // ∂/∂ln τ of e^(−per_tick·k) is per_tick·k times itself.
        let derivative = beside(white(&|k| per_tick * k * libm::exp(-per_tick * k))?);
        let norm = decay.norm();
        let decay = decay / norm;
        let along = decay.dot(&derivative);
        let turn = (derivative - &decay * along).norm() / norm;
        Some(Self { level, decay, norm, turn })
    }
}

/// Cholesky factor of the noise's covariance, from the settled half of the ticks behind the switches.
fn whitener(rows: &[DVector<f64>], length: usize) -> Option<Cholesky<f64, Dyn>> {
    let half = length / 2;
    let mut sums = [0.0; LAGS + 1];
    let mut count = 0.0;
    for row in rows {
        let settled = row.rows(length - half, half);
        let mean = settled.mean();
        count += real(half) - 1.0;
        for (lag, sum) in sums.iter_mut().enumerate() {
            let products: f64 = (lag..half).map(|k| (settled[k] - mean) * (settled[k - lag] - mean)).sum();
            *sum += products * real(half) / real(half - lag);
        }
    }
    let autocovariance = sums.map(|sum| sum / count);
    if !(autocovariance[0] > 0.0) {
        return None;
    }
    let covariance = |taper: f64| {
        DMatrix::from_fn(length, length, |row, column| {
            let lag = row.abs_diff(column);
            autocovariance.get(lag).map_or(0.0, |value| if lag == 0 { *value } else { value * taper })
        })
    };
    // A cut-off autocovariance may be none of any noise; with less of its sides it is.
    [1.0, 0.8, 0.5, 0.0].into_iter().find_map(|taper| covariance(taper).cholesky())
}
