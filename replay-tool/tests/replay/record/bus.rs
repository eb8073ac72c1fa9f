//! `record` with producers on loopback: what is published is in the files, and what is not is counted.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use isotherm_bus::{SessionOptions, close, locators, open};
use isotherm_log::recording::{Metadata, RecordingReader};
use isotherm_protocol::key::{self, RawStream, UnitId};
use serde_json::Value;
use zenoh::Session;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};

use super::{shell_example, temperature};
use crate::common::{replay, told};

pub(crate) const LIMIT: Duration = Duration::from_secs(30);

/// A session that recorders connect to.
pub(crate) struct Bench {
    pub(crate) session: Session,
    folder: tempfile::TempDir,
}

/// A recorder in a process of its own; killed when dropped.
pub(crate) struct Recorder(Child);

impl Drop for Recorder {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Recorder {
    /// Stops it as an operator would.
    pub(crate) fn interrupt(&self) {
        let asked = Command::new("kill").args(["-INT", &self.0.id().to_string()]).status();
        assert!(asked.unwrap().success());
    }

    /// Waits for its end: exit code, what it printed.
    pub(crate) fn end(mut self) -> (Option<i32>, Value, String) {
        let mut errors = String::new();
        self.0.stderr.take().unwrap().read_to_string(&mut errors).unwrap();
        let mut summary = String::new();
        self.0.stdout.take().unwrap().read_to_string(&mut summary).unwrap();
        let code = self.0.wait().unwrap().code();
        (code, serde_json::from_str(&summary).unwrap_or(Value::Null), errors)
    }
}

impl Bench {
    pub(crate) async fn new() -> Self {
        let session = open(&SessionOptions::default()).await.unwrap();
        Self { session, folder: tempfile::tempdir().unwrap() }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A recorder of whatever is published here, without a service; `prefix` stands in front of the command in a shell.
    fn record(&self, prefix: &str, arguments: &[&str]) -> Recorder {
        self.start(prefix, &[&["--no-service"], arguments].concat())
    }

    /// A recorder with other arguments.
    pub(crate) fn start(&self, prefix: &str, arguments: &[&str]) -> Recorder {
        let program = env!("CARGO_BIN_EXE_isotherm-replay");
        let locator = locators(&self.session).remove(0);
        let line =
            format!("{prefix} exec {program} record --json --connect {locator} {}", arguments.join(" "));
        let child = Command::new("sh")
            .args(["-c", &line])
            .current_dir(self.folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        Recorder(child.unwrap())
    }

    /// A publisher that somebody subscribes to.
    async fn publisher(&self, key: &str) -> Publisher<'static> {
        let publisher = self.session.declare_publisher(key.to_owned());
        let publisher = publisher.congestion_control(CongestionControl::Block).priority(Priority::RealTime);
        let publisher = publisher.await.unwrap();
        let listener = publisher.matching_listener().await.unwrap();
        while !publisher.matching_status().await.unwrap().matching() {
            tokio::time::timeout(LIMIT, listener.recv_async()).await.unwrap().unwrap();
        }
        publisher
    }

    pub(crate) async fn end(self) {
        close(self.session, LIMIT).await.unwrap();
    }
}

/// The frames of a file or several by key, in their order, and the metadata.
pub(crate) fn read(paths: &[PathBuf]) -> (BTreeMap<String, Vec<Vec<u8>>>, Vec<Metadata>) {
    let mut reader = RecordingReader::open(paths, Arc::default()).unwrap();
    let (mut frames, mut before) = (BTreeMap::<_, Vec<_>>::new(), 0);
    while let Some(message) = reader.next_message().unwrap() {
        assert!(message.received_ns >= before, "in the order of their times");
        before = message.received_ns;
        frames.entry(message.topic.key()).or_default().push(message.frame);
    }
    assert_eq!(reader.report().cut_short, None);
    (frames, reader.take_metadata())
}

fn raw(serial: &str) -> String {
    key::raw(&UnitId::new(serial).unwrap(), RawStream::Temperature)
}

/// Publishes messages of two units, and what nobody records; what was published by key.
async fn publish(bench: &Bench, count: u32) -> BTreeMap<String, Vec<Vec<u8>>> {
    let mut published = BTreeMap::new();
    for serial in ["A-1", "B-2"] {
        let topic = bench.publisher(&raw(serial)).await;
        for number in 0..count {
            let frame = temperature(serial, number).frame;
            topic.put(frame.clone()).await.unwrap();
            published.entry(raw(serial)).or_insert_with(Vec::new).push(frame);
        }
    }
    bench.session.put("imu/A-1/other", "x").await.unwrap();
    published
}

/// Waits until a file names a key so many times beside its chunks: behind the chunk that has it first.
async fn wait_for(file: impl Fn() -> PathBuf, key: &str, times: usize) {
    let written = async {
        while fs::read(file()).map_or(0, |bytes| String::from_utf8_lossy(&bytes).matches(key).count()) < times
        {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    };
    tokio::time::timeout(LIMIT, written).await.expect("it is written");
}

/// Waits for the message that is published last.
async fn wait_for_last(file: impl Fn() -> PathBuf, times: usize) {
    wait_for(file, "imu/B-2/reference", times).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_published_is_in_the_file() {
    let bench = Bench::new().await;
    let recorder =
        bench.record("", &["--out", "run", "--chunk-seconds", "0.05", "--unit", "A-1", "--unit", "B-2"]);
    let published = publish(&bench, 2000).await;
    // Behind the others: when it is written, they are. The recording names the topics asked for, too.
    let last = bench.publisher("imu/B-2/reference").await;
    last.put("the last one").await.unwrap();
    let file = bench.path("run.mcap");
    wait_for_last(|| file.clone(), 2).await;
    recorder.interrupt();
    let (code, summary, errors) = recorder.end();
    assert_eq!(code, Some(0), "{errors}");
    assert_eq!(
        (&summary["received"], &summary["written"], &summary["lost"]),
        (&4001.into(), &4001.into(), &0.into())
    );
    assert_eq!(summary["ended_by"], "signal");
    assert_eq!(summary["topics"][0]["topic"], "imu/A-1/raw/temp");
    assert_eq!(summary["topics"][0]["written"], 2000);

    let (mut frames, metadata) = read(&[file]);
    assert_eq!(frames.remove("imu/B-2/reference").unwrap(), [b"the last one"]);
    assert_eq!(frames, published);
    let said: Vec<_> = metadata.iter().map(|record| record.values["record"].as_str()).collect();
    assert_eq!(said, ["beginning", "end"]);
    assert_eq!(metadata[0].values["units"], "A-1 B-2");
    assert!(metadata[0].values["wire_versions"].split(", ").any(|range| range == "raw_gyro 1 to 1"));
    assert_eq!(metadata[1].values["written"], "4001");
    let text = format!("{metadata:?}");
    assert!(!text.contains("127.0.0.1") && !text.contains(bench.folder.path().to_str().unwrap()), "{text}");
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn at_the_seam_of_two_files_nothing_is_lost_or_doubled() {
    let bench = Bench::new().await;
    let arguments = ["--out", "run", "--max-size", "20K", "--chunk-seconds", "0.01", "--compression", "none"];
    let recorder = bench.record("", &arguments);
    let mut published: BTreeMap<String, Vec<Vec<u8>>> = BTreeMap::new();
    let publishers = [bench.publisher(&raw("A-1")).await, bench.publisher(&raw("B-2")).await];
    let mut number = 0;
    // For as long as it takes to fill four files.
    while !bench.path("run-0005.mcap").exists() {
        for (serial, publisher) in ["A-1", "B-2"].into_iter().zip(&publishers) {
            let frame = temperature(serial, number).frame;
            publisher.put(frame.clone()).await.unwrap();
            published.entry(raw(serial)).or_default().push(frame);
        }
        number += 1;
        assert!(number < 1_000_000);
    }
    drop(publishers);
    let last = bench.publisher("imu/B-2/reference").await;
    last.put("the last one").await.unwrap();
    let all = || {
        let number = |number: u32| bench.path(&format!("run-{number:04}.mcap"));
        (1..=9999).map(number).take_while(|path| path.exists()).collect::<Vec<_>>()
    };
    wait_for_last(|| all().pop().unwrap(), 1).await;
    recorder.interrupt();
    let (code, summary, errors) = recorder.end();
    assert_eq!(code, Some(0), "{errors}");
    assert_eq!(summary["files"].as_array().unwrap().len(), all().len());

    let (mut frames, _) = read(&all());
    frames.remove("imu/B-2/reference");
    assert!(frames == published, "every message is in one of the files, once, in its order");
    for (index, path) in all().into_iter().enumerate() {
        let (frames, metadata) = read(&[path]);
        let written: usize = frames.values().map(Vec::len).sum();
        assert_eq!(metadata[0].values["file"], (index + 1).to_string());
        assert_eq!(metadata[1].values["written"], written.to_string());
        assert_eq!(metadata[1].values["lost"], "0");
    }
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn only_the_newest_files_are_kept() {
    let bench = Bench::new().await;
    let arguments = [
        "--out",
        "run",
        "--max-size",
        "16K",
        "--keep",
        "2",
        "--chunk-seconds",
        "0.01",
        "--compression",
        "none",
    ];
    let recorder = bench.record("", &arguments);
    let publisher = bench.publisher(&raw("A-1")).await;
    let mut number = 0;
    let newest = || {
        let files = fs::read_dir(bench.folder.path()).unwrap();
        let names = files.map(|file| file.unwrap().file_name().into_string().unwrap());
        names.max().unwrap_or_default()
    };
    while newest().as_str() < "run-0006.mcap" {
        publisher.put(temperature("A-1", number).frame).await.unwrap();
        number += 1;
        // At a pace: what is faster than the disk would have to be written after the end.
        tokio::time::sleep(Duration::from_micros(50)).await;
    }
    recorder.interrupt();
    let (code, summary, errors) = recorder.end();
    assert_eq!(code, Some(0), "{errors}");
    assert!(summary["files_deleted"].as_u64().unwrap() >= 4);
    assert_eq!(fs::read_dir(bench.folder.path()).unwrap().count(), 2);
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_does_not_fit_the_queue_is_counted_per_topic() {
    let bench = Bench::new().await;
    let recorder = bench.record("", &["--out", "run", "--queue", "1M", "--chunk-seconds", "0.01"]);
    let small = bench.publisher(&raw("A-1")).await;
    let large = bench.publisher(&raw("B-2")).await;
    for number in 0..300 {
        small.put(temperature("A-1", number).frame).await.unwrap();
        if number % 100 == 0 {
            large.put(vec![0_u8; 2 << 20]).await.unwrap();
        }
    }
    let last = bench.publisher("imu/B-2/reference").await;
    last.put("the last one").await.unwrap();
    let file = bench.path("run.mcap");
    wait_for_last(|| file.clone(), 1).await;
    recorder.interrupt();
    let (code, summary, errors) = recorder.end();
    assert_eq!(code, Some(3), "{errors}");
    insta::assert_snapshot!(errors.replace(bench.folder.path().to_str().unwrap(), "FOLDER"));
    let topic = |index: usize| {
        let topic = &summary["topics"][index];
        (topic["received"].as_u64(), topic["written"].as_u64(), topic["lost"].as_u64())
    };
    assert_eq!(topic(0), (Some(300), Some(300), Some(0)));
    assert_eq!(topic(1), (Some(3), Some(0), Some(3)));
    let (frames, metadata) = read(&[file]);
    assert_eq!(frames[&raw("A-1")].len(), 300);
    assert_eq!(metadata[1].values["lost"], "3");
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_disk_ends_the_recording_and_nothing_else() {
    let bench = Bench::new().await;
    // Blocks of 512 or of 1024 bytes, as the shell has it.
    let recorder =
        bench.record("ulimit -f 64;", &["--out", "run", "--compression", "none", "--chunk-seconds", "0.02"]);
    let topic = bench.publisher(&raw("A-1")).await;
    let mut published = Vec::new();
    let flood = async {
        while topic.matching_status().await.unwrap().matching() {
            let frame = temperature("A-1", u32::try_from(published.len()).unwrap()).frame;
            topic.put(frame.clone()).await.unwrap();
            published.push(frame);
            // A producer goes on at its pace.
            tokio::time::sleep(Duration::from_micros(200)).await;
        }
    };
    tokio::time::timeout(LIMIT, flood).await.expect("the recorder ends by itself");
    let (code, summary, errors) = recorder.end();
    assert_eq!(code, Some(3), "{errors}");
    assert!(errors.contains("run.mcap"), "{errors}");
    assert_eq!(summary["ended_by"], "failure");
    let figure = |name: &str| summary[name].as_u64().unwrap();
    assert!(figure("lost") > 0);
    assert_eq!(figure("received"), figure("written") + figure("lost"));

    // Where the limit leaves no room even for an end, the file has none.
    let output = replay(bench.folder.path(), &["recover", "run.mcap", "--out", "whole.mcap", "--json"]);
    let recovered: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((output.status.code(), &recovered["damaged_bytes"]), (Some(0), &0.into()), "{recovered}");
    let (frames, metadata) = read(&[bench.path("whole.mcap")]);
    let back = &frames[&raw("A-1")];
    assert_eq!(back.len() as u64, figure("written"));
    assert!(back.len() > 100 && published.starts_with(back));
    if let Some(end) = metadata.iter().find(|record| record.values["record"] == "end") {
        assert!(end.values["why"].contains("writing failed"), "{metadata:?}");
        assert_eq!(end.values["written"], back.len().to_string());
    }
    bench.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_recorder_does_not_touch_the_file_of_the_first() {
    let bench = Bench::new().await;
    let first = bench.record("", &["--out", "run", "--chunk-seconds", "0.01"]);
    let publisher = bench.publisher(&raw("A-1")).await;
    publisher.put(temperature("A-1", 0).frame).await.unwrap();
    wait_for(|| bench.path("run.mcap"), "imu/A-1/raw/temp", 1).await;
    for arguments in
        [["--out", "run", "--duration", "1", ""], ["--out", "run", "--duration", "1", "--overwrite"]]
    {
        let (code, _, errors) = bench.record("", &arguments).end();
        assert_eq!(code, Some(2), "{errors}");
        assert!(errors.contains("run.mcap"), "{errors}");
    }
    first.interrupt();
    assert_eq!(first.end().0, Some(0));
    let (code, _, errors) = bench.record("", &["--out", "run", "--duration", "1"]).end();
    assert!(code == Some(2) && errors.contains("--overwrite"), "{errors}");
    assert_eq!(read(&[bench.path("run.mcap")]).0[&raw("A-1")].len(), 1);
    assert_eq!(bench.record("", &["--out", "run", "--duration", "0.1", "--overwrite"]).end().0, Some(0));
    assert!(read(&[bench.path("run.mcap")]).0.is_empty());
    bench.end().await;
}

#[test]
fn a_missing_service_is_an_error_within_the_time() {
    let folder = tempfile::tempdir().unwrap();
    let begun = std::time::Instant::now();
    let nobody = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let output = replay(folder.path(), &["record", "--out", "run", "--timeout", "0.3", "--connect", &nobody]);
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(errors.contains(&nobody) && errors.contains("--no-service"), "{errors}");
    assert!(begun.elapsed() < Duration::from_secs(8));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "no file is left behind");
}

#[test]
fn limits_are_said_before_anything_is_opened() {
    let folder = tempfile::tempdir().unwrap();
    let wrong = [
        ["--max-size", "1K"],
        ["--queue", "5"],
        ["--chunk-seconds", "0"],
        ["--keep", "3"],
        ["--topic", "gyro"],
        ["--max-size", "5T"],
        ["--unit", "a b"],
    ];
    let record = ["record", "--out", "run", "--no-service"];
    insta::assert_snapshot!(wrong.map(|more| told(folder.path(), &[&record[..], &more].concat())).concat());
}

#[test]
fn the_example_of_the_help_works_as_printed() {
    shell_example("record", &["record --out run.mcap"]);
}
