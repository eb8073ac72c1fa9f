//! `isotherm serve --metrics` as a process.

use std::io::{BufRead, BufReader};
use std::net::{SocketAddr, TcpListener};
use std::process::{Child, Command, Output, Stdio};

use serde_json::Value;

use super::checker::Page;
use super::client::get;

fn isotherm(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_isotherm"));
    command.args(["serve", "--listen", "tcp/127.0.0.1:0"]).args(arguments).env_remove("ISOTHERM_LOG");
    command
}

/// A process that is ended with the test.
struct Served(Child);

impl Drop for Served {
    fn drop(&mut self) {
        // Fails where it has ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts it and waits until it says that it is ready.
fn start(arguments: &[&str]) -> (Served, Value) {
    let mut command = isotherm(arguments);
    let mut child = command.arg("--announce").stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    (Served(child), serde_json::from_str(&line).unwrap())
}

fn address(ready: &Value) -> SocketAddr {
    let url = ready["metrics"].as_str().unwrap();
    url.strip_prefix("http://").unwrap().parse().unwrap()
}

/// Runs it where it is to refuse at once.
fn refused(arguments: &[&str]) -> (Option<i32>, String) {
    let Output { status, stdout, stderr } = isotherm(arguments).output().unwrap();
    assert!(stdout.is_empty());
    (status.code(), String::from_utf8(stderr).unwrap())
}

#[test]
fn the_announced_line_and_the_ready_file_say_where_metrics_are() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("ready.json");
    let (_served, ready) = start(&["--metrics", "127.0.0.1:0", "--ready-file", file.to_str().unwrap()]);
    let metrics = address(&ready);
    assert_ne!(metrics.port(), 0);
    Page::read(&get(metrics, "/metrics").body).unwrap();
    let text = loop {
        if let Ok(text) = std::fs::read_to_string(&file) {
            break text;
        }
        std::thread::yield_now();
    };
    assert_eq!(serde_json::from_str::<Value>(&text).unwrap(), ready);

    let (_without, ready) = start(&[]);
    assert_eq!(ready.get("metrics"), None, "opt-in");
}

#[test]
fn the_option_replaces_the_configured_address() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("service.toml");
    std::fs::write(&config, format!("[metrics]\nlisten = \"{}\"\n", taken.local_addr().unwrap())).unwrap();
    let config = config.to_str().unwrap();
    let (_served, ready) = start(&["--config", config, "--metrics", "[::1]:0"]);
    assert!(address(&ready).is_ipv6());
    let (code, stderr) = refused(&["--config", config]);
    assert_eq!(code, Some(1), "{stderr}");
}

#[test]
fn a_second_service_on_the_same_port_does_not_start() {
    let (_first, ready) = start(&["--metrics", "127.0.0.1:0"]);
    let address = address(&ready).to_string();
    let (code, stderr) = refused(&["--metrics", &address]);
    assert_eq!(code, Some(1), "{stderr}");
    insta::assert_snapshot!(stderr.lines().last().unwrap().replace(&address, "ADDRESS"));
}

#[test]
fn an_address_that_others_could_reach_is_refused() {
    let (code, stderr) = refused(&["--metrics", "0.0.0.0:0"]);
    assert_eq!(code, Some(78), "{stderr}");
    let mut told = stderr.lines().last().unwrap().to_owned() + "\n";
    let (code, stderr) = refused(&["--metrics", "9464"]);
    assert_eq!(code, Some(2), "{stderr}");

    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("service.toml");
    std::fs::write(&config, "[metrics]\nlisten = \"0.0.0.0:0\"\n").unwrap();
    let (code, stderr) = refused(&["--config", config.to_str().unwrap()]);
    assert_eq!(code, Some(78), "{stderr}");
    told += &stderr;
    insta::assert_snapshot!(told.replace(folder.path().to_str().unwrap(), "FOLDER"));
}
