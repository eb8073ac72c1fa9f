//! One weighted least-squares problem over all positions and temperatures (models §9).
//!
//! A position's outputs scatter for two reasons. White noise of each accelerometer is its own. An error of the stand's
//! positioning turns the case, and all accelerometers feel it at once: their residuals of that position are correlated, and the
//! weight is the inverse of the whole covariance
//!
//! ```text
//! V = diag(Q_i/τ) + σ²·Σ_k d_k·d_kᵀ        d_k: change of the outputs per radian about either axis across "up"
//! ```
//!
//! The stand's errors δ1…δ3 are parameters with a prior as wide as the stand may be out of level, so that few positions, which do
//! not tell them from the axes, give what they can with uncertainties that say so.

use nalgebra::{DMatrix, DVector, Vector3};

use super::model::{Degrees, Guess, SMALL, Sensor, Taken, across};
use super::plan::{Attitude, Plan, StandErrors};
use crate::lsq::linear;
use crate::lsq::nonlinear::{NoSolution, Solution, known, solve};

/// What is known of the errors beforehand.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    /// Intensity of the white noise of each accelerometer (output²·s).
    pub intensity: Vec<f64>,
    /// Standard deviation of the case's direction in a position: positioning and run-out together (rad).
    pub positioning_rad: f64,
    /// Standard deviation of δ1, δ2, δ3 beforehand (rad).
    pub levelling_rad: f64,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Degrees that it was found with.
    pub degrees: Degrees,
    /// The accelerometers.
    pub sensors: Vec<Sensor>,
    /// δ1, δ2, δ3 (rad) with standard errors.
    pub stand: [(f64, f64); 3],
    /// Parameters with their covariance, as [`Positions`] counts them.
    pub solution: Solution,
    /// First guesses, which the parameters are relative to.
    pub guess: Vec<Guess>,
}

impl Fit {
    /// Covariance of the directions of all axes at the reference: two angles (rad) per accelerometer.
    pub fn axes_covariance(&self, power: usize) -> DMatrix<f64> {
        let index = self.degrees.axes_indices(self.guess.len(), power);
        DMatrix::from_fn(index.len(), index.len(), |i, j| {
            self.solution.covariance[(index[i], index[j])] * SMALL * SMALL
        })
    }

    /// Standard errors of the elements of a sensor's row of C, by power (per scaled temperature to that power).
    pub fn axis_sigma(&self, sensor: usize, power: usize) -> [f64; 3] {
        let covariance = self.axes_covariance(power);
        let Some(guess) = self.guess.get(sensor) else { return [f64::NAN; 3] };
        let block = covariance.view((2 * sensor, 2 * sensor), (2, 2));
        [0, 1, 2].map(|i| {
            let [a, b] = [guess.across[0][i], guess.across[1][i]];
            (a * a * block[(0, 0)] + 2.0 * a * b * block[(0, 1)] + b * b * block[(1, 1)]).max(0.0).sqrt()
        })
    }
}

/// First guesses of all accelerometers; `Err` names those whose positions do not spread.
///
/// # Errors
/// Numbers of the accelerometers that the positions do not determine.
pub fn guesses(plan: &Plan, taken: &[Taken], sensors: usize) -> Result<Vec<Guess>, Vec<usize>> {
    let ups: Vec<[f64; 3]> = taken.iter().map(|taken| plan.up(taken.position, [0.0; 3])).collect();
    let of = |sensor: usize| {
        let outputs: Vec<f64> =
            taken.iter().map(|taken| taken.outputs.get(sensor).copied().unwrap_or(f64::NAN)).collect();
        Guess::of(&ups, &outputs).ok_or(sensor)
    };
    let found: Vec<Result<Guess, usize>> = (0..sensors).map(of).collect();
    let bad: Vec<usize> = found.iter().filter_map(|guess| guess.as_ref().err().copied()).collect();
    if bad.is_empty() { Ok(found.into_iter().flatten().collect()) } else { Err(bad) }
}

/// Positions to be fitted, and what is known of them beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Positions<'a> {
    /// The plan that they are of.
    pub plan: &'a Plan,
    /// The positions as they were taken.
    pub taken: &'a [Taken],
    /// First guesses of all accelerometers.
    pub guess: &'a [Guess],
    /// What is known of the errors.
    pub weights: &'a Weights,
    /// Degrees of the polynomials.
    pub degrees: Degrees,
}

/// Parameters: accelerometer by accelerometer K, S, a, b, each by powers; then δ1, δ2, δ3 (in thousandths).
impl Positions<'_> {
    /// Finds everything from them.
    ///
    /// # Errors
    /// Where they do not determine it.
    pub fn fit(&self) -> Result<Fit, NoSolution> {
        Ok(self.found(solve(&self.start(), self.residuals())?))
    }

    /// What [`Positions::fit`] will find of positions that are only planned, so that the first guess is the truth: nothing is
    /// searched for.
    ///
    /// # Errors
    /// Where they do not determine it.
    pub fn planned(&self) -> Result<Fit, NoSolution> {
        Ok(self.found(known(&self.start(), self.residuals())?))
    }

    /// What some of them say by themselves, at one temperature; `None` where they do not determine it.
    pub(super) fn alone(&self, taken: &[Taken]) -> Option<Fit> {
        Positions { taken, degrees: Degrees::NONE, ..*self }.fit().ok()
    }

    fn start(&self) -> Vec<f64> {
        vec![0.0; self.guess.len() * self.degrees.of_sensor() + 3]
    }

    /// Each accelerometer with its parameters.
    fn sensors<'a>(&'a self, p: &'a [f64]) -> impl Iterator<Item = (&'a Guess, (Degrees, &'a [f64]))> {
        let degrees = self.degrees;
        let own = p.chunks_exact(degrees.of_sensor());
        self.guess.iter().zip(own).map(move |(guess, own)| (guess, (degrees, own)))
    }

    /// Outputs of all accelerometers in a position under a direction of "up".
    fn outputs(&self, p: &[f64], taken: &Taken, up: [f64; 3]) -> DVector<f64> {
        let output = |(index, (guess, own)): (usize, (&Guess, (Degrees, &[f64])))| {
            guess.output(own, [taken.sensor_t[index], taken.axes_t], taken.ratio[index], up)
        };
        DVector::from_iterator(self.guess.len(), self.sensors(p).enumerate().map(output))
    }

    /// Residuals of all outputs, white, and of the stand's errors.
    fn residuals(&self) -> impl Fn(&[f64]) -> Vec<f64> {
        let whitening: Vec<DMatrix<f64>> = self.taken.iter().map(|taken| self.whitening(taken)).collect();
        let prior = self.weights.levelling_rad / SMALL;
        move |p: &[f64]| {
            let mut all = Vec::with_capacity(self.taken.len() * self.guess.len() + 3);
            for (taken, whitening) in self.taken.iter().zip(&whitening) {
                let up = self.plan.up(taken.position, errors(p));
                let away = DVector::from_column_slice(&taken.outputs) - self.outputs(p, taken, up);
                all.extend((whitening * away).iter());
            }
            all.extend(p[p.len() - 3..].iter().map(|error| error / prior));
            all
        }
    }

    /// L⁻¹ of V = L·Lᵀ for one position.
    fn whitening(&self, taken: &Taken) -> DMatrix<f64> {
        let (count, weights, start) = (self.guess.len(), self.weights, self.start());
        // A position without a stand behind it does not know which way the level is out.
        let sigma = match self.plan.positions[taken.position].attitude {
            Attitude::Up(_) => (weights.positioning_rad.powi(2) + weights.levelling_rad.powi(2)).sqrt(),
            Attitude::Stand(_) => weights.positioning_rad,
        };
        let noise = |i: usize, _| weights.intensity[i] / taken.duration_s;
        let mut covariance = DMatrix::from_diagonal(&DVector::from_fn(count, noise));
        let at_rest = self.outputs(&start, taken, [0.0; 3]);
        let up = self.plan.up(taken.position, [0.0; 3]);
        let first = Vector3::from(across(up)[0]);
        for direction in [first, Vector3::from(up).cross(&first)] {
            let change = self.outputs(&start, taken, direction.into()) - &at_rest;
            covariance += &change * change.transpose() * (sigma * sigma);
        }
        linear::whitening(&covariance).unwrap_or_else(|| DMatrix::from_element(count, count, f64::NAN))
    }

    fn found(&self, solution: Solution) -> Fit {
        let p = &solution.parameters;
        let errors = errors(p);
        Fit {
            degrees: self.degrees,
            sensors: self.sensors(p).map(|(guess, own)| guess.found(own)).collect(),
            stand: [0, 1, 2].map(|i| (errors[i], solution.sigma(p.len() - 3 + i) * SMALL)),
            guess: self.guess.to_vec(),
            solution,
        }
    }
}

/// The stand's errors among the parameters (rad).
fn errors(p: &[f64]) -> StandErrors {
    let from = p.len() - 3;
    [0, 1, 2].map(|i| p[from + i] * SMALL)
}
