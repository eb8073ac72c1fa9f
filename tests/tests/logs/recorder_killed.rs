//! Fifty recorders killed amid the messages of eight units: what each leaves behind is whole up to its last chunk.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use isotherm_bus::{SessionOptions, close, locators, open};
use isotherm_log::recording::{RecordingOptions, RecordingReader, recover};
use isotherm_protocol::codec;
use isotherm_protocol::key::{self, RawStream, UnitId};
use isotherm_protocol::raw::{HealthBatch, HealthReading, HealthTick};
use isotherm_tests::bench::LIMIT;
use isotherm_tests::dice::Dice;
use isotherm_tests::process::program;
use zenoh::Session;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};

const KILLS: u64 = 50;
const UNITS: usize = 8;
/// The longest that a recorder lives (ms).
const LONGEST_LIFE_MS: u64 = 700;
/// The longest that a chunk takes.
const CHUNK: Duration = Duration::from_millis(50);
/// What two busy cores may need to bring a message from the producer into a chunk, and the chunk to the system.
const ON_THE_WAY: Duration = Duration::from_millis(400);
/// Between two messages of a unit.
const PERIOD: Duration = Duration::from_millis(1);

/// A recorder in a process of its own.
fn recorder(locator: &str, file: &Path) -> Child {
    Command::new(program("isotherm-replay"))
        .args(["record", "--no-service", "--overwrite", "--connect", locator, "--chunk-seconds"])
        .arg(CHUNK.as_secs_f64().to_string())
        .arg("--out")
        .arg(file)
        .stdout(Stdio::null())
        .spawn()
        .unwrap()
}

/// Eight units on the raw topics.
struct Units {
    publishers: Vec<Publisher<'static>>,
    number: u32,
}

impl Units {
    async fn declare(session: &Session) -> Self {
        let mut publishers = Vec::new();
        for unit in 0..UNITS {
            let key = key::raw(&UnitId::new(&format!("KILL-{unit}")).unwrap(), RawStream::Health);
            let publisher = session.declare_publisher(key).congestion_control(CongestionControl::Block);
            publishers.push(publisher.priority(Priority::RealTime).await.unwrap());
        }
        Self { publishers, number: 0 }
    }

    /// Waits until somebody subscribes, or nobody does.
    async fn wait(&self, matching: bool) {
        for publisher in &self.publishers {
            let listener = publisher.matching_listener().await.unwrap();
            while publisher.matching_status().await.unwrap().matching() != matching {
                tokio::time::timeout(LIMIT, listener.recv_async()).await.unwrap().unwrap();
            }
        }
    }

    /// One message of each.
    async fn publish(&mut self) -> Vec<Vec<u8>> {
        self.number += 1;
        let mut frames = Vec::new();
        for (unit, publisher) in (0_u32..).zip(&self.publishers) {
            let reading = HealthReading { name: "x".try_into().unwrap(), value: f64::from(unit) };
            let tick = HealthTick { time_ns: i64::from(self.number), readings: vec![reading] };
            let frame = codec::encode(&HealthBatch { ticks: vec![tick] }).unwrap();
            publisher.put(frame.clone()).await.unwrap();
            frames.push(frame);
        }
        frames
    }
}

/// The frames of a whole file, by key.
fn read(path: &Path) -> BTreeMap<String, Vec<Vec<u8>>> {
    let mut reader = RecordingReader::open(&[path.to_owned()], Arc::default()).unwrap();
    let mut frames = BTreeMap::<_, Vec<_>>::new();
    while let Some(message) = reader.next_message().unwrap() {
        frames.entry(message.topic.key()).or_default().push(message.frame);
    }
    assert_eq!(reader.report().cut_short, None);
    frames
}

#[tokio::test(flavor = "multi_thread")]
async fn a_killed_recorder_loses_its_last_chunk_at_most() {
    let session = open(&SessionOptions::default()).await.unwrap();
    let locator = locators(&session).remove(0);
    let folder = tempfile::tempdir().unwrap();
    let (broken, whole) = (folder.path().join("broken.mcap"), folder.path().join("whole.mcap"));
    let mut dice = Dice::new(4);
    // Built, where it has to be, before the clock runs.
    let _ = program("isotherm-replay");
    let started = Instant::now();
    let mut units = Units::declare(&session).await;
    let (mut sent_in_all, mut back_in_all) = (0, 0);
    for kill in 0..KILLS {
        let mut child = recorder(&locator, &broken);
        units.wait(true).await;
        let begun = Instant::now();
        let life = Duration::from_millis(dice.below(LONGEST_LIFE_MS));
        let mut sent = Vec::new();
        let mut due = tokio::time::interval(PERIOD);
        while begun.elapsed() < life {
            due.tick().await;
            sent.push((Instant::now(), units.publish().await));
        }
        child.kill().unwrap();
        let killed = Instant::now();
        child.wait().unwrap();
        units.wait(false).await;
        if !broken.exists() {
            // Killed before it began its file.
            assert!(life < ON_THE_WAY, "{life:?}");
            continue;
        }

        let options = RecordingOptions { overwrite: true, ..RecordingOptions::default() };
        let report = recover(&broken, &whole, options).unwrap();
        assert!(!report.ended, "it was killed");
        assert_eq!((report.missing, report.nameless), (0, 0), "kill {kill}: {report:?}");
        let back = read(&whole);
        for (index, publisher) in units.publishers.iter().enumerate() {
            let of_unit: Vec<_> = sent.iter().map(|(_, frames)| frames[index].clone()).collect();
            let back = back.get(publisher.key_expr().as_str()).cloned().unwrap_or_default();
            assert!(of_unit.starts_with(&back), "kill {kill}: nothing is lost before the last, or doubled");
            let at_least = sent.iter().filter(|(at, _)| *at + CHUNK + ON_THE_WAY < killed).count();
            assert!(
                back.len() >= at_least,
                "kill {kill}: {} of {} are there, {at_least} must be",
                back.len(),
                of_unit.len()
            );
            sent_in_all += of_unit.len();
            back_in_all += back.len();
        }
        std::fs::remove_file(&broken).unwrap();
    }
    let took = started.elapsed();
    println!("{back_in_all} of {sent_in_all} messages came back of {KILLS} killed recorders, in {took:.1?}");
    assert!(back_in_all * 2 > sent_in_all, "{back_in_all} of {sent_in_all}");
    close(session, LIMIT).await.unwrap();
}
