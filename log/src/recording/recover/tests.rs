//! Recordings broken in every way, and what comes back of them.

use std::collections::BTreeMap;
use std::path::Path;

use isotherm_protocol::codec;
use isotherm_protocol::journal::{JournalEntry, JournalEvent, split};
use isotherm_protocol::key::{RawStream, UnitId};

use super::*;
use crate::message::{Message, Topic};
use crate::recording::{Attachment, Metadata, RecordingReader, RecordingWriter};

/// Messages of a unit, of a length each that tells them apart.
fn message(serial: &str, number: usize) -> Message {
    let topic = Topic::Raw(UnitId::new(serial).unwrap(), RawStream::Gyro);
    let frame = (0..60 + number % 37).map(|byte| u8::try_from((byte * 7 + number) % 251).unwrap()).collect();
    Message { topic, received_ns: 1000 + number as u64, frame }
}

const MESSAGES: usize = 400;
/// The second unit comes in later chunks than the first.
const LATER: usize = 150;

fn messages() -> Vec<Message> {
    let serial = |number| if number >= LATER && number % 2 == 0 { "B-2" } else { "A-1" };
    (0..MESSAGES).map(|number| message(serial(number), number)).collect()
}

/// A recording in chunks of twenty messages or so.
fn write(path: &Path, compress: bool) {
    let options = RecordingOptions { compress, chunk_bytes: 2000, ..RecordingOptions::default() };
    let mut writer = RecordingWriter::create(path, options).unwrap();
    let document = Attachment {
        name: "a.toml".to_owned(),
        media_type: "application/toml".to_owned(),
        attached_ns: 5,
        bytes: b"unit = 1".to_vec(),
    };
    writer.attach(&document).unwrap();
    for message in &messages() {
        writer.write(message).unwrap();
    }
    let values = BTreeMap::from([("version".to_owned(), "1".to_owned())]);
    writer.metadata(&Metadata { name: "isotherm".to_owned(), values }).unwrap();
    writer.finish().unwrap();
}

/// The messages and attachments of a file that must be whole.
fn read(path: &Path) -> (Vec<Message>, Vec<Attachment>, Vec<Metadata>) {
    let mut reader = RecordingReader::open(&[path.to_owned()], Arc::default()).unwrap();
    let mut messages = Vec::new();
    while let Some(message) = reader.next_message().unwrap() {
        messages.push(message);
    }
    assert_eq!(reader.report().cut_short, None);
    assert_eq!(reader.report().foreign_messages, 0);
    (messages, reader.take_attachments(), reader.take_metadata())
}

/// Recovers bytes; the report and what came back.
fn recovered(folder: &Path, bytes: &[u8]) -> (RecoveryReport, Vec<Message>) {
    let (input, output) = (folder.join("broken.mcap"), folder.join("recovered.mcap"));
    std::fs::write(&input, bytes).unwrap();
    let report =
        recover(&input, &output, RecordingOptions { overwrite: true, ..RecordingOptions::default() })
            .unwrap();
    let (messages, ..) = read(&output);
    assert_eq!(report.messages, messages.len() as u64);
    (report, messages)
}

/// Where the records of a kind begin in a file, and their lengths.
fn records(bytes: &[u8], kind: u8) -> Vec<(usize, usize)> {
    let (mut at, mut records) = (8, Vec::new());
    while let Some(head) = bytes.get(at..at + 9) {
        let length = usize::try_from(u64::from_le_bytes(*head[1..].first_chunk().unwrap())).unwrap() + 9;
        if head[0] == kind {
            records.push((at, length));
        }
        at += length;
    }
    records
}

fn chunks(bytes: &[u8]) -> Vec<(usize, usize)> {
    records(bytes, mcap::records::op::CHUNK)
}

#[test]
fn a_whole_file_comes_back_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    for compress in [true, false] {
        let _ = std::fs::remove_file(&path);
        write(&path, compress);
        let (report, back) = recovered(folder.path(), &std::fs::read(&path).unwrap());
        assert_eq!(back, messages());
        assert!(report.ended && !report.lost_data(), "{report:?}");
        let (_, attachments, metadata) = read(&folder.path().join("recovered.mcap"));
        assert_eq!(attachments[0].bytes, b"unit = 1");
        let names: Vec<_> = metadata.iter().map(|record| record.values.get("record")).collect();
        assert_eq!(names, [None, Some(&"recovered".to_owned())]);
    }
}

#[test]
fn a_file_cut_anywhere_comes_back_to_its_last_whole_chunk() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    write(&path, true);
    let bytes = std::fs::read(&path).unwrap();
    let ends: Vec<_> = chunks(&bytes).iter().map(|(at, length)| at + length).collect();
    assert!(ends.len() > 10);
    let attachment = records(&bytes, mcap::records::op::ATTACHMENT)[0];
    let mut most = 0;
    for length in (9..bytes.len()).step_by(61) {
        // Nothing is whole before the end of the attachment.
        if length < attachment.0 + attachment.1 {
            let cut = folder.path().join("cut.mcap");
            std::fs::write(&cut, &bytes[..length]).unwrap();
            assert!(
                recover(&cut, &folder.path().join("x"), RecordingOptions::default()).is_err(),
                "{length}"
            );
            continue;
        }
        let (report, back) = recovered(folder.path(), &bytes[..length]);
        assert!(messages().starts_with(&back), "{length}");
        let whole = ends.iter().filter(|end| **end <= length).count() as u64;
        assert_eq!(report.chunks, whole, "{length}");
        assert!(back.len() >= most);
        most = back.len();
    }
    assert_eq!(most, MESSAGES);
}

#[test]
fn behind_a_damaged_chunk_reading_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    for compress in [true, false] {
        let _ = std::fs::remove_file(&path);
        write(&path, compress);
        let whole = std::fs::read(&path).unwrap();
        let chunks = chunks(&whole);
        for (index, (at, length)) in chunks.iter().copied().enumerate() {
            // A bit in its data, its own length, its compression, its opcode; all of it.
            for (begin, damaged) in [(at + length / 2, 1), (at + 1, 8), (at + 40, 2), (at, 1), (at, length)] {
                for with_summary in [true, false] {
                    let mut bytes = whole.clone();
                    bytes[begin..begin + damaged].iter_mut().for_each(|byte| *byte ^= 0x55);
                    if !with_summary {
                        let end = chunks.last().map(|(at, length)| at + length).unwrap();
                        bytes.truncate(end);
                    }
                    let (report, back) = recovered(folder.path(), &bytes);
                    let lost = MESSAGES - back.len();
                    assert!(lost > 5 && lost < 40, "chunk {index}: {lost} lost");
                    assert!(report.lost_data() && report.nameless == 0, "{report:?}");
                    assert!(report.damage.iter().any(|damage| damage.offset == at as u64), "{report:?}");
                    let expected: Vec<_> =
                        messages().into_iter().filter(|message| back.contains(message)).collect();
                    assert!(back == expected, "in their order, and nothing else");
                    // Without the summary nobody knows what stood in the last chunk.
                    if with_summary || index + 1 < chunks.len() {
                        assert_eq!(report.missing, lost as u64, "chunk {index}, {with_summary}");
                    }
                }
            }
        }
    }
}

#[test]
fn what_is_there_once_more_for_viewers_is_not_lost_twice() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let options = RecordingOptions { chunk_bytes: 300, json: true, ..RecordingOptions::default() };
    let mut writer = RecordingWriter::create(&path, options).unwrap();
    for number in 1..40 {
        writer.write(&crate::recording::tests::message("A-1", number, 5)).unwrap();
    }
    writer.finish().unwrap();
    let whole = std::fs::read(&path).unwrap();
    let chunks = chunks(&whole);
    let (damaged, end) = (chunks[1].0 + chunks[1].1 / 2, chunks.last().map(|(at, length)| at + length));
    let missing = [whole.len(), end.unwrap()].map(|length| {
        let mut bytes = whole[..length].to_vec();
        bytes[damaged] ^= 0x55;
        std::fs::write(&path, &bytes).unwrap();
        let options = RecordingOptions { overwrite: true, ..RecordingOptions::default() };
        recover(&path, &folder.path().join("b.mcap"), options).unwrap().missing
    });
    assert!(missing[0] > 0 && missing[0] == missing[1], "{missing:?}");
}

#[test]
fn documents_that_are_lost_are_attached_anew() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut writer = RecordingWriter::create(&path, RecordingOptions::default()).unwrap();
    let event = JournalEvent::Memory { memory: vec![1], document: Some("a = 1\n".into()), pending: None };
    let unit = UnitId::new("A-1").unwrap();
    let entry = JournalEntry {
        unit: unit.to_string(),
        instance: "i".into(),
        number: 0,
        heard: Default::default(),
        event,
    };
    for part in split(&entry) {
        let frame = codec::encode(&part).unwrap();
        writer.write(&Message { topic: Topic::Journal(unit.clone()), received_ns: 9, frame }).unwrap();
    }
    writer.finish().unwrap();
    let (report, _) = recovered(folder.path(), &std::fs::read(&path).unwrap());
    assert_eq!((report.attachments, report.documents_rebuilt, report.lost_data()), (0, 1, false));
    let (_, attachments, _) = read(&folder.path().join("recovered.mcap"));
    assert_eq!(attachments[0].bytes, b"a = 1\n");
    // And only once.
    let again = std::fs::read(folder.path().join("recovered.mcap")).unwrap();
    let (report, _) = recovered(folder.path(), &again);
    assert_eq!((report.attachments, report.documents_rebuilt), (1, 0));
}

#[test]
fn what_is_no_recording_is_refused_and_nothing_is_written_over() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("x"), folder.path().join("y"));
    std::fs::write(&input, "sequence,end_time_ns\n".repeat(1000)).unwrap();
    let error = recover(&input, &output, RecordingOptions::default()).unwrap_err();
    assert!(error.to_string().starts_with(input.to_str().unwrap()), "{error}");
    assert!(!output.exists());
    let overwrite = RecordingOptions { overwrite: true, ..RecordingOptions::default() };
    assert!(recover(&input, &input, overwrite).is_err());
    std::fs::write(&output, "mine").unwrap();
    assert!(recover(&input, &output, RecordingOptions::default()).is_err());
    // What fails leaves what is there.
    assert!(recover(&input, &output, overwrite).is_err());
    assert_eq!(std::fs::read(&output).unwrap(), b"mine");
    let partial = folder.path().join("y.partial");
    std::fs::rename(&input, &partial).unwrap();
    assert!(recover(&partial, &output, overwrite).is_err_and(|error| error.is_usage()));
    assert!(partial.exists());
}

#[test]
fn a_recording_has_its_name_when_it_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (folder.path().join("x"), folder.path().join("y"));
    write(&input, true);
    let watch = |_: &RecoveryReport| assert!(!output.exists());
    Recovery::open(&input).unwrap().run(&output, RecordingOptions::default(), watch).unwrap();
    assert_eq!(read(&output).0, messages());
}
