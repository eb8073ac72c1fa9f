//! `isotherm-replay play` as a program, into a service of its own or to a listener.

mod endings;
mod faults;
mod keys;
mod lossless;
mod recordings;

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use isotherm_bus::{SessionOptions, locators, open};
use isotherm_tests::bench::LIMIT;
use isotherm_tests::data::root;
use isotherm_tests::process::{Service, program, run_well};
use serde_json::Value;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

/// Simulates a log of a preset into a folder: its path and its mapping's.
fn simulated(folder: &Path, preset: &str, seconds: u32) -> [String; 2] {
    let [log, mapping] =
        ["log.csv", "log.mapping.toml"].map(|name| folder.join(name).to_str().unwrap().to_owned());
    let seconds = seconds.to_string();
    run_well("isotherm-replay", &["simulate", "--preset", preset, "--duration", &seconds, "--out", &log]);
    [log, mapping]
}

/// Begins to play; what it says is kept.
fn begin(arguments: &[&str]) -> Child {
    Command::new(program("isotherm-replay"))
        .arg("play")
        .args(arguments)
        .current_dir(root())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the player starts")
}

/// The summary of a player that ended with this exit code.
fn summary(output: &Output, code: i32) -> Value {
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{errors}");
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {errors}"))
}

/// A service with the shipped configuration and documents.
fn service() -> Service {
    Service::start(&["--config", "config/service.toml"])
}

/// Somebody who listens to everything that is played, in a session that others can connect to.
struct Listener {
    session: Session,
    _subscriber: Subscriber<()>,
    heard: UnboundedReceiver<(String, Vec<u8>)>,
}

impl Listener {
    async fn new() -> Self {
        let session = open(&SessionOptions::default()).await.unwrap();
        let (sender, heard) = unbounded_channel();
        let subscriber = session
            .declare_subscriber("imu/**")
            .callback(move |sample| {
                let key = sample.key_expr().as_str().to_owned();
                let _ = sender.send((key, sample.payload().to_bytes().into_owned()));
            })
            .await
            .unwrap();
        Self { session, _subscriber: subscriber, heard }
    }

    /// Plays to it, without anything coming back: the summary, and every message in its order.
    async fn play(&mut self, arguments: &[&str]) -> (Value, Vec<(String, Vec<u8>)>) {
        let locator = locators(&self.session).remove(0);
        let arguments: Vec<_> = arguments
            .iter()
            .copied()
            .chain(["--connect", &locator, "--no-acknowledge", "--json"])
            .map(str::to_owned)
            .collect();
        let played = tokio::task::spawn_blocking(move || {
            let arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
            begin(&arguments).wait_with_output().unwrap()
        });
        let summary = summary(&played.await.unwrap(), 0);
        let sent = usize::try_from(summary["messages_sent"].as_u64().unwrap()).unwrap();
        let mut heard = Vec::new();
        while heard.len() < sent {
            let message = tokio::time::timeout(LIMIT, self.heard.recv()).await;
            heard.push(message.unwrap_or_else(|_| panic!("{} of {sent} messages", heard.len())).unwrap());
        }
        assert!(self.heard.try_recv().is_err(), "none more than {sent}");
        (summary, heard)
    }
}

/// Waits for a blocking call elsewhere, not longer than the limit.
async fn in_time<T: Send + 'static>(limit: Duration, work: impl FnOnce() -> T + Send + 'static) -> T {
    let work = tokio::task::spawn_blocking(work);
    tokio::time::timeout(limit, work).await.expect("in time").expect("it ends")
}
