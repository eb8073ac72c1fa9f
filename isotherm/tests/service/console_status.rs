//! `isotherm status` and `isotherm top` against a service process, as an operator runs them.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use isotherm_bus::{Consumer, Producer, ProducerOptions, SessionOptions, open, presence};
use isotherm_correction::sample::{GyroTick, OutputKind};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::key::UnitId;
use serde_json::Value;
use tokio::net::TcpSocket;

const LIMIT: Duration = Duration::from_secs(30);

fn isotherm(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_isotherm"));
    command.args(arguments).env_remove("ISOTHERM_LOG").env_remove("NO_COLOR").env("TERM", "xterm");
    command
}

fn run(arguments: &[&str]) -> Output {
    isotherm(arguments).output().unwrap()
}

fn words(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// A service process that is ended with the test.
struct Served {
    child: Child,
    locator: String,
}

impl Served {
    /// Starts it on loopback and waits until it says that it is ready.
    fn start() -> Self {
        let mut command = isotherm(&["serve", "--announce", "--listen", "tcp/127.0.0.1:0"]);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let ready: Value = serde_json::from_str(&line).unwrap();
        Self { child, locator: ready["locators"][0].as_str().unwrap().to_owned() }
    }

    /// A service with units that each gave out some ticks.
    async fn with_units(serials: &[&str]) -> Self {
        let served = Self::start();
        let options = SessionOptions { connect: vec![served.locator.clone()], ..SessionOptions::default() };
        let session = open(&options).await.unwrap();
        let mut consumer = Consumer::declare(&session, None).await.unwrap();
        presence::wait_for_service(&session, LIMIT).await.unwrap();
        for serial in serials {
            let unit = UnitId::new(serial).unwrap();
            let mut producer = Producer::declare(&session, &unit, ProducerOptions::default()).await.unwrap();
            for sequence in 0..100 {
                let tick = GyroTick {
                    sequence,
                    end_time: Timestamp::from_ns(i64::try_from(sequence + 1).unwrap() * 5_000_000),
                    duration: Span::from_ms(5),
                    readings: [1.0, 2.0, 3.0].into_iter().collect(),
                    ..GyroTick::default()
                };
                producer.gyro(OutputKind::Counts, tick).await.unwrap();
            }
            while consumer.continuity(&unit).ticks < 50 {
                tokio::time::timeout(LIMIT, consumer.next()).await.expect("in time").unwrap();
            }
        }
        served
    }

    fn ask(&self, arguments: &[&str]) -> Output {
        run(&[arguments, &["--connect", &self.locator]].concat())
    }

    /// What is printed by a command that must succeed.
    fn told(&self, arguments: &[&str]) -> String {
        let output = self.ask(arguments);
        assert_eq!(output.status.code(), Some(0), "{}", words(&output.stderr));
        words(&output.stdout)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        // Fails where it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn status_prints_units_pages_and_json() {
    let served = Served::with_units(&["STATUS-1", "STATUS-2", "STATUS-3"]).await;

    let table = served.told(&["status"]);
    for unit in ["STATUS-1", "STATUS-2", "STATUS-3"] {
        assert!(table.contains(unit), "{unit} in\n{table}");
    }
    assert!(!table.contains('\x1b'), "no colours into a pipe");
    let narrow = served.told(&["status", "--width", "80"]);
    assert!(narrow.lines().all(|line| line.chars().count() <= 80), "{narrow}");
    assert!(narrow.contains("STATUS-3"), "{narrow}");

    let two = served.told(&["status", "STATUS-1", "STATUS-3"]);
    assert!(two.contains("STATUS-1") && !two.contains("STATUS-2") && two.contains("STATUS-3"), "{two}");
    let page = served.told(&["status", "STATUS-2"]);
    assert!(page.contains("STATUS-2") && page.contains("gyro_ticks_in"), "{page}");
    assert!(!page.contains("STATUS-1"), "{page}");

    let report: Value = serde_json::from_str(&served.told(&["status", "STATUS-2", "--json"])).unwrap();
    assert_eq!(
        (report["units"].as_array().unwrap().len(), &report["units"][0]["unit"]),
        (1, &"STATUS-2".into())
    );
    assert_eq!(report["units"][0]["instance"], report["services"][0]["instance"]);
    assert_eq!(report["services"][0]["pid"], served.child.id());
    let whole: Value = serde_json::from_str(&served.told(&["status", "--json"])).unwrap();
    assert_eq!(whole["units"].as_array().unwrap().len(), 3);

    let unknown = served.ask(&["status", "STATUS-9"]);
    assert_eq!(unknown.status.code(), Some(1));
    let error = words(&unknown.stderr);
    insta::assert_snapshot!(error.replace(&served.locator, "LOCATOR"));
    assert!(unknown.stdout.is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_without_units_is_shown_too() {
    let served = Served::start();
    let text = served.told(&["status"]);
    assert!(text.starts_with("service ") && text.contains("0 units"), "{text}");
    let report: Value = serde_json::from_str(&served.told(&["status", "--json"])).unwrap();
    assert_eq!(
        (report["services"].as_array().unwrap().len(), &report["units"]),
        (1, &Value::Array(Vec::new()))
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn where_nobody_answers_it_says_so_in_time() {
    // Bound and never listening: whoever connects is refused, and no other test can be given the port.
    let taken = TcpSocket::new_v4().unwrap();
    taken.bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let locator = format!("tcp/{}", taken.local_addr().unwrap());
    for command in ["status", "swap"] {
        let start = Instant::now();
        let unit = if command == "swap" { ["U", "/dev/null"].as_slice() } else { &[] };
        let output = run(&[&[command, "--connect", &locator, "--timeout", "1"], unit].concat());
        let error = words(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{error}");
        assert!(error.contains(&locator) && error.contains("--connect"), "{error}");
        assert!(start.elapsed() < LIMIT, "{:?}", start.elapsed());
    }
}

#[test]
fn wrong_calls_are_usage() {
    for arguments in [
        ["status", "no/serial"].as_slice(),
        &["status", "--width", "3"],
        &["status", "--timeout", "0"],
        &["top", "--interval", "0"],
        &["top", "UNIT"],
    ] {
        assert_eq!(run(arguments).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn top_needs_a_terminal_and_says_what_does_not() {
    let output = run(&["top"]);
    assert_eq!(output.status.code(), Some(2));
    let error = words(&output.stderr);
    assert!(error.contains("isotherm status"), "{error}");
}

/// `top` on a terminal that `script` provides, with keys typed into it; what it wrote there.
#[cfg(target_os = "linux")]
struct Typed {
    child: Child,
    /// Process id of the shell that runs it.
    shell: String,
    screen: std::sync::mpsc::Receiver<Vec<u8>>,
    seen: String,
}

#[cfg(target_os = "linux")]
impl Typed {
    /// `None` where this system has no `script`.
    fn top(locator: &str) -> Option<Self> {
        let command = format!(
            "stty cols 100 rows 30; echo \"shell $$.\"; '{}' top --connect {locator} --interval 0.1; echo \"ended with $?, $(stty -a)\"",
            env!("CARGO_BIN_EXE_isotherm")
        );
        let mut script = Command::new("script");
        script.args(["-qfc", &command, "/dev/null"]).env("TERM", "xterm").env("SHELL", "/bin/sh");
        let child = script.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let Ok(mut child) = child else {
            eprintln!("skipped: no script(1)");
            return None;
        };
        let (sender, screen) = std::sync::mpsc::channel();
        let mut stdout = child.stdout.take().unwrap();
        std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(read) = stdout.read(&mut bytes) {
                if read == 0 || sender.send(bytes[..read].to_vec()).is_err() {
                    return;
                }
            }
        });
        let mut typed = Self { child, shell: String::new(), screen, seen: String::new() };
        typed.wait_for("shell ");
        typed.shell = typed.wait_for(".").replace('.', "");
        Some(typed)
    }

    /// Reads on until this has been written since the last time.
    fn wait_for(&mut self, words: &str) -> String {
        let deadline = Instant::now() + LIMIT;
        loop {
            if let Some(at) = self.seen.find(words) {
                return self.seen.drain(..at + words.len()).collect();
            }
            let left = deadline.saturating_duration_since(Instant::now());
            let Ok(more) = self.screen.recv_timeout(left) else { panic!("{words} in\n{:?}", self.seen) };
            self.seen.push_str(&String::from_utf8_lossy(&more));
        }
    }

    fn press(&mut self, keys: &str) {
        let stdin = self.child.stdin.as_mut().unwrap();
        stdin.write_all(keys.as_bytes()).and_then(|()| stdin.flush()).unwrap();
    }
}

#[cfg(target_os = "linux")]
impl Drop for Typed {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Enters the alternate screen, and leaves it.
#[cfg(target_os = "linux")]
const ALTERNATE: [&str; 2] = ["\x1b[?1049h", "\x1b[?1049l"];

#[cfg(target_os = "linux")]
#[test]
fn top_writes_no_sequences_to_a_dumb_terminal() {
    let command = format!("TERM=dumb '{}' top; echo \"ended with $?\"", env!("CARGO_BIN_EXE_isotherm"));
    let script = Command::new("script").args(["-qfc", &command, "/dev/null"]).stdin(Stdio::null()).output();
    let Ok(output) = script else { return eprintln!("skipped: no script(1)") };
    let told = words(&output.stdout);
    assert!(told.contains("isotherm status") && told.contains("ended with 2"), "{told}");
    assert!(!told.contains('\x1b'), "{told}");
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn top_shows_units_and_pages_and_gives_the_terminal_back() {
    let served = Served::with_units(&["TOP-1", "TOP-2"]).await;
    let Some(mut top) = Typed::top(&served.locator) else { return };
    top.wait_for(ALTERNATE[0]);
    top.wait_for("TOP-2");
    top.press("\r");
    top.wait_for("Calibration");
    top.press("q");
    top.wait_for(ALTERNATE[1]);
    top.wait_for("ended with 0");
    // Echo and lines are as they were.
    let modes = top.wait_for("echoke");
    assert!(
        ["icanon", "echo"].iter().all(|mode| modes.split_whitespace().any(|word| word == *mode)),
        "{modes}"
    );
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn top_shows_that_its_service_has_died_and_ends_on_a_signal() {
    let mut served = Served::with_units(&["TOP-1"]).await;
    let Some(mut top) = Typed::top(&served.locator) else { return };
    top.wait_for("TOP-1");
    served.child.kill().unwrap();
    top.wait_for("gone for");
    let found = Command::new("pgrep").args(["-P", &top.shell]).output().unwrap();
    let pid = words(&found.stdout).trim().to_owned();
    assert!(Command::new("kill").args(["-TERM", &pid]).status().unwrap().success());
    top.wait_for(ALTERNATE[1]);
    top.wait_for("ended with 0");
}
