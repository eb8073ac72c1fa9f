//! The project's programs as separate processes.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::Once;
use std::time::Duration;

/// Path of a program of the project, built with the profile of the running test.
///
/// # Panics
/// Where it cannot be built.
#[must_use]
pub fn program(name: &str) -> PathBuf {
    static BUILD: Once = Once::new();
    let test = std::env::current_exe().expect("the running test has a path");
    let folder =
        test.parent().and_then(|deps| deps.parent()).expect("target/PROFILE/deps/TEST").to_path_buf();
    // `cargo test` builds the programs of tested packages only; a test of this package alone needs them too.
    BUILD.call_once(|| {
        let target = folder.parent().expect("target/PROFILE");
        let mut cargo = Command::new(env!("CARGO"));
        // The whole workspace, so that the dependencies have the features that they have under test.
        cargo.args(["build", "--quiet", "--workspace", "--bins"]);
        cargo.arg("--target-dir").arg(target).current_dir(crate::data::root());
        // What `cargo test` says of this package would look like a change to build scripts that ask for it, such as that of
        // `ring`: it would be built anew each time, and all of Zenoh with it.
        for (name, _) in std::env::vars_os() {
            if name
                .to_str()
                .is_some_and(|name| name.starts_with("CARGO_PKG_") || name.starts_with("CARGO_MANIFEST_"))
            {
                cargo.env_remove(name);
            }
        }
        if folder.ends_with("release") {
            cargo.arg("--release");
        }
        assert!(cargo.status().expect("cargo runs").success(), "the programs build");
    });
    folder.join(name)
}

/// Runs a program to its end.
///
/// # Panics
/// Where it cannot be started.
#[must_use]
pub fn run(name: &str, arguments: &[&str]) -> Output {
    Command::new(program(name))
        .args(arguments)
        .current_dir(crate::data::root())
        .output()
        .expect("the program starts")
}

/// Runs a program that must succeed; what it printed on stdout.
///
/// # Panics
/// With what it printed on stderr, where it fails.
#[expect(clippy::must_use_candidate, reason = "many a run is made for what it does")]
pub fn run_well(name: &str, arguments: &[&str]) -> String {
    let output = run(name, arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name} {}: {}\n{stderr}", arguments.join(" "), output.status);
    String::from_utf8(output.stdout).expect("stdout is text")
}

/// Sends a signal to a process.
///
/// # Panics
/// Where it cannot be sent.
pub fn send_signal(child: &Child, signal: &str) {
    let sent = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status();
    assert!(sent.is_ok_and(|status| status.success()), "SIG{signal} is sent");
}

/// What the system says of a process.
///
/// # Panics
/// Where it is gone.
#[must_use]
pub fn resources(id: u32) -> Resources {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).expect("the process is there");
    let value = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
        line.and_then(|line| line.split_whitespace().next()?.parse().ok()).expect("a number")
    };
    let descriptors = std::fs::read_dir(format!("/proc/{id}/fd")).expect("the process is there").count();
    let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).expect("the process is there");
    // Behind the name, which may hold anything: user and system time are the 12th and 13th, in hundredths of a second.
    let times = stat.rsplit(')').next().into_iter().flat_map(str::split_whitespace).skip(11).take(2);
    let hundredths: u64 = times.map(|time| time.parse::<u64>().expect("a number")).sum();
    Resources {
        resident_kb: value("VmRSS"),
        data_kb: value("VmData"),
        threads: value("Threads"),
        descriptors,
        cpu: Duration::from_millis(hundredths * 10),
    }
}

/// The number that the next descriptor of a process would have.
///
/// # Panics
/// Where it is gone.
#[must_use]
pub fn next_descriptor(id: u32) -> usize {
    let folder = PathBuf::from(format!("/proc/{id}/fd"));
    assert!(folder.exists(), "the process is there");
    (0..65_536)
        .find(|number| std::fs::symlink_metadata(folder.join(number.to_string())).is_err())
        .unwrap_or(0)
}

/// What a process uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Resources {
    /// Resident memory (kB).
    pub resident_kb: u64,
    /// Memory of its own that it may write (kB).
    pub data_kb: u64,
    /// Threads.
    pub threads: u64,
    /// Open descriptors.
    pub descriptors: usize,
    /// Time that it has computed.
    pub cpu: Duration,
}

/// `isotherm serve` in a process of its own; killed when dropped.
#[derive(Debug)]
pub struct Service {
    child: Child,
    /// Where it listens; empty where it is a client.
    pub locator: String,
}

impl Service {
    /// Starts it on a port of the system's choice and waits until it says that it is ready.
    ///
    /// # Panics
    /// Where it does not.
    #[must_use]
    pub fn start(arguments: &[&str]) -> Self {
        Self::start_as_configured(&[&["--listen", "tcp/127.0.0.1:0"], arguments].concat())
    }

    /// Starts it where its configuration says.
    ///
    /// # Panics
    /// Where it does not start.
    #[must_use]
    pub fn start_as_configured(arguments: &[&str]) -> Self {
        Self::start_in(&crate::data::root(), arguments)
    }

    /// The same, in another folder.
    ///
    /// # Panics
    /// Where it does not start.
    #[must_use]
    pub fn start_in(folder: &Path, arguments: &[&str]) -> Self {
        Self::start_among(folder, arguments, &[])
    }

    /// The same, with these variables.
    ///
    /// # Panics
    /// Where it does not start.
    #[must_use]
    pub fn start_among(folder: &Path, arguments: &[&str], variables: &[(&str, &Path)]) -> Self {
        let mut child = Command::new(program("isotherm"))
            .args(["serve", "--announce", "--json"])
            .args(arguments)
            .envs(variables.iter().copied())
            .current_dir(folder)
            .stdout(Stdio::piped())
            .spawn()
            .expect("the service starts");
        let mut line = String::new();
        let stdout = child.stdout.as_mut().expect("stdout is piped");
        // One byte at a time: what follows the line belongs to `stop`.
        BufReader::with_capacity(1, stdout).read_line(&mut line).expect("stdout is read");
        let ready: serde_json::Value = serde_json::from_str(&line).expect("one line of JSON");
        let locator = ready["locators"][0].as_str().unwrap_or_default().to_owned();
        Self { child, locator }
    }

    /// Sends it a signal.
    ///
    /// # Panics
    /// Where it cannot be sent.
    pub fn signal(&self, signal: &str) {
        send_signal(&self.child, signal);
    }

    /// Its process.
    #[must_use]
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Whether it has ended by itself.
    ///
    /// # Panics
    /// Where that cannot be found out.
    pub fn has_ended(&mut self) -> bool {
        self.child.try_wait().expect("it is a child").is_some()
    }

    /// Sets a limit of the running process, as `prlimit` writes it.
    ///
    /// # Panics
    /// Where that is not allowed.
    pub fn limit(&self, limit: &str) {
        let set = Command::new("prlimit").args(["--pid", &self.id().to_string(), limit]).status();
        assert!(set.is_ok_and(|status| status.success()), "prlimit {limit}");
    }

    /// Ends it as a crash would, in the middle of whatever it does.
    pub fn kill(self) {
        drop(self);
    }

    /// Asks it to stop as an operator would; how it ended and what it said of its totals.
    ///
    /// # Panics
    /// Where it cannot be asked.
    #[must_use]
    pub fn stop(mut self) -> (ExitStatus, String) {
        self.signal("TERM");
        let mut totals = String::new();
        let stdout = self.child.stdout.as_mut().expect("stdout is piped");
        std::io::Read::read_to_string(stdout, &mut totals).expect("stdout is read");
        (self.child.wait().expect("the service ends"), totals)
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        // Ended already after `stop`.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
