//! The `keygen` command: a new pair of keys.

use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::{Exit, failed, json, print};
use isotherm_document::file::create;
use isotherm_protocol::signature::{KeyError, PrivateKey};
use serde::Serialize;
use thiserror::Error;

/// Arguments of `keygen`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  isotherm keygen bench-2
  isotherm keygen bench-2 --folder ~/keys --json

NAME.key signs: the signer keeps it secret. NAME.pub verifies: put it into the folder of trusted keys of every service
that accepts documents signed with NAME.key; the signer is shown there as NAME. Both are PEM; a key made with
`openssl genpkey -algorithm ed25519` works too.
Exit codes: 0 done, 1 a file exists or cannot be written.")]
pub struct KeygenArgs {
    /// Name of the signer: 1 to 64 letters, digits, `-`, `_` and `.`
    #[arg(value_parser = name)]
    pub name: String,
    /// Folder for the two files
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    pub folder: PathBuf,
    /// Print one JSON object on stdout instead
    #[arg(long)]
    pub json: bool,
}

/// A pair that was made.
#[derive(Debug, Serialize)]
struct Made {
    name: String,
    key_id: String,
    fingerprint: String,
    private_key: String,
    public_key: String,
}

/// Why no pair was made.
#[derive(Debug, Error)]
enum KeygenError {
    #[error("{} exists and is left unchanged: choose another name, or move the file", .0.display())]
    Exists(PathBuf),
    #[error("cannot write {}: {source}", path.display())]
    Write { path: PathBuf, source: std::io::Error },
    #[error("the system provides no random numbers: {0}")]
    Random(getrandom::Error),
    #[error("the new key {0}")]
    Encode(#[from] KeyError),
}

/// Makes a pair of keys and says what they are called.
#[must_use]
pub fn run(args: &KeygenArgs) -> Exit {
    match make(&args.name, &args.folder) {
        Ok(made) if args.json => print(&json(&made), Exit::Ok),
        Ok(made) => print(&in_words(&made), Exit::Ok),
        Err(error) => failed(error, Exit::Failed),
    }
}

fn make(name: &str, folder: &Path) -> Result<Made, KeygenError> {
    // Not `with_extension`, which would take the end off a name with a dot in it.
    let [private, public] = ["key", "pub"].map(|ending| folder.join(format!("{name}.{ending}")));
    for path in [&private, &public] {
        if path.symlink_metadata().is_ok() {
            return Err(KeygenError::Exists(path.clone()));
        }
    }
    let mut seed = [0; 32];
    getrandom::fill(&mut seed).map_err(KeygenError::Random)?;
    let key = PrivateKey::from_seed(&seed);
    write(&private, &key.to_pem()?, 0o600)?;
    // Half a pair is no use to anybody, and would be in the way of the next attempt.
    let made_public = key.public().to_pem().map_err(KeygenError::from);
    if let Err(error) = made_public.and_then(|pem| write(&public, &pem, 0o644)) {
        let _ = std::fs::remove_file(&private);
        return Err(error);
    }
    Ok(Made {
        name: name.to_owned(),
        key_id: key.public().id().to_string(),
        fingerprint: key.public().fingerprint(),
        private_key: private.display().to_string(),
        public_key: public.display().to_string(),
    })
}

fn write(path: &Path, pem: &str, mode: u32) -> Result<(), KeygenError> {
    create(path, pem.as_bytes(), mode).map_err(|source| match source.kind() {
        std::io::ErrorKind::AlreadyExists => KeygenError::Exists(path.to_owned()),
        _ => KeygenError::Write { path: path.to_owned(), source },
    })
}

fn in_words(made: &Made) -> String {
    format!(
        "private key  {}  (it signs: keep it secret)\n\
         public key   {}  (for the folder of trusted keys)\n\
         key id       {}\n\
         fingerprint  sha256 {}\n",
        made.private_key, made.public_key, made.key_id, made.fingerprint
    )
}

/// A name that is safe as a file's, on every system.
fn name(text: &str) -> Result<String, String> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    if (1..=64).contains(&text.len()) && text.chars().all(is_plain) && !text.starts_with(['.', '-']) {
        Ok(text.to_owned())
    } else {
        Err("must be 1 to 64 letters, digits, `-`, `_` and `.`, and begin with a letter, a digit or `_`; the folder is \
             given by --folder"
            .to_owned())
    }
}
