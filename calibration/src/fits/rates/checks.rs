//! Whether a unit turned as was stated, and whether what was fitted is a gyro.

use isotherm_protocol::document::Document;

use super::bins::Bin;
use super::matching::Matched;
use super::measure::in_case;
use super::model::GyroRates;
use super::plateaus::scatter;
use super::steps::Step;
use crate::axes::main_axis;
use crate::document::gyro_name;
use crate::finding::{Instead, Kind};
use crate::fits::modes::document::row;
use crate::numbers::{Size, dot, ends, median, norm, real};

/// Share of a run's fastest step from which on a step shows what the table turned about.
const FAST: f64 = 0.5;
/// Largest angle between the stated axis and the one that the gyros show (°). Mountings are good to a degree.
const LARGEST_ANGLE_DEG: f64 = 30.0;
/// Most times by which a scale factor may differ from the document's.
const LARGEST_FACTOR: f64 = 2.0;
/// Share of the largest rate that the straight line may leave of a step, where noise does not explain it.
const LARGEST_LEFT: f64 = 0.01;
/// Share of the step's rate, and standard deviations, by which a bin may differ from its middle; share of the bins that may differ more.
const UNSTEADY: f64 = 0.05;
const UNSTEADY_SIGMAS: f64 = 10.0;
const UNSTEADY_BINS: f64 = 0.05;
/// Share of the liveliest gyro's range below which another one shows nothing at all: what a document takes from a dead reading.
const DEAD: f64 = 1e-9;

/// The fast steps of a run must turn about the stated axis, and about as fast as stated where the scale is known.
///
/// # Errors
/// What the gyros show instead.
pub(super) fn turned_as_stated(
    matched: &[Matched],
    document: &Document,
    scale_known: bool,
) -> Result<(), Kind> {
    let sensors = document.gyro.sensor.len();
    let axes: Vec<[f64; 3]> = (0..sensors).map(|sensor| row(document, sensor, f64::NAN)).collect();
    let in_case = in_case(&axes);
    let rest: Vec<f64> = (0..sensors).map(|sensor| at_rest(matched, sensor)).collect();
    let fastest = matched.iter().map(|one| one.step.rate_deg_per_s.abs()).fold(0.0, f64::max);
    for one in
        matched.iter().filter(|one| one.step.rate_deg_per_s.abs() >= FAST * fastest.max(f64::MIN_POSITIVE))
    {
        let shown = |sensor: usize| (one.plateau.rate[sensor] - rest[sensor]) / 3600.0;
        let rate = one.step.rate_deg_per_s;
        let turned = in_case(&shown).map(|x| x * rate.signum());
        let size = norm(turned);
        let angle_deg = libm::acos((dot(turned, one.step.axis) / size).clamp(-1.0, 1.0)).to_degrees();
        let factor = size / rate.abs();
        let right_size = !scale_known || (1.0 / LARGEST_FACTOR..=LARGEST_FACTOR).contains(&factor);
        if angle_deg <= LARGEST_ANGLE_DEG && right_size {
            continue;
        }
        let along = |sensor: usize| axes.get(sensor).map_or(0.0, |axis| dot(*axis, one.step.axis).abs());
        let mut telling = vec![largest(sensors, along), largest(sensors, |sensor| shown(sensor).abs())];
        telling.dedup();
        return Err(Kind::TurnedOtherwise {
            window_s: one.plateau.window_s,
            stated: (rate, one.step.axis),
            shown: telling
                .into_iter()
                .map(|sensor| (gyro_name(document, sensor).to_owned(), shown(sensor)))
                .collect(),
            instead: Box::new(if right_size {
                Instead::Axis(turned.map(|x| x / size), [angle_deg, LARGEST_ANGLE_DEG])
            } else {
                Instead::Factor([factor, LARGEST_FACTOR])
            }),
        });
    }
    Ok(())
}

/// Each step must be one rate from end to end.
///
/// # Errors
/// The first that is not, and what to do.
pub(super) fn steady(matched: &[Matched], bins: &[Bin]) -> Result<(), Kind> {
    let sigma = scatter(bins);
    for one in matched {
        let own = one.plateau.own(bins);
        let sensor = largest(sigma.len(), |sensor| one.plateau.rate[sensor].abs());
        let rates: Vec<f64> = own.iter().filter(|bin| bin.good_s > 0.0).map(|bin| bin.rate[sensor]).collect();
        if rates.is_empty() {
            continue;
        }
        let usual = median(&rates);
        let allowed =
            (UNSTEADY * one.step.rate_deg_per_s.abs() * 3600.0).max(UNSTEADY_SIGMAS * sigma[sensor]);
        let off = rates.iter().filter(|rate| (**rate - usual).abs() > allowed).count();
        if off > 1 && real(off) > UNSTEADY_BINS * real(rates.len()) {
            let [low, high] = ends(rates);
            return Err(Kind::Unsteady {
                window_s: one.plateau.window_s,
                stated: one.step.rate_deg_per_s,
                range: [low / 3600.0, high / 3600.0],
            });
        }
    }
    Ok(())
}

/// The first gyro that does not move at all while another one does.
pub(super) fn dead(bins: &[Bin]) -> Option<usize> {
    let sensors = bins.first().map_or(0, |bin| bin.rate.len());
    let range = |sensor: usize| {
        let rates = bins.iter().filter(|bin| bin.good_s > 0.0).map(|bin| bin.rate[sensor]);
        Size::of(&rates.collect::<Vec<f64>>()).peak_to_peak
    };
    let liveliest = (0..sensors).map(range).fold(0.0, f64::max);
    let still = scatter(bins);
    (0..sensors).find(|sensor| {
        liveliest > 0.0 && still[*sensor] <= DEAD * liveliest && range(*sensor) < 1e-3 * liveliest
    })
}

/// Axes about which the runs turned one way only: scale factor and bias, or an asymmetry, then cannot be told apart.
pub(super) fn one_way(steps: &[Step]) -> Option<Kind> {
    let about = |axis: usize| {
        steps
            .iter()
            .filter(move |step| main_axis(&step.axis) == axis)
            .map(move |step| step.rate_deg_per_s * step.axis[axis])
    };
    let one_way = |axis: &usize| about(*axis).any(|rate| rate > 0.0) != about(*axis).any(|rate| rate < 0.0);
    let axes: Vec<usize> = (0..3).filter(one_way).collect();
    (!axes.is_empty()).then_some(Kind::OneWay { axes })
}

/// Why what was fitted is no gyro: `rates` are the true rates of the steps (°/h), `axis` its input axis.
pub(super) fn no_result(
    found: &GyroRates,
    rates: &[[f64; 3]],
    axis: [f64; 3],
    scale_known: bool,
) -> Option<Kind> {
    let [gain, _] = found.gain;
    let sense = gain.is_finite() && gain > 0.0;
    if !sense || (scale_known && !(1.0 / LARGEST_FACTOR..=LARGEST_FACTOR).contains(&gain)) {
        return Some(Kind::OtherScale { factor: gain, most: LARGEST_FACTOR });
    }
    let full = rates.iter().map(|rate| dot(*rate, axis).abs()).fold(0.0, f64::max);
    let left = found.left.iter().map(|left| left.abs()).fold(0.0, f64::max);
    (found.widened && left > LARGEST_LEFT * full).then(|| Kind::NotStraight {
        left: left / 3600.0,
        share: [left / full, LARGEST_LEFT],
        chi_square: found.chi_square,
    })
}

/// What a gyro shows at rest (°/h): the median of a run's rests, 0 without any.
fn at_rest(matched: &[Matched], sensor: usize) -> f64 {
    let rests = matched.iter().filter(|one| one.step.rate_deg_per_s == 0.0);
    let shown: Vec<f64> = rests.map(|one| one.plateau.rate[sensor]).collect();
    if shown.is_empty() { 0.0 } else { median(&shown) }
}

/// The number below `count` with the largest value.
fn largest(count: usize, value: impl Fn(usize) -> f64) -> usize {
    (0..count).fold(0, |best, index| if value(index) > value(best) { index } else { best })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use nalgebra::DMatrix;

    use super::*;
    use crate::fits::rates::plateaus::within;

    /// Bins of half a second of two gyros: the second has noise alone, as sampled from its number.
    fn turning(rate_deg_per_s: impl Fn(f64) -> f64) -> Vec<Bin> {
        let bin = |index: u32| {
            let begin_s = 0.5 * f64::from(index);
            let noise = f64::from(index * 7 % 5) - 2.0;
            let rate = vec![3600.0 * rate_deg_per_s(begin_s) + noise, noise];
            Bin { begin_s, length_s: 0.5, good_s: 0.5, rate, ..Bin::default() }
        };
        (0..200).map(bin).collect()
    }

    fn step(bins: &[Bin], window_s: [f64; 2], rate_deg_per_s: f64) -> Matched {
        let step = Step { run: 0, axis: [1.0, 0.0, 0.0], rate_deg_per_s, window_s: Some(window_s) };
        Matched::new(step, within(bins, window_s).unwrap())
    }

    #[test]
    fn a_step_is_one_rate_from_end_to_end() {
        let bins = turning(|time_s| if (20.0..60.0).contains(&time_s) { 36.0 } else { 0.0 });
        assert_eq!(steady(&[step(&bins, [22.0, 58.0], 36.0), step(&bins, [65.0, 95.0], 0.0)], &bins), Ok(()));
        let late = steady(&[step(&bins, [32.0, 68.0], 36.0)], &bins).unwrap_err();
        assert!(
            matches!(late, Kind::Unsteady { window_s: [32.0, 68.0], stated: 36.0, range: [low, high] } if low < 0.1 && high > 35.9),
            "{late:?}"
        );
        let rest = steady(&[step(&bins, [40.0, 80.0], 0.0)], &bins).unwrap_err();
        assert!(matches!(rest, Kind::Unsteady { stated: 0.0, .. }), "{rest:?}");
    }

    #[test]
    fn a_gyro_that_does_not_move_at_all_is_dead() {
        let mut bins = turning(|time_s| if time_s < 50.0 { 36.0 } else { -36.0 });
        assert_eq!(dead(&bins), None, "noise is life");
        for bin in &mut bins {
            bin.rate[1] = 12.0;
        }
        assert_eq!(dead(&bins), Some(1));
    }

    #[test]
    fn turning_one_way_is_pointed_out() {
        let steps = |rates: &[f64]| -> Vec<Step> {
            rates
                .iter()
                .map(|rate| Step { run: 0, axis: [0.0, 0.0, -1.0], rate_deg_per_s: *rate, window_s: None })
                .collect()
        };
        assert_eq!(one_way(&steps(&[36.0, 0.0, 108.0])), Some(Kind::OneWay { axes: vec![2] }));
        assert_eq!(one_way(&steps(&[36.0, -36.0])), None);
        assert_eq!(one_way(&steps(&[0.0])), None);
    }

    #[test]
    fn a_gyro_is_one_whose_scale_and_line_are_near_what_was_stated() {
        let gyro = |gain: f64, left: f64, widened: bool| GyroRates {
            gain: [gain, 1e-6],
            axis: None,
            axis_sigma: [f64::NAN; 3],
            asymmetry: None,
            bias: [0.0, 1.0],
            bias_of: BTreeMap::new(),
            covariance: DMatrix::identity(2, 2),
            left: vec![left, -left],
            chi_square: 1e9,
            widened,
            freedom: 1.0,
        };
        // 100 °/s about x.
        let rates = [[360_000.0, 0.0, 0.0], [-360_000.0, 0.0, 0.0]];
        let doubt = |found: &GyroRates, known: bool| no_result(found, &rates, [1.0, 0.0, 0.0], known);
        assert_eq!(doubt(&gyro(1.002, 3000.0, true), true), None, "0.8 % of the largest rate");
        assert_eq!(doubt(&gyro(0.3, 1.0, false), false), None, "counts without a document");
        let other = |factor: f64| Some(Kind::OtherScale { factor, most: LARGEST_FACTOR });
        assert_eq!(doubt(&gyro(-2e-4, 1.0, false), true), other(-2e-4));
        assert_eq!(doubt(&gyro(2.1, 1.0, false), true), other(2.1));
        let bent = Kind::NotStraight { left: 10.0, share: [0.1, 0.01], chi_square: 1e9 };
        assert_eq!(doubt(&gyro(1.0, 36_000.0, true), true), Some(bent));
        assert!(doubt(&gyro(-1.0, 1.0, false), false).is_some(), "the wrong sense is wrong at any scale");
    }
}
