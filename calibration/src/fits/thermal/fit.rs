//! From runs to a document and its report.

use isotherm_protocol::document::Document;

use super::bare::{bare, carry, filter, nominal_of};
use super::checks::{self, Findings};
use super::columns::Columns;
use super::filter::{choose_filter, longest_run_s};
use super::joint::{Found, Joint, rivals};
use super::known::{Known, channel, histories};
use super::outcome::Outcome;
use super::samples::Samples;
use super::select::Target;
use super::sequential;
use super::settings::{Method, Settings};
use super::stand::Stand;
use super::target::{rest, target};
use crate::document::{Fitted, accelerometers};
use crate::error::Error;
use crate::finding::ThermalKind;
use crate::report::{Rest, few, six};
use crate::runs::Run;
use crate::runs::series::Series;
use crate::runs::table::usual_window_s;

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

impl Sensor {
    /// Whether it works and follows a channel.
    pub(super) fn follows(&self, channel: &str) -> bool {
        self.dead.is_none() && self.channel == channel
    }
}

/// Fits the thermal terms of a unit to its runs, and judges them on others.
///
/// # Errors
/// [`Error::Refused`] with every reason why the runs do not allow it; [`Error::Log`], [`Error::Document`].
pub fn fit(
    base: Option<&Document>,
    (runs, judges): (&[Run], &[Run]),
    settings: &Settings,
) -> Result<Fitted, Error> {
    let mut warnings = Vec::new();
    let (mut refusals, mut dead) = (Vec::new(), Vec::new());
    let mut series: Vec<Series> = Vec::new();
    let stands: Vec<Stand> = (0..runs.len() + judges.len()).map(|run| settings.stand(run)).collect();
    let all =
        || runs.iter().chain(judges).zip(&stands).enumerate().map(|(index, of)| (index < runs.len(), of));
    for (is_fitted, (run, stand)) in all() {
        let of_run = run.series()?;
        if is_fitted {
            let found = checks::raw(&run.name, &of_run, stand);
            refusals.extend(found.refusals);
            warnings.extend(found.warnings);
            dead.extend(found.dead);
        } else {
            warnings.extend(checks::judging(&run.name, &of_run, stand));
        }
        refusals.extend(twins((run, &of_run), series.iter().zip(runs.iter().chain(judges)), !is_fitted));
        series.push(of_run);
    }
    let first = series.first().ok_or_else(|| Error::refused("there is no run to fit to"))?;
    if !refusals.is_empty() {
        return Err(Error::Refused(refusals));
    }
    let base = match base {
        Some(base) => base.clone(),
        None => nominal_of(first)?,
    };
    if base.accel.is_none() && !first.accels.is_empty() {
        warnings.push(
            "the log's accelerometers are left out: the document has none; add [accel] to fit them"
                .to_owned(),
        );
    }
    warnings.extend(trends_removed(&base));
    let mut plain = bare(&base);
    if plain.temperature.channel.is_empty() {
        return Err(Error::refused(
            "the document has no temperature channel: a thermal fit needs one; add [[temperature.channel]]",
        ));
    }
    let channels = series.iter().flat_map(|series| series.temperatures.values());
    let step_s = channels.map(|channel| checks::median_step_s(&channel.time_ns)).fold(0.0, f64::max);
    if let Some(grids_s) = carry(&mut plain, &series, step_s) {
        let [stated_s, carried_s] = grids_s.map(six);
        warnings.push(format!(
            "temperature readings come every {} s: the document's grid of {stated_s} s is too fine, and is replaced \
             by one of {carried_s} s",
            six(step_s)
        ));
    }
    let filter = plain.temperature.filter.get_or_insert_with(|| filter(step_s)).clone();
    // No window is shorter than the readings are apart.
    let settings =
        &Settings { fit_window_s: settings.fit_window_s.max(libm::ceil(step_s)), ..settings.clone() };
    let mut samples = Vec::new();
    let mut rests = Vec::new();
    let mut sound = Vec::new();
    for ((is_fitted, (run, stand)), series) in all().zip(&series) {
        let window_s = stand.window_s(settings.fit_window_s);
        let (of_readings, far) = checks::far(&run.name, series, (&plain, stand), window_s);
        let run = &run.without(far);
        sound.push(run.clone());
        let of_run = Samples::of(run, series, &plain, window_s)?;
        let (of_rest, mut found) = stands_as_stated(run, &of_run, (&base, &plain), (stand, &dead))?;
        found.refusals.extend(checks::frozen(&run.name, series, &plain));
        found.refusals.extend(of_readings.refusals);
        found.warnings.extend(of_readings.warnings);
        if is_fitted {
            rests.extend(of_rest);
            refusals.extend(found.refusals);
            samples.push(of_run);
        } else {
            // What can be judged is judged.
            warnings.extend(found.refusals);
        }
        warnings.extend(found.warnings);
    }
    if !refusals.is_empty() {
        return Err(Error::Refused(refusals));
    }
    let sensors = sensors(&plain, &dead, (&samples, &stands));
    let histories = histories(&plain, &filter, &sensors, &samples, &mut warnings)?;
    let targets: Vec<Target> = sensors
        .iter()
        .map(|sensor| target(sensor, &plain, &samples, (&rests, &stands), &histories))
        .collect();
    let chosen = choose_filter(&filter, &plain, (&sensors, &targets), &samples, &histories, settings)?;
    let usual_s = || usual_window_s(longest_run_s(&samples), settings.fit_window_s);
    let settings =
        &Settings { window_s: Some(settings.window_s.unwrap_or_else(usual_s)), ..settings.clone() };
    let mut outcome = Outcome::new(&base, plain, chosen.clone(), settings);
    outcome.warnings = warnings;
    outcome.scales(&sensors, &targets);
    let longest_s = longest_run_s(&samples);
    for (name, known) in &histories {
        let columns = Columns::new(known.basis(channel(&outcome.bare, name)?, &chosen), &samples);
        let all: Vec<(&Sensor, &Target)> =
            sensors.iter().zip(&targets).filter(|(sensor, _)| sensor.channel == *name).collect();
        sensors_of(&mut outcome, columns, &all, (known, longest_s), &samples)?;
        outcome.history(name, &known.history);
    }
    outcome.finish(sound.split_at(runs.len()), |run, stand| rest(run, &base, stand))
}

/// That the new terms of a gyro take the place of its trend, which the runs hold too.
fn trends_removed(base: &Document) -> impl Iterator<Item = String> {
    let with_trend = base.gyro.sensor.iter().filter(|gyro| gyro.trend.is_some());
    with_trend.map(|gyro| {
        format!("gyro {}: its trend since turn-on is removed if its new terms are accepted: they are of the whole reading", gyro.name)
    })
}

/// The logs that have the same readings as a run.
fn twins<'a>(
    (run, series): (&Run, &Series),
    known: impl Iterator<Item = (&'a Series, &'a Run)>,
    judges: bool,
) -> Vec<String> {
    let same = known.filter(|(other, _)| series.gyros.overlap(&other.gyros));
    let words = |(_, other): (&Series, &Run)| {
        ThermalKind::SameReadings { log: run.name.clone(), other: other.name.clone(), judges }.to_string()
    };
    same.map(words).collect()
}

/// Whether a run feels what it must in its stated attitude, and what it would put out without error where it does.
fn stands_as_stated(
    run: &Run,
    of_run: &Samples,
    (base, plain): (&Document, &Document),
    (stand, dead): (&Stand, &[(bool, usize, String)]),
) -> Result<(Option<Rest>, Findings), Error> {
    let mut found = checks::corrected(of_run, stand, dead);
    if !found.refusals.is_empty() {
        return Ok((None, found));
    }
    let rest = rest(run, base, stand)?;
    found.refusals.extend(checks::turning(of_run, plain, stand));
    let stands = checks::attitude(of_run, plain, (&rest, stand));
    found.refusals.extend(stands.refusals);
    found.warnings.extend(stands.warnings);
    Ok((Some(rest), found))
}

/// That few windows of a sensor are complete: it cannot be fitted, and the others must not wait for it.
fn few_windows((gyro, index): (bool, usize), samples: &[Samples], stands: &[Stand]) -> Option<String> {
    // On a table the accelerometers take no part.
    let takes_part = samples.iter().zip(stands).filter(|(_, stand)| gyro || stand.turning.is_none());
    let counts = takes_part.map(|(run, _)| run.complete(gyro, index));
    few(counts.fold([0, 0], |[complete, all], [own, of]| [complete + own, all + of]))
}

/// Every sensor that follows a channel.
fn sensors(
    bare: &Document,
    dead: &[(bool, usize, String)],
    (samples, stands): (&[Samples], &[Stand]),
) -> Vec<Sensor> {
    let sensor = |gyro: bool, index: usize, name: &str, channel: Option<&String>| {
        let dead = dead.iter().find(|(g, i, _)| (*g, *i) == (gyro, index)).map(|(_, _, why)| why.clone());
        let dead = dead.or_else(|| few_windows((gyro, index), samples, stands));
        let kind = if gyro { "gyro" } else { "accelerometer" };
        Some(Sensor { gyro, index, name: format!("{kind} {name}"), channel: channel?.clone(), dead })
    };
    let gyros = bare.gyro.sensor.iter().enumerate();
    let gyros = gyros.filter_map(|(index, own)| sensor(true, index, &own.name, own.channel.as_ref()));
    let accels = accelerometers(bare).iter().enumerate();
    let accels = accels.filter_map(|(index, own)| sensor(false, index, &own.name, own.channel.as_ref()));
    gyros.chain(accels).collect()
}

/// Finds the terms of a channel's sensors.
fn sensors_of<'a>(
    outcome: &mut Outcome,
    mut columns: Columns<'a>,
    sensors: &[(&'a Sensor, &'a Target)],
    (known, longest_s): (&'a Known, f64),
    samples: &'a [Samples],
) -> Result<(), Error> {
    let (dead, alive): (Vec<_>, Vec<_>) = sensors.iter().partition(|(sensor, _)| sensor.dead.is_some());
    let method = outcome.settings.method;
    if method.is_stepwise() {
        columns.span_derivatives()?;
    }
    let basis = columns.basis().clone();
    for (sensor, _) in dead {
        outcome.add(sensor, &basis, Found::refused(sensor.dead.as_deref().unwrap_or_default()));
    }
    if method.is_stepwise() {
        for (sensor, target) in alive {
            let found = step_by_step(&mut columns, (sensor, target), known, method)?;
            outcome.add(sensor, &basis, found);
        }
        return Ok(());
    }
    let terms = outcome.settings.terms;
    let mut joint = Joint::of(columns, samples, (known, longest_s), &alive)?;
    for (sensor, _) in alive {
        let found = joint.find(sensor, terms)?;
        outcome.add(sensor, &basis, found);
    }
    Ok(())
}

/// Finds the terms of one sensor one after the other.
fn step_by_step(
    columns: &mut Columns<'_>,
    (sensor, target): (&Sensor, &Target),
    known: &Known,
    method: Method,
) -> Result<Found, Error> {
    let history = &known.history;
    if !history.both_directions() {
        return Ok(Found::refused(
            "the temperature goes one way only: methods sequential and rate need ramps both ways",
        ));
    }
    let choice = sequential::choose(columns, (sensor.gyro, target), known, method)?;
    let Some(dynamics) = choice.best().map(|best| &best.spec.dynamics) else {
        return Ok(Found::refused("too few windows for cross-validation"));
    };
    let mut found = match sequential::find(columns, target, history, &dynamics.terms) {
        Err(why) => Found::refused(&why),
        Ok(terms) => Found::unless_better(&choice, target, columns).unwrap_or_else(|| {
            let words = format!("plateaus, then {}", dynamics.name);
            Found { terms, words, ..Found::default() }
        }),
    };
    found.rivals = Some(rivals(columns, sensor, target, target.widest_scale())?);
    found.choice = Some(choice);
    Ok(found)
}
