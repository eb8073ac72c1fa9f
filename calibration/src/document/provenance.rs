//! Where the numbers of a document come from: `[origin]` of the document.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use isotherm_log::source::is_recording;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::{Log, Origin};
use sha2::{Digest as _, Sha256};

use crate::document::{Written, name_of};
use crate::error::Error;

/// Name and version of this program, as documents state it.
pub const TOOL: &str = concat!("isotherm-calibrate ", env!("CARGO_PKG_VERSION"));

/// Key in `origin.details`: the document that this one was made from.
pub(crate) const BASE: &str = "base";

/// Most logs that a document's origin lists.
pub(super) const MOST_LOGS: usize = 64;

/// A document as those made from it name it: the digest of its text, nothing where a fit started without one.
pub(crate) fn base_of(base: Option<&Written>) -> toml::Value {
    base.map(digest_of).unwrap_or_default().into()
}

/// Head of the digest of a document's text.
pub(super) fn digest_of(document: &Written) -> String {
    format!("{:016x}", u64::from_be_bytes(document.loaded.digest))
}

/// The origin of a document made from logs by a command; method, ranges and residuals are the fit's to add.
///
/// # Errors
/// [`Error::Log`] where a log cannot be read.
pub fn origin(logs: &[PathBuf], command: &str) -> Result<Origin, Error> {
    let log = logs.iter().map(|path| log_of(path)).collect::<Result<_, _>>()?;
    Ok(Origin { tool: Some(TOOL.to_owned()), command: Some(command.to_owned()), log, ..Origin::default() })
}

/// Name and SHA-256 of a log; of a folder that of its files.
fn log_of(path: &Path) -> Result<Log, Error> {
    let digest = if path.is_dir() { of_folder(path)? } else { of_file(path)? };
    Ok(Log { name: name_of(path), sha256: digest.to_string() })
}

/// Whether two files have the same contents. What cannot be read is told by who reads it next.
pub(crate) fn are_copies(one: &Path, other: &Path) -> bool {
    let length = |path: &Path| Some(path.metadata().ok().filter(std::fs::Metadata::is_file)?.len());
    let lengths = [one, other].map(length);
    lengths[0].is_some() && lengths[0] == lengths[1] && of_file(one).ok() == of_file(other).ok()
}

fn of_file(path: &Path) -> Result<Digest, Error> {
    let failed = |source: io::Error| Error::file(path, "read the log", source);
    let mut file = File::open(path).map_err(failed)?;
    let mut hash = Sha256::new();
    let mut block = vec![0; 1 << 16];
    loop {
        match file.read(&mut block).map_err(failed)? {
            0 => break,
            count => hash.update(&block[..count]),
        }
    }
    Ok(Digest(hash.finalize().into()))
}

/// The digest of what `sha256sum` prints of a folder's files, in the order of their names: of its recordings where it has some, else of
/// all but documents and pages, which a fit may have written beside its log.
fn of_folder(folder: &Path) -> Result<Digest, Error> {
    let mut files = recordings_in(folder)?;
    if files.is_empty() {
        let beside = |path: &PathBuf| {
            let hidden = name_of(path).starts_with('.');
            hidden || path.extension().is_some_and(|end| end == "toml" || end == "html")
        };
        files = files_of(folder)?;
        files.retain(|path| !beside(path));
    }
    files.sort();
    let mut hash = Sha256::new();
    for file in &files {
        let name = name_of(file);
        hash.update(format!("{}  {name}\n", of_file(file)?));
    }
    Ok(Digest(hash.finalize().into()))
}

/// The regular files of a folder, not those of folders in it.
pub(crate) fn files_of(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let failed = |source: io::Error| Error::file(folder, "read the folder", source);
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.is_file() {
            files.push(path);
        }
    }
    Ok(files)
}

/// The recordings in a folder, in the order in which they were written: by name, numbers in it by their size.
///
/// # Errors
/// [`Error::Log`] where the folder cannot be read.
pub fn recordings_in(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut files = files_of(folder)?;
    files.retain(|path| is_recording(path));
    files.sort_by_cached_key(|path| pieces(&name_of(path)));
    Ok(files)
}

/// A name as text and numbers in turn, so that 10 comes behind 9.
fn pieces(name: &str) -> Vec<(String, u128)> {
    let letters: Vec<char> = name.chars().collect();
    let pieces = letters.chunk_by(|a, b| a.is_ascii_digit() == b.is_ascii_digit()).map(String::from_iter);
    let piece = |piece: String| match piece.parse() {
        Ok(number) if piece.starts_with(|letter: char| letter.is_ascii_digit()) => (String::new(), number),
        _ => (piece, 0),
    };
    pieces.map(piece).collect()
}

/// The command line as it was given, for the document.
pub fn command_line() -> String {
    let mut words = std::env::args();
    let _ = words.next();
    words.fold("isotherm-calibrate".to_owned(), |line, word| format!("{line} {}", quoted(&word)))
}

/// A word as a shell takes it for one and for nothing else.
fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "-_./=,:+@%".contains(letter);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_can_be_given_once_more() {
        let words = ["a/b-1.mcap", "--axis=0,-1,0", "run (2).csv", "it's", "a&b", "*", ""].map(quoted);
        let given = ["a/b-1.mcap", "--axis=0,-1,0", "'run (2).csv'", r"'it'\''s'", "'a&b'", "'*'", "''"];
        assert_eq!(words, given);
    }

    #[test]
    fn a_folder_has_the_digest_of_its_files_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("b.csv"), "two").unwrap();
        std::fs::write(path("a.csv"), "one").unwrap();
        std::fs::write(path("new.toml"), "what a fit wrote").unwrap();
        let digest = |path: &Path| origin(&[path.to_path_buf()], "").unwrap().log.remove(0).sha256;
        let listed = format!("{}  a.csv\n{}  b.csv\n", digest(&path("a.csv")), digest(&path("b.csv")));
        std::fs::write(path("listed.html"), listed).unwrap();
        assert_eq!(digest(folder.path()), digest(&path("listed.html")));
        std::fs::write(path("b.csv"), "three").unwrap();
        assert_ne!(digest(folder.path()), digest(&path("listed.html")));
        assert!(origin(&[path("none")], "").unwrap_err().to_string().contains("none"));
    }

    #[test]
    fn recordings_come_in_the_order_of_their_numbers() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["run_10.mcap", "run_9.mcap", "run_1.mcap", "notes.mcap.txt"] {
            let magic = if name.ends_with("mcap") { isotherm_log::recording::MAGIC } else { b"no" };
            std::fs::write(folder.path().join(name), magic).unwrap();
        }
        let found = recordings_in(folder.path()).unwrap();
        let names: Vec<_> = found.iter().map(|path| path.file_name().unwrap().to_str().unwrap()).collect();
        assert_eq!(names, ["run_1.mcap", "run_9.mcap", "run_10.mcap"]);
    }
}
