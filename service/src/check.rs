//! The `check` command: calibration documents, overlays, service configurations and Zenoh configurations.

mod kinds;
mod rivals;
mod signer;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use isotherm_cli::{Exit, failed, print, say, say_warning};
use isotherm_document::file::read_bounded;
use isotherm_document::unplaced;
use isotherm_protocol::document::Problem;
use isotherm_protocol::escape::escaped;
use serde::Serialize;

pub use signer::Signer;

use crate::ServiceError;
use crate::control::NO_OVERLAYS;
use crate::control::watch::{files_in, read_document};
use crate::signing::read_trusted_keys;

/// Arguments of `check`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  isotherm check config/service.toml config/zenoh/*.json5
  isotherm check config/calibration
  isotherm check --json --kind calibration new.toml
  isotherm check --trusted-keys keys units/*.toml
  isotherm check state/overlays/*.toml

Every problem goes to stderr as file:line:column: key: message, one line per good file to stdout.
A calibration document need not be signed, but a wrong signature makes it bad.
An overlay is checked by itself; a swap checks whether it fits its document.
Exit codes: 0 all good, 78 a file is bad, 1 a file cannot be read (and none is bad).")]
pub struct CheckArgs {
    /// Files to validate, or folders: every *.toml in them, as a service takes it
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Kind of the files (default: by extension and content)
    #[arg(long, value_enum)]
    pub kind: Option<FileKind>,
    /// Folder of public keys (*.pub) that signatures are verified with
    #[arg(long, value_name = "FOLDER")]
    pub trusted_keys: Option<PathBuf>,
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
    /// Changes of the bias constants of a calibration document (TOML), such as the result of a pre-launch calibration.
    Overlay,
    /// Service configuration (TOML).
    Service,
    /// Zenoh configuration (JSON5).
    Zenoh,
}

/// What was found in one file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
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

impl Finding {
    fn unreadable(path: &Path, words: String) -> Self {
        Self { file: path.display().to_string(), unreadable: Some(words), ..Self::default() }
    }

    /// The file may not be used, though it holds by itself.
    fn refuse(&mut self, problem: Problem) {
        self.problems.push(problem);
        (self.good, self.summary) = (false, None);
    }
}

/// What a good file holds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Summary {
    /// In words.
    pub summary: String,
    /// Serial of the unit, for a calibration document or overlay.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// SHA-256 of a calibration document or overlay, in hexadecimal digits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
    /// Who signed it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub signature: Option<Signer>,
}

/// Validates the files and says what was found.
#[must_use]
pub fn run(args: &CheckArgs) -> Exit {
    // A folder that cannot be read is no bad key.
    if let Some(path) = &args.trusted_keys
        && let Err(source) = std::fs::read_dir(path)
    {
        return failed(ServiceError::Read { path: path.clone(), source }, Exit::Failed);
    }
    let trusted = match args.trusted_keys.as_deref().map(read_trusted_keys).transpose() {
        Ok(trusted) => trusted,
        Err(problems) => {
            say_problems(&problems, &[]);
            return Exit::BadConfiguration;
        }
    };
    say_problems(&[], trusted.as_ref().map_or(&[][..], |(_, warnings)| warnings));
    let trusted = trusted.as_ref().map(|(trusted, _)| trusted);
    let check = |file: &PathBuf, read| kinds::check_file(file, read, args.kind, trusted);
    let check_all = |path: &PathBuf| match files_of(path) {
        // As a service reads them: a pipe there is none of its documents.
        Ok(files) if path.is_dir() => {
            files.iter().map(|file| in_folder(check(file, read_document(file)))).collect()
        }
        Ok(files) => files.iter().map(|file| check(file, read_bounded(file))).collect(),
        Err(words) => vec![Finding::unreadable(path, words)],
    };
    let mut findings: Vec<_> = args.files.iter().flat_map(check_all).collect();
    rivals::refuse(&mut findings);
    let good = findings.iter().all(|finding| finding.good);
    let text = if args.json {
        isotherm_cli::json(&serde_json::json!({ "good": good, "files": findings }))
    } else {
        findings.iter().map(in_words).collect()
    };
    let is_bad = findings.iter().any(|finding| !finding.problems.is_empty());
    print(&text, if good { Exit::Ok } else { Exit::blaming(false, is_bad) })
}

/// The documents of a folder; a file by itself.
fn files_of(path: &Path) -> Result<Vec<PathBuf>, String> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let files = files_in(path, "toml").map_err(|error| error.to_string())?;
    if files.is_empty() { Err("the folder has no documents (*.toml)".to_owned()) } else { Ok(files) }
}

/// What is found in a file of a folder, as a service takes it.
fn in_folder(mut finding: Finding) -> Finding {
    if finding.kind == Some(FileKind::Overlay) {
        finding.refuse(unplaced(Some(&finding.file), NO_OVERLAYS.to_owned()));
    }
    finding
}

/// Problems to stderr; the line for stdout, where the file is good.
fn in_words(finding: &Finding) -> String {
    if let Some(reason) = &finding.unreadable {
        say(format_args!("{}: cannot be read: {reason}", escaped(&finding.file)));
    }
    say_problems(&finding.problems, &finding.warnings);
    let summary = finding.summary.as_ref();
    summary.map_or_else(String::new, |summary| {
        format!("{}: {}\n", escaped(&finding.file), escaped(&summary.summary))
    })
}

/// What is wrong and what is doubtful, on stderr.
pub(crate) fn say_problems(problems: &[Problem], warnings: &[Problem]) {
    problems.iter().for_each(say);
    warnings.iter().for_each(say_warning);
}
