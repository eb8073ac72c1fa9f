//! Files of the folder, read: each once, several at the same time.

use std::io;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::thread;

use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::Problem;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::overlay::Candidate;

use super::decision::unit_of;
use super::document::Document;
use crate::control::compressed::Compressed;
use crate::control::watch::read_document;
use isotherm_document::file;

/// Files from which on it is worth while to read several at the same time.
const FEW: usize = 8;
/// Most threads that read.
const MOST_THREADS: usize = 8;

/// The content of a file, and what was found in it.
#[derive(Debug)]
pub(super) struct Read {
    content: Compressed,
    /// SHA-256 of the content.
    pub(super) digest: Digest,
    /// Unit that it names, whatever else is wrong with it.
    pub(super) hint: Option<UnitId>,
    /// What it says, or everything that is wrong with it; `None` where it is no text.
    pub(super) found: Option<Result<Document, Vec<Problem>>>,
}

impl Read {
    /// Looks at the content of a file.
    pub(super) fn of(path: &Path, bytes: &[u8]) -> Self {
        let name = path.display().to_string();
        let digest = Digest::of(bytes);
        let text = file::text(bytes, Some(&name)).ok();
        let read =
            |text: &str| Candidate::parse(text, Some(&name), None).map(|it| Document::of(it, None, bytes));
        let found = text.map(read);
        let hint = match &found {
            Some(Ok(document)) => UnitId::new(&document.unit).ok(),
            _ => std::str::from_utf8(bytes).ok().and_then(unit_of),
        };
        let text = found.as_ref().and_then(|found| found.as_ref().ok()?.text.as_ref());
        let content = text.cloned().unwrap_or_else(|| Compressed::new(bytes));
        Self { content, digest, hint, found }
    }

    /// The content.
    pub(super) fn bytes(&self) -> Vec<u8> {
        self.content.read()
    }

    /// Unit that a valid document in it names.
    pub(super) fn unit(&self) -> Option<UnitId> {
        self.found.as_ref()?.as_ref().ok().and_then(|document| UnitId::new(&document.unit).ok())
    }
}

/// Reads files, on as many threads as there are processors; in the order of the files.
pub(super) fn read_all(files: &[PathBuf]) -> Vec<(PathBuf, io::Result<Read>)> {
    let threads = thread::available_parallelism().map_or(1, NonZero::get).min(MOST_THREADS);
    if files.len() <= FEW || threads == 1 {
        return read_some(files);
    }
    thread::scope(|scope| {
        let parts = files.chunks(files.len().div_ceil(threads));
        let readers: Vec<_> = parts.map(|part| (part, scope.spawn(move || read_some(part)))).collect();
        // Where a reader has ended in a panic, it is to be seen here.
        let read =
            readers.into_iter().map(|(part, reader)| reader.join().unwrap_or_else(|_| read_some(part)));
        read.flatten().collect()
    })
}

fn read_some(files: &[PathBuf]) -> Vec<(PathBuf, io::Result<Read>)> {
    let read = |file: &PathBuf| read_document(file).map(|bytes| Read::of(file, &bytes));
    files.iter().map(|file| (file.clone(), read(file))).collect()
}
