//! Which plateau is which step of the table.

use super::bins::Bin;
use super::plateaus::{Plateau, within};
use super::steps::Step;
use crate::finding::Kind;
use crate::numbers::{ends, median};

/// Share of the smallest stated rate below which a plateau is a rest.
const REST: f64 = 0.5;
/// Share of the smallest stated rate that a rest may still show: bias, and what the document does not know of it.
const AT_REST: f64 = 0.2;
/// Share of the smallest stated rate by which rests may differ from each other.
const RESTS_ALIKE: f64 = 0.05;
/// What rests may show and differ by in any case (°/h): three times the Earth's rate, which turns with the case.
const EARTH_DEG_PER_H: f64 = 45.0;
/// Share by which a plateau may differ from its step, scale and axes being as good as unknown.
const MISMATCH: f64 = 0.05;

/// A step with its plateau.
#[derive(Debug, Clone, PartialEq)]
pub struct Matched {
    /// The step.
    pub step: Step,
    /// Its plateau.
    pub plateau: Plateau,
    /// Rate relative to the stars along the case axes (°/h): the table's, with the Earth's where that is known.
    pub rate: [f64; 3],
    /// Mean corrected rate less that, along the case axes, before and after (°/h).
    pub error: [[f64; 3]; 2],
    /// Number of the group of steps that have one bias.
    pub group: usize,
}

impl Matched {
    pub(super) fn new(step: Step, plateau: Plateau) -> Self {
        Self { rate: step.rate_deg_per_h(), error: [[0.0; 3]; 2], group: 0, step, plateau }
    }
}

/// Finds the steps of one run: those with a window by it, the others in the order of the plateaus. Rests between them are
/// taken along as steps of rate zero.
///
/// # Errors
/// What does not fit, with the plateaus that were found.
pub fn matched(steps: &[Step], bins: &[Bin], plateaus: &[Plateau]) -> Result<Vec<Matched>, Kind> {
    let Some(first) = steps.first() else { return Ok(Vec::new()) };
    if steps.iter().all(|step| step.window_s.is_some()) {
        let of = |step: &Step| {
            let window = step.window_s.unwrap_or_default();
            let plateau = within(bins, window).ok_or(Kind::NoTicks { window_s: window })?;
            Ok(Matched::new(*step, plateau))
        };
        if let Some(windows_s) = overlapping(steps) {
            return Err(Kind::StepsOverlap { windows_s });
        }
        return steps.iter().map(of).collect();
    }
    if steps.iter().any(|step| step.window_s.is_some()) {
        return Err(Kind::SomeTimes);
    }
    let turning: Vec<&Step> = steps.iter().filter(|step| step.rate_deg_per_s != 0.0).collect();
    let fastest = plateaus.iter().map(Plateau::size).fold(0.0, f64::max);
    let [least, most] = ends(turning.iter().map(|step| step.rate_deg_per_s.abs()));
    let limit = REST * least / most * fastest;
    let moving: Vec<&Plateau> = plateaus.iter().filter(|plateau| plateau.size() > limit).collect();
    if turning.is_empty() || moving.len() != turning.len() {
        let found = plateaus.to_vec();
        return Err(Kind::OtherPlateaus { stated: turning.len(), turning: moving.len(), found });
    }
    let mut all: Vec<Matched> = turning
        .into_iter()
        .zip(&moving)
        .map(|(step, plateau)| Matched::new(*step, (*plateau).clone()))
        .collect();
    check(&all, plateaus)?;
    let rests: Vec<&Plateau> = plateaus.iter().filter(|plateau| plateau.size() <= limit).collect();
    // The table's rates by the scale of the fastest plateau: weights may be as good as unknown.
    let scale = fastest / (3600.0 * most);
    let of_slowest = |share: f64| (3600.0 * share * least).max(EARTH_DEG_PER_H) * scale;
    let allowed = [of_slowest(AT_REST), of_slowest(RESTS_ALIKE)];
    if let Some(turn) = no_rest(&rests, allowed) {
        return Err(Kind::UnstatedTurn {
            stated: all.len(),
            turn: turn.clone(),
            allowed: allowed.map(|rate| rate / 3600.0),
            found: plateaus.to_vec(),
        });
    }
    all.extend(
        rests
            .into_iter()
            .map(|plateau| Matched::new(Step { rate_deg_per_s: 0.0, ..*first }, plateau.clone())),
    );
    all.sort_by_key(|one| one.plateau.bins[0]);
    Ok(all)
}

/// Windows of two steps that share a time.
fn overlapping(steps: &[Step]) -> Option<[[f64; 2]; 2]> {
    let mut windows: Vec<[f64; 2]> = steps.iter().filter_map(|step| step.window_s).collect();
    windows.sort_by(|a, b| a[0].total_cmp(&b[0]));
    windows.windows(2).find(|pair| pair[1][0] < pair[0][1]).map(|pair| [pair[0], pair[1]])
}

/// The plateaus in which the table stands, by the slowest of the stated rates.
pub(super) fn slow(steps: &[Step], plateaus: Vec<Plateau>) -> Vec<Plateau> {
    let rates = steps.iter().map(|step| step.rate_deg_per_s.abs()).filter(|rate| *rate > 0.0);
    let most = (3600.0 * AT_REST * rates.fold(f64::INFINITY, f64::min)).max(EARTH_DEG_PER_H);
    plateaus.into_iter().filter(|plateau| plateau.size() <= most).collect()
}

/// The plateau among the rests that is none: it turns, or not as the others do.
fn no_rest<'a>(rests: &[&'a Plateau], [most, alike]: [f64; 2]) -> Option<&'a Plateau> {
    let sensors = rests.first().map_or(0, |rest| rest.rate.len());
    let middle: Vec<f64> = (0..sensors)
        .map(|sensor| median(&rests.iter().map(|rest| rest.rate[sensor]).collect::<Vec<_>>()))
        .collect();
    let away = |rest: &Plateau| {
        let squares = rest.rate.iter().zip(&middle).map(|(rate, middle)| (rate - middle).powi(2));
        squares.sum::<f64>().sqrt()
    };
    rests.iter().copied().find(|rest| rest.size() > most || away(rest) > alike)
}

/// Plateaus must be in proportion to their steps about each axis.
fn check(all: &[Matched], plateaus: &[Plateau]) -> Result<(), Kind> {
    let Some(fastest) =
        all.iter().max_by(|a, b| a.step.rate_deg_per_s.abs().total_cmp(&b.step.rate_deg_per_s.abs()))
    else {
        return Ok(());
    };
    let per_rate: Vec<f64> =
        fastest.plateau.rate.iter().map(|rate| rate / fastest.step.rate_deg_per_s).collect();
    let norm: f64 = per_rate.iter().map(|x| x * x).sum();
    for one in all.iter().filter(|one| one.step.axis.map(f64::to_bits) == fastest.step.axis.map(f64::to_bits))
    {
        let along: f64 =
            one.plateau.rate.iter().zip(&per_rate).map(|(rate, per)| rate * per).sum::<f64>() / norm;
        let away = (along - one.step.rate_deg_per_s).abs();
        let limit = MISMATCH * one.step.rate_deg_per_s.abs().max(0.1 * fastest.step.rate_deg_per_s.abs());
        if away > limit {
            return Err(Kind::OutOfProportion {
                window_s: one.plateau.window_s,
                shown: along,
                stated: one.step.rate_deg_per_s,
                allowed: limit,
                found: plateaus.to_vec(),
            });
        }
    }
    Ok(())
}
