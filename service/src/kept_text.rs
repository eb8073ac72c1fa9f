//! Texts that are kept for long and read seldom.

use std::io::{Read, Write};
use std::sync::Arc;

use flate2::Compression;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;

/// A text in little room: deflated, and shared by whoever keeps it. A calibration document of a few kilobytes takes a
/// quarter of them, which counts where there are thousands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeptText {
    deflated: Arc<[u8]>,
    length: usize,
}

impl KeptText {
    /// Keeps a text.
    #[must_use]
    pub fn new(text: &str) -> Self {
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::fast());
        // Writing to a vector does not fail.
        let _ = encoder.write_all(text.as_bytes());
        Self { deflated: encoder.finish().unwrap_or_default().into(), length: text.len() }
    }

    /// The text.
    #[must_use]
    pub fn read(&self) -> String {
        let mut text = String::with_capacity(self.length);
        // Its own bytes, in memory: there is nothing that could be wrong with them.
        let _ = DeflateDecoder::new(&*self.deflated).read_to_string(&mut text);
        text
    }

    /// Its length (bytes).
    #[must_use]
    pub fn len(&self) -> usize {
        self.length
    }

    /// Whether there is nothing in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kept_text_is_read_as_it_was_and_is_small() {
        let document = include_str!("../../config/calibration/MEMS-0001.toml");
        for text in ["", "°", document] {
            let kept = KeptText::new(text);
            assert_eq!(
                (kept.read().as_str(), kept.len(), kept.is_empty()),
                (text, text.len(), text.is_empty())
            );
        }
        assert!(KeptText::new(document).deflated.len() * 3 < document.len());
    }
}
