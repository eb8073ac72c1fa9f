use std::io::Write;
use std::net::TcpStream;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Mutex as StdMutex, PoisonError};
use std::time::Instant;

use isotherm_correction::sample::{AccelTick, ChannelName, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec::encode;
use isotherm_protocol::document::{Document, Parsed};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::raw::{AccelBatch, GyroBatch, TemperatureBatch};

use super::*;
use crate::config::Settings;
use crate::control::revision::Calibrations;
use crate::observe::instance::Instance;
use crate::pair::Pair;
use crate::receive::intake::{Intake, OutletMaker};
use crate::receive::pulse::Pulse;
use checker::Page;
use client::{connect, get, read};

mod checker;
mod client;

const LIMIT: Duration = Duration::from_secs(30);

/// An endpoint over units whose output goes where the test wants it.
struct Stand {
    intake: Arc<Intake>,
    endpoint: Endpoint,
    /// What a tick of the unit "U" has: kind of output and number of gyros.
    shape: (OutputKind, usize),
    sequence: u64,
}

fn on_loopback() -> MetricsSettings {
    MetricsSettings { listen: Some("127.0.0.1:0".parse().unwrap()), allow_remote: false }
}

fn source(settings: &Settings, intake: &Arc<Intake>) -> Source {
    let pair = Arc::new(Pair::new(settings, "test".to_owned(), 0, Vec::new()));
    let instance = Instance::new(Arc::clone(intake), pair, Arc::default(), None);
    Source::new(Arc::new(instance), Arc::new(Pulse::new(settings.congestion)))
}

fn watch() -> Watch {
    Watch::of(&UnitSettings::default())
}

impl Stand {
    async fn new(outlets: OutletMaker, watch: Watch, limits: Limits) -> Self {
        let mut settings = Settings::default();
        // So that every tick leaves with the one behind it.
        settings.unit.pairing_window = Span::from_ms(1);
        let mut calibrations = Calibrations::default();
        let Parsed { calibration, .. } =
            Document::parse(include_str!("../../../../config/calibration/ZLG-0001.toml"), None).unwrap();
        let shape = (calibration.gyro_output(), calibration.gyro_count());
        calibrations.insert(UnitId::new("U").unwrap(), Arc::new(calibration), [7; 8]);
        let intake = Arc::new(Intake::new(settings.clone(), calibrations, outlets));
        let endpoint = Endpoint::start_within(&on_loopback(), String::new(), watch, limits).await;
        let endpoint = endpoint.unwrap().unwrap();
        endpoint.open(source(&settings, &intake), None);
        Self { intake, endpoint, shape, sequence: 0 }
    }

    /// The unit's next raw tick comes in.
    fn tick(&mut self) {
        self.sequence += 1;
        self.intake.receive(
            "imu/U/raw/gyro",
            Some(&gyro_frame(self.shape.0, self.sequence, self.shape.1)),
            Instant::now(),
        );
    }

    /// Lets ticks come until the service's health is as stated.
    fn until(&mut self, status: u16) -> serde_json::Value {
        let deadline = Instant::now() + LIMIT;
        loop {
            self.tick();
            let answer = get(self.endpoint.address(), "/healthz");
            if answer.status == status {
                return answer.json();
            }
            assert!(Instant::now() < deadline, "{answer:?}");
        }
    }

    fn page(&self) -> Page {
        Page::read(&get(self.endpoint.address(), "/metrics").body).unwrap()
    }
}

fn gyro_frame(kind: OutputKind, sequence: u64, sensors: usize) -> Vec<u8> {
    let tick = GyroTick {
        sequence,
        end_time: Timestamp::from_ns(i64::try_from(sequence).unwrap() * 5_000_000),
        duration: Span::from_ms(5),
        readings: std::iter::repeat_n(1.0, sensors).collect(),
        ..GyroTick::default()
    };
    encode(&GyroBatch { output: kind, ticks: vec![tick] }).unwrap()
}

/// Everything goes out.
fn good() -> OutletMaker {
    Box::new(|_| Ok(Box::new(|_| Ok(()))))
}

#[tokio::test(flavor = "multi_thread")]
async fn an_alarm_is_told_and_passes() {
    let outlets: OutletMaker = Box::new(|_| {
        let mut frames = 0;
        Ok(Box::new(move |_| {
            frames += 1;
            assert_ne!(frames, 3, "on purpose");
            Ok(())
        }))
    });
    let watch = Watch::new((LIMIT, 2), Duration::from_millis(300));
    let mut stand = Stand::new(outlets, watch, Limits::default()).await;
    let verdict = stand.until(503);
    assert_eq!(verdict["status"], "unhealthy");
    let reason = &verdict["reasons"][0];
    assert_eq!((&reason["kind"], &reason["unit"]), (&"alarm".into(), &"U".into()), "{verdict}");
    assert_eq!(stand.until(200)["reasons"], serde_json::json!([]));
    let page = stand.page();
    let alarms = [("unit", "U"), ("kind", "alarms")];
    assert_eq!(page.value("isotherm_unit_faults_total", &alarms), Some(1.0), "the count stays");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_unit_that_gives_nothing_out_is_told_until_it_does() {
    let fails = Arc::new(AtomicBool::new(true));
    let failing = Arc::clone(&fails);
    let outlets: OutletMaker = Box::new(move |_| {
        let failing = Arc::clone(&failing);
        Ok(Box::new(move |_| if failing.load(Ordering::Relaxed) { Err("no route".into()) } else { Ok(()) }))
    });
    let watch = Watch::new((Duration::from_millis(300), 2), LIMIT);
    let mut stand = Stand::new(outlets, watch, Limits::default()).await;
    let verdict = stand.until(503);
    assert_eq!(verdict["reasons"][0]["kind"], "no-output", "{verdict}");
    assert_eq!(verdict["units"][0]["unit"], "U");
    let page = stand.page();
    assert_eq!(page.value("isotherm_unit_stalled", &[("unit", "U")]), Some(1.0));
    assert_eq!(page.value("isotherm_healthy", &[]), Some(0.0));
    fails.store(false, Ordering::Relaxed);
    stand.until(200);
    assert_eq!(stand.page().value("isotherm_unit_stalled", &[("unit", "U")]), Some(0.0));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_unit_that_is_held_up_holds_one_look_up_and_nothing_else() {
    let (release, held): (Sender<()>, Receiver<()>) = channel();
    let held = Arc::new(StdMutex::new(held));
    let (entered, inside) = channel();
    let outlets: OutletMaker = Box::new(move |_| {
        let (held, entered) = (Arc::clone(&held), entered.clone());
        Ok(Box::new(move |_| {
            let _ = entered.send(());
            let _ = held.lock().unwrap_or_else(PoisonError::into_inner).recv();
            Ok(())
        }))
    });
    let limits = Limits { look: Duration::from_millis(200), ..Limits::default() };
    let stand = Stand::new(outlets, watch(), limits).await;
    let (intake, (kind, sensors)) = (Arc::clone(&stand.intake), stand.shape);
    let receiving = std::thread::spawn(move || {
        for sequence in 0..20 {
            intake.receive("imu/U/raw/gyro", Some(&gyro_frame(kind, sequence, sensors)), Instant::now());
        }
    });
    inside.recv_timeout(LIMIT).unwrap();
    for _ in 0..20 {
        let answer = get(stand.endpoint.address(), "/healthz");
        assert_eq!((answer.status, &answer.json()["reasons"][0]["kind"]), (503, &"busy".into()));
    }
    assert_eq!(get(stand.endpoint.address(), "/metrics").status, 503);
    for (path, status) in [("/", 404), ("/livez", 200), ("/readyz", 200)] {
        assert_eq!(
            get(stand.endpoint.address(), path).status,
            status,
            "{path}: who asks for less is answered"
        );
    }
    drop(release);
    receiving.join().unwrap();
    let deadline = Instant::now() + LIMIT;
    while get(stand.endpoint.address(), "/healthz").status != 200 {
        assert!(Instant::now() < deadline);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_stops_is_not_healthy_and_still_tells_its_metrics() {
    let stand = Stand::new(good(), watch(), Limits::default()).await;
    let address = stand.endpoint.address();
    assert_eq!(get(address, "/healthz").status, 200);
    stand.endpoint.stopping();
    let answer = get(address, "/healthz");
    assert_eq!((answer.status, answer.header("content-type")), (503, Some("application/json")));
    assert_eq!(answer.json()["reasons"][0]["kind"], "stopping");
    assert_eq!([get(address, "/livez").status, get(address, "/readyz").status], [200, 503]);
    assert_eq!(stand.page().value("isotherm_healthy", &[]), Some(0.0));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_unit_without_a_calibration_says_nothing_of_the_services_health() {
    let watch = Watch::new((Duration::from_millis(100), 2), LIMIT);
    let limits = Limits { interval: Duration::from_millis(10), ..Limits::default() };
    let stand = Stand::new(good(), watch, limits).await;
    let address = stand.endpoint.address();
    let mut bad = gyro_frame(OutputKind::Counts, 0, 3);
    stand.intake.receive("imu/INVENTED/raw/gyro", Some(&bad), Instant::now());
    bad[0] ^= 0xff;
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(1) {
        stand.intake.receive("imu/INVENTED/raw/gyro", Some(&bad), Instant::now());
        let answer = get(address, "/healthz");
        assert_eq!(answer.status, 200, "{answer:?}");
    }
    assert_eq!(stand.page().value("isotherm_units", &[]), Some(1.0), "it has appeared");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_still_waits_is_alive_and_says_what_for() {
    let settings = Settings { metrics: on_loopback(), ..Settings::default() };
    let endpoint = Endpoint::start(&settings, "a router".to_owned()).await.unwrap().unwrap();
    let address = endpoint.address();
    assert_eq!(get(address, "/livez").status, 200);
    let answer = get(address, "/readyz");
    assert_eq!((answer.status, answer.body.contains("a router")), (503, true), "{answer:?}");
    let answer = get(address, "/healthz");
    assert_eq!((answer.status, answer.json()["reasons"][0]["kind"].as_str()), (503, Some("starting")));
    let page = Page::read(&get(address, "/metrics").body).unwrap();
    assert_eq!(page.value("isotherm_healthy", &[]), Some(0.0));
}

/// Connections that have sent this and read nothing, beside which others are still answered soon.
fn occupy(address: SocketAddr, count: usize, request: &[u8], path: &str) -> Vec<TcpStream> {
    let send = |_| {
        let mut stream = connect(address);
        stream.write_all(request).unwrap();
        stream
    };
    let streams = (0..count).map(send).collect();
    let start = Instant::now();
    for _ in 0..10 {
        assert_eq!(get(address, path).status, 200);
    }
    assert!(start.elapsed() < LIMIT / 2, "{:?}", start.elapsed());
    streams
}

#[tokio::test(flavor = "multi_thread")]
async fn connections_that_say_nothing_keep_nobody_out() {
    let limits = Limits { head: LIMIT, connection: LIMIT, ..Limits::default() };
    let stand = Stand::new(good(), watch(), limits).await;
    let address = stand.endpoint.address();
    let request = b"GET /metrics HTTP/1.1\r\nHost: x\r\nX-Slow: ";
    let idle = occupy(address, http::MAX_CONNECTIONS * 3, request, "/healthz");
    // The oldest have made room.
    for stream in idle.into_iter().take(http::MAX_CONNECTIONS * 2) {
        assert!(read(stream).is_none());
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn connections_that_do_not_take_their_answer_keep_nobody_out() {
    let limits = Limits { head: LIMIT, connection: LIMIT, ..Limits::default() };
    let endpoint = Endpoint::start_within(&on_loopback(), String::new(), watch(), limits).await;
    let endpoint = endpoint.unwrap().unwrap();
    let settings = Settings::default();
    // The system holds little of an answer that is not taken: a page of many units does not fit.
    let socket = tokio::net::TcpSocket::new_v4().unwrap();
    socket.set_send_buffer_size(1 << 14).unwrap();
    socket.bind("127.0.0.1:0".parse().unwrap()).unwrap();
    let listener = socket.listen(1024).unwrap();
    let address = listener.local_addr().unwrap();
    let serving = tokio::spawn(http::serve(listener, Arc::clone(&endpoint.exporter)));
    let intake = fleet(include_str!("../../../../config/calibration/ZLG-0001.toml"), 200, 2);
    endpoint.open(source(&settings, &intake), None);
    let request = b"GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n";
    drop(occupy(address, http::MAX_CONNECTIONS + 8, request, "/livez"));
    serving.abort();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_connection_ends_at_its_limit_whatever_goes_on() {
    let limits = Limits { connection: Duration::from_millis(300), head: LIMIT, ..Limits::default() };
    let stand = Stand::new(good(), watch(), limits).await;
    let start = Instant::now();
    let mut stream = connect(stand.endpoint.address());
    stream.write_all(b"GET /metrics HTTP/1.1\r\nHost: x\r\nX-Slow: ").unwrap();
    assert!(read(stream).is_none());
    assert!(start.elapsed() >= limits.connection && start.elapsed() < LIMIT);
}

#[tokio::test]
async fn an_address_that_others_could_reach_is_not_taken() {
    let listen = Some("0.0.0.0:0".parse().unwrap());
    let start = async |metrics| {
        let settings = Settings { metrics, ..Settings::default() };
        Endpoint::start(&settings, String::new()).await
    };
    let error = start(MetricsSettings { listen, allow_remote: false }).await.unwrap_err();
    assert!(error.to_string().contains("0.0.0.0:0") && error.to_string().contains("allow_remote"), "{error}");
    assert!(start(MetricsSettings { listen, allow_remote: true }).await.unwrap().is_some());
    assert!(start(MetricsSettings::default()).await.unwrap().is_none());
}

/// Units, all of one document, that have corrected some ticks.
fn fleet(document: &str, units: usize, ticks: u64) -> Arc<Intake> {
    let Parsed { calibration, document, .. } = Document::parse(document, None).unwrap();
    let calibration = Arc::new(calibration);
    let mut calibrations = Calibrations::default();
    let serials: Vec<_> = (0..units).map(|unit| format!("ZLG-{unit:04}")).collect();
    for serial in &serials {
        calibrations.insert(UnitId::new(serial).unwrap(), Arc::clone(&calibration), [7; 8]);
    }
    let settings = Settings { max_units: units, ..Settings::default() };
    let intake = Arc::new(Intake::new(settings, calibrations, good()));
    let channels: Vec<_> = document
        .temperature
        .channel
        .iter()
        .map(|channel| ChannelName::from(&channel.name).unwrap())
        .collect();
    for sequence in 1..=ticks {
        let end_time = Timestamp::from_ns(i64::try_from(sequence).unwrap() * 5_000_000);
        let reading = |&channel| TemperatureReading { channel, time: end_time, raw: 1.8 };
        let temperatures = TemperatureBatch { readings: channels.iter().map(reading).collect() };
        let temperatures = encode(&temperatures).unwrap();
        let accel = AccelTick {
            sequence,
            end_time,
            duration: Span::from_ms(5),
            readings: std::iter::repeat_n(1.0, calibration.accel_count()).collect(),
        };
        let accel = encode(&AccelBatch { output: calibration.accel_output(), ticks: vec![accel] }).unwrap();
        let gyro = gyro_frame(calibration.gyro_output(), sequence, calibration.gyro_count());
        for serial in &serials {
            for (stream, frame) in [("temp", &temperatures), ("accel", &accel), ("gyro", &gyro)] {
                intake.receive(&format!("imu/{serial}/raw/{stream}"), Some(frame), Instant::now());
            }
        }
    }
    intake
}

/// Looks at two hundred units of a document: the page, and the shortest time that it took.
fn two_hundred(document: &str) -> (String, Duration) {
    let intake = fleet(document, 200, 40);
    let settings = Settings::default();
    let source = source(&settings, &intake);
    let mut watch = Watch::of(&settings.unit);
    let (mut text, mut shortest) = (String::new(), Duration::MAX);
    for _ in 0..5 {
        let start = Instant::now();
        let look = source.look(&mut watch, false);
        let looked = start.elapsed();
        text = page::page(look).unwrap();
        shortest = shortest.min(start.elapsed());
        let (bytes, lines, made) = (text.len(), text.lines().count(), start.elapsed());
        let packed = page::pack(&text).unwrap();
        println!(
            "{bytes} bytes, {lines} lines, look {looked:?}, text {made:?}; packed {} bytes, {:?}",
            packed.len(),
            start.elapsed()
        );
        assert!(packed.len() < bytes / 5, "{}", packed.len());
    }
    (text, shortest)
}

#[test]
fn a_page_of_two_hundred_units_is_whole_quick_and_of_bounded_size() {
    for document in [
        include_str!("../../../../config/calibration/ZLG-0001.toml"),
        include_str!("../../../../config/calibration/example-full.toml"),
    ] {
        let (text, time) = two_hundred(document);
        let page = Page::read(&text).unwrap();
        assert_eq!(page.value("isotherm_units", &[]), Some(200.0));
        let unit = [("unit", "ZLG-0199")];
        assert!(page.value("isotherm_unit_ticks_out_total", &unit).unwrap() > 0.0);
        assert_eq!(page.value("isotherm_unit_revision", &unit), Some(1.0));
        let seen = page.0.values().filter(|family| !family.is_empty()).count();
        assert!(seen > 60, "{seen} metrics with samples");
        assert!(text.len() < 2_000_000, "{}", text.len());
        // Generous: other tests keep the machine busy.
        assert!(time < Duration::from_secs(1), "{time:?}");
    }
}
