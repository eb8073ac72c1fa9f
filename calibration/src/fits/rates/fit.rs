//! The whole procedure: bin, find the steps, fit, write, judge.

use std::collections::BTreeMap;

use isotherm_correction::earth::Place;
use isotherm_protocol::document::Document;

use super::attitude;
use super::checks::{no_result, one_way};
use super::document;
use super::matching::Matched;
use super::measure::{carry_earth, first_gains, group, points, white};
use super::model::{GyroRates, solve};
use super::over_temperature::{OverTemperature, levels_of};
use super::read::{Turned, read, whole_turns};
use super::steps::Step;
use crate::axes::{AXES, main_axis};
use crate::document::Written;
use crate::error::Error;
use crate::finding::{Finding, Kind};
use crate::fits::modes::document::{row, widened};
use crate::numbers::{hull, mean, median};
use crate::report::{Verdict, beside, of_logs};
use crate::runs::Run;
use crate::runs::table::{Rows, Table};

/// Rounds in which the Earth's turning and the fit settle.
const ROUNDS: usize = 3;

/// What the fit starts from.
#[derive(Debug, Clone)]
pub struct Wanted<'a> {
    /// Runs.
    pub runs: &'a [Run],
    /// Runs that the fit does not see and is judged on.
    pub judge: &'a [Run],
    /// What the table did in all of them; the numbers of the judging runs follow on those of the others.
    pub steps: &'a [Step],
    /// Whether the document's weights are near those of the unit; without a document those of counts are not.
    pub scale_known: bool,
    /// Document that gives channels, filter, biases, and the scale and axes that are to be replaced.
    pub base: &'a Document,
    /// Where the table is, and how the case stands on it at the beginning of each run; one for all, one for each, or none.
    pub place: &'a [Place],
    /// Standard deviation of the table's rates (ppm).
    pub table_ppm: f64,
    /// Whether the bias that is found is written too.
    pub with_bias: bool,
}

/// What came of it.
#[derive(Debug, Clone)]
pub struct Made {
    /// The document.
    pub written: Written,
    /// What was found of each gyro, or why nothing was.
    pub gyros: Vec<Result<GyroRates, Kind>>,
    /// The steps.
    pub steps: Vec<Matched>,
    /// The steps of the judging runs.
    pub judged: Vec<Matched>,
    /// Whether the Earth's rate was taken off in a stated attitude.
    pub earth_known: bool,
    /// Whether the weights of the base are near those of the unit.
    pub scale_known: bool,
    /// Verdicts, by case axis.
    pub verdicts: Vec<Verdict>,
    /// Mean temperature of each run (°C).
    pub temperatures_deg_c: Vec<f64>,
    /// Axes and scale factors over temperature, where there are several.
    pub over_temperature: Option<OverTemperature>,
    /// What is to be said.
    pub warnings: Vec<Finding>,
}

/// Makes scale, axes and the rest from runs on a rate table.
///
/// # Errors
/// [`Error::Refused`] with every reason; [`Error::Log`], [`Error::Document`].
pub fn make(wanted: &Wanted<'_>) -> Result<Made, Error> {
    let mut warnings: Vec<Finding> = one_way(wanted.steps).map(Finding::from).into_iter().collect();
    let mut runs = read_all(wanted, &mut warnings)?;
    let mut judging = runs.split_off(wanted.runs.len());
    let sensors = wanted.base.gyro.sensor.len();
    // Of each gyro, its white noise and what it shows of a rate.
    let mut shows = vec![(0.0, [0.0; 3]); sensors];
    let mut axes: Vec<[f64; 3]> = (0..sensors).map(|sensor| row(wanted.base, sensor, f64::NAN)).collect();
    let mut gains = first_gains(&runs, &axes);
    let mut gyros = Vec::new();
    for _ in 0..ROUNDS {
        carry_earth(&mut runs, &axes, &gains, &gyros);
        for (sensor, (walk, gain)) in shows.iter_mut().enumerate() {
            *gain = axes[sensor].map(|x| x * gains[sensor]);
            *walk = white(wanted.base, &runs, sensor, *gain);
        }
        gyros = (0..sensors)
            .map(|sensor| {
                solve(&points(wanted, &runs, sensor, shows[sensor]), row(wanted.base, sensor, f64::NAN))
            })
            .collect();
        for (sensor, found) in gyros.iter().enumerate() {
            if let Ok(found) = found {
                gains[sensor] = found.gain[0];
                if let Some(axis) = found.axis {
                    axes[sensor] = axis;
                }
            }
        }
    }
    carry_earth(&mut judging, &axes, &gains, &gyros);
    let over_temperature = match OverTemperature::of(wanted, &runs, &shows) {
        Ok(found) => found,
        Err(deg_c) => {
            warnings.push(Kind::NotEachTemperature { deg_c }.into());
            None
        }
    };
    if let Some(over) = &over_temperature {
        for (sensor, found) in gyros.iter_mut().enumerate() {
            let points = over.at_reference(wanted, &runs, sensor, shows[sensor]);
            *found = solve(&points, row(wanted.base, sensor, f64::NAN));
        }
    }
    let steps = steps_of(&runs);
    let rates: Vec<[f64; 3]> = steps.iter().map(|one| one.rate).collect();
    let mut doubted = Vec::new();
    for (sensor, found) in gyros.iter_mut().enumerate() {
        let what =
            found.as_ref().ok().and_then(|found| no_result(found, &rates, axes[sensor], wanted.scale_known));
        if let Some(what) = what {
            *found = Err(what.clone());
            doubted.push((sensor, what));
        }
    }
    if gyros.iter().all(Result::is_err) {
        let named = wanted.base.gyro.sensor.iter().zip(gyros);
        return Err(Error::Found(
            named.filter_map(|(sensor, found)| Some(found.err()?.of_gyro(&sensor.name))).collect(),
        ));
    }
    let temperatures: Vec<f64> = runs.iter().filter_map(|run| run.binned.temperature_deg_c).collect();
    let axes_deg_c = runs.iter().find_map(|run| run.binned.axes_deg_c);
    let judged = steps_of(&judging);
    runs.extend(judging);
    warnings.extend(attitude::doubts(wanted.place, &runs, (&axes, &gains)));
    let mut made = Made {
        written: Written::of(wanted.base)?,
        gyros,
        steps,
        judged,
        earth_known: !wanted.place.is_empty(),
        scale_known: wanted.scale_known,
        verdicts: Vec::new(),
        temperatures_deg_c: temperatures,
        over_temperature,
        warnings,
    };
    made.settle(wanted, axes_deg_c, &doubted)?;
    Ok(made)
}

/// Reads the runs and, behind them, the judging ones.
fn read_all(wanted: &Wanted<'_>, warnings: &mut Vec<Finding>) -> Result<Vec<Turned>, Error> {
    let (mut runs, mut reasons) = (Vec::new(), Vec::new());
    for (number, run) in wanted.runs.iter().chain(wanted.judge).enumerate() {
        match read(wanted, number, run)? {
            Ok(read) => runs.push(read),
            Err(reason) => reasons.push(reason),
        }
    }
    if !reasons.is_empty() {
        return Err(Error::Found(reasons));
    }
    let names = wanted.runs.iter().chain(wanted.judge).map(|run| run.name.as_str());
    let troubles: Vec<(&str, String)> = names
        .zip(&runs)
        .flat_map(|(name, run)| run.binned.troubles.iter().map(move |words| (name, words.clone())))
        .collect();
    warnings.extend(of_logs(&troubles).into_iter().map(|words| Kind::Passed { words }.into()));
    if wanted.place.is_empty() {
        warnings.push(Kind::NoAttitude.into());
        let rates: Vec<f64> = runs.iter_mut().flat_map(whole_turns).collect();
        if !rates.is_empty() {
            warnings.push(Kind::ShortSteps { rates }.into());
        }
    }
    let levels = levels_of(wanted.base, &runs).map_or_else(|| vec![0; runs.len()], |(level_of, _)| level_of);
    group(&mut runs, &levels, wanted.place.is_empty());
    Ok(runs)
}

fn steps_of(runs: &[Turned]) -> Vec<Matched> {
    runs.iter().flat_map(|run| run.matched.iter().cloned()).collect()
}

impl Made {
    /// Writes and judges; gyros that make an axis worse keep weight and axis, and all is judged once more. Axes of gyros that
    /// came to nothing are refused.
    fn settle(
        &mut self,
        wanted: &Wanted<'_>,
        axes_deg_c: Option<f64>,
        doubted: &[(usize, Kind)],
    ) -> Result<(), Error> {
        self.judge(wanted, 0)?;
        self.write(wanted, axes_deg_c)?;
        self.verdicts = verdicts(&self.steps, &self.judged);
        let worse: Vec<usize> =
            (0..self.verdicts.len()).filter(|axis| !self.verdicts[*axis].accepted).collect();
        let main_axes: Vec<usize> = wanted.base.gyro.orientation.rows.iter().map(main_axis).collect();
        if !worse.is_empty() {
            for (main, gyro) in main_axes.iter().zip(&mut self.gyros).filter(|(main, _)| worse.contains(main))
            {
                *gyro = Err(Kind::Worse { axis: *main });
            }
            self.write(wanted, axes_deg_c)?;
            self.verdicts = beside(&self.verdicts, verdicts(&self.steps, &self.judged));
        }
        for (axis, verdict) in self.verdicts.iter_mut().enumerate().filter(|(_, verdict)| verdict.accepted) {
            let mut own = main_axes.iter().zip(&self.gyros).filter(|(main, _)| **main == axis).peekable();
            if own.peek().is_some()
                && own.all(|(_, gyro)| matches!(gyro, Err(Kind::NothingTurns | Kind::Across)))
            {
                *verdict = Verdict::said(&verdict.of, "not turned about, left as it was");
            }
        }
        for (sensor, what) in doubted {
            if let Some(verdict) = main_axes.get(*sensor).and_then(|axis| self.verdicts.get_mut(*axis)) {
                *verdict = verdict.clone().refused(what.to_string());
            }
        }
        Ok(())
    }

    /// Writes what is left of the fits, and judges it.
    fn write(&mut self, wanted: &Wanted<'_>, axes_deg_c: Option<f64>) -> Result<(), Error> {
        // What was fitted at the reference needs no slopes to come there.
        let axes_deg_c = axes_deg_c.filter(|_| self.over_temperature.is_none());
        let mut document = document::fitted(wanted.base, &self.gyros, axes_deg_c, wanted.with_bias);
        if let Some(over) = &self.over_temperature {
            over.put(&mut document, &self.gyros);
        }
        self.written = Written::of(&document)?;
        self.judge(wanted, 1)
    }

    /// Errors of all steps with the document as it stands: before (0), after (1).
    fn judge(&mut self, wanted: &Wanted<'_>, sample: usize) -> Result<(), Error> {
        for (number, run) in wanted.runs.iter().chain(wanted.judge).enumerate() {
            let steps = if number < wanted.runs.len() { &mut self.steps } else { &mut self.judged };
            let ticks = Table::of_rows(run, &self.written.loaded, Rows::TICKS)?;
            for one in steps.iter_mut().filter(|one| one.step.run == number) {
                let mean = ticks.mean_rate_within(one.plateau.window_s);
                one.error[sample] = [0, 1, 2].map(|axis| mean[axis] - one.rate[axis]);
            }
        }
        Ok(())
    }

    /// Median of the runs' mean temperatures (°C).
    pub fn temperature_deg_c(&self) -> Option<f64> {
        (!self.temperatures_deg_c.is_empty()).then(|| median(&self.temperatures_deg_c))
    }

    /// Lowest and highest mean temperature of a run (°C), in tenths of a degree.
    pub fn range_deg_c(&self) -> Option<[f64; 2]> {
        let ends = self.temperatures_deg_c.iter().map(|deg_c| [*deg_c, *deg_c]);
        hull(ends).map(widened)
    }
}

/// Before and after by case axis, of the steps that were fitted and of those that were not, which decide where there are any; the
/// bias is not what rates are about, so the mean of each group of steps that have one bias is taken off.
fn verdicts(steps: &[Matched], judged: &[Matched]) -> Vec<Verdict> {
    let of = |steps: &[Matched], axis: usize, sample: usize| -> Vec<f64> {
        let mut of_group: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for one in steps {
            of_group.entry(one.group).or_default().push(one.error[sample][axis]);
        }
        let means: BTreeMap<usize, f64> =
            of_group.into_iter().map(|(group, errors)| (group, mean(&errors))).collect();
        steps.iter().map(|one| one.error[sample][axis] - means[&one.group]).collect()
    };
    AXES
        .iter()
        .enumerate()
        .map(|(axis, name)| {
            let both = |steps: &[Matched]| [of(steps, axis, 0), of(steps, axis, 1)];
            let outside = (!judged.is_empty()).then(|| both(judged));
            let verdict = Verdict::of_values(format!("gyro {name}"), "°/h", both(steps), outside);
            if verdict.accepted {
                return verdict;
            }
            let grown = format!(
                "the errors of its steps grow, {}: check the table's axis and rates, and the temperature of all logs",
                verdict.reason
            );
            verdict.refused(grown)
        })
        .collect()
}
