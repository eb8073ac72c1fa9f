//! A document beside what anybody would fit first, on runs that none of them has seen: no correction, the mean, a cubic over
//! temperature, a cubic with Ṫ.

use isotherm_log::offline::Loaded;
use isotherm_pages::Table as Rows;
use isotherm_protocol::document::{Document, Sample};

use super::checks::moves_enough;
use super::columns::Term;
use super::outcome::{Outcome, axis_of};
use super::stand::Stand;
use crate::axes::output_name;
use crate::document::{Written, accelerometers};
use crate::error::Error;
use crate::finding::ThermalKind;
use crate::numbers::{Size, real, scatter_of_steps};
use crate::report::curve::{Judging, channel_of, column};
use crate::report::{Curve, Rest, is_worse, or_dash, short};
use crate::runs::Run;
use crate::runs::table::Table;

/// Axes: gyros, then accelerometers.
const AXES: usize = 6;
/// What is compared, in the order of the columns; a document of each but of the mean, which needs none.
const HEAD: [&str; DOCUMENTS + 1] = ["raw", "mean", "cubic", "cubic + Ṫ", "this document", "the one before"];
const DOCUMENTS: usize = 5;

/// Heading of the table that states each axis' accuracy.
pub(super) const HEADING: &str = "Accuracy: rms of windows on the judging runs; noise of a window, and of single ticks from the thermometer";

/// What a sensor's terms are compared with: the mean, nothing where the level is not known; a cubic; a cubic and Ṫ.
pub(super) type Rivals = [Vec<(Term, f64, f64)>; 3];

/// A run, and how it is judged.
type Stage<'a> = (&'a Run, Judging);

/// What is left on the judging runs, window by window, by axis and in the order of [`HEAD`]; and the levels that the document and none
/// had where it was fitted.
#[derive(Debug, Clone, Default)]
pub(super) struct Compared {
    left: [[Vec<f64>; HEAD.len()]; AXES],
    levels: [[f64; 2]; AXES],
}

impl Compared {
    /// Of documents without terms, with cubics, with Ṫ beside them, the new one, and the one before it.
    fn of(
        documents: [&Document; DOCUMENTS],
        fitted: &[Stage<'_>],
        judging: &[Stage<'_>],
    ) -> Result<Self, Error> {
        let loaded: Vec<Loaded> =
            documents.iter().copied().map(Written::compiled).collect::<Result<_, _>>()?;
        let mut levels = [[(0.0, 0.0); DOCUMENTS]; AXES];
        for (run, (rest, rows, counts)) in fitted {
            let tables = Table::together(run, &loaded, *rows)?;
            for (axis, levels) in levels.iter_mut().enumerate().filter(|(axis, _)| takes_part(counts, *axis))
            {
                let truth = rest.truth(axis).unwrap_or(0.0);
                for ((sum, count), table) in levels.iter_mut().zip(&tables) {
                    let good = column(table, axis).iter().filter(|value| value.is_finite());
                    good.for_each(|value| (*sum, *count) = (*sum + value - truth, *count + 1.0));
                }
            }
        }
        let levels =
            levels.map(|axis| axis.map(|(sum, count)| if count > 0.0 { sum / count } else { f64::NAN }));
        let mut left: [[Vec<f64>; HEAD.len()]; AXES] = Default::default();
        for (run, (rest, rows, counts)) in judging {
            let tables = Table::together(run, &loaded, *rows)?;
            let shared = fitted.iter().any(|(other, _)| run.shares_log(other));
            let judges = |axis: &usize| takes_part(counts, *axis) && moves(&tables, documents[0], *axis);
            for axis in (0..AXES).filter(judges) {
                add(&mut left[axis], &tables, (axis, rest.truth(axis)), levels[axis], shared);
            }
        }
        Ok(Self { left, levels: levels.map(|axis| [axis[0], axis[3]]) })
    }

    /// Rms of what is left of an axis; `None` where nothing judges it.
    fn rms(&self, axis: usize) -> Option<[f64; HEAD.len()]> {
        let left = self.left.get(axis).filter(|left| !left[0].is_empty())?;
        let square = |left: &Vec<f64>| left.iter().map(|left| left.powi(2)).sum::<f64>() / real(left.len());
        Some(left.each_ref().map(|left| square(left).sqrt()))
    }

    /// Levels before and after, for a run that is another part of a log of the fit.
    pub(super) fn levels(&self) -> [[f64; 2]; AXES] {
        self.levels
    }

    /// Which of the rivals leaves less of an axis than the document does, and in words: a mean or a cubic.
    fn prefers(&self, axis: usize) -> Option<(usize, &'static str)> {
        let [_, mean, cubic, _, document, _] = self.rms(axis)?;
        if mean.min(cubic) >= document {
            None
        } else if mean < cubic {
            Some((0, "constant"))
        } else {
            Some((1, "cubic by plain least squares"))
        }
    }

    /// That the document before leaves less of an axis than the new one, by more than noise.
    pub(super) fn before_is_better(&self, axis: usize) -> Option<ThermalKind> {
        let [.., new, before] = self.left.get(axis)?;
        is_worse(before, new).then(|| ThermalKind::BeforeIsBetter {
            left: [before, new].map(|left| Size::of(left).rms),
            measure: if axis < 3 { "°/h" } else { "m/s²" },
        })
    }

    /// By axis what is left in the end, beside the noise that nothing takes away and that of the thermometers.
    pub(super) fn table(&self, outcome: &Outcome, curves: &[Curve]) -> Rows {
        let judged = curves.iter().any(|curve| curve.sample == Sample::Out);
        let mut rows = Vec::new();
        for axis in 0..AXES {
            let (of, rms) = (output_name(axis < 3, axis % 3), self.rms(axis));
            let deciding = |curve: &&Curve| curve.of == of && (curve.sample == Sample::Out) == judged;
            let mine: Vec<&Curve> = curves.iter().filter(deciding).collect();
            let Some(first) = mine.first() else { continue };
            let white = mine.iter().map(|curve| scatter_of_steps(&curve.after)).fold(f64::INFINITY, f64::min);
            let mut row = vec![format!("{of}, {}", first.measure), short(white)];
            row.push(or_dash(outcome.passed_on(axis).map(short)));
            row.extend((0..HEAD.len()).map(|line| or_dash(rms.map(|rms| short(rms[line])))));
            rows.push(row);
        }
        let head = ["", "white noise", "from the thermometer"].into_iter().chain(HEAD);
        Rows::of(head, rows)
    }
}

impl Outcome {
    /// The documents beside each other, where there are runs to judge them.
    pub(super) fn compared(
        &self,
        document: &Document,
        (runs, judges): (&[Run], &[Run]),
        rest: &impl Fn(&Run, &Stand) -> Result<Rest, Error>,
    ) -> Result<Compared, Error> {
        if judges.is_empty() {
            return Ok(Compared::default());
        }
        let all = runs.iter().chain(judges).enumerate();
        let stages: Vec<Stage<'_>> =
            all.map(|of| Ok((of.1, self.judging(of, rest)?))).collect::<Result<_, Error>>()?;
        let (fitted, judging) = stages.split_at(runs.len());
        let [cubic, with_rate] = [1, 2].map(|rival: usize| {
            self.document(|found| found.rivals.as_ref().map_or(&found.terms, |rivals| &rivals[rival]))
        });
        Compared::of([&self.plain(), &cubic, &with_rate, document, &self.base], fitted, judging)
    }

    /// Takes a mean or a cubic where a judging run leaves less with it; whether there was one.
    pub(super) fn take_simpler(&mut self, compared: &Compared) -> bool {
        let sensors = [accelerometers(&self.base).len(), self.base.gyro.sensor.len()];
        let (mut changed, stepwise) = (false, self.settings.method.is_stepwise());
        for (sensor, _, found) in &mut self.found {
            // Of more than three sensors none stands for an axis.
            let axis = axis_of(sensor).filter(|_| sensors[usize::from(sensor.gyro)] == 3);
            let Some((rival, words)) = axis.and_then(|axis| compared.prefers(axis)) else { continue };
            let Some(rivals) = found.rivals.as_ref().filter(|_| found.choice.is_some() && !stepwise) else {
                continue;
            };
            let simpler = &rivals[rival];
            if found.refused.is_none() && found.terms != *simpler && !simpler.is_empty() {
                found.terms.clone_from(simpler);
                found.words = format!("{words}: the judging run leaves more with {}", found.words);
                found.passed_on = None;
                changed = true;
            }
        }
        changed
    }

    /// Root mean square of the thermometer's noise that the terms of an axis' sensor pass on.
    pub(super) fn passed_on(&self, axis: usize) -> Option<f64> {
        let mine = self.found.iter().find(|(sensor, ..)| axis_of(sensor) == Some(axis));
        mine.and_then(|(.., found)| found.passed_on.filter(|_| found.refused.is_none()))
    }
}

/// Whether an axis is among those that count in a run: all, or the gyros.
fn takes_part(counts: &str, axis: usize) -> bool {
    counts.is_empty() || axis < 3
}

/// Adds what is left of an axis in windows that all have.
fn add(
    left: &mut [Vec<f64>; HEAD.len()],
    tables: &[Table],
    (axis, truth): (usize, Option<f64>),
    levels: [f64; DOCUMENTS],
    shared: bool,
) {
    let columns: Vec<&[f64]> = tables.iter().map(|table| column(table, axis)).collect();
    let count = columns.iter().map(|column| column.len()).min().unwrap_or(0);
    let good: Vec<usize> =
        (0..count).filter(|&row| columns.iter().all(|column| column[row].is_finite())).collect();
    let own = |column: &[f64]| good.iter().map(|&row| column[row]).sum::<f64>() / real(good.len());
    let off = |document: usize| match truth {
        Some(truth) => truth,
        None if shared => levels[document],
        None => own(columns[document]),
    };
    // The mean of the fitted runs is what it takes, where the level counts.
    let mean = off(0) + if truth.is_some() { levels[0] } else { 0.0 };
    let lines = [(0, off(0)), (0, mean), (1, off(1)), (2, off(2)), (3, off(3)), (4, off(4))];
    for (left, (document, off)) in left.iter_mut().zip(lines) {
        left.extend(good.iter().map(|&row| columns[document][row] - off));
    }
}

/// Whether the temperature that an axis follows moves enough for a judgement.
fn moves(tables: &[Table], document: &Document, axis: usize) -> bool {
    let channel = channel_of(document, axis < 3, axis % 3);
    let column = channel.and_then(|channel| tables.first()?.temperature_deg_c.get(&channel));
    column.is_some_and(|deg_c| moves_enough(deg_c))
}
