//! Plans as their files have them.

use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Attitude, Plan, Position, mounting};
use crate::csv;
use crate::error::Error;
use crate::numbers::direction;

/// What goes behind everything that is wrong with a plan.
const HINT: &str = "; a plan is \"twelve\", \"six\", or a file as docs/calibration/positions.md shows";

/// Reads a file with a plan: CSV or TOML.
///
/// # Errors
/// [`Error::Log`] where it cannot be read, [`Error::Usage`] with what is wrong in it.
pub(super) fn read(path: &Path) -> Result<Plan, Error> {
    let written: Written = csv::read(path, ("read the plan", HINT), of_csv)?;
    written.plan().map_err(|what| Error::Usage(format!("{}: {what}{HINT}", path.display())))
}

/// A plan as its file has it.
#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
struct Written {
    /// Case axis along the stand's axis 1 at zero angles.
    #[serde(default = "along_1")]
    #[schemars(regex(pattern = "^[xyz]$"), extend("x-must-be" = "x, y or z"))]
    axis_1: char,
    /// Case axis along its axis 2.
    #[serde(default = "along_2")]
    #[schemars(regex(pattern = "^[xyz]$"), extend("x-must-be" = "x, y or z"))]
    axis_2: char,
    position: Vec<WrittenPosition>,
}

fn along_1() -> char {
    'y'
}

fn along_2() -> char {
    'x'
}

#[derive(Debug, Deserialize, JsonSchema)]
#[schemars(deny_unknown_fields)]
struct WrittenPosition {
    name: String,
    axis_1_deg: Option<f64>,
    axis_2_deg: Option<f64>,
    up: Option<[f64; 3]>,
}

impl Written {
    fn plan(self) -> Result<Plan, String> {
        let mounting = mounting(self.axis_1, self.axis_2).ok_or_else(|| {
            format!("axis_1 is {:?} and axis_2 {:?}: they must be two of x, y, z", self.axis_1, self.axis_2)
        })?;
        if self.position.is_empty() {
            return Err("it has no position".into());
        }
        let mut positions: Vec<Position> = Vec::new();
        for position in self.position {
            if positions.iter().any(|other| other.name == position.name) {
                return Err(format!("position {:?} is given twice: names must differ", position.name));
            }
            let attitude =
                match (position.axis_1_deg, position.axis_2_deg, position.up) {
                    (Some(first), Some(second), None) if first.is_finite() && second.is_finite() => {
                        Attitude::Stand([first.to_radians(), second.to_radians()])
                    }
                    (None, None, Some(up)) => Attitude::Up(direction(up).ok_or_else(|| {
                        format!("position {:?}: up is {up:?}, not a direction", position.name)
                    })?),
                    _ => {
                        return Err(format!(
                            "position {:?} needs axis_1_deg and axis_2_deg, or up = [x, y, z]",
                            position.name
                        ));
                    }
                };
            positions.push(Position { name: position.name, attitude });
        }
        Ok(Plan { mounting, positions })
    }
}

/// Rows of `name`, `axis_1_deg` and `axis_2_deg`.
fn of_csv(text: &str) -> Result<Written, String> {
    let row = |row: csv::Row<'_>| {
        Ok(WrittenPosition {
            name: row.need("name")?,
            axis_1_deg: Some(row.need("axis_1_deg")?),
            axis_2_deg: Some(row.need("axis_2_deg")?),
            up: None,
        })
    };
    let position = csv::rows(text, &["name", "axis_1_deg", "axis_2_deg"], row)?;
    Ok(Written { axis_1: along_1(), axis_2: along_2(), position })
}
