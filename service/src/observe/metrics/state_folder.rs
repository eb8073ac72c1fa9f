//! Whether the state folder can be written: without it every swap is refused.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long a trial holds.
const TRIAL_HOLDS: Duration = Duration::from_secs(2);
/// What is written for a trial: enough to need a block of the disk.
const TRIAL: [u8; 4096] = [0; 4096];

/// Tries the state folder, at most once in a while.
#[derive(Debug, Default)]
pub(super) struct StateFolder {
    tried: Option<(Instant, Result<(), String>)>,
}

impl StateFolder {
    /// Whether a file can be made and filled in the folder; why not, in words.
    pub(super) fn is_writable(&mut self, now: Instant, folder: &Path) -> Result<(), String> {
        match &self.tried {
            Some((then, outcome)) if now.saturating_duration_since(*then) < TRIAL_HOLDS => outcome.clone(),
            _ => {
                let outcome = try_to_write(folder).map_err(|error| error.to_string());
                self.tried = Some((now, outcome.clone()));
                outcome
            }
        }
    }
}

/// Writes a file that has no name and is gone at once.
fn try_to_write(folder: &Path) -> io::Result<()> {
    let folder: PathBuf = std::fs::canonicalize(folder)?;
    tempfile::tempfile_in(folder)?.write_all(&TRIAL)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_leaves_nothing_behind_and_is_not_made_anew_at_once() {
        let base = tempfile::tempdir().unwrap();
        let folder = base.path().join("state");
        let mut state = StateFolder::default();
        let start = Instant::now();
        assert!(state.is_writable(start, &folder).unwrap_err().contains("No such file"));
        std::fs::create_dir(&folder).unwrap();
        assert!(state.is_writable(start + TRIAL_HOLDS / 2, &folder).is_err());
        assert_eq!(state.is_writable(start + TRIAL_HOLDS, &folder), Ok(()));
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
    }
}
