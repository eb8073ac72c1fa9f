//! Files that a command writes: what must hold of them before anything is read.

use std::fs::OpenOptions;
use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_log::file::refuse_overwriting;

use crate::error::Error;
use crate::report::of_unit;
use crate::written::write_file;

/// The page of a command that writes nothing else.
#[derive(Debug, Clone, Args)]
pub(super) struct PageArgs {
    /// HTML report to write, one file; several units: FILE-UNIT.html each, and a table in FILE
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Replace an existing page
    #[arg(long, requires = "html")]
    overwrite: bool,
}

impl PageArgs {
    /// Checks before anything is read; `inputs` may not be overwritten.
    pub(super) fn check(&self, inputs: &[&Path]) -> Result<(), Error> {
        self.html.iter().try_for_each(|html| writable(html, inputs, self.overwrite))
    }

    /// Checks the page of one unit of several, before any of them is looked at.
    pub(super) fn check_unit(&self, unit: &str) -> Result<(), Error> {
        self.html.iter().try_for_each(|html| keep(&of_unit(html, unit), self.overwrite))
    }

    /// Writes the page, where one is wanted.
    pub(super) fn write(&self, page: impl FnOnce() -> String) -> Result<(), Error> {
        match &self.html {
            Some(html) => write_file(html, page().as_bytes(), self.overwrite),
            None => Ok(()),
        }
    }

    /// Writes the page of one unit of several.
    pub(super) fn write_unit(&self, unit: &str, page: impl FnOnce() -> String) -> Result<(), Error> {
        match &self.html {
            Some(html) => write_file(&of_unit(html, unit), page().as_bytes(), self.overwrite),
            None => Ok(()),
        }
    }

    /// The page of a batch's table, and whether it may replace another.
    pub(super) fn table(&self) -> (Option<&Path>, bool) {
        (self.html.as_deref(), self.overwrite)
    }
}

/// Refuses an output that is one of the inputs, that is there and may not be replaced, or that cannot be written.
pub(super) fn writable(out: &Path, inputs: &[&Path], overwrite: bool) -> Result<(), Error> {
    refuse_overwriting(out, inputs)?;
    if out.is_dir() {
        return Err(Error::Usage(format!("{} is a folder: give the name of a file in it", out.display())));
    }
    keep(out, overwrite)?;
    let folder = match out.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    if !folder.exists() {
        return Err(Error::Usage(format!(
            "{} cannot be written: first create the folder with mkdir -p {}",
            out.display(),
            folder.display()
        )));
    }
    if !folder.is_dir() {
        return Err(Error::Usage(format!(
            "{} cannot be written: {} is not a folder",
            out.display(),
            folder.display()
        )));
    }
    probe(out, folder).map_err(|source| Error::file(out, "write", source))
}

/// Leaves a file alone that is there, unless it may be written over.
pub(super) fn keep(out: &Path, overwrite: bool) -> Result<(), Error> {
    if out.exists() && !overwrite {
        return Err(Error::Usage(format!("{} exists: give another name, or --overwrite", out.display())));
    }
    Ok(())
}

/// Tries whether a file can be written, and leaves everything as it was: permissions do not tell of a file system that is read only.
fn probe(out: &Path, folder: &Path) -> io::Result<()> {
    if out.exists() {
        return OpenOptions::new().write(true).open(out).map(drop);
    }
    // Not under its own name: a service may watch the folder.
    let name = folder.join(format!(".isotherm-calibrate-{}", std::process::id()));
    OpenOptions::new().write(true).create(true).truncate(true).open(&name)?;
    std::fs::remove_file(&name)
}

#[cfg(test)]
mod tests {
    use isotherm_cli::Exit;

    use super::*;

    #[test]
    fn outputs_are_refused_in_words_that_say_what_to_do() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("notes.txt"), "mine").unwrap();
        let refused = |name: &str, overwrite| {
            let tried = writable(&path(name), &[&path("log.mcap")], overwrite);
            tried.err().map(|error| (error.exit(), error.to_string()))
        };
        for (name, overwrite, wanted) in [
            ("notes.txt", false, "exists"),
            ("no/such/x.toml", false, "first create the folder with mkdir -p "),
            ("notes.txt/x.toml", false, "is not a folder"),
            (".", true, "is a folder: give the name of a file in it"),
            ("log.mcap", true, "would be overwritten"),
        ] {
            let (code, words) = refused(name, overwrite).unwrap();
            assert!(code == Exit::Usage && words.contains(wanted), "{name}: {words}");
        }
        assert_eq!((refused("notes.txt", true), refused("new.toml", false)), (None, None));
        // Nothing has been touched.
        assert_eq!(std::fs::read_to_string(path("notes.txt")).unwrap(), "mine");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_place_that_takes_no_file_is_told_before_anything_is_read() {
        let error = writable(Path::new("/proc/unit.toml"), &[], false).unwrap_err();
        assert!(error.exit() == Exit::Failed && error.to_string().contains("/proc/unit.toml"), "{error}");
    }
}
