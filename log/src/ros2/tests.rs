//! Bytes of the messages.

use isotherm_correction::sample::{CorrectedTick, TickFlags};
use isotherm_correction::units::Span;

use super::message::{Header, Imu, Temperature, Time, time, to_cdr};

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
    let bytes = to_cdr(&Temperature { header: header(), temperature: 1.5, variance: 0.0 }).unwrap();
    let expected: &[u8] = &[
        0, 1, 0, 0, // plain CDR, little-endian
        5, 0, 0, 0, 7, 0, 0, 0, // stamp
        4, 0, 0, 0, b'A', b'_', b'1', 0, // frame, with its zero
        0, 0, 0, 0, 0, 0, 0xf8, 0x3f, 0, 0, 0, 0, 0, 0, 0, 0,
    ];
    assert_eq!(bytes, expected);
    let longer = Header { frame_id: "A_12".to_owned(), ..header() };
    let bytes = to_cdr(&Temperature { header: longer, temperature: 1.5, variance: 0.0 }).unwrap();
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
    let numbers = |tick: &CorrectedTick| doubles(&to_cdr(&Imu::of_tick(header(), tick)).unwrap(), 37);
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
