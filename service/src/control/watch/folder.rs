//! Which files of a folder count, and what a look at one and a reading of it see.

use std::fs::{File, Metadata};
use std::io::{ErrorKind, Read};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::MAX_DOCUMENT_BYTES;

/// The files of a folder with an extension, in the order of their names, hidden files and sub-folders excepted.
///
/// What cannot be read counts too, such as a pipe, or a link that leads nowhere: an operator who put it there is told.
///
/// # Errors
/// Where the folder cannot be read.
pub(crate) fn files_in(folder: &Path, extension: &str) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let hidden = path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
        let wanted = !hidden && path.extension().is_some_and(|other| other == extension);
        if wanted && path.metadata().map_or(true, |metadata| !metadata.is_dir()) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// Which folder a path leads to, links followed: device and inode.
///
/// # Errors
/// Where it leads nowhere.
pub(super) fn identity(folder: &Path) -> std::io::Result<(u64, u64)> {
    let metadata = folder.metadata()?;
    Ok((metadata.dev(), metadata.ino()))
}

/// What differs when a file has been touched, written, replaced, or given other permissions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    file: (u64, u64),
    length: u64,
    /// Written at, in s and ns.
    written: (i64, i64),
    /// Anything of it changed at. An editor may set the former back, not this.
    changed: (i64, i64),
}

impl Stamp {
    fn of(metadata: &Metadata) -> Self {
        Self {
            file: (metadata.dev(), metadata.ino()),
            length: metadata.len(),
            written: (metadata.mtime(), metadata.mtime_nsec()),
            changed: (metadata.ctime(), metadata.ctime_nsec()),
        }
    }
}

/// What a look at a path sees, links followed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Sight {
    /// A regular file.
    File(Stamp),
    /// Something else, or nothing that can be looked at: why it cannot be read.
    Odd(String),
    /// Nothing of this name.
    Absent,
}

/// Looks at a path.
pub(super) fn look(path: &Path) -> Sight {
    match path.metadata() {
        Ok(metadata) if metadata.is_file() => Sight::File(Stamp::of(&metadata)),
        Ok(metadata) if metadata.is_dir() => Sight::Odd("it is a folder".to_owned()),
        Ok(_) => Sight::Odd("it is a pipe or a device".to_owned()),
        Err(error) if error.kind() == ErrorKind::NotFound => match path.symlink_metadata() {
            Ok(_) => Sight::Odd("it is a link to a file that does not exist".to_owned()),
            Err(_) => Sight::Absent,
        },
        Err(error) => Sight::Odd(error.to_string()),
    }
}

/// Reads a file that may be anything: of a longer one, one byte more than a document may have.
///
/// # Errors
/// Where it cannot be read, or is no file: opening a pipe would wait for somebody who writes, and a device may never end.
pub(crate) fn read_document(path: &Path) -> std::io::Result<Vec<u8>> {
    match look(path) {
        Sight::File(_) => read(path).map(|content| content.bytes),
        Sight::Odd(reason) => Err(std::io::Error::other(reason)),
        Sight::Absent => Err(ErrorKind::NotFound.into()),
    }
}

/// The content of a file as it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Content {
    /// At most one byte more than a document may have.
    pub(super) bytes: Vec<u8>,
    /// SHA-256 of the bytes.
    pub(super) digest: Digest,
    /// Whether nobody wrote while it was read.
    pub(super) steady: bool,
}

/// Reads a file.
///
/// # Errors
/// Where it cannot be opened or read, or is no file any more.
pub(super) fn read(path: &Path) -> std::io::Result<Content> {
    let file = File::open(path)?;
    let before = file.metadata()?;
    if !before.is_file() {
        return Err(std::io::Error::other("it is not a file"));
    }
    let mut bytes = Vec::new();
    (&file).take(MAX_DOCUMENT_BYTES as u64 + 1).read_to_end(&mut bytes)?;
    let steady = Stamp::of(&before) == Stamp::of(&file.metadata()?);
    let digest = Digest::of(&bytes);
    Ok(Content { bytes, digest, steady })
}
