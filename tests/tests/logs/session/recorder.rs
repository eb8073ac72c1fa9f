//! Recorders beside the session.

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use isotherm_tests::bench::LIMIT;
use isotherm_tests::process::program;
use zenoh::Session;

/// A key that recorders listen to last: who publishes on it knows when they hear everything.
const READY: &str = "test/ready";

/// A recorder in a process of its own.
pub(super) struct Recorder {
    child: Child,
    file: PathBuf,
}

impl Recorder {
    /// Starts one that records to a file, or to a row of files where `more` says so.
    pub(super) fn start(file: PathBuf, locators: &[String], more: &[&str]) -> Self {
        let mut command = Command::new(program("isotherm-replay"));
        command.args(["record", "--out"]).arg(&file).args(["--until-service-stops", "--json"]);
        for locator in locators {
            command.args(["--connect", locator]);
        }
        command.args(more);
        for topic in ["raw", "reference", "corrected", "status", "service", "journal", READY] {
            command.args(["--topic", topic]);
        }
        let child = command.stdout(Stdio::piped()).spawn().expect("the recorder starts");
        Self { child, file }
    }

    /// Its files so far, in their order.
    pub(super) fn files(&self) -> Vec<String> {
        let stem = self.file.file_stem().unwrap().to_str().unwrap();
        let folder = std::fs::read_dir(self.file.parent().unwrap()).unwrap();
        let paths = folder.map(|entry| entry.unwrap().path().to_str().unwrap().to_owned());
        let mut files: Vec<_> = paths.filter(|path| path.contains(&format!("/{stem}"))).collect();
        files.sort();
        files
    }

    /// Waits for its end, with the service's; nothing may be lost. Its files.
    pub(super) fn wait(mut self) -> Vec<String> {
        let mut report = String::new();
        std::io::Read::read_to_string(self.child.stdout.as_mut().unwrap(), &mut report).unwrap();
        let status = self.child.wait().unwrap();
        assert!(status.success(), "{status}: {report}");
        self.files()
    }
}

/// Waits until a recorder hears what is published on the session.
pub(super) async fn until_heard(session: &Session) {
    let ready = session.declare_publisher(READY).await.unwrap();
    let deadline = Instant::now() + LIMIT;
    while !ready.matching_status().await.unwrap().matching() {
        assert!(Instant::now() < deadline, "the recorder listens");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

/// Waits until a recorder writes its file.
pub(super) async fn until_recording(recorder: &Recorder) {
    let deadline = Instant::now() + LIMIT;
    while recorder.files().is_empty() {
        assert!(Instant::now() < deadline, "the recorder records");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}
