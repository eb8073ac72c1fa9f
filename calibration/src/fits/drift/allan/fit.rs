//! The five coefficients of IEEE 952 out of overlapping Allan variances.
//!
//! ```text
//! σ²(τ) = 3Q²/τ² + N²/τ + (2·ln 2/π)·B² + K²·τ/3 + R²·τ²/2
//! ```
//!
//! The squares are fitted by least squares, none below zero, weighted with the covariance that the fitted noise itself
//! gives the variances; fit and covariance are taken in turns until they agree. A coefficient that the log does not show
//! is left out of the fit, and an upper limit is stated in its place.
//!
//! Where the five terms do not describe a log within its statistics, the shortest τ, which are known best, would decide alone over what
//! the curve shows elsewhere. Then every point has a model error beside its statistical one, and counts as much as the others.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::confidence::{Mixture, PowerLaw, degrees_of_freedom};
use super::deviation::{Estimator, Variance};
use crate::lsq::linear::{self, SINGULAR, Weak};
use crate::numbers::real;

/// One coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Term {
    /// Q.
    Quantization,
    /// N.
    AngleRandomWalk,
    /// B.
    BiasInstability,
    /// K.
    RateRandomWalk,
    /// R.
    RateRamp,
}

impl Term {
    /// All of them, in the order of the powers of τ.
    pub const ALL: [Self; 5] = [
        Self::Quantization,
        Self::AngleRandomWalk,
        Self::BiasInstability,
        Self::RateRandomWalk,
        Self::RateRamp,
    ];

    /// Its letter.
    pub const fn symbol(self) -> &'static str {
        ["Q", "N", "B", "K", "R"][self as usize]
    }

    /// Its name.
    pub const fn name(self) -> &'static str {
        ["quantization", "angle random walk", "bias instability", "rate random walk", "rate ramp"]
            [self as usize]
    }

    /// σ²(τ) for a coefficient of one, τ in s.
    pub fn variance(self, tau_s: f64) -> f64 {
        match self {
            Self::Quantization => 3.0 / (tau_s * tau_s),
            Self::AngleRandomWalk => 1.0 / tau_s,
            Self::BiasInstability => 2.0 * std::f64::consts::LN_2 / std::f64::consts::PI,
            Self::RateRandomWalk => tau_s / 3.0,
            Self::RateRamp => tau_s * tau_s / 2.0,
        }
    }

    /// The kind of noise whose degrees of freedom hold where it dominates; a ramp counts as random walk.
    pub const fn law(self) -> PowerLaw {
        match self {
            Self::Quantization => PowerLaw::Quantization,
            Self::AngleRandomWalk => PowerLaw::White,
            Self::BiasInstability => PowerLaw::Flicker,
            Self::RateRandomWalk | Self::RateRamp => PowerLaw::RandomWalk,
        }
    }
}

/// What the fit says of a coefficient, in readings and seconds.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum Coefficient {
    /// The log shows it.
    Observed {
        /// Value.
        value: f64,
        /// Ends of its 95 % confidence interval.
        interval: [f64; 2],
    },
    /// The log does not show it.
    NotObservable {
        /// What it is below, with 97.5 % confidence.
        below: f64,
    },
}

impl Coefficient {
    /// The same in another unit.
    pub fn times(self, factor: f64) -> Self {
        match self {
            Self::Observed { value, interval } => {
                Self::Observed { value: value * factor, interval: interval.map(|end| end * factor) }
            }
            Self::NotObservable { below } => Self::NotObservable { below: below * factor },
        }
    }

    /// The value, or what it is below.
    pub const fn value_or_limit(&self) -> f64 {
        match *self {
            Self::Observed { value, .. } => value,
            Self::NotObservable { below } => below,
        }
    }
}

/// A fit.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseFit {
    /// By [`Term::ALL`], in readings and seconds.
    pub coefficients: [Coefficient; 5],
    /// χ² of the fit over its degrees of freedom; near 1 where the five terms describe the log.
    pub chi_square_per_degree: f64,
    /// Model error that every deviation is given, as a share of it: zero where the five terms describe the log without.
    pub model_error: f64,
}

/// Fits and covariances that are taken in turns.
const ROUNDS: usize = 6;
/// A squared coefficient below so many of its sigmas is not observable: 5 % on one side.
const LEAST_SIGMAS: f64 = 1.645;
/// χ² per degree of freedom beyond which the five terms do not describe a log.
const LARGEST_CHI_SQUARE: f64 = 3.0;
/// The same without a model error: beyond it the shortest τ decide over the others.
const LARGEST_EXACT_CHI_SQUARE: f64 = 2.0;
/// Model error of every deviation, as a share of it, where they do not.
const MODEL_ERROR: f64 = 0.1;
/// Half width of a 95 % interval in sigmas.
const SIGMAS_95: f64 = 1.96;

impl NoiseFit {
    /// Fits overlapping variances of readings every `tick_s`; `None` with fewer than three.
    pub fn of(variances: &[Variance], tick_s: f64) -> Option<Self> {
        let problem = Problem::new(variances, tick_s)?;
        let exact = problem.fit(0.0)?;
        let by_itself = exact.chi_square_per_degree <= LARGEST_EXACT_CHI_SQUARE;
        if by_itself { Some(exact) } else { problem.fit(MODEL_ERROR).or(Some(exact)) }
    }

    /// Whether the five terms describe the log, if only within the model error; otherwise something else than noise is in it, and its
    /// coefficients say nothing.
    pub fn describes(&self) -> bool {
        self.chi_square_per_degree <= LARGEST_CHI_SQUARE
    }

    /// The same of a log in pieces: its Allan differences do not span the gaps, over which a ramp would show.
    pub fn of_pieces(mut self, pieces: usize) -> Self {
        if pieces > 1 {
            self.coefficients[Term::RateRamp as usize] = Coefficient::NotObservable { below: f64::INFINITY };
        }
        self
    }

    /// What the fit says of a coefficient.
    pub const fn of_term(&self, term: Term) -> &Coefficient {
        &self.coefficients[term as usize]
    }

    /// σ²(τ) of the fit, by term.
    pub fn variances(&self, tau_s: f64) -> [f64; 5] {
        Term::ALL.map(|term| match self.of_term(term) {
            Coefficient::Observed { value, .. } => value * value * term.variance(tau_s),
            Coefficient::NotObservable { .. } => 0.0,
        })
    }

    /// The term that dominates at τ; angle random walk where nothing is observable.
    pub fn dominant(&self, tau_s: f64) -> Term {
        let of = self.variances(tau_s);
        let largest = Term::ALL.into_iter().max_by(|a, b| of[*a as usize].total_cmp(&of[*b as usize]));
        largest.filter(|term| of[*term as usize] > 0.0).unwrap_or(Term::AngleRandomWalk)
    }
}

/// A coefficient with the interval that χ² with its equivalent degrees of freedom gives its square.
fn observed(square: f64, sigma: f64) -> Coefficient {
    let degrees = 2.0 * (square / sigma.max(f64::MIN_POSITIVE)).powi(2);
    let [low, high] = interval(degrees);
    Coefficient::Observed { value: square.sqrt(), interval: [(square * low).sqrt(), (square * high).sqrt()] }
}

/// Factors to the ends of the 95 % interval of a variance with so many degrees of freedom.
pub fn interval(degrees: f64) -> [f64; 2] {
    if degrees > 1e5 {
        let half = SIGMAS_95 * (2.0 / degrees).sqrt();
        return [1.0 - half, 1.0 + half];
    }
    let degrees = degrees.max(1.0);
    ChiSquared::new(degrees).map_or([0.0, f64::INFINITY], |distribution| {
        [0.975, 0.025].map(|p| degrees / distribution.inverse_cdf(p))
    })
}

/// Variances with the columns of the terms.
struct Problem<'a> {
    variances: &'a [Variance],
    tick_s: f64,
    /// One row per variance, one column per term.
    design: DMatrix<f64>,
    values: DVector<f64>,
}

impl<'a> Problem<'a> {
    fn new(variances: &'a [Variance], tick_s: f64) -> Option<Self> {
        let count = variances.len();
        if count < 3 || variances.iter().any(|v| v.variance <= 0.0 || !v.variance.is_finite()) {
            return None;
        }
        let tau = |row: usize| variances.get(row).map_or(1.0, |v| real(v.ticks)) * tick_s;
        let design = DMatrix::from_fn(count, 5, |row, column| Term::ALL[column].variance(tau(row)));
        let values = DVector::from_iterator(count, variances.iter().map(|v| v.variance));
        Some(Self { variances, tick_s, design, values })
    }

    /// Fit and covariance in turns, with a model error of each deviation.
    fn fit(&self, model_error: f64) -> Option<NoiseFit> {
        let mut squares = self.first_guess()?;
        let mut whitened = self.whiten(&squares, model_error)?;
        for _ in 0..ROUNDS {
            squares = whitened.eliminate()?.0;
            whitened = self.whiten(&squares, model_error)?;
        }
        let (squares, kept) = whitened.eliminate()?;
        let (_, cost, sigmas) = whitened.solve(&kept)?;
        let degrees = self.variances.len().saturating_sub(kept.len()).max(1);
        let chi_square_per_degree = cost / real(degrees);
        let mut coefficients = [Coefficient::NotObservable { below: 0.0 }; 5];
        for (place, coefficient) in coefficients.iter_mut().enumerate() {
            let square = squares[place];
            *coefficient = match kept.iter().position(|term| *term == place) {
                Some(at) => observed(square, sigmas.get(at).copied().unwrap_or(0.0)),
                None => Coefficient::NotObservable { below: whitened.limit(&kept, place) },
            };
        }
        Some(NoiseFit { coefficients, chi_square_per_degree, model_error })
    }

    /// With the variances' own sizes as their weights.
    fn first_guess(&self) -> Option<[f64; 5]> {
        let sigmas = self.variances.iter().map(|v| {
            let degrees = degrees_of_freedom(Estimator::Overlapping, PowerLaw::White, v.ticks, v.differences);
            v.variance * (2.0 / degrees).sqrt()
        });
        let diagonal = DVector::from_iterator(self.values.len(), sigmas.map(|sigma| 1.0 / sigma));
        let weight = DMatrix::from_diagonal(&diagonal);
        let whitened = Whitened { design: &weight * &self.design, values: weight * &self.values };
        Some(whitened.non_negative(&[0, 1, 2, 3, 4])?.0)
    }

    /// Rows made independent and of unit variance, as the noise of these squares has them.
    fn whiten(&self, squares: &[f64; 5], model_error: f64) -> Option<Whitened> {
        let count = self.values.len();
        let [quantization, white, flicker, random_walk, ramp] = *squares;
        let mixture = Mixture {
            quantization: quantization / (self.tick_s * self.tick_s),
            white: white / self.tick_s,
            flicker,
            random_walk: random_walk * self.tick_s,
            ramp: ramp.sqrt() * self.tick_s,
        };
        let place = |row: usize| self.variances.get(row).map_or((1, 1), |v| (v.ticks, v.differences));
        let mut covariance = DMatrix::zeros(count, count);
        for (a, b) in (0..count).flat_map(|a| (0..=a).map(move |b| (a, b))) {
            covariance[(a, b)] = mixture.covariance(place(a), place(b));
            covariance[(b, a)] = covariance[(a, b)];
        }
        // What the model has no noise for still has some: no row counts for more than its own size allows.
        let model = &self.design * DVector::from_row_slice(squares);
        let floor = |row: usize| {
            let (ticks, differences) = place(row);
            let nu = degrees_of_freedom(Estimator::Overlapping, PowerLaw::White, ticks, differences);
            let of_model = 2.0 * model_error * self.values[row];
            1e-2 * 2.0 * model[row] * model[row] / nu + of_model * of_model
        };
        for row in 0..count {
            covariance[(row, row)] += floor(row);
        }
        // Rounding may leave no covariance: its rows are then taken to hang together a little less.
        let mut shrink = 1.0;
        let white = loop {
            let near =
                DMatrix::from_fn(count, count, |a, b| covariance[(a, b)] * if a == b { 1.0 } else { shrink });
            match linear::whitening(&near) {
                Some(white) => break white,
                None if shrink > 0.1 => shrink *= 0.9,
                None => return None,
            }
        };
        Some(Whitened { design: &white * &self.design, values: white * &self.values })
    }
}

/// Rows that are independent and of unit variance.
struct Whitened {
    design: DMatrix<f64>,
    values: DVector<f64>,
}

impl Whitened {
    /// Squares of these terms, cost, and the squares' sigmas; `None` where they cannot be told apart.
    fn solve(&self, terms: &[usize]) -> Option<(Vec<f64>, f64, Vec<f64>)> {
        if terms.is_empty() {
            return Some((Vec::new(), self.values.norm_squared(), Vec::new()));
        }
        let columns = self.design.select_columns(terms);
        let found = linear::solve(&columns, &self.values, Weak::Refuse(SINGULAR)).ok()?;
        let sigmas = (0..terms.len()).map(|index| found.sigma(index)).collect();
        Some((found.coefficients.iter().copied().collect(), found.chi_square(), sigmas))
    }

    /// The best squares among these terms of which none is below zero, and which of them are above.
    fn non_negative(&self, among: &[usize]) -> Option<([f64; 5], Vec<usize>)> {
        let mut best: Option<(f64, [f64; 5], Vec<usize>)> = None;
        // With five terms, all 31 choices are tried: nothing can be missed.
        for choice in 1_u32..1 << among.len() {
            let terms: Vec<usize> = among
                .iter()
                .enumerate()
                .filter(|(bit, _)| (choice >> bit) & 1 == 1)
                .map(|(_, term)| *term)
                .collect();
            let Some((squares, cost, _)) = self.solve(&terms) else { continue };
            if squares.iter().all(|square| *square > 0.0) && best.as_ref().is_none_or(|best| cost < best.0) {
                let mut all = [0.0; 5];
                terms.iter().zip(squares).for_each(|(term, square)| all[*term] = square);
                best = Some((cost, all, terms));
            }
        }
        best.map(|(_, squares, terms)| (squares, terms))
    }

    /// As [`non_negative`](Self::non_negative), without the terms that do not stand out, the least first.
    fn eliminate(&self) -> Option<([f64; 5], Vec<usize>)> {
        let mut among = vec![0, 1, 2, 3, 4];
        loop {
            let (squares, terms) = self.non_negative(&among)?;
            let (values, _, sigmas) = self.solve(&terms)?;
            let heights = values.iter().zip(&sigmas).map(|(value, sigma)| value / sigma);
            let least = terms.iter().zip(heights).min_by(|a, b| a.1.total_cmp(&b.1));
            match least {
                Some((term, height)) if height < LEAST_SIGMAS && terms.len() > 1 => {
                    among = terms.iter().copied().filter(|other| other != term).collect();
                }
                _ => return Some((squares, terms)),
            }
        }
    }

    /// What the coefficient of a term that was left out is below.
    fn limit(&self, kept: &[usize], term: usize) -> f64 {
        let mut terms = kept.to_vec();
        terms.push(term);
        let Some((squares, _, sigmas)) = self.solve(&terms) else { return f64::INFINITY };
        let square = squares.last().copied().unwrap_or(0.0).max(0.0);
        (square + SIGMAS_95 * sigmas.last().copied().unwrap_or(f64::INFINITY)).sqrt()
    }
}
