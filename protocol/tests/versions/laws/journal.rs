//! Laws of the journal: what is split is joined, and nothing else is taken for an entry.

use isotherm_correction::unit::UnitSettings;
use isotherm_protocol::codec::{decode, encode};
use isotherm_protocol::journal::{
    JoinError, JoinFault, Joiner, JournalEntry, JournalEvent, JournalPart, MAX_OPEN_ENTRIES, MAX_PART_BYTES,
    MAX_PARTS, split,
};
use isotherm_protocol::stream::Heard;
use proptest::prelude::*;

fn entry(unit: &str, number: u64, memory: usize) -> JournalEntry {
    let memory = (0..memory).map(|i| u8::try_from(i * 7 % 251).expect("below 251")).collect();
    let event = JournalEvent::Memory { memory, document: Some("schema = 1".to_owned()), pending: None };
    let heard = [Heard { frames: number, crc: 0xffff_ffff }; 5];
    JournalEntry { unit: unit.to_owned(), instance: "a1".to_owned(), number, heard, event }
}

/// The parts as they come off the wire.
fn sent(entry: &JournalEntry) -> Vec<JournalPart> {
    split(entry).iter().map(|part| decode(&encode(part).expect("a part")).expect("its frame")).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Parts of several units, one behind the other and mixed: each entry comes out whole with its last part.
    #[test]
    fn entries_come_back_from_their_parts(sizes in prop::collection::vec(0..3 * MAX_PART_BYTES, 1..5), turns: u64) {
        let entries: Vec<_> =
            (0..).zip(&sizes).map(|(i, size)| entry(&format!("U-{i}"), i + 1, *size)).collect();
        let mut left: Vec<_> = entries.iter().map(|entry| sent(entry).into_iter()).collect();
        let (mut joiner, mut joined, mut turns) = (Joiner::new(), Vec::new(), turns);
        while !left.is_empty() {
            turns = turns.rotate_left(5) ^ 0x9e37;
            let which = usize::try_from(turns % left.len() as u64).expect("an index");
            match left[which].next() {
                Some(part) => joined.extend(joiner.join(part).expect("a part in its turn")),
                None => drop(left.remove(which)),
            }
        }
        joined.sort_by_key(|entry| entry.number);
        prop_assert!(joined == entries);
        prop_assert_eq!(joiner.given_up(), 0);
    }

    #[test]
    fn no_parts_make_the_joiner_panic(
        parts in prop::collection::vec((any::<u8>(), 0..4u64, 0..4u32, 0..4u32, prop::collection::vec(any::<u8>(), 0..40)), 0..60)
    ) {
        let mut joiner = Joiner::new();
        for (unit, number, part, parts, bytes) in parts {
            let unit = (unit % 3).to_string();
            let _ = joiner.join(JournalPart { unit, instance: String::new(), number, part, parts, bytes });
        }
    }
}

#[test]
fn the_parts_of_an_entry_fit_a_frame_and_are_as_few_as_can_be() {
    for size in [0, MAX_PART_BYTES - 200, MAX_PART_BYTES, 2 * MAX_PART_BYTES, 5_000_000] {
        let parts = sent(&entry("U-1", 1, size));
        let bytes: usize = parts.iter().map(|part| part.bytes.len()).sum();
        assert_eq!(parts.len(), bytes.div_ceil(MAX_PART_BYTES), "{size} bytes of memory");
        assert!((0..).zip(&parts).all(|(index, part)| part.part == index));
    }
    let much = split(&entry("U-1", 1, MAX_PARTS as usize * MAX_PART_BYTES));
    assert!(encode(&much[0]).is_err(), "an entry that no reader takes is not sent");
}

#[test]
fn a_lost_part_loses_its_entry_and_no_other() {
    let (first, second) = (entry("U-1", 1, 2 * MAX_PART_BYTES), entry("U-1", 2, 10));
    let parts = sent(&first);
    let mut joiner = Joiner::new();
    assert_eq!(joiner.join(parts[0].clone()), Ok(None));
    let lost = joiner.join(parts[2].clone()).unwrap_err();
    assert!(matches!(lost.fault, JoinFault::Missing { got: 2, need: 1, parts: 3 }), "{lost}");
    assert_eq!(joiner.join(sent(&second).remove(0)), Ok(Some(second.clone())));
    // The end of an entry never comes.
    assert_eq!(joiner.join(parts[0].clone()), Ok(None));
    assert_eq!(joiner.join(sent(&second).remove(0)), Ok(Some(second)));
    assert_eq!(joiner.given_up(), 2);
    // Its end is the first that is heard of it.
    let late = joiner.join(parts[1].clone()).unwrap_err();
    assert!(matches!(late.fault, JoinFault::Missing { got: 1, need: 0, .. }), "{late}");
}

#[test]
fn parts_that_hold_another_entry_or_none_are_refused() {
    let good = sent(&entry("U-1", 1, 10)).remove(0);
    let mut joiner = Joiner::new();
    for other in [
        JournalPart { unit: "U-2".to_owned(), ..good.clone() },
        JournalPart { number: 2, ..good.clone() },
        JournalPart { instance: "b2".to_owned(), ..good.clone() },
    ] {
        assert!(matches!(joiner.join(other), Err(JoinError { fault: JoinFault::Other { .. }, .. })));
    }
    let mut more = good.clone();
    more.bytes.push(0);
    let fewer = JournalPart { bytes: good.bytes[..20].to_vec(), ..good.clone() };
    for other in [more, fewer] {
        assert!(matches!(joiner.join(other), Err(JoinError { fault: JoinFault::Malformed, .. })));
    }
    for other in [
        JournalPart { parts: 0, ..good.clone() },
        JournalPart { part: 1, ..good.clone() },
        JournalPart { parts: MAX_PARTS + 1, ..good.clone() },
        JournalPart { bytes: Vec::new(), ..good.clone() },
        JournalPart { bytes: vec![0; MAX_PART_BYTES + 1], ..good.clone() },
    ] {
        assert!(encode(&other).is_err());
        assert!(matches!(joiner.join(other), Err(JoinError { fault: JoinFault::Part(_), .. })));
    }
    let nameless = JournalPart { unit: "x\n".repeat(1000), parts: 0, ..good.clone() };
    let words = joiner.join(nameless).expect_err("no parts").to_string();
    assert!(words.len() < 200 && !words.contains('\n'), "{words}");
    assert!(joiner.join(good).is_ok_and(|joined| joined.is_some()));
}

#[test]
fn what_waits_for_its_other_parts_is_bounded() {
    let part = |unit: usize| JournalPart {
        unit: unit.to_string(),
        instance: String::new(),
        number: 1,
        part: 0,
        parts: 2,
        bytes: vec![0; MAX_PART_BYTES],
    };
    let mut joiner = Joiner::new();
    let taken = (0..2 * MAX_OPEN_ENTRIES).take_while(|unit| joiner.join(part(*unit)).is_ok()).count();
    assert_eq!(taken, 127, "64 MiB with the names");
    let named =
        |unit: usize| JournalPart { instance: "x".repeat(MAX_PART_BYTES), bytes: vec![0], ..part(unit) };
    let mut joiner = Joiner::new();
    let taken = (0..2 * MAX_OPEN_ENTRIES).take_while(|unit| joiner.join(named(*unit)).is_ok()).count();
    assert_eq!(taken, 127, "names of any length");
    let small = |unit: usize| JournalPart { bytes: vec![0], ..part(unit) };
    let mut joiner = Joiner::new();
    let taken = (0..2 * MAX_OPEN_ENTRIES).take_while(|unit| joiner.join(small(*unit)).is_ok()).count();
    assert_eq!(taken, MAX_OPEN_ENTRIES);
}

#[test]
fn an_entry_says_what_it_is() {
    let began = JournalEvent::Began { settings: UnitSettings::default(), highest_revision: 0 };
    assert_eq!([began.name(), JournalEvent::PreLaunchEnded.name()], ["began", "pre-launch ended"]);
}
