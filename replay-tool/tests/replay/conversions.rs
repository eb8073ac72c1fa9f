//! Logs converted there and back.

use std::fs;
use std::path::{Path, PathBuf};

use isotherm_correction::sample::{AccelTick, ChannelName, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_log::mapping::Mapping;
use isotherm_log::message::{Message, Topic};
use isotherm_log::recording::{Documents, RecordingOptions, RecordingReader, RecordingWriter};
use isotherm_log::text::{LogEvent, LogReader};
use isotherm_protocol::codec;
use isotherm_protocol::raw::{
    AccelBatch, GyroBatch, HealthBatch, HealthReading, HealthTick, TemperatureBatch,
};
use serde_json::Value;

use crate::common::{check, mapping, replay, stderr, stdout, told};
use crate::real_logs::data;

/// All events of a text log.
fn events(mapping: &Path, log: &Path) -> Vec<LogEvent> {
    let mapping = Mapping::load(mapping).unwrap();
    LogReader::open(&mapping, &[log.to_path_buf()]).unwrap().map(Result::unwrap).collect()
}

/// All messages of a recording.
fn messages(path: &Path) -> Vec<Message> {
    let mut reader = RecordingReader::open(&[path.to_path_buf()], std::sync::Arc::default()).unwrap();
    std::iter::from_fn(|| reader.next_message().unwrap()).collect()
}

fn record(path: &Path, messages: &[Message]) {
    let mut writer = RecordingWriter::create(path, RecordingOptions::default()).unwrap();
    for message in messages {
        writer.write(message).unwrap();
    }
    writer.finish().unwrap();
}

/// Runs a conversion with its summary as JSON, which must end with this code.
fn convert(folder: &Path, args: &[&str], code: i32) -> Value {
    let output = replay(folder, &[&["convert", "--json"], args].concat());
    check(&output, code);
    serde_json::from_str(&stdout(&output)).unwrap()
}

#[test]
fn a_part_of_a_recording_is_the_same_whether_or_not_its_log_begins_before_time_0() {
    let [before, after] = [-2005, 3005].map(|begin_ms| {
        let folder = tempfile::tempdir().unwrap();
        let row = |row: i32| format!("{},1.5,2.5,{row}\n", row * 10 + begin_ms);
        let front = "t [ms],gx [deg/s],gy [deg/s],gz [deg/s]\n".to_owned();
        fs::write(folder.path().join("log.csv"), front + &(0..400).map(row).collect::<String>()).unwrap();
        check(&replay(folder.path(), &["import", "log.csv", "--no-plot"]), 0);
        convert(folder.path(), &["log.csv", "--unit", "U-1", "--batch", "1", "--out", "log.mcap"], 0);
        [["--start", "0.5", "--end", "1.0"], ["--start", "1.9", "--end", "2.5"]].map(|window| {
            let lines = stdout(&replay(folder.path(), &[&["cat", "log.mcap"][..], &window].concat()));
            let message = |line: &str| serde_json::from_str::<Value>(line).unwrap()["message"].take();
            let ticks = lines.lines().map(|line| message(line)["ticks"][0]["sequence"].as_u64().unwrap());
            ticks.collect::<Vec<_>>()
        })
    });
    assert_eq!(before, after);
    assert_eq!((before[0].len(), before[1].first()), (50, Some(&191)));
}

/// A text log to a recording, back to text, and once more to a recording: the same ticks, the same messages.
fn there_and_back(mapping: &Path, log: &Path) {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let [mapping_name, log_name] = [mapping, log].map(|path| path.to_str().unwrap());
    convert(folder.path(), &[log_name, "-m", mapping_name, "-u", "U-1", "--out", "a.mcap"], 0);
    let back = convert(folder.path(), &["a.mcap", "--out", "b.csv"], 0);
    assert_eq!((back["duplicates"].as_u64(), &back["lost"]), (Some(0), &serde_json::json!({})));
    let before = events(mapping, log);
    let after = events(&path("b.mapping.toml"), &path("b.csv"));
    assert_eq!(before.len(), after.len());
    for (before, after) in before.iter().zip(&after) {
        assert_eq!(before, after);
    }
    let once_more =
        ["b.csv", "-m", "b.mapping.toml", "-u", "U-1", "--out", "c.mcap", "--compression", "none"];
    convert(folder.path(), &once_more, 0);
    assert!(messages(&path("a.mcap")) == messages(&path("c.mcap")), "the same messages");
    let length = |name: &str| fs::metadata(path(name)).unwrap().len();
    assert!(length("a.mcap") < length("c.mcap"), "compressed, and not");
}

#[test]
fn simulated_logs_come_back_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let presets = stdout(&replay(folder.path(), &["simulate", "--list-presets"]));
    for name in presets.lines().map(|line| line.split_whitespace().next().unwrap()) {
        let simulate = ["simulate", "--preset", name, "--duration", "20", "--out", "log.csv", "--overwrite"];
        check(&replay(folder.path(), &simulate), 0);
        there_and_back(&folder.path().join("log.mapping.toml"), &folder.path().join("log.csv"));
    }
}

#[test]
fn with_data_real_logs_come_back_to_the_bit() {
    for (name, log) in [
        ("rlg-static.toml", "rlg-static/rlg-static.imu.gz"),
        ("chamber-mems.toml", "chamber-mems/chamber.tsv"),
        ("tumble-mems.toml", "tumble-mems"),
    ] {
        let Some(log) = data(log) else { continue };
        there_and_back(&fs::canonicalize(mapping(name)).unwrap(), &fs::canonicalize(log).unwrap());
    }
}

/// A gyro message of one tick of three counts that ends at so many milliseconds.
fn gyro(unit: &str, series: u64, sequence: u64, end_ms: i64) -> Message {
    let number = f64::from(i32::try_from(sequence).unwrap());
    let tick = GyroTick {
        sequence,
        end_time: Timestamp::from_ns(end_ms * 1_000_000),
        duration: Span::from_ms(10),
        readings: [number, -number, f64::from(i32::MIN)].into_iter().collect(),
        series,
        ..GyroTick::default()
    };
    let frame = codec::encode(&GyroBatch { output: OutputKind::Counts, ticks: vec![tick] }).unwrap();
    Message { topic: Topic::of(&format!("imu/{unit}/raw/gyro")), received_ns: 5, frame }
}

fn accel(unit: &str, sequence: u64, end_ms: i64, volts: &[f64]) -> Message {
    let tick = AccelTick {
        sequence,
        end_time: Timestamp::from_ns(end_ms * 1_000_000),
        duration: Span::from_ms(10),
        readings: volts.iter().copied().collect(),
    };
    let frame = codec::encode(&AccelBatch { output: OutputKind::Mean, ticks: vec![tick] }).unwrap();
    Message { topic: Topic::of(&format!("imu/{unit}/raw/accel")), received_ns: 5, frame }
}

fn temperatures(unit: &str, channels: &[&str], time_ms: i64, raw: &[f64]) -> Message {
    let time = Timestamp::from_ns(time_ms * 1_000_000);
    let reading = |(name, raw): (&&str, &f64)| TemperatureReading {
        channel: ChannelName::from(name).unwrap(),
        time,
        raw: *raw,
    };
    let readings = channels.iter().zip(raw).map(reading).collect();
    let frame = codec::encode(&TemperatureBatch { readings }).unwrap();
    Message { topic: Topic::of(&format!("imu/{unit}/raw/temp")), received_ns: 5, frame }
}

fn health(unit: &str) -> Message {
    let readings = vec![HealthReading { name: ChannelName::from("half, \"wave\"").unwrap(), value: 48.25 }];
    let frame = codec::encode(&HealthBatch { ticks: vec![HealthTick { time_ns: 7, readings }] }).unwrap();
    Message { topic: Topic::of(&format!("imu/{unit}/raw/health")), received_ns: 5, frame }
}

/// Paths of the files that a summary names, and their rows.
fn files(summary: &Value) -> Vec<(String, u64)> {
    let files = summary["files"].as_array().unwrap().iter();
    let mut files: Vec<_> = files
        .map(|file| (file["path"].as_str().unwrap().to_owned(), file["rows"].as_u64().unwrap()))
        .collect();
    files.sort();
    files
}

fn pairs(files: &[(&str, u64)]) -> Vec<(String, u64)> {
    files.iter().map(|(path, rows)| ((*path).to_owned(), *rows)).collect()
}

#[test]
fn odd_serials_and_channels_each_get_their_own_folder_and_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let odd = ["a,b", "a;b", "µ \"x\"", "line\nend"];
    let raw = [-0.0, 1e-300, f64::INFINITY, 273.15];
    let mut all = Vec::new();
    for unit in ["..", "A-1", "A_1", "0042"] {
        all.push(temperatures(unit, &odd, 4, &raw));
        all.push(gyro(unit, 0, 1, 10));
        all.push(health(unit));
    }
    record(&path("odd.mcap"), &all);
    let summary = convert(folder.path(), &["odd.mcap", "--out", "out", "--to", "text"], 0);
    for unit in ["%2E.", "A-1", "A_1", "0042"] {
        let raw_csv = path(&format!("out/{unit}/raw.csv"));
        let back = events(&path(&format!("out/{unit}/raw.mapping.toml")), &raw_csv);
        let readings: Vec<_> = back
            .iter()
            .filter_map(|event| match event {
                LogEvent::Temperature(reading) => Some((reading.channel.to_string(), reading.raw.to_bits())),
                _ => None,
            })
            .collect();
        let expected: Vec<_> =
            odd.iter().zip(raw).map(|(name, raw)| ((*name).to_owned(), raw.to_bits())).collect();
        assert_eq!(readings, expected, "{unit}");
        let health = fs::read_to_string(path(&format!("out/{unit}/health.csv"))).unwrap();
        assert_eq!(health, "time_ns,name,value\n7,\"half, \"\"wave\"\"\",48.25\n");
    }
    assert_eq!(files(&summary).len(), 12);
    let bag = ["convert", "odd.mcap", "--out", "bag", "--to", "ros2", "--frame", "x"];
    insta::assert_snapshot!(told(folder.path(), &bag));
    assert!(!path("bag").exists());
}

#[test]
fn a_stream_that_is_empty_is_read_back_as_empty() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    record(&path("accel.mcap"), &[accel("A-1", 7, 10, &[0.1, -0.0])]);
    convert(folder.path(), &["accel.mcap", "--out", "accel.csv"], 0);
    let back = events(&path("accel.mapping.toml"), &path("accel.csv"));
    let [LogEvent::Accel { output: OutputKind::Mean, tick }] = back.as_slice() else { panic!("{back:?}") };
    assert_eq!((tick.sequence, tick.readings[1].to_bits()), (7, (-0.0f64).to_bits()));

    record(&path("none.mcap"), &[]);
    let mut words: String = ["text", "parquet", "ros2"]
        .map(|target| told(folder.path(), &["convert", "none.mcap", "--out", "out", "--to", target]))
        .concat();
    let again = ["convert", "accel.csv", "-m", "accel.mapping.toml", "-u", "A-1", "--out", "later.mcap"];
    words += &told(folder.path(), &[&again[..], &["--start", "100"]].concat());
    insta::assert_snapshot!(words);
    assert!(!path("later.mcap").exists() && !path("out").exists());

    // A document of another unit would say nothing of these readings.
    let document = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
    let bag = ["convert", "accel.mcap", "--to", "ros2", "--out", "bag", "--calibration", document];
    insta::assert_snapshot!(stderr(&replay(folder.path(), &bag)));
}

#[test]
fn a_document_behind_the_last_message_says_what_readings_are() {
    let folder = tempfile::tempdir().unwrap();
    let document = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/ZLG-0001.toml");
    let mut writer =
        RecordingWriter::create(&folder.path().join("x.mcap"), RecordingOptions::default()).unwrap();
    writer.write(&gyro("ZLG-0001", 3, 0, 10)).unwrap();
    writer.attach(&Documents::attachment(fs::read(document).unwrap(), 6)).unwrap();
    writer.finish().unwrap();
    let summary = convert(folder.path(), &["x.mcap", "--to", "ros2", "--out", "bag"], 0);
    assert_eq!(summary["topics"][0]["name"], "/imu/ZLG_0001/data_raw");
}

#[test]
fn doubled_and_late_ticks_and_new_runs_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mut all: Vec<_> = (0..700_u64).map(|n| gyro("A-1", 3, n, 10 * n.cast_signed())).collect();
    all.swap(100, 103);
    all.insert(50, all[49].clone());
    all.push(gyro("A-1", 3, 2, 25));
    all.extend((0..5_u64).map(|n| gyro("A-1", 4, n, 10 * n.cast_signed())));
    all.push(Message { frame: vec![1, 2, 3, 4, 5, 6, 7], ..gyro("A-1", 4, 0, 0) });
    record(&path("x.mcap"), &all);
    let summary = convert(folder.path(), &["x.mcap", "--out", "x.csv"], 3);
    assert_eq!(summary["duplicates"], 1);
    let lost = serde_json::json!({ "frames that cannot be read": 1, "too late to be sorted": 1 });
    assert_eq!(summary["lost"], lost);
    let expected = [("x.2.csv", 5), ("x.2.mapping.toml", 1), ("x.csv", 700), ("x.mapping.toml", 1)];
    assert_eq!(files(&summary), pairs(&expected));
    for (name, ticks) in [("x", 700), ("x.2", 5)] {
        let back = events(&path(&format!("{name}.mapping.toml")), &path(&format!("{name}.csv")));
        let sequences: Vec<_> = back
            .iter()
            .filter_map(|event| match event {
                LogEvent::Gyro { tick, .. } => Some(tick.sequence),
                _ => None,
            })
            .collect();
        assert_eq!(sequences, (0..ticks).collect::<Vec<_>>(), "{name}");
    }
    // Parquet has everything as it came.
    let summary = convert(folder.path(), &["x.mcap", "--out", "tables", "--to", "parquet"], 3);
    assert_eq!(files(&summary), pairs(&[("tables/A-1/raw_gyro.parquet", 707)]));
}

#[test]
fn a_recording_that_is_cut_is_converted_to_its_last_whole_chunk() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let options = RecordingOptions { chunk_bytes: 2000, ..RecordingOptions::default() };
    let mut writer = RecordingWriter::create(&path("whole.mcap"), options).unwrap();
    for n in 0..500_u64 {
        writer.write(&gyro("A-1", 3, n, 10 * n.cast_signed())).unwrap();
    }
    writer.finish().unwrap();
    let bytes = fs::read(path("whole.mcap")).unwrap();
    fs::write(path("cut.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    let summary = convert(folder.path(), &["cut.mcap", "--out", "cut.csv"], 3);
    assert!(summary["log"]["cut_short"].as_str().unwrap().contains("cut.mcap"));
    let back = events(&path("cut.mapping.toml"), &path("cut.csv"));
    assert!((1..500).contains(&back.len()), "{}", back.len());
}

#[test]
fn the_part_that_is_asked_for_is_converted() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let at = |n: u64, message: Message| Message { received_ns: n * 10_000_000, ..message };
    let mut all = Vec::new();
    for n in 0..100_u64 {
        all.push(at(n, gyro("A-1", 3, n, 10 * n.cast_signed())));
        all.push(at(n, gyro("B-2", 3, n, 10 * n.cast_signed())));
    }
    record(&path("x.mcap"), &all);
    let part = ["x.mcap", "--out", "x.csv.gz", "--unit", "B-2", "--start", "0.2", "--duration", "0.3"];
    let summary = convert(folder.path(), &part, 0);
    assert_eq!(files(&summary), pairs(&[("x.csv.gz", 30), ("x.mapping.toml", 1)]));
    assert_eq!(events(&path("x.mapping.toml"), &path("x.csv.gz")).len(), 30);
    // A part that adjoins has the next message, and none of these again.
    let next = ["x.mcap", "--out", "y.csv.gz", "--unit", "B-2", "--start", "0.5", "--duration", "0.1"];
    convert(folder.path(), &next, 0);
    let times = |name| events(&path("x.mapping.toml"), &path(name)).into_iter().map(|event| event.time());
    assert_eq!(times("y.csv.gz").next(), times("x.csv.gz").next_back().map(|last| last + Span::from_ms(10)));
    insta::assert_snapshot!(told(folder.path(), &["convert", "x.mcap", "--out", "y.csv"]));
}

#[test]
fn nothing_is_written_over_and_nothing_half_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let names = || -> Vec<PathBuf> {
        let mut names: Vec<_> =
            folder.path().read_dir().unwrap().map(|entry| entry.unwrap().path()).collect();
        names.sort();
        names
    };
    record(&path("x.mcap"), &[gyro("A-1", 3, 1, 10)]);
    fs::write(path("x.csv"), "mine").unwrap();
    fs::write(path("y.mapping.toml"), "mine").unwrap();
    fs::create_dir_all(path("full/other")).unwrap();
    let before = names();
    let run = |args: &[&str]| replay(folder.path(), &[&["convert"], args].concat());
    let refused = [
        &["x.mcap", "--out", "x.csv"][..],
        &["x.mcap", "--out", "y.csv"],
        &["x.mcap", "--out", "full", "--to", "parquet"],
        &["x.mcap", "--out", "x.csv", "--to", "ros2"],
        &["x.mcap", "--out", "x.mcap"],
        &["x.mcap", "--out", "other"],
        &["x.mcap", "--out", "x.parquet", "--to", "parquet"],
        &["x.mcap", "--out", "z.csv", "--frame", "x"],
        &["x.mcap", "--out", "z.csv", "--compression", "none"],
        &["none.mcap", "--out", "z.csv"],
        &["x.csv", "-m", "y.mapping.toml", "-u", "A-1", "--out", "z.mcap"],
    ];
    let refused = refused.map(|args| told(folder.path(), &[&["convert"], args].concat()));
    insta::assert_snapshot!(refused.concat());
    assert_eq!(names(), before);
    assert_eq!(fs::read_to_string(path("x.csv")).unwrap(), "mine");
    check(&run(&["x.mcap", "--out", "x.csv", "--overwrite"]), 0);
    check(&run(&["x.mcap", "--out", "full", "--to", "parquet", "--overwrite"]), 0);
    assert!(path("full/other").is_dir() && path("full/A-1/raw_gyro.parquet").is_file());
    assert!(fs::read_to_string(path("x.csv")).unwrap().starts_with("end_time_ns,"));

    // A text log that fails in its middle leaves nothing behind.
    let csv = "end_time_ns,gyro_sequence,gyro_duration_ns,gyro_1,gyro_2,gyro_3\n1,0,1,1,1,1\n2,x,1,1,1,1\n";
    fs::write(path("bad.csv"), csv).unwrap();
    let before = names();
    let bad = ["bad.csv", "-m", "x.mapping.toml", "-u", "A-1"];
    insta::assert_snapshot!(told(folder.path(), &[&["convert"], &bad[..], &["--out", "bad.mcap"]].concat()));
    assert_eq!(names(), before);
}
