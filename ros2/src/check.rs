//! The `check` command.

use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::{Exit, json, print, say};
use isotherm_document::Problem;
use isotherm_document::escape::escaped;
use serde::Serialize;

use crate::{Error, Mapping};

/// Arguments of `check`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Example:
  isotherm-ros check config/ros2.toml

Every problem goes to stderr as file:line:column: key: message, one line per unit of a good file to stdout.
Exit codes: 0 all good, 78 a file is bad, 1 a file cannot be read (and none is bad).")]
pub struct CheckArgs {
    /// Files to validate
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Print one JSON object on stdout instead
    #[arg(long)]
    pub json: bool,
}

/// What was found in one file.
#[derive(Debug, Default, Serialize)]
struct Finding {
    file: String,
    good: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    unreadable: Option<String>,
    problems: Vec<Problem>,
    /// A line for each unit.
    units: Vec<String>,
}

/// Validates the files and says what was found.
#[must_use]
pub fn run(args: &CheckArgs) -> Exit {
    let findings: Vec<_> = args.files.iter().map(|path| check(path)).collect();
    let exit = if findings.iter().any(|finding| !finding.problems.is_empty()) {
        Exit::BadConfiguration
    } else if findings.iter().any(|finding| !finding.good) {
        Exit::Failed
    } else {
        Exit::Ok
    };
    if args.json {
        let all = serde_json::json!({ "good": exit == Exit::Ok, "files": findings });
        return print(&json(&all), exit);
    }
    let mut text = String::new();
    for Finding { file, unreadable, problems, units, .. } in &findings {
        problems.iter().for_each(say);
        if let Some(reason) = unreadable {
            say(reason);
        }
        text.extend(units.iter().map(|unit| format!("{}: {unit}\n", escaped(file))));
    }
    print(&text, exit)
}

fn check(path: &Path) -> Finding {
    let finding = Finding { file: path.display().to_string(), ..Finding::default() };
    match Mapping::load(path) {
        Ok(mapping) => {
            let units = mapping.units.iter();
            let units = units.map(|unit| format!("unit {}: {} -> {}", unit.unit, unit.raw, unit.corrected));
            Finding { good: true, units: units.collect(), ..finding }
        }
        Err(Error::Mapping(problems)) => Finding { problems, ..finding },
        Err(error) => Finding { unreadable: Some(error.to_string()), ..finding },
    }
}
