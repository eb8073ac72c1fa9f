//! Logs with known gaps, duplicates, late messages and jitter.

use isotherm_correction::sample as core;
use isotherm_correction::sigma::{Causes, Sigma};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::corrected::{CorrectedBatch, Revision, SigmaRun};
use isotherm_protocol::journal::{JournalEntry, JournalEvent, split};
use isotherm_protocol::key::RawStream;
use isotherm_protocol::raw::{AccelBatch, GyroBatch, TemperatureBatch};
use isotherm_protocol::status::{State, Status};

use super::*;
use crate::recording::{RecordingOptions, RecordingReport, RecordingWriter};

/// Ticks of 5 ms.
const TICK_NS: u64 = 5_000_000;

fn unit() -> UnitId {
    UnitId::new("ZLG-0001").unwrap()
}

/// End of a tick by its number.
fn end_ns(sequence: u64) -> i64 {
    i64::try_from((sequence + 1) * TICK_NS).unwrap()
}

/// When a batch is received that ends with this tick, so many ns late.
fn received_ns(sequence: u64, late_ns: u64) -> u64 {
    1_700_000_000_000_000_000 + end_ns(sequence).unsigned_abs() + late_ns
}

/// A batch of gyro ticks, ten to a mode.
fn gyro(first: u64, ticks: u64, late_ns: u64) -> Message {
    let tick = |sequence: u64| core::GyroTick {
        sequence,
        end_time: Timestamp::from_ns(end_ns(sequence)),
        duration: Span::from_ns(TICK_NS.cast_signed()),
        readings: [1.0, 2.0, 3.0].into_iter().collect(),
        mode: Some(if (sequence / 10).is_multiple_of(2) {
            core::LasingMode::Plus
        } else {
            core::LasingMode::Minus
        }),
        switch_command: sequence > 0 && sequence.is_multiple_of(10),
        ..core::GyroTick::default()
    };
    let output = OutputKind::Counts;
    let batch = GyroBatch { output, ticks: (first..first + ticks).map(tick).collect() };
    Message {
        topic: Topic::Raw(unit(), RawStream::Gyro),
        received_ns: received_ns(first + ticks - 1, late_ns),
        frame: codec::encode(&batch).unwrap(),
    }
}

fn corrected(sequences: &[u64], missed: u64, counter: u64) -> Message {
    let tick = |&sequence: &u64| core::CorrectedTick {
        sequence,
        end_time: Timestamp::from_ns(end_ns(sequence)),
        duration: Span::from_ns(5_000_000),
        ticks: 1,
        missed: if Some(&sequence) == sequences.first() { missed } else { 0 },
        flags: core::TickFlags::WARM_UP,
        gyro_flags: std::iter::once(core::SensorFlags::VALID | core::SensorFlags::OVERRANGE).collect(),
        ..core::CorrectedTick::default()
    };
    let batch = CorrectedBatch {
        unit: unit().to_string(),
        series: 0,
        revision: Revision { counter, digest: [7; 8] },
        temperatures: std::iter::empty().collect(),
        sigmas: Vec::new(),
        ticks: sequences.iter().map(tick).collect(),
    };
    let frame = codec::encode(&batch).unwrap();
    Message {
        topic: Topic::Corrected(unit()),
        received_ns: received_ns(*sequences.last().unwrap(), 0),
        frame,
    }
}

/// What a recording of these messages holds.
fn info_of(messages: &[Message]) -> LogInfo {
    let mut survey = Survey::new(&LogFiles::Recordings(Vec::new()));
    for message in messages {
        survey.take(message);
    }
    survey.finish(Vec::new(), LogReport::Recording(RecordingReport::default()))
}

/// The topic of a key.
fn topic<'a>(info: &'a LogInfo, key: &str) -> &'a TopicInfo {
    info.units["ZLG-0001"].topics.iter().find(|topic| topic.key == key).unwrap()
}

#[test]
fn gaps_duplicates_late_ticks_and_jitter_are_those_that_were_made() {
    // 2000 batches of ten ticks. Batch 100 is lost; 200 to 202 too; 300 comes twice; 400 comes behind 401.
    // Every 100th is received 2 ms late, the others 0.1 ms.
    let batch = |index: u64| gyro(index * 10, 10, if index % 100 == 50 { 2_000_000 } else { 100_000 });
    let mut messages = Vec::new();
    for index in (0..2000).filter(|index| ![100, 200, 201, 202, 400].contains(index)) {
        messages.push(batch(index));
        if index == 300 {
            messages.push(batch(index));
        }
        if index == 401 {
            let mut late = batch(400);
            late.received_ns = batch(401).received_ns + 50_000;
            messages.push(late);
        }
    }
    let info = info_of(&messages);
    let gyro = topic(&info, "imu/ZLG-0001/raw/gyro");
    let order = gyro.order.unwrap();
    assert_eq!((order.gaps.count, order.gaps.missing_ticks), (2, 40));
    let longest = order.gaps.longest.unwrap();
    assert_eq!((longest.ticks, longest.first_sequence, longest.after_ns), (30, 2000, end_ns(1999)));
    assert_eq!((order.duplicates, order.late, order.restarts), (10, 10, 0));
    assert_eq!((gyro.messages, gyro.ticks), (1997, 19_970));

    let rate = gyro.rate.unwrap();
    assert!((rate.nominal_hz - 200.0).abs() < 1e-9, "{rate:?}");
    assert!((rate.mean_hz - 200.0).abs() < 1.0 && rate.mean_hz < 200.0, "{rate:?}");
    assert!((gyro.duration_s - 99.995).abs() < 1e-6, "{}", gyro.duration_s);
    // The late batch is 50 ms and 50 µs behind its time, and the receive time of the one before.
    let jitter = gyro.jitter.unwrap().delay;
    assert_eq!(jitter.p50_ns, 0);
    assert!(jitter.p99_ns.abs_diff(1_900_000) < 20_000, "{jitter:?}");
    assert_eq!(jitter.max_ns, 50_050_000);
    assert_eq!(info.first_received_ns, Some(received_ns(9, 100_000)));
}

#[test]
fn modes_are_counted_with_the_time_between_switches() {
    let messages: Vec<_> = (0..100).map(|index| gyro(index * 7, 7, 0)).collect();
    let modes = info_of(&messages).units["ZLG-0001"].modes.unwrap();
    assert_eq!((modes.plus_ticks, modes.minus_ticks), (350, 350));
    assert_eq!((modes.changes, modes.switch_commands), (69, 69));
    assert_eq!(modes.between_changes.unwrap().p50_ns, 10 * TICK_NS);
}

#[test]
fn corrected_ticks_show_gaps_flags_and_revisions() {
    let info = info_of(&[
        corrected(&[0, 1, 2], 0, 1),
        corrected(&[3, 4], 0, 1),
        corrected(&[10, 11], 5, 2),
        corrected(&[12], 0, 2),
    ]);
    let unit = info.units["ZLG-0001"].corrected.as_ref().unwrap();
    assert_eq!(
        (unit.outputs, unit.ticks, unit.gaps, unit.missed_ticks, unit.longest_gap_ticks),
        (8, 8, 1, 5, 5)
    );
    assert_eq!(unit.flags.iter().collect::<Vec<_>>(), [(&"WARM_UP", &8)]);
    assert_eq!(unit.sensor_flags.iter().collect::<Vec<_>>(), [(&"OVERRANGE", &8)]);
    let firsts: Vec<_> =
        unit.revisions.iter().map(|first| (first.revision.counter, first.first_sequence)).collect();
    assert_eq!((firsts.as_slice(), unit.revision_changes), ([(1, 0), (2, 10)].as_slice(), 1));
    let order = topic(&info, "imu/ZLG-0001/corrected").order.unwrap();
    assert_eq!((order.gaps.count, order.gaps.missing_ticks), (1, 5));
}

#[test]
fn standard_errors_are_summed_up_and_the_unknown_counted() {
    let axes = |noise: [f64; 3], calibration: [f64; 3]| Causes { noise, calibration, ..Causes::default() };
    let known = Sigma { angle: axes([3.0, 0.0, 1.0], [4.0, 2.0, 0.0]), velocity: Causes::UNKNOWN };
    let quiet = Sigma { angle: Causes::default(), velocity: Causes::UNKNOWN };
    let mut message = corrected(&[0, 1, 2], 0, 1);
    let mut batch: CorrectedBatch = codec::decode(&message.frame).unwrap();
    batch.ticks[0].sigma = Some(Box::new(known));
    batch.ticks[1].sigma = Some(Box::new(quiet));
    batch.ticks[2].sigma = Some(Box::new(Sigma::UNKNOWN));
    batch.sigmas = SigmaRun::of(&batch.ticks);
    message.frame = codec::encode(&batch).unwrap();
    let info = info_of(&[message, corrected(&[3], 0, 1)]);
    let unit = info.units["ZLG-0001"].corrected.as_ref().unwrap();
    let angle = unit.angle_sigma_rad.unwrap();
    assert_eq!((angle.outputs, angle.unknown), (2, 1));
    for (rms, expected) in angle.rms.into_iter().zip([12.5_f64.sqrt(), 2.0_f64.sqrt(), 0.5_f64.sqrt()]) {
        assert!((rms - expected).abs() < 1e-12, "{:?}", angle.rms);
    }
    let velocity = unit.velocity_sigma_m_per_s.unwrap();
    assert_eq!((velocity.outputs, velocity.unknown), (0, 3));
}

#[test]
fn sensors_have_their_range_and_mean() {
    let mut spoilt = gyro(20, 10, 0);
    let mut batch: GyroBatch = codec::decode(&spoilt.frame).unwrap();
    (batch.ticks[3].readings[1], batch.ticks[4].readings[1]) = (-7.0, 12.0);
    spoilt.frame = codec::encode(&batch).unwrap();
    // The second message comes twice.
    let info = info_of(&[gyro(0, 20, 0), spoilt.clone(), spoilt]);
    let gyros = &info.units["ZLG-0001"].gyros;
    let figures = |info: &ReadingInfo| (info.readings, info.min, info.max, info.first, info.last);
    assert_eq!(
        gyros.iter().map(figures).collect::<Vec<_>>()[..2],
        [(30, 1.0, 1.0, 1.0, 1.0), (30, -7.0, 12.0, 2.0, 2.0)]
    );
    assert!((gyros[1].mean - 61.0 / 30.0).abs() < 1e-12 && (gyros[2].mean - 3.0).abs() < 1e-12);
    assert!(info.units["ZLG-0001"].accelerometers.is_empty());
}

#[test]
fn another_series_of_the_same_numbers_is_a_restart_for_every_topic() {
    let mut messages = Vec::new();
    for (series, index) in [7, 8, 9].into_iter().flat_map(|series| (0..10).map(move |index| (series, index)))
    {
        let mut raw = gyro(index * 10, 10, 0);
        let mut batch: GyroBatch = codec::decode(&raw.frame).unwrap();
        let accel = |tick: &core::GyroTick| core::AccelTick {
            sequence: tick.sequence,
            end_time: tick.end_time,
            duration: tick.duration,
            readings: std::iter::once(9.8).collect(),
        };
        let ticks = batch.ticks.iter().map(accel).collect();
        let frame = codec::encode(&AccelBatch { output: OutputKind::Mean, ticks }).unwrap();
        let topic = Topic::Raw(unit(), RawStream::Accel);
        messages.push(Message { topic, received_ns: raw.received_ns, frame });
        batch.ticks.iter_mut().for_each(|tick| tick.series = series);
        raw.frame = codec::encode(&batch).unwrap();
        messages.push(raw);
        let mut made = corrected(&(index * 10..index * 10 + 10).collect::<Vec<_>>(), 0, 1);
        let mut batch: CorrectedBatch = codec::decode(&made.frame).unwrap();
        batch.series = series;
        made.frame = codec::encode(&batch).unwrap();
        messages.push(made);
    }
    let info = info_of(&messages);
    for key in ["raw/gyro", "raw/accel", "corrected"] {
        let topic = topic(&info, &format!("imu/ZLG-0001/{key}"));
        let order = topic.order.unwrap();
        assert_eq!((topic.ticks, order.duplicates, order.restarts), (300, 0, 2), "{key}");
        assert!(topic.duration_s > 1.3, "{key}: {}", topic.duration_s);
    }
    // The first ten of a run come before anything says of which it is.
    assert_eq!(info.units["ZLG-0001"].accelerometers[0].readings, 280);
}

#[test]
fn temperatures_have_their_range_and_what_is_missing() {
    let channels = ["body", "coil"].map(|name| core::ChannelName::from(name).unwrap());
    let ticks = [(0, [20.0, f64::NAN]), (1, [-3.5, 30.0]), (2, [25.0, 31.0])];
    let tick = |(second, raw): (i64, [f64; 2])| {
        let time = Timestamp::from_ns(second * 1_000_000_000);
        let reading = move |(channel, raw)| core::TemperatureReading { channel, time, raw };
        channels.into_iter().zip(raw).map(reading)
    };
    let batch = TemperatureBatch { readings: ticks.into_iter().flat_map(tick).collect() };
    let frame = codec::encode(&batch).unwrap();
    let topic = Topic::Raw(unit(), RawStream::Temperature);
    let info = info_of(&[Message { topic, received_ns: 1, frame }]);
    let readings = &info.units["ZLG-0001"].temperatures.by_name;
    let body = &readings["body"];
    assert_eq!((body.readings, body.min, body.max, body.first, body.last), (3, -3.5, 25.0, 20.0, 25.0));
    assert_eq!((readings["coil"].readings, readings["coil"].missing, readings["coil"].min), (2, 1, 30.0));
}

#[test]
fn a_journal_tells_swaps_commands_and_lost_entries() {
    let entry = |number, event| JournalEntry {
        unit: unit().to_string(),
        instance: "7f".into(),
        number,
        heard: <[isotherm_protocol::stream::Heard; 5]>::default(),
        event,
    };
    let changed = JournalEvent::Changed {
        revision: Revision { counter: 3, digest: [1; 8] },
        at: isotherm_protocol::control::Schedule::NextTick,
        slew_ns: 0,
        document: Some("text".into()),
        overlay: None,
        source: "bus, by ann".into(),
    };
    let commanded = JournalEvent::Commanded {
        command: isotherm_correction::operation::Command::Standby,
        accepted: true,
        words: "standby".into(),
    };
    // Number 3 and 4 are passed over; one that comes late passes none over once more.
    let late = [5, 4, 6].map(|number| entry(number, JournalEvent::Flushed));
    let entries = [vec![entry(1, changed), entry(2, commanded)], late.to_vec()].concat();
    let messages: Vec<_> = entries
        .iter()
        .flat_map(split)
        .map(|part| Message {
            topic: Topic::Journal(unit()),
            received_ns: 5,
            frame: codec::encode(&part).unwrap(),
        })
        .chain([Message { topic: Topic::Journal(unit()), received_ns: 6, frame: vec![9, 1, 2] }])
        .collect();
    let info = info_of(&messages);
    let journal = info.units["ZLG-0001"].journal.as_ref().unwrap();
    assert_eq!(journal.missing_entries, 2);
    assert_eq!((journal.swaps.len(), journal.swaps[0].source.as_str()), (1, "bus, by ann"));
    assert_eq!((journal.commands[0].command, journal.commands[0].accepted), ("standby", true));
    assert_eq!(topic(&info, "imu/ZLG-0001/journal").unreadable, 1);
}

#[test]
fn states_beyond_those_listed_are_counted_where_they_change() {
    let mut info = StatusInfo::default();
    for n in 0..3000 {
        let state = if n < 2000 && n % 2 == 0 { State::Standby } else { State::default() };
        info.take(n, &Status { state, ..Status::default() });
    }
    assert_eq!((info.states.len(), info.changes), (MAX_LISTED, 1999));
}

#[test]
fn a_file_tells_its_chunks_and_whether_it_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let options = RecordingOptions { chunk_bytes: 2000, ..RecordingOptions::default() };
    let mut writer = RecordingWriter::create(&path, options).unwrap();
    for index in 0..200 {
        writer.write(&gyro(index * 10, 10, 0)).unwrap();
    }
    writer
        .attach(&Attachment {
            name: "a.toml".into(),
            media_type: "application/toml".into(),
            attached_ns: 1,
            bytes: vec![1; 100],
        })
        .unwrap();
    writer.finish().unwrap();
    let file = FileInfo::of(&path).unwrap();
    let layout = file.recording.unwrap();
    assert!(layout.complete && layout.chunks > 5, "{layout:?}");
    assert_eq!((layout.attachments, layout.compression.as_slice()), (1, ["zstd".to_owned()].as_slice()));
    assert!(layout.stored_bytes < layout.uncompressed_bytes && layout.stored_bytes < file.bytes);

    let bytes = std::fs::read(&path).unwrap();
    for cut in (8..bytes.len()).step_by(101) {
        std::fs::write(&path, &bytes[..cut]).unwrap();
        let cut = FileInfo::of(&path).unwrap().recording.unwrap();
        assert!(!cut.complete && cut.chunks <= layout.chunks);
    }
}
