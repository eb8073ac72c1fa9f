//! From runs to a document and its report.

use std::collections::{BTreeMap, BTreeSet};

use isotherm_protocol::document::{Channel, Document, Filter, Origin};

use super::bare::{bare, filter, nominal_of};
use super::branches::History;
use super::checks::{self, SMALLEST_RANGE_DEG_C};
use super::columns::{Basis, Branch, Columns, Term};
use super::model::Spec;
use super::outcome::{Found, Outcome};
use super::samples::Samples;
use super::select::{Target, WORTH_IT, equal_temperature, terms_of};
use super::settings::{Method, Settings, Site, Terms};
use super::{search, sequential};
use crate::error::Error;
use crate::means::Means;
use crate::report::{FitReport, Rest};
use crate::run::{Run, Watch};
use crate::written::Written;

/// Highest powers of temperature that are tried.
const DEGREES: [usize; 5] = [1, 2, 3, 4, 5];
/// Smoothings of the temperature that are tried (s).
const SMOOTHINGS_S: [f64; 4] = [5.0, 10.0, 20.0, 40.0];
/// For the sequential method, whose derivatives know nothing of lags: smoothing and derivative step (s).
const SLOW_SMOOTHINGS_S: [f64; 5] = [15.0, 40.0, 90.0, 180.0, 250.0];
const DERIVATIVE_STEPS_S: [f64; 2] = [20.0, 40.0];

/// A document and what is to be said of it.
#[derive(Debug)]
pub struct Fitted {
    /// The document.
    pub written: Written,
    /// The report.
    pub report: FitReport,
}

/// One sensor on its way.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sensor {
    pub(super) gyro: bool,
    pub(super) index: usize,
    pub(super) name: String,
    pub(super) channel: String,
    /// Why it cannot be fitted at all.
    pub(super) dead: Option<String>,
}

/// Fits the thermal terms of a unit to its runs, and judges them on others.
///
/// # Errors
/// [`Error::Refused`] with every reason why the runs do not allow it; [`Error::Log`], [`Error::Document`].
pub fn fit(
    base: Option<&Document>,
    (runs, judges): (&[Run], &[Run]),
    settings: &Settings,
    origin: Origin,
    mut watch: impl Watch,
) -> Result<Fitted, Error> {
    let mut warnings = Vec::new();
    let (mut refusals, mut dead) = (Vec::new(), Vec::new());
    let mut series = Vec::new();
    for run in runs {
        let of_run = run.series(Lent(&mut watch))?;
        let found = checks::raw(&run.name, &of_run);
        refusals.extend(found.refusals);
        warnings.extend(found.warnings);
        dead.extend(found.dead);
        series.push(of_run);
    }
    let first = series.first().ok_or_else(|| Error::Refused(vec!["there is no run to fit to".to_owned()]))?;
    if !refusals.is_empty() {
        return Err(Error::Refused(refusals));
    }
    let base = match base {
        Some(base) => base.clone(),
        None => nominal_of(first)?,
    };
    let mut bare = bare(&base);
    if bare.temperature.channel.is_empty() {
        return Err(Error::Refused(vec![
            "the document has no temperature channel: a thermal fit needs one; add [[temperature.channel]]".to_owned(),
        ]));
    }
    let step_s = first.temperatures.values().map(|channel| checks::median_step_s(&channel.time_ns)).fold(0.0, f64::max);
    let filter = bare.temperature.filter.get_or_insert_with(|| filter(step_s)).clone();
    let mut samples = Vec::new();
    for (run, series) in runs.iter().zip(&series) {
        let of_run = Samples::of(run, series, &bare, settings.fit_window_s, Lent(&mut watch))?;
        let found = checks::corrected(&of_run);
        refusals.extend(found.refusals);
        warnings.extend(found.warnings);
        samples.push(of_run);
    }
    if !refusals.is_empty() {
        return Err(Error::Refused(refusals));
    }
    let rests = runs.iter().map(|run| rest(run, &bare, &settings.site, Lent(&mut watch))).collect::<Result<Vec<_>, _>>()?;
    let sensors = sensors(&bare, &dead);
    let histories = histories(&bare, &filter, &sensors, &samples, &mut warnings)?;
    let targets: Vec<Target> = sensors.iter().map(|sensor| target(sensor, &bare, &samples, &rests, &histories)).collect();
    let chosen = choose_filter(&filter, &bare, (&sensors, &targets), &samples, &histories, settings)?;
    let mut outcome = Outcome::new(&base, bare, chosen.clone(), settings);
    outcome.warnings = warnings;
    for (name, known) in &histories {
        let basis = known.basis(channel(&outcome.bare, name)?, &chosen);
        let mut columns = Columns::new(basis, &samples);
        let longest = samples.iter().map(|run| run.time_s.len()).max().unwrap_or(0);
        #[expect(clippy::cast_precision_loss, reason = "windows of a log")]
        let longest_s = longest as f64 * settings.fit_window_s;
        let mine: Vec<usize> = (0..sensors.len()).filter(|&i| sensors[i].channel == *name).collect();
        let alive: Vec<&Target> = mine.iter().filter(|&&i| sensors[i].dead.is_none()).map(|&i| &targets[i]).collect();
        let searched = match settings.method {
            Method::Lag => search::searched(&mut columns, &alive, &known.history, longest_s)?,
            _ => Vec::new(),
        };
        for index in mine {
            let found = find(&mut columns, (&sensors[index], &targets[index]), known, &searched, settings)?;
            outcome.add(&sensors[index], columns.basis(), found);
        }
        outcome.history(name, &known.history);
    }
    outcome.finish((runs, judges), origin, |run| rest(run, &base, &settings.site, ()), watch)
}

/// What is known of a channel before the fit.
#[derive(Debug)]
pub(super) struct Known {
    pub(super) history: History,
    pub(super) temperature: Vec<f64>,
}

impl Known {
    fn basis(&self, channel: Channel, filter: &Filter) -> Basis {
        let [low, high] = self.history.range_deg_c;
        let range_deg_c = [libm::floor(2.0 * low - 0.5) / 2.0, libm::ceil(2.0 * high + 0.5) / 2.0];
        Basis { channel, filter: filter.clone(), reference_deg_c: libm::round(0.5 * (low + high)), range_deg_c }
    }
}

fn channel(document: &Document, name: &str) -> Result<Channel, Error> {
    let channel = document.temperature.channel.iter().find(|channel| channel.name == name);
    channel.cloned().ok_or_else(|| {
        Error::Refused(vec![format!("the document has no temperature channel {name:?}: add [[temperature.channel]]")])
    })
}

/// A watch that is lent.
pub(super) struct Lent<'a, W: Watch>(pub(super) &'a mut W);

impl<W: Watch> Watch for Lent<'_, W> {
    fn begin(&mut self, progress: isotherm_log::progress::Progress) {
        self.0.begin(progress);
    }

    fn step(&mut self) {
        self.0.step();
    }

    fn end(&mut self) {
        self.0.end();
    }
}

/// Every sensor that follows a channel.
fn sensors(bare: &Document, dead: &[(bool, usize, String)]) -> Vec<Sensor> {
    let why = |gyro: bool, index: usize| {
        dead.iter().find(|(g, i, _)| (*g, *i) == (gyro, index)).map(|(_, _, why)| why.clone())
    };
    let gyros = bare.gyro.sensor.iter().enumerate().filter_map(|(index, sensor)| {
        let name = format!("gyro {}", sensor.name);
        Some(Sensor { gyro: true, index, name, channel: sensor.channel.clone()?, dead: why(true, index) })
    });
    let accels = bare.accel.iter().flat_map(|accel| &accel.sensor).enumerate().filter_map(|(index, sensor)| {
        let name = format!("accelerometer {}", sensor.name);
        Some(Sensor { gyro: false, index, name, channel: sensor.channel.clone()?, dead: why(false, index) })
    });
    gyros.chain(accels).collect()
}

/// Thermal history of each channel that a sensor follows.
fn histories(
    bare: &Document,
    filter: &Filter,
    sensors: &[Sensor],
    samples: &[Samples],
    warnings: &mut Vec<String>,
) -> Result<BTreeMap<String, Known>, Error> {
    let names: BTreeSet<&String> = sensors.iter().map(|sensor| &sensor.channel).collect();
    let mut known = BTreeMap::new();
    let mut refusals = Vec::new();
    for name in names {
        if samples.iter().any(|run| run.temperatures.get(name).is_none_or(Vec::is_empty)) {
            refusals.push(format!("a run has no readings of temperature channel {name:?}, which the document's sensors follow"));
            continue;
        }
        let channel = channel(bare, name)?;
        let basis = Basis { channel, filter: filter.clone(), reference_deg_c: 0.0, range_deg_c: [-300.0, 1000.0] };
        let (temperature, _) = Columns::new(basis, samples).temperature()?;
        let mut parts = Vec::new();
        let mut from = 0;
        for run in samples {
            let to = from + run.time_s.len();
            parts.push((&temperature[from..to], run.window_s));
            from = to;
        }
        let history = History::of(&parts);
        let [low, high] = history.range_deg_c;
        if !(high - low >= SMALLEST_RANGE_DEG_C) {
            refusals.push(format!(
                "temperature channel {name:?} stays between {low:.1} and {high:.1} °C: a fit over temperature needs at least \
                 {SMALLEST_RANGE_DEG_C} °C, better the whole range of use; run the chamber through it"
            ));
        }
        warnings.extend(doubts(name, &history));
        known.insert(name.clone(), Known { history, temperature });
    }
    if refusals.is_empty() { Ok(known) } else { Err(Error::Refused(refusals)) }
}

/// What a channel's history leaves to be wished for.
fn doubts(name: &str, history: &History) -> Vec<String> {
    let mut doubts = Vec::new();
    let levels = history.levels();
    if levels < 2 {
        doubts.push(format!(
            "channel {name:?}: {levels} plateaus of different temperature, 2 or more are needed to tell the static bias from what \
             follows the change: hold the chamber at its ends until nothing drifts any more (an hour for a fibre coil)"
        ));
    }
    if !history.both_directions() {
        doubts.push(format!(
            "channel {name:?}: the temperature goes one way only, so that what follows its change cannot be told from the static bias, \
             and the other way is unknown: only a static bias is fitted; run the chamber both ways"
        ));
    }
    doubts
}

/// What a unit at rest would put out during a run.
fn rest(run: &Run, document: &Document, site: &Site, watch: impl Watch) -> Result<Rest, Error> {
    let Site::Known { place, force_m_per_s2 } = site else { return Ok(Rest::default()) };
    let mean_force = match force_m_per_s2 {
        Some(force) => Some(*force),
        None if document.accel.is_some() => {
            let means = Means::of(run, &Written::of(document)?.loaded, 60.0, watch)?;
            let mean = |axis: usize| crate::means::Size::of(means.force(axis)).mean;
            Some([mean(0), mean(1), mean(2)])
        }
        None => None,
    };
    let rate = place.earth_rate_in_case(mean_force).ok_or_else(|| {
        Error::Refused(vec![format!(
            "{}: the unit cannot be levelled from its accelerometers: state --roll and --pitch, or leave the mean out with \
             --remove-mean",
            run.name
        )])
    })?;
    let deg_per_h = rate.map(|rate| isotherm_correction::units::AngularRate::from_rad_per_s(rate).as_deg_per_h());
    Ok(Rest { rate_deg_per_h: Some(deg_per_h), force_m_per_s2: *force_m_per_s2 })
}

/// What is to be explained of a sensor.
fn target(
    sensor: &Sensor,
    bare: &Document,
    samples: &[Samples],
    rests: &[Rest],
    histories: &BTreeMap<String, Known>,
) -> Target {
    let mut target = Target { values: Vec::new(), weights: Vec::new(), run: Vec::new(), share: Vec::new(), level: true };
    let rows = if sensor.gyro {
        bare.gyro.orientation.rows.get(sensor.index)
    } else {
        bare.accel.as_ref().and_then(|accel| accel.orientation.rows.get(sensor.index))
    };
    for (index, (run, rest)) in samples.iter().zip(rests).enumerate() {
        let truth = if sensor.gyro { rest.rate_deg_per_h } else { rest.force_m_per_s2 };
        let along = truth.zip(rows).map(|(truth, row)| truth.iter().zip(row).map(|(t, r)| t * r).sum::<f64>());
        target.level &= along.is_some();
        let along = along.unwrap_or(0.0);
        let empty = Vec::new();
        let outputs = if sensor.gyro { &run.gyros } else { &run.forces }.get(sensor.index).unwrap_or(&empty);
        let responses = run.responses.get(sensor.index);
        #[expect(clippy::cast_precision_loss, reason = "windows of a log")]
        let count = run.time_s.len() as f64;
        for (row, output) in outputs.iter().enumerate() {
            let response = if sensor.gyro { 1.0 } else { responses.and_then(|r| r.get(row)).copied().unwrap_or(1.0) };
            target.values.push((output - along) / response);
            target.run.push(index);
            #[expect(clippy::cast_precision_loss, reason = "windows of a log")]
            target.share.push(row as f64 / count - 0.5);
        }
    }
    if let Some(known) = histories.get(&sensor.channel) {
        target.weights = equal_temperature(&known.temperature, known.history.range_deg_c);
    }
    target
}

/// The filter with which the sensors are explained best together.
fn choose_filter(
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
        None if sequential => (SLOW_SMOOTHINGS_S.to_vec(), DERIVATIVE_STEPS_S.to_vec()),
        None => (SMOOTHINGS_S.to_vec(), vec![20.0]),
    };
    let whole = |length: f64| libm::round(length / grid).max(1.0) * grid;
    let mut best: Option<(f64, Filter)> = None;
    let mut tried: BTreeSet<(u64, u64)> = BTreeSet::new();
    for smoothing in &smoothings {
        for step in &steps {
            let mut trial = Filter { smoothing_s: whole(*smoothing), derivative_step_s: whole(*step), ..filter.clone() };
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
                        super::model::Dynamics { name: String::new(), terms: vec![rate, acceleration] }
                    } else {
                        search::ladders(false, grid, &known.history).pop().unwrap_or_default()
                    };
                }
                columns.make(&spec.terms(true))?;
                for (sensor, target) in sensors.iter().zip(targets) {
                    if sensor.channel == *name && sensor.dead.is_none() && (sensor.gyro || !sequential) {
                        cost += target.solve(&columns, &spec, false).map_or(0.0, |solution| libm::log(solution.rms));
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

/// A twentieth of what Ṫ·T̈ reaches: the blend between run-up and braking.
fn usual_product(rate: &[f64], acceleration: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = rate.iter().zip(acceleration).map(|(r, a)| (r * a).abs()).filter(|p| p.is_finite()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let high = sizes.get(sizes.len() * 95 / 100).copied().unwrap_or(0.0);
    (0.05 * high).max(1e-12)
}

/// Finds the terms of one sensor.
fn find(
    columns: &mut Columns<'_>,
    (sensor, target): (&Sensor, &Target),
    known: &Known,
    searched: &[super::model::Dynamics],
    settings: &Settings,
) -> Result<Found, Error> {
    if let Some(why) = &sensor.dead {
        return Ok(Found::refused(why));
    }
    let history = &known.history;
    if settings.method == Method::Sequential {
        if !history.both_directions() {
            return Ok(Found::refused("the temperature goes one way only: the sequential method needs ramps both ways"));
        }
        let grid = columns.basis().filter.grid_step_s;
        let steps = if sensor.gyro {
            sequential::gyro_terms().to_vec()
        } else {
            vec![search::lags(&[(3.0 * grid).max(10.0)], 0).terms]
        };
        columns.make(&terms_of(&[sequential::degree(history)], &[]))?;
        for terms in &steps {
            columns.make(terms)?;
        }
        return Ok(match sequential::find(columns, target, history, &steps) {
            Err(why) => Found::refused(&why),
            Ok(found) => {
                let (left, mean) =
                    (sequential::left(columns, target, &found), sequential::left(columns, target, &[]));
                Found::sequential(found, left, mean)
            }
        });
    }
    let dynamics = match settings.method {
        Method::Lag => searched.to_vec(),
        _ => search::ladders(sensor.gyro, columns.basis().filter.grid_step_s, history),
    };
    let degrees = if history.tells_dynamics() { &DEGREES[..] } else { &DEGREES[..3] };
    columns.make(&terms_of(degrees, &dynamics))?;
    let mut choice = target.choose(columns, (degrees, &dynamics), (history, &known.temperature));
    if settings.terms == Terms::All {
        choice.chosen = choice.tried.iter().rposition(|tried| !tried.spec.trend);
    }
    let Some(best) = choice.best().cloned() else {
        return Ok(Found::refused(
            "cross-validation has nothing to judge by: the log has one stretch of temperature only; run the chamber both ways",
        ));
    };
    if settings.terms == Terms::Auto && !(best.score <= WORTH_IT * choice.mean) {
        let why = format!(
            "nothing beats its mean: the best model, {}, leaves {:.3e} on stretches that it did not see, the mean {:.3e}; the axis \
             follows something else than temperature",
            best.spec.words(),
            best.score,
            choice.mean
        );
        return Ok(Found { choice: Some(choice), ..Found::refused(&why) });
    }
    let solution = target.solve(columns, &best.spec, true);
    Ok(match solution {
        None => Found { choice: Some(choice), ..Found::refused("the model has no solution on this log") },
        Some(solution) => Found::chosen(choice, &best.spec, &solution, target.level),
    })
}

