//! What is said of a drift's impact.

use isotherm_correction::drift::DriftParts;
use isotherm_pages::{Axis, Chart, Ink, Panel, Series, Table};

use serde_json::{Value, json};

use super::ins::Errors;
use super::models::{Choice, table_3, table_3_gains, table_3_json};
use super::monte_carlo::Spread;
use super::scenario::{CARES, Care, Course, Drift, Figures, Voyage};
use crate::axes::AXES;
use crate::error::Error;
use crate::fits::drift::DEG_PER_H_IN_RAD_PER_S;
use crate::report::{Report, Verdict, short};

/// Height of a panel (CSS pixels).
const HEIGHT: u32 = 220;
/// Share of the estimator's error below which a drift that is known exactly is another matter than one that is estimated.
const EXACT: f64 = 0.5;

/// One row.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Which drift.
    pub case: String,
    /// How it went, or how it went with the first seed.
    pub course: Course,
    /// Over many seeds; `None` for one drift.
    pub spread: Option<Spread>,
}

/// What was sailed.
#[derive(Debug, Clone, PartialEq)]
pub struct Sailed {
    /// Where and how long.
    pub voyage: Voyage,
    /// Which drift, in words.
    pub source: String,
    /// Number of seeds; 0 for one drift.
    pub seeds: usize,
    /// Rows: for each case one per care.
    pub rows: Vec<Row>,
    /// What is to be said.
    pub notes: Vec<String>,
    /// Which model of the drift the log's calibration bears out, by gyro; empty without a log.
    pub choices: Vec<Choice>,
}

impl Row {
    /// One drift under each care.
    ///
    /// # Errors
    /// As [`Voyage::sail`].
    pub fn of_cares(
        case: &str,
        voyage: &Voyage,
        drift: &Drift,
        parts: &[DriftParts; 3],
    ) -> Result<Vec<Self>, Error> {
        let row =
            |care| Ok(Self { case: case.to_owned(), course: voyage.sail(care, drift, parts)?, spread: None });
        CARES.into_iter().map(row).collect()
    }

    /// The figure that the row is judged by.
    fn judged(&self) -> Figures {
        self.spread.as_ref().map_or_else(|| self.course.figures(), |spread| spread.median)
    }

    fn to_json(&self) -> Value {
        let points = self.course.points.iter().map(|(hours, errors)| {
            let [north, east] = errors.position_m;
            [*hours, errors.heading_arcmin(), north, east, errors.radial_m()]
        });
        let mut value = json!({ "case": self.case, "care": self.course.care.words(), "points": points.collect::<Vec<_>>() });
        match &self.spread {
            None => value["figures"] = json!(self.course.figures()),
            Some(spread) => {
                value["median"] = json!(spread.median);
                value["within_95_percent"] = json!(spread.within_95_percent);
            }
        }
        value
    }
}

impl Sailed {
    /// All that is said of it.
    pub fn report(&self) -> Report {
        let mut report = Report::new("What a drift means for navigation", "");
        report.verdicts.push(self.verdict());
        report.notes.push(self.circumstances());
        report.tell(self.notes.iter().cloned());
        report.notes.extend(self.said_of_models());
        if self.seeds > 0 {
            report.notes.push("The curves are those of the first seed.".to_owned());
        }
        report.summary = Some(self.rows());
        let mut cases: Vec<&str> = self.rows.iter().map(|row| row.case.as_str()).collect();
        cases.dedup();
        report.charts = cases.into_iter().map(|case| (case.to_owned(), self.chart(case))).collect();
        report.tables.push(("Position errors of real gyros in 002, table 3".to_owned(), table_3()));
        report.figures = json!({
            "source": self.source,
            "voyage": self.voyage,
            "seeds": self.seeds,
            "columns_of_points": ["hours", "heading_arcmin", "north_m", "east_m", "radial_m"],
            "rows": self.rows.iter().map(Row::to_json).collect::<Vec<_>>(),
            "models": self.choices,
            "table_3": table_3_json(),
        });
        report
    }

    /// The first line, in words: the case that carries the position farthest.
    fn verdict(&self) -> Verdict {
        let radial = |row: &&Row| row.judged().radial_largest_m;
        let Some(worst) = self.rows.iter().max_by(|a, b| radial(a).total_cmp(&radial(b))) else {
            return Verdict::said("no drift", "nothing to show");
        };
        let of = |care: Care| {
            let row = self.rows.iter().find(|row| row.case == worst.case && row.course.care == care);
            row.map(Row::judged).unwrap_or_default()
        };
        let [held, without, with, alone] = CARES.map(of);
        let middle = if self.seeds > 0 { "in the middle of all seeds " } else { "" };
        let gain = without.radial_largest_m / with.radial_largest_m.max(f64::MIN_POSITIVE);
        let judgement = if gain >= 1.05 {
            format!("the trend state cuts the error {gain:.1}×")
        } else if gain > 1.0 / 1.05 || without.radial_largest_m <= 0.0 && with.radial_largest_m <= 0.0 {
            "the trend state makes no difference".to_owned()
        } else {
            let more = 1.0 / gain;
            format!(
                "the trend state increases the error {more:.1}×: its trend_sigma is too large for this gyro"
            )
        };
        let judgement = format!("{judgement}; {} with the trend alone", distance(alone.radial_largest_m));
        let hours = short(self.voyage.hours);
        let [position, of_without, of_with] = [held, without, with].map(|of| distance(of.radial_largest_m));
        let heading = short(held.heading_largest_arcmin);
        // Seeded drifts are held at what they are, without noise: no procedure comes that far.
        let is_bound = self.seeds > 0
            && held.radial_largest_m < EXACT * without.radial_largest_m.min(with.radial_largest_m);
        let words = if is_bound {
            format!(
                "over {hours} h {middle}{of_without} of position with the estimator without trend state, {of_with} with \
                 it: {judgement}. A drift known exactly at departure and held would leave {position} of position and \
                 {heading}′ of heading; the rest is what noise hides from the estimator."
            )
        } else {
            format!(
                "over {hours} h {middle}{position} of position and {heading}′ of heading if the drift is held at its \
                 last value; {of_without} with the estimator without trend state, {of_with} with it: {judgement}."
            )
        };
        Verdict::said(&worst.case, words)
    }

    /// Head and rows of the table.
    fn rows(&self) -> Table {
        let mut head =
            vec!["drift", "care", "position at end, m", "largest, m", "heading at end, ′", "largest, ′"];
        if self.seeds > 0 {
            head.extend(["95 %: position largest, m", "heading largest, ′"]);
        }
        let rows = self.rows.iter().map(|row| {
            let Figures { radial_at_end_m, radial_largest_m, heading_at_end_arcmin, heading_largest_arcmin } =
                row.judged();
            let mut cells = vec![row.case.clone(), row.course.care.words().to_owned()];
            cells.extend(
                [radial_at_end_m, radial_largest_m, heading_at_end_arcmin, heading_largest_arcmin].map(short),
            );
            if let Some(spread) = &row.spread {
                let far = spread.within_95_percent;
                cells.extend([far.radial_largest_m, far.heading_largest_arcmin].map(short));
            }
            cells
        });
        Table::of(head, rows)
    }

    /// Which model the log bears out, and what 002 has of the two.
    fn said_of_models(&self) -> Vec<String> {
        let [least, median, most] = table_3_gains();
        let paper = format!(
            "002's table 3, 18 starts of six gyros: its model with trend, which has no Markov part, cuts the position \
             error {least:.0}…{most:.0}×, {median:.1}× in the middle. It is worse if the drift has one: let the \
             likelihood of a log choose."
        );
        let chosen = self.choices.iter().map(Choice::words);
        chosen.chain([paper]).collect()
    }

    fn chart(&self, case: &str) -> Chart {
        let rows = || self.rows.iter().filter(|row| row.case == case);
        let panel = |title: &str, measure: &str, of: &dyn Fn(&Errors, [f64; 3]) -> f64| {
            let curve = |(row, ink): (&Row, Ink)| {
                let points = row.course.points.iter().zip(&row.course.left);
                let points = points.map(|((hours, errors), left)| (*hours, of(errors, *left)));
                Series::line(row.course.care.words(), ink, points)
            };
            let inks = [Ink::Third, Ink::Second, Ink::First, Ink::Fourth];
            Panel::of(title, measure, HEIGHT, rows().zip(inks).map(curve).collect())
        };
        // The gyro of which most is left.
        let most = |axis: usize| {
            let left = rows().flat_map(|row| row.course.left.iter());
            left.map(|left| left[axis].abs()).fold(0.0, f64::max)
        };
        let axis = [2, 0, 1].into_iter().max_by(|a, b| most(*a).total_cmp(&most(*b))).unwrap_or(2);
        let title = format!("remaining drift of gyro {}", AXES[axis]);
        let panels = vec![
            panel("radial position error", "m", &|errors, _| errors.radial_m()),
            panel("heading error", "′", &|errors, _| errors.heading_arcmin()),
            panel(&title, "°/h", &|_, left| left[axis] * DEG_PER_H_IN_RAD_PER_S),
        ];
        let x = Axis::of("time since departure", "h");
        Chart::of(format!("{case}: errors since departure."), x, panels)
    }

    fn circumstances(&self) -> String {
        let v = &self.voyage;
        format!(
            "{}. Latitude {}°, platform turning at {} Earth rates, {} h of calibration, then {} h without position; level gyros {}.",
            self.source,
            short(v.latitude_deg),
            short(v.turn_ratio),
            short(v.calibration_h),
            short(v.hours),
            if v.log_aids_level {
                "observed through the velocity log all the time"
            } else {
                "not observed either"
            }
        )
    }
}

/// Metres, or kilometres where they are many.
fn distance(metres: f64) -> String {
    if metres >= 1000.0 { format!("{} km", short(metres / 1000.0)) } else { format!("{} m", short(metres)) }
}
