//! Files that a command writes, and what must hold of them before anything is read.

use std::fs::OpenOptions;
use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::say;
use isotherm_log::file::{refuse_overwriting, refuse_replacing};

use crate::document::write_file;
use crate::error::Error;
use crate::report::of_unit;

/// Where what a command comes to goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Files<'a> {
    /// The new document.
    pub(super) out: Option<&'a Path>,
    /// The page.
    pub(super) html: Option<&'a Path>,
    /// Whether they may replace others.
    pub(super) overwrite: bool,
    /// Whether one JSON object is printed instead of text.
    pub(super) json: bool,
}

/// What a command prints that writes nothing but a page.
#[derive(Debug, Clone, Args)]
pub(super) struct PageArgs {
    /// HTML report to write, one file
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Replace an existing page
    #[arg(long, requires = "html")]
    overwrite: bool,
    /// Print everything as one JSON object
    #[arg(long)]
    json: bool,
}

impl PageArgs {
    /// As files.
    pub(super) fn files(&self) -> Files<'_> {
        Files { out: None, html: self.html.as_deref(), overwrite: self.overwrite, json: self.json }
    }
}

impl Files<'_> {
    /// Checks before anything is read; `inputs` may not be replaced.
    pub(super) fn check(&self, inputs: &[&Path]) -> Result<(), Error> {
        if let Some(out) = self.out {
            let inputs: Vec<&Path> = inputs.iter().copied().chain(self.html).collect();
            writable(out, &inputs, self.overwrite)?;
        }
        self.html.map_or(Ok(()), |html| writable(html, inputs, self.overwrite))
    }

    /// Checks the files of one unit of several, before any of them is looked at; `inputs` may not be replaced.
    pub(super) fn check_unit(&self, unit: &str, inputs: &[&Path]) -> Result<(), Error> {
        let mut outputs = self.out.into_iter().chain(self.html).map(|out| of_unit(out, unit));
        outputs.try_for_each(|out| {
            refuse_overwriting(&out, inputs)?;
            Ok(refuse_replacing(&out, self.overwrite)?)
        })
    }

    /// Says which files were written; a document is where one `came`.
    pub(super) fn say_written(&self, came: bool) {
        let there = self.out.filter(|_| came).into_iter().chain(self.html);
        let names: Vec<_> = there.map(|path| path.display().to_string()).collect();
        if !names.is_empty() {
            say(format_args!("written: {}", names.join(", ")));
        }
    }

    /// Writes the page, where one is wanted, under what its name is turned into.
    pub(super) fn page(
        &self,
        name: impl FnOnce(&Path) -> PathBuf,
        page: impl FnOnce() -> String,
    ) -> Result<(), Error> {
        self.html.map_or(Ok(()), |html| write_file(&name(html), page().as_bytes(), self.overwrite))
    }
}

/// Refuses an output that is one of the inputs, that is there and may not be replaced, or that cannot be written.
pub(super) fn writable(out: &Path, inputs: &[&Path], overwrite: bool) -> Result<(), Error> {
    refuse_overwriting(out, inputs)?;
    if out.is_dir() {
        return Err(Error::Usage(format!("{} is a folder: give the name of a file in it", out.display())));
    }
    refuse_replacing(out, overwrite)?;
    let folder = match out.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    if folder.is_dir() {
        return probe(out, folder).map_err(|source| Error::file(out, "write", source));
    }
    let why = if folder.exists() {
        format!("{} is not a folder", folder.display())
    } else {
        format!("first create the folder with mkdir -p {}", folder.display())
    };
    Err(Error::Usage(format!("{} cannot be written: {why}", out.display())))
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
        let told = [
            ("notes.txt", false),
            ("no/such/x.toml", false),
            ("notes.txt/x.toml", false),
            (".", true),
            ("log.mcap", true),
        ]
        .map(|(name, overwrite)| {
            let (code, words) = refused(name, overwrite).unwrap();
            assert_eq!(code, Exit::Usage, "{name}: {words}");
            words
        });
        insta::assert_snapshot!(told.join("\n").replace(folder.path().to_str().unwrap(), "FOLDER"));
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
