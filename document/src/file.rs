//! Files as text, or what keeps them from being read as such; and files written so that nobody ever sees half of them.

use std::fs::{self, File, Permissions};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt, PermissionsExt, fchown};
use std::path::{Path, PathBuf, absolute};
use std::thread;
use std::time::{Duration, Instant};

use rustix::fs::OFlags;
use tempfile::{Builder, NamedTempFile};

use crate::looks::doubt;
use crate::problem::{Lines, Problem};
use crate::text::{MAX_BYTES, unplaced};

/// How long somebody who writes to a pipe is waited for, and how often a pipe is looked at.
const PIPE_LIMIT: Duration = Duration::from_secs(1);
const PIPE_INTERVAL: Duration = Duration::from_millis(10);

/// Reads a file up to one byte more than a text may have, so that a wrong file cannot fill the memory. A pipe is read to its end, however
/// long its writer takes.
///
/// # Errors
/// That of the file; a pipe that nobody writes to.
pub fn read_bounded(file: &Path) -> io::Result<Vec<u8>> {
    // Otherwise opening a pipe waits for its writer for ever.
    let no_wait = OFlags::NONBLOCK.bits().cast_signed();
    let opened = File::options().read(true).custom_flags(no_wait).open(file)?;
    let mut may_lack_writer = opened.metadata()?.file_type().is_fifo();
    let deadline = Instant::now() + PIPE_LIMIT;
    let mut bytes = Vec::new();
    loop {
        let room = MAX_BYTES + 1 - bytes.len();
        match (&opened).take(room as u64).read_to_end(&mut bytes) {
            Ok(0) if may_lack_writer && Instant::now() >= deadline => {
                return Err(io::Error::other("it is a pipe that nobody writes to"));
            }
            Ok(0) if may_lack_writer => {}
            Ok(_) => return Ok(bytes),
            Err(error) if error.kind() == ErrorKind::WouldBlock => may_lack_writer = false,
            Err(error) => return Err(error),
        }
        thread::sleep(PIPE_INTERVAL);
    }
}

/// Refuses a pipe or a device under the name of a file: to open or read it might wait for ever. What is not there is no problem here.
///
/// # Errors
/// What the file is instead.
pub fn check_regular(file: &Path) -> io::Result<()> {
    match fs::metadata(file) {
        Ok(found) if !found.is_file() => Err(io::Error::other("it is a folder, pipe or device, not a file")),
        _ => Ok(()),
    }
}

/// Bytes as text, as they were read by [`read_bounded`] or came over the bus.
///
/// # Errors
/// The one problem of what is too long, or not UTF-8: the place of the first bytes that are not.
pub fn text<'b>(bytes: &'b [u8], file: Option<&str>) -> Result<&'b str, Vec<Problem>> {
    if bytes.len() > MAX_BYTES {
        let message = format!("is longer than {MAX_BYTES} bytes: {}", doubt(bytes));
        return Err(vec![unplaced(file, message)]);
    }
    std::str::from_utf8(bytes).map_err(|error| {
        let valid = error.valid_up_to();
        let before =
            bytes.get(..valid).and_then(|before| std::str::from_utf8(before).ok()).unwrap_or_default();
        let (line, column) = Lines::new(before).position(valid);
        let message = format!("is not UTF-8 at byte {valid}: {}", doubt(bytes));
        vec![Problem { line, column, ..unplaced(file, message) }]
    })
}

/// Whether two names are of one file. Of two files that do not exist yet, one is the other where their names are.
#[must_use]
pub fn are_one(one: &Path, other: &Path) -> bool {
    let resolved = |path: &Path| path.canonicalize().or_else(|_| absolute(path)).ok();
    resolved(one).is_some_and(|one| resolved(other) == Some(one))
}

/// Whether a name is taken, by a link that leads nowhere too; a device or a pipe is written to as it is.
#[must_use]
pub fn is_taken(path: &Path) -> bool {
    path.is_file() || path.is_dir() || (path.is_symlink() && !path.exists())
}

/// What a file that is being written is called until it is whole: hidden, so that no reader of the folder takes it.
const PREFIX: &str = ".isotherm-";
/// Permissions of a new file before the umask takes its part.
pub const NEW_FILE: u32 = 0o666;

/// Writes a file anew: under a temporary name beside it, then renamed over it.
///
/// A symbolic link stays one, its target is replaced. Permissions are kept, the owner too where the caller may give
/// files away. Whatever happens on the way, the old file or the new one is there in whole.
///
/// # Errors
/// That of the folder or the disk; what is no regular file is left alone.
pub fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let old = match fs::metadata(path) {
        Err(error) if error.kind() == ErrorKind::NotFound && !path.is_symlink() => None,
        old => Some(old?),
    };
    if old.as_ref().is_some_and(|old| !old.is_file()) {
        return Err(io::Error::new(ErrorKind::InvalidInput, "is not a regular file"));
    }
    let target = if old.is_some() { path.canonicalize()? } else { path.to_owned() };
    let file = written(&target, bytes, NEW_FILE)?;
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

/// Writes a file anew, as [`replace`]; a pipe or a device is written to as it is.
///
/// # Errors
/// That of the file, the folder or the disk.
pub fn write_over(path: &Path, bytes: &[u8]) -> io::Result<()> {
    if path.exists() && !path.is_file() { fs::write(path, bytes) } else { replace(path, bytes) }
}

/// Writes a new file with these permissions; one of that name is left alone and is an error.
///
/// # Errors
/// That of the folder or the disk.
pub fn create(path: &Path, bytes: &[u8], mode: u32) -> io::Result<()> {
    let file = written(path, bytes, mode)?;
    file.as_file().sync_all()?;
    file.persist_noclobber(path)?;
    sync(&folder_of(path))
}

/// The bytes in a temporary file, in the folder where it will stay.
fn written(path: &Path, bytes: &[u8], mode: u32) -> io::Result<NamedTempFile> {
    let folder = folder_of(path);
    if !folder.is_dir() {
        let words = format!("there is no folder {}: make it first, or name another", folder.display());
        return Err(io::Error::new(ErrorKind::NotFound, words));
    }
    let mut builder = Builder::new();
    builder.prefix(PREFIX).permissions(Permissions::from_mode(mode));
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(bytes)?;
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
    use std::process::Command;

    use tempfile::TempDir;

    use super::*;

    #[test]
    fn what_is_no_text_has_one_problem() {
        let words = |bytes: &[u8]| text(bytes, Some("f")).unwrap_err()[0].to_string();
        assert_eq!(text("°".as_bytes(), Some("f")), Ok("°"));
        let long = vec![b'#'; MAX_BYTES + 1];
        insta::assert_snapshot!(
            [b"a = 1\n\xff".as_slice(), &long, b"\x89MCAP0\r\n\xff"].map(words).join("\n")
        );
        let zero = read_bounded(Path::new("/dev/zero")).unwrap();
        assert_eq!(zero.len(), MAX_BYTES + 1);
    }

    #[test]
    fn a_pipe_is_read_as_its_writer_writes_and_refused_without_one() {
        let folder = TempDir::new().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        assert_eq!(read_bounded(&pipe).unwrap_err().to_string(), "it is a pipe that nobody writes to");
        let slow = "exec 3>\"$0\"; sleep 1.2; echo one >&3; sleep 0.2; echo two >&3";
        let mut writer = Command::new("sh").args(["-c", slow]).arg(&pipe).spawn().unwrap();
        assert_eq!(read_bounded(&pipe).unwrap(), b"one\ntwo\n");
        assert!(writer.wait().unwrap().success());
    }

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
        replace(&link, b"new").unwrap();
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
        replace(&file, texts[0].as_bytes()).unwrap();
        thread::scope(|scope| {
            let writer = scope.spawn(|| {
                for round in 0..50 {
                    replace(&file, texts[round % 2].as_bytes()).unwrap();
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
        assert_eq!(replace(&nowhere, b"new").unwrap_err().kind(), ErrorKind::NotFound);
        symlink("missing", &nothing).unwrap();
        assert_eq!(replace(&nothing, b"new").unwrap_err().kind(), ErrorKind::NotFound, "a link to nothing");
        assert_eq!(replace(folder.path(), b"new").unwrap_err().to_string(), "is not a regular file");
        assert_eq!(names(&folder), ["nothing"]);
    }

    #[test]
    fn a_new_file_never_takes_the_place_of_another() {
        let folder = TempDir::new().unwrap();
        let file = folder.path().join("file");
        create(&file, b"secret", 0o600).unwrap();
        assert_eq!(mode(&file), 0o600);
        assert_eq!(create(&file, b"other", 0o600).unwrap_err().kind(), ErrorKind::AlreadyExists);
        assert_eq!(fs::read_to_string(&file).unwrap(), "secret");
        assert_eq!(names(&folder), ["file"], "nothing is left over");
    }
}
