//! Units that go on by themselves, and the program that serves them.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use isotherm_bus::{Producer, ProducerOptions, SessionOptions, locators, open};
use isotherm_correction::sample::{ChannelName, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_simulator::presets::zeeman_sine;
use isotherm_simulator::{Scenario, Simulation, Step};
use serde_json::Value;
use tokio::task::JoinHandle;
use zenoh::Session;

use crate::control::stand::{Folders, LIMIT, TICK_NS, document, unit_id};

/// Ticks of a message.
const BATCH: u64 = 10;

/// What a unit does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// All is well.
    Fine,
    /// Warmer than its document was fitted for.
    Hot,
    /// No document.
    Strange,
    /// It sends some ticks and then no more.
    Silent,
    /// Some of its messages are none.
    Broken,
    /// A simulated laser gyro with the shipped document.
    Laser,
}

pub(crate) struct Stage {
    pub(crate) folders: Folders,
    session: Session,
    producers: Vec<JoinHandle<()>>,
    child: Option<Child>,
    second: Option<Child>,
    /// Where the first service listens.
    first: String,
    address: Option<SocketAddr>,
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.stop_service();
        end(self.second.take());
        self.producers.iter().for_each(JoinHandle::abort);
    }
}

impl Stage {
    /// The service at work, and units that send.
    pub(crate) async fn start(units: &[(String, Kind)]) -> Self {
        let folders = Folders::new();
        for (unit, kind) in units {
            match kind {
                Kind::Strange => continue,
                Kind::Laser => {
                    let text = include_str!("../../../../config/calibration/ZLG-0001.toml");
                    folders.put(&format!("{unit}.toml"), &text.replace("ZLG-0001", unit))
                }
                _ => folders.put(&format!("{unit}.toml"), &document(unit, 1.0)),
            };
        }
        let session = open(&SessionOptions::default()).await.unwrap();
        let mut stage = Self {
            folders,
            session,
            producers: Vec::new(),
            child: None,
            second: None,
            first: String::new(),
            address: None,
        };
        stage.start_service();
        for (at, (unit, kind)) in units.iter().enumerate() {
            let (session, unit, kind) = (stage.session.clone(), unit.clone(), *kind);
            stage.producers.push(tokio::spawn(async move { produce(&session, &unit, kind, at).await }));
        }
        stage
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folders.documents.with_file_name(name)
    }

    /// Starts the program, at the same address as before, and waits until it is ready.
    pub(crate) fn start_service(&mut self) {
        let listen = self.address.map_or_else(|| "127.0.0.1:0".to_owned(), |address| address.to_string());
        let web = format!("[metrics]\nlisten = \"{listen}\"\n[web]\nenabled = true\nwrite = true\n");
        let (child, told) = self.serve("service", "state", &locators(&self.session)[..1], &web);
        self.child = Some(child);
        told["locators"][0].as_str().unwrap().clone_into(&mut self.first);
        self.address =
            Some(told["metrics"].as_str().unwrap().strip_prefix("http://").unwrap().parse().unwrap());
    }

    /// Starts the other service of a pair.
    pub(crate) fn start_second(&mut self) {
        let connect = [self.first.clone(), locators(&self.session)[0].clone()];
        let (child, _) = self.serve("second", "state-of-second", &connect, "[pair]\nname = \"south\"\n");
        self.second = Some(child);
    }

    /// A service with its configuration, and what it says when it is ready.
    fn serve(&self, name: &str, state: &str, connect: &[String], rest: &str) -> (Child, Value) {
        let [configuration, ready] = ["toml", "json"].map(|form| self.file(&format!("{name}.{form}")));
        let text = format!(
            "calibrations = \"documents\"\nstate = \"{state}\"\nmax_units = 400\n{rest}[zenoh]\nconnect = {connect:?}\n\
             listen = [\"tcp/127.0.0.1:0\"]\n",
        );
        std::fs::write(&configuration, text).unwrap();
        let _ = std::fs::remove_file(&ready);
        let child = Command::new(env!("CARGO_BIN_EXE_isotherm"))
            .args(["serve", "--config"])
            .arg(&configuration)
            .arg("--ready-file")
            .arg(&ready)
            .env_remove("ISOTHERM_LOG")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        let child = child.unwrap();
        let deadline = Instant::now() + LIMIT;
        let told = loop {
            if let Ok(text) = std::fs::read_to_string(&ready) {
                break serde_json::from_str(&text).unwrap();
            }
            assert!(Instant::now() < deadline, "it does not start");
            std::thread::sleep(Duration::from_millis(20));
        };
        (child, told)
    }

    /// Ends the program at once.
    pub(crate) fn stop_service(&mut self) {
        end(self.child.take());
    }

    /// Where the console is.
    pub(crate) fn origin(&self) -> String {
        format!("http://{}/", self.address.unwrap())
    }

    /// Its address with the token, as the command prints it.
    pub(crate) fn address(&self) -> String {
        let mut command = Command::new(env!("CARGO_BIN_EXE_isotherm"));
        let printed = command.args(["web", "--config"]).arg(self.file("service.toml")).output().unwrap();
        assert!(printed.status.success(), "{printed:?}");
        let printed = String::from_utf8(printed.stdout).unwrap();
        let token = printed.trim().split_once("#token=").unwrap().1;
        format!("{}#token={token}", self.origin())
    }
}

fn end(child: Option<Child>) {
    if let Some(mut child) = child {
        let _ = child.kill();
        let _ = child.wait();
    }
}

/// Sends what the unit sends, for as long as the test lasts.
async fn produce(session: &Session, unit: &str, kind: Kind, at: usize) {
    if kind == Kind::Laser {
        return laser(session, unit).await;
    }
    let options = ProducerOptions { batch_ticks: 10, ..ProducerOptions::default() };
    let mut producer = Producer::declare(session, &unit_id(unit), options).await.unwrap();
    let mut beat = tokio::time::interval(Duration::from_millis(50));
    let channel = ChannelName::from("body").unwrap();
    for batch in 0_u32.. {
        beat.tick().await;
        if kind == Kind::Silent && batch > 40 {
            continue;
        }
        if kind == Kind::Broken && batch.is_multiple_of(40) {
            session.put(format!("imu/{unit}/raw/gyro"), vec![7; 40]).await.unwrap();
        }
        let warm = f64::from(u32::try_from(at * 7 % 11).unwrap());
        let raw = if kind == Kind::Hot { 46.0 } else { 15.0 + warm + 2.0 * (f64::from(batch) / 300.0).sin() };
        for tick in 0..BATCH {
            let sequence = u64::from(batch) * BATCH + tick;
            let end_time = Timestamp::from_ns(i64::try_from(sequence + 1).unwrap() * TICK_NS);
            if tick == 0 {
                producer.temperatures(&[TemperatureReading { channel, time: end_time, raw }]).await.unwrap();
            }
            let noise = f64::from(u32::try_from(sequence * 2_654_435_761 % 1000).unwrap()) / 250.0 - 2.0;
            let readings = [noise.round(), (noise * 0.7).round() + 1.0, -2.0].into_iter().collect();
            let tick =
                GyroTick { sequence, end_time, duration: Span::from_ms(5), readings, ..GyroTick::default() };
            producer.gyro(OutputKind::Counts, tick).await.unwrap();
        }
    }
}

/// A laser gyro in motion, at its own pace.
async fn laser(session: &Session, unit: &str) {
    let scenario = Scenario { unit: unit.to_owned(), ..zeeman_sine(7) };
    let accel = scenario.instrument.accel_output_kind();
    let batch_ticks = usize::try_from(50_000_000 / scenario.tick_ns).unwrap();
    let options = ProducerOptions { batch_ticks, ..ProducerOptions::default() };
    let mut producer = Producer::declare(session, &unit_id(unit), options).await.unwrap();
    let mut steps = Simulation::new(&scenario).unwrap();
    let mut beat = tokio::time::interval(Duration::from_millis(50));
    loop {
        beat.tick().await;
        let batch: Vec<Step> = steps.by_ref().take(batch_ticks).collect();
        for step in batch {
            producer.temperatures(&step.temperatures).await.unwrap();
            if let (Some(output), Some(tick)) = (accel, step.accel) {
                producer.accel(output, tick).await.unwrap();
            }
            producer.gyro(OutputKind::Counts, step.gyro).await.unwrap();
        }
    }
}
