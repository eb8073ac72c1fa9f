//! What is said of a log's noise and drift.

use std::fmt::Write;

use isotherm_pages::Table;
use serde_json::{Map, Value, json};

use super::columns::{Kind, stated_in};
use super::document::{Parameters, Trend, trend};
use super::fit::{Analysis, Deviation, Deviations};
use super::markov::Estimate;
use super::page;
use super::pieces::Grid;
use crate::fits::drift::allan::{Coefficient, Term};
use crate::report::{Report, Verdict, or_dash, short, within};

/// What was found in a log.
#[derive(Debug, Clone)]
pub struct Found {
    /// What the readings measure.
    pub kind: Kind,
    /// Length (h).
    pub length_h: f64,
    /// The sensors.
    pub sensors: Vec<Analysis>,
    /// What the estimator is to expect, by sensor, or why a document cannot say it; empty for accelerometers.
    pub parameters: Vec<(String, Result<Parameters, String>)>,
}

impl Found {
    /// What the estimator is to expect, where a document can say it.
    pub fn stated(&self) -> impl Iterator<Item = (&String, &Parameters)> {
        self.parameters.iter().filter_map(|(name, found)| Some((name, found.as_ref().ok()?)))
    }

    /// All that is said of it.
    pub fn report(&self, unit: &str, corrected: bool, grid: Grid) -> Report {
        let mut report = Report::new("Noise and drift", unit);
        let called = |name: &str| format!("{} {name}", self.kind.sensor());
        report.verdicts = self.sensors.iter().map(|sensor| self.verdict(sensor)).collect();
        report
            .verdicts
            .extend(grid.refused.iter().map(|(name, why)| Verdict::said(called(name), "").refused(why)));
        report.figures = json!({
            "corrected": corrected,
            "tick_s": grid.tick_s,
            "ticks": grid.ticks,
            "length_h": self.length_h,
            "measure": if self.kind == Kind::Rate { "deg/h" } else { "m/s2" },
            "sensors": self.sensors.iter().map(|sensor| self.sensor_json(sensor)).collect::<Vec<_>>(),
        });
        report.tell(grid.notes);
        report.notes.push(format!(
            "{} ticks of {} s{}, {:.2} h{}.",
            grid.ticks,
            short(grid.tick_s),
            if grid.missing > 0 { format!(", {} of them missing", grid.missing) } else { String::new() },
            self.length_h,
            if corrected { ", corrected and along the case axes" } else { ", raw readings" }
        ));
        report.warnings.extend(self.noise_words());
        let notes = self
            .stated()
            .flat_map(|(name, found)| found.notes.iter().map(move |note| format!("gyro {name}: {note}.")));
        report.tell(notes.collect::<Vec<_>>());
        report.tell(self.line_words());
        report.summary = Some(self.summary());
        report.charts = page::charts(self);
        for (heading, rows) in [
            ("Noise coefficients, with intervals that hold 95 %", self.noise_rows()),
            ("Drift", self.drift_rows()),
            ("How far a trend can be trusted", self.extrapolation_rows()),
            ("Allan deviations", self.allan_rows()),
            ("Parameters of the estimator", self.parameter_rows()),
        ] {
            report.table(heading, rows.head, rows.rows);
        }
        report
    }

    /// What a sensor's fit says of a coefficient, and the unit that it is stated in.
    fn coefficient(&self, sensor: &Analysis, term: Term) -> (Option<Coefficient>, &'static str) {
        let (factor, unit) = stated_in(term, self.kind);
        (sensor.stated_noise().map(|noise| noise.of_term(term).times(factor)), unit)
    }

    /// What was found of a sensor, in one sentence.
    fn verdict(&self, sensor: &Analysis) -> Verdict {
        let (walk, unit) = self.coefficient(sensor, Term::AngleRandomWalk);
        let mut words = match walk {
            None if sensor.noise.is_some() => "more than the five noise terms".to_owned(),
            Some(Coefficient::Observed { value, .. }) => format!("N {} {unit}", short(value)),
            Some(Coefficient::NotObservable { below }) => format!("N below {} {unit}", short(below)),
            None => "too short for noise coefficients".to_owned(),
        };
        let _ = match sensor.slow_drift() {
            Some((_, time)) if time.value > self.length_h => {
                write!(words, ", a drift slower than this log of {} h can show", short(self.length_h))
            }
            Some((sigma, time)) => {
                let measure = self.kind.measure();
                write!(words, ", drift σ {} {measure} over {} h", short(sigma.value), short(time.value))
            }
            None => write!(words, ", no slow drift above the noise"),
        };
        let _ = match trend(sensor) {
            Trend::Seen { slope, .. } => {
                write!(words, ", trend {} {}", short(slope), self.kind.over_hours(1))
            }
            Trend::NotSeen { .. } => write!(words, ", no trend"),
        };
        let verdict = Verdict::said(format!("{} {}", self.kind.sensor(), sensor.name), words);
        match self.parameters.iter().find(|(name, _)| *name == sensor.name) {
            Some((_, Err(why))) => verdict.refused(why),
            _ => verdict,
        }
    }

    /// σ and correlation time (h) of the Markov part in words; of what is slower than the log, that it is.
    fn markov(&self, sensor: &Analysis, number: impl Fn(&Estimate) -> String) -> [String; 2] {
        match sensor.slow_drift() {
            Some((_, time)) if time.value > self.length_h => {
                ["slower than the log".to_owned(), format!("> {}", short(self.length_h))]
            }
            Some((sigma, time)) => [number(&sigma), number(&time)],
            None => ["none seen", "none seen"].map(str::to_owned),
        }
    }

    /// A row for each sensor.
    fn summary(&self) -> Table {
        let stated = Term::ALL.map(|term| format!("{}, {}", term.symbol(), stated_in(term, self.kind).1));
        let slow = [format!("σ, {}", self.kind.measure()), "correlation time, h".to_owned()];
        let trends = format!("trend, {}", self.kind.over_hours(1));
        let head = [String::new()].into_iter().chain(stated).chain(slow).chain([trends]);
        let row = |sensor: &Analysis| {
            let noise = Term::ALL.map(|term| match self.coefficient(sensor, term).0 {
                Some(Coefficient::Observed { value, .. }) => short(value),
                Some(Coefficient::NotObservable { below }) if below.is_finite() => {
                    format!("< {}", short(below))
                }
                _ => "–".to_owned(),
            });
            let slope = match trend(sensor) {
                Trend::Seen { slope, .. } => short(slope),
                Trend::NotSeen { .. } => "none seen".to_owned(),
            };
            let slow = self.markov(sensor, |estimate| short(estimate.value));
            let of = format!("{} {}", self.kind.sensor(), sensor.name);
            [of].into_iter().chain(noise).chain(slow).chain([slope]).collect()
        };
        Table::of(head, self.sensors.iter().map(row))
    }

    /// What a document is to state, as it states it.
    fn parameter_rows(&self) -> Table {
        let rows: Vec<(&String, Map<String, Value>)> = self
            .stated()
            .filter_map(|(name, found)| Some((name, json!(found.drift).as_object()?.clone())))
            .collect();
        let fields: Vec<String> =
            rows.first().map(|(_, fields)| fields.keys().cloned().collect()).unwrap_or_default();
        let row = |(name, fields): (&String, Map<String, Value>)| {
            [format!("gyro {name}")].into_iter().chain(fields.values().map(ToString::to_string)).collect()
        };
        Table::of([String::new()].into_iter().chain(fields), rows.into_iter().map(row))
    }

    /// Allan deviations, one row per averaging time.
    fn allan_rows(&self) -> Table {
        let mut head = vec!["τ, s".to_owned()];
        for sensor in &self.sensors {
            for estimator in ["plain", "overlapping", "modified"] {
                head.push(format!("{} {estimator}", sensor.name));
            }
        }
        let longest = self.sensors.iter().map(|sensor| sensor.allan.len()).max().unwrap_or(0);
        let cell = |deviation: Option<Deviation>| or_dash(deviation.map(|deviation| short(deviation.value)));
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

    fn sensor_heads(&self) -> impl Iterator<Item = &str> {
        std::iter::once("").chain(self.sensors.iter().map(|sensor| sensor.name.as_str()))
    }

    /// The noise coefficients, one row per coefficient.
    fn noise_rows(&self) -> Table {
        let row = |term: Term| {
            let (_, unit) = stated_in(term, self.kind);
            let cells = self.sensors.iter().map(|sensor| match self.coefficient(sensor, term).0 {
                None if sensor.noise.is_some() => "not stated".to_owned(),
                Some(Coefficient::Observed { value, interval }) => within(value, interval),
                Some(Coefficient::NotObservable { below }) if below.is_finite() => {
                    format!("not observable (< {})", short(below))
                }
                _ => "not observable".to_owned(),
            });
            std::iter::once(format!("{} {}, {unit}", term.symbol(), term.name())).chain(cells).collect()
        };
        Table::of(self.sensor_heads(), Term::ALL.map(row))
    }

    /// The slow part, one row per figure.
    fn drift_rows(&self) -> Table {
        let measure = self.kind.measure();

        let mut rows: Vec<Vec<String>> = Vec::new();
        let mut row = |name: String, of: &dyn Fn(&Analysis) -> String| {
            rows.push(std::iter::once(name).chain(self.sensors.iter().map(of)).collect());
        };
        let power =
            |value: Option<(f64, f64)>| or_dash(value.map(|(v, e)| format!("{} ± {}", short(v), short(e))));
        row(format!("mean, {measure}"), &|a| short(a.mean));
        row(format!("standard deviation, {measure}"), &|a| short(a.deviation));
        row(format!("of the slow part, {measure}"), &|a| short(a.slow_deviation));
        let [sigma, time] =
            [0, 1].map(|place| move |a: &Analysis| self.markov(a, Estimate::words)[place].clone());
        row(format!("σ of the Markov part, {measure}"), &sigma);
        row("its correlation time, h".to_owned(), &time);
        row("the autocorrelation falls to 1/e at, h".to_owned(), &|a| {
            or_dash(a.autocorrelation.as_ref().and_then(|auto| auto.correlation_time_h).map(short))
        });
        row(format!("trend, {}", self.kind.over_hours(1)), &|a| power(a.slope));
        row(format!("second order, {}", self.kind.over_hours(2)), &|a| {
            power(a.second_order.as_ref().and_then(|fit| fit.power(2)))
        });
        Table::of(self.sensor_heads(), rows)
    }

    /// "Fit 21 h, extrapolate the rest", one row per sensor.
    fn extrapolation_rows(&self) -> Table {
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
    fn noise_words(&self) -> Vec<String> {
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
    fn line_words(&self) -> Vec<String> {
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

    fn sensor_json(&self, sensor: &Analysis) -> Value {
        let deviations = |row: &Deviations| {
            let [plain, overlapping, modified] = row.of;
            json!({ "tau_s": row.tau_s, "plain": plain, "overlapping": overlapping, "modified": modified })
        };
        let allan: Vec<Value> = sensor.allan.iter().map(deviations).collect();
        let mut noise = Map::new();
        for term in Term::ALL {
            let (found, unit) = self.coefficient(sensor, term);
            let mut value = json!(found);
            if found.is_some() {
                value["unit"] = json!(unit);
            }
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
        let parameters = self.stated().find(|(name, _)| **name == sensor.name);
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
