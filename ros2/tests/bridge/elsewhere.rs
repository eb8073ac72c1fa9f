//! The service elsewhere, and the session with ROS 2 by a configuration of one's own.

use super::*;
use isotherm_service::Settings;

/// As a router's file has it.
const ROUTER: &str = r#"{
  mode: "router", // both ways of writing
  "listen": { "endpoints": ["tcp/127.0.0.1:0"] },
  scouting: { multicast: { enabled: false } },
}
"#;

#[tokio::test(flavor = "multi_thread")]
async fn a_service_elsewhere_and_a_zenoh_configuration_of_ones_own() {
    const MESSAGES: usize = 200;
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    std::fs::write(folder.path().join("zenoh.json5"), ROUTER).unwrap();
    let listen = vec!["tcp/127.0.0.1:0".to_owned()];
    let session = open(&SessionOptions { listen, ..SessionOptions::default() }).await.unwrap();
    let locator = isotherm_bus::locators(&session).remove(0);
    let settings = Settings::load(&folder.path().join("service.toml")).unwrap();
    let service = isotherm_service::start(settings, session).await.unwrap();

    let endpoint = locator.strip_prefix("tcp/").unwrap();
    let bridge = Bridge::launch(folder.path(), &["--service", endpoint, "--zenoh-config", "zenoh.json5"]);
    assert_eq!(bridge.ready["service"], Value::Array(Vec::new()), "nothing listens for operators here");
    let mut driver = Driver::join(&bridge.locator("ros")).await;
    let (mut corrected, mut diagnostics) = driver.hear().await;
    let mut raw = driver.publisher("/imu/data_raw", IMU).await;
    let (mut correct, mut expected) = (Correct::new(folder.path()), Vec::new());
    for mut step in steps().take(MESSAGES) {
        step.temperatures.clear();
        raw.put(to_cdr(&message(&step)).unwrap()).await;
        expected.extend(correct.take(&step));
    }
    correct.offline.flush();
    expected.extend(correct.offline.take_ready());
    assert_eq!(expected.len(), MESSAGES);
    for tick in &expected {
        assert_eq!(bits(&corrected.imu().await), bits(&Imu::of_tick(header(tick.end_time.as_ns()), tick)));
    }
    driver_and_services(&driver, &mut diagnostics, folder.path()).await;
    let (code, totals) = bridge.stop();
    assert_eq!(
        (code, &totals["imu_out"], &totals["lost"]),
        (Some(0), &MESSAGES.into(), &0.into()),
        "{totals}"
    );
    service.stop().await;
}

#[test]
fn a_service_that_is_not_there_is_reported_once() {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    // A port on which nothing listens.
    let service = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let output = Command::new("timeout")
        .args(["--signal=TERM", "2", env!("CARGO_BIN_EXE_isotherm-ros"), "bridge", "ros2.toml"])
        .args(["--listen", "127.0.0.1:0", "--service", &service])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let log = String::from_utf8(output.stderr).unwrap();
    assert_eq!(log.matches("trying again").count(), 1, "{log}");
    // Zenoh's own words for the first trial: one for the endpoint, one for all of them.
    assert_eq!(log.matches("Unable to connect").count(), 2, "{log}");
}
