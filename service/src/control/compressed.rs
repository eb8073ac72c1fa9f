//! Texts and documents that are kept for long and read seldom.

use std::io::{Read, Write};
use std::sync::Arc;

use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;

/// Bytes in little room: deflated, and shared by whoever keeps them. A calibration document of a few kilobytes takes a
/// quarter of them, which counts where there are thousands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Compressed {
    deflated: Arc<[u8]>,
    length: usize,
}

impl Compressed {
    /// Keeps them.
    #[must_use]
    pub fn new(bytes: &[u8]) -> Self {
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::fast());
        // Writing to a vector does not fail.
        let _ = encoder.write_all(bytes);
        Self { deflated: encoder.finish().unwrap_or_default().into(), length: bytes.len() }
    }

    /// The bytes.
    pub(crate) fn read(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.length);
        // Its own, in memory: there is nothing that could be wrong with them.
        let _ = DeflateDecoder::new(&*self.deflated).read_to_end(&mut bytes);
        bytes
    }

    /// They as the text that they were.
    pub(crate) fn text(&self) -> String {
        String::from_utf8(self.read()).unwrap_or_default()
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.length
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kept_is_read_as_it_was_and_is_small() {
        let document = include_str!("../../../config/calibration/MEMS-0001.toml");
        for text in ["", "°", document] {
            let kept = Compressed::new(text.as_bytes());
            assert_eq!((kept.text().as_str(), kept.len()), (text, text.len()));
        }
        assert!(Compressed::new(document.as_bytes()).deflated.len() * 3 < document.len());
    }

    #[test]
    fn what_is_no_text_is_kept_too() {
        let bytes = [0xff, 0x00, 0xfe];
        assert_eq!(Compressed::new(&bytes).read(), bytes);
    }
}
