//! `docs/wire.md`: its vectors are the frozen ones and decode to what it says; its tables name every flag and counter.

use std::collections::BTreeSet;

use isotherm_correction::sample::{SensorFlags, TickFlags};
use isotherm_correction::unit::Counters;
use isotherm_protocol::{codec, key, raw, version};

use super::v1::FRAMES;
use super::{bytes, decode_as};

const PAGE: &str = include_str!("../../../docs/wire.md");

/// Name, hexadecimal and JSON of every vector on the page.
fn vectors() -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
    PAGE.split("\n### `").skip(1).filter_map(|section| {
        let (name, rest) = section.split_once('`')?;
        let (_, rest) = rest.split_once("\n```hex\n")?;
        let (hex, rest) = rest.split_once("\n```\n")?;
        let (_, rest) = rest.split_once("\n```json\n")?;
        let (json, _) = rest.split_once("\n```\n")?;
        Some((name, hex, json))
    })
}

/// Name, kind of the key and frame of every row of the table of frames to be refused.
fn refused() -> impl Iterator<Item = (&'static str, u8, Vec<u8>)> {
    PAGE.lines().filter_map(|line| {
        let mut cells = line.split('|').map(str::trim).skip(1);
        let name = cells.next()?.strip_prefix('`')?.strip_suffix('`')?;
        let kind = cells.next()?.parse().ok()?;
        let hex = cells.next()?.strip_prefix('`')?.strip_suffix('`')?;
        Some((name, kind, bytes(hex)))
    })
}

#[test]
fn the_vectors_of_the_page_are_the_frozen_ones() {
    let page: Vec<_> = vectors().map(|(name, hex, _)| (name, bytes(hex))).collect();
    let frozen: Vec<_> = FRAMES.iter().map(|(name, hex)| (*name, bytes(hex))).collect();
    assert_eq!(page, frozen);
}

#[test]
fn the_vectors_of_the_page_decode_to_what_it_says() {
    for (name, hex, json) in vectors() {
        let frame = bytes(hex);
        let said: serde_json::Value = serde_json::from_str(json).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(decode_as(frame[0], &frame), Ok(said), "{name}");
    }
}

#[test]
fn the_page_has_frames_that_are_refused() {
    let mut errors = BTreeSet::new();
    for (name, kind, frame) in refused() {
        let error = decode_as(kind, &frame).expect_err(name);
        errors.insert(format!("{error:?}").split([' ', '{']).next().unwrap_or_default().to_owned());
    }
    let all = "Checksum HalfPeriods Kind Length Malformed MixedReadings Ticks Trailing Version";
    assert_eq!(errors.into_iter().collect::<Vec<_>>().join(" "), all, "every reason has its frame");
}

#[test]
fn the_page_names_every_flag_with_its_bit() {
    let tick = TickFlags::all().iter_names().map(|(name, flag)| (name, flag.bits().trailing_zeros()));
    let sensor = SensorFlags::all().iter_names().map(|(name, flag)| (name, flag.bits().trailing_zeros()));
    for (name, bit) in tick.chain(sensor) {
        assert!(PAGE.contains(&format!("\n| {bit} | `{name}` |")), "bit {bit}, {name}");
    }
}

#[test]
fn the_page_names_every_counter_of_the_core() {
    for (name, _) in Counters::default().iter() {
        assert!(PAGE.contains(&format!("\n| `{name}` |")), "{name}");
    }
}

#[test]
fn the_page_states_versions_keys_and_limits() {
    // As one line: where the page breaks its lines is no matter.
    let words: Vec<_> = PAGE.split_whitespace().collect();
    let page = words.join(" ");
    for text in [
        format!("This page describes version {}.", version::CURRENT),
        format!("Versions from {} to {} are read.", version::MIN, version::CURRENT),
        format!("`{}`", key::ALL_RAW),
        format!("`{}`", key::ALL_CORRECTED),
        format!("`{}`", key::ALL_STATUS),
        format!("1…{} characters", key::MAX_UNIT_ID),
        format!("at most {} bytes", codec::MAX_FRAME),
        format!("1…{} ticks", codec::MAX_TICKS),
        format!("0…{} channels", raw::MAX_CHANNELS),
    ] {
        assert!(page.contains(&text), "{text}");
    }
}
