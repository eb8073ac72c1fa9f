//! What is said of a thermal fit: the origin in the document, and the report.

use isotherm_pages::Table;
use isotherm_protocol::document::{Document, Sample};
use serde_json::json;

use super::columns::Basis;
use super::fit::Sensor;
use super::joint::Found;
use super::model::described;
use super::outcome::Outcome;
use super::scale::Kept;
use super::select::{Target, Tried};
use crate::document::{About, by_name};
use crate::fits::drift::pieces::steps;
use crate::numbers::{Size, about_mean};
use crate::report::{Curve, Report, Sigmas, Verdict, is_worse, output_unit, short};

/// What a fit may leave on parts that it did not see, as a share of what the mean leaves.
const MUCH: f64 = 0.5;

impl Outcome {
    /// Says which sensors keep their scale factors, and why.
    pub(super) fn scales(&mut self, sensors: &[Sensor], targets: &[Target]) {
        let mut without = Vec::new();
        for (sensor, target) in sensors.iter().zip(targets).filter(|(sensor, _)| sensor.dead.is_none()) {
            match &target.kept {
                Some(Kept::Short(why)) => {
                    self.warnings.push(format!("{}: it keeps its scale factor: {why}", sensor.name));
                }
                Some(Kept::NotMeant) => without.push(sensor.gyro),
                None => {}
            }
        }
        let kinds = [
            (true, "gyros on a rate table (--axis, --rate)"),
            (false, "accelerometers in several attitudes (--roll, --pitch)"),
        ];
        let kinds: Vec<&str> =
            kinds.into_iter().filter(|(gyro, _)| without.contains(gyro)).map(|(_, words)| words).collect();
        if !kinds.is_empty() {
            self.notes.push(format!(
                "Scale factors without runs are kept: of {}, each log with its own.",
                kinds.join(" and of ")
            ));
        }
    }

    /// That only the fitted runs have judged, and of which sensors parts of them that the fit did not see say little good.
    pub(super) fn not_judged(&self) -> Option<String> {
        let fitted =
            || self.found.iter().filter(|(.., found)| found.refused.is_none() && !found.terms.is_empty());
        fitted().next()?;
        let much = fitted().filter_map(|(sensor, _, found)| {
            let choice = found.choice.as_ref()?;
            let share = choice.best()?.score / choice.mean;
            (share > MUCH).then(|| format!("{} {:.0} %", sensor.name, 100.0 * share))
        });
        let much = much.collect::<Vec<_>>().join(", ");
        let doubt = if much.is_empty() {
            String::new()
        } else {
            format!(
                ". On parts of the log that it did not see the fit leaves much of what the mean leaves ({much}): do these \
                 sensors follow temperature?"
            )
        };
        Some(format!(
            "not judged on another run: give --judge LOG, or with --judge-start a part of this one that --duration leaves \
             out{doubt}"
        ))
    }

    /// What the document says of the fit beside its coefficients.
    pub(super) fn about(&self) -> About {
        let sensors = self.found.iter().map(|(sensor, _, found)| {
            let mut of = json!({ "model": found.words });
            if let Some(why) = &found.refused {
                of["refused"] = json!(why);
            }
            if let Some((choice, best)) =
                found.choice.as_ref().and_then(|choice| Some((choice, choice.best()?)))
            {
                of["cross_validation"] = json!({ "left_of_mean": choice.mean, "left": best.score });
            }
            (sensor.name.as_str(), of)
        });
        About {
            method: self.settings.method.name(),
            key: "thermal",
            details: json!({
                "sensors": by_name(sensors),
                "fit_window_s": self.settings.fit_window_s,
                "smoothing_s": self.filter.smoothing_s,
                "derivative_step_s": self.filter.derivative_step_s,
                "mean_removed": self.settings.removes_mean(),
            }),
            sigmas: Sigmas::default(),
            range_deg_c: Some(self.range_deg_c.map(|t| libm::round(10.0 * t) / 10.0)),
            rate_range_deg_c_per_s: Some(self.rate_range_deg_c_per_s.map(|r| libm::round(1e5 * r) / 1e5)),
        }
    }

    pub(super) fn report(self, verdicts: Vec<Verdict>, curves: Vec<Curve>) -> Report {
        let title = format!("Thermal calibration, method {}", self.settings.method.name());
        let mut report = Report::new(title, self.base.unit.clone());
        report.verdicts = verdicts;
        report.warnings = self.warnings;
        report.notes = self.notes;
        let window_s = self.settings.window_s.unwrap_or(self.settings.fit_window_s);
        report.notes.push(format!(
            "The fit is to means over {} s; before and after are means over {window_s} s.",
            self.settings.fit_window_s
        ));
        report.notes.push(format!(
            "Temperature is smoothed over {} s and differentiated over {} s on a grid of {} s: this filter belongs to the coefficients.",
            self.filter.smoothing_s, self.filter.derivative_step_s, self.filter.grid_step_s
        ));
        if !self.settings.method.is_stepwise() {
            report.notes.push(
                "Lags and smoothing explain all sensors of a channel best together, because heat reaches them the same \
                 way."
                    .into(),
            );
        }
        if self.settings.removes_mean() {
            report.notes.push(
                "The mean of each run is removed, of a judging part of a fitted log the mean of the fitted part: Earth's \
                 rate and gravity along the axes are unknown."
                    .into(),
            );
        }
        for (sensor, basis, found) in &self.found {
            for (term, value, sigma) in &found.terms {
                let (name, unit) = described(basis, *term, output(&self.base, sensor));
                let name = format!("{} {name}", sensor.name);
                report.coefficient(name, unit, *value, *sigma);
            }
        }
        report.validation = validation(&self.found);
        report.residuals = curves;
        report
    }
}

/// Axes of which the fit makes the level better and the spread about it worse, as `validate` finds without a place.
pub(super) fn wider(curves: &[Curve], verdicts: &[Verdict]) -> Vec<String> {
    let words = |verdict: &Verdict| {
        let mine = |curve: &&Curve| curve.of == verdict.of && curve.sample == Sample::Out;
        let spread_of = |values: fn(&Curve) -> &[f64]| -> Vec<f64> {
            curves.iter().filter(mine).map(values).flat_map(about_mean).collect()
        };
        let spread = [spread_of(|curve| &curve.before), spread_of(|curve| &curve.after)];
        let [before, after] = spread.each_ref().map(|values| short(Size::of(values).rms));
        is_worse(&spread[0], &spread[1]).then(|| {
            format!(
                "{}: on the judging run only its level gets better: about its mean it spreads by {after} {} rms, without the \
                 terms by {before}, which validate refuses where no place is stated; add a run to the fit",
                verdict.of, verdict.measure
            )
        })
    };
    verdicts.iter().filter(|verdict| verdict.accepted).filter_map(words).collect()
}

/// Share of a step that the terms must leave for it to be told: what heat makes they take.
const LEFT_OF_STEP: f64 = 0.25;

/// Runs of the fit in which an axis with terms steps from one level to another, whatever they do.
pub(super) fn stepping(curves: &[Curve], verdicts: &[Verdict]) -> Vec<String> {
    let stands = |of: &str| verdicts.iter().any(|verdict| verdict.of == of && verdict.accepted);
    let fitted = curves.iter().filter(|curve| curve.sample == Sample::In && stands(&curve.of));
    let words = |curve: &Curve| {
        let [(before, at), (after, _)] =
            [steps::step_in(&curve.before, 1)?, steps::step_in(&curve.after, 1)?];
        let [whole, left] = [before, after].map(|step| (step.behind - step.before).abs());
        let stays = before.part.abs_diff(after.part) <= 1 && left >= LEFT_OF_STEP * whole;
        let called = format!("{}: {}", curve.run, curve.of);
        stays.then(|| {
            steps::words((&called, &curve.measure), before, curve.time_s.get(at).copied().unwrap_or(0.0))
        })
    };
    fitted.filter_map(words).collect()
}

/// Unit of a sensor's bias.
fn output(document: &Document, sensor: &Sensor) -> &'static str {
    if sensor.gyro { "°/h" } else { output_unit(document) }
}

/// Models that the table of a sensor shows, beside the one without dynamics and the chosen one.
const SHOWN: usize = 8;

/// The best model of each kind of dynamics, by sensor: of many kinds the best ones.
fn validation(found: &[(Sensor, Basis, Found)]) -> Option<Table> {
    let head = ["sensor", "model", "coefficients", "remaining on unseen parts", "of the mean's", ""];
    let mut rows = Vec::new();
    for (sensor, _, found) in found {
        let Some(choice) = &found.choice else { continue };
        let kind_of = |tried: &'_ Tried| (tried.spec.dynamics.name.clone(), tried.spec.scale);
        let mut kinds: Vec<&Tried> = Vec::new();
        for tried in &choice.tried {
            match kinds.iter_mut().find(|kind| kind_of(kind) == kind_of(tried)) {
                Some(kind) if tried.score < kind.score => *kind = tried,
                Some(_) => {}
                None => kinds.push(tried),
            }
        }
        if let Some(best) = choice.best()
            && let Some(kind) = kinds.iter_mut().find(|kind| kind_of(kind) == kind_of(best))
        {
            *kind = best;
        }
        let mut scores: Vec<f64> = kinds.iter().map(|kind| kind.score).collect();
        scores.sort_unstable_by(f64::total_cmp);
        let last = scores.get(SHOWN - 1).copied().unwrap_or(f64::INFINITY);
        for kind in kinds {
            let chosen = choice.best() == Some(kind);
            if kind.score > last && !chosen && !kind.spec.dynamics.terms.is_empty() {
                continue;
            }
            rows.push(vec![
                sensor.name.clone(),
                kind.spec.words(),
                kind.count.to_string(),
                short(kind.score),
                format!("{:.1} %", 100.0 * kind.score / choice.mean),
                if chosen && found.refused.is_none() { "chosen".to_owned() } else { String::new() },
            ]);
        }
    }
    (!rows.is_empty()).then(|| Table::of(head, rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_that_grows_beside_a_level_that_falls_is_told() {
        let wave = |k: u32| libm::sin(f64::from(k) * 0.3);
        let curve = |spread: f64, level: f64| Curve {
            of: "gyro x".to_owned(),
            measure: "°/h".to_owned(),
            run: "judge.csv".to_owned(),
            sample: Sample::Out,
            window_s: 10.0,
            time_s: (0..100).map(f64::from).collect(),
            temperature_deg_c: Vec::new(),
            before: (0..100).map(|k| 38.0 + 5.0 * wave(k)).collect(),
            after: (0..100).map(|k| level + spread * wave(k)).collect(),
        };
        let told = |spread: f64| {
            let curves = [curve(spread, 10.0)];
            wider(&curves, &Curve::verdicts(&curves))
        };
        assert!(told(5.0).is_empty());
        insta::assert_snapshot!(told(12.0).join("\n"));
    }
}
