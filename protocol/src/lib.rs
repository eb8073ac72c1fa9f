//! Everything that crosses a boundary: wire messages, keys, versions and the calibration document.
//!
//! Bytes and text come in here and leave as validated types of the `isotherm-correction` crate, and the
//! other way round. What this crate refuses to do: open a session, a socket or a file.
//!
//! | module | holds |
//! |---|---|
//! | [`version`] | the compatibility policy and the versions of each kind of message |
//! | [`key`] | every key, built and parsed in one place |
//! | [`codec`] | frames: kind, version, body, checksum |
//! | [`digest`] | SHA-256 digests: bytes on the wire, digits in JSON |
//! | [`raw`] | raw gyro, accelerometer, temperature and health batches |
//! | [`corrected`] | corrected batches |
//! | [`mod@reference`] | a known angular rate, for the drift estimator |
//! | [`status`] | what a unit says of itself |
//! | [`service_status`] | what a service instance says of itself |
//! | [`stream`] | frames in, frames out for one unit |
//! | [`control`] | what operators ask of a running unit, and the answers |
//! | [`journal`] | what acts on a unit's stream beside its frames, so that a log alone is enough to correct it again |
//! | [`replay`] | frames and journal in the order in which a service had them; a stream that follows another one |
//! | [`pair`] | several services of one stream: who they are, who speaks |
//! | [`history`] | what was done to a unit: the entries of the audit file |
//! | [`document`] | the calibration document: TOML in, validated calibration out; differences of two |
//! | [`overlay`] | changes of a document's bias constants, such as a pre-launch calibration's; the one way in for both |
//! | [`escape`] | text of others shown to people, without line breaks and marks of direction |
//! | [`signature`] | who signed a calibration document, and whether it is unchanged |
//!
//! `docs/wire.md` describes the bytes for readers in other languages.

pub mod codec;
pub mod control;
pub mod corrected;
pub mod digest;
pub mod document;
pub mod history;
pub mod journal;
pub mod key;
pub mod overlay;
pub mod pair;
pub mod raw;
pub mod reference;
pub mod replay;
pub mod service_status;
pub mod signature;
pub mod status;
pub mod stream;
pub mod version;

pub use isotherm_document::escape;
