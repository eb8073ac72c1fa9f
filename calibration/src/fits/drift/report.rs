//! What is said of a log's noise and drift: verdict, tables, JSON.

use std::fmt::Write;

use isotherm_pages::Table;
use serde::Serialize;
use serde_json::{Value, json};

use super::columns::Kind;
use super::columns::stated_in;
use super::document::{Parameters, Trend, trend};
use super::fit::{Analysis, Deviation, Deviations};
use crate::fits::drift::allan::{Coefficient, Term};
use crate::report::{dozen, short, table, within};

/// What is said of the log as a whole.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// Serial of the unit.
    pub unit: String,
    /// What the readings measure.
    #[serde(skip)]
    pub kind: Kind,
    /// Whether they are corrected, along the case axes.
    pub corrected: bool,
    /// Length of a tick (s).
    pub tick_s: f64,
    /// Ticks from beginning to end.
    pub ticks: usize,
    /// Length (h).
    pub length_h: f64,
    /// What is to be said.
    pub notes: Vec<String>,
    /// Sensors that were refused, and why.
    pub refused: Vec<String>,
    /// The sensors.
    #[serde(skip)]
    pub sensors: Vec<Analysis>,
    /// What the estimator is to expect, by sensor; empty for accelerometers.
    #[serde(skip)]
    pub parameters: Vec<(String, Parameters)>,
}

impl Report {
    /// All sentences in one line: what was found, in words.
    pub fn verdict(&self) -> String {
        format!("{}.", self.sentences().join("; "))
    }

    /// The first lines: what was found, one sentence for each sensor.
    pub fn sentences(&self) -> Vec<String> {
        let (measure, sensor) = (self.kind.measure(), self.kind.sensor());
        let of = |analysis: &Analysis| {
            let walk = analysis.stated_noise().map(|noise| noise.of_term(Term::AngleRandomWalk));
            let (factor, unit) = stated_in(Term::AngleRandomWalk, self.kind);
            let mut words = match walk {
                None if analysis.noise.is_some() => "more than the five noise terms".to_owned(),
                Some(Coefficient::Observed { value, .. }) => format!("N {} {unit}", short(value * factor)),
                Some(Coefficient::NotObservable { below }) => {
                    format!("N below {} {unit}", short(below * factor))
                }
                None => "too short for noise coefficients".to_owned(),
            };
            match analysis.slow_drift() {
                Some((_, time)) if time.value > self.length_h => {
                    let _ = write!(
                        words,
                        ", a drift slower than this log of {} h can show",
                        short(self.length_h)
                    );
                }
                Some((sigma, time)) => {
                    let _ = write!(
                        words,
                        ", drift σ {} {measure} over {} h",
                        short(sigma.value),
                        short(time.value)
                    );
                }
                None => words.push_str(", no slow drift above the noise"),
            }
            match trend(analysis) {
                Trend::Seen { slope, .. } => {
                    let _ = write!(words, ", trend {} {}", short(slope), self.kind.over_hours(1));
                }
                Trend::NotSeen { .. } => words.push_str(", no trend"),
            }
            format!("{sensor} {}: {words}", analysis.name)
        };
        let refused = (!self.refused.is_empty()).then(|| format!("{} refused", self.refused.len()));
        self.sensors.iter().map(of).chain(refused).collect()
    }

    /// Allan deviations, one row per averaging time.
    pub fn allan_rows(&self) -> Table {
        let mut head = vec!["τ, s".to_owned()];
        for sensor in &self.sensors {
            for estimator in ["plain", "overlapping", "modified"] {
                head.push(format!("{} {estimator}", sensor.name));
            }
        }
        let longest = self.sensors.iter().map(|sensor| sensor.allan.len()).max().unwrap_or(0);
        let cell =
            |deviation: Option<Deviation>| deviation.map_or_else(|| "–".to_owned(), |d| short(d.value));
        let row = |index: usize| {
            let tau = self.sensors.iter().find_map(|sensor| sensor.allan.get(index)).map_or(0.0, |d| d.tau_s);
            let cells = self.sensors.iter().flat_map(|sensor| {
                let of = sensor.allan.get(index).map_or([None; 3], |deviations| deviations.of);
                of.map(cell)
            });
            std::iter::once(short(tau)).chain(cells).collect()
        };
        Table::of(head, (0..longest).map(row))
    }

    /// Heads of a table with a column for each sensor; the first one names the rows.
    fn sensor_heads(&self) -> impl Iterator<Item = &str> {
        std::iter::once("").chain(self.sensors.iter().map(|sensor| sensor.name.as_str()))
    }

    /// The noise coefficients, one row per coefficient.
    pub fn noise_rows(&self) -> Table {
        let row = |term: Term| {
            let (factor, unit) = stated_in(term, self.kind);
            let cells = self.sensors.iter().map(|sensor| {
                match sensor.stated_noise().map(|noise| noise.of_term(term)) {
                    None if sensor.noise.is_some() => "not stated".to_owned(),
                    Some(Coefficient::Observed { value, interval }) => {
                        within(value * factor, interval.map(|end| end * factor))
                    }
                    Some(Coefficient::NotObservable { below }) if below.is_finite() => {
                        format!("not observable (< {})", short(below * factor))
                    }
                    _ => "not observable".to_owned(),
                }
            });
            std::iter::once(format!("{} {}, {unit}", term.symbol(), term.name())).chain(cells).collect()
        };
        Table::of(self.sensor_heads(), Term::ALL.map(row))
    }

    /// The slow part, one row per figure.
    pub fn drift_rows(&self) -> Table {
        let measure = self.kind.measure();

        let mut rows: Vec<Vec<String>> = Vec::new();
        let mut row = |name: String, of: &dyn Fn(&Analysis) -> String| {
            rows.push(std::iter::once(name).chain(self.sensors.iter().map(of)).collect());
        };
        let none = || "–".to_owned();
        let power = |value: Option<(f64, f64)>| {
            value.map_or_else(none, |(v, e)| format!("{} ± {}", short(v), short(e)))
        };
        row(format!("mean, {measure}"), &|a| short(a.mean));
        row(format!("standard deviation, {measure}"), &|a| short(a.deviation));
        row(format!("of the slow part, {measure}"), &|a| short(a.slow_deviation));
        row(format!("σ of the Markov part, {measure}"), &|a| {
            a.slow_drift().map_or_else(|| "none seen".to_owned(), |(s, _)| s.words())
        });
        row("its correlation time, h".to_owned(), &|a| a.slow_drift().map_or_else(none, |(_, t)| t.words()));
        row("the autocorrelation falls to 1/e at, h".to_owned(), &|a| {
            a.autocorrelation.as_ref().and_then(|auto| auto.correlation_time_h).map_or_else(none, short)
        });
        row(format!("trend, {}", self.kind.over_hours(1)), &|a| power(a.slope));
        row(format!("second order, {}", self.kind.over_hours(2)), &|a| {
            power(a.second_order.as_ref().and_then(|fit| fit.power(2)))
        });
        Table::of(self.sensor_heads(), rows)
    }

    /// "Fit 21 h, extrapolate the rest", one row per sensor.
    pub fn extrapolation_rows(&self) -> Table {
        let measure = self.kind.measure();
        let head = [
            "",
            "fitted, h",
            "extrapolated, h",
            "slope, per h",
            "error at end",
            "rms",
            "largest",
            "of the range",
            "without slope",
        ];

        let rows = self.sensors.iter().filter_map(|sensor| {
            let e = sensor.extrapolation.as_ref()?;
            Some(vec![
                format!("{}, {measure}", sensor.name),
                short(e.fit_h),
                short(e.extrapolated_h),
                short(e.slope_per_h),
                short(e.error_at_end),
                short(e.error_rms),
                short(e.error_largest),
                format!("{:.0} %", e.share_of_range * 100.0),
                short(e.error_at_end_without_trend),
            ])
        });
        Table::of(head, rows)
    }

    /// Sensors whose Allan deviation the five terms do not describe, or not within its statistics.
    pub fn noise_words(&self) -> Vec<String> {
        let badly = self.sensors.iter().filter_map(|sensor| {
            let noise = sensor.noise.as_ref().filter(|noise| noise.model_error > 0.0)?;
            let error = format!("{:.0} %", 100.0 * noise.model_error);
            let of = format!("{} {}", self.kind.sensor(), sensor.name);
            Some(if noise.describes() {
                format!(
                    "{of}: the five terms describe the Allan deviations to {error} each at best: this is the model \
                     error of the coefficients."
                )
            } else {
                format!(
                    "{of}: the five terms do not describe this log, not even with a model error of {error} (χ² per \
                     degree of freedom {}): it contains vibration, motion or a change of temperature. See the \
                     diagram; coefficients are not stated.",
                    short(noise.chi_square_per_degree)
                )
            })
        });
        badly.collect()
    }

    /// What is to be said of lines, by sensor.
    pub fn line_words(&self) -> Vec<String> {
        let (measure, kind) = (self.kind.measure(), self.kind.sensor());
        let mut words = Vec::new();
        for sensor in &self.sensors {
            let daily = sensor.markov.as_ref().map(|(_, lines)| lines.as_slice()).unwrap_or_default();
            for line in daily.iter().filter(|line| line.stands_out()) {
                words.push(format!(
                    "{kind} {}: a line at {} h of {} {measure}. Lines at 24 h and 8 h come from the test hall, not from the \
                     gyro: its temperature over the day, through the test equipment, and the mains voltage as machines are \
                     switched on and off [002]. It is left out of σ and correlation time.",
                    sensor.name,
                    line.period_h,
                    short(line.amplitude)
                ));
            }
            for line in &sensor.lines {
                words.push(format!(
                    "{kind} {}: a line at {} Hz ({} s) of {} {measure}, {} times its neighbourhood: find what turns \
                     or switches at that rate.",
                    sensor.name,
                    short(line.frequency_hz),
                    short(1.0 / line.frequency_hz),
                    short(line.amplitude),
                    short(line.ratio)
                ));
            }
        }
        if self.length_h < 48.0 {
            words.push(format!(
                "A line at 24 h needs two days, the log has {:.1} h{}.",
                self.length_h,
                if self.length_h < 16.0 { "; one at 8 h takes 16 h" } else { "" }
            ));
        }
        words
    }

    /// What a terminal shows: what was found, the noise coefficients, and what is to be looked at.
    pub fn to_text(&self) -> String {
        let mut found: Vec<String> =
            self.sentences().into_iter().map(|sentence| format!("{sentence}.")).collect();
        let Table { head, mut rows } = self.noise_rows();
        // What no sensor shows is on the page, with its limits.
        rows.retain(|row| row.iter().skip(1).any(|cell| !cell.starts_with("not ")));
        if !rows.is_empty() {
            found.extend(table(&head, &rows).lines().map(str::to_owned));
        }
        let parameters = self.parameters.iter();
        let notes = parameters
            .flat_map(|(name, found)| found.notes.iter().map(move |note| format!("gyro {name}: {note}.")));
        let all = self.notes.iter().cloned().chain(self.noise_words()).chain(notes).chain(self.line_words());
        let (mut told, others): (Vec<String>, Vec<String>) =
            all.partition(|words| words.starts_with("warning: "));
        told.extend(others);
        let rest = format!(
            "Unit {}, {:.2} h in ticks of {} s{}: deviations, drift, lines and what the estimator is to expect",
            self.unit,
            self.length_h,
            short(self.tick_s),
            if self.corrected { ", corrected, along the case axes" } else { "" }
        );
        dozen(&found, &told, &rest)
    }

    /// Everything as JSON.
    pub fn to_json(&self) -> Value {
        let mut value = json!(self);
        let sensors: Vec<Value> = self.sensors.iter().map(|sensor| self.sensor_json(sensor)).collect();
        if let Some(object) = value.as_object_mut() {
            object.insert("verdict".to_owned(), json!(self.verdict()));
            object
                .insert("measure".to_owned(), json!(if self.kind == Kind::Rate { "deg/h" } else { "m/s2" }));
            object.insert("sensors".to_owned(), json!(sensors));
        }
        value
    }

    fn sensor_json(&self, sensor: &Analysis) -> Value {
        let deviations = |row: &Deviations| {
            let [plain, overlapping, modified] = row.of;
            json!({ "tau_s": row.tau_s, "plain": plain, "overlapping": overlapping, "modified": modified })
        };
        let allan: Vec<Value> = sensor.allan.iter().map(deviations).collect();
        let mut noise = serde_json::Map::new();
        for term in Term::ALL {
            let (factor, unit) = stated_in(term, self.kind);
            let value = match sensor.stated_noise().map(|noise| noise.of_term(term)) {
                Some(Coefficient::Observed { value, interval }) => {
                    json!({ "value": value * factor, "interval": interval.map(|end| end * factor), "unit": unit })
                }
                Some(Coefficient::NotObservable { below }) => {
                    json!({ "below": below * factor, "unit": unit })
                }
                None => Value::Null,
            };
            noise.insert(term.symbol().to_owned(), value);
        }
        let fit = sensor.markov.as_ref().map(|(fit, _)| fit);
        let lines = sensor.markov.as_ref().map(|(_, lines)| lines.as_slice()).unwrap_or_default();
        let daily: Vec<Value> = lines
            .iter()
            .map(|line| json!({ "period_h": line.period_h, "amplitude": line.amplitude, "stands_out": line.stands_out() }))
            .collect();

        let power =
            |value: Option<(f64, f64)>| value.map(|(value, error)| json!({ "value": value, "sigma": error }));
        let parameters = self.parameters.iter().find(|(name, _)| *name == sensor.name);
        json!({
            "name": sensor.name,
            "mean": sensor.mean,
            "standard_deviation": sensor.deviation,
            "standard_deviation_slow": sensor.slow_deviation,
            "allan": allan,
            "noise": noise,
            "noise_chi_square_per_degree": sensor.noise.as_ref().map(|noise| noise.chi_square_per_degree),
            "noise_model_error": sensor.noise.as_ref().map(|noise| noise.model_error),
            "markov_sigma": fit.and_then(|fit| fit.sigma),
            "markov_correlation_time_h": fit.and_then(|fit| fit.correlation_time_h),
            "autocorrelation_time_h": sensor.autocorrelation.as_ref().and_then(|auto| auto.correlation_time_h),
            "trend_per_h": power(sensor.slope),
            "second_order_per_h2": power(sensor.second_order.as_ref().and_then(|fit| fit.power(2))),
            "daily_lines": daily,
            "lines": sensor.lines,
            "extrapolation": sensor.extrapolation,
            "drift": parameters.map(|(_, parameters)| &parameters.drift),
            "drift_notes": parameters.map(|(_, parameters)| &parameters.notes),
        })
    }
}
