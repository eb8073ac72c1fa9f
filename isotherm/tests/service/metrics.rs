//! Metrics and health of a running service, over real HTTP connections.

#[path = "../../../service/src/observe/metrics/tests/checker.rs"]
mod checker;
#[path = "../../../service/src/observe/metrics/tests/client.rs"]
pub(crate) mod client;
mod served;

use std::io::{Read, Write};
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use checker::Page;
use client::{Answer, connect, get, read, say};
use flate2::read::GzDecoder;
use isotherm_bus::{Consumer, Producer, ProducerOptions, SessionOptions, locators, open, presence};
use isotherm_correction::sample::{GyroTick, OutputKind};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::key::UnitId;
use isotherm_service::config::MetricsSettings;
use isotherm_service::{RunningService, Settings, start};
use zenoh::Session;

const LIMIT: Duration = Duration::from_secs(30);

/// A service with metrics on a port of the system's choice, where it is not said.
async fn service(settings: Settings) -> (RunningService, Session, SocketAddr) {
    let listen = settings.metrics.listen.or(Some("127.0.0.1:0".parse().unwrap()));
    let settings = Settings { metrics: MetricsSettings { listen, allow_remote: false }, ..settings };
    let session = open(&settings.zenoh.session).await.unwrap();
    let connect = locators(&session);
    let service = start(settings, session).await.unwrap();
    let address = service.metrics().unwrap();
    let client = open(&SessionOptions { connect, ..SessionOptions::default() }).await.unwrap();
    (service, client, address)
}

/// Sends ticks of a unit, and waits until they have come back.
async fn run_unit(session: &Session, unit: &UnitId, ticks: u64) {
    let mut consumer = Consumer::declare(session, None).await.unwrap();
    presence::wait_for_service(session, LIMIT).await.unwrap();
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
    producer.flush().await.unwrap();
    while consumer.continuity(unit).ticks < ticks {
        tokio::time::timeout(LIMIT, consumer.next()).await.unwrap().unwrap();
    }
}

fn page(address: SocketAddr) -> Page {
    let answer = get(address, "/metrics");
    assert_eq!(answer.status, 200);
    Page::read(&answer.body).unwrap_or_else(|wrong| panic!("{wrong}\n{}", answer.body))
}

/// Asks for the health until it is as stated.
fn until(address: SocketAddr, status: u16) -> Answer {
    let deadline = Instant::now() + LIMIT;
    loop {
        let answer = get(address, "/healthz");
        if answer.status == status {
            return answer;
        }
        assert!(Instant::now() < deadline, "{answer:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn the_page_says_what_came_in_and_what_went_out() {
    // An address that no other test has: what is free after the end stays free.
    let listen = Some("127.0.0.77:0".parse().unwrap());
    let metrics = MetricsSettings { listen, ..MetricsSettings::default() };
    let (service, session, address) = service(Settings { metrics, ..Settings::default() }).await;
    let empty = page(address);
    assert_eq!(empty.value("isotherm_units", &[]), Some(0.0));
    assert_eq!(empty.value("isotherm_build_info", &[("version", env!("CARGO_PKG_VERSION"))]), Some(1.0));
    assert!(empty.0["isotherm_unit_ticks_out"].is_empty(), "no unit, no sample, but the metric is described");

    let unit = UnitId::new("METRICS-1").unwrap();
    run_unit(&session, &unit, 500).await;
    let bad = vec![0_u8; 40];
    session.put("imu/METRICS-1/raw/gyro", bad.clone()).await.unwrap();
    session.put("imu/STRANGE/raw/gyro", bad).await.unwrap();
    let of_unit = [("unit", "METRICS-1")];
    let deadline = Instant::now() + LIMIT;
    let refused = [("kind", "bad_frames_kind")];
    // Two queues of Zenoh's: the frames arrive some time.
    let page = loop {
        let page = page(address);
        if page.value("isotherm_refused_messages_total", &refused) == Some(1.0)
            && page.value("isotherm_unit_bad_frames_total", &of_unit) == Some(1.0)
        {
            break page;
        }
        assert!(Instant::now() < deadline);
    };
    let value = |name: &str| page.value(name, &of_unit).unwrap_or_else(|| panic!("{name}"));
    let status = service.status(&unit).unwrap();
    for (name, expected) in [
        ("isotherm_unit_gyro_ticks_in_total", 500.0),
        ("isotherm_unit_ticks_out_total", 500.0),
        ("isotherm_unit_gaps_total", 0.0),
        ("isotherm_unit_accel_missing_total", status.counter("accel_missing").to_string().parse().unwrap()),
        ("isotherm_unit_revision", 0.0),
        ("isotherm_unit_stalled", 0.0),
        ("isotherm_healthy", 1.0),
    ] {
        let labels = if name.starts_with("isotherm_unit") { &of_unit[..] } else { &[] };
        assert_eq!(page.value(name, labels), Some(expected), "{name}");
    }
    let state = |state| page.value("isotherm_unit_state", &[of_unit[0], ("state", state)]);
    assert_eq!(state("standby"), Some(0.0));
    assert_eq!(state(status.state.name()), Some(1.0));
    assert_eq!(page.value("isotherm_unit_output", &[of_unit[0], ("output", "pass-through")]), Some(1.0));
    assert_eq!(
        page.value("isotherm_unit_faults_total", &[of_unit[0], ("kind", "bad_frames_kind")]),
        Some(1.0)
    );
    let count = value("isotherm_unit_added_latency_seconds_count");
    let sum = value("isotherm_unit_added_latency_seconds_sum");
    assert!(count >= 1.0 && sum > 0.0 && sum / count < 1.0, "{count} {sum}");
    let all = page.value("isotherm_unit_added_latency_seconds_bucket", &[of_unit[0], ("le", "+Inf")]);
    assert_eq!(all, Some(count));
    service.stop().await;
    assert!(std::net::TcpStream::connect(address).is_err(), "nobody answers behind the end");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn health_goes_with_the_state_folder_and_comes_back() {
    let base = tempfile::tempdir().unwrap();
    let (state, away) = (base.path().join("state"), base.path().join("away"));
    let (service, session, address) =
        service(Settings { state: Some(state.clone()), ..Settings::default() }).await;
    let unit = UnitId::new("HEALTH-1").unwrap();
    run_unit(&session, &unit, 20).await;
    let answer = until(address, 200);
    assert_eq!(answer.header("content-type"), Some("application/json"));
    let verdict = answer.json();
    assert_eq!((&verdict["status"], &verdict["reasons"]), (&"ok".into(), &serde_json::json!([])));
    assert_eq!(verdict["units"][0]["unit"], "HEALTH-1");
    assert_eq!(verdict["units"][0]["output"], "pass-through");
    assert!(verdict["units"][0]["state"].as_str().unwrap().starts_with("running"), "{verdict}");
    assert_eq!(page(address).value("isotherm_state_folder_writable", &[]), Some(1.0));

    std::fs::rename(&state, &away).unwrap();
    let verdict = until(address, 503).json();
    let reason = &verdict["reasons"][0];
    assert_eq!(reason["kind"], "state-folder");
    let words = reason["words"].as_str().unwrap();
    assert!(words.contains(state.to_str().unwrap()), "{words}");
    assert_eq!(verdict["units"][0]["unit"], "HEALTH-1", "the units are told all the same");
    assert_eq!(page(address).value("isotherm_state_folder_writable", &[]), Some(0.0));

    std::fs::rename(&away, &state).unwrap();
    until(address, 200);
    assert!(!service.stop().await.lost());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn every_kind_of_request_gets_the_answer_that_it_should() {
    let (service, _session, address) = service(Settings::default()).await;
    let plain = get(address, "/metrics");
    assert_eq!(plain.header("content-type"), Some("text/plain; version=0.0.4; charset=utf-8"));
    assert_eq!(plain.header("content-length"), Some(plain.body.len().to_string().as_str()));
    assert_eq!(plain.header("connection"), Some("close"));
    // As Prometheus asks.
    let accept = "application/openmetrics-text;version=1.0.0;q=0.5,text/plain;version=0.0.4;q=0.3,*/*;q=0.2";
    let open = say(address, &format!("GET /metrics?x=1 HTTP/1.1\r\nHost: x\r\nAccept: {accept}\r\n\r\n"));
    assert_eq!(
        open.header("content-type"),
        Some("application/openmetrics-text; version=1.0.0; charset=utf-8")
    );
    Page::read(&open.body).unwrap();

    let mut packed = connect(address);
    packed.write_all(b"GET /metrics HTTP/1.1\r\nHost: x\r\nAccept-Encoding: br, gzip;q=0.5\r\n\r\n").unwrap();
    let mut answer = Vec::new();
    packed.read_to_end(&mut answer).unwrap();
    let head = answer.windows(4).position(|end| end == b"\r\n\r\n").unwrap() + 4;
    assert!(String::from_utf8_lossy(&answer[..head]).contains("content-encoding: gzip\r\n"));
    let mut unpacked = String::new();
    GzDecoder::new(&answer[head..]).read_to_string(&mut unpacked).unwrap();
    Page::read(&unpacked).unwrap();
    let refuses = say(address, "GET /metrics HTTP/1.1\r\nHost: x\r\nAccept-Encoding: gzip;q=0\r\n\r\n");
    assert_eq!(refuses.header("content-encoding"), None);

    for path in ["/metrics", "/healthz", "/livez", "/readyz"] {
        let head = say(address, &format!("HEAD {path} HTTP/1.1\r\nHost: x\r\n\r\n"));
        assert_eq!((head.status, head.body.as_str()), (200, ""), "{path}");
        assert!(head.header("content-length").unwrap().parse::<usize>().unwrap() > 0);
        for method in ["POST", "PUT", "DELETE", "OPTIONS", "BREW"] {
            let answer =
                say(address, &format!("{method} {path} HTTP/1.1\r\nHost: x\r\nContent-Length: 0\r\n\r\n"));
            assert_eq!((answer.status, answer.header("allow")), (405, Some("GET, HEAD")), "{method} {path}");
        }
    }
    for path in ["/", "/metrics/", "/Metrics", "/healthz/x", "/../etc/passwd", "/%6detrics"] {
        assert_eq!(get(address, path).status, 404, "{path}");
    }
    assert_eq!(say(address, "GET /healthz HTTP/1.0\r\n\r\n").status, 200, "HTTP/1.0 too");
    for nonsense in
        ["nonsense\r\n\r\n", "GET /metrics SPDY/7\r\n\r\n", "GET /metrics HTTP/1.1\r\nno colon\r\n\r\n"]
    {
        assert_eq!(say(address, nonsense).status, 400, "{nonsense:?}");
    }
    assert_eq!(get(address, "/healthz").status, 200, "after all that");
    service.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn a_request_that_is_too_long_or_too_slow_is_ended() {
    let (service, _session, address) = service(Settings::default()).await;
    let long = "x".repeat(100_000);
    for request in [
        format!("GET /metrics HTTP/1.1\r\nHost: x\r\nX-Long: {long}\r\n\r\n"),
        format!("GET /metrics HTTP/1.1\r\nHost: x\r\n{}\r\n", "X-Many: 1\r\n".repeat(500)),
        format!("GET /{long} HTTP/1.1\r\nHost: x\r\n\r\n"),
        long.repeat(10),
    ] {
        let mut stream = connect(address);
        // The end may come in the middle of it.
        let _ = stream.write_all(request.as_bytes());
        let answer = read(stream);
        let refused = answer.as_ref().is_none_or(|answer| [400, 414, 431].contains(&answer.status));
        assert!(refused, "{answer:?} to {:?}…", &request[..40]);
    }
    // A body is never read: the answer does not wait for it.
    let mut stream = connect(address);
    stream.write_all(b"POST /metrics HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000000\r\n\r\n").unwrap();
    assert_eq!(read(stream).map(|answer| answer.status), Some(405));

    let start = Instant::now();
    let mut slow = connect(address);
    slow.write_all(b"GET /metrics HTTP/1.1\r\nHost: ").unwrap();
    assert_eq!(get(address, "/healthz").status, 200, "others do not wait for it");
    assert!(read(slow).is_none_or(|answer| answer.status == 408));
    assert!(start.elapsed() < Duration::from_secs(15), "{:?}", start.elapsed());
    service.stop().await;
}
