//! The `sign` command.

use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::{Exit, print, say};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::{Document, Problem};
use isotherm_protocol::overlay::{Overlay, is_overlay};
use isotherm_protocol::signature::{self, Existing, KeyId, PrivateKey, Wrong};
use serde::Serialize;

use super::private_key;
use crate::check::say_problems;
use isotherm_document::file::{are_one, is_taken, read_bounded, replace, text};

/// Arguments of `sign`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  isotherm sign ZLG-0001.toml --key bench-2.key
  isotherm sign ZLG-0001.toml --key bench-2.key --out signed/ZLG-0001.toml
  isotherm sign --overwrite units/*.toml --key bench-2.key

Documents are validated first; if one is bad, none is signed. The signature is one more line of the file, so the
document's digest, which outputs name, changes.
Exit codes: 0 all signed, 78 a document or the key is bad, 1 a file is signed already, or cannot be read or written.")]
pub struct SignArgs {
    /// Calibration documents and overlays to sign
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Private key, of `isotherm keygen` or `openssl genpkey -algorithm ed25519`
    #[arg(long, value_name = "FILE")]
    pub key: PathBuf,
    /// Signed document to write, instead of changing the original; for a single document
    #[arg(long = "out", alias = "output", value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Replace an existing signature, valid or not, and the file of --out
    #[arg(long = "overwrite", alias = "replace")]
    pub replace: bool,
    /// Print one JSON object on stdout instead
    #[arg(long)]
    pub json: bool,
}

/// What became of one file.
#[derive(Debug, Default, Serialize)]
struct Outcome {
    /// The document.
    file: String,
    /// Where the signed one is, or was to be.
    output: String,
    signed: bool,
    /// The unit that it names, where it is good.
    unit: Option<String>,
    /// SHA-256 of the signed text, where the document is good.
    digest: Option<String>,
    /// What kept a good document from being signed.
    #[serde(skip_serializing_if = "Option::is_none")]
    failure: Option<String>,
    problems: Vec<Problem>,
    warnings: Vec<Problem>,
    /// The signed text, where the document is good.
    #[serde(skip)]
    text: Option<String>,
}

/// Signs the files and says what became of each.
#[must_use]
pub fn run(args: &SignArgs) -> Exit {
    if args.output.is_some() && args.files.len() > 1 {
        say("isotherm: --out names one file, so one document can be given with it");
        return Exit::Usage;
    }
    if let Some(words) = args.output.as_deref().and_then(|output| kept(args, output)) {
        say(words);
        return Exit::Usage;
    }
    let key = match private_key::read(&args.key) {
        Ok((key, warning)) => {
            say_problems(&[], warning.as_slice());
            key
        }
        Err((problem, exit)) => {
            say(problem);
            return exit;
        }
    };
    let existing = if args.replace { Existing::Replace } else { Existing::Refuse };
    let prepare = |file| prepare(file, args.output.as_deref().unwrap_or(file), &key, existing);
    let mut outcomes: Vec<_> = args.files.iter().map(|file| prepare(file)).collect();
    if outcomes.iter().all(|outcome| outcome.text.is_some()) {
        outcomes.iter_mut().for_each(write);
    }
    report(&outcomes, key.public().id(), args.json)
}

/// Why the file of --out is not written over; `None` where it may be. The document itself is signed in its place.
fn kept(args: &SignArgs, output: &Path) -> Option<String> {
    let why = if are_one(output, &args.key) {
        "is the private key: give another name"
    } else if is_taken(output) && !args.replace && !args.files.iter().any(|file| are_one(output, file)) {
        "exists: give another name, or --overwrite"
    } else {
        return None;
    };
    Some(format!("isotherm: {} {why}", output.display()))
}

/// Validates one document and signs its text, without writing it yet.
fn prepare(file: &Path, output: &Path, key: &PrivateKey, existing: Existing) -> Outcome {
    let mut outcome = Outcome {
        file: file.display().to_string(),
        output: output.display().to_string(),
        ..Outcome::default()
    };
    let bytes = match read_bounded(file) {
        Ok(bytes) => bytes,
        Err(error) => return Outcome { failure: Some(format!("cannot be read: {error}")), ..outcome },
    };
    let text = match text(&bytes, Some(&outcome.file)) {
        Ok(text) => text,
        Err(problems) => return Outcome { problems, ..outcome },
    };
    let signed = match signature::sign(text, key, existing) {
        Ok(signed) => Some(signed),
        Err(error) => {
            if matches!(error.wrong, Wrong::Signed { .. }) {
                outcome.failure = Some(error.wrong.to_string());
            } else {
                outcome.problems.push(error.problem(Some(&outcome.file)));
            }
            None
        }
    };
    // As it will be read: the line of the signature counts towards the longest length.
    match unit_and_warnings(signed.as_deref().unwrap_or(text), &outcome.file) {
        Ok((unit, warnings)) => {
            outcome.warnings = warnings;
            outcome.unit = Some(unit);
            outcome.digest = signed.as_ref().map(|signed| Digest::of(signed.as_bytes()).to_string());
        }
        Err(problems) => outcome.problems.extend(problems),
    }
    Outcome { text: signed.filter(|_| outcome.problems.is_empty()), ..outcome }
}

/// Unit and warnings of a document, or of an overlay. Whether an overlay fits its document is seen where both are.
fn unit_and_warnings(text: &str, file: &str) -> Result<(String, Vec<Problem>), Vec<Problem>> {
    if is_overlay(text) {
        return Overlay::parse(text, Some(file)).map(|parsed| (parsed.overlay.unit, Vec::new()));
    }
    Document::parse(text, Some(file)).map(|parsed| (parsed.document.unit, parsed.warnings))
}

fn write(outcome: &mut Outcome) {
    match replace(Path::new(&outcome.output), outcome.text.as_deref().unwrap_or_default().as_bytes()) {
        Ok(()) => outcome.signed = true,
        Err(error) => outcome.failure = Some(format!("cannot write {}: {error}", outcome.output)),
    }
}

fn report(outcomes: &[Outcome], key_id: KeyId, json: bool) -> Exit {
    let signed = outcomes.iter().all(|outcome| outcome.signed);
    let is_bad = outcomes.iter().any(|outcome| !outcome.problems.is_empty());
    let exit = if signed { Exit::Ok } else { Exit::blaming(false, is_bad) };
    if json {
        let report = serde_json::json!({ "signed": signed, "key_id": key_id, "files": outcomes });
        return print(&isotherm_cli::json(&report), exit);
    }
    let text: String = outcomes.iter().map(|outcome| in_words(outcome, key_id)).collect();
    if outcomes.len() > 1 && outcomes.iter().all(|outcome| !outcome.signed) {
        say("isotherm: none of the documents was signed");
    }
    print(&text, exit)
}

/// Problems to stderr; the line for stdout, where the file was signed.
fn in_words(outcome: &Outcome, key_id: KeyId) -> String {
    if let Some(failure) = &outcome.failure {
        say(format_args!("{}: {failure}", outcome.file));
    }
    say_problems(&outcome.problems, &outcome.warnings);
    if !outcome.signed {
        return String::new();
    }
    format!(
        "{}: calibration of unit {}, signed by key {key_id}, sha256 {}\n",
        outcome.output,
        outcome.unit.as_deref().unwrap_or_default(),
        outcome.digest.as_deref().and_then(|digest| digest.get(..16)).unwrap_or_default()
    )
}
