//! Every property over the seeds, which hold what fuzzing has found as well. With `ISOTHERM_BLESS=1` the seeds that are no text are
//! written anew.
#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::path::{Path, PathBuf};

use isotherm_correction::sample::{AccelTick, GyroTick};
use isotherm_fuzz::{frames, journal, logs, operators, stream, texts};
use isotherm_log::message::{Message, Topic};
use isotherm_log::recording::{Attachment, Metadata, RecordingOptions, RecordingWriter};
use isotherm_protocol::key::{RawStream, UnitId};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The files of a folder of the project, in order of their names; none where it is missing.
fn files(folder: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let Ok(entries) = fs::read_dir(root().join(folder)) else { return Vec::new() };
    let mut paths: Vec<_> =
        entries.map(|entry| entry.unwrap().path()).filter(|path| path.is_file()).collect();
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), fs::read(path).unwrap())).collect()
}

/// The frozen frames.
fn vectors() -> Vec<(PathBuf, Vec<u8>)> {
    let page = fs::read_to_string(root().join("docs/wire-vectors.txt")).unwrap();
    let mut vectors: Vec<(PathBuf, Vec<u8>)> = Vec::new();
    for line in page.lines() {
        if let Some(digits) = line.strip_prefix("hex ") {
            let digits = digits.split('#').next().unwrap().split_whitespace();
            vectors.last_mut().unwrap().1.extend(digits.map(|byte| u8::from_str_radix(byte, 16).unwrap()));
        } else if line.starts_with("vector ") || line.starts_with("refuse ") {
            vectors.push((line.into(), Vec::new()));
        }
    }
    vectors
}

/// A name, a property, and a folder of the project that is seeds too.
type Target = (&'static str, fn(&[u8]), &'static str);

/// The targets.
const TARGETS: [Target; 22] = [
    ("raw_gyro", frames::raw::<GyroTick>, ""),
    ("raw_accel", frames::raw::<AccelTick>, ""),
    ("raw_temperature", frames::temperature, ""),
    ("raw_health", frames::frame::<isotherm_protocol::raw::HealthBatch>, ""),
    ("corrected", frames::frame::<isotherm_protocol::corrected::CorrectedBatch>, ""),
    ("status", frames::frame::<isotherm_protocol::status::Status>, ""),
    ("service_status", frames::frame::<isotherm_protocol::service_status::ServiceStatus>, ""),
    ("reference", frames::frame::<isotherm_protocol::reference::Reference>, ""),
    ("journal_part", frames::frame::<isotherm_protocol::journal::JournalPart>, ""),
    ("journal_joiner", journal::joiner, ""),
    ("journal_entry", journal::entry, ""),
    ("stream", stream::stream, ""),
    ("document", texts::document, "config/calibration"),
    ("overlay", texts::overlay, ""),
    ("mapping", logs::mapping, "config/mappings"),
    ("text_log", logs::text_log, ""),
    ("recording", logs::recording, ""),
    ("recover", logs::recover, "fuzz/seeds/recording"),
    ("audit", operators::audit, ""),
    ("command", operators::command, ""),
    ("selector", operators::selector, ""),
    ("configuration", |_| {}, ""),
];

#[test]
fn every_property_holds_for_every_seed() {
    let vectors = vectors();
    assert!(vectors.len() > 20, "{} frozen frames", vectors.len());
    for (name, check, beside) in TARGETS {
        let of_frames = TARGETS.iter().position(|target| target.0 == name).unwrap() < 9;
        let mut seeds = files(&format!("fuzz/seeds/{name}"));
        seeds.extend(files(beside).into_iter().filter(|_| !beside.is_empty()));
        seeds.extend(vectors.iter().filter(|_| of_frames).cloned());
        for (path, seed) in &seeds {
            println!("{name}: {}", path.display());
            check(seed);
        }
    }
}

#[test]
fn the_script_and_the_targets_name_each_other() {
    let script = fs::read_to_string(root().join("fuzz/run")).unwrap();
    for (path, text) in files("fuzz/targets") {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        assert!(TARGETS.iter().any(|target| target.0 == name), "{name} has no line in this test");
        assert!(script.contains(&name), "{name} is not run");
        assert!(text.starts_with(b"//!"));
    }
    assert_eq!(files("fuzz/targets").len(), TARGETS.len());
}

/// A recording of the frozen frames.
fn record(path: &Path, options: RecordingOptions) {
    let mut writer = RecordingWriter::create(path, RecordingOptions { overwrite: true, ..options }).unwrap();
    let unit = UnitId::new("A-1").unwrap();
    let document = b"schema = 1\n".to_vec();
    let attachment = Attachment {
        name: "a.toml".into(),
        media_type: "application/toml".into(),
        attached_ns: 5,
        bytes: document,
    };
    writer.attach(&attachment).unwrap();
    for (received_ns, (_, frame)) in (7_000..).step_by(50).zip(vectors().into_iter().take(8)) {
        let topic = match frame[0] {
            1 => Topic::Raw(unit.clone(), RawStream::Gyro),
            2 => Topic::Raw(unit.clone(), RawStream::Accel),
            4 => Topic::Corrected(unit.clone()),
            _ => Topic::Other("something/else".into()),
        };
        writer.write(&Message { topic, received_ns, frame }).unwrap();
    }
    writer.metadata(&Metadata::of([("version", "1".to_owned())])).unwrap();
    writer.finish().unwrap();
}

/// Takes the checksums out of a recording's chunks, so that a change of a chunk is read on: 0 stands for none.
fn without_checksums(mut recording: Vec<u8>) -> Vec<u8> {
    let mut at = 8;
    while let Some(&[opcode, ..]) = recording.get(at..at + 9) {
        let length = u64::from_le_bytes(recording[at + 1..at + 9].try_into().unwrap());
        if opcode == 6 {
            recording[at + 9 + 24..at + 9 + 28].fill(0);
        }
        at += 9 + usize::try_from(length).unwrap();
    }
    recording
}

#[test]
fn the_recordings_among_the_seeds_are_whole() {
    let folder = root().join("fuzz/seeds/recording");
    let path = |name: &str| folder.join(name);
    if std::env::var_os("ISOTHERM_BLESS").is_some() {
        let small = RecordingOptions { chunk_bytes: 300, ..RecordingOptions::default() };
        record(&path("zstd.mcap"), small);
        record(&path("plain.mcap"), RecordingOptions { compress: false, ..small });
        fs::write(path("unchecked.mcap"), without_checksums(fs::read(path("plain.mcap")).unwrap())).unwrap();
        let viewed = RecordingOptions { compress: false, json: true, ..small };
        record(&path("json.mcap"), viewed);
        for (name, bytes) in journal::seeds() {
            fs::write(root().join("fuzz/seeds/journal_entry").join(name), bytes).unwrap();
        }
    }
    for name in ["zstd", "plain", "unchecked", "json"] {
        let paths = [path(&format!("{name}.mcap"))];
        let mut reader =
            isotherm_log::recording::RecordingReader::open(&paths, std::sync::Arc::default()).unwrap();
        while reader.next_message().unwrap().is_some() {}
        assert_eq!((reader.report().messages, reader.report().lost_data()), (8, false), "{name}");
    }
    assert!(!files("fuzz/seeds/journal_entry").is_empty());
}
