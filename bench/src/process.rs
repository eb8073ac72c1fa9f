//! Processes that a bench starts: each is waited for by what it says, with a limit, and killed when it is dropped.

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use serde::de::DeserializeOwned;

use crate::error::Error;
use crate::machine::Usage;

/// A process.
#[derive(Debug)]
pub(crate) struct Process {
    name: &'static str,
    child: Child,
    lines: Receiver<String>,
    log: PathBuf,
}

impl Process {
    /// Starts it; what it says on stderr is kept in the folder, for the case that something goes wrong.
    pub(crate) fn start(name: &'static str, command: &mut Command, folder: &Path) -> Result<Self, Error> {
        let log = folder.join(format!("{name}.log"));
        let stderr = File::create(&log).map_err(|source| Error::file(&log, source))?;
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(stderr);
        let program = PathBuf::from(command.get_program());
        let mut child = command.spawn().map_err(|source| Error::file(&program, source))?;
        let (sender, lines) = channel();
        if let Some(stdout) = child.stdout.take() {
            // Ends with the process.
            std::thread::spawn(move || {
                let lines = BufReader::new(stdout).lines().map_while(Result::ok);
                lines.map(|line| sender.send(line)).take_while(Result::is_ok).for_each(drop);
            });
        }
        Ok(Self { name, child, lines, log })
    }

    /// The next thing that it says.
    pub(crate) fn hear<T: DeserializeOwned>(&self, limit: Duration) -> Result<T, Error> {
        let line = self.lines.recv_timeout(limit).map_err(|error| {
            self.failed(&match error {
                RecvTimeoutError::Timeout => format!("has said nothing for {limit:?}"),
                RecvTimeoutError::Disconnected => "has ended".to_owned(),
            })
        })?;
        serde_json::from_str(&line).map_err(|error| self.failed(&format!("says {line:?}: {error}")))
    }

    /// Tells it something.
    pub(crate) fn tell(&mut self, line: &str) -> Result<(), Error> {
        let told =
            self.child.stdin.as_mut().map(|stdin| writeln!(stdin, "{line}").and_then(|()| stdin.flush()));
        match told {
            Some(Ok(())) => Ok(()),
            _ => Err(self.failed("hears nothing")),
        }
    }

    /// What it has used so far.
    pub(crate) fn usage(&self) -> Result<Usage, Error> {
        Usage::of(self.child.id()).ok_or_else(|| self.failed("has ended"))
    }

    /// An error with the end of its log.
    fn failed(&self, what: &str) -> Error {
        let log = fs::read_to_string(&self.log).unwrap_or_default();
        let last: Vec<&str> = log.lines().rev().take(12).collect();
        let last: Vec<&str> = last.into_iter().rev().collect();
        Error::of(self.name)(format!("{what}\n{}", last.join("\n")))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Ended already, perhaps.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// This program.
pub(crate) fn this() -> Result<PathBuf, Error> {
    std::env::current_exe().map_err(|source| Error::file(Path::new("isotherm-bench"), source))
}

/// Another program of the project, built beside this one.
pub(crate) fn beside(name: &str) -> Result<PathBuf, Error> {
    let path = this()?.with_file_name(name);
    if path.is_file() { Ok(path) } else { Err(Error::Missing(path)) }
}
