//! How playing ends: by a signal, with the service, with a log that cannot be read on; and what it says while nothing
//! comes back.

use std::io::{BufRead, BufReader};
use std::time::{Duration, Instant};

use isotherm_bus::{SessionOptions, open, presence};
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::Status;
use isotherm_tests::bench::LIMIT;
use isotherm_tests::operator::Operator;
use isotherm_tests::process::send_signal;
use serde_json::json;

use super::{begin, in_time, service, simulated, summary};

const UNIT: &str = "MEMS-0001";

/// What playing in vain may take before it ends, far below the patience that it had before it looked at tokens.
const AT_ONCE: Duration = Duration::from_secs(4);

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_goes_ends_playing_at_once_with_its_summary() {
    let folder = tempfile::tempdir().unwrap();
    let [log, mapping] = simulated(folder.path(), "mems-chamber", 60);
    for killed in [true, false] {
        let service = service();
        let options = SessionOptions { connect: vec![service.locator.clone()], ..SessionOptions::default() };
        let operator = Operator::new(open(&options).await.unwrap());
        let player = begin(&["-m", &mapping, &log, "-u", UNIT, "--connect", &service.locator, "--json"]);
        presence::wait_for_service(operator.session(), LIMIT).await.unwrap();
        played(&operator, None).await;
        let words = format!("the service at {} is gone: ", service.locator);
        let begun = Instant::now();
        in_time(LIMIT, move || if killed { service.kill() } else { drop(service.stop()) }).await;
        let output = in_time(LIMIT, move || player.wait_with_output().unwrap()).await;
        let errors = String::from_utf8_lossy(&output.stderr);
        let said = summary(&output, 1);
        let ticks = |name: &str| said[name].as_u64().unwrap();
        let became = ["ticks_acknowledged", "ticks_lost", "ticks_late", "ticks_under_way"].map(ticks);
        assert_eq!((&said["stopped"], ticks("ticks_sent")), (&json!(true), became.iter().sum()), "{said}");
        assert!(errors.contains(&words), "{errors}");
        assert!(begun.elapsed() < AT_ONCE, "{:?}", begun.elapsed());
    }
}

/// Waits until ticks of another series than `before` have gone out; its number.
async fn played(operator: &Operator, before: Option<u64>) -> u64 {
    let there = |status: &ServiceStatus| status.units.iter().any(|it| it.unit == UNIT).then_some(());
    operator.until_service(there).await;
    let series = |status: &Status| status.last_tick.map(|tick| tick.series).filter(|it| Some(*it) != before);
    operator.until(UNIT, series).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_signal_always_ends_it_with_its_summary() {
    let folder = tempfile::tempdir().unwrap();
    let [log, mapping] = simulated(folder.path(), "mems-chamber", 60);
    let service = service();
    let options = SessionOptions { connect: vec![service.locator.clone()], ..SessionOptions::default() };
    let operator = Operator::new(open(&options).await.unwrap());
    let mut series = None;
    for name in ["INT", "TERM", "HUP"] {
        let player = begin(&["-m", &mapping, &log, "-u", UNIT, "--connect", &service.locator, "--json"]);
        series = Some(played(&operator, series).await);
        let begun = Instant::now();
        send_signal(&player, name);
        let output = in_time(LIMIT, move || player.wait_with_output().unwrap()).await;
        assert!(begun.elapsed() < AT_ONCE, "{:?}", begun.elapsed());
        let said = summary(&output, 1);
        assert_eq!(said["stopped"], true, "{said}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_unit_in_standby_is_said_and_a_signal_ends_the_wait() {
    let folder = tempfile::tempdir().unwrap();
    let [log, mapping] = simulated(folder.path(), "mems-chamber", 60);
    let service = service();
    let options = SessionOptions { connect: vec![service.locator.clone()], ..SessionOptions::default() };
    let operator = Operator::new(open(&options).await.unwrap());
    // A unit is there once it has sent something.
    let first =
        ["-m", &mapping, "-u", UNIT, "--connect", &service.locator, "--speed", "max", "--duration", "1"];
    let player = begin(&[&[log.as_str()], &first[..]].concat());
    let output = in_time(LIMIT, move || player.wait_with_output().unwrap()).await;
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    operator.command(UNIT, json!({ "command": "standby" })).await.expect("a unit that runs takes it");

    let play =
        ["-m", &mapping, &log, "-u", UNIT, "--connect", &service.locator, "--speed", "max", "--wait", "60"];
    let mut player = begin(&play);
    let stderr = player.stderr.take().unwrap();
    let said = in_time(LIMIT, move || BufReader::new(stderr).lines().next().unwrap().unwrap()).await;
    assert!([UNIT, "standby", "--no-acknowledge"].iter().all(|part| said.contains(part)), "{said}");
    send_signal(&player, "INT");
    let status = in_time(LIMIT, move || player.wait().unwrap()).await;
    assert_eq!(status.code(), Some(1));

    // Without waiting it goes through.
    let free =
        ["-m", &mapping, "-u", UNIT, "--connect", &service.locator, "--speed", "max", "--no-acknowledge"];
    let player = begin(&[&[log.as_str()], &free[..]].concat());
    let output = in_time(LIMIT, move || player.wait_with_output().unwrap()).await;
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_row_that_cannot_be_read_ends_playing_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let [log, mapping] = simulated(folder.path(), "mems-chamber", 10);
    let text = std::fs::read_to_string(&log).unwrap();
    let mut lines: Vec<_> = text.lines().map(str::to_owned).collect();
    lines.swap(400, 401);
    std::fs::write(&log, lines.join("\n") + "\n").unwrap();
    let service = service();
    let player = begin(&["-m", &mapping, &log, "-u", UNIT, "--connect", &service.locator, "--speed", "max"]);
    let output = in_time(LIMIT, move || player.wait_with_output().unwrap()).await;
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{errors}");
    assert!(errors.contains("log.csv:402:1: "), "{errors}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_temperature_channel_that_the_calibration_does_not_have_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let [log, mapping] = simulated(folder.path(), "mems-chamber", 2);
    let text = std::fs::read_to_string(&mapping).unwrap();
    std::fs::write(&mapping, text.replacen("channel = \"gyro0\"", "channel = \"girO0\"", 1)).unwrap();
    let service = service();
    let arguments =
        ["-m", &mapping, &log, "-u", UNIT, "--connect", &service.locator, "--speed", "max", "--json"];
    let player = begin(&arguments);
    let output = in_time(LIMIT, move || player.wait_with_output().unwrap()).await;
    assert_eq!(summary(&output, 0)["units"][0]["unknown_channels"], json!(["girO0"]));
    insta::assert_snapshot!(String::from_utf8_lossy(&output.stderr));
}
