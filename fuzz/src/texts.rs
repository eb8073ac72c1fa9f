//! Texts that people write.

use std::sync::LazyLock;

use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::{Document, Parsed};
use isotherm_protocol::overlay::{Candidate, Overlay, is_overlay};

use crate::said::{listed, on_one_line};

/// A document: what is taken is written as text that says the same, to the digest of a second writing.
pub fn document(input: &[u8]) {
    match Document::parse_bytes(input, Some("a.toml")) {
        Err(problems) => listed(&problems),
        Ok(parsed) => {
            assert_eq!(parsed.digest, Digest::of(input));
            parsed.warnings.iter().for_each(on_one_line);
            let text = parsed.document.to_toml().expect("what is read can be written");
            let again = Document::parse(&text, None).expect("what is written can be read");
            assert!(again.document == parsed.document, "says something else:\n{text}");
            assert!(again.calibration == parsed.calibration, "corrects otherwise:\n{text}");
            assert_eq!(again.document.to_toml().ok().as_ref(), Some(&text));
        }
    }
}

/// The document that overlays are for.
const BASE: &str = include_str!("../../config/calibration/ZLG-0001.toml");
static PARSED: LazyLock<Parsed> = LazyLock::new(|| Document::parse(BASE, None).expect("a shipped document"));

/// An overlay: what is taken is written as text that says the same, and what it makes of its base is a document by itself.
pub fn overlay(input: &[u8]) {
    let Ok(text) = str::from_utf8(input) else { return };
    let overlay = match Overlay::parse(text, Some("a.toml")) {
        Err(problems) => return listed(&problems),
        Ok(overlay) => overlay,
    };
    assert!(is_overlay(text));
    assert_eq!(overlay.digest, Digest::of(input));
    let written = overlay.overlay.to_toml().expect("what is read can be written");
    let again = Overlay::parse(&written, None).expect("what is written can be read");
    assert!(again.overlay == overlay.overlay, "says something else:\n{written}");
    match overlay.apply(&PARSED) {
        Err(problems) => listed(&problems),
        Ok(document) => match Candidate::parse(text, Some("a.toml"), Some(BASE)) {
            Err(problems) => listed(&problems),
            Ok(candidate) => {
                assert!(candidate.document == document);
                candidate.warnings.iter().for_each(on_one_line);
                let alone = Candidate::parse(&candidate.text, None, None).expect("a document by itself");
                assert!(alone.digest == candidate.digest && alone.calibration == candidate.calibration);
            }
        },
    }
}
