//! Everything that crosses a boundary: wire messages, keys, versions and the calibration document.
//!
//! Bytes and text come in here and leave as validated types of the `isotherm-correction` crate, and the
//! other way round. What this crate refuses to do: open a session, a socket or a file.
//!
//! | module | holds |
//! |---|---|
//! | [`version`] | the compatibility policy, on its two constants |
//! | [`key`] | every key, built and parsed in one place |
//! | [`codec`] | frames: kind, version, body, checksum |
//! | [`raw`] | raw gyro, accelerometer and temperature batches |
//! | [`corrected`] | corrected batches |
//! | [`status`] | what a unit says of itself |
//! | [`stream`] | frames in, frames out for one unit |
//! | [`document`] | the calibration document: TOML in, validated calibration out |
//!
//! `docs/wire.md` describes the bytes for readers in other languages.

pub mod codec;
pub mod corrected;
pub mod document;
pub mod key;
pub mod raw;
pub mod status;
pub mod stream;
pub mod version;
