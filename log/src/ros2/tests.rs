//! Bytes of the messages, and a bag as MCAP readers find it.

use std::collections::BTreeMap;

use isotherm_correction::sample::{AccelTick, CorrectedTick, GyroTick, OutputKind, TickFlags};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::document::Document;

use super::message::{Header, Imu, RosMessage, Temperature, Time, time};
use super::nominal::Nominal;
use super::{BagWriter, metadata};

fn header() -> Header {
    Header { stamp: Time { sec: 5, nanosec: 7 }, frame_id: "A_1".to_owned() }
}

/// The doubles at the end of a message.
fn doubles(bytes: &[u8], count: usize) -> Vec<f64> {
    let tail = &bytes[bytes.len() - 8 * count..];
    tail.chunks_exact(8).map(|chunk| f64::from_le_bytes(chunk.try_into().unwrap())).collect()
}

#[test]
fn a_temperature_has_these_bytes() {
    let bytes = Temperature { header: header(), temperature: 1.5, variance: 0.0 }.to_cdr().unwrap();
    let expected: &[u8] = &[
        0, 1, 0, 0, // plain CDR, little-endian
        5, 0, 0, 0, 7, 0, 0, 0, // stamp
        4, 0, 0, 0, b'A', b'_', b'1', 0, // frame, with its zero
        0, 0, 0, 0, 0, 0, 0xf8, 0x3f, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    assert_eq!(bytes, expected);
    let longer = Header { frame_id: "A_12".to_owned(), ..header() };
    let bytes = Temperature { header: longer, temperature: 1.5, variance: 0.0 }.to_cdr().unwrap();
    // Seventeen bytes behind the encapsulation, then seven up to the next multiple of eight.
    assert_eq!(bytes[20..28], [0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(bytes.len(), 4 + 17 + 7 + 16);
}

#[test]
fn an_imu_message_states_means_and_says_what_it_does_not_know() {
    let tick = CorrectedTick {
        duration: Span::from_ms(10),
        delta_angle: [0.01, 0.02, 0.03],
        delta_velocity: [0.1, 0.2, 0.3],
        ..CorrectedTick::default()
    };
    let numbers = |tick: &CorrectedTick| doubles(&Imu::of_tick(header(), tick).to_cdr().unwrap(), 37);
    let seconds = Span::from_ms(10).as_s();
    let known = numbers(&tick);
    assert_eq!(known[..4], [0.0, 0.0, 0.0, 1.0]);
    assert_eq!((known[4], known[13 + 3], known[25 + 3]), (-1.0, 0.0, 0.0));
    assert_eq!(known[13..16], [0.01 / seconds, 0.02 / seconds, 0.03 / seconds]);
    assert_eq!(known[25..28], [0.1 / seconds, 0.2 / seconds, 0.3 / seconds]);
    let alone = numbers(&CorrectedTick { flags: TickFlags::ACCELEROMETER_MISSING, ..tick.clone() });
    assert_eq!((alone[16], alone[28], alone[25]), (0.0, -1.0, 0.0));
    let invalid = numbers(&CorrectedTick { flags: TickFlags::ANGLE_INVALID, ..tick });
    assert_eq!((invalid[16], invalid[28], invalid[13]), (-1.0, 0.0, 0.0));
}

#[test]
fn a_time_of_ros_has_68_years() {
    assert_eq!(time(1_700_000_000_123_456_789), Some(Time { sec: 1_700_000_000, nanosec: 123_456_789 }));
    assert_eq!(time(0), Some(Time { sec: 0, nanosec: 0 }));
    assert_eq!(time(-1), None);
    assert_eq!(time(i64::from(i32::MAX) * 1_000_000_000 + 999_999_999).map(|time| time.sec), Some(i32::MAX));
    assert_eq!(time((i64::from(i32::MAX) + 1) * 1_000_000_000), None);
}

#[test]
fn raw_readings_are_stated_only_where_their_unit_is_known() {
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/ZLG-0001.toml"));
    let laser = Nominal::of(&Document::parse(&text.unwrap(), None).unwrap().document);
    let unknown = Nominal::default();
    let tick = |readings: &[f64]| GyroTick {
        readings: readings.iter().copied().collect(),
        duration: Span::from_ms(10),
        end_time: Timestamp::from_ns(0),
        ..GyroTick::default()
    };
    assert_eq!(unknown.rate(OutputKind::Mean, &tick(&[1.0, 2.0, 3.0])), Some([1.0, 2.0, 3.0]));
    assert_eq!(unknown.rate(OutputKind::Mean, &tick(&[1.0, 2.0, 3.0, 4.0])), None);
    assert_eq!(unknown.rate(OutputKind::Counts, &tick(&[1.0, 2.0, 3.0])), None);
    assert!(!unknown.states(OutputKind::Counts, 3) && laser.states(OutputKind::Counts, 3));
    let rate = laser.rate(OutputKind::Counts, &tick(&[1000.0, -1000.0, 0.0])).unwrap();
    // A count of a laser gyro is around one second of arc: 1000 of them in 10 ms are some 0.5 rad/s.
    assert!((0.05..5.0).contains(&rate[0].abs()) && rate[0] * rate[1] < 0.0 && rate[2] == 0.0, "{rate:?}");
    let accel = AccelTick { readings: [1.0, 2.0, 3.0].into_iter().collect(), ..AccelTick::default() };
    assert_eq!(unknown.force(OutputKind::Mean, &accel), None, "volts or m/s²?");
}

#[test]
fn a_bag_describes_itself() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x_0.mcap");
    let mut bag = BagWriter::create(&path).unwrap();
    let origin = || BTreeMap::from([("unit".to_owned(), "A-1".to_owned())]);
    for (topic, time_ns) in [("/imu/A_1/temperature/b", 9), ("/imu/A_1/temperature/a", 4)] {
        let message = Temperature { header: header(), temperature: 1.5, variance: 0.0 };
        bag.write(topic, time_ns, &message, origin).unwrap();
    }
    bag.write("/imu/A_1/data", 7, &Imu::new(header(), None, None), origin).unwrap();
    let (summary, yaml) = bag.finish("x_0.mcap").unwrap();
    assert_eq!((summary.first_ns, summary.duration_ns(), summary.messages()), (Some(4), 5, 3));
    for line in ["  version: 5\n", "nanoseconds_since_epoch: 4\n", "        name: \"/imu/A_1/data\"\n"] {
        assert!(yaml.contains(line), "{line}\n{yaml}");
    }

    let bytes = std::fs::read(&path).unwrap();
    let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    assert_eq!(messages.len(), 3);
    let imu = messages.iter().find(|message| message.channel.topic == "/imu/A_1/data").unwrap();
    let schema = imu.channel.schema.as_ref().unwrap();
    assert_eq!((schema.name.as_str(), schema.encoding.as_str()), ("sensor_msgs/msg/Imu", "ros2msg"));
    assert_eq!((imu.channel.message_encoding.as_str(), imu.log_time), ("cdr", 7));
    assert_eq!(imu.channel.metadata["offered_qos_profiles"], metadata::QUALITY_OF_SERVICE);
    assert_eq!(imu.channel.metadata["unit"], "A-1");
}
