//! Names of the files of a recording.

use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};

use isotherm_log::file::{is_being_written, refuse_replacing};

use crate::error::Error;

/// Extension of recordings.
const EXTENSION: &str = "mcap";

/// The files of a recording, one or a row of them.
#[derive(Debug)]
pub(super) struct Files {
    out: PathBuf,
    rotates: bool,
    /// How many of them are kept.
    keep: Option<usize>,
    overwrite: bool,
    /// Of the file that was given last, from 1.
    pub(super) number: u32,
    /// Those that are there, oldest first.
    pub(super) kept: VecDeque<PathBuf>,
    /// How many were deleted to keep only the newest.
    pub(super) deleted: u64,
}

impl Files {
    /// Looks whether there is a place for them.
    ///
    /// # Errors
    /// [`Error::Usage`] where `out` has no file name, or there are files of this name already, and may not be written over, or are
    /// being written.
    pub(super) fn new(
        out: &Path,
        rotates: bool,
        keep: Option<usize>,
        overwrite: bool,
    ) -> Result<Self, Error> {
        let is_folder = out.as_os_str().as_encoded_bytes().ends_with(b"/");
        let Some(name) = out.file_name().filter(|_| !is_folder) else {
            let folder = out.display();
            let words = format!("--out {folder} is a folder: give the file's name too, such as {folder}/run");
            return Err(Error::Usage(words.replace("//", "/")));
        };
        let out = match out.extension() {
            Some(extension) if extension == EXTENSION => out.to_owned(),
            _ => {
                let mut name = name.to_owned();
                name.push(".");
                name.push(EXTENSION);
                out.with_file_name(name)
            }
        };
        let files = Self { out, rotates, keep, overwrite, number: 0, kept: VecDeque::new(), deleted: 0 };
        let found = files.found();
        if let Some(path) = found.iter().find(|path| is_being_written(path)) {
            return Err(Error::Usage(format!("{} is being written by another recorder", path.display())));
        }
        found.first().map_or(Ok(()), |path| refuse_replacing(path, overwrite))?;
        Ok(files)
    }

    /// The next file to be written. Before the first, those of an earlier recording of the same name are deleted, so that
    /// they are not taken for part of this one.
    ///
    /// # Errors
    /// [`Error::Log`] where one cannot be deleted.
    pub(super) fn advance(&mut self) -> Result<PathBuf, Error> {
        if self.number == 0 && self.rotates && self.overwrite {
            for path in self.found() {
                fs::remove_file(&path)
                    .map_err(|source| Error::file(&path, "delete the recording", source))?;
            }
        }
        self.number += 1;
        let path = if self.rotates {
            self.out.with_file_name(format!("{}-{:04}.{EXTENSION}", self.stem(), self.number))
        } else {
            self.out.clone()
        };
        self.kept.push_back(path.clone());
        Ok(path)
    }

    /// Deletes the oldest beyond those that are kept, never the last one; what could not be deleted, in words.
    pub(super) fn prune(&mut self) -> Option<String> {
        let keep = self.keep?.max(1);
        while self.kept.len() > keep {
            let path = self.kept.pop_front()?;
            match fs::remove_file(&path) {
                Ok(()) => self.deleted += 1,
                Err(error) => return Some(format!("{}: cannot be deleted: {error}", path.display())),
            }
        }
        None
    }

    fn stem(&self) -> String {
        self.out.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
    }

    /// Files of this name that are there.
    fn found(&self) -> Vec<PathBuf> {
        if !self.rotates {
            return self.out.symlink_metadata().is_ok().then(|| self.out.clone()).into_iter().collect();
        }
        let folder = self.out.parent().filter(|folder| !folder.as_os_str().is_empty());
        let begin = format!("{}-", self.stem());
        let is_ours = |path: &PathBuf| {
            let stem = path.file_stem().map(|stem| stem.to_string_lossy()).unwrap_or_default();
            let number = stem.strip_prefix(&begin).unwrap_or_default();
            path.extension().is_some_and(|extension| extension == EXTENSION)
                && number.len() >= 4
                && number.bytes().all(|byte| byte.is_ascii_digit())
        };
        let entries = fs::read_dir(folder.unwrap_or(Path::new("."))).into_iter().flatten().flatten();
        let mut found: Vec<_> = entries.map(|entry| entry.path()).filter(is_ours).collect();
        found.sort();
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_numbered_and_nothing_is_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("run");
        let mut single = Files::new(&out, false, None, false).unwrap();
        assert_eq!(single.advance().unwrap(), folder.path().join("run.mcap"));
        fs::write(folder.path().join("run.mcap"), "").unwrap();
        assert!(Files::new(&out, false, None, false).is_err());
        assert!(Files::new(&out, false, None, true).is_ok());
        for folder in ["folder/", "folder/run.mcap/", ".", "..", "/"] {
            assert!(
                matches!(Files::new(Path::new(folder), false, None, false), Err(Error::Usage(_))),
                "{folder}"
            );
        }

        let mut row = Files::new(&out, true, Some(2), false).unwrap();
        for number in 1..=4 {
            let path = row.advance().unwrap();
            assert_eq!(path, folder.path().join(format!("run-000{number}.mcap")));
            fs::write(&path, "").unwrap();
            assert_eq!(row.prune(), None);
        }
        let names = |files: &Files| files.kept.iter().cloned().collect::<Vec<_>>();
        assert_eq!(names(&row), [folder.path().join("run-0003.mcap"), folder.path().join("run-0004.mcap")]);
        assert_eq!((row.deleted, row.number), (2, 4));
        fs::write(folder.path().join("run-old.mcap"), "").unwrap();
        assert!(Files::new(&out, true, None, false).is_err());
        let mut again = Files::new(&out, true, None, true).unwrap();
        again.advance().unwrap();
        let left: Vec<_> =
            fs::read_dir(folder.path()).unwrap().map(|file| file.unwrap().file_name()).collect();
        assert_eq!(left.len(), 2, "run.mcap and run-old.mcap are of others: {left:?}");
    }
}
