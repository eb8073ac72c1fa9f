//! Where outputs may go, and files that are compressed by their name.

use std::path::{Path, PathBuf};

use isotherm_log::file::{Partial, Sink, refuse_overwriting, refuse_replacing};
use isotherm_protocol::key::UnitId;

use isotherm_log::error::Error;

/// Where outputs may go.
#[derive(Debug, Clone, Default)]
pub struct Place {
    /// Files that are there already are written over.
    pub overwrite: bool,
    /// Files that are read: none of them is ever written over.
    pub inputs: Vec<PathBuf>,
}

impl Place {
    /// Refuses a file that is there already, or is read.
    ///
    /// # Errors
    /// [`Error::Usage`].
    pub fn check(&self, path: &Path) -> Result<(), Error> {
        let inputs: Vec<_> = self.inputs.iter().map(PathBuf::as_path).collect();
        refuse_overwriting(path, &inputs)?;
        if path.exists() && !path.is_file() {
            return Err(Error::Usage(format!("{} is no file: give another name", path.display())));
        }
        refuse_replacing(path, self.overwrite)
    }

    /// Refuses a folder that has something in it, or a file in its place.
    ///
    /// # Errors
    /// [`Error::Usage`].
    pub fn check_folder(&self, path: &Path) -> Result<(), Error> {
        let name = path.display();
        if path.is_dir() {
            let empty = path.read_dir().is_ok_and(|mut entries| entries.next().is_none());
            if empty || self.overwrite {
                return Ok(());
            }
            return Err(Error::Usage(format!(
                "the folder {name} is not empty: give another name, or --overwrite (other files in it stay)"
            )));
        }
        if path.symlink_metadata().is_ok() {
            return Err(Error::Usage(format!(
                "{name} is a file, but the output is a folder: give another name"
            )));
        }
        Ok(())
    }

    /// A file to be written, with its folder.
    pub(super) fn partial(&self, path: &Path) -> Result<Partial, Error> {
        self.prepare(path)?;
        Ok(Partial::of(path))
    }

    fn prepare(&self, path: &Path) -> Result<(), Error> {
        self.check(path)?;
        if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder)
                .map_err(|source| Error::file(folder, "create the folder", source))?;
        }
        Ok(())
    }

    /// A file of text or bytes to be written, compressed where its name ends in `.gz`.
    pub(super) fn sink(&self, path: &Path) -> Result<Sink, Error> {
        self.prepare(path)?;
        Sink::create(path)
    }

    /// A whole text as a file.
    pub(super) fn write(&self, path: &Path, text: &str) -> Result<Partial, Error> {
        let mut sink = self.sink(path)?;
        sink.write(|writer| writer.write_all(text.as_bytes()))?;
        sink.finish()
    }
}

/// A unit's folder: its serial; one that begins with a dot begins with `%2E`, which no serial has, so that it is
/// neither hidden nor another folder.
pub(super) fn folder(unit: &UnitId) -> String {
    match unit.as_str().strip_prefix('.') {
        Some(rest) => format!("%2E{rest}"),
        None => unit.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_serial_leaves_its_folder() {
        let folder = |serial: &str| folder(&UnitId::new(serial).unwrap());
        assert_eq!([folder("A.1"), folder("."), folder(".."), folder(".a")], ["A.1", "%2E", "%2E.", "%2Ea"]);
    }

    #[test]
    fn what_is_not_whole_is_removed_and_what_is_there_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.csv");
        let place = Place::default();
        let mut sink = place.sink(&path).unwrap();
        sink.write(|writer| writer.write_all(b"half")).unwrap();
        drop(sink);
        assert_eq!(folder.path().read_dir().unwrap().count(), 0);
        place.write(&path, "whole").unwrap().keep().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "whole");
        let over = Place { overwrite: true, ..Place::default() };
        over.write(&path, "again").unwrap().keep().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "again");
        let input = Place { overwrite: true, inputs: vec![path.clone()] };
        let refused = [place, input].map(|place| place.sink(&path).unwrap_err().to_string());
        insta::assert_snapshot!(refused.join("\n").replace(folder.path().to_str().unwrap(), "FOLDER"));
    }
}
