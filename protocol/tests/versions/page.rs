//! `docs/wire.md` names every counter, command and option (its tables: `layout`), and its examples of control messages are understood;
//! `docs/wire-vectors.txt` holds the frozen vectors, which decode to the JSON beside them.

use std::collections::BTreeSet;

use isotherm_correction::drift::ReferenceCounters;
use isotherm_correction::operation::State;
use isotherm_correction::unit::Counters;
use isotherm_protocol::codec;
use isotherm_protocol::control::{CommandOrder, CommandReply, Order, SwapReply};
use isotherm_protocol::history::{AuditEntry, AuditEvent};
use isotherm_protocol::key;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{bytes, decode_as, frames};

const PAGE: &str = include_str!("../../../docs/wire.md");
const VECTORS: &str = include_str!("../../../docs/wire-vectors.txt");

/// One test vector of the file.
#[derive(Default)]
pub(super) struct Vector {
    pub(super) name: &'static str,
    /// Kind of the key on which the frame must be refused; none for a good frame.
    pub(super) refused_as: Option<u8>,
    pub(super) frame: Vec<u8>,
    pub(super) json: String,
}

/// Every vector of `docs/wire-vectors.txt`, whose head describes its form.
pub(super) fn all_vectors() -> Vec<Vector> {
    let mut vectors: Vec<Vector> = Vec::new();
    for line in VECTORS.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        let (directive, rest) = line.split_once(' ').unwrap_or_else(|| panic!("no directive: {line}"));
        if let ("vector" | "refuse", name) = (directive, rest) {
            let (name, kind) = name.split_once(' ').map_or((name, None), |(name, kind)| (name, Some(kind)));
            let refused_as = kind.map(|kind| kind.parse().expect("a kind"));
            assert_eq!(refused_as.is_some(), directive == "refuse", "{line}");
            vectors.push(Vector { name, refused_as, ..Vector::default() });
            continue;
        }
        let vector = vectors.last_mut().expect("a frame begins with its name");
        match directive {
            "hex" => vector.frame.extend(bytes(rest)),
            "json" => vector.json.extend([rest, "\n"]),
            _ => panic!("no directive: {line}"),
        }
    }
    vectors
}

/// The frames that decode.
fn vectors() -> impl Iterator<Item = Vector> {
    all_vectors().into_iter().filter(|vector| vector.refused_as.is_none())
}

#[test]
fn the_published_vectors_are_the_frozen_ones() {
    let published: Vec<_> = vectors().map(|vector| (vector.name, vector.frame)).collect();
    let frozen: Vec<_> = frames().map(|(name, hex)| (name, bytes(hex))).collect();
    assert_eq!(published, frozen);
}

#[test]
fn the_published_vectors_decode_to_their_json() {
    for Vector { name, frame, json, .. } in vectors() {
        let said: serde_json::Value = serde_json::from_str(&json).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(decode_as(frame[0], &frame), Ok(said), "{name}");
    }
}

#[test]
fn every_reason_to_refuse_a_frame_has_its_vector() {
    let mut errors = BTreeSet::new();
    for Vector { name, refused_as, frame, .. } in all_vectors() {
        let Some(kind) = refused_as else { continue };
        let error = decode_as(kind, &frame).expect_err(name);
        errors.insert(format!("{error:?}").split([' ', '{']).next().unwrap_or_default().to_owned());
    }
    let all = "ChannelReadings Checksum HalfPeriods Kind Length Malformed MixedReadings Ticks Trailing Value Version";
    assert_eq!(errors.into_iter().collect::<Vec<_>>().join(" "), all, "every reason has its frame");
}

/// Every example of a control message under a label, read as `T` and written again, none field lost.
fn control_examples<T: DeserializeOwned + Serialize>(label: &str) -> Vec<T> {
    let opening = format!("\n```json {label}\n");
    let (_, rest) = PAGE.split_once(&opening).unwrap_or_else(|| panic!("{label} has examples"));
    let (block, _) = rest.split_once("\n```\n").expect("the end of the block");
    let said = serde_json::Deserializer::from_str(block).into_iter::<serde_json::Value>();
    let read = said.map(|said| {
        let said = said.unwrap_or_else(|e| panic!("{label}: {e}"));
        let read: T = serde_json::from_value(said.clone()).unwrap_or_else(|e| panic!("{label}: {e}"));
        let written = serde_json::to_value(&read).expect("JSON takes it");
        for (name, value) in said.as_object().expect("an object") {
            assert_eq!(written.get(name), Some(value), "{label}: {name}");
        }
        read
    });
    read.collect()
}

#[test]
fn the_examples_of_control_messages_are_understood() {
    assert_eq!(control_examples::<SwapReply>("swap-reply").len(), 1);
    let states: Vec<_> = control_examples::<CommandReply>("command-reply").iter().map(|r| r.state).collect();
    assert_eq!(states, [State::Standby, State::SelfTest]);
    let orders = control_examples::<CommandOrder>("order");
    assert!(matches!(&orders[1].order, Order::PreLaunch(order) if !order.install));
    assert_eq!(orders.len(), 5);
    let history = control_examples::<AuditEntry>("history");
    assert!(matches!(
        history.iter().map(|entry| &entry.event).collect::<Vec<_>>()[..],
        [AuditEvent::Accepted(_), AuditEvent::InForce(_)]
    ));
}

#[test]
fn the_page_names_every_option_of_a_swap_and_every_command() {
    for option in ["by", "dry_run", "at_sequence", "at_time_ns", "slew_s", "any_serial", "force"] {
        assert!(PAGE.contains(&format!("\n- `{option}`: ")), "{option}");
    }
    for command in State::ALL.into_iter().flat_map(State::allowed) {
        let item = format!("\n- `{command}`");
        assert!(PAGE.contains(&(item.clone() + ":")) || PAGE.contains(&(item + ",")), "{command}");
    }
}

#[test]
fn the_page_names_every_counter_of_the_core() {
    for (name, _) in Counters::default().iter() {
        assert!(PAGE.contains(&format!("\n- `{name}`: ")), "{name}");
    }
}

#[test]
fn the_page_names_every_counter_of_the_references() {
    for (name, _) in ReferenceCounters::default().iter() {
        assert!(PAGE.contains(&format!("\n- `references_{name}`: ")), "{name}");
    }
}

#[test]
fn the_page_states_keys_and_limits() {
    // As one line: where the page breaks its lines is no matter.
    let words: Vec<_> = PAGE.split_whitespace().collect();
    let page = words.join(" ");
    for text in [
        format!("`{}`", key::ALL_RAW),
        format!("`{}`", key::ALL_CORRECTED),
        format!("`{}`", key::ALL_STATUS),
        format!("`{}`", key::ALL_SERVICE_STATUS),
        format!("`{}`", key::ALL_JOURNALS),
        format!("`{}`", key::ALL_CONFIGURATIONS),
        format!("`{}`", key::ALL_UNITS_ALIVE),
        format!("`{}`", key::ALL_SERVICES_ALIVE),
        format!("`{}`", key::ALL_RECEIPTS),
        format!("`{}`", key::receipt("{session}")),
        format!("1…{} characters", key::MAX_UNIT_ID),
        format!("6…{} bytes", codec::MAX_FRAME),
    ] {
        assert!(page.contains(&text), "{text}");
    }
}
