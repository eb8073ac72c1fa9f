//! Changes in words, tables and charts.

use std::collections::BTreeSet;

use isotherm_pages::{Axis, Chart, Ink, Panel, Series, Table};
use serde_json::json;

use super::{AxisChange, BEYOND, Changes, ValueChange};
use crate::document::show::charts::HEIGHT;
use crate::report::{Report, counted, fixed, or_dash, short};

/// Sections that axes, biases and scale factors are made of.
const SHOWN: [&str; 13] = [
    "accel.orientation.rows",
    "accel.orientation.thermal",
    "bias",
    "board_ratio_error",
    "gyro.orientation.rows",
    "gyro.orientation.thermal",
    "increment_weight_arcsec_per_count",
    "increment_weight_error",
    "increment_weight_rad_per_rad",
    "magnetic_bias",
    "scale_factor",
    "slow_meander",
    "static_bias",
];
/// Entries of an origin that are shown one by one.
const MOST_ABOUT: usize = 12;

impl Changes {
    /// Whether an axis has turned beyond what the two calibrations can tell.
    pub fn turned(&self) -> Vec<&AxisChange> {
        let beyond = |axis: &&AxisChange| axis.significance.is_some_and(|sigmas| sigmas > BEYOND);
        self.axes.iter().filter(beyond).collect()
    }

    /// A report with the first line.
    pub(super) fn saying(&self, title: String) -> Report {
        let [before, after] = &self.names;
        Report::saying(title, format!("{before} → {after}"), self.words())
    }

    fn words(&self) -> String {
        if self.entries.is_empty() {
            return "they are the same".to_owned();
        }
        let largest = self.axes.iter().max_by(|a, b| a.turned_arcsec.total_cmp(&b.turned_arcsec));
        let axes = match largest {
            Some(axis) if axis.turned_arcsec > 0.0 => {
                let beyond = self.turned();
                let names: Vec<&str> = beyond.iter().map(|axis| axis.of.as_str()).collect();
                let judged = if self.axes.iter().all(|axis| axis.significance.is_none()) {
                    "not both documents state their uncertainty".to_owned()
                } else if names.is_empty() {
                    format!("no axis beyond {BEYOND} σ")
                } else {
                    format!("beyond {BEYOND} σ: {}", names.join(", "))
                };
                format!(
                    "axes turn by up to {} ″ ({}); {judged}",
                    plus_minus(axis.turned_arcsec, axis.turned_sigma_arcsec, tenths),
                    axis.of
                )
            }
            _ => "no axis turns".to_owned(),
        };
        let mut parts = vec![axes];
        for (kind, what) in [("°/h", "gyro bias"), ("mg", "accelerometer bias"), ("ppm", "scale")] {
            let of = |value: &&ValueChange| value.unit == kind;
            let most = self.values.iter().filter(of).map(|value| (largest_of(value), &value.of));
            if let Some((most, of)) = most.max_by(|a, b| a.0.total_cmp(&b.0)) {
                parts.push(format!("{what} changes by up to {} {kind} ({of})", short(most)));
            }
        }
        let others: BTreeSet<&str> =
            self.sections.values().flatten().map(String::as_str).filter(|key| !SHOWN.contains(key)).collect();
        if !others.is_empty() {
            parts.push(format!("also different: {}", others.into_iter().collect::<Vec<_>>().join(", ")));
        }
        parts.join("; ")
    }

    /// Everything.
    pub fn sheet(&self) -> Report {
        let [before, after] = &self.names;
        let mut sheet = self.saying(format!("{before} → {after}"));
        let [old, new] = &self.units;
        if old != new {
            sheet.warnings.push(format!("{before} is for unit {old}, {after} for unit {new}"));
        }
        let range = self.temperature_deg_c.first().zip(self.temperature_deg_c.last());
        if let Some((low, high)) = range {
            sheet.notes.push(format!(
                "Changes are {after} less {before}, at {} °C and over {}…{} °C, all channels at one temperature, {}.",
                short(self.reference_deg_c),
                short(*low),
                short(*high),
                self.settled
            ));
        }
        if self.axes.iter().any(|axis| axis.significance.is_none() && axis.turned_arcsec > 0.0) {
            sheet.notes.push(
                "If a document does not state standard errors of its axes ([origin.details.sigma]), give that of \
                 your stand with --axis-sigma."
                    .to_owned(),
            );
        }
        self.axes_table(&mut sheet);
        self.values_table(&mut sheet);
        self.entries_table(&mut sheet);
        self.charts(&mut sheet);
        sheet.figures = json!(self);
        sheet
    }

    /// The largest changes of each sensor, and how many entries there are beside.
    pub fn in_brief(&self) -> String {
        let row = |axis: &AxisChange| {
            let largest = |is_scale: bool| {
                let own = |value: &&ValueChange| value.of.starts_with(&format!("{} ", axis.of));
                let mut own = self.values.iter().filter(own);
                let value = own.find(|value| (value.unit == "ppm") == is_scale)?;
                Some(format!("{} {}", short(largest_of(value)), value.unit))
            };
            let turned = plus_minus(axis.turned_arcsec, axis.turned_sigma_arcsec, tenths);
            let different = or_dash(self.sections.get(&axis.of).map(|sections| sections.join(", ")));
            vec![axis.of.clone(), turned + " ″", or_dash(largest(false)), or_dash(largest(true)), different]
        };
        let head = ["", "axis turned", "bias by up to", "scale by up to", "different"];
        let summary = Table::of(head, self.axes.iter().map(row));
        let sheet = Report { summary: Some(summary), ..self.sheet() };
        let entries = counted(self.entries.len(), "entry differs", "entries differ");
        format!(
            "{}{entries}: --all lists them, --html draws the changes over temperature\n",
            sheet.summary_text()
        )
    }

    fn axes_table(&self, sheet: &mut Report) {
        let row = |axis: &AxisChange| {
            let cosine = |(change, sigma): (f64, f64)| {
                if sigma > 0.0 { format!("{change:+.1} ± {sigma:.1}") } else { format!("{change:+.1}") }
            };
            let mut cells = vec![axis.of.clone()];
            cells.extend(axis.change_arcsec.into_iter().zip(axis.sigma_arcsec).map(cosine));
            cells.push(plus_minus(axis.turned_arcsec, axis.turned_sigma_arcsec, tenths));
            cells.push(or_dash(axis.significance.map(tenths)));
            cells.push(tenths(axis.largest_arcsec));
            cells.push(
                match axis.significance {
                    _ if axis.turned_arcsec <= 0.0 => "as it was",
                    None => "not known",
                    Some(sigmas) if sigmas > BEYOND => "turned",
                    Some(_) => "within the uncertainty",
                }
                .to_owned(),
            );
            cells
        };
        let head =
            ["input axis, ″", "towards x", "towards y", "towards z", "turned", "in σ", "largest over T", ""];
        sheet.table("Input axes", head, self.axes.iter().map(row));
    }

    fn values_table(&self, sheet: &mut Report) {
        let count = self.temperature_deg_c.len();
        let at: Vec<usize> = (0..5).map(|k| k * count.saturating_sub(1) / 4).collect();
        let mut head = vec![String::new()];
        let shown = at.iter().filter_map(|index| self.temperature_deg_c.get(*index));
        head.extend(shown.map(|x| format!("{} °C", short(*x))));
        head.push(format!("at {} °C", short(self.reference_deg_c)));
        let row = |value: &ValueChange| {
            let mut cells = vec![format!("{}, {}", value.of, value.unit)];
            cells.extend(at.iter().filter_map(|index| value.change.get(*index)).map(|change| short(*change)));
            cells.push(plus_minus(value.at_reference, value.sigma, short));
            cells
        };
        sheet.table("Changes of biases and scale factors", head, self.values.iter().map(row));
    }

    fn entries_table(&self, sheet: &mut Report) {
        let about = |key: &str| ["origin", "note", "created"].iter().any(|about| key.starts_with(about));
        let row = |entry: &isotherm_protocol::control::DocumentChange| {
            vec![entry.key.clone(), or_dash(entry.before.clone()), or_dash(entry.after.clone())]
        };
        let matter = self.entries.iter().filter(|entry| !about(&entry.key)).map(row);
        sheet.table("Entries that differ", ["key", "before", "after"], matter);
        let rest: Vec<_> = self.entries.iter().filter(|entry| about(&entry.key)).collect();
        sheet.table(
            "Origins",
            ["key", "before", "after"],
            rest.iter().take(MOST_ABOUT).map(|entry| row(entry)),
        );
        if rest.len() > MOST_ABOUT {
            sheet.notes.push(format!(
                "Of {} entries about origins, {MOST_ABOUT} are shown; --json has all.",
                rest.len()
            ));
        }
    }

    fn charts(&self, sheet: &mut Report) {
        let panels = self.values.iter().filter(|value| value.change.iter().any(|change| *change != 0.0));
        let panels = panels.map(|value| {
            let points = self.temperature_deg_c.iter().copied().zip(value.change.iter().copied());
            Panel::of(&value.of, value.unit, HEIGHT, vec![Series::line("change", Ink::First, points)])
        });
        let (caption, x) = ("Change of each bias and scale factor.", Axis::of("temperature", "°C"));
        sheet.chart("Over temperature", Chart::of(caption, x, panels.collect()));
    }
}

/// A number with its standard error, where it has one.
pub(super) fn plus_minus(value: f64, sigma: Option<f64>, digits: fn(f64) -> String) -> String {
    let sigma = sigma.map_or_else(String::new, |sigma| format!(" ± {}", digits(sigma)));
    digits(value) + &sigma
}

pub(super) fn tenths(value: f64) -> String {
    fixed(value, 1)
}

fn largest_of(value: &ValueChange) -> f64 {
    value.change.iter().map(|change| change.abs()).fold(value.at_reference.abs(), f64::max)
}
