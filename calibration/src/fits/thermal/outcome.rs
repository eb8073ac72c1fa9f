//! What a thermal fit came to: the document, its verdicts, its report.

use isotherm_protocol::document::{Document, Filter, Sample};

use super::bare::DYNAMIC;
use super::branches::{History, Plateau, Ramp};
use super::checks::{SMALLEST_RANGE_DEG_C, moves_enough};
use super::columns::{Basis, Term};
use super::compare::{self, Compared};
use super::fit::Sensor;
use super::joint::Found;
use super::model::{put_accel, put_gyro};
use super::settings::Settings;
use super::stand::Stand;
use super::told::{stepping, wider};
use crate::axes::output_name;
use crate::document::{Fitted, Written, accelerometers};
use crate::error::Error;
use crate::finding::ThermalKind;
use crate::numbers::{Size, hull, once_each};
use crate::report::curve::Judging;
use crate::report::{Curve, FLAT, Judged, Rest, Verdict, judge};
use crate::runs::Run;
use crate::runs::table::Rows;

/// Why a sensor is refused that nothing can judge.
const NO_WINDOW: &str = "none of its windows is complete: look for gaps and flags with isotherm-replay correct, and choose a shorter --window";

/// Everything that gathers on the way.
#[derive(Debug)]
pub(super) struct Outcome {
    pub(super) bare: Document,
    pub(super) warnings: Vec<String>,
    pub(super) base: Document,
    pub(super) filter: Filter,
    pub(super) settings: Settings,
    pub(super) found: Vec<(Sensor, Basis, Found)>,
    pub(super) notes: Vec<String>,
    pub(super) range_deg_c: [f64; 2],
    pub(super) rate_range_deg_c_per_s: [f64; 2],
}

/// Puts what was found into a sensor that has none of it; a refused one becomes what it was before.
fn put<T: Clone>(
    sensor: Option<&mut T>,
    old: Option<&T>,
    (basis, found): (&Basis, &Found),
    terms: &[(Term, f64, f64)],
    of_kind: impl FnOnce(&mut T, &Basis, &[(Term, f64)], Option<&T>),
) {
    let Some(sensor) = sensor else { return };
    if let Some(old) = old.filter(|_| found.refused.is_some()) {
        sensor.clone_from(old);
        return;
    }
    let terms: Vec<(Term, f64)> = terms.iter().map(|(term, value, _)| (*term, *value)).collect();
    of_kind(sensor, basis, &terms, old);
}

impl Outcome {
    pub(super) fn new(base: &Document, without: Document, filter: Filter, settings: &Settings) -> Self {
        Self {
            bare: without,
            warnings: Vec::new(),
            base: base.clone(),
            filter,
            settings: settings.clone(),
            found: Vec::new(),
            notes: Vec::new(),
            range_deg_c: [f64::INFINITY, f64::NEG_INFINITY],
            rate_range_deg_c_per_s: [0.0, 0.0],
        }
    }

    pub(super) fn add(&mut self, sensor: &Sensor, basis: &Basis, found: Found) {
        self.found.push((sensor.clone(), basis.clone(), found));
    }

    pub(super) fn history(&mut self, name: &str, history: &History) {
        let [low, high] = history.range_deg_c;
        self.range_deg_c = hull([self.range_deg_c, history.range_deg_c]).unwrap_or_default();
        let rates = [self.rate_range_deg_c_per_s, history.rate_range_deg_c_per_s];
        self.rate_range_deg_c_per_s = hull(rates).unwrap_or_default();
        let ramp = |ramp: &Ramp| {
            let [from, to] = ramp.from_to_deg_c;
            format!("{from:.0} to {to:.0} °C at up to {:.1} °C/min", ramp.deg_c_per_min.abs())
        };
        let ramps: Vec<String> = history.ramps.iter().map(ramp).collect();
        let plateau =
            |plateau: &Plateau| format!("{:.1} °C for {:.0} min", plateau.deg_c, plateau.length_s / 60.0);
        let plateaus: Vec<String> = history.plateaus.iter().map(plateau).collect();
        let plateaus = if plateaus.is_empty() { "none".to_owned() } else { plateaus.join(", ") };
        self.notes.push(format!(
            "Channel {name}: {low:.1} to {high:.1} °C; ramps {}; plateaus {plateaus}.",
            ramps.join(", ")
        ));
    }

    /// Writes the document, judges it, and takes out what made an axis worse.
    pub(super) fn finish(
        mut self,
        (runs, judges): (&[Run], &[Run]),
        rest: impl Fn(&Run, &Stand) -> Result<Rest, Error>,
    ) -> Result<Fitted, Error> {
        self.found.sort_by_key(|(sensor, ..)| (!sensor.gyro, sensor.index));
        let before = Written::of(&self.plain())?;
        let (document, curves, mut verdicts, troubles, compared) = loop {
            let document = self.document(|found| &found.terms);
            let compared = self.compared(&document, (runs, judges), &rest)?;
            if self.take_simpler(&compared) {
                continue;
            }
            let written = Written::of(&document)?;
            let of_run = |index: usize, run: &Run| {
                let (rest, rows, counts) = self.judging((index, run), &rest)?;
                let shares = index >= runs.len() && runs.iter().any(|other| run.shares_log(other));
                Ok((Rest { levels: shares.then(|| compared.levels()), ..rest }, rows, counts))
            };
            let Judged { mut curves, mut troubles } = judge((runs, judges), [&before, &written], of_run)?;
            troubles.extend(unjudged(&mut curves));
            let verdicts = Curve::verdicts(&curves);
            if verdicts.is_empty() {
                let nothing = "no window of any axis is complete: the log has gaps, or all its ticks are flagged; \
                               check with isotherm-replay correct";
                return Err(Error::Refused([vec![nothing.to_owned()], troubles].concat()));
            }
            // Every time round there is a sensor less.
            if !self.take_out(&verdicts, &compared) {
                break (document, curves, verdicts, troubles, compared);
            }
        };
        let table = compared.table(&self, &curves);
        self.say(&mut verdicts);
        for (sensor, _, found) in self.found.iter().filter(|(_, _, found)| found.refused.is_none()) {
            self.warnings.extend(found.remarks.iter().map(|words| format!("{}: {words}", sensor.name)));
        }
        let written = Written::of(&document)?;
        for words in troubles {
            if !self.warnings.contains(&words) {
                self.warnings.push(words);
            }
        }
        self.warnings.extend(judges.is_empty().then(|| self.not_judged()).flatten());
        self.warnings.extend(wider(&curves, &verdicts));
        self.warnings.extend(stepping(&curves, &verdicts));
        let any_accepted = self.found.iter().any(|(.., found)| found.refused.is_none());
        self.warnings.extend(any_accepted.then(|| self.kept_terms()).flatten());
        let about = self.about();
        let mut report = self.report(verdicts, curves);
        report.tables.push((compare::HEADING.to_owned(), table));
        Ok(Fitted { written, report, about })
    }

    /// How a run is judged, by its number among all.
    pub(super) fn judging(
        &self,
        (index, run): (usize, &Run),
        rest: &impl Fn(&Run, &Stand) -> Result<Rest, Error>,
    ) -> Result<Judging, Error> {
        let stand = self.settings.stand(index);
        let window_s = self.settings.window_s.unwrap_or(self.settings.fit_window_s);
        // On a table the accelerometers feel its turning, too.
        let counts = if stand.turning.is_none() { "" } else { "gyro" };
        Ok((rest(run, &stand)?, Rows::mostly_valid(stand.window_s(window_s)), counts))
    }

    /// The document without the fitted terms, with the filter of the fit.
    pub(super) fn plain(&self) -> Document {
        let mut document = self.bare.clone();
        document.temperature.filter = Some(self.filter.clone());
        document
    }

    /// The document with what was found, or something else for it; a refused sensor keeps what it had.
    pub(super) fn document(&self, of: impl for<'a> Fn(&'a Found) -> &'a Vec<(Term, f64, f64)>) -> Document {
        let mut document = self.plain();
        for (sensor, basis, found) in &self.found {
            let (index, own, terms) = (sensor.index, (basis, found), of(found));
            if sensor.gyro {
                let old = self.base.gyro.sensor.get(index);
                put(document.gyro.sensor.get_mut(index), old, own, terms, put_gyro);
            } else {
                let accel = document.accel.as_mut().and_then(|accel| accel.sensor.get_mut(index));
                put(accel, accelerometers(&self.base).get(index), own, terms, put_accel);
            }
        }
        if self.settings.removes_mean() {
            let level = "The attitude of the unit was not stated: in the middle of its range every fitted bias is what it \
                         was before, and the level of each output does not change.";
            document.note = Some(match &self.base.note {
                Some(note) if note.contains(level) => note.clone(),
                Some(note) => format!("{note}\n{level}"),
                None => level.to_owned(),
            });
        }
        document
    }

    /// Takes the terms of sensors out whose axis became worse, by the verdicts or than it is with the document before; whether there was
    /// one.
    fn take_out(&mut self, verdicts: &[Verdict], compared: &Compared) -> bool {
        let why = |(sensor, _, found): &(Sensor, Basis, Found)| {
            let axis = axis_name(sensor)?;
            let Some(verdict) = verdicts.iter().find(|verdict| verdict.of == axis) else {
                return (!found.terms.is_empty()).then(|| NO_WINDOW.to_owned());
            };
            let sample = if verdict.out_of_sample.is_some() { "on the judging run" } else { "in sample" };
            let worse = (!verdict.accepted).then(|| format!("{sample}: {}", verdict.reason));
            let than_before = || compared.before_is_better(axis_of(sensor)?).map(|kind| kind.to_string());
            worse.or_else(|| than_before().filter(|_| self.had_terms(sensor)))
        };
        let reason = |of: &(Sensor, Basis, Found)| if of.2.refused.is_none() { why(of) } else { None };
        let reasons: Vec<Option<String>> = self.found.iter().map(reason).collect();
        for ((.., found), why) in self.found.iter_mut().zip(&reasons).filter(|(_, why)| why.is_some()) {
            found.refused.clone_from(why);
            found.terms.clear();
        }
        reasons.iter().any(Option::is_some)
    }

    /// That a refused sensor keeps terms which were made with another filter: a document has one for all its sensors.
    fn kept_terms(&self) -> Option<String> {
        let old = self.base.temperature.filter.as_ref()?;
        let lengths = |filter: &Filter| [filter.smoothing_s, filter.derivative_step_s];
        if lengths(old).iter().zip(lengths(&self.filter)).all(|(a, b)| (a - b).abs() <= 1e-9 * b) {
            return None;
        }
        let (gyros, accels) = (&self.base.gyro.sensor, accelerometers(&self.base));
        let follows = |sensor: &Sensor| {
            DYNAMIC.into_iter().any(|feature| {
                if sensor.gyro {
                    gyros.get(sensor.index).is_some_and(|gyro| gyro.terms.has(feature))
                } else {
                    accels.get(sensor.index).is_some_and(|accel| accel.terms.has(feature))
                }
            })
        };
        let refused = self.found.iter().filter(|(.., found)| found.refused.is_some());
        let names: Vec<&str> =
            refused.filter(|(sensor, ..)| follows(sensor)).map(|(sensor, ..)| sensor.name.as_str()).collect();
        (!names.is_empty()).then(|| {
            format!(
                "{}: refused, and keeps rate terms made with a smoothing of {} s and a derivative step of {} s, but \
                 the document now has {} s and {} s for all sensors: they are wrong with these. Keep the old filter \
                 with --smoothing {}",
                names.join(", "),
                old.smoothing_s,
                old.derivative_step_s,
                self.filter.smoothing_s,
                self.filter.derivative_step_s,
                old.smoothing_s
            )
        })
    }

    /// Whether a sensor of the document at hand has terms of the kind that is fitted.
    fn had_terms(&self, sensor: &Sensor) -> bool {
        let (document, without, index) = (&self.base, &self.bare, sensor.index);
        if sensor.gyro {
            document.gyro.sensor.get(index) != without.gyro.sensor.get(index)
        } else {
            accelerometers(document).get(index) != accelerometers(without).get(index)
        }
    }

    /// Gives the verdicts their reasons, and a refused sensor of which no window is complete a verdict of its own.
    fn say(&self, verdicts: &mut Vec<Verdict>) {
        let unseen = |(sensor, _, found): &&(Sensor, Basis, Found)| {
            sensor.dead.is_some() || found.refused.as_deref() == Some(NO_WINDOW)
        };
        for axis in self.found.iter().filter(unseen).filter_map(|(sensor, ..)| axis_name(sensor)) {
            if verdicts.iter().all(|verdict| verdict.of != axis) {
                verdicts.push(Verdict::said(axis, ""));
            }
        }
        let place = |of: &str| (0..6).position(|axis| output_name(axis < 3, axis % 3) == of);
        verdicts.sort_by_key(|verdict| place(&verdict.of).unwrap_or(usize::MAX));
        for verdict in verdicts {
            let mine = self.found.iter().find(|(sensor, ..)| axis_name(sensor).as_ref() == Some(&verdict.of));
            let Some((sensor, _, found)) = mine else {
                if verdict.accepted {
                    *verdict = verdict.clone().remark("it follows no temperature channel; left unchanged");
                }
                continue;
            };
            if let Some(why) = &found.refused {
                *verdict = verdict.clone().refused(why.clone());
                if sensor.dead.is_some() {
                    // What comes out along its axis is not its own.
                    (verdict.in_sample, verdict.out_of_sample) = ([Size::default(); 2], None);
                }
            } else {
                verdict.accepted = true;
                let words = match (found.flat, found.terms.is_empty()) {
                    (true, true) if self.had_terms(sensor) => format!("{FLAT}; its terms are removed"),
                    (true, true) => format!("{FLAT}; left unchanged"),
                    (true, false) => format!("{FLAT}; constant bias"),
                    (false, _) => found.words.clone(),
                };
                let unjudged = !found.terms.is_empty() && verdict.out_of_sample.is_none();
                *verdict = verdict.clone().remark(words + if unjudged { "; not judged" } else { "" });
            }
        }
    }
}

/// Leaves out the curves of judging runs over which their temperature is not known or hardly moves; says so.
fn unjudged(curves: &mut Vec<Curve>) -> Vec<String> {
    let idle = |curve: &Curve| curve.sample == Sample::Out && !moves_enough(&curve.temperature_deg_c);
    let runs = once_each(curves.iter().filter(|curve| idle(curve)).map(|curve| curve.run.clone()));
    let words = |run: String| {
        let mine = || curves.iter().filter(|curve| idle(curve) && curve.run == run);
        let ranges = mine().map(|curve| Size::of(&curve.temperature_deg_c)).filter(|size| size.count > 0);
        let range_deg_c = ranges.map(|size| size.peak_to_peak).reduce(f64::max);
        let axes = mine().map(|curve| curve.of.clone()).collect();
        ThermalKind::NotJudged { run, axes, range_deg_c, needed: SMALLEST_RANGE_DEG_C }.to_string()
    };
    let told = runs.into_iter().map(words).collect();
    curves.retain(|curve| !idle(curve));
    told
}

/// The case axis that a sensor of a unit with three stands for, gyros first.
pub(super) fn axis_of(sensor: &Sensor) -> Option<usize> {
    (sensor.index < 3).then_some(sensor.index + if sensor.gyro { 0 } else { 3 })
}

/// The same, as the curves call it.
fn axis_name(sensor: &Sensor) -> Option<String> {
    (sensor.index < 3).then(|| output_name(sensor.gyro, sensor.index))
}
