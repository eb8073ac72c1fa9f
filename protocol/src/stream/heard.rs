//! What a stream was given so far: where in its inputs it stands.

use serde::{Deserialize, Serialize};

use super::UnitStream;
use crate::key::Input;

/// The frames that a stream was given of one input, bad ones included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub struct Heard {
    /// How many.
    pub frames: u64,
    /// The last four bytes of the last one, little-endian: the checksum of a good frame. 0 before the first frame, and
    /// for one of fewer than four bytes.
    pub crc: u32,
}

impl Heard {
    /// One frame more.
    pub fn note(&mut self, frame: &[u8]) {
        self.frames += 1;
        self.crc = frame.last_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
    }
}

impl UnitStream {
    /// What it was given, by [`Input::index`]. A unit that has started anew goes on counting.
    #[must_use]
    pub fn heard(&self) -> [Heard; Input::ALL.len()] {
        self.heard
    }

    pub(super) fn note_heard(&mut self, input: Input, frame: &[u8]) {
        if let Some(heard) = self.heard.get_mut(input.index()) {
            heard.note(frame);
        }
    }
}
