//! A stream written down and read back.
//!
//! | bytes | meaning |
//! |---|---|
//! | first | [`MEMORY_VERSION`] of the program that wrote it: its length, its text |
//! | … | the stream, postcard |
//! | last 4 | CRC-32 (as in [`crate::codec`]) of all bytes before, little-endian |
//!
//! The form of the stream is whatever the program's types are: only the version that wrote a memory reads it.

use thiserror::Error;

use super::UnitStream;
use crate::codec;

/// Version of the program and of the form of its memory, in words.
///
/// The number behind the program's version goes up with every change of a type that is part of the memory; a test of
/// this module notices.
pub const MEMORY_VERSION: &str = concat!("isotherm ", env!("CARGO_PKG_VERSION"), ", memory 15");

/// CRC-32 behind.
const CHECKSUM: usize = 4;
/// Longest version that is repeated in an error, in characters.
const LONGEST_VERSION: usize = 80;

/// Why a memory cannot be gone on with.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum MemoryError {
    /// Too short to be one.
    #[error("the memory has only {length} bytes: it was cut short")]
    Length {
        /// Its length in bytes.
        length: usize,
    },
    /// The bytes changed on their way.
    #[error("the memory's checksum is {got:#010x}, its bytes give {need:#010x}: it was damaged")]
    Checksum {
        /// The checksum found.
        got: u32,
        /// The checksum of the bytes.
        need: u32,
    },
    /// Another version of the program wrote it.
    #[error(
        "the memory was written by \"{got}\", this program is \"{need}\": a memory can be read only by the version \
         that wrote it"
    )]
    Version {
        /// The version that wrote it.
        got: String,
        /// The version that is to read it: [`MEMORY_VERSION`].
        need: &'static str,
    },
    /// It does not decode as its version says.
    #[error("the memory is malformed although its checksum is right: it was not written by this program")]
    Malformed,
}

impl UnitStream {
    /// Everything that the stream knows, as bytes.
    #[must_use]
    pub fn memory(&self) -> Vec<u8> {
        // Writing to a vector does not fail; what is empty, no reader takes.
        let mut bytes = postcard::to_allocvec(&(MEMORY_VERSION, self)).unwrap_or_default();
        codec::seal(&mut bytes);
        bytes
    }

    /// A stream that goes on where the one stood whose memory this is, to the same bits.
    ///
    /// # Errors
    /// [`MemoryError`], whatever the bytes are; first of all for the memory of another version.
    pub fn from_memory(memory: &[u8]) -> Result<Self, MemoryError> {
        let Some((covered, checksum)) = memory.split_last_chunk::<CHECKSUM>() else {
            return Err(MemoryError::Length { length: memory.len() });
        };
        let (got, need) = (u32::from_le_bytes(*checksum), crc32fast::hash(covered));
        if got != need {
            return Err(MemoryError::Checksum { got, need });
        }
        let (version, rest) =
            postcard::take_from_bytes::<&str>(covered).map_err(|_| MemoryError::Malformed)?;
        if version != MEMORY_VERSION {
            let got = version.chars().take(LONGEST_VERSION).collect();
            return Err(MemoryError::Version { got, need: MEMORY_VERSION });
        }
        match postcard::take_from_bytes(rest) {
            Ok((stream, [])) => Ok(stream),
            _ => Err(MemoryError::Malformed),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use isotherm_correction::earth::Place;
    use isotherm_correction::operation::Command;
    use isotherm_correction::prelaunch::PreLaunchSettings;
    use isotherm_correction::unit::{At, Change, UnitSettings};
    use isotherm_correction::units::Span;

    use super::*;
    use crate::document::Document;
    use crate::key::UnitId;
    use crate::stream::Label;

    /// A stream in which everything is that a command or a calibration makes; no tick has been corrected.
    fn stream() -> UnitStream {
        let parsed =
            Document::parse(include_str!("../../../config/calibration/example-full.toml"), None).unwrap();
        let label = Label::of(&parsed.document, parsed.digest, "a test");
        let mut stream = UnitStream::new(UnitId::new("U-1").unwrap(), UnitSettings::default());
        let calibration = Arc::new(parsed.calibration);
        for (revision, at) in [(1, At::NextTick), (2, At::Sequence(900))] {
            let calibration = Arc::clone(&calibration);
            stream.schedule(Change { calibration, revision, at, slew: Span::from_ms(5) }, label.clone());
        }
        let place = Place::new(0.0, 0.0, Some([0.0, 0.0])).unwrap();
        let pre_launch = PreLaunchSettings { place: Some(place), ..PreLaunchSettings::default() };
        let commands = [
            Command::Rest(place),
            Command::Standby,
            Command::PreLaunch(pre_launch),
            Command::Abort,
            Command::SelfTest,
        ];
        for command in &commands {
            stream.command(command).unwrap();
        }
        stream
    }

    #[test]
    fn the_form_of_a_memory_has_a_number() {
        let memory = stream().memory();
        // With its own checksum behind it, every memory has the same.
        let (covered, _) = memory.split_last_chunk::<CHECKSUM>().unwrap();
        assert_eq!(
            (MEMORY_VERSION, memory.len(), crc32fast::hash(covered)),
            ("isotherm 0.1.0, memory 15", 29_221, 4_128_281_057),
            "the form of the memory has changed, or the example: where it is the form, or in doubt, raise the number in \
             MEMORY_VERSION; then write the new figures here"
        );
    }

    #[test]
    fn a_memory_of_another_version_is_refused_with_both() {
        let got = "isotherm 9.9.9, memory 9".to_owned();
        let written = postcard::to_allocvec(&(&got, 17_u32)).unwrap();
        let memory = [&written[..], &crc32fast::hash(&written).to_le_bytes()].concat();
        let error = UnitStream::from_memory(&memory).unwrap_err();
        assert_eq!(error, MemoryError::Version { got, need: MEMORY_VERSION });
        assert!(matches!(UnitStream::from_memory(&[1, 2]), Err(MemoryError::Length { length: 2 })));
        let written = postcard::to_allocvec(&(MEMORY_VERSION, 17_u32)).unwrap();
        let memory = [&written[..], &crc32fast::hash(&written).to_le_bytes()].concat();
        assert_eq!(UnitStream::from_memory(&memory).unwrap_err(), MemoryError::Malformed);
    }
}
