//! Smoothing and derivative step of the document: they are part of the fit.

use std::collections::{BTreeMap, BTreeSet};

use isotherm_protocol::document::{Document, Filter};

use super::columns::{Branch, Columns, Effect};
use super::fit::Sensor;
use super::joint::Joint;
use super::known::{Known, channel};
use super::ladder::smoothings_s;
use super::model::{Dynamics, Spec};
use super::samples::Samples;
use super::select::Target;
use super::settings::{Method, Settings};
use crate::document::tidy;
use crate::error::Error;
use crate::numbers::{percentile, real};

/// For the stepwise methods, whose derivatives know nothing of lags: smoothing, its delay being all the lag that there is, and
/// derivative step (s).
const SLOW_SMOOTHINGS_S: [f64; 8] = [15.0, 40.0, 90.0, 180.0, 250.0, 400.0, 650.0, 1000.0];
const DERIVATIVE_STEPS_S: [f64; 2] = [20.0, 40.0];
/// Longest smoothing as a share of the longest run, and in grid steps.
const LONGEST_SMOOTHING_SHARE: f64 = 0.06;
const LONGEST_SMOOTHING_GRID_STEPS: f64 = 2000.0;

/// The filter with which the sensors are explained best together.
pub(super) fn choose_filter(
    filter: &Filter,
    bare: &Document,
    (sensors, targets): (&[Sensor], &[Target]),
    samples: &[Samples],
    histories: &BTreeMap<String, Known>,
    settings: &Settings,
) -> Result<Filter, Error> {
    let sequential = settings.method.is_stepwise();
    let longest_s = longest_run_s(samples);
    let trials = match settings.smoothing_s {
        None if sequential => {
            let longest_s =
                (LONGEST_SMOOTHING_SHARE * longest_s).min(LONGEST_SMOOTHING_GRID_STEPS * filter.grid_step_s);
            let smoothings = SLOW_SMOOTHINGS_S.into_iter().filter(|s| *s <= longest_s.max(250.0));
            on_grid(filter, &smoothings.collect::<Vec<_>>(), &DERIVATIVE_STEPS_S)
        }
        None => {
            let tells = histories.values().all(|known| known.history.tells_dynamics());
            on_grid(filter, smoothings_s(tells), &[DERIVATIVE_STEPS_S[0]])
        }
        Some(stated) => on_grid(filter, &[stated], &[filter.derivative_step_s]),
    };
    let mut best: Option<(f64, Filter)> = None;
    for mut trial in trials {
        let (mut cost, mut dead_band) = (0.0, 0.0_f64);
        for (name, known) in histories {
            let mut columns = Columns::new(known.basis(channel(bare, name)?, &trial), samples);
            let [rate, acceleration] =
                [Effect::Rate, Effect::Acceleration].map(|of| of(Branch::Both).power(0));
            columns.make(&[rate, acceleration])?;
            dead_band = dead_band.max(usual_product(columns.get(rate), columns.get(acceleration)));
            let alive = sensors.iter().zip(targets).filter(|(sensor, _)| sensor.follows(name));
            if !sequential {
                let alive: Vec<_> = alive.collect();
                cost += Joint::of(columns, samples, (known, longest_s), &alive)?.cost();
                continue;
            }
            let mut spec = Spec { degree: 4, ..Spec::default() };
            if known.history.both_directions() {
                let terms =
                    if settings.method == Method::Rate { vec![rate] } else { vec![rate, acceleration] };
                spec.dynamics = Dynamics { name: String::new(), terms };
            }
            columns.make(&spec.terms(true))?;
            for (_, target) in alive.filter(|(sensor, _)| sensor.gyro) {
                let spec = Spec { scale: target.widest_scale(), ..spec.clone() };
                let solution = target.solve(&columns, &spec, false);
                cost += solution.map_or(0.0, |solution| libm::log(solution.rms));
            }
        }
        trial.branch_dead_band_deg_c2_per_s3 = Some(tidy(dead_band));
        if best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, trial));
        }
    }
    Ok(best.map_or_else(|| filter.clone(), |(_, filter)| filter))
}

/// Filters with smoothings and derivative steps (s) in whole grid steps, each once.
fn on_grid(filter: &Filter, smoothings_s: &[f64], steps_s: &[f64]) -> Vec<Filter> {
    let whole = |length: f64| libm::round(length / filter.grid_step_s).max(1.0) * filter.grid_step_s;
    let mut tried: BTreeSet<(u64, u64)> = BTreeSet::new();
    let pairs = smoothings_s.iter().flat_map(|smoothing| steps_s.iter().map(move |step| (*smoothing, *step)));
    let filters = pairs.map(|(smoothing, step)| Filter {
        smoothing_s: whole(smoothing),
        derivative_step_s: whole(step),
        ..filter.clone()
    });
    filters.filter(|f| tried.insert((f.smoothing_s.to_bits(), f.derivative_step_s.to_bits()))).collect()
}

/// Length of the longest run (s).
pub(super) fn longest_run_s(samples: &[Samples]) -> f64 {
    let length_s = |run: &Samples| real(run.time_s.len()) * run.window_s;
    samples.iter().map(length_s).fold(0.0, f64::max)
}

/// A twentieth of what Ṫ·T̈ reaches: the blend between run-up and braking.
fn usual_product(rate: &[f64], acceleration: &[f64]) -> f64 {
    let sizes = rate.iter().zip(acceleration).map(|(r, a)| (r * a).abs());
    (0.05 * percentile(sizes, 95)).max(1e-12)
}
