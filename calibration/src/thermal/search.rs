//! Time constants of thermal lags, by separable least squares.
//!
//! The gains enter linearly and are solved for at every trial of the time constants (variable projection), so that only
//! the time constants are searched. Several of them stand on a ladder with equal ratios: heat conduction has such a
//! spectrum, and neighbours on it can hardly be told apart, so that the two ends are all that a log can say of them.
//! What is searched is then one or two numbers on a grid, which finds the global minimum; a solver that follows the
//! gradient (the crate `varpro` was looked at: it stands on another version of nalgebra, and knows neither limits nor
//! weights that change) would have to be started at many places to be as sure.

use super::branches::History;
use super::columns::{Branch, Columns, Term, millis};
use super::model::{Dynamics, Spec};
use super::select::Target;
use crate::error::Error;

/// Shortest time constant, in grid steps; and where a step is a reading that comes seldom (s), one of them: a coil answers faster.
const SHORTEST_GRID_STEPS: f64 = 3.0;
const SELDOM_S: f64 = 6.0;
/// Longest, as a share of the longest run (a longer one cannot be told from a drift with time), and at all (s).
const LONGEST_SHARE: f64 = 0.1;
const LONGEST_S: f64 = 3000.0;
/// Points of the grid.
const POINTS: usize = 16;
/// Numbers of lags that are tried.
const COUNTS: [usize; 5] = [1, 2, 3, 5, 7];
/// Power of the static bias in the search.
const DEGREE: usize = 3;
/// Time constants of the fixed ladders (s).
const LADDERS: [&[f64]; 3] =
    [&[20.0, 100.0, 500.0], &[12.0, 30.0, 75.0, 190.0, 480.0], &[30.0, 100.0, 320.0, 1000.0, 2000.0]];
/// Time constants that the joint method offers alone (s).
const SINGLE: [f64; 3] = [30.0, 100.0, 300.0];

/// Lags with gains of some degree in temperature.
#[must_use]
pub fn lags(taus_s: &[f64], gain_degree: usize) -> Dynamics {
    let list: Vec<String> = taus_s.iter().map(|tau| format!("{}", libm::round(*tau))).collect();
    let plural = if taus_s.len() == 1 { "lag" } else { "lags" };
    let gain = match gain_degree {
        0 => String::new(),
        1 => ", gains linear in T".to_owned(),
        degree => format!(", gains of degree {degree} in T"),
    };
    let terms = taus_s.iter().flat_map(|tau| (0..=gain_degree).map(|power| Term::Lag(millis(*tau), power)));
    Dynamics { name: format!("{plural} of {} s{gain}", list.join(", ")), terms: terms.collect() }
}

/// Lags beside the thermal acceleration, for a thermometer that is behind a part of what it stands for. An accelerometer has none.
#[must_use]
pub fn leading(lags: &Dynamics) -> Dynamics {
    let mut dynamics = Dynamics { name: format!("{}, T̈", lags.name), terms: lags.terms.clone() };
    dynamics.terms.push(Term::Acceleration(Branch::Both, 0));
    dynamics
}

/// The dynamics that the joint method offers: 000's terms where the sensor can have them, and lags on a fixed ladder.
#[must_use]
pub fn ladders(gyro: bool, grid_step_s: f64, history: &History, longest_run_s: f64) -> Vec<Dynamics> {
    let named = |name: &str, terms: &[Term]| Dynamics { name: name.to_owned(), terms: terms.to_vec() };
    let mut all = vec![Dynamics::default()];
    if !history.both_directions() {
        return all;
    }
    if gyro {
        let (rate, acceleration) = (Term::Rate(Branch::Both, 0), Term::Acceleration(Branch::Both, 0));
        all.push(named("Ṫ", &[rate]));
        all.push(named("Ṫ, T̈", &[rate, acceleration]));
        let by_branch = [
            Term::Rate(Branch::RunUp, 0),
            Term::Rate(Branch::Braking, 0),
            Term::Acceleration(Branch::RunUp, 0),
            Term::Acceleration(Branch::Braking, 0),
        ];
        all.push(named("Ṫ±, T̈±", &by_branch));
    }
    let bounds = bounds(longest_run_s, grid_step_s);
    all.extend(within(&SINGLE, bounds).into_iter().map(|tau| lags(&[tau], 0)));
    if history.tells_dynamics() {
        let ladders = LADDERS.map(|ladder| within(ladder, bounds));
        if gyro {
            all.extend(ladders.iter().skip(1).map(|ladder| leading(&lags(ladder, 1))));
        }
        all.extend([1, 0].into_iter().flat_map(|gain| ladders.iter().map(move |ladder| lags(ladder, gain))));
    }
    all
}

/// The dynamics that the lag method offers: for every number of lags the time constants that explain the sensors of a channel
/// best together, with constant gains and, where the log can tell, gains that follow temperature.
///
/// # Errors
/// [`Error::Document`].
pub fn searched(
    columns: &mut Columns<'_>,
    targets: &[&Target],
    history: &History,
    longest_run_s: f64,
) -> Result<Vec<Dynamics>, Error> {
    let mut all = vec![Dynamics::default()];
    if !history.both_directions() || targets.is_empty() {
        return Ok(all);
    }
    let grid_step = columns.basis().filter.grid_step_s;
    let grid = ladder(bounds(longest_run_s, grid_step), POINTS);
    columns.make(&(0..=DEGREE).map(Term::Static).collect::<Vec<_>>())?;
    columns.make(&grid.iter().map(|tau| Term::Lag(millis(*tau), 0)).collect::<Vec<_>>())?;
    let gains = usize::from(history.tells_dynamics());
    for count in COUNTS.into_iter().take(if history.tells_dynamics() { COUNTS.len() } else { 1 }) {
        let mut best: Option<(f64, Vec<f64>)> = None;
        for first in 0..grid.len() {
            let lasts = if count == 1 { first..first + 1 } else { first + 1..grid.len() };
            for last in lasts {
                let taus = on_grid(&grid, first, last, count);
                if taus.len() < count {
                    continue;
                }
                let cost = cost(columns, targets, &taus);
                if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    best = Some((cost, taus));
                }
            }
        }
        let Some((_, taus)) = best else { continue };
        all.extend((0..=gains).map(|gain| lags(&taus, gain)));
    }
    Ok(all)
}

/// The shortest and the longest time constant that a log can tell (s).
fn bounds(longest_run_s: f64, grid_step_s: f64) -> [f64; 2] {
    let steps = if grid_step_s < SELDOM_S { SHORTEST_GRID_STEPS } else { 1.0 };
    let shortest = (steps * grid_step_s).max(2.0);
    [shortest, (LONGEST_SHARE * longest_run_s).min(LONGEST_S).max(4.0 * shortest)]
}

/// What a ladder has between two bounds. Below the shorter one the fastest lag is taken there, once: a part that answers faster than
/// the grid can tell is fitted by it best.
fn within(ladder: &[f64], [shortest, longest]: [f64; 2]) -> Vec<f64> {
    let mut taus: Vec<f64> =
        ladder.iter().map(|tau| tau.max(shortest)).filter(|tau| *tau <= longest).collect();
    taus.dedup();
    taus
}

/// Sum over the sensors of the logarithm of what is left.
fn cost(columns: &Columns<'_>, targets: &[&Target], taus: &[f64]) -> f64 {
    let spec = Spec { degree: DEGREE, dynamics: lags(taus, 0), ..Spec::default() };
    let left = |target: &&Target| {
        let spec = Spec { scale: target.widest_scale(), ..spec.clone() };
        target.solve(columns, &spec, false).map_or(0.0, |solution| libm::log(solution.rms))
    };
    targets.iter().map(left).sum()
}

/// Time constants with equal ratios between two ends.
fn ladder([from, to]: [f64; 2], count: usize) -> Vec<f64> {
    #[expect(clippy::cast_precision_loss, reason = "some dozens")]
    let ratio = libm::log(to / from) / (count.max(2) - 1) as f64;
    #[expect(clippy::cast_precision_loss, reason = "some dozens")]
    let tau = |step: usize| stated(from * libm::exp(ratio * step as f64));
    (0..count).map(tau).collect()
}

/// Points of the grid nearest to a ladder between two of them.
fn on_grid(grid: &[f64], first: usize, last: usize, count: usize) -> Vec<f64> {
    let steps = count.max(2) - 1;
    let at = |step: usize| first + ((last - first) * step + steps / 2) / steps;
    let mut places: Vec<usize> = (0..count).map(at).collect();
    places.dedup();
    places.into_iter().filter_map(|place| grid.get(place).copied()).collect()
}

/// Three digits: no log knows a time constant better.
fn stated(tau: f64) -> f64 {
    format!("{tau:.2e}").parse().unwrap_or(tau)
}
