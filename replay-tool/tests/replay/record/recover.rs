//! `recover` as it is called.

use std::fs;

use isotherm_log::recording::{RecordingOptions, RecordingWriter};

use super::{shell_example, temperature};
use crate::common::{replay, told};

/// A recording of a hundred messages in ten chunks.
fn write(path: &std::path::Path) {
    let mut writer = RecordingWriter::create(path, RecordingOptions::default()).unwrap();
    for number in 0..100 {
        writer.write(&temperature("A-1", number)).unwrap();
        if number % 10 == 9 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap();
}

#[test]
fn what_is_lost_is_said_and_the_old_file_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write(&path.join("a.mcap"));
    let whole = fs::read(path.join("a.mcap")).unwrap();
    let output = replay(path, &["recover", "a.mcap", "--out", "b.mcap", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((summary["messages"].as_u64(), summary["missing"].as_u64()), (Some(100), Some(0)));

    // A bit in the middle of the fifth chunk, the record with opcode 6.
    let mut damaged = whole.clone();
    let (mut at, mut chunks) = (8, Vec::new());
    while let Some(head) = whole.get(at..at + 9) {
        let length = usize::try_from(u64::from_le_bytes(*head[1..].first_chunk().unwrap())).unwrap() + 9;
        chunks.extend((head[0] == 6).then_some(at + length / 2));
        at += length;
    }
    damaged[chunks[4]] ^= 1;
    fs::write(path.join("a.mcap"), &damaged).unwrap();
    let output = replay(path, &["recover", "a.mcap", "--out", "c.mcap"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(3), "{text}");
    assert_eq!(fs::read(path.join("a.mcap")).unwrap(), damaged);

    let refused =
        [["a.mcap", "--out", "a.mcap"], ["a.mcap", "--out", "c.mcap"], ["missing.mcap", "--out", "d.mcap"]];
    let refused = refused.map(|args| told(path, &[&["recover"], &args[..]].concat())).concat();
    insta::assert_snapshot!(format!("{}\n{refused}", text.lines().last().unwrap()));
    assert_eq!(fs::read(path.join("a.mcap")).unwrap(), damaged);
    assert_eq!(replay(path, &["recover", "a.mcap", "--out", "c.mcap", "--overwrite"]).status.code(), Some(3));
}

#[test]
fn the_example_of_the_help_works_as_printed() {
    shell_example("recover", &["record", "truncate", "recover"]);
}
