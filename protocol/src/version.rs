//! Versions of the wire messages.
//!
//! The version is the second byte of every frame, where a reader sees it before it decodes anything.
//!
//! Policy: a reader accepts every version from [`MIN`] to [`CURRENT`] and refuses others by number. Any change of
//! a body — a field added, removed, moved or given another meaning, a new flag bit excepted — makes a new version. A
//! version is dropped (by raising [`MIN`]) only in a release that says so at the top of its changelog, and not before the
//! release after the one that introduced its successor. Each version from [`MIN`] on has frozen bytes in
//! `protocol/tests/versions/`; those files are never edited.

/// Oldest version that is still read.
pub const MIN: u8 = 1;
/// The version that is written.
pub const CURRENT: u8 = 1;
