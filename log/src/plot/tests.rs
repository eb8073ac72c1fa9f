//! Pages of made-up logs.

use isotherm_correction::sample as core;
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec;
use isotherm_protocol::corrected::{CorrectedBatch, Revision};

use super::reading::UnitLogs;
use super::unit::UnitPlot;
use super::*;
use crate::message::{Message, Topic};
use crate::part::{LogFiles, Part};
use crate::recording::{RecordingOptions, RecordingWriter};

/// A batch of corrected ticks.
fn batch(unit: &UnitId, revision: Revision, ticks: Vec<core::CorrectedTick>) -> Message {
    let batch = CorrectedBatch {
        unit: unit.to_string(),
        series: 0,
        revision,
        temperatures: std::iter::empty().collect(),
        sigmas: Vec::new(),
        ticks,
    };
    Message { topic: Topic::Corrected(unit.clone()), received_ns: 0, frame: codec::encode(&batch).unwrap() }
}

/// A recording of corrected ticks of 5 ms: the rate about x is `rate(n)`; ten ticks to a batch, another revision at `change`.
fn recording(
    path: &std::path::Path,
    unit: &str,
    ticks: std::ops::Range<u64>,
    change: u64,
    delta: impl Fn(u64) -> f64,
) {
    let mut writer = RecordingWriter::create(path, RecordingOptions::default()).unwrap();
    let unit = UnitId::new(unit).unwrap();
    for first in ticks.clone().step_by(10) {
        let tick = |sequence: u64| core::CorrectedTick {
            sequence,
            end_time: Timestamp::from_ns(i64::try_from(sequence).unwrap() * 5_000_000),
            duration: Span::from_ns(5_000_000),
            ticks: 1,
            delta_angle: [delta(sequence), 0.0, 1e-6],
            delta_velocity: [0.0, 0.0, 0.049],
            mode: Some(core::LasingMode::Plus),
            flags: if sequence == 15 { core::TickFlags::ANGLE_RESTORED } else { core::TickFlags::empty() },
            ..core::CorrectedTick::default()
        };
        let revision = Revision { counter: 1 + u64::from(first >= change), digest: [0xab; 8] };
        let ticks = (first..(first + 10).min(ticks.end)).map(tick).collect();
        writer.write(&Message { received_ns: first, ..batch(&unit, revision, ticks) }).unwrap();
    }
    writer.finish().unwrap();
}

fn log(path: &std::path::Path) -> PlotLog {
    let messages = LogFiles::Recordings(vec![path.to_owned()]).open(&Part::default()).unwrap();
    let name = path.file_name().unwrap().to_string_lossy().into_owned();
    PlotLog { name, messages, shown_as: None, correct_from: None }
}

#[test]
fn two_logs_are_compared_tick_by_tick() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a.mcap", "b.mcap"].map(|name| folder.path().join(name));
    recording(&a, "ZLG-0001", 0..500, 250, |_| 1e-6);
    recording(&b, "ZLG-0001", 100..600, 9999, |sequence| if sequence < 300 { 1e-6 } else { 1.5e-6 });
    let (page, summary) = plot(vec![log(&a), log(&b)], &PlotOptions::default(), &mut |_| {}).unwrap();
    let difference = summary.differences["ZLG-0001"];
    let expected =
        DifferenceSummary { common_ticks: 400, differing_ticks: 200, only_first: 100, only_second: 100 };
    assert_eq!(difference, expected);
    let html = page.to_html();
    for words in [
        "A corrected",
        "B corrected",
        "B − A x",
        "calibration change",
        "ANGLE_RESTORED",
        "mode +1",
        "changes and commands: 1",
    ] {
        assert!(html.contains(words), "{words}");
    }
    insta::assert_snapshot!(
        html.split(['<', '"']).find(|text| text.contains("abababab") && text.contains("250")).unwrap()
    );
    // The mean of the differences: half of the common ticks differ by 0.5 µrad in 5 ms.
    let mean = 0.5 * 0.5e-6 / 0.005 * nominal::DEG_PER_H;
    assert!(html.contains(&format!(">{mean:.5}</td>")), "{mean}");
}

#[test]
fn units_of_different_serials_keep_them() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a.mcap", "b.mcap"].map(|name| folder.path().join(name));
    recording(&a, "ZLG-0001", 0..50, 9999, |_| 1e-6);
    recording(&b, "MEMS-0001", 0..50, 9999, |_| 1e-6);
    let second = PlotLog { shown_as: Some(UnitId::new("ZLG-0001").unwrap()), ..log(&b) };
    let (page, summary) = plot(vec![log(&a), second], &PlotOptions::default(), &mut |_| {}).unwrap();
    assert_eq!(summary.differences["ZLG-0001"].common_ticks, 50);
    let html = page.to_html();
    for words in ["Unit ZLG-0001 in a.mcap:", "Unit MEMS-0001 in b.mcap:", "Unit ZLG-0001 and MEMS-0001"] {
        assert!(html.contains(words), "{words}");
    }
}

#[test]
fn logs_of_different_days_begin_together() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a.mcap", "b.mcap"].map(|name| folder.path().join(name));
    // Their first batches are not equally long.
    recording(&a, "ZLG-0001", 0..50, 9999, |_| 1e-6);
    recording(&b, "ZLG-0001", 20_000_000..20_000_003, 9999, |_| 1e-6);
    let (_, summary) = plot(vec![log(&a), log(&b)], &PlotOptions::default(), &mut |_| {}).unwrap();
    assert_eq!(summary.second_moved_ns, Some(-100_000_000_000_000));
    assert_eq!(summary.differences["ZLG-0001"].common_ticks, 3);
}

#[test]
fn units_without_ticks_take_no_place() {
    let folder = tempfile::tempdir().unwrap();
    let [idle, ticks] = ["idle.mcap", "ticks.mcap"].map(|name| folder.path().join(name));
    let mut writer = RecordingWriter::create(&idle, RecordingOptions::default()).unwrap();
    for number in 0..=MAX_UNITS {
        let topic = Topic::Status(UnitId::new(&format!("IDLE-{number}")).unwrap());
        writer.write(&Message { topic, received_ns: 0, frame: Vec::new() }).unwrap();
    }
    writer.finish().unwrap();
    recording(&ticks, "ZLG-0001", 0..50, 9999, |_| 1e-6);
    let messages = LogFiles::Recordings(vec![idle, ticks.clone()]).open(&Part::default()).unwrap();
    let logs = vec![PlotLog { messages, ..log(&ticks) }];
    let (_, summary) = plot(logs, &PlotOptions::default(), &mut |_| {}).unwrap();
    assert_eq!(summary.units.keys().collect::<Vec<_>>(), ["ZLG-0001"]);
    assert_eq!(summary.units_left_out, 0);
}

/// A tick with flags of its own, of a gyro and of an accelerometer.
fn flagged(flags: core::TickFlags, gyro: core::SensorFlags, accel: core::SensorFlags) -> core::CorrectedTick {
    core::CorrectedTick {
        duration: Span::from_ms(5),
        ticks: 1,
        delta_angle: [1.0, 0.0, 0.0],
        flags,
        gyro_flags: std::iter::once(gyro).collect(),
        accel_flags: std::iter::once(accel).collect(),
        ..core::CorrectedTick::default()
    }
}

#[test]
fn each_flag_has_a_row_of_its_own() {
    let (tick, sensor) = (core::TickFlags::empty(), core::SensorFlags::VALID);
    let of_tick = core::TickFlags::all().iter_names();
    let of_tick = of_tick.map(|(name, flag)| (name.to_owned(), flagged(flag, sensor, sensor)));
    let of_sensor = core::SensorFlags::all().iter_names().filter(|(_, flag)| *flag != sensor);
    let of_sensor = of_sensor.flat_map(|(name, flag)| {
        let gyro = (format!("gyro {name}"), flagged(tick, flag, sensor));
        [gyro, (format!("accel {name}"), flagged(tick, sensor, flag))]
    });
    let unit = UnitId::new("ZLG-0001").unwrap();
    for (name, tick) in of_tick.chain(of_sensor) {
        let mut shown = UnitPlot::new(2, None, 0);
        shown.take(&batch(&unit, Revision::default(), vec![tick]), &mut |_, _| {});
        let logs = UnitLogs { logs: vec![Some(shown)], difference: None };
        let page = layout::page(vec![(unit.clone(), logs)], &PlotSummary::default()).unwrap().to_html();
        assert_eq!(page.matches("\"bit\":").count(), 1, "{name}");
        assert!(page.contains(&format!("\"name\":\"{name}\"")), "{name}");
    }
}

#[test]
fn ticks_without_a_calibration_are_counted_and_not_drawn() {
    let unit = UnitId::new("ZLG-0001").unwrap();
    let sensor = core::SensorFlags::VALID;
    let good =
        core::CorrectedTick { delta_angle: [0.0; 3], ..flagged(core::TickFlags::empty(), sensor, sensor) };
    let raw = flagged(core::TickFlags::UNCALIBRATED, sensor, sensor);
    let mut shown = UnitPlot::new(2, None, 0);
    let mut handed_on = 0;
    // A CSV of corrected ticks says no digest.
    let revision = Revision { counter: 1, digest: [0; 8] };
    for tick in [good, raw] {
        shown.take(&batch(&unit, revision, vec![tick]), &mut |_, _| handed_on += 1);
    }
    assert_eq!((handed_on, shown.uncalibrated), (1, 1));
    assert_eq!(shown.revisions[0].label, "1");
    let drawn = shown.corrected.unwrap();
    assert_eq!((drawn.ticks(), drawn.finish(0).overall(0, 1.0).unwrap().max), (2, 0.0));
}

#[test]
fn channels_of_two_logs_are_told_apart() {
    let [first, second] = [0, 8].map(|before| layout::several(before).take(8).collect::<Vec<_>>());
    assert!(first.iter().zip(&second).all(|(a, b)| a.0 == b.0 && a.1 != b.1), "a channel keeps its colour");
    let all: std::collections::BTreeSet<_> =
        first.iter().chain(&second).map(|(ink, dashes)| (format!("{ink:?}"), dashes)).collect();
    assert_eq!(all.len(), 16, "{all:?}");
}

#[test]
fn a_log_without_ticks_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("empty.mcap");
    RecordingWriter::create(&path, RecordingOptions::default()).unwrap().finish().unwrap();
    let error = plot(vec![log(&path)], &PlotOptions::default(), &mut |_| {}).unwrap_err();
    assert!(matches!(error, Error::Nothing("draw")), "{error}");
}

#[test]
fn the_page_of_many_ticks_is_no_larger_than_that_of_few() {
    let folder = tempfile::tempdir().unwrap();
    let size = |ticks: u64| {
        let path = folder.path().join(format!("{ticks}.mcap"));
        recording(
            &path,
            "ZLG-0001",
            0..ticks,
            u64::MAX,
            |sequence| if sequence == 7777 { 1.0 } else { 1e-6 },
        );
        let options = PlotOptions { detail: 512, calibration: None };
        let (page, summary) = plot(vec![log(&path)], &options, &mut |_| {}).unwrap();
        assert_eq!(summary.units["ZLG-0001"][0].as_ref().unwrap().corrected_ticks, ticks);
        let html = page.to_html();
        // Bins reach further than the ticks, the axis does not.
        let end = html
            .split("\"within\":[0.0,")
            .nth(1)
            .and_then(|rest| rest.split(']').next()?.parse::<f64>().ok());
        let expected = f64::from(u32::try_from(ticks - 1).unwrap()) * 0.005;
        assert!(end.is_some_and(|end| (end - expected).abs() < 1e-6), "{end:?} {expected}");
        // The peak is in the table whatever was joined: 1 rad in 5 ms.
        assert!(
            html.contains(&format!("{:.0}", 200.0 * nominal::DEG_PER_H).chars().take(5).collect::<String>())
        );
        html.len()
    };
    let (few, many) = (size(10_000), size(100_000));
    assert!(many < few * 2, "{few} {many}");
}

#[test]
fn ten_million_ticks_make_a_bounded_page() {
    let begun = std::time::Instant::now();
    let mut shown = UnitPlot::new(PlotOptions::default().detail, None, 0);
    let unit = UnitId::new("ZLG-0001").unwrap();
    let ticks = 10_000_000_u64;
    for first in (0..ticks).step_by(256) {
        let tick = |sequence: u64| {
            let noise = f64::from(u16::try_from(sequence * 7919 % 1000).unwrap());
            core::CorrectedTick {
                sequence,
                end_time: Timestamp::from_ns(i64::try_from(sequence).unwrap() * 5_000_000),
                duration: Span::from_ns(5_000_000),
                ticks: 1,
                delta_angle: [1e-9 * noise, 2e-9 * noise, 1e-6],
                delta_velocity: [0.0, 1e-6 * noise, 0.049],
                ..core::CorrectedTick::default()
            }
        };
        let ticks = (first..(first + 256).min(ticks)).map(tick).collect();
        shown.take(&batch(&unit, Revision::default(), ticks), &mut |_, _| {});
    }
    let taken = begun.elapsed();
    let summary = PlotSummary { logs: vec!["ten million".into()], ..PlotSummary::default() };
    let logs = UnitLogs { logs: vec![Some(shown)], difference: None };
    let html = layout::page(vec![(unit, logs)], &summary).unwrap().to_html();
    println!(
        "10 000 000 ticks: {taken:?} to take in, {:?} in all, page {} bytes",
        begun.elapsed(),
        html.len()
    );
    assert!(html.len() < 8_000_000, "{}", html.len());
}
