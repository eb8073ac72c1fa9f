//! The second generation, byte by byte: version 2 of the status, and the first versions of the kinds that came with it.
//!
//! If a test here fails, do not change the test: the change to the messages has broken every consumer in the field. Make a
//! new version instead (`protocol/src/version.rs` has the policy) and leave this file as it is. It may be deleted only when
//! `min` of these kinds is raised beyond these versions.

use isotherm_protocol::codec::{Message, decode, encode};
use isotherm_protocol::control::Schedule;
use isotherm_protocol::corrected::Revision;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::raw::{HealthBatch, HealthReading, HealthTick};
use isotherm_protocol::reference::Reference;
use isotherm_protocol::service_status::{
    BadDocument, FolderState, FolderStatus, ServiceStatus, StoreStatus, UnitSummary,
};
use isotherm_protocol::status::{Counter, Fault, Latency, LatencyBucket, Output, State, Status};

use super::bytes;

mod frames;
mod status;

pub(super) use frames::FRAMES;

/// The frozen frame of a name.
fn frame(name: &str) -> Vec<u8> {
    let found = FRAMES.iter().find(|(other, _)| *other == name);
    bytes(found.expect("a frame of this name").1)
}

/// The frame is read as the message, and the message is written as the frame.
///
/// Compared as text: every digit of every number, and NaN is like NaN.
fn holds<M: Message + std::fmt::Debug>(name: &str, version: u8, message: &M) {
    let frame = frame(name);
    assert_eq!(frame[1], version, "{name}");
    let read: M = decode(&frame).expect("a good frame");
    assert_eq!(format!("{read:?}"), format!("{message:?}"), "{name} is read");
    if M::VERSIONS.current == version {
        assert_eq!(encode(message).expect("a good message"), frame, "{name} is written");
    }
}

fn channel(name: &str) -> isotherm_correction::sample::ChannelName {
    name.try_into().expect("a short name")
}

fn digest(first: u8) -> Digest {
    let mut digest = Digest([0xaa; 32]);
    (first..first + 8).zip(&mut digest.0).for_each(|(value, byte)| *byte = value);
    digest
}

fn revision(counter: u64, first: u8) -> Revision {
    Revision { counter, digest: digest(first).head() }
}

fn fault() -> Fault {
    Fault {
        kind: "bad_frames_checksum".to_owned(),
        count: 3,
        first: "raw/gyro: checksum is 0x00000000, the bytes give 0x01020304".to_owned(),
        last_unix_ms: 1_750_000_000_123,
    }
}

#[test]
fn raw_health() {
    let reading = |name, value| HealthReading { name: channel(name), value };
    let first = HealthTick {
        time_ns: 1_000_000_000,
        readings: vec![reading("u-half-x", 41.5), reading("errors", 7.0)],
    };
    let second = HealthTick { time_ns: -1, readings: vec![reading("u-half-x", f64::NAN)] };
    holds("raw-health", 1, &HealthBatch { ticks: vec![first, second] });
    holds("raw-health-empty", 1, &HealthBatch { ticks: vec![HealthTick { time_ns: 5, readings: vec![] }] });
}

#[test]
fn reference() {
    let rest = Reference {
        start_ns: 60_000_000_000,
        end_ns: 120_000_000_000,
        angular_rate_rad_per_s: [4.18e-5, 0.0, -5.97e-5],
        sigma_rad_per_s: 1e-9,
    };
    holds("reference", 1, &rest);
    let edges = Reference {
        start_ns: i64::MIN,
        end_ns: i64::MAX,
        angular_rate_rad_per_s: [-0.0, 5e-324, -1e300],
        sigma_rad_per_s: 0.0,
    };
    holds("reference-edges", 1, &edges);
}

#[test]
fn service_status() {
    let unit = |unit: &str, state, output| UnitSummary { unit: unit.to_owned(), state, output };
    let typical = ServiceStatus {
        instance: "d36a8f01".to_owned(),
        version: "0.2.0".to_owned(),
        pid: Some(4242),
        started_unix_ms: 1_750_000_000_000,
        uptime_s: 12.5,
        units: vec![
            unit("ZLG-0001", State::RunningWithReversal, Output::Calibrated),
            unit("ZLG-0042", State::Standby, Output::Held),
        ],
        calibrations: Some(FolderStatus {
            path: "/etc/isotherm/calibration".to_owned(),
            state: FolderState::Polling,
            reason: Some("no more watches".to_owned()),
        }),
        bad_documents: vec![BadDocument {
            file: "zlg-0007.toml".to_owned(),
            problem: "zlg-0007.toml:2:8: unit: is missing".to_owned(),
            problems: 3,
        }],
        store: Some(StoreStatus { path: "/var/lib/isotherm".to_owned(), audit_entries: 311 }),
        faults: vec![fault()],
        settings_digest: Some(digest(1)),
        swaps_accepted: 17,
        swaps_refused: 2,
    };
    holds("service-status", 1, &typical);
    let folder = |state| Some(FolderStatus { path: String::new(), state, reason: None });
    let watching = ServiceStatus { calibrations: folder(FolderState::Watching), ..ServiceStatus::default() };
    holds("service-status-new", 1, &watching);
    let gone = ServiceStatus {
        started_unix_ms: i64::MIN,
        pid: Some(u32::MAX),
        uptime_s: f64::NAN,
        swaps_accepted: u64::MAX,
        calibrations: folder(FolderState::Gone),
        ..ServiceStatus::default()
    };
    holds("service-status-edges", 1, &gone);
}
