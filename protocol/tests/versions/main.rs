//! The bytes of the wire messages: frozen vectors of every version, laws of the codec, and `docs/wire.md`.
#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod form;
mod laws;
mod layout;
mod page;
mod v1;
mod v2;
mod v3;
mod v4;
mod v5;

use isotherm_protocol::codec::{self, CodecError, Kind};
use isotherm_protocol::journal::JournalPart;
use isotherm_protocol::raw::HealthBatch;
use isotherm_protocol::reference::Reference;
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::{self, Status};
use serde::Serialize;

use form::{AccelBatch, CorrectedBatch, CorrectedBatch2, CorrectedBatch3, Form, GyroBatch, TemperatureBatch};

/// Name and frame of every vector, in hexadecimal, in the order of the page.
fn frames() -> impl Iterator<Item = (&'static str, &'static str)> {
    v1::FRAMES.iter().chain(v2::FRAMES).chain(v3::FRAMES).chain(v4::FRAMES).chain(v5::FRAMES).copied()
}

/// Bytes written in hexadecimal; spaces and line ends between them, and comments behind `#`, mean nothing.
fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<u32> = hex
        .lines()
        .flat_map(|line| line.split('#').next().unwrap_or_default().chars())
        .filter(|c| !c.is_whitespace())
        .map(|c| c.to_digit(16).expect("hexadecimal"))
        .collect();
    assert!(digits.len().is_multiple_of(2), "two digits per byte: {hex}");
    digits.chunks(2).map(|pair| u8::try_from(pair[0] * 16 + pair[1]).expect("two digits")).collect()
}

/// Decodes a frame as a message of a kind, and gives it back in JSON (NaN as null).
fn decode_as(kind: u8, frame: &[u8]) -> Result<serde_json::Value, CodecError> {
    fn json<M: codec::Message + Serialize>(frame: &[u8]) -> Result<serde_json::Value, CodecError> {
        codec::decode::<M>(frame).map(|message| serde_json::to_value(message).expect("JSON takes it"))
    }
    fn form<F: Form>(frame: &[u8]) -> Result<serde_json::Value, CodecError> {
        let message = codec::decode::<F::Message>(frame)?;
        let form: F = postcard::from_bytes(&frame[2..frame.len() - 4]).expect("what the library reads");
        assert_eq!(format!("{message:?}"), format!("{:?}", form.message()), "both read the same");
        Ok(serde_json::to_value(form).expect("JSON takes it"))
    }
    match kind {
        1 => form::<GyroBatch>(frame),
        2 => form::<AccelBatch>(frame),
        3 => form::<TemperatureBatch>(frame),
        4 if frame.get(1) == Some(&2) => form::<CorrectedBatch2>(frame),
        4 if frame.get(1) == Some(&3) => form::<CorrectedBatch3>(frame),
        4 => form::<CorrectedBatch>(frame),
        5 if frame.get(1) == Some(&1) => {
            let old = json::<status::v1::Status>(frame);
            let current = codec::decode::<Status>(frame).err();
            assert_eq!(old.as_ref().err(), current.as_ref(), "version 1 is read as the current one too");
            old
        }
        5 => json::<Status>(frame),
        6 => json::<HealthBatch>(frame),
        7 => json::<ServiceStatus>(frame),
        8 => json::<Reference>(frame),
        9 => json::<JournalPart>(frame),
        _ => panic!("there is no kind {kind}"),
    }
}

#[test]
fn the_numbers_of_the_kinds_are_fixed() {
    let kinds = [
        Kind::RawGyro,
        Kind::RawAccel,
        Kind::RawTemperature,
        Kind::Corrected,
        Kind::Status,
        Kind::RawHealth,
        Kind::ServiceStatus,
        Kind::Reference,
        Kind::Journal,
    ];
    assert_eq!(kinds.map(|kind| kind as u8), [1, 2, 3, 4, 5, 6, 7, 8, 9]);
}
