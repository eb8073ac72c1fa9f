//! Who is answered what, and who is not.

use std::io::{Read, Write};
use std::net::SocketAddr;
use std::path::Path;
use std::time::{Duration, Instant};

use flate2::read::GzDecoder;
use isotherm_bus::{SessionOptions, locators, open};
use isotherm_protocol::history::AuditEvent;
use isotherm_service::config::{MetricsSettings, WebSettings, ZenohSettings};
use isotherm_service::{Settings, start};
use serde_json::{Value, json};

use crate::control::stand::{Folders, LIMIT, Stand, UNIT, assert_accepted, document};
use crate::metrics::client::{Answer, connect, get, read as read_answer, say};

const TOKEN: &str = "a-token-for-tests-0123456789abcdef";

fn settings(folders: &Folders, write: bool) -> Settings {
    let token = folders.documents.with_file_name("token");
    std::fs::write(&token, TOKEN).unwrap();
    let listen = Some("127.0.0.1:0".parse().unwrap());
    Settings {
        metrics: MetricsSettings { listen, allow_remote: false },
        web: WebSettings { enabled: true, write, hosts: Vec::new(), token_file: Some(token) },
        ..folders.settings()
    }
}

async fn stand(folders: &Folders, write: bool) -> (Stand, SocketAddr) {
    let stand = Stand::start(settings(folders, write)).await;
    let address = stand.service.metrics().unwrap();
    (stand, address)
}

/// A request as the console's own page sends it, with other headers in the place of its own.
fn send(address: SocketAddr, method: &str, path: &str, others: &[(&str, &str)], body: &str) -> Answer {
    let own = [
        ("Host", address.to_string()),
        ("Authorization", format!("Bearer {TOKEN}")),
        ("Origin", format!("http://{address}")),
        ("Sec-Fetch-Site", "same-origin".to_owned()),
        ("Content-Type", "application/json".to_owned()),
        ("Content-Length", body.len().to_string()),
    ];
    let kept =
        own.iter().filter(|(name, _)| !others.iter().any(|(other, _)| other.eq_ignore_ascii_case(name)));
    let kept = kept.map(|(name, value)| (*name, value.as_str()));
    // What is empty is left out.
    let lines = kept.chain(others.iter().copied()).filter(|(_, value)| !value.is_empty());
    let lines: String = lines.flat_map(|(name, value)| [name, ": ", value, "\r\n"]).collect();
    say(address, &format!("{method} {path} HTTP/1.1\r\n{lines}\r\n{body}"))
}

fn read(address: SocketAddr, path: &str) -> Answer {
    send(address, "GET", path, &[("Origin", "")], "")
}

fn post(address: SocketAddr, path: &str, body: &Value) -> Answer {
    send(address, "POST", path, &[], &body.to_string())
}

/// Waits until the console says this of the unit.
fn until(address: SocketAddr, found: impl Fn(&Value) -> bool) -> Value {
    let deadline = Instant::now() + LIMIT;
    loop {
        let answer = read(address, &format!("/api/unit/{UNIT}"));
        if answer.status == 200 && found(&answer.json()) {
            return answer.json();
        }
        assert!(Instant::now() < deadline, "{answer:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn swap_of(bias: f64) -> Value {
    json!({ "document": document(UNIT, bias), "by": "ann" })
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn nothing_of_it_is_there_unless_it_is_asked_for() {
    let folders = Folders::new();
    let settings = Settings { web: WebSettings::default(), ..settings(&folders, true) };
    let stand = Stand::start(settings).await;
    let address = stand.service.metrics().unwrap();
    for path in ["/", "/web/console.js", "/api/units", "/api/bundle"] {
        assert_eq!(read(address, path).status, 404, "{path}");
    }
    assert_eq!(get(address, "/livez").status, 200);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn whoever_tries_to_get_round_the_guard_is_refused_and_changes_nothing() {
    let folders = Folders::new();
    let (mut stand, address) = stand(&folders, true).await;
    stand.run_unit(UNIT, 20).await;
    let first = post(address, &format!("/api/unit/{UNIT}/swap"), &swap_of(1.0));
    assert_eq!((first.status, &first.json()["outcome"]), (200, &"accepted".into()), "{first:?}");
    let (swap, command) = (format!("/api/unit/{UNIT}/swap"), format!("/api/unit/{UNIT}/command"));
    let body = swap_of(9.0).to_string();
    let bearer = format!("Bearer {TOKEN}");
    // Paths, with what a page of another site, a rebound name or a stranger can send.
    let tries: Vec<(u16, Vec<(&str, &str)>)> = vec![
        (401, vec![("Authorization", "")]),
        (401, vec![("Authorization", "Bearer wrong-wrong-wrong-wrong-wrong-wrong")]),
        (401, vec![("Authorization", ""), ("Cookie", &bearer)]),
        (421, vec![("Host", "evil.example")]),
        (421, vec![("Host", "evil.example"), ("Origin", "http://evil.example")]),
        (421, vec![("Host", "127.0.0.1.evil.example:80")]),
        (403, vec![("Origin", "http://evil.example")]),
        (403, vec![("Origin", "null")]),
        (403, vec![("Origin", ""), ("Sec-Fetch-Site", "cross-site")]),
        (403, vec![("Origin", ""), ("Sec-Fetch-Site", "")]),
        (415, vec![("Content-Type", "text/plain")]),
        (415, vec![("Content-Type", "application/x-www-form-urlencoded")]),
        (415, vec![("Content-Type", "")]),
    ];
    for (status, headers) in &tries {
        let answer = send(address, "POST", &swap, headers, &body);
        assert_eq!(answer.status, *status, "{headers:?}: {answer:?}");
        let answer = send(address, "POST", &command, headers, r#"{"command":"standby","by":"eve"}"#);
        assert_eq!(answer.status, *status, "{headers:?}");
    }
    for path in [&swap, &command] {
        for method in ["GET", "HEAD", "PUT", "DELETE", "OPTIONS", "PATCH"] {
            let answer = send(address, method, path, &[], &body);
            assert_eq!((answer.status, answer.header("allow")), (405, Some("POST")), "{method} {path}");
            assert_eq!(answer.header("access-control-allow-origin"), None);
        }
    }
    // Nothing of it is read by a stranger either.
    let reading = [
        "/api/units",
        &format!("/api/unit/{UNIT}"),
        &format!("/api/unit/{UNIT}/document"),
        &format!("/api/unit/{UNIT}/history"),
        &format!("/api/unit/{UNIT}/live"),
        "/api/bundle",
        "/api/nothing",
    ];
    for path in reading {
        for (status, headers) in &tries[..9] {
            let answer = send(address, "GET", path, headers, "");
            assert_eq!(answer.status, *status, "{path} {headers:?}");
            assert!(!answer.body.contains("gyro"), "{path}");
        }
        assert_eq!(
            send(address, "POST", path, &[], "{}").status,
            if path == "/api/nothing" { 404 } else { 405 },
            "{path}"
        );
    }
    assert_eq!(send(address, "GET", "/", &[("Host", "evil.example")], "").status, 421);
    assert_eq!(
        send(address, "GET", &format!("http://evil.example{swap}"), &[("Host", "evil.example")], "").status,
        421
    );
    for path in
        ["/api/unit/../units", "/api/unit/*/swap", "/api//units", "/web/../api/units", "/web/", "/web/secret"]
    {
        assert_ne!(read(address, path).status, 200, "{path}");
    }
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    let history = stand.history(UNIT).await;
    let done = history.iter().filter(|entry| !matches!(entry.event, AuditEvent::InForce(_)));
    assert_eq!(done.count(), 1, "the first swap alone: {history:#?}");
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn without_write_everything_can_be_seen_and_nothing_changed() {
    let folders = Folders::new();
    folders.put("u.toml", &document(UNIT, 1.0));
    let (mut stand, address) = stand(&folders, false).await;
    stand.run_unit(UNIT, 20).await;
    let before =
        until(address, |sheet| sheet["instances"][0]["status"]["calibration"]["revision"]["counter"] == 1);
    assert_eq!(before["instances"][0]["own"], true);
    let (swap, command) = (format!("/api/unit/{UNIT}/swap"), format!("/api/unit/{UNIT}/command"));
    let mut told = Vec::new();
    for (path, body) in [
        (&swap, swap_of(2.0)),
        (&swap, json!({ "document": document(UNIT, 2.0), "by": "ann", "dry_run": false })),
        (&command, json!({ "command": "standby", "by": "ann" })),
        (&command, json!({ "command": "rollback", "by": "ann" })),
        (&command, json!({ "command": "forget", "by": "ann" })),
    ] {
        let answer = post(address, path, &body);
        assert_eq!(answer.status, 403, "{body}");
        told.push(answer.body);
    }
    insta::assert_snapshot!(told.join("\n"));
    let entries = stand.history(UNIT).await.len();
    let looked = post(address, &swap, &json!({ "document": document(UNIT, 3.5), "dry_run": true })).json();
    assert_eq!(looked["outcome"], "would-be-accepted", "{looked}");
    assert_eq!(looked["difference"]["document"][0]["after"], "3.5", "{looked}");
    let looked = post(address, &command, &json!({ "command": "rollback", "dry_run": true })).json();
    assert_eq!(looked["accepted"], false, "there is nothing to go back to: {looked}");
    assert_eq!(stand.history(UNIT).await.len(), entries, "a look is not written down");
    assert_eq!(read(address, "/api/units").json()["write"], false);
    assert_eq!(stand.status(UNIT).revision().counter, 1);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn a_swap_a_rollback_and_a_command_are_those_of_the_bus() {
    let folders = Folders::new();
    // Whoever has the token is not asked for a certificate, and has no name of one.
    let mut stand = Stand::start(Settings {
        zenoh: ZenohSettings { certified_names: true, ..settings(&folders, true).zenoh },
        ..settings(&folders, true)
    })
    .await;
    let address = stand.service.metrics().unwrap();
    stand.run_unit(UNIT, 20).await;
    let (swap, command) = (format!("/api/unit/{UNIT}/swap"), format!("/api/unit/{UNIT}/command"));
    let reply: isotherm_protocol::control::SwapReply =
        serde_json::from_str(&post(address, &swap, &swap_of(1.0)).body).unwrap();
    assert_accepted(&reply, 1);
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    let by_bus =
        json!({ "document": document(UNIT, 2.0), "by": "ann; 50 % = all", "slew_s": 0.5, "at_sequence": 45 });
    assert_eq!(post(address, &swap, &by_bus).json()["schedule"]["sequence"], 45);
    assert_eq!(stand.revisions(UNIT, 20).await, [1, 2]);
    let refused = post(address, &swap, &json!({ "document": "schema = 1\nunit = 7", "by": "ann" })).json();
    assert_eq!((&refused["outcome"], &refused["revision"]), (&"refused".into(), &2.into()));
    let of_unit = refused["problems"].as_array().unwrap().iter().find(|problem| problem["key"] == "unit");
    assert_eq!(of_unit.unwrap()["line"], 2, "{refused}");
    let back = post(address, &command, &json!({ "command": "rollback", "by": "bob" })).json();
    assert_eq!((&back["accepted"], &back["swap"]["revision"]), (&true.into(), &3.into()), "{back}");
    let standby = post(address, &command, &json!({ "command": "standby", "by": "bob" })).json();
    assert_eq!((&standby["accepted"], &standby["state"]), (&true.into(), &"standby".into()));
    let sheet = until(address, |sheet| sheet["instances"][0]["status"]["state"] == "standby");
    assert_eq!(sheet["instances"][0]["allowed"][0], "standby");
    let late = post(address, &command, &json!({ "command": "abort", "by": "bob" })).json();
    assert_eq!((&late["accepted"], &late["allowed"][0]), (&false.into(), &"standby".into()), "{late}");
    for (body, words) in [
        (json!({ "document": document(UNIT, 4.0), "by": " " }), "your name"),
        (json!({ "document": document(UNIT, 4.0) }), "your name"),
        (json!({ "document": document(UNIT, 4.0), "by": "x".repeat(65) }), "64"),
        (json!({ "document": document(UNIT, 4.0), "by": "ann", "slew_s": -1 }), "slew_s"),
        (json!({ "document": document(UNIT, 4.0), "by": "ann", "colour": "red" }), "colour"),
        (json!({ "by": "ann" }), "document"),
    ] {
        let answer = post(address, &swap, &body);
        assert!(answer.status == 400 && answer.body.contains(words), "{words}: {answer:?}");
    }
    assert_eq!(send(address, "POST", &command, &[], "standby").status, 400);
    let forged = post(address, &command, &json!({ "command": "standby", "by": "CN=eve" }));
    assert!(forged.status == 409 && forged.body.contains("CN=eve"), "{forged:?}");
    let entries = stand.history(UNIT).await;
    let by: Vec<_> = entries
        .iter()
        .filter(|entry| matches!(entry.event, AuditEvent::Accepted(_) | AuditEvent::Command(_)))
        .map(|entry| entry.by.as_str())
        .collect();
    assert_eq!(by, ["ann", "ann; 50 % = all", "bob", "bob", "bob", "bob"]);
    let told = read(address, &format!("/api/unit/{UNIT}/history?limit=1000")).json();
    assert_eq!(told, serde_json::to_value(&entries).unwrap(), "the same as on the bus");
    assert_eq!(read(address, &format!("/api/unit/{UNIT}/document")).body, document(UNIT, 1.0));
    let strange = post(address, "/api/unit/STRANGE/command", &json!({ "command": "standby", "by": "bob" }));
    assert_eq!(strange.status, 409);
    assert!(strange.body.contains("STRANGE"), "{strange:?}");
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn a_body_without_end_holds_nothing_up() {
    let folders = Folders::new();
    let (mut stand, address) = stand(&folders, true).await;
    stand.run_unit(UNIT, 5).await;
    let path = format!("/api/unit/{UNIT}/swap");
    let mut stream = connect(address);
    let head = format!(
        "POST {path} HTTP/1.1\r\nHost: {address}\r\nAuthorization: Bearer {TOKEN}\r\nOrigin: http://{address}\r\n\
         Content-Type: application/json\r\nContent-Length: 100000000\r\n\r\n"
    );
    stream.write_all(head.as_bytes()).unwrap();
    let part = vec![b'x'; 1 << 16];
    // Refused as soon as it is known to be too long, or cut off.
    let mut sent = 0;
    while sent < 100_000_000 && stream.write_all(&part).is_ok() {
        sent += part.len();
        assert!(sent < 50_000_000, "it reads on and on");
    }
    assert_eq!(get(address, "/livez").status, 200);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn malformed_requests_are_refused_and_change_nothing() {
    let folders = Folders::new();
    let (mut stand, address) = stand(&folders, true).await;
    stand.run_unit(UNIT, 5).await;
    let command = format!("/api/unit/{UNIT}/command");
    let head = format!(
        "POST {command} HTTP/1.1\r\nHost: {address}\r\nAuthorization: Bearer {TOKEN}\r\nOrigin: http://{address}\r\n\
         Content-Type: application/json\r\n"
    );
    let order = r#"{"command":"standby","by":"eve"}"#;
    let with = |more: &str, body: &[u8]| [head.as_bytes(), more.as_bytes(), b"\r\n", body].concat();
    let of = |body: &[u8]| with(&format!("Content-Length: {}\r\n", body.len()), body);
    let deep = format!("{{\"command\":{}", "[".repeat(100_000));
    let tries: [(&str, Vec<u8>); 12] = [
        ("TLS", b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n".to_vec()),
        ("HTTP/2", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n".to_vec()),
        ("zeros", vec![0; 10_000]),
        ("a header of zeros", with("X-Zero: \0\0\r\nContent-Length: 32\r\n", order.as_bytes())),
        ("two lengths", with("Content-Length: 32\r\nContent-Length: 3\r\n", order.as_bytes())),
        ("a length that is none", with("Content-Length: -1\r\n", order.as_bytes())),
        ("a length beyond all", with("Content-Length: 99999999999999999999999\r\n", order.as_bytes())),
        ("chunks of no size", with("Transfer-Encoding: chunked\r\n", b"zz\r\nxx\r\n0\r\n\r\n")),
        ("an unknown coding", with("Transfer-Encoding: gzip\r\n", order.as_bytes())),
        ("deep JSON", of(deep.as_bytes())),
        ("no UTF-8", of(b"{\"command\":\"standby\",\"by\":\"\xff\xfe\"}")),
        ("half of it", of(&order.as_bytes()[..20])),
    ];
    for (what, bytes) in tries {
        let mut stream = connect(address);
        // The end may come in the middle of it.
        let _ = stream.write_all(&bytes);
        let _ = stream.shutdown(std::net::Shutdown::Write);
        let answer = read_answer(stream);
        let refused = answer.as_ref().is_none_or(|answer| [400, 411, 413, 501, 505].contains(&answer.status));
        assert!(refused, "{what}: {answer:?}");
    }
    // A body that comes byte by byte, and not to its end, holds up nobody.
    let mut slow = connect(address);
    slow.write_all(&with("Content-Length: 32\r\n", b"{")).unwrap();
    assert_eq!(get(address, "/livez").status, 200);
    assert_eq!(read(address, "/api/units").status, 200);
    let history = stand.history(UNIT).await;
    assert!(history.iter().all(|entry| !matches!(entry.event, AuditEvent::Command(_))), "{history:#?}");
    stand.stop().await;
    drop(slow);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn pages_come_with_their_policy_and_without_the_token() {
    let folders = Folders::new();
    let (stand, address) = stand(&folders, false).await;
    for path in ["/", "/web/console.js", "/web/console.css", "/web/icon.svg", "/api/units", "/api/nothing"] {
        let answer = send(address, "GET", path, &[("Origin", "")], "");
        let header = |name| answer.header(name).unwrap_or_else(|| panic!("{path}: {name}"));
        assert!(header("content-security-policy").starts_with("default-src 'self'; frame-ancestors 'none'"));
        for (name, value) in [
            ("x-frame-options", "DENY"),
            ("x-content-type-options", "nosniff"),
            ("cache-control", "no-store"),
            ("referrer-policy", "no-referrer"),
            ("cross-origin-resource-policy", "same-origin"),
        ] {
            assert_eq!(header(name), value, "{path}");
        }
        assert_eq!(
            answer.header("set-cookie"),
            None,
            "no cookie, so none that a page of another site could use"
        );
        assert!(!answer.body.contains(TOKEN), "{path}");
    }
    let page = say(address, &format!("GET / HTTP/1.1\r\nHost: localhost:{}\r\n\r\n", address.port()));
    assert_eq!((page.status, page.header("content-type")), (200, Some("text/html; charset=utf-8")));
    assert_eq!(send(address, "POST", "/", &[], "").status, 405);
    let mut packed = connect(address);
    write!(packed, "GET /web/console.js HTTP/1.1\r\nHost: {address}\r\nAccept-Encoding: gzip\r\n\r\n")
        .unwrap();
    let script = unpacked(&mut packed);
    assert!(script.len() < 100_000 && script.starts_with(b"\"use strict\""), "{}", script.len());
    stand.stop().await;
}

/// Reads an answer whose body is packed with gzip.
fn unpacked(stream: &mut impl Read) -> Vec<u8> {
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    let head = answer.windows(4).position(|end| end == b"\r\n\r\n").unwrap() + 4;
    let mut body = Vec::new();
    GzDecoder::new(&answer[head..]).read_to_end(&mut body).unwrap();
    body
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn units_are_told_worst_first_with_the_reason_and_their_ticks_live() {
    let folders = Folders::new();
    folders.put("u.toml", &document(UNIT, 3600.0));
    let (mut stand, address) = stand(&folders, false).await;
    stand.run_unit("A-FINE-NAME", 20).await;
    stand.temperature_deg_c = 55.0;
    stand.run_unit(UNIT, 400).await;
    let deadline = Instant::now() + LIMIT;
    let units = loop {
        let units = read(address, "/api/units").json();
        let above = units["units"]
            .as_array()
            .unwrap()
            .iter()
            .find(|row| row["unit"] == UNIT && row["range"] == "above");
        if above.is_some_and(|row| row["level"] == "warning") && units["units"].as_array().unwrap().len() == 2
        {
            break units;
        }
        assert!(Instant::now() < deadline, "{units:#}");
    };
    let rows: Vec<_> = units["units"].as_array().unwrap().iter().collect();
    assert!(rows.iter().all(|row| row["level"] == "warning"), "{rows:?}");
    let of = |serial: &str| *rows.iter().find(|row| row["unit"] == serial).unwrap();
    // Whatever else time has brought.
    let mut reasons = of(UNIT)["reasons"].as_array().unwrap().iter();
    let range = reasons.find(|reason| reason.to_string().contains("40 °C")).unwrap();
    insta::assert_snapshot!(format!("{}\n{range}", of("A-FINE-NAME")["reasons"][0]));
    assert_eq!(of(UNIT)["calibrated_range_deg_c"], json!([-10.0, 40.0]));
    assert_eq!(units["services"][0]["instance"], units["instance"]);

    // Watched while ticks go by.
    let watched =
        tokio::task::spawn_blocking(move || read(address, &format!("/api/unit/{UNIT}/live")).json());
    let mut live = None;
    while !watched.is_finished() {
        stand.run_unit(UNIT, 4).await;
    }
    live.replace(watched.await.unwrap());
    let bins = live.unwrap()["bins"].as_array().unwrap().clone();
    assert!(!bins.is_empty());
    for bin in &bins {
        let mean = |name: &str| bin[name][0][1].as_f64().unwrap();
        let removed = (mean("raw_rad_per_s") - mean("corrected_rad_per_s")).to_degrees() * 3600.0;
        assert!((removed - 3600.15).abs() < 0.2, "the bias of the document: {removed} °/h");
        assert_eq!(bin["raw_m_per_s2"], Value::Null, "it has no accelerometers");
    }
    assert_eq!(read(address, "/api/unit/NOBODY/live").status, 404);
    assert_eq!(read(address, "/api/unit/NOBODY").status, 404);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn one_download_has_everything_for_a_fault_report_and_no_token() {
    let folders = Folders::new();
    folders.put("u.toml", &document(UNIT, 1.0));
    let (mut stand, address) = stand(&folders, false).await;
    stand.run_unit(UNIT, 20).await;
    until(address, |sheet| sheet["instances"][0]["status"]["output"] == "calibrated");
    let mut stream = connect(address);
    write!(stream, "GET /api/bundle HTTP/1.1\r\nHost: {address}\r\nAuthorization: Bearer {TOKEN}\r\n\r\n")
        .unwrap();
    let archive = unpacked(&mut stream);
    let mut files = std::collections::BTreeMap::new();
    for entry in tar::Archive::new(&*archive).entries().unwrap() {
        let mut entry = entry.unwrap();
        let name = entry.path().unwrap().strip_prefix("isotherm-report").map(Path::to_owned).unwrap();
        let mut text = String::new();
        entry.read_to_string(&mut text).unwrap();
        assert!(!text.contains(TOKEN), "{}", name.display());
        files.insert(name.display().to_string(), text);
    }
    let instance = stand.status(UNIT).instance;
    assert_eq!(files[&format!("unit/{UNIT}/calibration.toml")], document(UNIT, 1.0));
    assert!(files[&format!("service/{instance}.toml")].contains("[web]"));
    let status: Value = serde_json::from_str(&files["status.json"]).unwrap();
    assert_eq!(status["units"][0]["unit"], UNIT);
    assert!(files["summary.txt"].contains(UNIT) && files["README.txt"].contains("journalctl"));
    assert!(files[&format!("unit/{UNIT}/history.json")].contains("accepted"));
    assert_eq!(files.len(), 6, "{:?}", files.keys());
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn a_second_service_is_shown_and_says_nothing_of_the_unit_while_it_stands_by() {
    let (folders, others) = (Folders::new(), Folders::new());
    folders.put("u.toml", &document(UNIT, 1.0));
    others.put("u.toml", &document(UNIT, 1.0));
    let (mut stand, address) = stand(&folders, false).await;
    // To the first, and to who sends and asks: peers pass nothing on.
    let connect = [locators(stand.service.session()), locators(&stand.session)].concat();
    let session = open(&SessionOptions { connect, ..SessionOptions::default() }).await.unwrap();
    let second = start(others.settings(), session).await.unwrap();
    let deadline = Instant::now() + LIMIT;
    let units = loop {
        stand.send(UNIT, 5).await;
        let answer = read(address, "/api/units");
        let (status, units) = (answer.status, answer.json());
        let sheet = read(address, &format!("/api/unit/{UNIT}"));
        // The list was read before the sheet.
        let listed = units["units"].as_array().is_some_and(|rows| rows.iter().any(|row| row["unit"] == UNIT));
        let shown = listed
            && sheet.status == 200
            && sheet.json()["instances"].as_array().is_some_and(|all| !all.is_empty());
        if status == 200 && shown && units["services"].as_array().unwrap().len() == 2 {
            break units;
        }
        assert!(Instant::now() < deadline, "{answer:?}");
        tokio::time::sleep(Duration::from_millis(50)).await;
    };
    assert_eq!(units["units"].as_array().unwrap().iter().filter(|row| row["unit"] == UNIT).count(), 1);
    let own = stand.service.session().zid().to_string();
    let sheet = read(address, &format!("/api/unit/{UNIT}")).json();
    assert_eq!(sheet["instances"].as_array().unwrap().len(), 1);
    assert_eq!(sheet["instances"][0]["status"]["instance"], own);

    // What each of them does for the unit, and for how many.
    let deadline = Instant::now() + LIMIT;
    loop {
        stand.send(UNIT, 5).await;
        let sheet = read(address, &format!("/api/unit/{UNIT}")).json();
        let mut halves = sheet["pair"].as_array().unwrap().clone();
        halves.sort_by_key(|half| half["own"] != true);
        let roles: Vec<_> = halves.iter().filter_map(|half| half["role"].as_str()).collect();
        let compares = halves.iter().any(|half| half["ticks_compared"].as_u64() > Some(0));
        if roles == ["speaking", "standby"] && compares {
            assert!(halves.iter().all(|half| half["ticks_differing"] == 0), "{sheet}");
            break;
        }
        assert!(Instant::now() < deadline, "{sheet}");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    let told = read(address, "/api/units").json();
    let lines = told["pair"].as_array().unwrap().iter();
    let mut lines: Vec<_> = lines.map(|line| line["columns"][1].to_string()).collect();
    lines.sort_unstable();
    insta::assert_snapshot!(lines.join("\n"));
    second.stop().await;
    stand.service.stop().await;
}
