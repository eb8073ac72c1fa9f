//! What the service says of itself, and the tokens of its life.

use isotherm_protocol::codec::decode;
use isotherm_protocol::control::SwapOptions;
use isotherm_protocol::key;
use isotherm_protocol::service_status::{FolderState, ServiceStatus};
use isotherm_protocol::status::Status;

use super::stand::{Folders, LIMIT, Stand, UNIT, assert_accepted, document};

#[tokio::test(flavor = "multi_thread")]
async fn the_service_tells_of_units_folder_store_and_swaps_and_is_alive() {
    let folders = Folders::new();
    folders.put("bad.toml", "schema = 1");
    folders.put("silent.toml", &document("ZLG-8", 1.0));
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &SwapOptions::default()).await, 1);
    stand.revisions(UNIT, 20).await;

    let instance = stand.service.session().zid().to_string();
    let (sender, mut published) = tokio::sync::mpsc::unbounded_channel();
    let _subscriber = stand
        .session
        .declare_subscriber(key::service_status(&instance))
        .callback(move |sample| sender.send(sample.payload().to_bytes().into_owned()).unwrap())
        .await
        .unwrap();
    let status: ServiceStatus = loop {
        let bytes = tokio::time::timeout(LIMIT, published.recv()).await.expect("in time").unwrap();
        let status: ServiceStatus = decode(&bytes).unwrap();
        if status.swaps_accepted == 1 && !status.units.is_empty() {
            break status;
        }
    };
    assert_eq!((status.instance.as_str(), status.units[0].unit.as_str()), (&*instance, UNIT));
    assert_eq!(status.calibrations.unwrap().state, FolderState::Watching);
    assert!(status.bad_documents[0].file.ends_with("bad.toml"), "{:#?}", status.bad_documents);
    assert!(status.store.unwrap().audit_entries >= 2);
    let awaited: Vec<_> = status.faults.iter().filter(|fault| fault.kind == "awaited_units").collect();
    assert!(
        matches!(awaited[..], [fault] if fault.count == 1 && fault.first.ends_with(": ZLG-8")),
        "{awaited:?}"
    );
    assert_eq!((status.pid, status.swaps_refused), (Some(std::process::id()), 1));

    for (token, alive) in [
        (key::ALL_UNITS_ALIVE, "imu/ZLG-7/alive".to_owned()),
        (key::ALL_SERVICES_ALIVE, key::service_alive(&instance)),
    ] {
        let replies = stand.session.liveliness().get(token).await.unwrap();
        let reply = tokio::time::timeout(LIMIT, replies.recv_async()).await.expect("in time").unwrap();
        assert_eq!(reply.into_result().unwrap().key_expr().as_str(), alive);
    }
    let unit: Status = stand.status(UNIT);
    assert_eq!((unit.instance.as_str(), unit.sensors.len()), (&*instance, 3));
    assert_eq!(unit.calibration.unwrap().created_unix_s, Some(1_767_571_200));
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn input_rates_are_measured_between_statuses() {
    let folders = Folders::new();
    let mut settings = folders.settings();
    settings.status_interval = std::time::Duration::from_millis(100);
    let mut stand = Stand::start(settings).await;
    // With a calibration the unit waits for no accelerometer: the ticks come one after the other.
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &SwapOptions::default()).await, 1);
    let deadline = std::time::Instant::now() + LIMIT;
    loop {
        stand.revisions(UNIT, 20).await;
        let rates = stand.status(UNIT).input_rates;
        if rates.gyro_ticks_per_s > 0.0
            && rates.temperature_readings_per_s > 0.0
            && rates.messages_per_s > 0.0
        {
            break;
        }
        assert!(std::time::Instant::now() < deadline, "{rates:?}");
    }
    let latency = stand.status(UNIT).latency;
    assert_eq!(latency.buckets.last().map(|bucket| bucket.up_to_ns >= latency.max_ns), Some(true));
    stand.stop().await;
}
