//! Thermal lags on a ladder of time constants, and the models that are made with it.
//!
//! Heat conduction has a spectrum of time constants with nearly equal ratios, and neighbours in it can hardly be told apart: one ladder
//! that is close enough serves every coil. How much of each rung is believed is a matter of shrinking, not of searching.

use super::branches::History;
use super::columns::{Branch, Effect, millis};
use super::model::{Dynamics, Spec};

/// Time constants (s).
const LADDER_S: [f64; 7] = [5.0, 12.0, 30.0, 75.0, 190.0, 480.0, 1200.0];
/// Shortest time constant, in grid steps; and where a step is a reading that comes seldom (s), one of them: a coil answers faster.
const SHORTEST_GRID_STEPS: f64 = 3.0;
const SELDOM_S: f64 = 4.0;
/// Longest, as a share of the longest run: a longer one cannot be told from a drift with time.
const LONGEST_SHARE: f64 = 0.2;
/// Powers of temperature in the static bias beside lags: where the log tells lags from hysteresis, and where not; alone, likewise.
const DEGREES: [&[usize]; 2] = [&[3, 5], &[2, 3]];
const STATIC_DEGREES: [&[usize]; 2] = [&[1, 2, 3, 4, 5], &[1, 2, 3]];
/// Weights of zero against the gains of lags, as shares of the columns' variances.
const SHRINKS: [f64; 10] = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 5e-2, 0.3];
/// The least of them where the log does not tell lags from hysteresis: pieces of the same two passes agree with any.
const LEAST_UNTOLD: f64 = 5e-2;
/// Smoothings of the temperature that are tried (s); the first only where the log tells so fast a lag.
const SMOOTHINGS_S: [f64; 3] = [5.0, 20.0, 60.0];

/// A model that all sensors of a channel may have.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Highest power of temperature in the static bias.
    pub degree: usize,
    /// Time constants (s).
    pub taus_s: Vec<f64>,
    /// Power of temperature in the gains.
    pub gain_degree: usize,
    /// Weights of zero against them that are tried.
    pub shrinks: Vec<f64>,
    /// Whether gyros have T̈ beside them, for a thermometer that is behind a part of what it stands for.
    pub leads: bool,
}

impl Plan {
    /// The plans that a log can tell: with lags where the temperature goes both ways; with gains that follow temperature, and T̈, where
    /// holds or a third pass tell them from hysteresis.
    pub fn all(history: &History, grid_step_s: f64, longest_run_s: f64) -> Vec<Self> {
        if !history.both_directions() {
            return Vec::new();
        }
        let tells = history.tells_dynamics();
        let taus_s = taus(longest_run_s, grid_step_s);
        let degrees = DEGREES[usize::from(!tells)].iter();
        let shrinks: Vec<f64> = SHRINKS.into_iter().filter(|share| tells || *share >= LEAST_UNTOLD).collect();
        let plan = |(degree, leads)| Self {
            degree,
            taus_s: taus_s.clone(),
            gain_degree: usize::from(tells),
            shrinks: shrinks.clone(),
            leads,
        };
        degrees.flat_map(|&degree| [false, true].map(|leads| (degree, leads && tells))).map(plan).collect()
    }

    /// The model of a sensor.
    pub fn spec(&self, gyro: bool, scale: Option<usize>, shrink: f64) -> Spec {
        let mut dynamics = lags(&self.taus_s, self.gain_degree);
        if self.leads && gyro {
            dynamics.name.push_str(", T̈");
            dynamics.terms.push(Effect::Acceleration(Branch::Both).power(0));
        }
        Spec { degree: self.degree, dynamics, scale, shrink }
    }
}

/// Smoothings of the temperature that logs can tell (s).
pub fn smoothings_s(tells_dynamics: bool) -> &'static [f64] {
    SMOOTHINGS_S.get(usize::from(!tells_dynamics)..).unwrap_or(&[])
}

/// Models of the static bias alone.
pub fn statics(history: &History, scale: Option<usize>) -> Vec<Spec> {
    let degrees = STATIC_DEGREES[usize::from(!history.tells_dynamics())];
    degrees.iter().map(|&degree| Spec { degree, scale, ..Spec::default() }).collect()
}

/// Lags with gains of some degree in temperature.
pub fn lags(taus_s: &[f64], gain_degree: usize) -> Dynamics {
    let list: Vec<String> = taus_s.iter().map(|tau| format!("{}", libm::round(*tau))).collect();
    let plural = if taus_s.len() == 1 { "lag" } else { "lags" };
    let gain = match gain_degree {
        0 => String::new(),
        1 => ", gains linear in T".to_owned(),
        degree => format!(", gains of degree {degree} in T"),
    };
    let terms = taus_s.iter().flat_map(|tau| Effect::Lag(millis(*tau)).powers(0..=gain_degree));
    Dynamics { name: format!("{plural} of {} s{gain}", list.join(", ")), terms: terms.collect() }
}

/// The time constants of the ladder that a log can tell (s). Below the shortest one the fastest lag is taken there, once: a part that
/// answers faster than the grid can tell is fitted by it best.
fn taus(longest_run_s: f64, grid_step_s: f64) -> Vec<f64> {
    let steps = if grid_step_s < SELDOM_S { SHORTEST_GRID_STEPS } else { 1.0 };
    let shortest = (steps * grid_step_s).max(2.0);
    let longest = (LONGEST_SHARE * longest_run_s).max(4.0 * shortest);
    let mut taus: Vec<f64> =
        LADDER_S.iter().map(|tau| tau.max(shortest)).filter(|tau| *tau <= longest).collect();
    taus.dedup();
    taus
}
