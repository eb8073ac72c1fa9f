//! `isotherm serve` as a process: readiness, signals, exit codes, totals, log.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpListener;
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use std::time::Duration;

use isotherm_bus::{Consumer, Producer, ProducerOptions, SessionOptions, open, presence};
use isotherm_correction::sample::{GyroTick, OutputKind};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::key::{self, RawStream, UnitId};
use serde_json::Value;
use zenoh::Session;

use super::metrics::client::get;

const LIMIT: Duration = Duration::from_secs(30);

fn isotherm(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_isotherm"));
    command.args(arguments).env_remove("ISOTHERM_LOG");
    command
}

/// A service process that is ended with the test.
pub(crate) struct Served {
    child: Child,
    stdout: BufReader<ChildStdout>,
    pub(crate) locators: Vec<String>,
}

impl Served {
    /// Starts it on loopback and waits until it says that it is ready.
    pub(crate) fn start(arguments: &[&str]) -> Self {
        Self::start_with(arguments, Stdio::piped())
    }

    fn start_with(arguments: &[&str], stderr: Stdio) -> Self {
        let mut command = isotherm(&["serve", "--announce", "--listen", "tcp/127.0.0.1:0"]);
        let mut child = command.args(arguments).stdout(Stdio::piped()).stderr(stderr).spawn().unwrap();
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        let (sender, read) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let mut line = String::new();
            stdout.read_line(&mut line).unwrap();
            let _ = sender.send((line, stdout));
        });
        let Ok((line, stdout)) = read.recv_timeout(LIMIT) else {
            child.kill().unwrap();
            panic!("not ready in time");
        };
        let ready: Value = serde_json::from_str(&line).unwrap();
        assert_eq!(ready["ready"], true);
        let locators =
            ready["locators"].as_array().unwrap().iter().map(|l| l.as_str().unwrap().to_owned()).collect();
        Self { child, stdout, locators }
    }

    async fn session(&self) -> Session {
        open(&SessionOptions { connect: self.locators.clone(), ..SessionOptions::default() }).await.unwrap()
    }

    /// Sends a signal and waits for the end: exit code, rest of stdout, stderr.
    pub(crate) fn stop(mut self, signal: &str) -> (Option<i32>, String, String) {
        kill(signal, &self.child);
        let (mut stdout, mut stderr) = (String::new(), String::new());
        self.stdout.read_to_string(&mut stdout).unwrap();
        if let Some(mut pipe) = self.child.stderr.take() {
            pipe.read_to_string(&mut stderr).unwrap();
        }
        (self.child.wait().unwrap().code(), stdout, stderr)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        // Fails where it has ended already, as it should have.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

async fn produce(session: &Session, unit: &UnitId, ticks: u64) {
    let mut producer = Producer::declare(session, unit, ProducerOptions::default()).await.unwrap();
    for sequence in 0..ticks {
        let tick = GyroTick {
            sequence,
            end_time: Timestamp::from_ns(i64::try_from(sequence + 1).unwrap() * 5_000_000),
            duration: Span::from_ms(5),
            readings: [1.0, 2.0, 3.0].into_iter().collect(),
            ..GyroTick::default()
        };
        producer.gyro(OutputKind::Counts, tick).await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_signal_ends_it_cleanly_with_every_tick_given_out() {
    for signal in ["-TERM", "-INT"] {
        let served = Served::start(&["--json"]);
        let session = served.session().await;
        let mut consumer = Consumer::declare(&session, None).await.unwrap();
        presence::wait_for_service(&session, LIMIT).await.unwrap();
        let unit = UnitId::new("PROCESS-1").unwrap();
        produce(&session, &unit, 100).await;
        // Once something has come back the rest is on its way in; the signal comes in the middle of it.
        let first = tokio::time::timeout(LIMIT, consumer.next()).await.expect("in time").unwrap();
        let before: u64 = first.ticks.len() as u64;
        let (code, stdout, stderr) = served.stop(signal);
        assert_eq!(code, Some(0), "{stderr}");
        let totals: Value = serde_json::from_str(&stdout).unwrap();
        let account = &totals["units"]["PROCESS-1"];
        assert!(account["ticks_in"].as_u64().unwrap() >= before);
        assert_eq!(account["ticks_in"], account["ticks_out"], "{stdout}");
        assert_eq!((&account["gaps"], &account["bad"]), (&Value::from(0), &Value::from(0)));
        let out = account["ticks_out"].as_u64().unwrap();
        while consumer.continuity(&unit).ticks < out {
            tokio::time::timeout(LIMIT, consumer.next()).await.expect("in time").unwrap();
        }
        assert!(consumer.continuity(&unit).is_whole());
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn it_serves_before_what_it_connects_to_is_there_and_finds_it_then() {
    let free = TcpListener::bind("127.0.0.1:0").and_then(|listener| listener.local_addr()).unwrap();
    let other = format!("tcp/{free}");
    let served = Served::start(&["--connect", &other]);
    presence::wait_for_service(&served.session().await, LIMIT).await.unwrap();
    let options = SessionOptions { listen: vec![other], ..SessionOptions::default() };
    let later = open(&options).await.unwrap();
    presence::wait_for_service(&later, LIMIT).await.unwrap();
    let (code, _, stderr) = served.stop("-TERM");
    assert_eq!(code, Some(0), "{stderr}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_repeated_fault_is_logged_once_and_the_table_counts_it() {
    let served = Served::start(&["--log-format", "json"]);
    let session = served.session().await;
    let unit = UnitId::new("NOISY").unwrap();
    let mut consumer = Consumer::declare(&session, None).await.unwrap();
    presence::wait_for_service(&session, LIMIT).await.unwrap();
    produce(&session, &unit, 1).await;
    for _ in 0..500 {
        session.put("imu/NOISY/raw/gyro", &[0; 40]).await.unwrap();
    }
    // Of lower priority than none of the above: once this has come back, they have been read.
    produce(&session, &unit, 100).await;
    while consumer.continuity(&unit).ticks < 60 {
        tokio::time::timeout(LIMIT, consumer.next()).await.expect("in time").unwrap();
    }
    presence::wait_for_service(&session, LIMIT).await.unwrap();
    let (code, stdout, stderr) = served.stop("-TERM");
    assert_eq!(code, Some(0), "{stderr}");
    assert!(
        stdout
            .lines()
            .any(|line| { line.contains("NOISY") && line.split_whitespace().any(|cell| cell == "500") }),
        "{stdout}"
    );
    let events: Vec<Value> = stderr.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let bad = events.iter().filter(|event| event["kind"] == "bad_frames_kind").count();
    assert_eq!(bad, 1, "{stderr}");
    assert!(events.iter().any(|event| event["message"] == "ready"), "{stderr}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_log_that_nobody_reads_costs_no_tick_and_does_not_hold_up_the_end() {
    // As much as a pipe takes: the first line of the log waits for a reader that never comes.
    let (unread, mut full) = std::io::pipe().unwrap();
    full.write_all(&vec![b'.'; 65_536]).unwrap();
    let served = Served::start_with(&["--json", "--log-level", "debug"], full.into());
    let session = served.session().await;
    let mut consumer = Consumer::declare(&session, None).await.unwrap();
    presence::wait_for_service(&session, LIMIT).await.unwrap();
    let units = ["A", "B", "C"].map(|serial| UnitId::new(serial).unwrap());
    for unit in &units {
        produce(&session, unit, 200).await;
        // Each of a kind that is logged.
        session.put(key::raw(unit, RawStream::Gyro), &[0; 40]).await.unwrap();
        while consumer.continuity(unit).ticks < 200 {
            tokio::time::timeout(LIMIT, consumer.next()).await.expect("at its rate").unwrap();
        }
        assert!(consumer.continuity(unit).is_whole());
    }
    let end = tokio::task::spawn_blocking(|| served.stop("-TERM"));
    let (code, stdout, _) = tokio::time::timeout(LIMIT, end).await.expect("ends all the same").unwrap();
    assert_eq!(code, Some(0), "{stdout}");
    drop(unread);
}

/// Sends a signal.
fn kill(signal: &str, child: &Child) {
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_hangup_has_a_daemon_read_its_documents_again() {
    let folder = tempfile::tempdir().unwrap();
    let text = include_str!("../../../config/calibration/example-full.toml");
    let (file, config) = (folder.path().join("a.toml"), folder.path().join("service.conf"));
    std::fs::write(&file, text).unwrap();
    std::fs::write(&config, "calibrations = \".\"\n").unwrap();
    let served = Served::start(&["--config", config.to_str().unwrap()]);
    let session = served.session().await;
    let changed = text.to_owned() + "# changed\n";
    std::fs::write(&file, &changed).unwrap();
    let deadline = std::time::Instant::now() + LIMIT;
    loop {
        kill("-HUP", &served.child);
        let replies = session.get("imu/EXAMPLE-0001/calibration").await.unwrap();
        if let Ok(reply) = replies.recv_async().await
            && let Ok(sample) = reply.into_result()
            && sample.payload().to_bytes() == changed.as_bytes()
        {
            break;
        }
        assert!(std::time::Instant::now() < deadline, "not read again");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    let (code, _, stderr) = served.stop("-TERM");
    assert_eq!(code, Some(0), "{stderr}");
    assert!(stderr.contains("read again"), "{stderr}");
}

#[test]
fn a_client_without_its_router_says_what_it_waits_for_and_can_be_stopped() {
    let nobody = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let zenoh = folder.path().join("client.json5");
    let shipped = include_str!("../../../config/zenoh/client.json5");
    std::fs::write(&zenoh, shipped.replace("127.0.0.1:7447", &nobody.to_string())).unwrap();
    let mut command =
        isotherm(&["serve", "--metrics", "127.0.0.1:0", "--zenoh-config", zenoh.to_str().unwrap()]);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let (sender, said) = std::sync::mpsc::channel();
    std::thread::spawn(move || lines.map_while(Result::ok).for_each(|line| drop(sender.send(line))));
    let mut address = None;
    loop {
        let line = said.recv_timeout(LIMIT).expect("a line that says what it waits for");
        if let Some((_, rest)) = line.split_once("metrics on http://") {
            address = rest.split_once('/').map(|(address, _)| address.parse().unwrap());
        }
        if line.contains("waiting for") {
            assert!(line.contains(&format!("tcp/{nobody}")), "{line}");
            break;
        }
    }
    let address = address.expect("metrics come first");
    assert_eq!(get(address, "/livez").status, 200);
    let answer = get(address, "/readyz");
    assert!(answer.status == 503 && answer.body.contains(&nobody.to_string()), "{answer:?}");
    kill("-TERM", &child);
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

fn run(arguments: &[&str]) -> Output {
    isotherm(arguments).output().unwrap()
}

#[test]
fn a_bad_configuration_ends_it_with_78_and_every_problem() {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("service.toml");
    std::fs::write(&config, "max_units = 0\nstop_timeout_ms = 1\n").unwrap();
    let output = run(&["serve", "--config", config.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(78));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(
        stderr.contains("service.toml:1:13: max_units")
            && stderr.contains("service.toml:2:19: stop_timeout_ms"),
        "{stderr}"
    );
    assert!(output.stdout.is_empty());
}

#[test]
fn strict_start_refuses_bad_documents_and_names_every_problem() {
    let folder = tempfile::tempdir().unwrap();
    let units = folder.path().join("units");
    std::fs::create_dir(&units).unwrap();
    let good = include_str!("../../../config/calibration/example-full.toml");
    std::fs::write(units.join("a.toml"), good).unwrap();
    std::fs::write(units.join("b.toml"), good).unwrap();
    std::fs::write(units.join("c.toml"), "schema = 1\nunit = 7\n").unwrap();
    std::fs::write(units.join(".hidden.toml"), "nonsense").unwrap();
    std::fs::write(units.join("notes.txt"), "nonsense").unwrap();
    let config = folder.path().join("service.toml");
    std::fs::write(&config, "calibrations = \"units\"\nstrict_start = true\n").unwrap();
    let output = run(&["serve", "--config", config.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(78));
    let stderr = String::from_utf8_lossy(&output.stderr);
    for expected in ["a.toml:1:1: unit: ", "b.toml:1:1: unit: ", "c.toml:2:8: unit: "] {
        assert!(stderr.contains(expected), "{expected} in {stderr}");
    }
    assert!(!stderr.contains("hidden") && !stderr.contains("notes"), "{stderr}");
}

#[test]
fn a_start_without_its_port_leaves_no_state_folder_behind() {
    let holder = TcpListener::bind("127.0.0.1:0").unwrap();
    let (taken, folder) = (holder.local_addr().unwrap().to_string(), tempfile::tempdir().unwrap());
    let state = folder.path().join("state");
    let listen = ["serve", "--listen", "127.0.0.1:0"];
    let arguments = [&listen[..], &["--metrics", &taken, "--state", state.to_str().unwrap()]].concat();
    assert_eq!((run(&arguments).status.code(), state.exists()), (Some(1), false));
}

#[test]
fn the_ready_file_says_where() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ready.json");
    let served = Served::start(&["--ready-file", file.to_str().unwrap()]);
    // Written before or after the announced line, never half.
    let text = loop {
        if let Ok(text) = std::fs::read_to_string(&file) {
            break text;
        }
        std::thread::yield_now();
    };
    let ready: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(ready["locators"][0].as_str(), Some(served.locators[0].as_str()));
    assert_eq!(served.stop("-INT").0, Some(0));
}

#[test]
fn a_wrong_call_is_usage_and_completions_are_printed() {
    assert_eq!(run(&["serve", "--no-such-option"]).status.code(), Some(2));
    assert_eq!(run(&["serve", "--log-level", "no=such=level"]).status.code(), Some(2));
    for shell in ["bash", "zsh", "fish"] {
        let output = run(&["completions", shell]);
        assert_eq!(output.status.code(), Some(0));
        assert!(String::from_utf8_lossy(&output.stdout).contains("isotherm"), "{shell}");
    }
}
