//! What the layout says is what the codec does.

use std::collections::BTreeMap;

use isotherm_correction::sample::{MAX_PARITY, MAX_SENSORS, SensorFlags, TickFlags};
use isotherm_protocol::codec::{self, Kind};
use isotherm_protocol::key::MAX_UNIT_ID;
use isotherm_protocol::{journal, raw, service_status, status, version};
use serde_json::Value;

use super::super::decode_as;
use super::super::page::{Vector, all_vectors};
use super::decode::decode;
use super::file::Layout;

#[test]
fn limits_are_those_of_the_codec() {
    let limits = Layout::load().limits;
    let limits: BTreeMap<_, _> = limits.iter().map(|(name, &limit)| (name.as_str(), limit)).collect();
    let ours = [
        ("frame_bytes", codec::MAX_FRAME),
        ("ticks", codec::MAX_TICKS),
        ("sensors", MAX_SENSORS),
        ("parity", MAX_PARITY),
        ("channels", raw::MAX_CHANNELS),
        ("unit_bytes", MAX_UNIT_ID),
        ("health_readings", raw::MAX_HEALTH),
        ("all_sensors", 2 * MAX_SENSORS),
        ("faults", status::MAX_FAULTS),
        ("units", service_status::MAX_UNITS),
        ("bad_documents", service_status::MAX_BAD_DOCUMENTS),
        ("parts", usize::try_from(journal::MAX_PARTS).expect("few")),
        ("part_bytes", journal::MAX_PART_BYTES),
    ];
    for (name, limit) in ours {
        assert_eq!(limits.get(name), Some(&limit), "{name}");
    }
}

#[test]
fn flags_are_those_of_the_core() {
    let layout = Layout::load();
    let said = |name: &str| -> Vec<(String, usize)> {
        let flags = layout.flags.iter().find(|flags| flags.name == name).expect("flags");
        flags.bits.iter().enumerate().map(|(bit, [name, _])| (name.clone(), bit)).collect()
    };
    let bit = |bits: u32| usize::try_from(bits.trailing_zeros()).expect("few");
    let tick = TickFlags::all();
    let tick = tick.iter_names().map(|(name, flag)| (name.to_owned(), bit(flag.bits().into())));
    assert_eq!(said("tick"), tick.collect::<Vec<_>>());
    let sensor = SensorFlags::all();
    let sensor = sensor.iter_names().map(|(name, flag)| (name.to_owned(), bit(flag.bits().into())));
    assert_eq!(said("sensor"), sensor.collect::<Vec<_>>());
}

#[test]
fn kinds_and_versions_are_those_of_the_codec() {
    let layout = Layout::load();
    let kinds = [
        (Kind::RawGyro, version::RAW_GYRO),
        (Kind::RawAccel, version::RAW_ACCEL),
        (Kind::RawTemperature, version::RAW_TEMPERATURE),
        (Kind::Corrected, version::CORRECTED),
        (Kind::Status, version::STATUS),
        (Kind::RawHealth, version::RAW_HEALTH),
        (Kind::ServiceStatus, version::SERVICE_STATUS),
        (Kind::Reference, version::REFERENCE),
        (Kind::Journal, version::JOURNAL),
    ];
    let said: Vec<_> = layout.kinds.iter().map(|kind| (kind.number, kind.bodies.len())).collect();
    let ours = kinds.map(|(kind, versions)| {
        assert_eq!(versions.min, 1, "the layout has every version");
        (kind as u8, usize::from(versions.current))
    });
    assert_eq!(said, ours);
}

#[test]
fn frozen_frames_have_the_fields_that_the_layout_says() {
    let layout = Layout::load();
    for Vector { name, refused_as, frame, json } in all_vectors() {
        let said = decode(&layout, refused_as.unwrap_or(frame[0]), &frame);
        if refused_as.is_some() {
            assert!(said.is_err(), "{name} is refused");
        } else {
            let json: Value = serde_json::from_str(&json).expect("JSON");
            assert_eq!(said, Ok(json), "{name}");
        }
    }
}

/// Every byte of every frozen frame, changed in several ways, and every frame cut short anywhere; the checksum fits again.
#[test]
fn frames_that_differ_in_one_byte_are_read_or_refused_alike() {
    let layout = Layout::load();
    let (mut read, mut refused) = (0, 0);
    let mut judge = |kind: u8, covered: &[u8]| {
        let frame = [covered, &crc32fast::hash(covered).to_le_bytes()].concat();
        let (ours, said) = (decode_as(kind, &frame), decode(&layout, kind, &frame));
        match (ours, said) {
            (Ok(ours), Ok(said)) => {
                assert_eq!(said, ours, "{frame:02x?}");
                read += 1;
            }
            (Err(_), Err(_)) => refused += 1,
            (ours, said) => panic!("{ours:?} but {said:?}: {frame:02x?}"),
        }
    };
    for Vector { refused_as, frame, .. } in all_vectors().into_iter().filter(|vector| vector.frame.len() >= 6)
    {
        let kind = refused_as.unwrap_or(frame[0]);
        let covered = &frame[..frame.len() - 4];
        for at in 0..covered.len() {
            judge(kind, &covered[..at.max(2)]);
            for change in [0x01, 0x02, 0x40, 0x80, 0x81, 0xff] {
                let mut changed = covered.to_vec();
                changed[at] ^= change;
                judge(kind, &changed);
            }
        }
    }
    assert!(read > 1000 && refused > 1000, "{read} read, {refused} refused");
}
