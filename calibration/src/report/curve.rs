//! Before and after over time and temperature, taken from runs that the service's own code has corrected.

use std::sync::Arc;

use isotherm_protocol::document::{AccelOutput, Document, Sample};

use super::verdict::Verdict;
use crate::axes::output_name;
use crate::document::Written;
use crate::error::Error;
use crate::numbers::{Size, once_each, real};
use crate::runs::table::{Rows, Table};
use crate::runs::{Run, Troubles};

/// One sensor or axis over one run, before and after. A window that either lacks is a gap in both.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Of what, such as "gyro x", as its verdict names it.
    pub of: String,
    /// Symbol of the unit of measure.
    pub measure: String,
    /// The run's name.
    pub run: String,
    /// Whether the fit saw the run.
    pub sample: Sample,
    /// Distance of the values (s); 0 where they are not equally spaced, and there is no spectrum.
    pub window_s: f64,
    /// Time of each value since the run's beginning (s).
    pub time_s: Arc<[f64]>,
    /// Temperature of the time (°C); empty where none is known.
    pub temperature_deg_c: Vec<f64>,
    /// Without the fitted terms.
    pub before: Vec<f64>,
    /// With them.
    pub after: Vec<f64>,
}

/// What a unit at rest would put out if it were without error. Where it is not known, the mean over the run is taken off,
/// before and after each its own.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rest {
    /// Earth rate along the case axes (°/h).
    pub rate_deg_per_h: Option<[f64; 3]>,
    /// Specific force along the case axes (m/s²).
    pub force_m_per_s2: Option<[f64; 3]>,
    /// Levels before and after by axis, gyros first, of another part of the same log: they stand in for what is not known.
    pub levels: Option<[[f64; 2]; 6]>,
}

impl Rest {
    /// What is known of an output, 0…5, gyros first.
    pub fn truth(&self, output: usize) -> Option<f64> {
        let known = if output < 3 { self.rate_deg_per_h } else { self.force_m_per_s2 };
        known.map(|known| known[output % 3])
    }
}

/// An output of a table, 0…5, gyros first.
pub fn column(table: &Table, output: usize) -> &[f64] {
    if output < 3 { table.rate(output) } else { table.force(output - 3) }
}

/// Runs, corrected before and after.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Judged {
    /// By run and axis: gyros first, then accelerometers; an axis without any good window is not there.
    pub curves: Vec<Curve>,
    /// What the corrections passed over, behind the name of the run.
    pub troubles: Troubles,
}

/// What a run's unit would put out without error, the run's windows, and which of its curves count: those of what begins so, "gyro",
/// "accelerometer" or "" for all.
pub type Judging = (Rest, Rows, &'static str);

/// Corrects runs of the fit, and others that it has not seen, with two documents, and lays the outputs side by side along the case axes,
/// averaged over windows. `of_run` is told the run's number among all.
///
/// # Errors
/// As [`Run::correct_together`].
pub fn judge(
    (runs, unseen): (&[Run], &[Run]),
    [before, after]: [&Written; 2],
    of_run: impl Fn(usize, &Run) -> Result<Judging, Error>,
) -> Result<Judged, Error> {
    let mut judged = Judged::default();
    let loaded = [after.loaded.clone(), before.loaded.clone()];
    for (index, run) in runs.iter().chain(unseen).enumerate() {
        let (rest, rows, counts) = of_run(index, run)?;
        let sample = if index < runs.len() { Sample::In } else { Sample::Out };
        let tables = Table::together(run, &loaded, rows)?;
        let [of_after, of_before] = <[Table; 2]>::try_from(tables).unwrap_or_default();
        let curves = Curve::of_tables(&run.name, sample, [&of_before, &of_after], &after.document, &rest);
        judged.curves.extend(curves.into_iter().filter(|curve| curve.of.starts_with(counts)));
        let passed_over = once_each([of_after.troubles, of_before.troubles].concat());
        judged.troubles.extend(passed_over.iter().map(|words| format!("{}: {words}", run.name)));
    }
    Ok(judged)
}

impl Curve {
    /// The curves of two corrections of the same run; the document tells which temperature channel an axis follows.
    pub fn of_tables(
        run: &str,
        sample: Sample,
        [before, after]: [&Table; 2],
        document: &Document,
        rest: &Rest,
    ) -> Vec<Self> {
        let time_s: Arc<[f64]> = after.time_s.as_slice().into();
        let axis_of = |output: usize| {
            let (gyro, axis) = (output < 3, output % 3);
            let truth = rest.truth(output).map(|truth| [truth; 2]);
            let carried = rest.levels.map(|levels| levels[output]);
            let [before, after_values] =
                common([before, after].map(|table| column(table, output)), truth.or(carried))?;
            let channel = channel_of(document, gyro, axis);
            let temperature = channel.and_then(|channel| after.temperature_deg_c.get(&channel).cloned());
            Some(Self {
                of: output_name(gyro, axis),
                measure: if gyro { "°/h" } else { "m/s²" }.to_owned(),
                run: run.to_owned(),
                sample,
                window_s: after.window_s,
                time_s: Arc::clone(&time_s),
                temperature_deg_c: temperature.unwrap_or_default(),
                before,
                after: after_values,
            })
        };
        (0..6).filter_map(axis_of).collect()
    }

    /// Sizes before and after.
    pub fn sizes(&self) -> [Size; 2] {
        [Size::of(&self.before), Size::of(&self.after)]
    }

    /// One verdict for each sensor of some curves, in the order of their first appearance, over all runs in and out of
    /// sample together, as [`Verdict::of_values`].
    pub fn verdicts(curves: &[Self]) -> Vec<Verdict> {
        let values = |of: &str, sample: Sample| {
            let mine = || curves.iter().filter(|curve| curve.of == of && curve.sample == sample);
            let all = |values: fn(&Self) -> &[f64]| -> Vec<f64> {
                mine().flat_map(|curve| values(curve).iter().copied()).collect()
            };
            mine().next().map(|_| [all(|curve| &curve.before), all(|curve| &curve.after)])
        };
        let verdict = |named: &Self| {
            let inside = values(&named.of, Sample::In).unwrap_or_default();
            Verdict::of_values(&named.of, &named.measure, inside, values(&named.of, Sample::Out))
        };
        Self::firsts(curves).into_iter().map(verdict).collect()
    }

    /// The first curve of each sensor.
    pub(super) fn firsts<'a>(curves: impl IntoIterator<Item = &'a Self>) -> Vec<&'a Self> {
        curves.into_iter().fold(Vec::new(), |mut firsts: Vec<&'a Self>, curve| {
            if firsts.iter().all(|first| first.of != curve.of) {
                firsts.push(curve);
            }
            firsts
        })
    }
}

/// Both where both are numbers, less what a unit without error would put out of each, or less the mean of each; `None` without any.
fn common([before, after]: [&[f64]; 2], truth: Option<[f64; 2]>) -> Option<[Vec<f64>; 2]> {
    let pairs: Vec<(f64, f64)> = before
        .iter()
        .zip(after)
        .map(|(a, b)| if a.is_finite() && b.is_finite() { (*a, *b) } else { (f64::NAN, f64::NAN) })
        .collect();
    let good: Vec<&(f64, f64)> = pairs.iter().filter(|(a, _)| a.is_finite()).collect();
    if good.is_empty() {
        return None;
    }
    let mean = |of: fn(&(f64, f64)) -> f64| good.iter().map(|pair| of(pair)).sum::<f64>() / real(good.len());
    let [before, after] = truth.unwrap_or_else(|| [mean(|pair| pair.0), mean(|pair| pair.1)]);
    Some([pairs.iter().map(|(a, _)| a - before).collect(), pairs.iter().map(|(_, b)| b - after).collect()])
}

/// Unit of measure of the accelerometers' output, which their biases have too; empty for a unit without accelerometers.
pub fn output_unit(document: &Document) -> &'static str {
    document.accel.as_ref().map_or("", |accel| match accel.output {
        AccelOutput::Counts => "counts/s",
        AccelOutput::Volts => "V",
        AccelOutput::MetresPerSecondSquared => "m/s²",
    })
}

/// The channel that the sensor follows which looks along a case axis more than the others do.
pub fn channel_of(document: &Document, gyro: bool, axis: usize) -> Option<String> {
    let along = |rows: &[[f64; 3]]| {
        let part = |row: &[f64; 3]| row.get(axis).copied().unwrap_or(0.0).abs();
        let largest = |best: (usize, f64), (index, row): (usize, &[f64; 3])| {
            if part(row) > best.1 { (index, part(row)) } else { best }
        };
        rows.iter().enumerate().fold((0, 0.0), largest).0
    };
    let first = document.temperature.channel.first().map(|channel| channel.name.clone());
    let own = if gyro {
        let sensor = document.gyro.sensor.get(along(&document.gyro.orientation.rows));
        sensor.and_then(|sensor| sensor.channel.clone())
    } else {
        let accel = document.accel.as_ref()?;
        accel.sensor.get(along(&accel.orientation.rows)).and_then(|sensor| sensor.channel.clone())
    };
    own.or(first)
}
