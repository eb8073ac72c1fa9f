//! `hiroz`, an implementation of ROS 2 over Zenoh by others, against the bridge: it finds it in the graph, sends it messages, hears
//! them corrected, reads its diagnostics and calls its services.
//!
//!     just ros-peer
//!
//! The program of the bridge is the first argument, the messages to send the second.

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use hiroz::Builder;
use hiroz::context::ZContextBuilder;
use hiroz::entity::{EndpointKind, Entity};
use hiroz_msgs::builtin_interfaces::Time;
use hiroz_msgs::diagnostic_msgs::DiagnosticArray;
use hiroz_msgs::geometry_msgs::Vector3;
use hiroz_msgs::sensor_msgs::{Imu, Temperature};
use hiroz_msgs::std_msgs::Header;
use hiroz_msgs::std_srvs::{TriggerRequest, srv::Trigger};

/// Every wait ends here at the latest.
const LIMIT: Duration = Duration::from_secs(60);
const TICK_NS: u64 = 10_000_000;
const CHANNELS: [&str; 8] = ["gyro0", "gyro1", "gyro2", "accel0", "accel1", "accel2", "board", "housing"];

/// `isotherm-ros bridge` with a service in its process; killed when dropped.
struct Bridge(Child);

impl Drop for Bridge {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn header(number: u64) -> Header {
    let ns = 1_700_000_000_000_000_000 + number * TICK_NS;
    let stamp = Time { sec: (ns / 1_000_000_000) as i32, nanosec: (ns % 1_000_000_000) as u32 };
    Header { stamp, frame_id: "raw".to_owned() }
}

async fn in_time<T>(what: &str, wait: impl Future<Output = T>) -> T {
    tokio::time::timeout(LIMIT, wait).await.unwrap_or_else(|_| panic!("{what}: not within {LIMIT:?}"))
}

#[tokio::main]
async fn main() {
    let mut arguments = std::env::args().skip(1);
    let program = arguments.next().expect("usage: isotherm-ros-peer PROGRAM MESSAGES");
    let messages: u64 =
        arguments.next().expect("a number of messages").parse().expect("a number of messages");
    let mut child = Command::new(program)
        .args([
            "bridge",
            "config/ros2.toml",
            "--calibration",
            "config/calibration",
            "--listen",
            "127.0.0.1:0",
        ])
        .args(["--announce", "--json", "--log-level", "error", "--domain", "7"])
        .stdout(Stdio::piped())
        .spawn()
        .expect("the bridge starts");
    let mut line = String::new();
    BufReader::new(child.stdout.take().expect("stdout")).read_line(&mut line).expect("stdout is read");
    let bridge = Bridge(child);
    let ready: serde_json::Value = serde_json::from_str(&line).expect("one line of JSON");
    let locator = ready["ros"][0].as_str().expect("a locator").to_owned();

    let context = ZContextBuilder::default()
        .with_domain_id(7)
        .disable_multicast_scouting()
        .with_connect_endpoints([locator])
        .build()
        .expect("a context");
    let node = context.create_node("driver").build().expect("a node");
    let corrected = node.create_sub::<Imu>("/imu/data").build().expect("a subscription");
    let diagnostics = node.create_sub::<DiagnosticArray>("/diagnostics").build().expect("a subscription");
    let raw = node.create_pub::<Imu>("/imu/data_raw").build().expect("a publisher");
    let temperatures = CHANNELS.map(|channel| {
        node.create_pub::<Temperature>(&format!("/imu/temperature/{channel}")).build().expect("a publisher")
    });

    let graph = context.graph();
    let wanted: BTreeSet<(String, String)> = [
        ("/imu/data", "sensor_msgs::msg::dds_::Imu_"),
        ("/imu/data_raw", "sensor_msgs::msg::dds_::Imu_"),
        ("/imu/temperature/board", "sensor_msgs::msg::dds_::Temperature_"),
        ("/diagnostics", "diagnostic_msgs::msg::dds_::DiagnosticArray_"),
    ]
    .map(|(topic, kind)| (topic.to_owned(), kind.to_owned()))
    .into();
    let services = ["standby", "run", "rollback"].map(|name| format!("/isotherm/MEMS_0001/{name}"));
    in_time("the bridge in the graph", async {
        loop {
            let topics: BTreeSet<_> = graph.get_topic_names_and_types().into_iter().collect();
            let offered: Vec<_> = graph.get_service_names_and_types();
            let has = |service: &String| {
                offered.iter().any(|(name, kind)| name == service && kind == "std_srvs::srv::dds_::Trigger_")
            };
            let nodes = graph.get_node_names();
            let heard = graph.get_entities_by_topic(EndpointKind::Subscription, "/imu/data_raw").len() == 1;
            if wanted.is_subset(&topics)
                && services.iter().all(has)
                && nodes.iter().any(|(name, _)| name == "isotherm")
                && heard
            {
                break;
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    })
    .await;
    let output = graph.get_entities_by_topic(EndpointKind::Publisher, "/imu/data");
    let [output] = &output[..] else { panic!("one publisher: {output:?}") };
    let Entity::Endpoint(output) = &**output else { panic!("an endpoint: {output:?}") };
    println!("/imu/data: {:?}", output.qos);

    for (channel, publisher) in CHANNELS.iter().zip(&temperatures) {
        // A voltage at which the channel is near 25 °C is no matter here: what counts is that it comes.
        let message = Temperature { header: header(0), temperature: 1.0, variance: 0.0 };
        in_time(channel, publisher.async_publish(&message)).await.expect("sent");
    }
    for number in 1..=messages {
        let rate = Vector3 { x: 0.1, y: -0.2, z: 0.3 };
        let force = Vector3 { x: 0.0, y: 0.0, z: 9.8 };
        let header = header(number);
        let message = Imu {
            header: header.clone(),
            angular_velocity: rate,
            linear_acceleration: force,
            ..Imu::default()
        };
        in_time("sending", raw.async_publish(&message)).await.expect("sent");
        let back = in_time("a corrected message", corrected.async_recv()).await.expect("a message");
        let stamps = [&back.header.stamp, &header.stamp].map(|stamp| (stamp.sec, stamp.nanosec));
        assert_eq!(stamps[0], stamps[1], "message {number}");
        assert_eq!(back.header.frame_id, "imu_link");
        let (rate, force) = (&back.angular_velocity, &back.linear_acceleration);
        assert!(
            (rate.x - 0.1).abs() < 0.05 && (rate.y + 0.2).abs() < 0.05 && (rate.z - 0.3).abs() < 0.05,
            "{rate:?}"
        );
        assert!((force.z - 9.8).abs() < 1.0, "{force:?}");
        assert!(back.angular_velocity_covariance[0] > 0.0);
    }
    let array = in_time("diagnostics", diagnostics.async_recv()).await.expect("a message");
    assert_eq!(array.status[0].hardware_id, "MEMS-0001");
    for service in &services[..2] {
        let client = node.create_client::<Trigger>(service).build().expect("a client");
        let reply = in_time(service, async {
            loop {
                match client.call(&TriggerRequest::default()).await {
                    Ok(reply) => break reply,
                    Err(error) => println!("{service}: {error}"),
                }
                tokio::time::sleep(Duration::from_millis(500)).await;
            }
        })
        .await;
        println!("{service}: {}", reply.message);
        assert!(reply.success, "{service}");
    }
    println!("{messages} messages came back corrected");
    drop(bridge);
}
