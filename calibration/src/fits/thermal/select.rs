//! Cross-validation: which model survives on stretches that it was not fitted to.

use std::borrow::Cow;

use nalgebra::DMatrix;

use super::branches::History;
use super::columns::{Columns, Effect, Term};
use super::ladder::{Plan, statics};
use super::model::Spec;
use super::noise::Noise;
use super::scale::{self, Kept};
use crate::lsq::folds::{Folds, Shrink};
use crate::lsq::weighted::{Solution, once, solve};
use crate::numbers::{block_length, ends, hull, is_white, median_if_any};

/// Score of a larger model, as a share of that of a smaller one, above which the smaller one is kept.
const NO_BETTER: f64 = 0.985;
/// Likewise for a static bias alone beside what the other sensors of its channel have: one log tells little of one sensor.
const PLAINLY_STATIC: f64 = 0.8;
/// Largest share of the mean's score with which an axis is accepted.
pub const WORTH_IT: f64 = 0.9;
/// How many times what is usual a temperature may count.
const CROWDED: f64 = 3.0;
/// Weight of zero against the highest power of the static bias, as a share of that against lags: beyond the temperatures of the log it
/// goes furthest astray.
const OF_HIGHEST: f64 = 0.2;

/// One sensor's windows over all runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Target {
    /// What is to be explained, in the units of the coefficients.
    pub values: Vec<f64>,
    /// Weight of each window.
    pub weights: Vec<f64>,
    /// By window: its run.
    pub run: Vec<usize>,
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
    /// Root mean square of what it leaves on stretches that it did not see, with the thermometer's noise that it passes on.
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
    pub fn best(&self) -> Option<&Tried> {
        self.chosen.and_then(|index| self.tried.get(index))
    }
}

impl Target {
    /// Columns that take part in the fit and stay out of the document: a level for each run where it is not known.
    fn levels(&self) -> Vec<Vec<f64>> {
        let runs = self.run.last().map_or(0, |last| last + 1);
        let only = |of: usize| self.run.iter().map(|run| f64::from(u8::from(*run == of))).collect();
        (0..if self.level { 0 } else { runs }).map(only).collect()
    }

    /// The largest scale factor error that the runs can tell.
    pub fn widest_scale(&self) -> Option<usize> {
        self.scale.as_ref().map(|_| scale::HIGHEST)
    }

    /// Columns of terms, and behind them those that stay out of the document.
    fn design<'a>(&self, columns: &'a Columns<'_>, terms: &[Term]) -> Vec<Cow<'a, [f64]>> {
        let levels = self.levels().into_iter().map(Cow::Owned);
        terms.iter().map(|term| self.column(columns, *term)).chain(levels).collect()
    }

    /// The column of a term that was made; those of the scale factor are the sensor's own.
    pub fn column<'a>(&self, columns: &'a Columns<'_>, term: Term) -> Cow<'a, [f64]> {
        match (term.effect, &self.scale) {
            (Effect::Scale, Some(scale)) => {
                let powers = columns.get(Effect::Static.power(term.power));
                Cow::Owned(powers.iter().zip(scale).map(|(power, scale)| power * scale).collect())
            }
            _ => Cow::Borrowed(columns.get(term)),
        }
    }

    /// Solves for a model without shrinking; the coefficients come in the order of its terms, those that stay out of the document behind.
    pub fn solve(&self, columns: &Columns<'_>, spec: &Spec, robust: bool) -> Option<Solution> {
        self.held(columns, spec, robust, None)
    }

    fn held(
        &self,
        columns: &Columns<'_>,
        spec: &Spec,
        robust: bool,
        holding: Option<&DMatrix<f64>>,
    ) -> Option<Solution> {
        let design = self.design(columns, &spec.terms(self.level));
        let all: Vec<&[f64]> = design.iter().map(AsRef::as_ref).collect();
        let solve = if robust { solve } else { once };
        solve(&all, &self.values, &self.weights, holding)
    }

    /// The level, and nothing else, where what it leaves is no more than noise.
    pub fn flat(&self, columns: &Columns<'_>) -> Option<Solution> {
        self.solve(columns, &Spec::default(), true).filter(|level| is_white(&level.residual))
    }
}

/// One sensor's rows, ready to be judged with any model of some terms.
#[derive(Debug)]
pub struct Trials<'a> {
    target: &'a Target,
    /// All terms.
    terms: Vec<Term>,
    folds: Folds,
    /// Covariance of all terms and levels from the thermometer's noise.
    noise: DMatrix<f64>,
}

impl<'a> Trials<'a> {
    /// Of a sensor with all terms that are to be tried, whose columns were made; windows by piece and temperature (°C), the point about
    /// which powers are taken.
    pub fn of(
        target: &'a Target,
        columns: &Columns<'_>,
        terms: &[Term],
        noise: &Noise,
        (piece, temperature): (&[usize], &[f64]),
    ) -> Self {
        let first = usize::from(!target.level);
        let widest =
            target.widest_scale().into_iter().flat_map(|widest| Effect::Scale.powers(first..=widest));
        let mut terms: Vec<Term> = terms.iter().copied().chain(widest).collect();
        terms.sort_unstable();
        terms.dedup();
        let design = target.design(columns, &terms);
        let all: Vec<&[f64]> = design.iter().map(AsRef::as_ref).collect();
        // White noise is in every model alike: averaged over some windows it no longer hides which of them is better.
        let block = block_length(target.values.len());
        let known = ranges(target, piece, temperature);
        let is_judged = |row: usize| {
            let [low, high] = known.get(piece[row]).copied().unwrap_or(ends([]));
            (low..=high).contains(&temperature[row])
        };
        let folds = Folds::of(&all, (&target.values, &target.weights), piece, is_judged, block);
        let away: Vec<f64> = temperature.iter().map(|t| t - columns.basis().reference_deg_c).collect();
        let noise = DMatrix::from_fn(all.len(), all.len(), |i, j| match (terms.get(i), terms.get(j)) {
            (Some(a), Some(b)) => noise.covariance(*a, *b, &away),
            _ => 0.0,
        });
        Self { target, terms, folds, noise }
    }

    /// Places of a model's columns, those that stay out of the document behind.
    fn places(&self, spec: &Spec) -> Vec<usize> {
        let place = |term: Term| self.terms.iter().position(|other| *other == term);
        let levels = self.terms.len()..self.noise.nrows();
        spec.terms(self.target.level).into_iter().filter_map(place).chain(levels).collect()
    }

    /// What stands against each coefficient of a model.
    fn shares(&self, spec: &Spec) -> Vec<f64> {
        let share = |term: &Term| match term.effect {
            Effect::Static if term.power == spec.degree => OF_HIGHEST * spec.shrink,
            Effect::Static | Effect::Scale => 0.0,
            _ => spec.shrink,
        };
        let levels = self.terms.len()..self.noise.nrows();
        self.terms.iter().map(share).chain(levels.map(|_| 0.0)).collect()
    }

    /// Root mean square of what a model leaves on pieces that were left out one by one, over temperatures that the others have too, with
    /// the noise that it passes on. `None` where too little can be judged.
    pub fn score(&self, spec: &Spec) -> Option<f64> {
        let share = self.shares(spec);
        self.folds.score(&self.places(spec), Shrink { share: &share, noise: &self.noise })
    }

    /// A model with its score.
    pub fn tried(&self, spec: Spec) -> Option<Tried> {
        let (score, count) = (self.score(&spec)?, spec.terms(self.target.level).len());
        Some(Tried { spec, count, score })
    }

    /// Solves for a model, its coefficients held as it says.
    pub fn solve(&self, columns: &Columns<'_>, spec: &Spec) -> Option<Solution> {
        let share = self.shares(spec);
        let shrink = Shrink { share: &share, noise: &self.noise };
        let holding = self.folds.holding(&self.places(spec), shrink)?;
        self.target.held(columns, spec, true, Some(&holding))
    }

    /// Root mean square of the thermometer's noise that found coefficients of terms pass on.
    pub fn passed_on(&self, found: &[(Term, f64)]) -> f64 {
        let placed: Vec<(usize, f64)> = found
            .iter()
            .filter_map(|(term, c)| Some((self.terms.iter().position(|other| other == term)?, *c)))
            .collect();
        let row =
            |&(i, a): &(usize, f64)| -> f64 { placed.iter().map(|&(j, b)| a * b * self.noise[(i, j)]).sum() };
        placed.iter().map(row).sum::<f64>().max(0.0).sqrt()
    }

    /// Chooses a sensor's model: what its channel has chosen for all, or a static bias alone where that is plainly better.
    pub fn choose(&self, tried: Vec<Tried>, plan: Option<Spec>, history: &History, largest: bool) -> Choice {
        let widest = self.target.widest_scale();
        let mean = self.score(&Spec::default()).unwrap_or(f64::NAN);
        let statics: Vec<Tried> =
            statics(history, widest).into_iter().filter_map(|spec| self.tried(spec)).collect();
        let plan = plan.and_then(|spec| self.tried(spec));
        let limit = plan.as_ref().map_or(f64::INFINITY, |plan| PLAINLY_STATIC * plan.score);
        let mut candidates: Vec<Tried> =
            statics.iter().filter(|tried| tried.score < limit).cloned().collect();
        if candidates.is_empty() {
            candidates.extend(plan);
        }
        let mut tried = [statics, tried].concat();
        let chosen = if largest {
            tried.iter().max_by(|a, b| a.count.cmp(&b.count).then(b.score.total_cmp(&a.score))).cloned()
        } else {
            smallest(&candidates).map(|best| self.least_scale(&mut tried, best))
        };
        let chosen = chosen.map(|chosen| {
            let place = tried.iter().position(|other| other.spec == chosen.spec);
            place.unwrap_or_else(|| {
                tried.push(chosen);
                tried.len() - 1
            })
        });
        Choice { mean, tried, chosen }
    }

    /// Tries the chosen model with smaller scale factor errors, and without: the smallest that is as good.
    fn least_scale(&self, tried: &mut Vec<Tried>, chosen: &Tried) -> Tried {
        let widest = self.target.widest_scale();
        let smaller = widest
            .into_iter()
            .flat_map(|widest| (usize::from(!self.target.level)..widest).map(Some).chain([None]));
        let mut models: Vec<Tried> =
            smaller.filter_map(|scale| self.tried(Spec { scale, ..chosen.spec.clone() })).collect();
        tried.extend(models.iter().cloned());
        models.push(chosen.clone());
        smallest(&models).unwrap_or(chosen).clone()
    }
}

/// What all sensors of a channel are explained best by together: the plan, how much it is shrunk, and the mean logarithm of their scores.
/// One log tells little of how much to believe; what conducts heat to one sensor does so to all.
pub fn together(plans: &[Plan], trials: &[(bool, &Trials<'_>)]) -> Option<(usize, f64, f64)> {
    let mut best: Option<(usize, f64, f64)> = None;
    for (index, plan) in plans.iter().enumerate() {
        for &shrink in &plan.shrinks {
            let score = |(gyro, trials): &(bool, &Trials<'_>)| {
                trials.score(&plan.spec(*gyro, trials.target.widest_scale(), shrink)).map(libm::log)
            };
            let Some(scores) = trials.iter().map(score).collect::<Option<Vec<f64>>>() else { continue };
            let sum: f64 = scores.iter().sum();
            if !scores.is_empty() && best.is_none_or(|(.., least)| sum < least) {
                best = Some((index, shrink, sum));
            }
        }
    }
    best
}

/// By piece: the range of temperatures (°C) that the other pieces have.
fn ranges(target: &Target, piece: &[usize], temperature: &[f64]) -> Vec<[f64; 2]> {
    let count = piece.iter().max().map_or(0, |last| last + 1);
    let mut own = vec![ends([]); count];
    for (row, piece) in piece.iter().enumerate() {
        let t = temperature[row];
        if t.is_finite() && target.weights[row] > 0.0 {
            own[*piece] = [own[*piece][0].min(t), own[*piece][1].max(t)];
        }
    }
    let of_others = |left_out: usize| {
        let others = own.iter().enumerate().filter(|(piece, _)| *piece != left_out);
        hull(others.map(|(_, own)| *own)).unwrap_or(ends([]))
    };
    (0..count).map(of_others).collect()
}

/// The smallest model that is hardly worse than the best.
pub(super) fn smallest(tried: &[Tried]) -> Option<&Tried> {
    let best = tried.iter().map(|tried| tried.score).fold(f64::INFINITY, f64::min);
    let good = tried.iter().filter(|tried| tried.score * NO_BETTER <= best);
    good.min_by(|a, b| a.count.cmp(&b.count).then(a.score.total_cmp(&b.score)))
}

/// Weights that keep slow parts from dominating: no temperature counts for more than `CROWDED` times what is usual, so that a hold of
/// hours weighs no more than some passes. Limited to a tenth, because what a plateau knows well is not to be thrown away. What is on
/// a plateau and at rest is counted for itself: the ends of the ramps, which alone tell of the fast lags, have the same temperatures.
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
