//! Rest frequency of the dither over temperature, for the servo's model (models §6).
//!
//! The frequency falls by some 30 Hz/°C, so the delay of the temperature behind the gyro shows in it: a column Ṫ, and one
//! (T − `T_ref`)·Ṫ, take it out of the polynomial. The delay is reported; a document cannot hold it.

use super::cells::{Cell, MAX_POWER};
use super::model::largest_order;
use super::units::LARGEST_HZ;
use crate::lsq::correlated::Data;
use crate::numbers::ends;
use crate::report::short;

/// Squared standard errors that the highest coefficient must be away from zero.
const BETTER: f64 = 4.0;
/// Standard errors that the delay must be away from zero to be told.
const SEEN: f64 = 3.0;
/// Largest order of the rest frequency.
const MAX_ORDER: usize = 2;
/// Smallest rate of temperature (°C/s) at which its delay can be told.
const SLOWEST_DEG_C_PER_S: f64 = 2e-3;

/// f0 over temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    /// Coefficients (Hz per °Cʲ) with their standard errors.
    pub coefficients: Vec<[f64; 2]>,
    /// Range of temperature (°C).
    pub range_deg_c: [f64; 2],
    /// Time by which the temperature lags behind the gyro (s), where the run shows it.
    pub delay_s: Option<f64>,
}

/// f0 of the gyro at a place among the three of the cells.
///
/// # Errors
/// That there is none, or one that no dither has.
pub fn found(cells: &[Cell], place: usize, reference_deg_c: f64) -> Result<Rest, String> {
    let rest = fit(cells, place, reference_deg_c).ok_or("the dither's rest frequency cannot be fitted")?;
    let rest_hz = rest.coefficients[0][0];
    if (0.0..LARGEST_HZ).contains(&rest_hz) {
        return Ok(rest);
    }
    Err(format!(
        "the dither's rest frequency comes out as {} Hz, 0 to {LARGEST_HZ} Hz are possible: check the columns of the half periods",
        short(rest_hz)
    ))
}

/// Fits f0 of the gyro at a place among the three of the cells; `None` without half-period counts.
fn fit(cells: &[Cell], place: usize, reference_deg_c: f64) -> Option<Rest> {
    let cells: Vec<&Cell> = cells.iter().filter(|cell| cell.dither_hz[place].is_finite()).collect();
    let temperature: Vec<f64> = cells.iter().map(|cell| cell.powers[0][place] + reference_deg_c).collect();
    let [low, high] = ends(temperature.iter().copied());
    let rates = rates(&cells, &temperature);
    let moving = rates.iter().filter(|rate| rate.abs() > SLOWEST_DEG_C_PER_S).count() * 4 > rates.len();
    let largest = largest_order(high - low, &mut Vec::new()).min(MAX_ORDER);
    let data = |order: usize| {
        let power = |j: usize| {
            move |cell: &&Cell| if j == 0 { 1.0 } else { cell.powers[j.min(MAX_POWER) - 1][place] }
        };
        let mut columns: Vec<Vec<f64>> = (0..=order).map(|j| cells.iter().map(power(j)).collect()).collect();
        if order > 0 && moving {
            columns.push(rates.clone());
            columns.push(rates.iter().zip(&cells).map(|(rate, cell)| rate * cell.powers[0][place]).collect());
        }
        Data {
            value: cells.iter().map(|cell| cell.dither_hz[place]).collect(),
            columns,
            time_s: cells.iter().map(|cell| cell.time_s).collect(),
            length_s: cells.iter().map(|cell| cell.good_s).collect(),
            joined: vec![false; cells.len()],
            quantum: 0.0,
        }
    };
    (0..=largest).rev().find_map(|order| {
        let data = data(order);
        if data.len() < 2 * data.columns.len() {
            return None;
        }
        let noise = data.noise();
        let solution = data.solve(noise)?;
        let covariance = data.covariance(noise)?;
        let sigma = |index: usize| covariance[(index, index)].sqrt();
        let highest = solution.coefficients[order];
        let variance = solution.covariance[(order, order)];
        if order > 0 && highest * highest < BETTER * variance {
            return None;
        }
        let slope = if order > 0 { solution.coefficients[1] } else { 0.0 };
        let delay = solution
            .coefficients
            .get(order + 1)
            .filter(|rate| slope != 0.0 && rate.abs() > SEEN * sigma(order + 1))
            .map(|rate| rate / slope);
        Some(Rest {
            coefficients: (0..=order).map(|index| [solution.coefficients[index], sigma(index)]).collect(),
            range_deg_c: [low, high],
            delay_s: delay,
        })
    })
}

/// Rate of temperature over neighbouring cells of a run (°C/s).
fn rates(cells: &[&Cell], temperature: &[f64]) -> Vec<f64> {
    const FAR_S: f64 = 1e8;
    let near = |a: usize, b: usize| (cells[a].time_s - cells[b].time_s).abs() < FAR_S;
    let rate = |row: usize| {
        let before = row.checked_sub(1).filter(|before| near(*before, row)).unwrap_or(row);
        let behind =
            Some(row + 1).filter(|behind| *behind < cells.len() && near(*behind, row)).unwrap_or(row);
        let length_s = cells[behind].time_s - cells[before].time_s;
        if length_s > 0.0 { (temperature[behind] - temperature[before]) / length_s } else { 0.0 }
    };
    (0..cells.len()).map(rate).collect()
}
