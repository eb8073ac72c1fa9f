//! Smoothing and derivative step of the document: they are part of the fit.

use std::collections::{BTreeMap, BTreeSet};

use isotherm_protocol::document::{Document, Filter};

use super::columns::{Branch, Columns, Term};
use super::fit::Sensor;
use super::known::{Known, channel};
use super::model::{Dynamics, Spec};
use super::samples::Samples;
use super::search;
use super::select::Target;
use super::settings::{Method, Settings};
use crate::error::Error;

/// Smoothings of the temperature that are tried (s).
const SMOOTHINGS_S: [f64; 4] = [5.0, 10.0, 20.0, 40.0];
/// For the sequential method, whose derivatives know nothing of lags: smoothing, its delay being all the lag that there is, and
/// derivative step (s).
const SLOW_SMOOTHINGS_S: [f64; 8] = [15.0, 40.0, 90.0, 180.0, 250.0, 400.0, 650.0, 1000.0];
/// Longest smoothing as a share of the longest run, and in grid steps.
const LONGEST_SMOOTHING_SHARE: f64 = 0.06;
const LONGEST_SMOOTHING_GRID_STEPS: f64 = 2000.0;
const DERIVATIVE_STEPS_S: [f64; 2] = [20.0, 40.0];

/// The filter with which the sensors are explained best together.
pub(super) fn choose_filter(
    filter: &Filter,
    bare: &Document,
    (sensors, targets): (&[Sensor], &[Target]),
    samples: &[Samples],
    histories: &BTreeMap<String, Known>,
    settings: &Settings,
) -> Result<Filter, Error> {
    let grid = filter.grid_step_s;
    let sequential = settings.method == Method::Sequential;
    let (smoothings, steps): (Vec<f64>, Vec<f64>) = match settings.smoothing_s {
        Some(smoothing) => (vec![smoothing], vec![filter.derivative_step_s]),
        None if sequential => {
            let longest_s =
                (LONGEST_SMOOTHING_SHARE * longest_run_s(samples)).min(LONGEST_SMOOTHING_GRID_STEPS * grid);
            let smoothings = SLOW_SMOOTHINGS_S.into_iter().filter(|s| *s <= longest_s.max(250.0));
            (smoothings.collect(), DERIVATIVE_STEPS_S.to_vec())
        }
        None => (SMOOTHINGS_S.to_vec(), vec![20.0]),
    };
    let whole = |length: f64| libm::round(length / grid).max(1.0) * grid;
    let mut best: Option<(f64, Filter)> = None;
    let mut tried: BTreeSet<(u64, u64)> = BTreeSet::new();
    for smoothing in &smoothings {
        for step in &steps {
            let mut trial =
                Filter { smoothing_s: whole(*smoothing), derivative_step_s: whole(*step), ..filter.clone() };
            if !tried.insert((trial.smoothing_s.to_bits(), trial.derivative_step_s.to_bits())) {
                continue;
            }
            let mut cost = 0.0;
            let mut dead_band: f64 = 0.0;
            for (name, known) in histories {
                let mut columns = Columns::new(known.basis(channel(bare, name)?, &trial), samples);
                let (rate, acceleration) = (Term::Rate(Branch::Both, 0), Term::Acceleration(Branch::Both, 0));
                columns.make(&[rate, acceleration])?;
                dead_band = dead_band.max(usual_product(columns.get(rate), columns.get(acceleration)));
                let mut spec = Spec { degree: 4, ..Spec::default() };
                if known.history.both_directions() {
                    spec.dynamics = if sequential {
                        Dynamics { name: String::new(), terms: vec![rate, acceleration] }
                    } else {
                        search::ladders(false, grid, &known.history, longest_run_s(samples))
                            .pop()
                            .unwrap_or_default()
                    };
                }
                columns.make(&spec.terms(true))?;
                for (sensor, target) in sensors.iter().zip(targets) {
                    if sensor.channel == *name && sensor.dead.is_none() && (sensor.gyro || !sequential) {
                        let spec = Spec { scale: target.widest_scale(), ..spec.clone() };
                        cost += target
                            .solve(&columns, &spec, false)
                            .map_or(0.0, |solution| libm::log(solution.rms));
                    }
                }
            }
            trial.branch_dead_band_deg_c2_per_s3 = Some(crate::written::tidy(dead_band));
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, trial));
            }
        }
    }
    Ok(best.map_or_else(|| filter.clone(), |(_, filter)| filter))
}

/// Length of the longest run (s).
pub(super) fn longest_run_s(samples: &[Samples]) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "windows of a log")]
    let length_s = |run: &Samples| run.time_s.len() as f64 * run.window_s;
    samples.iter().map(length_s).fold(0.0, f64::max)
}

/// A twentieth of what Ṫ·T̈ reaches: the blend between run-up and braking.
fn usual_product(rate: &[f64], acceleration: &[f64]) -> f64 {
    let mut sizes: Vec<f64> =
        rate.iter().zip(acceleration).map(|(r, a)| (r * a).abs()).filter(|p| p.is_finite()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let high = sizes.get(sizes.len() * 95 / 100).copied().unwrap_or(0.0);
    (0.05 * high).max(1e-12)
}
