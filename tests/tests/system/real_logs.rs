//! Real logs through Zenoh: player, service and subscriber are three processes.

use isotherm_bus::{Consumer, SessionOptions, close, open, presence};
use isotherm_correction::sample::TickFlags;
use isotherm_protocol::corrected::CorrectedTick;
use isotherm_protocol::key::UnitId;
use isotherm_tests::bench::LIMIT;
use isotherm_tests::data;
use isotherm_tests::process::{self, Service};

const RAD_PER_S_IN_DEG_PER_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;
const RAD_PER_DEG: f64 = std::f64::consts::PI / 180.0;

/// Plays a log as `unit` into a service of its own; every corrected tick that arrives here.
async fn play(unit: &str, mapping: &str, log: &str, ticks: u64) -> Vec<CorrectedTick> {
    // Nothing may be dropped on the way to this subscriber; a live service would rather drop than wait for one.
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("service.toml");
    let calibrations = data::root().join("config/calibration");
    std::fs::write(&config, format!("calibrations = '{}'\ncongestion = \"block\"\n", calibrations.display()))
        .unwrap();
    let service = Service::start(&["--config", config.to_str().unwrap()]);
    let options = SessionOptions { connect: vec![service.locator.clone()], ..SessionOptions::default() };
    let session = open(&options).await.unwrap();
    let id = UnitId::new(unit).unwrap();
    let mut consumer = Consumer::declare(&session, Some(&id)).await.unwrap();
    presence::wait_for_service(&session, LIMIT).await.unwrap();

    let arguments = ["play", log, "--mapping", mapping, "--unit", unit, "--connect", &service.locator]
        .into_iter()
        .chain(["--speed", "max", "--batch", "16", "--json"])
        .map(ToOwned::to_owned)
        .collect::<Vec<_>>();
    let player = tokio::task::spawn_blocking(move || {
        process::run_well("isotherm-replay", &arguments.iter().map(String::as_str).collect::<Vec<_>>())
    });
    let mut received = Vec::new();
    while (received.len() as u64) < ticks {
        let batch = tokio::time::timeout(LIMIT, consumer.next()).await;
        let batch = batch.unwrap_or_else(|_| panic!("{} of {ticks} ticks", received.len())).expect("open");
        received.extend(batch.ticks);
    }
    let summary: serde_json::Value = serde_json::from_str(&player.await.unwrap()).unwrap();
    assert_eq!(summary["ticks_sent"], ticks, "{summary}");
    let (status, totals) = tokio::task::spawn_blocking(move || service.stop()).await.unwrap();
    assert_eq!(status.code(), Some(0), "{totals}");
    while let Some(batch) = consumer.try_next() {
        received.extend(batch.ticks);
    }
    assert_eq!(received.len() as u64, ticks, "none too many");
    assert!(consumer.continuity(&id).is_whole());
    assert_eq!(consumer.continuity(&id).announced_missing, 0);
    close(session, LIMIT).await.unwrap();
    received
}

/// Mean and standard deviation.
fn mean_and_deviation(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = values.clone().fold(0.0, |count, _| count + 1.0);
    let mean = values.clone().sum::<f64>() / count;
    (mean, (values.map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt())
}

#[tokio::test(flavor = "multi_thread")]
async fn real_laser_gyro_log_from_the_data_folder_keeps_every_tick_and_its_mean_rates() {
    let Some(folder) = data::folder() else { return };
    let log = folder.join("rlg-static/rlg-static.imu.gz");
    let ticks = play("RLG-STATIC", "config/mappings/rlg-static.toml", log.to_str().unwrap(), 184_718).await;
    assert!(
        ticks.windows(2).all(|pair| pair[1].sequence == pair[0].sequence + 1),
        "each tick once, in order"
    );
    // Mean over the first 1800 s of 10 ms ticks (°/h), from the log's README.
    for (axis, expected) in [-12.265, 0.474, 8.354].into_iter().enumerate() {
        let angle: f64 = ticks[..180_000].iter().map(|tick| tick.delta_angle[axis]).sum();
        let rate = angle / 1800.0 / RAD_PER_S_IN_DEG_PER_H;
        println!("axis {axis}: {rate:.5} °/h, expected {expected}");
        assert!((rate - expected).abs() < 0.001, "axis {axis}: {rate} °/h, expected {expected}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn real_chamber_log_from_the_data_folder_reaches_the_cubic_residuals() {
    let Some(folder) = data::folder() else { return };
    let log = folder.join("chamber-mems/chamber.tsv");
    let ticks = play("CHAMBER-MEMS", "config/mappings/chamber-mems.toml", log.to_str().unwrap(), 8400).await;
    // The first row is an outlier; its figures are left out of the published ones.
    let ticks = &ticks[1..];
    assert!(ticks.iter().all(|tick| !tick.flags.contains(TickFlags::ACCELEROMETER_MISSING)));
    let seconds = |tick: &CorrectedTick| tick.duration.as_s();
    let gyro_y = ticks.iter().map(|tick| tick.delta_angle[1] / seconds(tick) / RAD_PER_DEG);
    let accel_z = ticks.iter().map(|tick| tick.delta_velocity[2] / seconds(tick));
    for (name, (_, got), expected) in [
        ("gyro.y (°/s)", mean_and_deviation(gyro_y), 9.5e-4),
        ("acc.z (m/s²)", mean_and_deviation(accel_z), 0.044),
    ] {
        println!("{name}: residual {got:.4e}, expected {expected:.2e}");
        assert!((got / expected - 1.0).abs() < 0.02, "{name}: residual {got}, expected {expected}");
    }
}
