//! Files: column mappings, text logs, recordings.

use std::cell::OnceCell;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};

use isotherm_log::mapping::Mapping;
use isotherm_log::recording::recover::Recovery;
use isotherm_log::recording::{RecordingOptions, RecordingReader};
use isotherm_log::text::LogReader;
use tempfile::TempDir;

use crate::said::{in_few_words, listed};

thread_local! {
    static FOLDER: OnceCell<TempDir> = const { OnceCell::new() };
}

/// A file of this thread alone with these bytes.
fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path =
        FOLDER.with(|folder| folder.get_or_init(|| TempDir::new().expect("a folder")).path().join(name));
    fs::write(&path, bytes).expect("it can be written");
    path
}

/// A short log for mappings to try.
const LOG: &str = include_str!("../seeds/text_log/columns.csv");

/// A mapping: what is taken reads a log, or says why not.
pub fn mapping(input: &[u8]) {
    let Ok(text) = str::from_utf8(input) else { return };
    match Mapping::parse(text, "a.toml") {
        Err(problems) => listed(&problems),
        Ok(mapping) => read(&mapping, &file("mapped.csv", LOG.as_bytes()), LOG.as_bytes()),
    }
}

/// The shipped mappings, and one with everything else.
static MAPPINGS: LazyLock<Vec<Mapping>> = LazyLock::new(|| {
    let texts = [
        include_str!("../../config/mappings/chamber-mems.toml"),
        include_str!("../../config/mappings/rlg-static.toml"),
        include_str!("../../config/mappings/tumble-mems.toml"),
        include_str!("../seeds/mapping/columns.toml"),
        include_str!("../seeds/mapping/dates.toml"),
    ];
    texts.iter().map(|text| Mapping::parse(text, "a.toml").expect("a good mapping")).collect()
});

/// A text log, its mapping by the first byte: events in order of time, each line in one count.
pub fn text_log(input: &[u8]) {
    let Some((choice, text)) = input.split_first() else { return };
    let Some(mapping) = MAPPINGS.get(usize::from(*choice) % MAPPINGS.len()) else { return };
    read(mapping, &file("log.csv", text), text);
}

fn read(mapping: &Mapping, path: &Path, text: &[u8]) {
    let paths = vec![path.to_owned(); mapping.files.len()];
    let mut reader = match LogReader::open(mapping, &paths) {
        Ok(reader) => reader,
        Err(error) => return in_few_words(&error),
    };
    let mut last = None;
    for event in reader.by_ref() {
        match event {
            Ok(event) => {
                assert!(last <= Some(event.time()), "back in time: {event:?}");
                last = Some(event.time());
            }
            Err(error) => in_few_words(&error),
        }
    }
    let report = reader.report();
    let lines = text.split(|byte| matches!(byte, b'\n' | b'\r')).count() * paths.len();
    let counted = report.rows + report.dropped_rows + report.skipped_rows + report.bad_status_rows;
    assert!(counted <= lines as u64, "{lines} lines: {report:?}");
    assert_eq!(report.first_skipped.is_some(), report.skipped_rows > 0, "{report:?}");
    report.first_skipped.iter().for_each(in_few_words);
}

/// Messages of a recording from a time on, and whether it was cut short; `None` where it is none.
fn messages(path: &Path, from_ns: u64) -> Option<(u64, bool)> {
    let mut reader = match RecordingReader::open_at(&[path.to_owned()], from_ns, Arc::default()) {
        Ok(reader) => reader,
        Err(error) => {
            in_few_words(&error);
            return None;
        }
    };
    let mut messages = 0;
    loop {
        match reader.next_message() {
            Ok(Some(_)) => messages += 1,
            Ok(None) => break,
            Err(error) => {
                in_few_words(&error);
                break;
            }
        }
    }
    let report = reader.report();
    assert_eq!(report.messages, messages);
    report.cut_short.iter().for_each(in_few_words);
    Some((messages, report.lost_data()))
}

/// A recording: read to its end, or as far as it is whole, from the front and from a time.
pub fn recording(input: &[u8]) {
    let path = file("log.mcap", input);
    let (all, late) = (messages(&path, 0), messages(&path, 7_100));
    // What is damaged in front may be passed over.
    if let (Some((all, false)), Some((late, _))) = (all, late) {
        assert!(late <= all, "{all} messages, {late} from a time on");
    }
}

/// What is recovered of a recording is a whole recording with as many messages as the report says, and at least those that a reader
/// finds; there is nothing to recover of it.
pub fn recover(input: &[u8]) {
    let path = file("log.mcap", input);
    let (once, twice) = (path.with_file_name("once.mcap"), path.with_file_name("twice.mcap"));
    let options = RecordingOptions { compress: false, overwrite: true, ..RecordingOptions::default() };
    let recover = |from: &Path, to: &Path| Recovery::open(from)?.run(to, options, |_| {});
    let report = match recover(&path, &once) {
        Ok(report) => report,
        Err(error) => return in_few_words(&error),
    };
    report.damage.iter().for_each(|damage| in_few_words(&damage.words));
    assert!(report.damaged_bytes <= report.bytes && report.bytes == input.len() as u64, "{report:?}");
    let (recovered, cut_short) = messages(&once, 0).expect("a recording");
    // What stands in a recording a second time, as JSON, a reader does not count.
    assert!(recovered <= report.messages && !cut_short, "a reader finds {recovered}: {report:?}");
    if let Some((read, _)) = messages(&path, 0) {
        assert!(read <= recovered + report.nameless, "a reader finds {read}, then {recovered}: {report:?}");
    }
    let again = recover(&once, &twice).expect("a whole recording");
    assert!(!again.lost_data() && again.messages == report.messages, "{report:?}\n{again:?}");
}
