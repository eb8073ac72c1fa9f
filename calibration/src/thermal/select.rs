//! Cross-validation: which terms survive on stretches that they were not fitted to.

use std::borrow::Cow;

use super::branches::History;
use super::columns::{Columns, Term};
use super::model::{Dynamics, Spec};
use super::scale::{self, Kept};
use crate::lsq::weighted::{Pieces, Solution, once, solve};
use crate::robust::{block_length, is_white, median_if_any};

/// Score of a larger model, as a share of that of a smaller one, above which the smaller one is kept.
const NO_BETTER: f64 = 0.985;
/// Likewise for the drift with time, which stays out of the document and must be plain to be believed.
const PLAIN_DRIFT: f64 = 0.8;
/// Likewise for T̈, whose gain passes the thermometer's noise on as no other term does: what cross-validation sees is means over
/// minutes, in which that noise has gone, and a near-tie there costs many times what it gains in single ticks.
const PLAIN_ACCELERATION: f64 = 0.8;
/// Largest share of the mean's score with which an axis is accepted.
pub const WORTH_IT: f64 = 0.9;

/// How many times what is usual a temperature may count.
const CROWDED: f64 = 3.0;

/// One sensor's windows over all runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Target {
    /// What is to be explained, in the units of the coefficients.
    pub values: Vec<f64>,
    /// Weight of each window.
    pub weights: Vec<f64>,
    /// By window: its run.
    pub run: Vec<usize>,
    /// By window: time since its run's beginning as a share of the run, −0.5 to 0.5.
    pub share: Vec<f64>,
    /// Whether the level is known; otherwise each run has one of its own.
    pub level: bool,
    /// What a scale factor error of 1 ppm adds in each window; `None` where the scale factor stays.
    pub scale: Option<Vec<f64>>,
    /// Why it stays.
    pub kept: Option<Kept>,
}

/// One tried model.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// The model.
    pub spec: Spec,
    /// Number of its coefficients in the document.
    pub count: usize,
    /// Root mean square of what it leaves on stretches that it did not see.
    pub score: f64,
}

/// What cross-validation came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Score of the mean.
    pub mean: f64,
    /// Every model, in the order in which they were tried.
    pub tried: Vec<Tried>,
    /// Index of the chosen one; `None` where nothing could be judged.
    pub chosen: Option<usize>,
}

impl Choice {
    /// The chosen model.
    #[must_use]
    pub fn best(&self) -> Option<&Tried> {
        self.chosen.and_then(|index| self.tried.get(index))
    }
}

impl Target {
    /// Columns that take part in the fit and stay out of the document: a level for each run, and a drift with time.
    fn nuisance(&self, trend: bool) -> Vec<Vec<f64>> {
        let runs = self.run.last().map_or(0, |last| last + 1);
        let only = |of: usize, value: &dyn Fn(usize) -> f64| {
            (0..self.run.len()).map(|row| if self.run[row] == of { value(row) } else { 0.0 }).collect()
        };
        let levels = (0..if self.level { 0 } else { runs }).map(|of| only(of, &|_| 1.0));
        let drifts = (0..if trend { runs } else { 0 }).map(|of| only(of, &|row| self.share[row]));
        levels.chain(drifts).collect()
    }

    /// The largest scale factor error that the runs can tell.
    #[must_use]
    pub fn widest_scale(&self) -> Option<usize> {
        self.scale.as_ref().map(|_| scale::HIGHEST)
    }

    /// The columns of a model, in the order of its terms, those that stay out of the document behind.
    fn design<'a>(&self, columns: &'a Columns<'_>, spec: &Spec) -> Vec<Cow<'a, [f64]>> {
        let nuisance = self.nuisance(spec.trend).into_iter().map(Cow::Owned);
        spec.terms(self.level).into_iter().map(|term| self.column(columns, term)).chain(nuisance).collect()
    }

    /// The column of a term that was made; those of the scale factor are the sensor's own.
    #[must_use]
    pub fn column<'a>(&self, columns: &'a Columns<'_>, term: Term) -> Cow<'a, [f64]> {
        match (term, &self.scale) {
            (Term::Scale(power), Some(scale)) => {
                let powers = columns.get(Term::Static(power));
                Cow::Owned(powers.iter().zip(scale).map(|(power, scale)| power * scale).collect())
            }
            _ => Cow::Borrowed(columns.get(term)),
        }
    }

    /// Solves for a model; the coefficients come in the order of its terms, those that stay out of the document behind.
    #[must_use]
    pub fn solve(&self, columns: &Columns<'_>, spec: &Spec, robust: bool) -> Option<Solution> {
        let design = self.design(columns, spec);
        let all: Vec<&[f64]> = design.iter().map(AsRef::as_ref).collect();
        if robust {
            solve(&all, &self.values, &self.weights)
        } else {
            once(&all, &self.values, &self.weights)
        }
    }

    /// The level, and nothing else, where what it leaves is no more than noise.
    #[must_use]
    pub fn flat(&self, columns: &Columns<'_>) -> Option<Solution> {
        self.solve(columns, &Spec::default(), true).filter(|level| is_white(&level.residual))
    }

    /// Root mean square of what a model leaves on pieces that were left out one by one, over temperatures that the others have
    /// too. `None` where too little can be judged.
    #[must_use]
    pub fn score(
        &self,
        columns: &Columns<'_>,
        spec: &Spec,
        history: &History,
        temperature: &[f64],
    ) -> Option<f64> {
        let design = self.design(columns, spec);
        let all: Vec<&[f64]> = design.iter().map(AsRef::as_ref).collect();
        let pieces = history.piece.iter().max().map_or(0, |last| last + 1);
        // White noise is in every model alike: averaged over some windows it no longer hides which of them is better.
        let block = block_length(self.values.len());
        let (mut square, mut weight, mut judged) = (0.0, 0.0, 0);
        let fits = Pieces::of(&all, &self.values, &self.weights, &history.piece);
        for left_out in 0..pieces {
            let others = (0..self.values.len()).filter(|&row| history.piece[row] != left_out);
            let judging = others.filter(|&row| self.weights[row] > 0.0 && temperature[row].is_finite());
            let (low, high) = judging.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), row| {
                (low.min(temperature[row]), high.max(temperature[row]))
            });
            let rows: Vec<usize> = (0..self.values.len())
                .filter(|&row| {
                    history.piece[row] == left_out
                        && self.weights[row] > 0.0
                        && self.values[row].is_finite()
                        && (low..=high).contains(&temperature[row])
                })
                .collect();
            if rows.len() < 3 {
                continue;
            }
            let Some(coefficients) = fits.without(left_out) else { continue };
            let residual = |row: usize| {
                let terms = all.iter().zip(&coefficients);
                terms.fold(self.values[row], |left, (column, c)| left - c * column[row])
            };
            for block in rows.chunks(block) {
                let left = block.iter().map(|&row| (self.weights[row], residual(row)));
                let (sum, share) = left
                    .filter(|(_, left)| left.is_finite())
                    .fold((0.0, 0.0), |(sum, share), (w, left)| (sum + w * left, share + w));
                if share > 0.0 {
                    let mean = sum / share;
                    square += share * mean * mean;
                    weight += share;
                }
            }
            judged += 1;
        }
        (judged >= 2 && weight > 0.0).then(|| (square / weight).sqrt())
    }

    /// Scores the models of all degrees and dynamics and chooses the smallest that is as good as the best.
    #[must_use]
    pub fn choose(
        &self,
        columns: &Columns<'_>,
        (degrees, dynamics): (&[usize], &[Dynamics]),
        (history, temperature): (&History, &[f64]),
    ) -> Choice {
        let constant = Spec::default();
        let mean = self.score(columns, &constant, history, temperature).unwrap_or(f64::NAN);
        let mut tried = Vec::new();
        let mut try_one = |spec: Spec| {
            let score = self.score(columns, &spec, history, temperature)?;
            let count = spec.terms(self.level).len();
            tried.push(Tried { spec, count, score });
            Some(score)
        };
        for dynamics in dynamics {
            for &degree in degrees {
                try_one(Spec {
                    degree,
                    dynamics: dynamics.clone(),
                    trend: false,
                    scale: self.widest_scale(),
                });
            }
        }
        let mut chosen = smallest(&tried);
        if let Some(least) = chosen.and_then(|index| tried.get(index)).map(|best| best.score) {
            let drifting = self.with_drift(columns, &tried, (history, temperature));
            let first = tried.len();
            tried.extend(drifting);
            let plain = |(index, tried): (usize, &Tried)| {
                (tried.score < PLAIN_DRIFT * least).then_some((index, tried.score))
            };
            let best =
                tried.iter().enumerate().skip(first).filter_map(plain).min_by(|a, b| a.1.total_cmp(&b.1));
            chosen = best.map_or(chosen, |(index, _)| Some(index));
        }
        let chosen =
            chosen.and_then(|index| self.least_scale(columns, &mut tried, index, (history, temperature)));
        Choice { mean, tried, chosen }
    }
}

impl Target {
    /// Tries the chosen model with smaller scale factor errors, and without: the smallest that is as good.
    fn least_scale(
        &self,
        columns: &Columns<'_>,
        tried: &mut Vec<Tried>,
        chosen: usize,
        (history, temperature): (&History, &[f64]),
    ) -> Option<usize> {
        let first = tried.len();
        let (widest, own) = (self.widest_scale(), tried.get(chosen)?.clone());
        let smaller =
            widest.into_iter().flat_map(|widest| (usize::from(!self.level)..widest).map(Some).chain([None]));
        for scale in smaller {
            let spec = Spec { scale, ..own.spec.clone() };
            if let Some(score) = self.score(columns, &spec, history, temperature) {
                tried.push(Tried { count: spec.terms(self.level).len(), spec, score });
            }
        }
        let mut among: Vec<usize> = (first..tried.len()).collect();
        among.push(chosen);
        let models: Vec<Tried> = among.iter().filter_map(|&index| tried.get(index).cloned()).collect();
        smallest(&models).and_then(|best| among.get(best).copied())
    }

    /// The best model of each kind of dynamics once more, beside a drift with time.
    fn with_drift(
        &self,
        columns: &Columns<'_>,
        tried: &[Tried],
        (history, temperature): (&History, &[f64]),
    ) -> Vec<Tried> {
        let mut drifting: Vec<Tried> = Vec::new();
        for one in tried {
            let name = &one.spec.dynamics.name;
            // Without a dynamic term a drift takes what a lag has left, and the next run pays for it.
            if one.spec.dynamics.terms.is_empty()
                || drifting.iter().any(|done| done.spec.dynamics.name == *name)
            {
                continue;
            }
            let same = tried.iter().filter(|other| other.spec.dynamics.name == *name);
            let Some(best) = same.min_by(|a, b| a.score.total_cmp(&b.score)) else { continue };
            let spec = Spec { trend: true, ..best.spec.clone() };
            if let Some(score) = self.score(columns, &spec, history, temperature) {
                drifting.push(Tried { spec, count: best.count, score });
            }
        }
        drifting
    }
}

/// The smallest model that is hardly worse than the best; one with T̈ where all without are plainly worse.
fn smallest(tried: &[Tried]) -> Option<usize> {
    let has_acceleration =
        |tried: &Tried| tried.spec.dynamics.terms.iter().any(|term| matches!(term, Term::Acceleration(..)));
    let least = |acceleration: bool| {
        let own = tried.iter().filter(|tried| has_acceleration(tried) == acceleration);
        own.map(|tried| tried.score).fold(f64::INFINITY, f64::min)
    };
    let plain = least(true) < PLAIN_ACCELERATION * least(false);
    let best = least(plain);
    let among = tried.iter().enumerate().filter(|(_, tried)| plain || !has_acceleration(tried));
    let good = among.filter(|(_, tried)| tried.score * NO_BETTER <= best);
    good.min_by(|(_, a), (_, b)| {
        (a.count, a.score).partial_cmp(&(b.count, b.score)).unwrap_or(std::cmp::Ordering::Equal)
    })
    .map(|(index, _)| index)
}

/// Weights that keep slow parts from dominating: no temperature counts for more than `CROWDED` times what is usual, so that a hold of
/// hours weighs no more than some passes. Limited to a tenth, because what a plateau knows well is not to be thrown away. What is on
/// a plateau and at rest is counted for itself: the ends of the ramps, which alone tell of the fast lags, have the same temperatures.
#[must_use]
pub fn equal_temperature(temperature: &[f64], at_rest: &[bool], [low, high]: [f64; 2]) -> Vec<f64> {
    const BINS: f64 = 25.0;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 25")]
    let bin = |t: f64| ((t - low) / (high - low).max(1e-9) * BINS).clamp(0.0, BINS - 1.0) as usize;
    let mut counts = [[0.0_f64; 25]; 2];
    let windows = || temperature.iter().zip(at_rest);
    for (t, at_rest) in windows().filter(|(t, _)| t.is_finite()) {
        counts[usize::from(*at_rest)][bin(*t)] += 1.0;
    }
    let filled: Vec<f64> = counts[0].iter().copied().filter(|count| *count > 0.0).collect();
    let usual = CROWDED * median_if_any(&filled).unwrap_or(1.0);
    let weight = |(t, at_rest): (&f64, &bool)| {
        let among = if t.is_finite() { counts[usize::from(*at_rest)][bin(*t)] } else { return 0.0 };
        (usual / among.max(1.0)).clamp(0.1, 1.0)
    };
    windows().map(weight).collect()
}

/// All terms that some models have.
#[must_use]
pub fn terms_of(degrees: &[usize], dynamics: &[Dynamics]) -> Vec<Term> {
    let highest = degrees.iter().copied().max().unwrap_or(0);
    (0..=highest).map(Term::Static).chain(dynamics.iter().flat_map(|d| d.terms.iter().copied())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thermal::search::{lags, leading};

    #[test]
    fn a_gain_on_the_acceleration_must_be_plain() {
        let lags = lags(&[3.0, 27.0, 250.0], 1);
        let tried = |dynamics: &Dynamics, score: f64| {
            let spec = Spec { degree: 3, dynamics: dynamics.clone(), ..Spec::default() };
            Tried { count: spec.terms(true).len(), spec, score }
        };
        let chosen = |score: f64| smallest(&[tried(&lags, 1.0), tried(&leading(&lags), score)]);
        assert_eq!([0.97, 0.9, 0.7].map(chosen), [Some(0), Some(0), Some(1)]);
        assert_eq!(smallest(&[tried(&leading(&lags), 1.0)]), Some(0), "there is no other");
    }
}
