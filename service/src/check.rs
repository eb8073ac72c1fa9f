//! The `check` command: calibration documents, service configurations and Zenoh configurations.

mod kinds;
mod rivals;

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use isotherm_protocol::document::Problem;
use serde::Serialize;

use crate::exit::Exit;
use crate::words::{print, say};

/// Arguments of `check`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  isotherm check config/service.toml config/zenoh/*.json5
  isotherm check config/calibration/*.toml
  isotherm check --json --kind calibration new.toml

Every problem goes to stderr as file:line:column: key: message, one line per good file to stdout.
Exit codes: 0 all good, 78 a file is bad, 1 a file cannot be read (and none is bad).")]
pub struct CheckArgs {
    /// Files to validate
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// What the files are; without it told by extension and content
    #[arg(long, value_enum)]
    pub kind: Option<FileKind>,
    /// Print one JSON object on stdout instead
    #[arg(long)]
    pub json: bool,
}

/// What a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum FileKind {
    /// Calibration document of a unit (TOML).
    Calibration,
    /// Service configuration (TOML).
    Service,
    /// Zenoh configuration (JSON5).
    Zenoh,
}

/// What was found in one file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// The file.
    pub file: String,
    /// What it was taken for; `None` where it cannot be read.
    pub kind: Option<FileKind>,
    /// Whether it may be used.
    pub good: bool,
    /// Why it cannot be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unreadable: Option<String>,
    /// Everything that is wrong.
    pub problems: Vec<Problem>,
    /// What is doubtful, though valid.
    pub warnings: Vec<Problem>,
    /// What it holds, where it is good.
    #[serde(flatten)]
    pub summary: Option<Summary>,
}

/// What a good file holds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Summary {
    /// In words.
    pub summary: String,
    /// Serial of the unit, for a calibration document.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// SHA-256 of a calibration document, in hexadecimal digits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
}

/// Validates the files and says what was found.
pub(crate) fn run(args: &CheckArgs) -> Exit {
    let mut findings: Vec<_> = args.files.iter().map(|file| kinds::check_file(file, args.kind)).collect();
    rivals::refuse(&mut findings);
    let text = if args.json {
        let good = findings.iter().all(|finding| finding.good);
        serde_json::to_string_pretty(&serde_json::json!({ "good": good, "files": findings }))
            .unwrap_or_default()
            + "\n"
    } else {
        findings.iter().map(in_words).collect()
    };
    print(&text, verdict(&findings))
}

/// Problems to stderr; the line for stdout, where the file is good.
fn in_words(finding: &Finding) -> String {
    if let Some(reason) = &finding.unreadable {
        say(format_args!("{}: cannot be read: {reason}", finding.file));
    }
    for problem in &finding.problems {
        say(problem);
    }
    for warning in &finding.warnings {
        say(format_args!("{warning} (warning)"));
    }
    let summary = finding.summary.as_ref();
    summary.map_or_else(String::new, |summary| format!("{}: {}\n", finding.file, summary.summary))
}

fn verdict(findings: &[Finding]) -> Exit {
    if findings.iter().any(|finding| !finding.problems.is_empty()) {
        Exit::BadConfiguration
    } else if findings.iter().any(|finding| finding.unreadable.is_some()) {
        Exit::Failed
    } else {
        Exit::Ok
    }
}
