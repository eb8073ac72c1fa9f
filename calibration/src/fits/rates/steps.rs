//! What the rate table was told to do: steps of constant rate about an axis of the case.

use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::csv;
use crate::error::Error;
use crate::numbers::direction;
use crate::report::counted;

/// Fastest table (°/s).
const FASTEST_DEG_PER_S: f64 = 20_000.0;
/// Most steps of a file.
const MOST: usize = 10_000;

/// One step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Number of the run, from 0.
    pub run: usize,
    /// Axis of the table in case axes, of length one.
    pub axis: [f64; 3],
    /// Rate about it, relative to the Earth (°/s).
    pub rate_deg_per_s: f64,
    /// When it is steady, since the beginning of the run (s); found in the log where it is not stated.
    pub window_s: Option<[f64; 2]>,
}

impl Step {
    /// Rate of the table along the case axes (°/h).
    pub fn rate_deg_per_h(&self) -> [f64; 3] {
        self.axis.map(|axis| axis * 3600.0 * self.rate_deg_per_s)
    }
}

/// A row of a file.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
struct Row {
    log: Option<usize>,
    axis: Axis,
    rate_deg_per_s: f64,
    begin_s: Option<f64>,
    end_s: Option<f64>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(extend("x-must-be" = "x, y, z, -x, -y, -z in quotes, or three numbers"))]
enum Axis {
    Name(String),
    Vector([f64; 3]),
}

#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
struct File {
    step: Vec<Row>,
}

/// An axis by its name (x, -y, …) or as three numbers with commas.
///
/// # Errors
/// What is wrong with it.
pub fn axis(text: &str) -> Result<[f64; 3], String> {
    let (sign, name) = match text.strip_prefix('-') {
        Some(name) if name.len() == 1 => (-1.0, name),
        _ => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    let named = match name {
        "x" => Some([sign, 0.0, 0.0]),
        "y" => Some([0.0, sign, 0.0]),
        "z" => Some([0.0, 0.0, sign]),
        _ => None,
    };
    if let Some(axis) = named {
        return Ok(axis);
    }
    let numbers: Vec<f64> =
        text.split(',').map(|part| part.trim().parse()).collect::<Result<_, _>>().unwrap_or_default();
    match numbers.as_slice() {
        [x, y, z] => direction([*x, *y, *z]).ok_or_else(|| format!("axis {text:?} has no length")),
        _ => Err(format!("axis {text:?} must be x, y, z, -x, -y, -z or three numbers such as 0,0.6,0.8")),
    }
}

/// Steps by lists of rates: run k turns about axis k. Both rates and runs are those of the fit, then those that it is judged on.
///
/// # Errors
/// [`Error::Usage`].
pub fn listed(
    names: &[String],
    [rates, judging]: [&[f64]; 2],
    [runs, judges]: [usize; 2],
) -> Result<Vec<Step>, Error> {
    if names.len() != runs + judges {
        let and = if judges > 0 { format!(", {judges} to judge on") } else { String::new() };
        return Err(Error::Usage(format!(
            "{}{and} and {} --axis: state the table's axis of each log, in their order",
            counted(runs, "log", "logs"),
            counted(names.len(), "time", "times")
        )));
    }
    let mut steps = Vec::new();
    for (run, name) in names.iter().enumerate() {
        let axis = axis(name).map_err(Error::Usage)?;
        for rate in if run < runs { rates } else { judging } {
            let step = Step { run, axis, rate_deg_per_s: *rate, window_s: None };
            steps.push(checked(step, runs + judges).map_err(Error::Usage)?);
        }
    }
    Ok(steps)
}

/// Steps of a file: TOML with a table `[[step]]` for each, or CSV with the same keys as its first line.
///
/// # Errors
/// [`Error::Usage`] with the line or the step that is wrong; [`Error::Log`] where it cannot be read.
pub fn read(path: &Path, runs: usize) -> Result<Vec<Step>, Error> {
    let wrong = |what: String| Error::Usage(format!("{}: {what}", path.display()));
    let File { step: rows } = csv::read(path, ("read the table of steps", ""), of_csv)?;
    if rows.is_empty() || rows.len() > MOST {
        return Err(wrong(format!("{}, must be 1 to {MOST}", counted(rows.len(), "step", "steps"))));
    }
    let step = |(index, row): (usize, Row)| {
        let axis = match &row.axis {
            Axis::Name(name) => axis(name).map_err(|what| format!("step {}: {what}", index + 1))?,
            Axis::Vector(vector) => {
                direction(*vector).ok_or_else(|| format!("step {}: axis has no length", index + 1))?
            }
        };
        let window_s = match (row.begin_s, row.end_s) {
            (Some(begin), Some(end)) => Some([begin, end]),
            (None, None) => None,
            _ => return Err(format!("step {}: begin_s and end_s go together", index + 1)),
        };
        let log = row.log.unwrap_or(1);
        let run =
            log.checked_sub(1).ok_or_else(|| format!("step {}: log is 0, the first log is 1", index + 1))?;
        let step = Step { run, axis, rate_deg_per_s: row.rate_deg_per_s, window_s };
        checked(step, runs).map_err(|what| format!("step {}: {what}", index + 1))
    };
    rows.into_iter().enumerate().map(step).collect::<Result<_, _>>().map_err(|what: String| wrong(what))
}

fn checked(step: Step, runs: usize) -> Result<Step, String> {
    if !(-FASTEST_DEG_PER_S..=FASTEST_DEG_PER_S).contains(&step.rate_deg_per_s) {
        return Err(format!(
            "rate is {} °/s, must be from −{FASTEST_DEG_PER_S} to {FASTEST_DEG_PER_S}",
            step.rate_deg_per_s
        ));
    }
    if step.run >= runs {
        return Err(format!("log {} is named, {} given", step.run + 1, counted(runs, "was", "were")));
    }
    match step.window_s {
        Some([begin, end]) if !(begin >= 0.0 && end > begin && end.is_finite()) => {
            Err(format!("begin_s is {begin}, end_s {end}: must be 0 ≤ begin < end"))
        }
        _ => Ok(step),
    }
}

fn of_csv(text: &str) -> Result<File, String> {
    let row = |row: csv::Row<'_>| {
        Ok(Row {
            log: row.get("log")?,
            axis: Axis::Name(row.need("axis")?),
            rate_deg_per_s: row.need("rate_deg_per_s")?,
            begin_s: row.get("begin_s")?,
            end_s: row.get("end_s")?,
        })
    };
    let step = csv::rows(text, &["log", "axis", "rate_deg_per_s", "begin_s", "end_s"], row)?;
    Ok(File { step })
}
