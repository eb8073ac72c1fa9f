//! Tokens as others write them. What is written here is frozen in `vectors.json`.

mod hiroz;

use super::*;
use crate::Mapping;
use crate::graph::{Finding, Topics};
use crate::interface::{IMU, NO_HASH};

fn node(name: &str) -> Node {
    Node { domain: 3, session: "ab12".to_owned(), namespace: "/car".to_owned(), name: name.to_owned() }
}

#[test]
fn tokens_are_read_as_they_are_written() {
    let token = node("imu").endpoint(7, Kind::Publisher, "/imu/raw", IMU, Qos::SENSOR_DATA);
    let topic = Some(("/imu/raw".to_owned(), IMU.dds.to_owned(), IMU.hash.to_owned()));
    let seen = Seen { kind: Kind::Publisher, node: "/car/imu".to_owned(), topic };
    assert_eq!(parse(&token), Some(seen.clone()));
    // Lyrical and rolling say more at the end.
    assert_eq!(parse(&format!("{token}/backends:cpu")), Some(seen));
    assert_eq!(parse(&node("imu").token()).map(|seen| (seen.kind, seen.topic)), Some((Kind::Node, None)));
    for broken in
        ["", "@ros2_lv", "x/0/z/0/0/NN/%/%/n", "@ros2_lv/0/z/0/0/XX/%/%/n", "@ros2_lv/0/z/0/1/MP/%/%/n/%t"]
    {
        assert_eq!(parse(broken), None, "{broken}");
    }
}

#[test]
fn publishers_that_cannot_be_heard_are_found() {
    let text =
        "version = 1\n[[unit]]\nserial = \"A-1\"\nraw = \"/raw\"\ncorrected = \"/imu\"\ntime.tick_ms = 10\n";
    let topics = Topics::of(&Mapping::parse(text, "m").unwrap());
    let judge = |topic: &str, dds: &str, hash: &str| {
        let topic = Some((topic.to_owned(), dds.to_owned(), hash.to_owned()));
        topics.judge(&Seen { kind: Kind::Publisher, node: "/driver".to_owned(), topic })
    };
    assert_eq!(judge("/raw", IMU.dds, IMU.hash), None);
    assert_eq!(judge("/raw", IMU.dds, NO_HASH), Some(Finding::Humble));
    assert!(matches!(judge("/raw", "x::msg::dds_::Y_", IMU.hash), Some(Finding::OtherType(_))));
    assert!(matches!(judge("/raw", IMU.dds, "RIHS01_00"), Some(Finding::OtherType(_))));
    assert_eq!(judge("/imu", IMU.dds, IMU.hash), Some(Finding::OnOutput));
    assert_eq!(judge("/other", "x", "y"), None);
}
