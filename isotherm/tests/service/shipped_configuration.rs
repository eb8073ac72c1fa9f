//! Every configuration file that is shipped loads and says what its comments say.

use std::path::{Path, PathBuf};
use std::time::Duration;

use isotherm_bus::SessionOptions;
use isotherm_service::Settings;
use serde_json::{Value, json};

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../config").join(name)
}

/// Values of a Zenoh configuration that matter here.
fn assert_values(name: &str, values: &[(&str, Value)]) {
    let config = zenoh::Config::from_file(shipped(name)).unwrap();
    for (key, expected) in values {
        let value: Value = serde_json::from_str(&config.get_json(key).unwrap()).unwrap();
        assert_eq!(value, *expected, "{name}: {key}");
    }
}

#[test]
fn the_service_configuration_shows_the_defaults() {
    let settings = Settings::load(&shipped("service.toml")).unwrap();
    assert_eq!(settings.calibrations, Some(shipped("calibration")));
    assert_eq!(settings.session.config, Some(shipped("zenoh/peer.json5")));
    let defaults = Settings {
        calibrations: settings.calibrations.clone(),
        session: settings.session.clone(),
        digest: settings.digest,
        ..Settings::default()
    };
    assert_eq!(settings, defaults);
    assert_eq!(settings.stop_timeout, Duration::from_secs(3));
}

#[test]
fn the_zenoh_configurations_say_what_their_comments_say() {
    let quiet = [("scouting/multicast/enabled", json!(false)), ("scouting/gossip/enabled", json!(false))];
    let quick = [
        ("transport/link/tx/queue/batching/time_limit", json!(0)),
        ("transport/link/tx/queue/size/real_time", json!(16)),
    ];
    for name in ["peer", "client", "router", "tls", "access-control"] {
        let name = format!("zenoh/{name}.json5");
        assert_values(&name, &quiet);
        assert_values(&name, &quick);
    }
    for name in ["peer", "router", "tls", "access-control"] {
        let idle = ["accept_timeout", "accept_pending"].map(|key| format!("transport/unicast/{key}"));
        assert_values(&format!("zenoh/{name}.json5"), &[(&idle[0], json!(2000)), (&idle[1], json!(1000))]);
    }
    assert_values(
        "zenoh/peer.json5",
        &[("mode", json!("peer")), ("listen/endpoints", json!(["tcp/127.0.0.1:7447"]))],
    );
    assert_values(
        "zenoh/client.json5",
        &[("mode", json!("client")), ("connect/endpoints", json!(["tcp/127.0.0.1:7447"]))],
    );
    assert_values("zenoh/router.json5", &[("mode", json!("router"))]);
    assert_values(
        "zenoh/tls.json5",
        &[
            ("listen/endpoints", json!(["tls/127.0.0.1:7448"])),
            ("transport/link/tls/enable_mtls", json!(true)),
        ],
    );
    let control =
        [("access_control/enabled", json!(true)), ("access_control/default_permission", json!("deny"))];
    assert_values("zenoh/access-control.json5", &control);
}

#[test]
fn every_policy_names_rules_and_subjects_that_are_there() {
    let config = zenoh::Config::from_file(shipped("zenoh/access-control.json5")).unwrap();
    let control: Value = serde_json::from_str(&config.get_json("access_control").unwrap()).unwrap();
    let ids = |list: &str| -> Vec<Value> {
        control[list].as_array().unwrap().iter().map(|item| item["id"].clone()).collect()
    };
    let used = |list: &str| -> Vec<Value> {
        control["policies"]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(|policy| policy[list].as_array().unwrap().clone())
            .collect()
    };
    for list in ["rules", "subjects"] {
        let (ids, used) = (ids(list), used(list));
        assert!(!ids.is_empty() && used.iter().all(|id| ids.contains(id)), "{list}: {used:?} of {ids:?}");
        assert!(ids.iter().all(|id| used.contains(id)), "{list}: unused among {ids:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_peer_configuration_opens() {
    // On a port of the system's choice: the shipped one may be in use.
    let options = SessionOptions {
        config: Some(shipped("zenoh/peer.json5")),
        listen: vec!["tcp/127.0.0.1:0".to_owned()],
        ..SessionOptions::default()
    };
    let session = isotherm_bus::open(&options).await.unwrap();
    assert_eq!(isotherm_bus::locators(&session).len(), 1);
    isotherm_bus::close(session, Duration::from_secs(10)).await.unwrap();
}
