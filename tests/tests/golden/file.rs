//! Committed digests: how they are written, read and compared.
//!
//! ```text
//! frames SHA-256 of all frames
//! journal SHA-256 of all entries
//! ticks 3000
//! entries 1200
//! ticks from 0: two digits per tick, 64 ticks to a line
//! …
//! entries from 0: likewise
//! …
//! ```

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use isotherm_tests::data::root;

use crate::recording::{Recording, hex};

/// Ticks or entries to a line.
const TO_A_LINE: usize = 64;

/// Folder of the committed files.
pub(crate) fn folder() -> PathBuf {
    root().join("tests/golden")
}

pub(crate) fn blessing() -> bool {
    std::env::var_os("ISOTHERM_BLESS").is_some()
}

/// Compares a recording with what is committed; with `ISOTHERM_BLESS=1` writes it.
pub(crate) fn check(name: &str, recording: &Recording) {
    let path = folder().join(format!("{name}.txt"));
    if blessing() {
        std::fs::write(&path, text(recording)).unwrap();
        return;
    }
    let committed = std::fs::read_to_string(&path)
        .unwrap_or_else(|error| panic!("golden/{name}: {error}; ISOTHERM_BLESS=1 writes it"));
    if let Err(words) = compare(&committed, recording) {
        panic!("golden/{name}: {words}; bless with ISOTHERM_BLESS=1 only where the change is meant");
    }
}

/// A recording as it is committed.
pub(crate) fn text(recording: &Recording) -> String {
    let [frames, journal] = recording.digests();
    let (ticks, entries) = (recording.ticks.len(), recording.entries.len());
    let mut text = format!("frames {frames}\njournal {journal}\nticks {ticks}\nentries {entries}\n");
    let ticks: Vec<_> = recording.ticks.iter().map(|tick| tick.digest).collect();
    let entries: Vec<_> = recording.entries.iter().map(|entry| entry.digest).collect();
    for (what, digests) in [("ticks", ticks), ("entries", entries)] {
        for (line, some) in digests.chunks(TO_A_LINE).enumerate() {
            writeln!(text, "{what} from {}: {}", line * TO_A_LINE, hex(some)).unwrap();
        }
    }
    text
}

/// Says what of a recording differs first from what is committed.
pub(crate) fn compare(committed: &str, recording: &Recording) -> Result<(), String> {
    if committed == text(recording) {
        return Ok(());
    }
    let committed = Committed::read(committed)?;
    let digests = recording.ticks.iter().map(|tick| tick.digest);
    if let Some(index) = first(&committed.ticks, digests) {
        return Err(match recording.ticks.get(index) {
            Some(tick) => format!("corrected tick {index} (sequence {}) differs first", tick.sequence),
            None => format!("corrected tick {index} and those behind it do not come any more"),
        });
    }
    let digests = recording.entries.iter().map(|entry| entry.digest);
    if let Some(index) = first(&committed.entries, digests) {
        return Err(match recording.entries.get(index) {
            Some(entry) => format!("journal entry {index} differs first; it is now “{}”", entry.text),
            None => format!("journal entry {index} and those behind it do not come any more"),
        });
    }
    // One difference in 256 does not show in a digest of a byte.
    let [frames, journal] = recording.digests();
    match (committed.heads.get("frames") == Some(&frames), committed.heads.get("journal") == Some(&journal)) {
        (false, _) => Err("the frames differ, and no digest of a tick tells in which".to_owned()),
        (_, false) => Err("the journal differs, and no digest of an entry tells in which".to_owned()),
        (true, true) => Err("the file is not as it would be written".to_owned()),
    }
}

fn first(committed: &[u8], now: impl ExactSizeIterator<Item = u8>) -> Option<usize> {
    let (before, after) = (committed.len(), now.len());
    let differs = committed.iter().zip(now).position(|(committed, now)| *committed != now);
    differs.or_else(|| (before != after).then_some(before.min(after)))
}

#[derive(Default)]
struct Committed {
    heads: BTreeMap<String, String>,
    ticks: Vec<u8>,
    entries: Vec<u8>,
}

impl Committed {
    fn read(text: &str) -> Result<Self, String> {
        let mut committed = Self::default();
        for line in text.lines() {
            let unreadable = || format!("the committed file has the line “{line}”");
            let Some((head, digits)) = line.split_once(": ") else {
                let (name, value) = line.split_once(' ').ok_or_else(unreadable)?;
                committed.heads.insert(name.to_owned(), value.to_owned());
                continue;
            };
            let ticks = head.starts_with("ticks");
            let digests = if ticks { &mut committed.ticks } else { &mut committed.entries };
            for place in (0..digits.len()).step_by(2) {
                let byte = digits.get(place..place + 2).and_then(|pair| u8::from_str_radix(pair, 16).ok());
                digests.push(byte.ok_or_else(unreadable)?);
            }
        }
        Ok(committed)
    }
}

mod tests {
    use isotherm_protocol::codec::{decode, encode};
    use isotherm_protocol::corrected::CorrectedBatch;

    use super::*;
    use crate::plain;

    /// Frames of a hundred ticks, of which one may be changed.
    fn recording(change: impl Fn(&mut CorrectedBatch)) -> Recording {
        let mut recording = Recording::default();
        for frame in plain::frames() {
            let mut batch: CorrectedBatch = decode(&frame).unwrap();
            change(&mut batch);
            recording.frame(&encode(&batch).unwrap());
        }
        recording.entry("state: running".to_owned());
        recording
    }

    #[test]
    fn what_differs_first_is_found_and_named() {
        let committed = text(&recording(|_| ()));
        assert_eq!(compare(&committed, &recording(|_| ())), Ok(()));
        // A bit of one tick.
        let flip = |batch: &mut CorrectedBatch| {
            for tick in batch.ticks.iter_mut().filter(|tick| tick.sequence == 1071) {
                let angle = &mut tick.delta_angle[1];
                *angle = f64::from_bits(angle.to_bits() ^ 1);
            }
        };
        let mut told = vec![compare(&committed, &recording(flip)).unwrap_err()];
        // Another entry, and then missing ticks beside it; or ticks that were not there.
        let mut more = recording(|_| ());
        let (ticks, entries) = (more.ticks.len(), more.entries.len());
        assert_eq!(ticks, 100);
        more.entry("state: standby".to_owned());
        told.push(compare(&committed, &more).unwrap_err());
        more.ticks.truncate(90);
        told.push(compare(&committed, &more).unwrap_err());
        more.entries.truncate(entries);
        let now = recording(|_| ());
        told.push(compare(&text(&more), &now).unwrap_err());
        // What hides in the digests of bytes is found in that of all frames.
        let [frames, _] = now.digests();
        let committed = committed.replace(&frames, &"0".repeat(frames.len()));
        told.push(compare(&committed, &now).unwrap_err());
        insta::assert_snapshot!(told.join("\n"));
    }
}
