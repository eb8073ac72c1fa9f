//! What `convert` writes, read by programs of others in Python: `mcap`, `rosbags` and `duckdb`.

use std::process::Command;

use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::Angle;
use isotherm_log::mapping::Mapping;
use isotherm_log::message::{Message, Topic};
use isotherm_log::offline::load_calibration;
use isotherm_log::part::{LogFiles, Part};
use isotherm_log::plot::nominal_forces;
use isotherm_log::recording::{RecordingOptions, RecordingWriter};
use isotherm_protocol::document::{AccelOutput, Document};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::stream::UnitStream;
use isotherm_protocol::{codec, key};

use crate::common::{check, replay, root};

/// Units, the presets that simulate them, and the names of their documents.
const UNITS: [(&str, &str); 2] = [("MEMS-0001", "mems-chamber"), ("ZLG-0001", "zeeman-sine")];

#[test]
fn python_reads_what_convert_writes() {
    let Ok(python) = std::env::var("ISOTHERM_PYTHON") else {
        println!("skipped: ISOTHERM_PYTHON is not set");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let options = RecordingOptions { json: true, ..RecordingOptions::default() };
    let mut writer = RecordingWriter::create(&path.join("log.mcap"), options).unwrap();
    for (unit, preset) in UNITS {
        let simulate =
            ["simulate", "--preset", preset, "--duration", "20", "--out", "log.csv", "--overwrite"];
        check(&replay(path, &simulate), 0);
        record(path, unit, &mut writer);
    }
    writer.finish().unwrap();
    let documents: serde_json::Map<_, _> =
        UNITS.iter().map(|(unit, _)| ((*unit).to_owned(), raw_readings(unit))).collect();
    let documents = serde_json::Value::Object(documents).to_string();
    std::fs::write(path.join("documents.json"), documents).unwrap();
    for target in ["text", "ros2", "parquet"] {
        let raw = if target == "ros2" { &["--raw"][..] } else { &[] };
        let documents = UNITS.map(|(unit, _)| document(unit));
        let documents = documents.iter().flat_map(|path| ["--calibration", path.as_str()]);
        let documents: Vec<_> = documents.filter(|_| target == "ros2").collect();
        let args = [&["convert", "log.mcap", "--out", target, "--to", target], raw, &documents].concat();
        check(&replay(path, &args), 0);
    }
    let output = Command::new(python)
        .args(["-B", "tests/python/recordings.py"])
        .arg(path)
        .current_dir(root())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}\n{}", String::from_utf8_lossy(&output.stderr));
    let said: serde_json::Value = serde_json::from_str(&said).unwrap();
    // 20 s of 100 Hz and of 200 Hz.
    for (what, count) in [("mcap", 6000), ("ros2", 6000), ("parquet", 6000)] {
        assert!(said[what]["corrected"].as_u64().is_some_and(|ticks| ticks >= count / 2), "{said}");
        assert!(said[what]["raw_gyro"].as_u64() == said["csv"]["raw_gyro"].as_u64(), "{said}");
        assert!(said[what]["temperature"].as_u64().is_some_and(|readings| readings > 0), "{said}");
    }
}

/// A unit's calibration document.
fn document(unit: &str) -> String {
    std::fs::canonicalize(root().join(format!("config/calibration/{unit}.toml")))
        .unwrap()
        .display()
        .to_string()
}

/// What a document says of raw readings: the angle of each gyro's count (rad), and whether accelerometers read m/s².
fn raw_readings(unit: &str) -> serde_json::Value {
    let text = std::fs::read_to_string(document(unit)).unwrap();
    let document = Document::parse(&text, None).unwrap().document;
    let weights = document.gyro.sensor.iter().map(|sensor| sensor.increment_weight_arcsec_per_count);
    let weights = weights.map(|weight| weight.map(|weight| Angle::from_arcsec(weight).as_rad()));
    let weights = weights.collect::<Option<Vec<_>>>();
    let output = document.accel.as_ref().map(|accel| accel.output);
    let are_forces = output == Some(AccelOutput::MetresPerSecondSquared);
    let scales = if are_forces { vec![1.0; 3] } else { nominal_forces(&document) };
    serde_json::json!([weights, scales, output == Some(AccelOutput::Counts)])
}

/// Records the raw messages of the log in the folder, and what the service would publish of them.
fn record(folder: &std::path::Path, unit: &str, writer: &mut RecordingWriter) {
    let loaded = load_calibration(document(unit).as_ref()).unwrap();
    let unit = UnitId::new(unit).unwrap();
    let mapping = Mapping::load(&folder.join("log.mapping.toml")).unwrap();
    let (paths, mapping) = (vec![folder.join("log.csv")], Box::new(mapping));
    let files = LogFiles::Text { paths, mapping, unit: unit.clone(), batch_ticks: 16 };
    let mut log = files.open(&Part::default()).unwrap();
    let mut stream = UnitStream::new(unit.clone(), UnitSettings::default());
    stream.install(loaded.calibration, loaded.digest);
    let mut frame = Vec::new();
    let publish =
        |stream: &mut UnitStream, received_ns, writer: &mut RecordingWriter, frame: &mut Vec<u8>| {
            while stream.next_frame(frame).is_some() {
                let topic = Topic::of(&key::corrected(&unit));
                writer.write(&Message { topic, received_ns, frame: frame.clone() }).unwrap();
            }
        };
    let mut last_ns = 0;
    while let Some(message) = log.next_message().unwrap() {
        writer.write(&message).unwrap();
        let Topic::Raw(_, raw) = &message.topic else { continue };
        stream.receive(*raw, &message.frame).unwrap();
        last_ns = message.received_ns;
        publish(&mut stream, last_ns, writer, &mut frame);
    }
    stream.flush();
    publish(&mut stream, last_ns, writer, &mut frame);
    let status = isotherm_protocol::status::Status { unit: unit.to_string(), ..Default::default() };
    let frame = codec::encode(&status).unwrap();
    writer.write(&Message { topic: Topic::of(&key::status(&unit)), received_ns: last_ns, frame }).unwrap();
}
