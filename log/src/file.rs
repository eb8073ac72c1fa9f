//! Small files read and written whole, and outputs that must not fall on inputs.

mod alone;

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, BufWriter, Read, Stdout, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use flate2::Compression;
use flate2::write::GzEncoder;
use isotherm_document::file::{NEW_FILE, are_one, create, is_taken, read_bounded, write_over};

pub(crate) use alone::create_alone;
pub use alone::is_being_written;

use crate::error::Error;

/// Reads a mapping, calibration document or scenario; a log given in its place must not fill the memory.
///
/// # Errors
/// [`Error::File`], also where it is too long or not UTF-8.
pub fn read_small_text(path: &Path, action: &'static str) -> Result<String, Error> {
    let failed = |source| Error::file(path, action, source);
    let bytes = read_bounded(path).map_err(failed)?;
    let text = isotherm_document::file::text(&bytes, None).map(ToOwned::to_owned);
    text.map_err(|problems| {
        failed(io::Error::other(problems.into_iter().map(|problem| problem.message).collect::<String>()))
    })
}

/// Refuses a log that is no file: it would be gone when it is read the second time.
///
/// # Errors
/// [`Error::Usage`]; what is not there is not refused.
pub(crate) fn refuse_pipe(path: &Path) -> Result<(), Error> {
    match std::fs::metadata(path) {
        Ok(found) if !found.is_file() && !found.is_dir() => Err(Error::Usage(format!(
            "{} is a pipe or a device: a log is read more than once; save it to a file",
            path.display()
        ))),
        _ => Ok(()),
    }
}

/// Opens a file of a log.
///
/// # Errors
/// As [`refuse_pipe`], and [`Error::File`].
pub(crate) fn open_log(path: &Path, action: &'static str) -> Result<File, Error> {
    refuse_pipe(path)?;
    File::open(path).map_err(|source| Error::file(path, action, source))
}

/// Refuses an output that is one of the other files of the command, or is called as one until it is whole, before anything is written.
///
/// # Errors
/// [`Error::Usage`].
pub fn refuse_overwriting(out: &Path, others: &[&Path]) -> Result<(), Error> {
    // Devices may be given twice.
    for out in [out, &partial_of(out)].into_iter().filter(|out| out.is_file() || !out.exists()) {
        if let Some(other) = others.iter().find(|other| are_one(out, other)) {
            return Err(Error::Usage(format!(
                "{} would be overwritten: it is also the {} of this command; give another name",
                out.display(),
                other.display()
            )));
        }
    }
    Ok(())
}

/// Refuses an output that would replace what is there, unless it may; a device or a pipe is written to as it is.
///
/// # Errors
/// [`Error::Usage`].
pub fn refuse_replacing(out: &Path, overwrite: bool) -> Result<(), Error> {
    if is_taken(out) && !overwrite {
        return Err(Error::Usage(format!("{} exists: give another name, or --overwrite", out.display())));
    }
    Ok(())
}

/// Writes a file beside its place and moves it there: on a full disk the old one stays, and nothing is there by halves. One that is
/// there only where that is allowed.
///
/// # Errors
/// That of the folder or the disk.
pub fn write_whole(path: &Path, bytes: &[u8], overwrite: bool) -> io::Result<()> {
    if !overwrite {
        return create(path, bytes, NEW_FILE);
    }
    if path.is_symlink() && !path.exists() {
        // A link that leads nowhere goes.
        std::fs::remove_file(path)?;
    }
    write_over(path, bytes)
}

/// What is being written and has no name yet.
static WRITING: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn writing() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    WRITING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what is not whole, for a program that ends at once.
pub fn remove_partials() {
    for path in writing().iter() {
        // It may not have been created yet.
        let _ = std::fs::remove_file(path);
    }
}

/// What a file is called until it is whole.
pub(crate) fn partial_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".partial");
    name.into()
}

/// A file that is written under another name until it is whole; removed when dropped before.
#[derive(Debug)]
pub struct Partial {
    path: PathBuf,
    writing: PathBuf,
    kept: bool,
    /// Whether it was surely created here.
    own: bool,
}

impl Partial {
    /// What will be at a path; a device is written to as it is.
    #[must_use]
    pub fn of(path: &Path) -> Self {
        let kept = path.exists() && !path.is_file();
        let writing = if kept { path.to_owned() } else { partial_of(path) };
        if !kept {
            self::writing().insert(writing.clone());
        }
        Self { path: path.to_owned(), writing, kept, own: false }
    }

    /// Creates it, to be written by nobody else at the same time.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn create(&mut self) -> Result<File, Error> {
        let file = create_alone(&self.writing, true)?;
        self.own = true;
        Ok(file)
    }

    /// Where it is written to.
    #[must_use]
    pub fn writing(&self) -> &Path {
        &self.writing
    }

    /// Where it will be.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// It is whole: gives it its name.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn keep(mut self) -> Result<(), Error> {
        if !self.kept {
            std::fs::rename(&self.writing, &self.path)
                .map_err(|source| Error::file(&self.path, "name the file", source))?;
            writing().remove(&self.writing);
            self.kept = true;
        }
        Ok(())
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        if !self.kept {
            // It may never have been created, or be another program's. One's own may still look written to: a process that is being
            // started has all files of this one for a moment.
            if self.own || !is_being_written(&self.writing) {
                let _ = std::fs::remove_file(&self.writing);
            }
            writing().remove(&self.writing);
        }
    }
}

/// A file that is being written, compressed where its name ends in `.gz`; or standard output.
#[derive(Debug)]
pub struct Sink {
    stream: Stream,
    partial: Partial,
}

/// Where bytes go.
#[derive(Debug)]
enum Stream {
    Plain(BufWriter<File>),
    Gzip(Box<GzEncoder<BufWriter<File>>>),
    Stdout(BufWriter<Stdout>),
}

/// Bytes that are written together.
const BLOCK: usize = 1 << 16;

impl Sink {
    /// Creates a file.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn create(path: &Path) -> Result<Self, Error> {
        let mut partial = Partial::of(path);
        let file = BufWriter::with_capacity(BLOCK, partial.create()?);
        let stream = if path.extension().is_some_and(|extension| extension == "gz") {
            Stream::Gzip(Box::new(GzEncoder::new(file, Compression::default())))
        } else {
            Stream::Plain(file)
        };
        Ok(Self { stream, partial })
    }

    /// Standard output.
    #[must_use]
    pub fn stdout() -> Self {
        let partial =
            Partial { path: "standard output".into(), writing: PathBuf::new(), kept: true, own: true };
        Self { stream: Stream::Stdout(BufWriter::with_capacity(BLOCK, io::stdout())), partial }
    }

    /// Writes whatever `write` does.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn write<T>(&mut self, write: impl FnOnce(&mut dyn Write) -> io::Result<T>) -> Result<T, Error> {
        let written = match &mut self.stream {
            Stream::Plain(file) => write(file),
            Stream::Gzip(encoder) => write(encoder),
            Stream::Stdout(stdout) => write(stdout),
        };
        written.map_err(|source| Error::file(&self.partial.path, "write", source))
    }

    /// Everything is written: what has to be given its name.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn finish(self) -> Result<Partial, Error> {
        let Self { stream, partial } = self;
        let written = match stream {
            Stream::Plain(mut file) => file.flush(),
            Stream::Gzip(encoder) => encoder.finish().and_then(|mut file| file.flush()),
            Stream::Stdout(mut stdout) => stdout.flush(),
        };
        written.map_err(|source| Error::file(&partial.path, "write", source))?;
        Ok(partial)
    }
}

/// Whether something begins with these bytes; what cannot be read does not.
pub(crate) fn begins_with(source: impl Read, magic: &[u8]) -> bool {
    let mut start = Vec::with_capacity(magic.len());
    let read = source.take(magic.len() as u64).read_to_end(&mut start);
    read.is_ok() && start == magic
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    #[test]
    fn an_output_never_falls_on_an_input() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("log.csv"), "1\n").unwrap();
        std::os::unix::fs::symlink(path("log.csv"), path("link.csv")).unwrap();
        for (out, other, allowed) in [
            ("log.csv", "log.csv", false),
            ("link.csv", "log.csv", false),
            ("./log.csv", "link.csv", false),
            ("new.csv", "new.csv", false),
            ("new.csv", "new.csv.partial", false),
            ("new.csv", "log.csv", true),
        ] {
            assert_eq!(refuse_overwriting(&path(out), &[&path(other)]).is_ok(), allowed, "{out} {other}");
        }
        let null = Path::new("/dev/null");
        assert!(refuse_overwriting(null, &[null]).is_ok());

        std::os::unix::fs::symlink(path("nowhere"), path("dangling.csv")).unwrap();
        for (out, allowed) in [
            ("log.csv", false),
            ("link.csv", false),
            ("dangling.csv", false),
            (".", false),
            ("new.csv", true),
        ] {
            assert_eq!(refuse_replacing(&path(out), false).is_ok(), allowed, "{out}");
            assert!(refuse_replacing(&path(out), true).is_ok(), "{out}");
        }
        assert!(refuse_replacing(null, false).is_ok());
    }

    #[test]
    fn a_small_file_is_small() {
        insta::assert_snapshot!(read_small_text(Path::new("/dev/zero"), "read the mapping").unwrap_err());
    }

    #[test]
    fn a_log_is_no_pipe() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("log.csv");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        // Nothing of it is opened, which would wait for a writer.
        assert!(crate::part::are_recordings(std::slice::from_ref(&pipe)).unwrap_err().is_usage());
        assert!(!crate::source::is_recording(&pipe));
        assert!(crate::text::open_raw(&pipe, &std::sync::Arc::default()).is_err());
        insta::assert_snapshot!(open_log(Path::new("/dev/null"), "open the log").unwrap_err());
    }

    #[test]
    fn a_file_is_there_whole_or_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let text = |name: &str| std::fs::read_to_string(path(name)).unwrap();
        write_whole(&path("a.toml"), b"one", false).unwrap();
        assert!(write_whole(&path("a.toml"), b"two", false).is_err());
        assert_eq!(text("a.toml"), "one");
        std::os::unix::fs::symlink(path("a.toml"), path("link.toml")).unwrap();
        write_whole(&path("link.toml"), b"two", true).unwrap();
        assert_eq!(text("a.toml"), "two");
        assert!(path("link.toml").is_symlink());
        write_whole(Path::new("/dev/null"), b"three", true).unwrap();
        assert!(!Path::new("/dev/null").is_file());
        // As any other new file, for others to read.
        std::fs::write(path("other"), "").unwrap();
        let mode = |name: &str| std::fs::metadata(path(name)).unwrap().permissions().mode();
        assert_eq!(mode("a.toml"), mode("other"));
        assert!(write_whole(&path("none/b.toml"), b"", true).is_err());
        let left = std::fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(left, 3, "no temporary file stays");
    }
}
