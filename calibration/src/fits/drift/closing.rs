//! The report's part in the table that closes several units.

use serde_json::{Value, json};

use super::columns::stated_in;
use super::document::{Trend, trend};
use super::fit::Analysis;
use super::page::page;
use super::report::Report;
use crate::fits::drift::allan::{Coefficient, Term};
use crate::report::{BatchRow, UnitReport, short};

impl UnitReport for Report {
    const COLUMNS: &'static [&'static str] =
        &["of", "N", "σ", "correlation time, h", "trend, per h", "measure"];
    const DONE: &'static str = "analysed";

    fn to_text(&self) -> String {
        Self::to_text(self)
    }

    fn to_json(&self) -> Value {
        Self::to_json(self)
    }

    fn to_html(&self) -> String {
        page(self)
    }

    fn refusals(&self) -> Vec<String> {
        self.refused.clone()
    }

    fn rows(&self) -> Vec<BatchRow> {
        let refused = |words: &String| BatchRow {
            cells: vec!["–".to_owned(); Self::COLUMNS.len()],
            accepted: false,
            state: format!("refused: {words}"),
            json: json!({ "refused": words }),
        };
        self.sensors.iter().map(|sensor| self.row(sensor)).chain(self.refused.iter().map(refused)).collect()
    }
}

impl Report {
    /// What was found of a sensor, in one row.
    fn row(&self, sensor: &Analysis) -> BatchRow {
        let (factor, unit) = stated_in(Term::AngleRandomWalk, self.kind);
        let walk = match sensor.stated_noise().map(|noise| noise.of_term(Term::AngleRandomWalk)) {
            Some(Coefficient::Observed { value, .. }) => format!("{} {unit}", short(value * factor)),
            Some(Coefficient::NotObservable { below }) => format!("< {} {unit}", short(below * factor)),
            None => "–".to_owned(),
        };
        // A correlation time beyond the log's length is not in it.
        let part = sensor.slow_drift().filter(|(_, time)| time.value <= self.length_h);
        let slope = match trend(sensor) {
            Trend::Seen { slope, .. } => Some(slope),
            Trend::NotSeen { .. } => None,
        };
        let or_none = |value: Option<f64>| value.map_or_else(|| "none seen".to_owned(), short);
        let of = format!("{} {}", self.kind.sensor(), sensor.name);
        let json = json!({
            "of": of,
            "angle_random_walk": walk,
            "markov_sigma": part.map(|(sigma, _)| sigma.value),
            "markov_correlation_time_h": part.map(|(_, time)| time.value),
            "trend_per_h": slope,
        });
        BatchRow {
            cells: vec![
                of,
                walk,
                or_none(part.map(|(sigma, _)| sigma.value)),
                part.map_or_else(|| "–".to_owned(), |(_, time)| short(time.value)),
                or_none(slope),
                self.kind.measure().to_owned(),
            ],
            accepted: true,
            state: "analysed".to_owned(),
            json,
        }
    }
}
