//! Frozen keys, tokens, attachments and payloads: `ros2/vectors.json`, which `tests/python/ros2.py` holds against other
//! implementations. If this fails, ROS 2 would no longer understand the bridge: do not bless it, unless the cases themselves changed
//! (`ISOTHERM_BLESS=1`).

use isotherm_log::ros2::{Header, Imu, Temperature, Time, to_cdr};
use isotherm_protocol::digest::Digits;
use serde::Serialize;
use serde_json::{Value, json};

use crate::attachment::Attachment;
use crate::interface::{
    DIAGNOSTICS, DiagnosticArray, DiagnosticStatus, IMU, Interface, KeyValue, Level, TEMPERATURE, TRIGGER,
    TriggerRequest, TriggerResponse,
};
use crate::name::{Kind, Node, gid, key};
use crate::qos::{History, Qos, Reliability};

fn hex(bytes: &[u8]) -> String {
    Digits(bytes).to_string()
}

fn payload(name: &str, message: &impl Serialize) -> Value {
    json!({ "type": name, "message": message, "cdr": hex(&to_cdr(message).unwrap()) })
}

fn payloads() -> Vec<Value> {
    let header = |frame: &str| Header {
        stamp: Time { sec: 1_700_000_000, nanosec: 123_456_789 },
        frame_id: frame.to_owned(),
    };
    let imu = |frame| Imu::new(header(frame), Some([0.1, -2.5e-7, 3.0]), Some([1e300, -0.0, 9.81]));
    let value = |key: &str, value: &str| KeyValue { key: key.to_owned(), value: value.to_owned() };
    let status = |level, values| DiagnosticStatus {
        level,
        name: "isotherm: A-1".to_owned(),
        message: "running".to_owned(),
        hardware_id: "A-1".to_owned(),
        values,
    };
    let worst = status(Level::Stale, Vec::new());
    let status = vec![status(Level::Ok, vec![value("imu in", "7"), value("ä", "")]), worst];
    vec![
        payload("sensor_msgs/msg/Imu", &imu("imu_link")),
        payload("sensor_msgs/msg/Imu", &imu("")),
        payload(
            "sensor_msgs/msg/Temperature",
            &Temperature { header: header("imu"), temperature: 21.5, variance: 0.0 },
        ),
        payload("diagnostic_msgs/msg/DiagnosticArray", &DiagnosticArray { header: header(""), status }),
        payload("std_srvs/srv/Trigger_Request", &TriggerRequest::default()),
        payload(
            "std_srvs/srv/Trigger_Response",
            &TriggerResponse { success: true, message: "A-1: standby".to_owned() },
        ),
    ]
}

fn endpoints(node: &Node) -> Vec<Value> {
    let keep_all = Qos { reliability: Reliability::Reliable, history: History::KeepAll, depth: 10 };
    let all: [(u32, Kind, &str, &str, Interface, Qos); 5] = [
        (1, Kind::Publisher, "PUBLISHER", "/imu/data", IMU, keep_all),
        (2, Kind::Subscription, "SUBSCRIPTION", "/imu/data_raw", IMU, Qos::SENSOR_DATA),
        (3, Kind::Service, "SERVICE", "/isotherm/A_1/standby", TRIGGER, Qos::SERVICES),
        (4, Kind::Publisher, "PUBLISHER", "/diagnostics", DIAGNOSTICS, Qos::DIAGNOSTICS),
        (5, Kind::Subscription, "SUBSCRIPTION", "/imu/temperature", TEMPERATURE, Qos::SENSOR_DATA),
    ];
    let endpoint = |(number, kind, name, topic, interface, qos): (u32, Kind, &str, &str, Interface, Qos)| {
        let token = node.endpoint(number, kind, topic, interface, qos);
        let ros = interface.dds.replace("dds_::", "").replace("::", "/");
        json!({
            "number": number, "kind": name, "topic": topic, "type": ros.trim_end_matches('_'), "dds": interface.dds,
            "hash": interface.hash, "qos": qos.to_string(), "key": key(node.domain, topic, interface),
            "gid": hex(&gid(&token)), "token": token,
        })
    };
    all.into_iter().map(endpoint).collect()
}

fn nodes() -> Vec<Value> {
    let nodes = [(0, "/", "isotherm"), (42, "/car/front", "imu_bridge")];
    let node = |(domain, namespace, name): (u32, &str, &str)| {
        let session = "a1b2c3d4e5f60718293a4b5c6d7e8f90".to_owned();
        let node = Node { domain, session, namespace: namespace.to_owned(), name: name.to_owned() };
        json!({
            "domain": domain, "session": node.session, "namespace": namespace, "name": name,
            "token": node.token(), "endpoints": endpoints(&node),
        })
    };
    nodes.into_iter().map(node).collect()
}

#[test]
fn what_ros_sees_is_as_it_was() {
    let attachment =
        Attachment { sequence: 258, time_ns: 1_700_000_000_123_456_789, gid: *b"0123456789abcdef" };
    let all = json!({
        "nodes": nodes(),
        "attachments": [{
            "sequence": attachment.sequence, "time_ns": attachment.time_ns, "gid": hex(&attachment.gid),
            "bytes": hex(&attachment.to_bytes()),
        }],
        "payloads": payloads(),
    });
    let text = serde_json::to_string_pretty(&all).unwrap() + "\n";
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/vectors.json");
    if std::env::var_os("ISOTHERM_BLESS").is_some() {
        std::fs::write(path, &text).unwrap();
    }
    let frozen = std::fs::read_to_string(path).unwrap();
    assert!(frozen == text, "ros2/vectors.json differs from what would be sent now:\n{text}");
    assert_eq!(Attachment::parse(Some(&attachment.to_bytes())), Ok(attachment));
}
