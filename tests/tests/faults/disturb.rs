//! A service whose clock of the day steps, and whose disk is slow or fails, while it runs: `disturb.c` stands between it and libc.

use std::fs::{self, File};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// What is done to it; `errno` of the disk, 0: none.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Trouble {
    /// By how much the clock of the day is wrong (s).
    pub(crate) clock_s: i64,
    /// How long each call that writes to the state folder takes.
    pub(crate) slow: Duration,
    /// The error that each of them ends with.
    pub(crate) disk_errno: i64,
}

/// No space left on device.
pub(crate) const ENOSPC: i64 = 28;
/// Read-only file system.
pub(crate) const EROFS: i64 = 30;
/// Input/output error.
pub(crate) const EIO: i64 = 5;

/// The library and the file that tells it what to do.
#[derive(Debug)]
pub(crate) struct Disturb {
    library: PathBuf,
    path: PathBuf,
    told: File,
    folder: PathBuf,
}

impl Disturb {
    /// Builds it, for what is written below `folder`.
    pub(crate) fn new(place: &Path, folder: &Path) -> Self {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/faults/disturb.c");
        let library = place.join("disturb.so");
        let mut compiler = Command::new("cc");
        compiler.args(["-shared", "-fPIC", "-O2", "-Wall", "-Wextra", "-Werror", "-o"]);
        let built = compiler.arg(&library).arg(source).arg("-ldl").status();
        assert!(built.expect("a C compiler, cc").success(), "it builds");
        let path = place.join("disturb");
        fs::write(&path, [0; 24]).unwrap();
        let told = File::options().write(true).open(&path).unwrap();
        Self { library, path, told, folder: folder.to_owned() }
    }

    /// Variables of a program that is to be disturbed.
    pub(crate) fn variables(&self) -> [(&'static str, &Path); 3] {
        [
            ("LD_PRELOAD", &self.library),
            ("ISOTHERM_DISTURB", &self.path),
            ("ISOTHERM_DISTURBED", &self.folder),
        ]
    }

    /// From now on.
    pub(crate) fn set(&self, trouble: Trouble) {
        let numbers = [
            trouble.clock_s * 1_000_000_000,
            i64::try_from(trouble.slow.as_micros()).unwrap(),
            trouble.disk_errno,
        ];
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_ne_bytes()).collect();
        self.told.write_all_at(&bytes, 0).unwrap();
    }
}
