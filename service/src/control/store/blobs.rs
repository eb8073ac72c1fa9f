//! Documents by their digest, in a folder or in memory.

use std::collections::{BTreeMap, VecDeque};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::MAX_DOCUMENT_BYTES;

use super::{StoreError, folder};
use crate::control::compressed::Compressed;
use isotherm_document::file::{check_regular, read_bounded};

/// Most bytes of documents that are kept in memory; beyond it the oldest go.
const MAX_MEMORY_BYTES: usize = 64 * MAX_DOCUMENT_BYTES;

/// Documents by the SHA-256 of their bytes.
#[derive(Debug)]
pub(super) enum BlobStore {
    /// One file each, `<sha256>.toml`.
    Folder(PathBuf),
    /// Gone with the process.
    Memory(Memory),
}

/// Documents in memory.
#[derive(Debug, Default)]
pub(super) struct Memory {
    by_digest: BTreeMap<Digest, Compressed>,
    /// The oldest first.
    order: VecDeque<Digest>,
    bytes: usize,
}

impl BlobStore {
    /// The blobs in a folder, which is made if missing.
    ///
    /// # Errors
    /// [`StoreError::Folder`] where it cannot be made or written to.
    pub(super) fn open(folder: PathBuf) -> Result<Self, StoreError> {
        match folder::make_folder(&folder).and_then(|()| folder::sweep(&folder)) {
            Ok(()) => Ok(Self::Folder(folder)),
            Err(source) => Err(StoreError::Folder { path: folder, source }),
        }
    }

    /// An empty blobs in memory.
    pub(super) fn in_memory() -> Self {
        Self::Memory(Memory::default())
    }

    /// Keeps a document. One that is there already is left alone, one that was damaged since is written anew.
    ///
    /// # Errors
    /// [`StoreError::TooLong`], or [`StoreError::Write`].
    pub(super) fn put(&mut self, bytes: &[u8]) -> Result<Digest, StoreError> {
        let digest = Digest::of(bytes);
        self.put_all(&[(digest, Compressed::new(bytes))])?;
        Ok(digest)
    }

    /// Keeps documents, each under its digest; as [`Self::put`] does one, but the disk is waited for by several at the same
    /// time.
    ///
    /// # Errors
    /// As [`Self::put`]; some may be kept then.
    pub(super) fn put_all(&mut self, documents: &[(Digest, Compressed)]) -> Result<(), StoreError> {
        if let Some((_, kept)) = documents.iter().find(|(_, kept)| kept.len() > MAX_DOCUMENT_BYTES) {
            return Err(StoreError::TooLong { bytes: kept.len() });
        }
        let new: Vec<_> =
            documents.iter().filter(|(digest, _)| !matches!(self.get(digest), Ok(Some(_)))).collect();
        match self {
            Self::Folder(folder) => {
                let files = new.into_iter().map(|(digest, kept)| (name(digest), kept));
                folder::write_all(folder, files, Compressed::read)
                    .map_err(|(name, source)| StoreError::Write { path: folder.join(name), source })
            }
            Self::Memory(memory) => {
                for (digest, kept) in new {
                    memory.put(*digest, kept.clone());
                }
                Ok(())
            }
        }
    }

    /// The document of a digest, checked against it; `None` where it is not kept.
    ///
    /// # Errors
    /// [`StoreError::Read`], or [`StoreError::Corrupt`].
    pub(super) fn get(&self, digest: &Digest) -> Result<Option<Vec<u8>>, StoreError> {
        match self {
            Self::Folder(folder) => read(&folder.join(name(digest)), digest),
            Self::Memory(memory) => Ok(memory.by_digest.get(digest).map(Compressed::read)),
        }
    }

    /// The file that a document is kept in; `None` for one in memory.
    pub(super) fn file(&self, digest: &Digest) -> Option<PathBuf> {
        match self {
            Self::Folder(folder) => Some(folder.join(name(digest))),
            Self::Memory(_) => None,
        }
    }

    /// How many documents are kept in the folder; 0 for one in memory, or where that cannot be said.
    pub(super) fn count(&self) -> usize {
        let Self::Folder(folder) = self else { return 0 };
        let is_document =
            |entry: &std::fs::DirEntry| entry.path().extension().is_some_and(|extension| extension == "toml");
        std::fs::read_dir(folder).map_or(0, |entries| entries.flatten().filter(is_document).count())
    }

    /// Removes the documents that are older than this and go; how many there were.
    pub(super) fn prune(&self, now: SystemTime, age: Duration, goes: impl Fn(&Digest) -> bool) -> usize {
        let Self::Folder(folder) = self else { return 0 };
        let Ok(entries) = std::fs::read_dir(folder) else { return 0 };
        let digest = |path: &Path| path.file_name()?.to_str()?.strip_suffix(".toml")?.parse().ok();
        let paths = entries.flatten().map(|entry| entry.path());
        let old = paths.filter(|path| digest(path).is_some_and(|it| goes(&it)) && is_older(path, now, age));
        old.filter(|path| std::fs::remove_file(path).is_ok()).count()
    }

    /// Whether a document is kept; its bytes are not looked at.
    pub(super) fn holds(&self, digest: &Digest) -> bool {
        match self {
            Self::Folder(folder) => folder.join(name(digest)).is_file(),
            Self::Memory(memory) => memory.by_digest.contains_key(digest),
        }
    }
}

impl Memory {
    fn put(&mut self, digest: Digest, kept: Compressed) {
        self.bytes += kept.len();
        if let Some(before) = self.by_digest.insert(digest, kept) {
            // The same once more, in one go.
            self.bytes -= before.len();
            return;
        }
        self.order.push_back(digest);
        while self.bytes > MAX_MEMORY_BYTES {
            let Some(oldest) = self.order.pop_front() else { return };
            self.bytes -= self.by_digest.remove(&oldest).map_or(0, |kept| kept.len());
        }
    }
}

/// Name of a document's file.
fn name(digest: &Digest) -> String {
    format!("{digest}.toml")
}

/// Reads a document's file and checks it.
fn read(path: &Path, digest: &Digest) -> Result<Option<Vec<u8>>, StoreError> {
    let bytes = match check_regular(path).and_then(|()| read_bounded(path)) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(StoreError::Read { path: path.to_owned(), source }),
    };
    match Digest::of(&bytes) {
        found if found == *digest => Ok(Some(bytes)),
        found => Err(StoreError::Corrupt { path: path.to_owned(), found }),
    }
}

/// Whether a file was written longer ago than this.
fn is_older(file: &Path, now: SystemTime, age: Duration) -> bool {
    let written = file.metadata().and_then(|metadata| metadata.modified());
    written.is_ok_and(|written| now.duration_since(written).is_ok_and(|since| since > age))
}
