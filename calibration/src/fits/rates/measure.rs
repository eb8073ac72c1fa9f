//! True rates of the steps, what the gyros showed in them, and with which noise.

use isotherm_correction::earth::EARTH_RATE;
use isotherm_protocol::document::{Document, GyroOutput};
use nalgebra::{DMatrix, DVector, Vector3};

use super::bins::Bin;
use super::earth::carried;
use super::fit::Wanted;
use super::matching::Matched;
use super::model::{GyroRates, Point};
use super::read::Turned;
use crate::finding::Kind;
use crate::fits::modes::document::count_arcsec;
use crate::fits::modes::model::deg_per_h;
use crate::lsq::linear::{self, SINGULAR, Weak};
use crate::numbers::dot;

/// White noise of a gyro from second differences of its bins within steps (°/√h), less what the Earth's turning shows along
/// its `gain`.
pub(super) fn white(base: &Document, runs: &[Turned], sensor: usize, gain: [f64; 3]) -> f64 {
    let count = count_arcsec(base, sensor);
    let (mut sum, mut number) = (0.0, 0.0);
    let own = |bin: &Bin| bin.rate[sensor] - dot(gain, bin.earth);
    let steps =
        runs.iter().flat_map(|run| run.matched.iter().map(move |one| one.plateau.own(&run.binned.bins)));
    for three in steps.flat_map(|bins| bins.windows(3)) {
        let second = own(&three[0]) - 2.0 * own(&three[1]) + own(&three[2]);
        let length = three[1].good_s;
        if second.is_finite() && length > 0.0 {
            // White: 6·N²/L. Whole counts, differenced three times: 20·(1/12)·q²/L².
            let counted = 20.0 / 12.0 * count * count / (length * length);
            sum += (second * second - counted) * length / 6.0;
            number += 1.0;
        }
    }
    let white = if number > 0.0 { (sum / number).max(0.0) } else { 0.0 };
    // Neighbouring second differences hang together: about a third of them are independent.
    let upper = 1.0 + 2.0 * (2.0 / (number / 3.0_f64).max(2.0)).sqrt();
    (white * upper).sqrt() / 60.0
}

/// First guess of `K_old/K` along the document's axes.
pub(super) fn first_gains(runs: &[Turned], axes: &[[f64; 3]]) -> Vec<f64> {
    let steps: Vec<&Matched> = runs.iter().flat_map(|run| &run.matched).collect();
    axes.iter()
        .enumerate()
        .map(|(sensor, axis)| {
            let along = |one: &Matched| dot(*axis, one.step.axis);
            let stated = DMatrix::from_fn(steps.len(), 1, |i, _| {
                3600.0 * steps[i].step.rate_deg_per_s * along(steps[i])
            });
            let shown = DVector::from_fn(steps.len(), |i, _| steps[i].plateau.rate[sensor]);
            let found =
                linear::solve(&stated, &shown, Weak::Refuse(SINGULAR)).map(|found| found.coefficients[0]);
            found.ok().filter(|gain| *gain != 0.0).unwrap_or(1.0)
        })
        .collect()
}

/// What makes a rate in case axes of the rates along input axes, by least squares.
pub(super) fn in_case(axes: &[[f64; 3]]) -> impl Fn(&dyn Fn(usize) -> f64) -> [f64; 3] + '_ {
    let design = DMatrix::from_fn(axes.len(), 3, |sensor, axis| axes[sensor][axis]);
    // Axes of a document span space.
    let inverse = linear::inverse(&design).unwrap_or_else(|_| DMatrix::identity(3, 3));
    let solved = inverse * design.transpose();
    move |along| {
        let rates: Vec<f64> = (0..solved.ncols()).map(along).collect();
        [0, 1, 2]
            .map(|axis| rates.iter().enumerate().map(|(sensor, rate)| solved[(axis, sensor)] * rate).sum())
    }
}

/// Carries the Earth's rate through the bins of runs whose attitude is known, and adds it to the rates of their steps. The biases are
/// those of what has been `found` so far.
pub(super) fn carry_earth(
    runs: &mut [Turned],
    axes: &[[f64; 3]],
    gains: &[f64],
    found: &[Result<GyroRates, Kind>],
) {
    let in_case = in_case(axes);
    for run in runs {
        let Some(start) = run.earth_start else { continue };
        // All steps of a run whose attitude is known are of its temperature.
        let group = run.matched.first().map_or(0, |one| one.group);
        let left = |sensor: usize| {
            found
                .get(sensor)
                .and_then(|found| found.as_ref().ok())
                .map_or(0.0, |found| found.shown_bias(group))
        };
        let at_rest: Vec<f64> = (0..axes.len()).map(left).collect();
        // What the gyros show is relative to the stars: the Earth's own turning is in it.
        let turning = |bin: &Bin, earth: [f64; 3]| {
            let rate = in_case(&|sensor| (bin.rate[sensor] - at_rest[sensor]) / gains[sensor]);
            [0, 1, 2].map(|axis| rate[axis] - earth[axis])
        };
        let bins = &mut run.binned.bins;
        let earth = carried(bins, start, turning);
        bins.iter_mut().zip(earth).for_each(|(bin, earth)| bin.earth = earth);
        for one in &mut run.matched {
            let (mut sum, mut good) = ([0.0; 3], 0.0);
            for bin in one.plateau.own(bins) {
                good += bin.good_s;
                sum.iter_mut().zip(bin.earth).for_each(|(sum, earth)| *sum += earth * bin.good_s);
            }
            let table = one.step.rate_deg_per_h();
            one.rate = if good > 0.0 { [0, 1, 2].map(|axis| table[axis] + sum[axis] / good) } else { table };
        }
    }
}

/// Gives steps whose bias is one the same group: those at one temperature, whose number is given by run, and, where the Earth's share
/// along the table stays in the bias, about one axis.
pub(super) fn group(runs: &mut [Turned], level_of: &[usize], by_axis: bool) {
    let mut known = Vec::new();
    for (run, level) in runs.iter_mut().zip(level_of) {
        for one in &mut run.matched {
            let own = (*level, by_axis.then(|| one.step.axis.map(f64::to_bits)));
            one.group = known.iter().position(|group| *group == own).unwrap_or(known.len());
            if one.group == known.len() {
                known.push(own);
            }
        }
    }
}

/// Most that is left of the Earth's rate (°/h) in the mean of a gyro that shows so much of a `rate` along the case axes, where it is not
/// taken off: its part across the table's axis turns with the case, and stands still in a rest.
fn earth_left(gain: [f64; 3], one: &Matched, length_s: f64) -> f64 {
    let across = Vector3::from(gain).cross(&Vector3::from(one.step.axis)).norm();
    let half = (0.5 * one.step.rate_deg_per_s * length_s).to_radians();
    let mean = if half == 0.0 { 1.0 } else { libm::sin(half) / half };
    deg_per_h(EARTH_RATE.as_rad_per_s()) * across * mean
}

/// What a gyro showed in all steps, with the noise of the means; `gain` is what it shows of a rate along the case axes.
pub(super) fn points<'a>(
    wanted: &Wanted<'_>,
    runs: impl IntoIterator<Item = &'a Turned>,
    sensor: usize,
    (walk, gain): (f64, [f64; 3]),
) -> Vec<Point> {
    let count =
        if wanted.base.gyro.output == GyroOutput::Counts { count_arcsec(wanted.base, sensor) } else { 0.0 };
    let point = |run: &Turned, one: &Matched| {
        let bins = one.plateau.own(&run.binned.bins);
        let good: f64 = bins.iter().map(|bin| bin.good_s).sum();
        let length_s: f64 = bins.iter().map(|bin| bin.length_s).sum();
        let white = 3600.0 * walk * walk / good;
        let counted = count * count / 6.0 / (good * good);
        let table = wanted.table_ppm * 1e-6 * 3600.0 * one.step.rate_deg_per_s;
        let earth = if wanted.place.is_empty() { earth_left(gain, one, length_s) } else { 0.0 };
        let variance = white + counted + table * table + earth * earth;
        let shown = one.plateau.rate[sensor];
        // Readings without any noise are as good as their digits.
        let floor = 1e-9 * (1.0 + shown.abs());
        Point { rate: one.rate, shown, sigma: variance.sqrt().max(floor), group: one.group }
    };
    runs.into_iter().flat_map(|run| run.matched.iter().map(move |one| point(run, one))).collect()
}
