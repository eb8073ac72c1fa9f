//! A service with a producer, a consumer and an operator.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use isotherm_bus::{Consumer, Producer, ProducerOptions, SessionOptions, locators, open, presence};
use isotherm_correction::sample::{ChannelName, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::control::{CommandReply, SwapOptions, SwapOutcome, SwapReply};
use isotherm_protocol::corrected::CorrectedTick;
use isotherm_protocol::history::{AuditEntry, AuditEvent};
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::status::Status;
use isotherm_service::{RunningService, Settings, Totals, start};
use serde::de::DeserializeOwned;
use tempfile::TempDir;
use zenoh::Session;

pub(crate) const LIMIT: Duration = Duration::from_secs(30);
/// The unit of most tests.
pub(crate) const UNIT: &str = "ZLG-7";
/// One tick, in ns.
pub(crate) const TICK_NS: i64 = 5_000_000;

/// A document for three gyros with one channel, whose first gyro has a static bias.
pub(crate) fn document(unit: &str, bias_deg_per_h: f64) -> String {
    let sensors = ["x", "y", "z"].map(|name| {
        let bias = if name == "x" { bias_deg_per_h } else { 0.5 };
        format!(
            "[[gyro.sensor]]\nname = \"{name}\"\nchannel = \"body\"\nincrement_weight_arcsec_per_count = 0.1\n\
             static_bias = {{ kind = \"polynomial\", reference_deg_c = 25.0, coefficients_deg_per_h = [{bias}, 0.01], \
             range_deg_c = [-10.0, 40.0] }}\n"
        )
    });
    format!(
        "schema = 1\nunit = \"{unit}\"\ncreated = 2026-01-05\n\n[temperature]\nassumed_deg_c = 25.0\n\
         [temperature.filter]\ngrid_step_s = 1.0\nsmoothing_s = 3.0\nderivative_step_s = 1.0\nstale_after_s = 10.0\n\
         [[temperature.channel]]\nname = \"body\"\nrange_deg_c = [-70.0, 130.0]\nspike_limit_deg_c = 5.0\n\
         [gyro]\noutput = \"counts\"\n{}\n[gyro.orientation]\n\
         rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]\n",
        sensors.concat()
    )
}

pub(crate) fn unit_id(serial: &str) -> UnitId {
    UnitId::new(serial).unwrap()
}

/// Folders that outlive a service.
pub(crate) struct Folders {
    _whole: TempDir,
    pub(crate) documents: PathBuf,
    pub(crate) state: PathBuf,
}

impl Folders {
    pub(crate) fn new() -> Self {
        let whole = tempfile::tempdir().unwrap();
        let (documents, state) = (whole.path().join("documents"), whole.path().join("state"));
        std::fs::create_dir(&documents).unwrap();
        Self { _whole: whole, documents, state }
    }

    /// Settings with both folders, and a quick watch.
    pub(crate) fn settings(&self) -> Settings {
        let mut settings = Settings {
            calibrations: Some(self.documents.clone()),
            state: Some(self.state.clone()),
            ..Settings::default()
        };
        settings.folder.settle = Duration::from_millis(20);
        settings.folder.poll = Duration::from_millis(500);
        settings.unit.pairing_window = Span::from_ms(1);
        settings
    }

    /// Writes a document beside its place and renames it.
    pub(crate) fn put(&self, name: &str, text: &str) -> PathBuf {
        let (file, partial) = (self.documents.join(name), self.documents.join("partial"));
        std::fs::write(&partial, text).unwrap();
        std::fs::rename(&partial, &file).unwrap();
        file
    }
}

/// A service at work, and who deals with it.
pub(crate) struct Stand {
    pub(crate) service: RunningService,
    pub(crate) session: Session,
    consumer: Consumer,
    producers: BTreeMap<String, Producer>,
    next: BTreeMap<String, u64>,
    pub(crate) temperature_deg_c: f64,
    /// Whether the gyros' counts scatter.
    pub(crate) noisy: bool,
}

impl Stand {
    pub(crate) async fn start(settings: Settings) -> Self {
        let session = open(&settings.session).await.unwrap();
        let options = SessionOptions { connect: locators(&session), ..SessionOptions::default() };
        let service = start(settings, session).await.unwrap();
        let session = open(&options).await.unwrap();
        let consumer = Consumer::declare(&session, None).await.unwrap();
        presence::wait_for_service(&session, LIMIT).await.unwrap();
        let (producers, next) = (BTreeMap::new(), BTreeMap::new());
        Self { service, session, consumer, producers, next, temperature_deg_c: 25.0, noisy: false }
    }

    /// Sends ticks of a unit and waits for those that come out: all of them, in the end.
    pub(crate) async fn run_unit(&mut self, unit: &str, ticks: u64) -> Vec<(u64, CorrectedTick)> {
        let first = self.send(unit, ticks).await;
        self.receive(unit, first + ticks).await
    }

    /// Sends ticks of a unit; the sequence number of the first.
    pub(crate) async fn send(&mut self, unit: &str, ticks: u64) -> u64 {
        if !self.producers.contains_key(unit) {
            let producer = Producer::declare(&self.session, &unit_id(unit), ProducerOptions::default()).await;
            self.producers.insert(unit.to_owned(), producer.unwrap());
        }
        let producer = self.producers.get_mut(unit).unwrap();
        let next = self.next.entry(unit.to_owned()).or_default();
        let first = *next;
        for sequence in first..first + ticks {
            let end_time = Timestamp::from_ns((i64::try_from(sequence).unwrap() + 1) * TICK_NS);
            let raw = self.temperature_deg_c;
            let channel = ChannelName::from("body").unwrap();
            producer.temperatures(&[TemperatureReading { channel, time: end_time, raw }]).await.unwrap();
            let scatter = if self.noisy { noise(sequence) } else { 0.0 };
            let tick = GyroTick {
                sequence,
                end_time,
                duration: Span::from_ms(5),
                readings: [4.0, 5.0, -6.0].map(|counts| counts + scatter).into_iter().collect(),
                ..GyroTick::default()
            };
            producer.gyro(OutputKind::Counts, tick).await.unwrap();
        }
        producer.flush().await.unwrap();
        *next = first + ticks;
        first
    }

    /// What comes out until the tick before `end` has, each tick with its revision.
    pub(crate) async fn receive(&mut self, unit: &str, end: u64) -> Vec<(u64, CorrectedTick)> {
        let mut ticks = Vec::new();
        while ticks.last().is_none_or(|(_, tick): &(u64, CorrectedTick)| tick.sequence + 1 < end) {
            let batch = tokio::time::timeout(LIMIT, self.consumer.next()).await.expect("in time").unwrap();
            if batch.unit == unit {
                ticks.extend(batch.ticks.into_iter().map(|tick| (batch.revision.counter, tick)));
            }
        }
        ticks
    }

    /// Revisions that came out, each once, and whether every tick did.
    pub(crate) async fn revisions(&mut self, unit: &str, ticks: u64) -> Vec<u64> {
        let out = self.run_unit(unit, ticks).await;
        assert!(self.consumer.continuity(&unit_id(unit)).is_whole());
        assert_eq!(out.len() as u64, ticks, "nothing lost, nothing doubled");
        let mut revisions: Vec<_> = out.iter().map(|(revision, _)| *revision).collect();
        revisions.dedup();
        revisions
    }

    /// Asks, and takes the one reply.
    async fn ask(&self, selector: String, payload: Option<Vec<u8>>) -> Result<Vec<u8>, String> {
        let mut getter = self.session.get(selector).timeout(LIMIT);
        if let Some(payload) = payload {
            getter = getter.payload(payload);
        }
        let replies = getter.await.unwrap();
        let reply =
            tokio::time::timeout(LIMIT, replies.recv_async()).await.expect("in time").expect("a reply");
        match reply.into_result() {
            Ok(sample) => Ok(sample.payload().to_bytes().into_owned()),
            Err(error) => Err(String::from_utf8_lossy(&error.payload().to_bytes()).into_owned()),
        }
    }

    async fn ask_json<T: DeserializeOwned>(
        &self,
        selector: String,
        payload: Option<Vec<u8>>,
    ) -> Result<T, String> {
        let json = self.ask(selector, payload).await?;
        Ok(serde_json::from_slice(&json)
            .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&json))))
    }

    /// Has a document put in force over the bus.
    pub(crate) async fn swap(&self, unit: &str, text: &str, options: &SwapOptions) -> SwapReply {
        self.try_swap(unit, text, &options.to_parameters()).await.unwrap()
    }

    pub(crate) async fn try_swap(
        &self,
        unit: &str,
        text: &str,
        parameters: &str,
    ) -> Result<SwapReply, String> {
        let selector = format!("{}?{parameters}", key::calibration(&unit_id(unit)));
        self.ask_json(selector, Some(text.into())).await
    }

    /// The text of the active document.
    pub(crate) async fn active(&self, unit: &str) -> Result<String, String> {
        self.ask(key::calibration(&unit_id(unit)), None).await.map(|text| String::from_utf8(text).unwrap())
    }

    pub(crate) async fn command(&self, unit: &str, json: &str) -> CommandReply {
        self.try_command(unit, json).await.unwrap()
    }

    pub(crate) async fn try_command(&self, unit: &str, json: &str) -> Result<CommandReply, String> {
        self.ask_json(key::command(&unit_id(unit)), Some(json.into())).await
    }

    pub(crate) async fn history(&self, unit: &str) -> Vec<AuditEntry> {
        self.ask_json(format!("{}?limit=1000", key::history(&unit_id(unit))), None).await.unwrap()
    }

    /// Waits until the history says something.
    pub(crate) async fn until<T>(&self, unit: &str, found: impl Fn(&AuditEvent) -> Option<T>) -> T {
        let deadline = tokio::time::Instant::now() + LIMIT;
        loop {
            let history = self.history(unit).await;
            if let Some(found) = history.iter().find_map(|entry| found(&entry.event)) {
                return found;
            }
            assert!(tokio::time::Instant::now() < deadline, "not in time; the history says {history:#?}");
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    }

    /// Waits until a revision was accepted.
    pub(crate) async fn until_accepted(&self, unit: &str, revision: u64) {
        self.until(unit, |event| {
            matches!(event, AuditEvent::Accepted(accepted) if accepted.revision == revision).then_some(())
        })
        .await;
    }

    pub(crate) fn status(&self, unit: &str) -> Status {
        self.service.status(&unit_id(unit)).unwrap()
    }

    pub(crate) async fn stop(self) -> Totals {
        let totals = self.service.stop().await;
        assert!(!totals.lost(), "{totals:?}");
        totals
    }
}

/// A whole number from −1 to 1 that looks like chance.
fn noise(sequence: u64) -> f64 {
    let mixed = (sequence + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    [-1.0, 0.0, 1.0][usize::try_from((mixed >> 33) % 3).unwrap()]
}

/// The swap was accepted as this revision.
pub(crate) fn assert_accepted(reply: &SwapReply, revision: u64) {
    assert_eq!((reply.outcome, reply.revision), (SwapOutcome::Accepted, revision), "{:#?}", reply.problems);
}

/// The swap was refused, for one reason that says all of this.
pub(crate) fn assert_refused(reply: &SwapReply, words: &[&str]) {
    assert_eq!(reply.outcome, SwapOutcome::Refused);
    let problems: Vec<_> = reply.problems.iter().map(ToString::to_string).collect();
    let told = problems.iter().any(|problem| words.iter().all(|words| problem.contains(words)));
    assert!(told, "{words:?} in {problems:#?}");
}

pub(crate) fn audit_file(state: &Path) -> PathBuf {
    state.join("audit.jsonl")
}
