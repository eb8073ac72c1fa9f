//! Numbers, times, units of measure, and what is refused.

use isotherm_log::ros2::{Header, NOT_MEASURED, UNKNOWN, to_cdr};

use super::*;
use crate::Mapping;

const TICK_NS: i64 = 10_000_000;

fn mapping(changes: &str) -> UnitMapping {
    let text = format!(
        "version = 1\n[[unit]]\nserial = \"A-1\"\nraw = \"/raw\"\ncorrected = \"/imu\"\ntime.tick_ms = 10\naccel = {{}}\n{changes}\n\
         [[unit.temperature]]\ntopic = \"/t\"\nchannel = \"body\"\nunit = \"kelvin\"\n"
    );
    let mapping = Mapping::parse(&text, "m").unwrap_or_else(|problems| panic!("{problems:?}"));
    mapping.units.into_iter().next().unwrap()
}

fn at(ns: i64) -> Time {
    isotherm_log::ros2::time(ns).unwrap()
}

fn imu(stamp_ns: i64) -> Imu {
    let header = Header { stamp: at(stamp_ns), frame_id: "imu_link".to_owned() };
    Imu::new(header, Some([0.1, 0.2, 0.3]), Some([1.0, 2.0, 9.8]))
}

fn attachment(gid: u8, sequence: i64) -> Vec<u8> {
    Attachment { sequence, time_ns: 1, gid: [gid; 16] }.to_bytes()
}

/// What becomes of a good message.
fn take(feeder: &mut Feeder, gid: u8, sequence: i64, tick: i64) -> Result<Ticks, Refusal> {
    let payload = to_cdr(&imu(1_000_000_000 + tick * TICK_NS)).unwrap();
    feeder.imu(&payload, Some(&attachment(gid, sequence)))
}

#[test]
fn readings_are_in_si_and_end_at_their_stamp() {
    let mut feeder = Feeder::new(&mapping("gyro.unit = \"deg_per_s\""));
    let ticks = take(&mut feeder, 1, 1, 0).unwrap();
    assert!(ticks.restart && ticks.missing == 0 && ticks.frame_id == "imu_link");
    assert_eq!(
        (ticks.gyro.sequence, ticks.gyro.end_time.as_ns(), ticks.gyro.duration.as_ns()),
        (0, 1_000_000_000, TICK_NS)
    );
    assert!((ticks.gyro.readings[1] - 0.2_f64.to_radians()).abs() < 1e-18);
    let (output, accel) = ticks.accel.unwrap();
    assert_eq!((output, &*accel.readings), (OutputKind::Mean, &[1.0, 2.0, 9.8][..]));
    // Durations are those between stamps.
    let payload = to_cdr(&imu(1_000_000_000 + 11_000_000)).unwrap();
    let next = feeder.imu(&payload, Some(&attachment(1, 2))).unwrap();
    assert_eq!(
        (next.gyro.sequence, next.gyro.duration.as_ns(), next.deviation_ns),
        (1, 11_000_000, Some(1_000_000))
    );

    let mut starts = Feeder::new(&mapping("time.stamp = \"start\"\ngyro.unit = \"rad\""));
    let ticks = take(&mut starts, 1, 1, 0).unwrap();
    assert_eq!(ticks.gyro.end_time.as_ns(), 1_000_000_000 + TICK_NS);
    assert_eq!(ticks.gyro.readings[0].to_bits(), (0.1 / Span::from_ns(TICK_NS).as_s()).to_bits());
}

#[test]
fn a_gap_is_the_larger_of_what_numbers_and_stamps_say() {
    let mut feeder = Feeder::new(&mapping(""));
    let mut run = |sequence, tick| {
        let ticks = take(&mut feeder, 1, sequence, tick).unwrap();
        (ticks.gyro.sequence, ticks.missing, ticks.gyro.duration.as_ns() / TICK_NS)
    };
    assert_eq!(run(1, 0), (0, 0, 1));
    assert_eq!(run(2, 1), (1, 0, 1));
    // Two were lost on the way: numbers and stamps say the same.
    assert_eq!(run(5, 4), (4, 2, 1));
    // The driver left three out.
    assert_eq!(run(6, 8), (8, 3, 1));
    // One of another payload had the number between.
    assert_eq!(run(8, 9), (10, 1, 1));
    // One that is refused for its stamp came: it is no gap, unless the next stamp says so.
    for (refused, next, tick, expected) in [(9, 10, 10, (11, 0, 1)), (11, 12, 12, (13, 1, 1))] {
        assert_eq!(take(&mut feeder, 1, refused, 9).unwrap_err().kind(), "stamp_not_newer");
        let ticks = take(&mut feeder, 1, next, tick).unwrap();
        assert_eq!((ticks.gyro.sequence, ticks.missing, ticks.gyro.duration.as_ns() / TICK_NS), expected);
    }
}

#[test]
fn a_run_ends_with_its_publisher_or_after_eight_contradictions() {
    let mut feeder = Feeder::new(&mapping(""));
    take(&mut feeder, 1, 5, 0).unwrap();
    assert_eq!(take(&mut feeder, 1, 5, 0), Err(Refusal::Repeated { sequence: 5 }));
    assert_eq!(take(&mut feeder, 2, 1, 1), Err(Refusal::SecondPublisher));
    // Of a publisher that has left, the next one takes the place at once.
    feeder.left(&[9; 16]);
    assert_eq!(take(&mut feeder, 2, 2, 2), Err(Refusal::SecondPublisher));
    feeder.left(&[1; 16]);
    let ticks = take(&mut feeder, 2, 3, 3).unwrap();
    assert!(ticks.restart && ticks.gyro.sequence == 0);
    // A clock that was set back is believed after eight messages.
    for sequence in 4..11 {
        let refused = take(&mut feeder, 2, sequence, sequence - 50).unwrap_err();
        assert_eq!(refused.kind(), "stamp_not_newer", "{refused}");
    }
    assert!(take(&mut feeder, 2, 11, -39).unwrap().restart);
    assert!(!take(&mut feeder, 2, 12, -38).unwrap().restart);
}

/// Whatever is done to a message: it is refused with its kind, and the stream goes on as if it had not come.
#[test]
fn broken_messages_are_refused_and_the_stream_goes_on() {
    let good = to_cdr(&imu(1_000_000_000)).unwrap();
    let changed = |at: usize, bytes: &[u8]| {
        let mut changed = good.clone();
        changed[at..at + bytes.len()].copy_from_slice(bytes);
        changed
    };
    let of = |imu: Imu| to_cdr(&imu).unwrap();
    let without_rate = Imu { angular_velocity_covariance: NOT_MEASURED, ..imu(1_000_000_000) };
    let stamped = |sec, nanosec| {
        let header = Header { stamp: Time { sec, nanosec }, frame_id: String::new() };
        of(Imu { header, ..imu(1) })
    };
    let long = Header { stamp: at(1), frame_id: "x".repeat(256) };
    let cases = [
        (Vec::new(), "bad_encapsulation"),
        (good[..3].to_vec(), "bad_encapsulation"),
        (changed(1, &[3]), "bad_encapsulation"),
        (changed(1, &[7]), "bad_encapsulation"),
        (good[..4].to_vec(), "bad_payload"),
        (good[..good.len() - 1].to_vec(), "bad_payload"),
        ([&good[..], &[0; 8]].concat(), "bad_payload"),
        // The wrong byte order: the length of the frame's name becomes absurd.
        (changed(1, &[0]), "bad_payload"),
        (changed(12, &[0xff; 4]), "bad_payload"),
        // No UTF-8.
        (changed(16, &[0xff]), "bad_payload"),
        (of(Imu { header: long, ..imu(1) }), "bad_payload"),
        (of(without_rate), "no_angular_velocity"),
        (stamped(0, 0), "bad_stamp"),
        (stamped(-1, 0), "bad_stamp"),
        (stamped(5, 1_000_000_000), "bad_stamp"),
    ];
    let mut feeder = Feeder::new(&mapping(""));
    take(&mut feeder, 1, 1, 0).unwrap();
    for (number, (payload, kind)) in cases.iter().enumerate() {
        let refused = feeder.imu(payload, Some(&attachment(1, 2))).unwrap_err();
        assert_eq!(refused.kind(), *kind, "case {number}: {refused}");
    }
    let sound = attachment(1, 2);
    let old = [&[15], &b"sequence_number"[..], &sound].concat();
    for (bytes, kind) in [
        (None, "no_attachment"),
        (Some(&old[..]), "old_attachment"),
        (Some(&sound[..32]), "bad_attachment"),
        (Some(&[&sound[..], &[0]].concat()[..]), "bad_attachment"),
        (Some(&[][..]), "bad_attachment"),
        (Some(&attachment(1, -5)[..]), "bad_attachment"),
    ] {
        assert_eq!(feeder.imu(&good, bytes).unwrap_err().kind(), kind);
    }
    let next = take(&mut feeder, 1, 2, 1).unwrap();
    assert_eq!((next.gyro.sequence, next.missing, next.restart), (1, 0, false));
}

/// No bytes lead to a panic, and none but a whole message is taken.
#[test]
fn no_cut_and_no_changed_byte_does_harm() {
    let good = to_cdr(&imu(1_000_000_000)).unwrap();
    let mut feeder = Feeder::new(&mapping(""));
    for length in 0..good.len() {
        assert!(feeder.imu(&good[..length], Some(&attachment(1, 1))).is_err(), "{length} bytes");
    }
    for at in 0..40 {
        for byte in 0..=u8::MAX {
            let mut changed = good.clone();
            changed[at] = byte;
            let mut feeder = Feeder::new(&mapping(""));
            if let Ok(ticks) = feeder.imu(&changed, Some(&attachment(1, 1))) {
                assert_eq!(ticks.gyro.readings.len(), 3);
            }
        }
    }
}

#[test]
fn big_endian_messages_are_read() {
    let of = imu(1_000_000_000);
    let mut payload = vec![0, 0, 0, 0];
    cdr_big_endian(&of, &mut payload);
    let read: Imu = from_cdr(&payload).unwrap();
    assert_eq!(read, of);
}

/// An Imu message as a computer of the other byte order writes it.
fn cdr_big_endian(imu: &Imu, to: &mut Vec<u8>) {
    let Time { sec, nanosec } = imu.header.stamp;
    to.extend(sec.to_be_bytes());
    to.extend(nanosec.to_be_bytes());
    to.extend(9u32.to_be_bytes());
    to.extend(b"imu_link\0");
    while !(to.len() - 4).is_multiple_of(8) {
        to.push(0);
    }
    let orientation = [imu.orientation.x, imu.orientation.y, imu.orientation.z, imu.orientation.w];
    let parts: [&[f64]; 6] = [
        &orientation,
        &imu.orientation_covariance,
        &<[f64; 3]>::from(imu.angular_velocity),
        &imu.angular_velocity_covariance,
        &<[f64; 3]>::from(imu.linear_acceleration),
        &imu.linear_acceleration_covariance,
    ];
    to.extend(parts.iter().flat_map(|part| part.iter()).flat_map(|value| value.to_be_bytes()));
}

#[test]
fn accelerations_and_counts_are_taken_as_the_mapping_says() {
    let mut counts = Feeder::new(&mapping("gyro.unit = \"counts\""));
    let message = |rates| Imu::new(imu(1_000_000_000).header, Some(rates), None);
    let refused = counts.imu(&to_cdr(&message([1.0, 2.5, 3.0])).unwrap(), Some(&attachment(1, 1)));
    assert_eq!(refused.unwrap_err().kind(), "not_counts");
    let ticks = counts.imu(&to_cdr(&message([1.0, -2.0, 0.0])).unwrap(), Some(&attachment(1, 1))).unwrap();
    assert_eq!((ticks.output, &*ticks.gyro.readings), (OutputKind::Counts, &[1.0, -2.0, 0.0][..]));
    assert_eq!(ticks.accel, None, "the message says that it has no acceleration");
    let known = Imu { linear_acceleration_covariance: UNKNOWN, ..message([1.0, 2.0, 3.0]) };
    let ticks = Feeder::new(&mapping("")).imu(&to_cdr(&known).unwrap(), Some(&attachment(1, 1))).unwrap();
    assert!(ticks.accel.is_some());
}

#[test]
fn temperatures_are_converted_and_checked() {
    let feeder = Feeder::new(&mapping(""));
    let header = imu(7_000_000_000).header;
    let payload = to_cdr(&Temperature { header, temperature: 300.0, variance: 0.0 }).unwrap();
    let reading = feeder.temperature(0, &payload, Some(&attachment(3, 1))).unwrap().unwrap();
    assert_eq!((&*reading.channel, reading.time.as_ns()), ("body", 7_000_000_000));
    assert!((reading.raw - 26.85).abs() < 1e-12);
    assert_eq!(
        feeder.temperature(0, &payload[..30], Some(&attachment(3, 1))).unwrap_err().kind(),
        "bad_payload"
    );
    assert_eq!(feeder.temperature(0, &payload, None).unwrap_err().kind(), "no_attachment");
}
