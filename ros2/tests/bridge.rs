//! The loop of ROS 2: Imu messages through `isotherm-ros` and the service, back as Imu messages.
//!
//! `ISOTHERM_ROS_MESSAGES` sets how many (`just ros-loop`: 100 000).

#![expect(clippy::expect_used, clippy::unwrap_used, reason = "what does not hold ends the test")]

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::slice;
use std::time::{Duration, Instant};

use isotherm_bus::session::set;
use isotherm_bus::{Consumer, Producer, ProducerOptions, SessionOptions, close, open, open_config};
use isotherm_correction::sample::{CorrectedTick, OutputKind};
use isotherm_correction::unit::{Event, UnitSettings};
use isotherm_log::offline::load_calibration;
use isotherm_log::ros2::{Header, Imu, Temperature, from_cdr, time, to_cdr};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::stream::UnitStream;
use isotherm_ros::attachment::Attachment;
use isotherm_ros::interface::{
    DIAGNOSTICS, DiagnosticArray, IMU, Interface, Level, TEMPERATURE, TRIGGER, TriggerRequest,
    TriggerResponse,
};
use isotherm_ros::name::{Kind, Node, gid, key};
use isotherm_ros::qos::Qos;
use isotherm_ros::session::RosOptions;
use isotherm_simulator::{Scenario, Simulation, Step, presets};
use serde_json::Value;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};
use zenoh::Session;
use zenoh::bytes::ZBytes;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::CongestionControl;
use zenoh::query::QueryTarget;

#[path = "bridge/elsewhere.rs"]
mod elsewhere;

/// Every wait ends here at the latest.
const LIMIT: Duration = Duration::from_secs(60);
const UNIT: &str = "MEMS-0001";
/// Standard errors of its gyros: noise is twice that of the mapping, all else is exact.
const SIGMA: &str = "{ angle_random_walk_deg_per_sqrt_h = 0.3, quantisation_arcsec = 0.0, bias = { sigma_deg_per_h = [0.0] }, \
                     increment_weight_ppm = 0.0, misalignment_arcsec = 0.0 }";
/// The same unit beside ROS 2.
const NATIVE: &str = "NATIVE";
/// Messages of the loop if nobody says otherwise.
const MESSAGES: usize = 4000;
/// Messages that may be under way: a publisher with `keep_all` waits for nobody else.
const UNDER_WAY: usize = 1000;
/// As stamps have it.
const START_NS: i64 = 1_700_000_000_000_000_000;

fn root() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// `isotherm-ros bridge` in a process of its own; killed when dropped.
struct Bridge {
    child: Child,
    ready: Value,
}

/// Writes the shipped mapping, but for what must not be lost here, documents and a configuration of the service.
fn prepare(folder: &Path) {
    let mapping = std::fs::read_to_string(root().join("config/ros2.toml")).unwrap();
    let changed = mapping.replace("history = \"keep_last\"", "history = \"keep_all\"");
    assert_ne!(changed, mapping);
    assert!(changed.lines().any(|line| line.starts_with("uncertainty_us = 200")));
    std::fs::write(folder.join("ros2.toml"), changed).unwrap();
    std::fs::create_dir_all(folder.join("units")).unwrap();
    let document = std::fs::read_to_string(root().join(format!("config/calibration/{UNIT}.toml"))).unwrap();
    for unit in [UNIT, NATIVE] {
        let own = document.replace(&format!("unit = \"{UNIT}\""), &format!("unit = \"{unit}\""));
        let own = own.replace("[[gyro.sensor]]\n", &format!("[[gyro.sensor]]\nsigma = {SIGMA}\n"));
        assert_eq!(own.matches(SIGMA).count(), 3);
        std::fs::write(folder.join(format!("units/{unit}.toml")), own).unwrap();
    }
    std::fs::write(folder.join("service.toml"), "calibrations = \"units\"\ncongestion = \"block\"\n")
        .unwrap();
}

impl Bridge {
    /// Starts it with a service in its process.
    fn start(folder: &Path, arguments: &[&str]) -> Self {
        prepare(folder);
        Self::launch(folder, &[&["--config", "service.toml"], arguments].concat())
    }

    /// Starts it in a folder that is prepared.
    fn launch(folder: &Path, arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_isotherm-ros"))
            .args(["bridge", "ros2.toml", "--announce", "--json"])
            .args(["--log-level", "error", "--domain", "7"])
            .args(arguments)
            .current_dir(folder)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::with_capacity(1, child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        Self { child, ready: serde_json::from_str(&line).expect("one line of JSON") }
    }

    fn locator(&self, of: &str) -> String {
        self.ready[of][0].as_str().expect("a locator").to_owned()
    }

    /// Asks it to stop; its exit code and its totals of the unit.
    fn stop(mut self) -> (Option<i32>, Value) {
        let asked = Command::new("kill").args(["-TERM", &self.child.id().to_string()]).status();
        assert!(asked.is_ok_and(|status| status.success()), "SIGTERM is sent");
        let mut totals = String::new();
        self.child.stdout.as_mut().unwrap().read_to_string(&mut totals).unwrap();
        let totals: Value = serde_json::from_str(&totals).expect("totals");
        (self.child.wait().unwrap().code(), totals["units"][UNIT].clone())
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A node that drives the bridge.
struct Driver {
    session: Session,
    node: Node,
    numbers: u32,
    tokens: Vec<zenoh::liveliness::LivelinessToken>,
}

/// A publisher of it.
struct Topic {
    publisher: Publisher<'static>,
    gid: [u8; 16],
    sequence: i64,
}

impl Topic {
    async fn put(&mut self, payload: Vec<u8>) {
        self.sequence += 1;
        self.put_as(payload, self.sequence).await;
    }

    async fn put_as(&self, payload: Vec<u8>, sequence: i64) {
        let attachment = Attachment { sequence, time_ns: 1, gid: self.gid };
        self.publisher.put(payload).attachment(attachment.to_bytes()).await.unwrap();
    }
}

impl Driver {
    /// Joins the graph through a router, as nodes do.
    async fn join(locator: &str) -> Self {
        let options = RosOptions { connect: vec![locator.to_owned()], ..RosOptions::default() };
        let session = open_config(options.to_config().unwrap()).await.unwrap();
        let node = Node {
            domain: 7,
            session: session.zid().to_string(),
            namespace: "/".to_owned(),
            name: "driver".to_owned(),
        };
        Self { session, node, numbers: 0, tokens: Vec::new() }
    }

    async fn publisher(&mut self, topic: &str, interface: Interface) -> Topic {
        self.numbers += 1;
        let token = self.node.endpoint(self.numbers, Kind::Publisher, topic, interface, Qos::SENSOR_DATA);
        self.tokens.push(self.session.liveliness().declare_token(&token).await.unwrap());
        let publisher = self.session.declare_publisher(key(7, topic, interface));
        let publisher = publisher.congestion_control(CongestionControl::Block).await.unwrap();
        let listener = publisher.matching_listener().await.unwrap();
        while !publisher.matching_status().await.unwrap().matching() {
            tokio::time::timeout(LIMIT, listener.recv_async()).await.expect("the bridge subscribes").unwrap();
        }
        Topic { publisher, gid: gid(&token), sequence: 0 }
    }

    /// Corrected messages and diagnostics, once the bridge knows of both: it has been told of them in this order.
    async fn hear(&self) -> (Heard, Heard) {
        let corrected = self.subscribe("/imu/data", IMU).await;
        let mut diagnostics = self.subscribe("/diagnostics", DIAGNOSTICS).await;
        diagnostics.next().await;
        (corrected, diagnostics)
    }

    /// Tokens of the nodes and endpoints that the graph has at this moment.
    async fn graph(&self) -> Vec<String> {
        let tokens = self.session.liveliness().get("@ros2_lv/7/**").timeout(LIMIT).await.unwrap();
        let mut graph = Vec::new();
        while let Ok(reply) = tokens.recv_async().await {
            graph.push(reply.into_result().unwrap().key_expr().to_string());
        }
        graph
    }

    /// What is heard on a topic; payload and attachment of each.
    async fn subscribe(&self, topic: &str, interface: Interface) -> Heard {
        let (sender, heard) = unbounded_channel();
        let subscriber = self.session.declare_subscriber(key(7, topic, interface)).callback(move |sample| {
            let attachment = sample.attachment().map(|bytes| bytes.to_bytes().into_owned());
            let _ = sender.send((sample.payload().to_bytes().into_owned(), attachment));
        });
        Heard { heard, _subscriber: subscriber.await.unwrap() }
    }

    async fn call(&self, service: &str, asked: Vec<u8>) -> TriggerResponse {
        let request = Attachment { sequence: 77, time_ns: 5, gid: [3; 16] };
        let get = self.session.get(key(7, service, TRIGGER)).target(QueryTarget::AllComplete).timeout(LIMIT);
        let get = get.payload(asked).attachment(request.to_bytes());
        let reply = get.await.unwrap().recv_async().await.expect("an answer").into_result().unwrap();
        let of = Attachment::parse(reply.attachment().map(ZBytes::to_bytes).as_deref()).unwrap();
        assert_eq!((of.sequence, of.gid), (77, [3; 16]), "clients know by these what is answered");
        from_cdr(&reply.payload().to_bytes()).unwrap()
    }
}

struct Heard {
    heard: UnboundedReceiver<(Vec<u8>, Option<Vec<u8>>)>,
    _subscriber: Subscriber<()>,
}

impl Heard {
    async fn next(&mut self) -> (Vec<u8>, Option<Vec<u8>>) {
        tokio::time::timeout(LIMIT, self.heard.recv()).await.expect("a message").expect("the session is open")
    }

    async fn imu(&mut self) -> Imu {
        from_cdr(&self.next().await.0).expect("an Imu message")
    }
}

fn scenario() -> Scenario {
    Scenario { start_ns: START_NS, tick_jitter_ns: 400_000, ..presets::mems_chamber(20) }
}

fn steps() -> impl Iterator<Item = Step> {
    Simulation::new(&scenario()).unwrap()
}

fn header(ns: i64) -> Header {
    Header { stamp: time(ns).unwrap(), frame_id: "raw_frame".to_owned() }
}

fn three(readings: &[f64]) -> [f64; 3] {
    readings.try_into().unwrap()
}

/// A step as a driver would state it.
fn message(step: &Step) -> Imu {
    let force = step.accel.as_ref().map(|tick| three(&tick.readings));
    Imu::new(header(step.gyro.end_time.as_ns()), Some(three(&step.gyro.readings)), force)
}

/// What `isotherm-replay correct` makes of the same readings: its own code. Durations are those between stamps.
struct Correct {
    offline: UnitStream,
    last_ns: Option<i64>,
}

impl Correct {
    fn new(folder: &Path) -> Self {
        let loaded = load_calibration(&folder.join("units").join(format!("{UNIT}.toml"))).unwrap();
        Self { offline: loaded.stream(UnitSettings::default()), last_ns: None }
    }

    fn take(&mut self, step: &Step) -> Vec<CorrectedTick> {
        let end = step.gyro.end_time.as_ns();
        let duration =
            isotherm_correction::units::Span::from_ns(end - self.last_ns.unwrap_or(end - 10_000_000));
        self.last_ns = Some(end);
        for reading in &step.temperatures {
            self.offline.handle(Event::Temperature(slice::from_ref(reading)));
        }
        if let Some(tick) = step.accel.clone() {
            let tick =
                isotherm_correction::sample::AccelTick { duration, end_time: step.gyro.end_time, ..tick };
            self.offline.handle(Event::Accel { output: OutputKind::Mean, ticks: &[tick] });
        }
        let tick = isotherm_correction::sample::GyroTick { duration, ..step.gyro.clone() };
        self.offline.handle(Event::Gyro { output: OutputKind::Mean, ticks: &[tick] });
        self.offline.take_ready()
    }
}

/// What must be equal to the bit: stamp, rates, specific forces.
fn bits(imu: &Imu) -> (i32, u32, [[u64; 3]; 2]) {
    let means = [imu.angular_velocity, imu.linear_acceleration];
    (
        imu.header.stamp.sec,
        imu.header.stamp.nanosec,
        means.map(|mean| <[f64; 3]>::from(mean).map(f64::to_bits)),
    )
}

/// Messages that are none, one after the other.
fn broken(number: usize) -> Vec<u8> {
    let mut payload = to_cdr(&Imu::new(header(START_NS), Some([0.0; 3]), None)).unwrap();
    match number % 4 {
        0 => payload.truncate(100),
        1 => payload[1] = 0,
        2 => payload[12..16].copy_from_slice(&[0xff; 4]),
        _ => payload.clear(),
    }
    payload
}

#[tokio::test(flavor = "multi_thread")]
async fn imu_messages_come_back_corrected_to_the_bit_and_none_is_lost() {
    let stated = std::env::var("ISOTHERM_ROS_MESSAGES").ok().and_then(|number| number.parse().ok());
    let messages = stated.unwrap_or(MESSAGES);
    let folder = tempfile::tempdir().unwrap();
    let bridge = Bridge::start(folder.path(), &["--listen", "127.0.0.1:0"]);
    let mut driver = Driver::join(&bridge.locator("ros")).await;
    let (mut corrected, mut diagnostics) = driver.hear().await;
    let channels: Vec<_> = steps().next().unwrap().temperatures.iter().map(|it| it.channel).collect();
    let mut temperatures = Vec::new();
    for channel in &channels {
        temperatures.push(driver.publisher(&format!("/imu/temperature/{channel}"), TEMPERATURE).await);
    }
    let mut raw = driver.publisher("/imu/data_raw", IMU).await;

    let (mut correct, mut expected) = (Correct::new(folder.path()), Vec::new());
    let (mut received, mut refused) = (Vec::new(), 0);
    for (number, step) in steps().take(messages).enumerate() {
        for reading in &step.temperatures {
            let index = channels.iter().position(|channel| *channel == reading.channel).unwrap();
            let header = header(reading.time.as_ns());
            let message = Temperature { header, temperature: reading.raw, variance: 0.0 };
            temperatures[index].put(to_cdr(&message).unwrap()).await;
        }
        raw.put(to_cdr(&message(&step)).unwrap()).await;
        if number % 100 == 50 {
            // What nobody understands has been numbered before: it leaves no gap.
            raw.put_as(broken(refused), raw.sequence).await;
            refused += 1;
        }
        expected.extend(correct.take(&step));
        while received.len() + UNDER_WAY < number {
            received.push(corrected.imu().await);
        }
    }
    correct.offline.flush();
    expected.extend(correct.offline.take_ready());
    while received.len() < messages {
        received.push(corrected.imu().await);
    }
    assert_eq!(expected.len(), messages);
    for (number, (imu, tick)) in received.iter().zip(&expected).enumerate() {
        let stated = Imu::of_tick(header(tick.end_time.as_ns()), tick);
        assert_eq!(bits(imu), bits(&stated), "message {number}");
        assert_eq!(imu.header.frame_id, "imu_link", "that of the mapping");
    }
    // 0.3 °/√h as the unit's σ has it and 0.03 (m/s)/√h of the mapping, as it has none of the accelerometers; over 10 ms, about axes that
    // are orthogonal but for minutes of arc.
    let last = &received[messages - 1];
    let duration_s = expected[messages - 1].duration.as_s();
    let (rate, force) = (last.angular_velocity_covariance[4], last.linear_acceleration_covariance[0]);
    assert!((rate * duration_s / 8.726_646e-5_f64.powi(2) - 1.0).abs() < 0.01, "{rate}");
    assert!((force * duration_s / 5e-4_f64.powi(2) - 1.0).abs() < 0.01, "{force}");

    let array: DiagnosticArray = from_cdr(&diagnostics.next().await.0).expect("diagnostics");
    assert_eq!(array.status.iter().map(|status| status.hardware_id.as_str()).collect::<Vec<_>>(), [UNIT]);
    let uncertainty =
        array.status[0].values.iter().find(|value| value.key == "stamp uncertainty, stated (us)");
    assert_eq!(uncertainty.map(|value| value.value.as_str()), Some("200.0"), "{array:?}");
    driver_and_services(&driver, &mut diagnostics, folder.path()).await;

    let (code, totals) = bridge.stop();
    let kinds = totals["refused"].as_object().unwrap();
    let all: u64 = kinds.values().filter_map(Value::as_u64).sum();
    assert_eq!((all, kinds.len()), (refused as u64, 2), "{totals}");
    for (key, value) in
        [("imu_in", messages), ("imu_out", messages), ("lost", 0), ("missing", 0), ("runs", 1)]
    {
        assert_eq!(totals[key], value, "{key}: {totals}");
    }
    assert_eq!(code, Some(0));
}

/// Standby, run and rollback by their services; a unit that hears nothing is stale.
async fn driver_and_services(driver: &Driver, diagnostics: &mut Heard, folder: &Path) {
    let empty = to_cdr(&TriggerRequest::default()).unwrap();
    let standby = driver.call("/isotherm/MEMS_0001/standby", empty.clone()).await;
    assert_eq!(standby, TriggerResponse { success: true, message: "MEMS-0001: standby".to_owned() });
    // Without the byte that ROS gives a message without fields.
    let run = driver.call("/isotherm/MEMS_0001/run", empty[..4].to_vec()).await;
    assert!(run.success && run.message.contains("running"), "{run:?}");
    let rollback = async || driver.call("/isotherm/MEMS_0001/rollback", empty.clone()).await;
    let refused = rollback().await;
    assert!(!refused.success && refused.message.contains(UNIT), "{refused:?}");
    // Another calibration by its folder; until it is there, there is nothing to go back to.
    let document = folder.join(format!("units/{UNIT}.toml"));
    let text = std::fs::read_to_string(&document).unwrap();
    let other = text.replacen(SIGMA, &SIGMA.replacen("0.3", "0.4", 1), 1);
    assert_ne!(other, text);
    std::fs::write(folder.join("other"), other).unwrap();
    std::fs::rename(folder.join("other"), document).unwrap();
    let deadline = Instant::now() + LIMIT;
    let mut went_back = refused;
    while !went_back.success {
        assert!(Instant::now() < deadline, "{went_back:?}");
        went_back = rollback().await;
    }
    assert!(went_back.message.contains(UNIT), "{went_back:?}");
    loop {
        let array: DiagnosticArray = from_cdr(&diagnostics.next().await.0).expect("diagnostics");
        if array.status[0].level == Level::Stale {
            return assert!(array.status[0].message.contains("/imu/data_raw"), "{array:?}");
        }
    }
}

/// Beside a router of theirs, with gaps: nodes find each other by gossip, and what is lost is announced.
#[tokio::test(flavor = "multi_thread")]
async fn a_router_of_theirs_and_a_driver_that_leaves_out_ticks() {
    let folder = tempfile::tempdir().unwrap();
    let mut config =
        RosOptions { listen: vec!["127.0.0.1:0".to_owned()], ..RosOptions::default() }.to_config().unwrap();
    set(&mut config, "timestamping/enabled", true).unwrap();
    let router = open_config(config).await.unwrap();
    let locator = isotherm_bus::locators(&router).remove(0);
    let bridge = Bridge::start(folder.path(), &["--connect", &locator]);
    let mut driver = Driver::join(&locator).await;
    let (mut corrected, mut diagnostics) = driver.hear().await;
    // The router knows a token a moment after it is declared.
    let deadline = Instant::now() + LIMIT;
    let output = |token: &String| token.contains("/MP/%/%/isotherm/%imu%data/");
    let graph = loop {
        let graph = driver.graph().await;
        if graph.iter().any(output) && graph.iter().any(|token| token.ends_with("/0/0/NN/%/%/isotherm")) {
            break graph;
        }
        assert!(Instant::now() < deadline, "{graph:#?}");
    };
    assert!(graph.iter().any(|token| output(token) && token.ends_with("/1:2:2,:,:,:,,")), "{graph:#?}");

    let mut raw = driver.publisher("/imu/data_raw", IMU).await;
    let mut sent = 0;
    for (number, step) in steps().take(300).enumerate() {
        match number {
            // Never published: stamps show it. Lost on the way: numbers do.
            100..103 => {}
            200..205 => raw.sequence += 1,
            _ => {
                raw.put(to_cdr(&message(&step)).unwrap()).await;
                sent += 1;
            }
        }
    }
    for _ in 0..sent {
        corrected.imu().await;
    }
    let mut told = [0, 0];
    while told != [2, 8] {
        let array: DiagnosticArray = from_cdr(&diagnostics.next().await.0).expect("diagnostics");
        let status = &array.status[0];
        let said = status.message.split("; ").find(|said| said.ends_with(" ticks missing"));
        let Some(said) = said else { continue };
        assert!(status.level >= Level::Warn, "{status:?}");
        let numbers: Vec<u64> = said.split(' ').filter_map(|word| word.parse().ok()).collect();
        assert_eq!(said, format!("{} gaps, {} ticks missing", numbers[0], numbers[1]));
        told = [told[0] + numbers[0], told[1] + numbers[1]];
    }
    let (code, totals) = bridge.stop();
    for (key, value) in [("gaps", 2), ("missing", 8), ("announced_missing", 8)] {
        assert_eq!(totals[key], value, "{key}: {totals}");
    }
    assert_eq!((code, totals["imu_out"].as_u64()), (Some(0), Some(sent)), "{totals}");
    close(driver.session, LIMIT).await.unwrap();
    close(router, LIMIT).await.unwrap();
}

/// Median and 99th percentile.
fn quantiles(mut times: Vec<Duration>) -> [Duration; 2] {
    times.sort_unstable();
    [times[times.len() / 2], times[times.len() * 99 / 100]]
}

/// One message at a time, by way of ROS 2 and on the project's own topics, through one service in one run: printed, and never another
/// order of magnitude (`just ros-loop`).
#[tokio::test(flavor = "multi_thread")]
async fn the_way_through_ros_costs_little() {
    const WARM: usize = 100;
    let folder = tempfile::tempdir().unwrap();
    let bridge = Bridge::start(folder.path(), &["--listen", "127.0.0.1:0"]);
    let mut driver = Driver::join(&bridge.locator("ros")).await;
    let (mut corrected, _diagnostics) = driver.hear().await;
    let mut raw = driver.publisher("/imu/data_raw", IMU).await;
    let unit = UnitId::new(NATIVE).unwrap();
    let options = SessionOptions { connect: vec![bridge.locator("service")], ..SessionOptions::default() };
    let (source, sink) = (open(&options).await.unwrap(), open(&options).await.unwrap());
    let mut consumer = Consumer::declare(&sink, Some(&unit)).await.unwrap();
    let mut producer = Producer::declare(&source, &unit, ProducerOptions::default()).await.unwrap();
    isotherm_bus::presence::wait_for_service(&sink, LIMIT).await.unwrap();
    let (mut ros, mut native) = (Vec::new(), Vec::new());
    for (number, step) in steps().take(1000 + WARM).enumerate() {
        let start = Instant::now();
        raw.put(to_cdr(&message(&step)).unwrap()).await;
        corrected.imu().await;
        let by_ros = start.elapsed();
        let start = Instant::now();
        producer.accel(OutputKind::Mean, step.accel.unwrap()).await.unwrap();
        producer.gyro(OutputKind::Mean, step.gyro).await.unwrap();
        tokio::time::timeout(LIMIT, consumer.next()).await.expect("a batch").unwrap();
        if number >= WARM {
            ros.push(by_ros);
            native.push(start.elapsed());
        }
    }
    let ([ros, ros_99], [native, native_99]) = (quantiles(ros), quantiles(native));
    println!(
        "ROS 2: p50 {ros:?}, p99 {ros_99:?}; own topics: p50 {native:?}, p99 {native_99:?}; ratio of medians {:.1}",
        ros.as_secs_f64() / native.as_secs_f64()
    );
    assert!(ros < native * 20 + Duration::from_millis(2), "{ros:?} against {native:?}");
    for session in [source, sink] {
        close(session, LIMIT).await.unwrap();
    }
    assert_eq!(bridge.stop().0, Some(0));
}
