//! Parts of journal entries, and the entries.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use isotherm_correction::operation::Command;
use isotherm_correction::unit::UnitSettings;
use isotherm_protocol::codec::Message;
use isotherm_protocol::control::Schedule;
use isotherm_protocol::corrected::Revision;
use isotherm_protocol::journal::{JoinFault, Joiner, JournalEntry, JournalEvent, JournalPart, split};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::stream::UnitStream;

use crate::cursor::Cursor;
use crate::said::in_few_words;

/// Units, instances and numbers that parts are of.
const ENTRIES: [usize; 3] = [3, 2, 4];
/// Bytes of whole entries, by place in [`ENTRIES`].
static WHOLE: LazyLock<Vec<(JournalEntry, Vec<u8>)>> = LazyLock::new(|| {
    let [units, instances, numbers] = ENTRIES;
    let all = (0..units * instances * numbers).map(|index| {
        let (unit, instance, number) =
            (index % units, index / units % instances, index / units / instances % numbers);
        let event = match number {
            0 => JournalEvent::Flushed,
            1 => JournalEvent::Began { settings: UnitSettings::default(), highest_revision: 7 },
            2 => JournalEvent::Commanded {
                command: Command::Standby,
                accepted: true,
                words: "standby".to_owned(),
            },
            _ => JournalEvent::Changed {
                revision: Revision { counter: 8, digest: [7; 8] },
                at: Schedule::NextTick,
                slew_ns: 0,
                document: Some("schema = 1\n".repeat(20)),
                overlay: None,
                source: "the bus".to_owned(),
            },
        };
        let entry = JournalEntry {
            unit: format!("U-{unit}"),
            instance: format!("i{instance}"),
            number: number as u64,
            heard: [isotherm_protocol::stream::Heard::default(); 5],
            event,
        };
        let bytes = bytes(&entry);
        (entry, bytes)
    });
    all.collect()
});

/// The bytes of an entry.
fn bytes(entry: &JournalEntry) -> Vec<u8> {
    split(entry).into_iter().flat_map(|part| part.bytes).collect()
}

/// Number, parts and next part of an entry that is incomplete, and its bytes.
type Waiting = (u64, u32, u32, Vec<u8>);

/// Parts in any order, whole and damaged: every entry that was begun is given, refused or counted as given up, and what is given is
/// what was sent.
pub fn joiner(input: &[u8]) {
    let mut from = Cursor(input);
    let mut joiner = Joiner::new();
    let mut open: BTreeMap<(String, String), Waiting> = BTreeMap::new();
    while let Some(choice) = from.byte() {
        let part = part(choice, &mut from);
        let place = (part.instance.clone(), part.unit.clone());
        let (number, at, parts) = (part.number, part.part, part.parts);
        let is_sound = part.check().is_ok();
        let before = open.remove(&place);
        let waited = before.is_some();
        let goes_on = before.filter(|open| is_sound && (open.0, open.1, open.2) == (number, parts, at));
        let continues = goes_on.is_some();
        let mut so_far = goes_on.map(|open| open.3).unwrap_or_default();
        so_far.extend(&part.bytes);
        let given_up = joiner.given_up();
        let outcome = joiner.join(part);
        let given_up = joiner.given_up() - given_up;
        match outcome {
            Ok(entry) => {
                assert!(is_sound && (continues || at == 0), "a part without those before it is taken");
                assert_eq!(
                    given_up,
                    u64::from(waited && !continues),
                    "one that was waited for is lost uncounted"
                );
                assert_eq!(entry.is_some(), at + 1 == parts);
                match entry {
                    None => drop(open.insert(place, (number, parts, at + 1, so_far))),
                    Some(entry) => {
                        assert_eq!(
                            (&entry.instance, &entry.unit, entry.number),
                            (&place.0, &place.1, number)
                        );
                        let sent: JournalEntry = postcard::from_bytes(&so_far).expect("parts of an entry");
                        assert_eq!(bytes(&entry), bytes(&sent), "another entry than was sent");
                    }
                }
            }
            Err(error) => {
                in_few_words(&error);
                let says_so =
                    matches!(error.fault, JoinFault::Malformed | JoinFault::Other { .. }) && continues;
                assert!(
                    !waited || given_up == 1 || says_so,
                    "one that was waited for is lost uncounted: {error}"
                );
            }
        }
    }
}

/// A part: mostly one of a whole entry, cut into a few.
fn part(choice: u8, from: &mut Cursor<'_>) -> JournalPart {
    let shape = from.some();
    let index = usize::from(choice) % WHOLE.len();
    let parts = u32::from(shape % 4) + 1;
    let part = u32::from(shape / 4 % 4);
    let mut made = WHOLE.get(index).map_or_else(
        || JournalPart {
            unit: String::new(),
            instance: String::new(),
            number: 0,
            part,
            parts,
            bytes: Vec::new(),
        },
        |(entry, bytes)| {
            let size = bytes.len().div_ceil(parts as usize);
            let bytes = bytes.chunks(size).nth(part as usize).unwrap_or_default().to_vec();
            let JournalEntry { unit, instance, number, .. } = entry.clone();
            JournalPart { unit, instance, number, part, parts, bytes }
        },
    );
    match shape / 16 {
        13 => made.number = from.number(),
        14 => {
            let count = usize::from(from.some());
            made.bytes = from.bytes(count).to_vec();
        }
        15 => {
            let count = usize::from(from.some());
            made.unit = String::from_utf8_lossy(from.bytes(count)).into_owned();
            made.parts = u32::from(from.some());
        }
        _ => {}
    }
    made
}

/// An entry as a recording has it: it is cut into parts and joined to the same, and what it does to a stream leaves one that goes on.
pub fn entry(input: &[u8]) {
    let Ok(entry) = postcard::from_bytes::<JournalEntry>(input) else { return };
    let mut joiner = Joiner::new();
    let mut entries: Vec<_> =
        split(&entry).into_iter().filter_map(|part| joiner.join(part).transpose()).collect();
    let whole = entries.pop().expect("all parts have come").expect("they are as they were");
    assert_eq!(bytes(&whole), bytes(&entry));
    let Ok(unit) = UnitId::new("U-1") else { return };
    let mut stream = UnitStream::new(unit, UnitSettings::default());
    crate::stream::good_ticks(&mut stream, 0, 3);
    if let Err(error) = stream.carry_out(&entry.event) {
        in_few_words(&error);
    }
    crate::stream::good_ticks(&mut stream, 3, 5);
    stream.flush();
    crate::stream::outputs(&mut stream);
}

/// Entries of one unit, as seeds.
#[must_use]
pub fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let of_one = WHOLE.iter().filter(|(entry, _)| entry.unit == "U-1" && entry.instance == "i1");
    of_one.map(|(entry, bytes)| (entry.event.name(), bytes.clone())).collect()
}
