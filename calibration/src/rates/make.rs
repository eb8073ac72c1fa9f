//! The whole procedure: bin, find the steps, fit, write, judge.

use isotherm_correction::earth::Place;
use isotherm_protocol::document::{Document, GyroOutput};

use super::bins::{BIN_S, Bin, Binned, binned};
use super::document;
use super::earth::carried;
use super::matching::{Matched, matched};
use super::plateaus;
use super::solve::{GyroRates, Point, solve};
use super::steps::Step;
use crate::error::Error;
use crate::means::Size;
use crate::modes::document::{count_arcsec, row};
use crate::modes::fit::deg_per_h;
use crate::modes::robust::median;
use crate::report::{FitReport, Verdict};
use crate::run::{Run, Watch};
use crate::written::Written;

/// Rounds in which the Earth's turning and the fit settle.
const ROUNDS: usize = 3;
/// Share of a step's ticks that may be lost.
const LOST: f64 = 0.05;
/// Largest share of a turn, in whole turns, that is left at the end of a step where the Earth is not known.
const TURN_DEG: f64 = 360.0;

/// What the fit starts from.
#[derive(Debug, Clone)]
pub struct Wanted<'a> {
    /// Runs.
    pub runs: &'a [Run],
    /// What the table did in them.
    pub steps: &'a [Step],
    /// Document that gives channels, filter, biases, and the scale and axes that are to be replaced.
    pub base: &'a Document,
    /// Where the table is, and how the case stands on it at the beginning of each run; one for all, one for each, or none.
    pub place: &'a [Place],
    /// Standard deviation of the table's rates (ppm).
    pub table_ppm: f64,
    /// Whether the bias that is found is written too.
    pub with_bias: bool,
}

/// A step with what was measured in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// The step and its plateau.
    pub matched: Matched,
    /// True rate of the case (°/h).
    pub rate: [f64; 3],
    /// Error of the corrected rate in case axes (°/h), before and after.
    pub error: [[f64; 3]; 2],
}

/// What came of it.
#[derive(Debug, Clone)]
pub struct Made {
    /// The document.
    pub written: Written,
    /// What was found of each gyro, or why nothing was.
    pub gyros: Vec<Result<GyroRates, String>>,
    /// The steps.
    pub steps: Vec<Measured>,
    /// White noise of each gyro (°/√h).
    pub walk: Vec<f64>,
    /// Verdicts, by case axis.
    pub verdicts: Vec<Verdict>,
    /// Mean temperature of the runs (°C).
    pub temperature_deg_c: Option<f64>,
    /// What is to be said.
    pub warnings: Vec<String>,
}

/// One run with its steps.
struct Turned {
    binned: Binned,
    matched: Vec<Matched>,
    earth_start: Option<[f64; 3]>,
}

/// Makes scale, axes and the rest from runs on a rate table.
///
/// # Errors
/// [`Error::Refused`] with every reason; [`Error::Log`], [`Error::Document`].
pub fn make<W: Watch>(wanted: &Wanted<'_>, mut watch: impl FnMut() -> W) -> Result<Made, Error> {
    let mut warnings = Vec::new();
    let mut runs = Vec::new();
    let mut reasons = Vec::new();
    for (number, run) in wanted.runs.iter().enumerate() {
        match read(wanted, number, run, &mut watch, &mut warnings)? {
            Ok(read) => runs.push(read),
            Err(reason) => reasons.push(reason),
        }
    }
    if !reasons.is_empty() {
        return Err(Error::Refused(reasons));
    }
    if wanted.place.is_empty() {
        warnings.push(
            "the Earth rate is not known: steps are cut to whole turns, and its share along the table's axis is in the bias. Give \
             --latitude, --heading, --pitch and --roll of the beginning of each log"
                .to_owned(),
        );
        for run in &mut runs {
            whole_turns(run, &mut warnings);
        }
    }
    let sensors = wanted.base.gyro.sensor.len();
    let mut walk = vec![0.0; sensors];
    let mut axes: Vec<[f64; 3]> = (0..sensors).map(|sensor| row(wanted.base, sensor, f64::NAN)).collect();
    let mut gains = first_gains(&runs, &axes);
    let mut biases = vec![0.0; sensors];
    let mut gyros = Vec::new();
    let mut rates = Vec::new();
    for _ in 0..ROUNDS {
        let earth = earth_in_bins(&runs, &axes, &gains, &biases);
        rates = true_rates(&runs, &earth);
        for (sensor, walk) in walk.iter_mut().enumerate() {
            *walk = white(wanted.base, &runs, &earth, sensor, axes[sensor].map(|x| x * gains[sensor]));
        }
        gyros = (0..sensors)
            .map(|sensor| {
                solve(&points(wanted, &runs, &rates, sensor, walk[sensor]), axes_of(wanted.base, sensor))
            })
            .collect();
        for (sensor, found) in gyros.iter().enumerate() {
            if let Ok(found) = found {
                gains[sensor] = found.gain[0];
                biases[sensor] = found.bias[0] * found.gain[0].abs();
                if let Some(axis) = found.axis {
                    axes[sensor] = axis;
                }
            }
        }
    }
    if gyros.iter().all(Result::is_err) {
        let name = |sensor: usize| &wanted.base.gyro.sensor[sensor].name;
        let of = gyros
            .iter()
            .enumerate()
            .filter_map(|(n, found)| Some(format!("gyro {}: {}", name(n), found.as_ref().err()?)));
        return Err(Error::Refused(of.collect()));
    }
    let temperatures: Vec<f64> = runs.iter().filter_map(|run| run.binned.temperature_deg_c).collect();
    let axes_deg_c = runs.iter().find_map(|run| run.binned.axes_deg_c);
    let written = Written::of(&document::fitted(wanted.base, &gyros, axes_deg_c, wanted.with_bias))?;
    let mut steps: Vec<Measured> = runs
        .iter()
        .zip(&rates)
        .flat_map(|(run, rates)| run.matched.iter().cloned().zip(rates.iter().copied()))
        .map(|(matched, rate)| Measured { matched, rate, error: [[0.0; 3]; 2] })
        .collect();
    for (sample, document) in [wanted.base, &written.document].into_iter().enumerate() {
        errors(wanted.runs, document, &mut steps, sample, &mut watch)?;
    }
    let verdicts = verdicts(&steps);
    Ok(Made {
        written,
        gyros,
        steps,
        walk,
        verdicts,
        temperature_deg_c: (!temperatures.is_empty()).then(|| median(&temperatures)),
        warnings,
    })
}

impl Made {
    /// The report.
    #[must_use]
    pub fn report(&self) -> FitReport {
        super::report::report(self)
    }
}

fn axes_of(base: &Document, sensor: usize) -> [f64; 3] {
    row(base, sensor, f64::NAN)
}

/// Reads one run and finds its steps; the inner error is a reason to refuse.
fn read<W: Watch>(
    wanted: &Wanted<'_>,
    number: usize,
    run: &Run,
    watch: &mut impl FnMut() -> W,
    warnings: &mut Vec<String>,
) -> Result<Result<Turned, String>, Error> {
    let binned = binned(run, wanted.base, &mut *watch)?;
    warnings.extend(binned.troubles.iter().map(|words| format!("{}: {words}", run.name)));
    let counts: Vec<f64> =
        (0..wanted.base.gyro.sensor.len()).map(|sensor| count_arcsec(wanted.base, sensor) / BIN_S).collect();
    let found = plateaus::find(&binned.bins, &counts);
    let own: Vec<Step> = wanted.steps.iter().filter(|step| step.run == number).copied().collect();
    if own.is_empty() {
        return Ok(Err(format!(
            "no step is stated of log {} ({}): name it in --steps, or leave it out",
            number + 1,
            run.name
        )));
    }
    let matched = match matched(&own, &binned.bins, &found) {
        Ok(matched) => matched,
        Err(reason) => return Ok(Err(reason)),
    };
    for one in &matched {
        let bins = binned.bins.get(one.plateau.bins[0]..one.plateau.bins[1]).unwrap_or_default();
        let [good, all] =
            bins.iter().fold([0.0, 0.0], |[good, all], bin| [good + bin.good_s, all + bin.length_s]);
        let [from, to] = one.plateau.window_s;
        if good < (1.0 - LOST) * all {
            return Ok(Err(format!(
                "log {}: {:.1} % of the step of {from:.1}…{to:.1} s cannot be used, {:.0} % may be lost: cut it with --steps",
                number + 1,
                100.0 * (1.0 - good / all),
                100.0 * LOST
            )));
        }
        if bins.iter().any(|bin| bin.overrange) {
            return Ok(Err(format!(
                "log {}: a gyro is at its input limit in the step of {from:.1}…{to:.1} s ({} °/s): leave the step out, or turn slower",
                number + 1,
                one.step.rate_deg_per_s
            )));
        }
    }
    let place = wanted.place.get(number).or(wanted.place.first());
    let earth_start = match place.map(|place| place.earth_rate_in_case(binned.first_force)) {
        None => None,
        Some(Some(rate)) => Some(rate.map(deg_per_h)),
        Some(None) => {
            return Ok(Err(format!(
                "log {}: the unit cannot be levelled at its beginning: give --pitch and --roll of that moment",
                number + 1
            )));
        }
    };
    Ok(Ok(Turned { binned, matched, earth_start }))
}

/// Cuts steps to whole turns, so that the Earth's horizontal part averages out.
fn whole_turns(run: &mut Turned, warnings: &mut Vec<String>) {
    for one in &mut run.matched {
        let [begin, end] = one.plateau.bins;
        let bins = run.binned.bins.get(begin..end).unwrap_or_default();
        let length_s: f64 = bins.iter().map(|bin| bin.length_s).sum();
        let turns = libm::floor(one.step.rate_deg_per_s.abs() * length_s / TURN_DEG);
        if one.step.rate_deg_per_s == 0.0 {
            continue;
        }
        if turns < 1.0 {
            warnings.push(format!(
                "the step of {} °/s from {:.1} s on is less than a turn: up to the Earth's 15 °/h of its rate is left",
                one.step.rate_deg_per_s, one.plateau.window_s[0]
            ));
            continue;
        }
        let wanted_s = turns * TURN_DEG / one.step.rate_deg_per_s.abs();
        let mut taken = 0.0;
        let count = bins.iter().take_while(|bin| {
            taken += bin.length_s;
            taken <= wanted_s + 0.5 * bin.length_s
        });
        let count = count.count().max(1);
        one.plateau.bins = [begin, begin + count];
        if let Some(last) = bins.get(count - 1) {
            one.plateau.window_s[1] = last.begin_s + last.length_s;
        }
        one.plateau.rate = plateaus::mean(&bins[..count]);
    }
}

/// White noise of a gyro from second differences of its bins within steps (°/√h), less what the Earth's turning shows along
/// its `gain`.
fn white(base: &Document, runs: &[Turned], earth: &[Vec<[f64; 3]>], sensor: usize, gain: [f64; 3]) -> f64 {
    let count = count_arcsec(base, sensor);
    let (mut sum, mut number) = (0.0, 0.0);
    for (run, earth) in runs.iter().zip(earth) {
        for one in &run.matched {
            let own = |index: usize| {
                let earth = earth.get(index).copied().unwrap_or_default();
                let seen: f64 = gain.iter().zip(earth).map(|(a, b)| a * b).sum();
                run.binned.bins[index].rate[sensor] - seen
            };
            for index in (one.plateau.bins[0] + 1)..one.plateau.bins[1].saturating_sub(1) {
                let second = own(index - 1) - 2.0 * own(index) + own(index + 1);
                let length = run.binned.bins[index].good_s;
                if second.is_finite() && length > 0.0 {
                    // White: 6·N²/L. Whole counts, differenced three times: 20·(1/12)·q²/L².
                    let counted = 20.0 / 12.0 * count * count / (length * length);
                    sum += (second * second - counted) * length / 6.0;
                    number += 1.0;
                }
            }
        }
    }
    let white = if number > 0.0 { (sum / number).max(0.0) } else { 0.0 };
    // Neighbouring second differences hang together: about a third of them are independent.
    let upper = 1.0 + 2.0 * (2.0 / (number / 3.0_f64).max(2.0)).sqrt();
    (white * upper).sqrt() / 60.0
}

/// First guess of `K_old/K` along the document's axes.
fn first_gains(runs: &[Turned], axes: &[[f64; 3]]) -> Vec<f64> {
    let steps: Vec<&Matched> = runs.iter().flat_map(|run| &run.matched).collect();
    axes.iter()
        .enumerate()
        .map(|(sensor, axis)| {
            let (mut xy, mut xx) = (0.0, 0.0);
            for one in &steps {
                let along: f64 = axis.iter().zip(one.step.axis).map(|(a, b)| a * b).sum();
                let x = 3600.0 * one.step.rate_deg_per_s * along;
                xy += x * one.plateau.rate[sensor];
                xx += x * x;
            }
            if xx > 0.0 && xy != 0.0 { xy / xx } else { 1.0 }
        })
        .collect()
}

/// Mean of the Earth's rate in case axes over each bin of each run (°/h); none where it is not known.
fn earth_in_bins(runs: &[Turned], axes: &[[f64; 3]], gains: &[f64], biases: &[f64]) -> Vec<Vec<[f64; 3]>> {
    let sum = axes.iter().fold(nalgebra::Matrix3::zeros(), |sum, axis| {
        let row = nalgebra::Vector3::from(*axis);
        sum + row * row.transpose()
    });
    let inverse = sum.try_inverse().unwrap_or_else(nalgebra::Matrix3::identity);
    let turning = |bin: &Bin| {
        let mut vector = nalgebra::Vector3::zeros();
        for (sensor, axis) in axes.iter().enumerate() {
            vector += nalgebra::Vector3::from(*axis) * ((bin.rate[sensor] - biases[sensor]) / gains[sensor]);
        }
        <[f64; 3]>::from(inverse * vector)
    };
    let of_run = |run: &Turned| {
        run.earth_start.map(|start| carried(&run.binned.bins, start, turning)).unwrap_or_default()
    };
    runs.iter().map(of_run).collect()
}

/// True rates of all steps in case axes (°/h): the table's and the Earth's.
fn true_rates(runs: &[Turned], earth: &[Vec<[f64; 3]>]) -> Vec<Vec<[f64; 3]>> {
    let of_run = |(run, earth): (&Turned, &Vec<[f64; 3]>)| {
        let of_step = |one: &Matched| {
            let table = one.step.axis.map(|axis| axis * 3600.0 * one.step.rate_deg_per_s);
            let [begin, end] = one.plateau.bins;
            let (mut sum, mut good) = ([0.0; 3], 0.0);
            let bins = run.binned.bins.get(begin..end).unwrap_or_default();
            for (bin, earth) in bins.iter().zip(earth.get(begin..end).unwrap_or_default()) {
                good += bin.good_s;
                sum.iter_mut().zip(earth).for_each(|(sum, earth)| *sum += earth * bin.good_s);
            }
            if good > 0.0 { [0, 1, 2].map(|axis| table[axis] + sum[axis] / good) } else { table }
        };
        run.matched.iter().map(of_step).collect()
    };
    runs.iter().zip(earth).map(of_run).collect()
}

/// What a gyro showed in all steps, with the noise of the means.
fn points(
    wanted: &Wanted<'_>,
    runs: &[Turned],
    rates: &[Vec<[f64; 3]>],
    sensor: usize,
    walk: f64,
) -> Vec<Point> {
    let count =
        if wanted.base.gyro.output == GyroOutput::Counts { count_arcsec(wanted.base, sensor) } else { 0.0 };
    let mut points = Vec::new();
    for (run, rates) in runs.iter().zip(rates) {
        for (one, rate) in run.matched.iter().zip(rates) {
            let bins = run.binned.bins.get(one.plateau.bins[0]..one.plateau.bins[1]).unwrap_or_default();
            let good: f64 = bins.iter().map(|bin| bin.good_s).sum();
            let white = 3600.0 * walk * walk / good;
            let counted = count * count / 6.0 / (good * good);
            let table = wanted.table_ppm * 1e-6 * 3600.0 * one.step.rate_deg_per_s;
            let variance = white + counted + table * table;
            // Readings without any noise are as good as their digits.
            let floor = 1e-9 * (1.0 + one.plateau.rate[sensor].abs());
            points.push(Point {
                rate: *rate,
                shown: one.plateau.rate[sensor],
                sigma: variance.sqrt().max(floor),
            });
        }
    }
    points
}

/// Errors of the corrected rate in the windows of the steps, by the service's own code with a document.
fn errors<W: Watch>(
    runs: &[Run],
    document: &Document,
    steps: &mut [Measured],
    sample: usize,
    watch: &mut impl FnMut() -> W,
) -> Result<(), Error> {
    let loaded = Written::of(document)?.loaded;
    for (number, run) in runs.iter().enumerate() {
        let windows: Vec<[f64; 2]> = steps
            .iter()
            .filter(|step| step.matched.step.run == number)
            .map(|step| step.matched.plateau.window_s)
            .collect();
        let means = super::bins::means_within(run, &loaded, &windows, watch())?;
        let own = steps.iter_mut().filter(|step| step.matched.step.run == number);
        for (step, mean) in own.zip(means) {
            step.error[sample] = [0, 1, 2].map(|axis| mean[axis] - step.rate[axis]);
        }
    }
    Ok(())
}

/// Before and after by case axis; the bias is not what rates are about, so means are taken off.
fn verdicts(steps: &[Measured]) -> Vec<Verdict> {
    let of = |axis: usize, sample: usize| {
        let errors: Vec<f64> = steps.iter().map(|step| step.error[sample][axis]).collect();
        let mean = Size::of(&errors).mean;
        Size::of(&errors.iter().map(|error| error - mean).collect::<Vec<_>>())
    };
    ["x", "y", "z"]
        .iter()
        .enumerate()
        .map(|(axis, name)| {
            let sizes = [of(axis, 0), of(axis, 1)];
            let verdict = Verdict::new(format!("gyro {name}"), "°/h", sizes);
            if sizes[1].rms <= sizes[0].rms {
                verdict
            } else {
                verdict.refused("the errors of its steps grow: are the table's axis and rates right?")
            }
        })
        .collect()
}
