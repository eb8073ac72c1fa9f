//! Writing a file so that nobody ever sees half of it.

use std::fs::{self, File, Permissions};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

/// What a file that is being written is called until it is whole: hidden, so that no reader of the folder takes it.
const PREFIX: &str = ".isotherm-";
/// Permissions of a new file before the umask takes its part.
const NEW_FILE: u32 = 0o666;

/// Writes a file anew: under a temporary name beside it, then renamed over it.
///
/// A symbolic link stays one, its target is replaced. Permissions are kept, the owner too where the caller may give
/// files away. Whatever happens on the way, the old file or the new one is there in whole.
pub(crate) fn replace(path: &Path, text: &str) -> io::Result<()> {
    let target = match path.canonicalize() {
        Err(error) if error.kind() == ErrorKind::NotFound && !path.is_symlink() => path.to_owned(),
        target => target?,
    };
    let old = match fs::metadata(&target) {
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        old => Some(old?),
    };
    if old.as_ref().is_some_and(|old| !old.is_file()) {
        return Err(io::Error::new(ErrorKind::InvalidInput, "is not a regular file"));
    }
    let file = written(&target, text, NEW_FILE)?;
    if let Some(old) = old {
        let new = file.as_file().metadata()?;
        if (old.uid(), old.gid()) != (new.uid(), new.gid()) {
            // Only root may give files away; for others the file becomes theirs, as with any editor that renames.
            let _ = fchown(file.as_file(), Some(old.uid()), Some(old.gid()));
        }
        file.as_file().set_permissions(old.permissions())?;
    }
    file.as_file().sync_all()?;
    file.persist(&target)?;
    sync(&folder_of(&target))
}

/// Writes a new file with these permissions; one of that name is left alone and is an error.
pub(crate) fn create(path: &Path, text: &str, mode: u32) -> io::Result<()> {
    let file = written(path, text, mode)?;
    file.as_file().sync_all()?;
    file.persist_noclobber(path)?;
    sync(&folder_of(path))
}

/// The text in a temporary file, in the folder where it will stay.
fn written(path: &Path, text: &str, mode: u32) -> io::Result<NamedTempFile> {
    let folder = folder_of(path);
    if !folder.is_dir() {
        let words = format!("there is no folder {}: make it first, or name another", folder.display());
        return Err(io::Error::new(ErrorKind::NotFound, words));
    }
    let mut builder = Builder::new();
    builder.prefix(PREFIX).permissions(Permissions::from_mode(mode));
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(text.as_bytes())?;
    Ok(file)
}

fn folder_of(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.map_or_else(|| PathBuf::from("."), Path::to_owned)
}

/// Makes a rename outlive a power failure. Some file systems cannot, and say that the call is invalid.
fn sync(folder: &Path) -> io::Result<()> {
    match File::open(folder)?.sync_all() {
        Err(error) if error.kind() == ErrorKind::InvalidInput => Ok(()),
        synced => synced,
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use tempfile::TempDir;

    use super::*;

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o777
    }

    fn names(folder: &TempDir) -> Vec<String> {
        let entries = fs::read_dir(folder.path()).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_replaced_file_keeps_its_permissions_and_its_links() {
        let folder = TempDir::new().unwrap();
        let [file, link] = ["file", "link"].map(|name| folder.path().join(name));
        fs::write(&file, "old").unwrap();
        fs::set_permissions(&file, Permissions::from_mode(0o640)).unwrap();
        symlink("file", &link).unwrap();
        replace(&link, "new").unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
        assert!(link.is_symlink());
        assert_eq!(mode(&file), 0o640);
        assert_eq!(names(&folder), ["file", "link"], "nothing is left over");
    }

    #[test]
    fn a_reader_sees_the_old_text_or_the_new_one_and_nothing_between() {
        let folder = TempDir::new().unwrap();
        let file = folder.path().join("file");
        let texts = ["a".repeat(100_000), "b".repeat(200_000)];
        replace(&file, &texts[0]).unwrap();
        std::thread::scope(|scope| {
            let writer = scope.spawn(|| {
                for round in 0..50 {
                    replace(&file, &texts[round % 2]).unwrap();
                }
            });
            while !writer.is_finished() {
                let text = fs::read_to_string(&file).unwrap();
                assert!(texts.contains(&text), "{} bytes", text.len());
            }
        });
    }

    #[test]
    fn the_old_file_stays_where_the_new_one_cannot_be_written() {
        let folder = TempDir::new().unwrap();
        let [nowhere, nothing] = ["nowhere/file", "nothing"].map(|name| folder.path().join(name));
        assert_eq!(replace(&nowhere, "new").unwrap_err().kind(), ErrorKind::NotFound);
        symlink("missing", &nothing).unwrap();
        assert_eq!(replace(&nothing, "new").unwrap_err().kind(), ErrorKind::NotFound, "a link to nothing");
        assert_eq!(replace(folder.path(), "new").unwrap_err().to_string(), "is not a regular file");
        assert_eq!(names(&folder), ["nothing"]);
    }

    #[test]
    fn a_new_file_never_takes_the_place_of_another() {
        let folder = TempDir::new().unwrap();
        let file = folder.path().join("file");
        create(&file, "secret", 0o600).unwrap();
        assert_eq!(mode(&file), 0o600);
        assert_eq!(create(&file, "other", 0o600).unwrap_err().kind(), ErrorKind::AlreadyExists);
        assert_eq!(fs::read_to_string(&file).unwrap(), "secret");
        assert_eq!(names(&folder), ["file"], "nothing is left over");
    }
}
