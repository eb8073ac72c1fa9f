//! Orders of the polynomials by cross-validation: what was fitted to cooling is judged on heating, and the other way round.

use isotherm_correction::thermal::Feature;

use super::cells::MAX_POWER;
use super::model::{Asked, FITTED, MEANDER_ORDER};
use crate::lsq::correlated::{Data, Noise, White};
use crate::lsq::linear::{self, SINGULAR, Weak};
use crate::numbers::ends;

/// Share of the range that cooling and heating must each cover to be folds.
const COVERED: f64 = 0.7;
/// Change of temperature over a stretch that is more than none (°C).
const MOVED_DEG_C: f64 = 0.1;
/// Folds where the directions are none.
const FOLDS: usize = 5;
/// χ² by which a larger model must be better than a smaller one: two standard deviations of one coefficient.
const BETTER: f64 = 4.0;

/// Orders of the three terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Model {
    /// Of the static bias.
    pub static_order: usize,
    /// Of the magnetic bias.
    pub magnetic_order: usize,
    /// Of the slow meander; `None` without the term.
    pub meander_order: Option<usize>,
}

impl Model {
    /// Its columns among all.
    pub fn columns(&self) -> Vec<usize> {
        let place = |(term, power): (usize, usize)| (MAX_POWER + 1) * term + power;
        self.powers().map(place).collect()
    }

    /// Term and power of each column.
    pub fn terms(&self) -> Vec<(Feature, usize)> {
        self.powers().map(|(term, power)| (FITTED[term], power)).collect()
    }

    /// The same, the term by its number.
    fn powers(&self) -> impl Iterator<Item = (usize, usize)> {
        let orders = [Some(self.static_order), Some(self.magnetic_order), self.meander_order];
        let powers = |(term, order): (usize, Option<usize>)| {
            order.into_iter().flat_map(move |order| (0..=order).map(move |power| (term, power)))
        };
        orders.into_iter().enumerate().flat_map(powers)
    }
}

/// What the cross-validation says of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// The model.
    pub model: Model,
    /// Squared prediction errors, in the variances of the noise.
    pub chi_square: f64,
    /// Means that were predicted.
    pub count: usize,
}

/// Parts of the run that are predicted from the others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Folds {
    /// Number of the fold of each mean.
    pub of: Vec<usize>,
    /// Whether they are cooling and heating.
    pub directions: bool,
}

impl Folds {
    /// Cooling and heating, where both cover the range; else pairs of stretches, every fifth in one fold.
    pub fn of(temperature: &[f64], time_s: &[f64], stretch: &[usize]) -> Self {
        let mut direction = 0;
        let mut of = Vec::with_capacity(temperature.len());
        for row in 0..temperature.len() {
            // Over two stretches: one behind, one ahead.
            let near = |other: &usize| stretch[*other].abs_diff(stretch[row]) <= 1;
            let first = (0..=row).rev().take_while(near).last().unwrap_or(row);
            let last = (row..temperature.len()).take_while(near).last().unwrap_or(row);
            let change = temperature[last] - temperature[first];
            if change.abs() > MOVED_DEG_C && time_s[last] - time_s[first] < 1e8 {
                direction = usize::from(change > 0.0);
            }
            of.push(direction);
        }
        let span = |wanted: Option<usize>| {
            let mine =
                temperature.iter().zip(&of).filter(|(_, of)| wanted.is_none_or(|wanted| wanted == **of));
            let [low, high] = ends(mine.map(|(t, _)| *t));
            (high - low).max(0.0)
        };
        let whole = span(None);
        if whole > 2.0 && [0, 1].into_iter().all(|direction| span(Some(direction)) > COVERED * whole) {
            Self { of, directions: true }
        } else {
            Self { of: stretch.iter().map(|number| number / 2 % FOLDS).collect(), directions: false }
        }
    }
}

/// Chooses the orders that were not given.
///
/// # Errors
/// Where none of the models can be fitted.
pub fn choose(
    data: &Data,
    noise: Noise,
    full: Model,
    asked: Asked,
    folds: &Folds,
    remarks: &mut Vec<String>,
) -> Result<(Model, Vec<Score>), String> {
    let limited = |name: &str, asked: Option<usize>, largest: usize, remarks: &mut Vec<String>| match asked {
        Some(order) if order > largest => {
            remarks.push(format!("{name} order {order} was requested, {largest} is the most for this run"));
            vec![largest]
        }
        Some(order) => vec![order],
        None => (0..=largest).collect(),
    };
    let of_static = limited("static", asked.static_order, full.static_order, remarks);
    let of_magnetic = limited("magnetic", asked.magnetic_order, full.magnetic_order, remarks);
    let of_meander: Vec<Option<usize>> = match (full.meander_order, asked.meander_order) {
        (None, Some(_)) => {
            remarks.push(
                "the log does not state the phase of the slow meander: its term cannot be separated from the static \
                 bias".to_owned(),
            );
            vec![None]
        }
        (None, None) => vec![None],
        (Some(largest), Some(order)) => vec![Some(order.min(largest).min(MEANDER_ORDER))],
        (Some(largest), None) => std::iter::once(None).chain((0..=largest).map(Some)).collect(),
    };
    let mut models = Vec::new();
    for &static_order in &of_static {
        for &magnetic_order in &of_magnetic {
            let model = |&meander_order| Model { static_order, magnetic_order, meander_order };
            models.extend(of_meander.iter().map(model));
        }
    }
    if let [only] = models[..] {
        return Ok((only, Vec::new()));
    }
    let white = data.whitened(noise);
    let judged = |model: Model| {
        Some(Score { model, chi_square: score(&white, &folds.of, &model.columns())?, count: data.len() })
    };
    let mut scores: Vec<Score> = models.into_iter().filter_map(judged).collect();
    scores.sort_by(|a, b| a.chi_square.total_cmp(&b.chi_square));
    let best =
        scores.first().ok_or("no order of its terms can be cross-validated: take a longer run")?.chi_square;
    // The first of the smallest is the best of them.
    let near = scores.iter().filter(|score| score.chi_square <= best + BETTER);
    let chosen = near.min_by_key(|score| score.model.columns().len()).map(|score| score.model);
    Ok((chosen.unwrap_or(full), scores))
}

/// What columns leave of each fold when they are fitted to the others, over all folds.
fn score(white: &White, folds: &[usize], columns: &[usize]) -> Option<f64> {
    let design = white.columns.select_columns(columns);
    let left_in = |fold: usize| {
        let (own, others): (Vec<usize>, Vec<usize>) = (0..folds.len()).partition(|row| folds[*row] == fold);
        let values = white.value.select_rows(&others);
        let found = linear::solve(&design.select_rows(&others), &values, Weak::Refuse(SINGULAR)).ok()?;
        let left = white.value.select_rows(&own) - design.select_rows(&own) * found.coefficients;
        Some(left.norm_squared())
    };
    let mut all = folds.to_vec();
    all.sort_unstable();
    all.dedup();
    all.into_iter().map(left_in).sum()
}
