//! The headline: what was recorded beside a service is corrected offline to the bits that the service published.
//!
//! Ten minutes of eight laser units, played fast: mode switches, twenty swaps, a pre-launch calibration, ticks that are
//! lost, doubled and out of order on the producers' side. One recorder is there from the beginning, another comes in the
//! middle.

mod recorder;

use std::path::Path;
use std::time::{Duration, Instant};

use isotherm_bus::{SessionOptions, close, locators, open};
use isotherm_protocol::control::{Schedule, SwapOptions, SwapOutcome};
use isotherm_protocol::key::{self, RawStream, UnitId};
use isotherm_protocol::raw::{Batcher, RawFrame};
use isotherm_service::{RunningService, Settings, start};
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::presets::{zeeman_rest, zeeman_sine};
use isotherm_simulator::{Scenario, Simulation, Step};
use isotherm_tests::bench::LIMIT;
use isotherm_tests::dice::Dice;
use isotherm_tests::operator::Operator;
use isotherm_tests::process;
use serde_json::{Value, json};
use zenoh::Session;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};

use recorder::{Recorder, until_heard, until_recording};

const DOCUMENT: &str = include_str!("../../../config/calibration/ZLG-0001.toml");
const UNITS: usize = 8;
/// Ticks of every unit that are played at once: three seconds.
const CHUNK: u64 = 600;
const CHUNKS: u64 = 200;
/// Ticks in a message, unit by unit.
const BATCHES: [usize; UNITS] = [2, 4, 6, 8, 12, 24, 3, 20];
/// A swap of one unit after the other every so many chunks.
const SWAP_EVERY: u64 = 9;
const SWAPS: u64 = 20;
/// The unit that is calibrated before launch, from when to when.
const CALIBRATED: usize = UNITS - 1;
const STANDBY_AT: u64 = 30;
const RUN_AT: u64 = 160;
/// When the second recorder comes.
const MIDDLE: u64 = 95;
/// When it must be there.
const MIDDLE_AT_LATEST: u64 = 115;
/// It begins a new file every second, and asks for the memory of every unit for each.
const ROW: [&str; 2] = ["--max-duration", "1"];

fn serial(number: usize) -> String {
    format!("LOG-{number}")
}

fn scenario(number: usize) -> Scenario {
    let seed = number as u64;
    let mut scenario = if number == CALIBRATED { zeeman_rest(seed) } else { zeeman_sine(seed) };
    if let Gyros::Zeeman(zeeman) = &mut scenario.instrument.gyros {
        zeeman.reversal.period_s = 30.0;
    }
    Scenario { unit: serial(number), duration_s: 601.0, ..scenario }
}

/// The document of a unit with another first constant.
fn document(number: usize, constant: &str) -> String {
    let of_unit = DOCUMENT.replace("unit = \"ZLG-0001\"", &format!("unit = \"{}\"", serial(number)));
    let text = of_unit.replacen(
        "coefficients_deg_per_h = [0.41,",
        &format!("coefficients_deg_per_h = [{constant},"),
        1,
    );
    assert!(constant == "0.41" || text != of_unit, "the constant is in the document");
    text
}

/// A producer with a bad line: some frames are lost, some come twice, some behind the next.
struct Line {
    publishers: Vec<Publisher<'static>>,
    simulation: Simulation,
    scenario: Scenario,
    batcher: Batcher,
    dice: Dice,
    held: Option<RawFrame>,
    /// Gyro ticks that went out.
    sent: u64,
}

impl Line {
    async fn new(session: &Session, number: usize) -> Self {
        let (unit, scenario) = (UnitId::new(&serial(number)).unwrap(), scenario(number));
        let mut publishers = Vec::new();
        for stream in RawStream::ALL {
            let publisher = session.declare_publisher(key::raw(&unit, stream));
            publishers.push(
                publisher
                    .congestion_control(CongestionControl::Block)
                    .priority(Priority::RealTime)
                    .await
                    .unwrap(),
            );
        }
        Self {
            publishers,
            simulation: Simulation::new(&scenario).unwrap(),
            scenario,
            batcher: Batcher::new(BATCHES[number]),
            dice: Dice::new(number as u64),
            held: None,
            sent: 0,
        }
    }

    async fn play(&mut self, ticks: u64) {
        for _ in 0..ticks {
            let Step { gyro, accel, temperatures, .. } = self.simulation.next().expect("long enough");
            for reading in &temperatures {
                self.batcher.temperature(*reading);
            }
            if let (Some(output), Some(tick)) = (self.scenario.instrument.accel_output_kind(), accel) {
                self.batcher.accel(output, tick);
            }
            self.batcher.gyro(self.scenario.instrument.gyros.output_kind(), gyro);
            self.publish().await;
        }
    }

    async fn publish(&mut self) {
        while let Some(frame) = self.batcher.next_frame().transpose().unwrap() {
            match self.dice.below(1000) {
                0..4 => {}
                4..10 => {
                    self.put(&frame).await;
                    self.put(&frame).await;
                }
                10..20 if self.held.is_none() => self.held = Some(frame),
                _ => {
                    self.put(&frame).await;
                    if let Some(held) = self.held.take() {
                        self.put(&held).await;
                    }
                }
            }
        }
    }

    async fn put(&mut self, frame: &RawFrame) {
        let index = RawStream::ALL.iter().position(|stream| *stream == frame.stream).unwrap();
        self.publishers[index].put(frame.frame.clone()).await.unwrap();
        self.sent += if frame.stream == RawStream::Gyro { frame.ticks } else { 0 };
    }
}

/// The session as it goes.
struct Scene {
    service: RunningService,
    operator: Operator,
    lines: Vec<Line>,
    swaps: u64,
}

impl Scene {
    async fn chunk(&mut self) {
        for line in &mut self.lines {
            line.play(CHUNK).await;
        }
        let deadline = Instant::now() + LIMIT;
        for (number, line) in self.lines.iter().enumerate() {
            let unit = UnitId::new(&serial(number)).unwrap();
            while self.service.totals().unit(&unit).ticks_in < line.sent {
                assert!(Instant::now() < deadline, "the service takes in what is played");
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
        }
    }

    /// A swap in one of several ways.
    async fn swap(&mut self) {
        self.swaps += 1;
        let number = usize::try_from(self.swaps).unwrap() % CALIBRATED;
        let unit = serial(number);
        let status = self.service.status(&UnitId::new(&unit).unwrap()).unwrap();
        let last = status.last_tick.unwrap();
        let schedule = match self.swaps % 4 {
            1 => Schedule::Sequence(last.sequence + 700),
            2 => Schedule::TimeNs(last.end_time_ns + 2_000_000_000),
            _ => Schedule::NextTick,
        };
        let slew_s = (self.swaps == 7).then_some(4.0);
        let options = SwapOptions { by: "the test".to_owned(), schedule, slew_s, ..SwapOptions::default() };
        let text = document(number, &format!("0.{}", 411 + self.swaps));
        let reply = self.operator.swap(&unit, text.as_bytes(), &options).await.unwrap();
        assert_eq!(reply.outcome, SwapOutcome::Accepted, "{reply:#?}");
    }

    async fn command(&self, order: Value) {
        let reply = self.operator.command(&serial(CALIBRATED), order).await.unwrap();
        assert!(reply.accepted, "{reply:?}");
    }
}

/// Plays the session; the recordings from the beginning and from the middle.
async fn play(folder: &Path) -> [Vec<String>; 2] {
    let documents = folder.join("documents");
    std::fs::create_dir(&documents).unwrap();
    for number in 0..UNITS {
        std::fs::write(documents.join(format!("{}.toml", serial(number))), document(number, "0.41")).unwrap();
    }
    let settings = Settings {
        calibrations: Some(documents),
        state: Some(folder.join("state")),
        congestion: CongestionControl::Block,
        ..Settings::default()
    };
    let session = open(&settings.zenoh.session).await.unwrap();
    let to_service = locators(&session);
    let service = start(settings, session).await.unwrap();
    let of_service = SessionOptions { connect: to_service.clone(), ..SessionOptions::default() };
    let operator = Operator::new(open(&of_service).await.unwrap());
    let producers = open(&of_service).await.unwrap();
    let all: Vec<_> = to_service.into_iter().chain(locators(&producers)).collect();

    let first = Recorder::start(folder.join("begin.mcap"), &all, &[]);
    until_heard(&producers).await;
    let mut lines = Vec::new();
    for number in 0..UNITS {
        lines.push(Line::new(&producers, number).await);
    }
    let mut scene = Scene { service, operator, lines, swaps: 0 };
    let begun = Instant::now();
    let mut second = None;
    for chunk in 0..CHUNKS {
        scene.chunk().await;
        match chunk {
            STANDBY_AT => scene.command(json!({"command": "standby"})).await,
            RUN_AT => scene.command(json!({"command": "run"})).await,
            MIDDLE => second = Some(Recorder::start(folder.join("middle.mcap"), &all, &ROW)),
            MIDDLE_AT_LATEST => until_recording(second.as_ref().expect("it was started")).await,
            _ => {}
        }
        if chunk == STANDBY_AT + 1 {
            let order = json!({"command": "pre-launch", "latitude_deg": 55.75, "heading_deg": 30.0, "duration_s": 300.0});
            scene.command(order).await;
        }
        if chunk % SWAP_EVERY == 4 && scene.swaps < SWAPS {
            scene.swap().await;
        }
    }
    let speed = 600.0 / begun.elapsed().as_secs_f64();
    println!("played at {speed:.0}×");
    let status = scene.service.status(&UnitId::new(&serial(CALIBRATED)).unwrap()).unwrap();
    let outcome = status.pre_launch_outcome.expect("the pre-launch calibration has ended");
    println!("pre-launch calibration: {:?}", outcome.verdict);
    assert_eq!(scene.swaps, SWAPS);
    let totals = scene.service.stop().await;
    assert!(!totals.lost(), "{totals:?}");
    let recorded = [first, second.expect("it was started")].map(Recorder::wait);
    drop(scene.lines);
    close(producers, LIMIT).await.unwrap();
    close(scene.operator.session().clone(), LIMIT).await.unwrap();
    recorded
}

/// Corrects a recording and has it compared with what the service published; the report by unit.
fn corrected(recording: &[String], more: &[&str]) -> Vec<Value> {
    let recording = recording.iter().map(String::as_str);
    let arguments = ["correct", "--json"].into_iter().chain(recording).chain(more.iter().copied());
    let output = process::run("isotherm-replay", &arguments.collect::<Vec<_>>());
    let (report, errors) =
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{}: {report}\n{errors}", output.status);
    let report: Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["identical"], true, "{report:#}");
    let units = report["units"].as_array().unwrap().clone();
    assert_eq!(units.len(), UNITS);
    for unit in &units {
        assert_eq!(
            (&unit["by_journal"], &unit["replica"]["notices"]),
            (&json!(true), &json!([])),
            "{unit:#}"
        );
        assert_eq!((&unit["published"]["different"], &unit["published"]["first"]), (&json!(0), &json!(null)));
    }
    units
}

#[tokio::test(flavor = "multi_thread")]
async fn ten_minutes_of_eight_units_are_corrected_again_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let [begin, middle] = play(folder.path()).await;
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();

    let (one, many) = (path("one.mcap"), path("many.mcap"));
    let whole = corrected(&begin, &["--out", &many]);
    let ticks = |units: &[Value]| {
        units.iter().map(|unit| unit["published"]["ticks"].as_u64().unwrap()).collect::<Vec<_>>()
    };
    for (number, (unit, ticks)) in whole.iter().zip(ticks(&whole)).enumerate() {
        let least = if number == CALIBRATED { 30_000 } else { 115_000 };
        assert!(ticks > least, "{unit:#}");
        let counted = |name: &str| unit["counters"][name].as_u64().unwrap_or(0);
        for name in ["ticks_missed", "gyro_duplicates", "switches_restored"] {
            assert!(counted(name) > 0, "{name}: {unit:#}");
        }
        assert_eq!(unit["published"]["only_b"]["before"], 0, "{unit:#}");
    }
    assert!(middle.len() > 2, "a row of files: {middle:?}");
    let part = corrected(&middle, &[]);
    for unit in &part {
        let equal = unit["replica"]["memories_equal"].as_u64().unwrap();
        assert!(equal > 0, "the service's memory, to the bit: {unit:#}");
    }
    for (part, whole) in ticks(&part).into_iter().zip(ticks(&whole)) {
        assert!(part > whole / 4 && part < whole, "{part} of {whole}");
    }

    // Threads change nothing, in no byte.
    corrected(&begin, &["--out", &one, "--threads", "1"]);
    assert_eq!(std::fs::read(&one).unwrap(), std::fs::read(&many).unwrap());

    let begin = begin[0].as_str();
    let identical = process::run("isotherm-replay", &["diff", begin, &many]);
    let words = String::from_utf8_lossy(&identical.stdout);
    assert!(identical.status.code() == Some(0) && words.ends_with("identical\n"), "{words}");

    // One coefficient in its last digit.
    let (weight, changed) = ("per_count = 1.97\n", path("changed.toml"));
    let text = document(0, "0.41");
    assert!(text.contains(weight));
    std::fs::write(&changed, text.replacen(weight, "per_count = 1.970000000000001\n", 1)).unwrap();
    let (a, b, other) = (path("a.csv"), path("b.csv"), path("other.mcap"));
    let unit = serial(0);
    process::run_well("isotherm-replay", &["correct", begin, "--unit", &unit, "--out", &a]);
    for out in [&b, &other] {
        let arguments = ["correct", begin, "--unit", &unit, "--calibration", &changed, "--out", out];
        process::run_well("isotherm-replay", &arguments);
    }
    let (a, b) = (std::fs::read_to_string(&a).unwrap(), std::fs::read_to_string(&b).unwrap());
    let mut differing = a.lines().zip(b.lines()).filter(|(a, b)| a != b).map(|(a, _)| a);
    let first: u64 = differing.next().expect("some tick changes").split(',').next().unwrap().parse().unwrap();
    let different = process::run("isotherm-replay", &["diff", begin, &other, "--unit", &unit, "--json"]);
    assert_eq!(different.status.code(), Some(1));
    let report: Value = serde_json::from_slice(&different.stdout).unwrap();
    let account = &report["units"][&unit];
    assert_eq!(account["different"], differing.count() + 1, "{account:#}");
    assert_eq!((&account["only_a"]["between"], &account["first"]["sequence"]), (&json!(0), &json!(first)));
    let field = account["first"]["fields"][0]["field"].as_str().unwrap();
    assert!(field.starts_with("delta_angle"), "{account:#}");
}
