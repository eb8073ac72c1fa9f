//! Recordings written and read back, whole and cut.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use isotherm_correction::sample::{ChannelName, TemperatureReading};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec;
use isotherm_protocol::key::{RawStream, UnitId};
use isotherm_protocol::raw::TemperatureBatch;

use super::*;
use crate::error::Error;
use crate::file::is_being_written;
use crate::message::{Message, Topic};
use crate::part::{LogFiles, Part, are_recordings};
use crate::source::LogReport;

pub(super) fn message(serial: &str, time_ns: i64, received_ns: u64) -> Message {
    let (channel, time) = (ChannelName::from("board").unwrap(), Timestamp::from_ns(time_ns));
    let batch = TemperatureBatch { readings: vec![TemperatureReading { channel, time, raw: 25.0 }] };
    let topic = Topic::Raw(UnitId::new(serial).unwrap(), RawStream::Temperature);
    Message { topic, received_ns, frame: codec::encode(&batch).unwrap() }
}

fn read(paths: &[&Path]) -> (Vec<Message>, RecordingReader) {
    let paths: Vec<_> = paths.iter().map(|path| path.to_path_buf()).collect();
    let mut reader = RecordingReader::open(&paths, Arc::default()).unwrap();
    let mut messages = Vec::new();
    while let Some(message) = reader.next_message().unwrap() {
        messages.push(message);
    }
    (messages, reader)
}

/// Messages of two units, on their way into a small-chunked recording.
fn messages() -> Vec<Message> {
    (0..500_u32)
        .map(|n| {
            message(["A-1", "B-2"][usize::from(n % 3 == 0)], i64::from(n) * 5_000_000, 7_000 + u64::from(n))
        })
        .collect()
}

fn write(path: &Path, messages: &[Message]) {
    let options = RecordingOptions { chunk_bytes: 2000, ..RecordingOptions::default() };
    let mut writer = RecordingWriter::create(path, options).unwrap();
    let document = Attachment {
        name: "a.toml".to_owned(),
        media_type: "application/toml".to_owned(),
        attached_ns: 5,
        bytes: b"unit = 1".to_vec(),
    };
    writer.attach(&document).unwrap();
    for message in messages {
        writer.write(message).unwrap();
    }
    let values = BTreeMap::from([("version".to_owned(), "1".to_owned())]);
    writer.metadata(&Metadata { name: METADATA.to_owned(), values }).unwrap();
    writer.finish().unwrap();
}

#[test]
fn readings_as_json_stand_beside_the_frames_and_are_no_messages() {
    let folder = tempfile::tempdir().unwrap();
    let (path, recovered) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
    let options = RecordingOptions { chunk_bytes: 2000, json: true, ..RecordingOptions::default() };
    let mut writer = RecordingWriter::create(&path, options).unwrap();
    for message in messages() {
        writer.write(&message).unwrap();
    }
    writer.finish().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let shown: Vec<_> = mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(Result::unwrap)
        .filter(|shown| shown.channel.message_encoding == "json")
        .collect();
    assert_eq!(shown.len(), 500);
    assert_eq!(shown[3].channel.topic, "imu/B-2/raw/temp/json");
    assert_eq!(shown[3].channel.schema.as_ref().unwrap().encoding, "jsonschema");
    let json = r#"{"timestamp":{"sec":0,"nsec":15000000},"raw":{"board":25.0}}"#;
    assert_eq!(String::from_utf8_lossy(&shown[3].data), json);
    let whole = RecordingReport { messages: 500, ..RecordingReport::default() };
    let (back, reader) = read(&[&path]);
    assert_eq!((back, reader.report()), (messages(), &whole));
    // Without the first chunk, which has the channels' own records, they are known by name.
    let damaged = 120;
    let mut bytes = bytes;
    bytes[damaged] ^= 0xff;
    std::fs::write(&path, &bytes).unwrap();
    let report = recover(&path, &recovered, RecordingOptions::default()).unwrap();
    assert_eq!((report.nameless, report.damaged_places), (0, 1), "{report:?}");
    let (back, reader) = read(&[&recovered]);
    assert_eq!(reader.report().foreign_messages, 0);
    assert!(back.len() > 400 && messages().ends_with(&back[back.len() - 400..]), "{}", back.len());
}

#[test]
fn what_was_written_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    write(&path, &messages());
    let (back, mut reader) = read(&[&path]);
    assert_eq!(back, messages());
    assert_eq!(reader.report(), &RecordingReport { messages: 500, ..RecordingReport::default() });
    assert_eq!(reader.take_attachments()[0].bytes, b"unit = 1");
    assert_eq!(reader.take_metadata()[0].values["version"], "1");
    assert!(RecordingWriter::create(&path, RecordingOptions::default()).is_err(), "nothing is written over");
}

#[test]
fn a_record_longer_than_its_chunk_is_not_read_on_behind_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut writer =
        RecordingWriter::create(&path, RecordingOptions { compress: false, ..Default::default() }).unwrap();
    messages()[..3].iter().for_each(|message| writer.write(message).unwrap());
    writer.finish().unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let length = |bytes: &[u8], at: usize| {
        usize::try_from(u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap())).unwrap()
    };
    let mut chunk = MAGIC.len();
    while bytes[chunk] != mcap::records::op::CHUNK {
        chunk += 9 + length(&bytes, chunk);
    }
    // Without a checksum nobody notices that its last record has grown.
    bytes[chunk + 9 + 24..chunk + 9 + 28].fill(0);
    let (mut last, end) = (chunk + 9 + 40, chunk + 9 + length(&bytes, chunk));
    while last + 9 + length(&bytes, last) < end {
        last += 9 + length(&bytes, last);
    }
    bytes[last + 1] += 20;
    std::fs::write(&path, &bytes).unwrap();
    let (back, reader) = read(&[&path]);
    assert!(back.is_empty() && reader.report().lost_data(), "{back:?} {:?}", reader.report());
}

#[test]
fn a_file_cut_anywhere_is_read_to_its_last_whole_chunk() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, cut, other) =
        (folder.path().join("a.mcap"), folder.path().join("cut.mcap"), folder.path().join("b.mcap"));
    write(&whole, &messages());
    write(&other, &messages()[..10]);
    let bytes = std::fs::read(&whole).unwrap();
    let mut most = 0;
    for length in (8..bytes.len()).step_by(97) {
        std::fs::write(&cut, &bytes[..length]).unwrap();
        let (back, reader) = read(&[&cut, &other]);
        let report = reader.report().clone();
        let (first, rest) = back.split_at(back.len() - 10);
        assert_eq!(rest, &messages()[..10], "the next file is read all the same");
        assert!(messages().starts_with(first), "{length}");
        assert!(first.len() >= most, "more bytes, no fewer messages: {length}");
        most = first.len();
        let words = report.cut_short.unwrap_or_default();
        assert!(words.contains("cut.mcap") || first.len() == 500, "{length}: {words}");
    }
    assert_eq!(most, 500);
}

/// The messages of a part of recordings, and how many were read for it.
fn part_of(paths: &[PathBuf], start_ns: i64) -> (Vec<Message>, u64) {
    let part = Part { start: Span::from_ns(start_ns), ..Part::default() };
    let mut part = LogFiles::Recordings(paths.to_vec()).open(&part).unwrap();
    let mut messages = Vec::new();
    while let Some(message) = part.next_message().unwrap() {
        messages.push(message);
    }
    let LogReport::Recording(report) = part.report() else { unreachable!("it is a recording") };
    assert_eq!(part.recording().unwrap().take_attachments().len(), paths.len());
    (messages, report.messages)
}

#[test]
fn from_a_later_start_the_same_messages_come_and_chunks_before_it_are_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
    // A unit that comes late, a clock that falls back for a while, and the next file of the row.
    let mut first = messages();
    first.extend((500..900).map(|n| message("C-3", n, 7_000 + n.unsigned_abs())));
    first.iter_mut().skip(600).take(100).for_each(|message| message.received_ns -= 300);
    let second: Vec<_> = (900..1200).map(|n| message("C-3", n, 7_000 + n.unsigned_abs())).collect();
    write(&a, &first);
    write(&b, &second);
    let all: Vec<_> = first.into_iter().chain(second).collect();
    let files = [a.clone(), b];
    for start in (0..1250).step_by(7).chain([899, 900, 901, 1199, 1200]) {
        let (messages, read) = part_of(&files, start);
        let later = |message: &&Message| start == 0 || message.received_ns > 7_000 + start.unsigned_abs();
        assert_eq!(messages, all.iter().filter(later).cloned().collect::<Vec<_>>(), "{start}");
        // A chunk has some twenty messages.
        let most = if start < 400 { 1200 } else { 1200 + 400 - start.unsigned_abs() };
        assert!(read <= most, "{start}: {read} messages were read");
    }
    assert!(part_of(&files, 1190).1 < 60, "of 1200");

    // Cut short, it is read as far as without.
    let bytes = std::fs::read(&a).unwrap();
    for length in (bytes.len() / 3..bytes.len()).step_by(203) {
        std::fs::write(&a, &bytes[..length]).unwrap();
        let (whole, reader) = read(&[&a]);
        let part = Part { start: Span::from_ns(350), ..Part::default() };
        let mut part = LogFiles::Recordings(vec![a.clone()]).open(&part).unwrap();
        let mut later = whole.iter().filter(|message| message.received_ns > 7_350);
        while let Some(message) = part.next_message().unwrap() {
            assert_eq!(Some(&message), later.next(), "{length}");
        }
        assert_eq!(later.next(), None, "{length}");
        let LogReport::Recording(report) = part.report() else { unreachable!("it is a recording") };
        assert_eq!(report.cut_short, reader.report().cut_short, "{length}");
    }
}

#[test]
fn what_is_no_recording_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mcap");
    for bytes in [b"".as_slice(), b"\x89MCAP", b"sequence,end_time_ns\n"] {
        std::fs::write(&path, bytes).unwrap();
        let error = RecordingReader::open(std::slice::from_ref(&path), Arc::default()).unwrap_err();
        assert!(matches!(error, Error::File { .. }) && error.to_string().contains("MCAP"), "{error}");
    }
}

#[test]
fn what_is_flushed_is_whole_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut writer = RecordingWriter::create(&path, RecordingOptions::default()).unwrap();
    for (number, message) in messages().iter().take(10).enumerate() {
        writer.write(message).unwrap();
        assert_eq!(writer.waiting(), number as u64 + 1);
    }
    let (before, _) = read(&[&path]);
    assert!(before.is_empty());
    writer.flush().unwrap();
    assert_eq!((writer.waiting(), writer.length()), (0, std::fs::metadata(&path).unwrap().len()));
    let (after, _) = read(&[&path]);
    assert_eq!(after, messages()[..10]);
}

#[test]
fn a_file_that_is_being_written_is_nobody_elses() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let overwrite = RecordingOptions { overwrite: true, ..RecordingOptions::default() };
    let mut writer = RecordingWriter::create(&path, RecordingOptions::default()).unwrap();
    writer.write(&messages()[0]).unwrap();
    assert!(is_being_written(&path));
    let error = RecordingWriter::create(&path, overwrite).unwrap_err().to_string();
    insta::assert_snapshot!(error.replace(folder.path().to_str().unwrap(), "FOLDER"));
    writer.finish().unwrap();
    assert!(!is_being_written(&path));
    assert_eq!(read(&[&path]).0.len(), 1);
    RecordingWriter::create(&path, overwrite).unwrap().finish().unwrap();
    assert_eq!(read(&[&path]).0.len(), 0);
}

#[test]
fn a_file_given_up_ends_behind_what_was_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut writer = RecordingWriter::create(&path, RecordingOptions::default()).unwrap();
    let (first, rest) = (&messages()[..10], &messages()[10..]);
    for message in first {
        writer.write(message).unwrap();
    }
    writer.flush().unwrap();
    for message in rest {
        writer.write(message).unwrap();
    }
    let values = BTreeMap::from([("why".to_owned(), "full".to_owned())]);
    writer.abandon(&Metadata { name: METADATA.to_owned(), values });
    let (back, mut reader) = read(&[&path]);
    assert_eq!((back.as_slice(), reader.report().cut_short.as_deref()), (first, None));
    assert_eq!(reader.take_metadata()[0].values["why"], "full");
    // Others read it too.
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).count(), 10);
}

#[test]
fn a_recording_is_told_by_its_first_bytes_and_a_damaged_one_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let told = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        are_recordings(&[path])
    };
    assert!(matches!(told("whole", MAGIC), Ok(true)));
    assert!(matches!(told("log.csv", b"1,2\n"), Ok(false)));
    assert!(matches!(told("damaged.mcap", &MAGIC[1..]), Err(Error::File { .. })));
    assert!(matches!(told("empty.mcap", b""), Ok(false)));
    assert!(matches!(are_recordings(&[folder.path().join("none.mcap")]), Ok(false)));
}
