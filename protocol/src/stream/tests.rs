use isotherm_correction::earth::Place as Site;
use isotherm_correction::operation::Command;
use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_correction::sample::{ChannelName, LasingMode, Readings};
use isotherm_correction::units::Timestamp;

use super::status::reason;
use super::*;
use crate::codec::encode;
use crate::control::Schedule;
use crate::corrected::CorrectedBatch;
use crate::digest::Digest;
use crate::document::Document;
use crate::journal::JournalEvent;
use crate::raw::{AccelBatch, GyroBatch};
use crate::raw::{HealthReading as WireReading, HealthTick, TemperatureBatch};
use crate::status::{Output, Place, PreLaunchVerdict, SensorKind, State as WireState, Status};

const FULL: &str = include_str!("../../../config/calibration/example-full.toml");
const TICK_NS: i64 = 5_000_000;

fn stream() -> UnitStream {
    UnitStream::new(UnitId::new("U-1").unwrap(), UnitSettings::default())
}

fn full() -> (Arc<Calibration>, Label) {
    let parsed = Document::parse(FULL, None).unwrap();
    let label = Label::of(&parsed.document, parsed.digest, "a test");
    (Arc::new(parsed.calibration), label)
}

fn end(sequence: u64) -> Timestamp {
    Timestamp::from_ns((i64::try_from(sequence).unwrap() + 1) * TICK_NS)
}

/// Ticks of one number for the full example: temperatures, accelerometers, gyros.
fn tick(stream: &mut UnitStream, series: u64, sequence: u64) {
    let (calibration, _) = full();
    // A reading that stands still is that of a dead sensor.
    let wobble = if sequence.is_multiple_of(2) { 1.0 } else { 2.0 };
    let readings = |count: usize| -> Readings { (0..count).map(|_| wobble).collect() };
    if sequence.is_multiple_of(200) {
        let channels = ["block", "coil", "accel", "board"].map(|name| ChannelName::from(name).unwrap());
        let time = Timestamp::from_ns(end(sequence).as_ns() - TICK_NS);
        let readings = channels.into_iter().zip([1.8, 25.0, 4770.0, 72.5]);
        let readings = readings.map(|(channel, raw)| TemperatureReading { channel, time, raw });
        let batch = TemperatureBatch { readings: readings.collect() };
        stream.receive(RawStream::Temperature, &encode(&batch).unwrap()).unwrap();
    }
    let duration = Span::from_ns(TICK_NS);
    let accel = AccelTick {
        sequence,
        end_time: end(sequence),
        duration,
        readings: readings(calibration.accel_count()),
    };
    let batch = AccelBatch { output: calibration.accel_output(), ticks: vec![accel] };
    stream.receive(RawStream::Accel, &encode(&batch).unwrap()).unwrap();
    let gyro = GyroTick {
        sequence,
        end_time: end(sequence),
        duration,
        readings: readings(calibration.gyro_count()),
        mode: Some(LasingMode::Plus),
        series,
        ..GyroTick::default()
    };
    let batch = GyroBatch { output: calibration.gyro_output(), ticks: vec![gyro] };
    stream.receive(RawStream::Gyro, &encode(&batch).unwrap()).unwrap();
}

fn ticks(stream: &mut UnitStream, sequences: std::ops::Range<u64>) {
    sequences.for_each(|sequence| tick(stream, 7, sequence));
}

/// Every batch that is ready.
fn batches(stream: &mut UnitStream) -> Vec<CorrectedBatch> {
    let mut frame = Vec::new();
    let mut batches = Vec::new();
    while stream.next_frame(&mut frame).is_some() {
        batches.push(codec::decode(&frame).unwrap());
    }
    batches
}

fn status(stream: &UnitStream) -> Status {
    let status = stream.status(Edge { now_unix_s: Some(1_800_000_000), ..Edge::default() });
    // Whatever it says can go out.
    assert_eq!(codec::decode::<Status>(&encode(&status).unwrap()).unwrap(), status);
    status
}

#[test]
fn a_swap_at_a_sequence_number_is_announced_and_takes_effect_there() {
    let mut stream = stream().with_revision(40);
    let (calibration, label) = full();
    assert_eq!(stream.install(Arc::clone(&calibration), [1; 8]).counter, 41);
    ticks(&mut stream, 0..30);
    let other = Label { digest: Some(Digest([2; 32])), source: "bus".to_owned(), ..label };
    let change = |revision, sequence| Change {
        calibration: Arc::clone(&calibration),
        revision,
        at: At::Sequence(sequence),
        slew: Span::from_ms(500),
    };
    assert_eq!(stream.schedule(change(42, 32), other.clone()), None);
    assert_eq!(stream.schedule(change(43, 35), other), Some(42), "one waits, the last");
    let pending = status(&stream).pending.unwrap();
    let revision = Revision { counter: 43, digest: [2; 8] };
    assert_eq!((pending.revision, pending.schedule), (revision, Schedule::Sequence(35)));
    assert_eq!((pending.source.as_str(), pending.slew_s), ("bus", 0.5));
    assert_eq!(stream.revision().counter, 41);

    ticks(&mut stream, 30..40);
    let said = status(&stream);
    assert_eq!((said.pending, said.calibration.unwrap().revision), (None, revision));
    let first = stream.take_in_force().unwrap();
    assert_eq!((first.revision.counter, first.series, first.sequence), (41, 7, 0));
    let second = stream.take_in_force().unwrap();
    let expected = InForce { revision, series: 7, sequence: 35, end_time_ns: end(35).as_ns() };
    assert_eq!((second, stream.take_in_force()), (expected, None));
    let revisions: Vec<_> = batches(&mut stream)
        .iter()
        .map(|batch| (batch.revision.counter, batch.revision.digest, batch.ticks.first().unwrap().sequence))
        .collect();
    assert_eq!(revisions, [(41, [1; 8], 0), (43, [2; 8], 35)]);
    let last = status(&stream).last_tick.unwrap();
    assert_eq!(last, LastTick { end_time_ns: end(39).as_ns(), sequence: 39, series: 7 });
}

#[test]
fn every_frame_says_the_temperatures_and_the_revision_of_its_own_ticks() {
    let (mut stream, (calibration, label)) = (stream(), full());
    let mut seen = Vec::new();
    for sequence in 0..900 {
        if sequence == 100 || sequence == 700 {
            // The second has the counter of the first, and another digest.
            let mut digest = Digest([0; 32]);
            digest.0[0] = u8::try_from(sequence / 100).unwrap();
            let label = Label { digest: Some(digest), ..label.clone() };
            let calibration = Arc::clone(&calibration);
            stream.schedule(Change { calibration, revision: 1, at: At::NextTick, slew: Span::ZERO }, label);
        }
        if sequence == 500 {
            let time = Timestamp::from_ns(end(sequence).as_ns() - TICK_NS);
            let channel = ChannelName::from("coil").unwrap();
            let readings = vec![TemperatureReading { channel, time, raw: 25.1 }];
            let batch = TemperatureBatch { readings };
            stream.receive(RawStream::Temperature, &encode(&batch).unwrap()).unwrap();
        }
        tick(&mut stream, 7, sequence);
        for batch in batches(&mut stream) {
            let said = batch
                .temperatures
                .iter()
                .map(|applied| (applied.channel, applied.temperature_deg_c.to_bits()));
            let said: Vec<_> = said.collect();
            let known =
                stream.unit().temperatures().map(|(name, state)| (*name, state.temperature.to_bits()));
            assert_eq!(said, known.collect::<Vec<_>>(), "tick {sequence}");
            assert_eq!(batch.revision, stream.revision(), "tick {sequence}");
            if seen.last() != Some(&(said.clone(), batch.revision)) {
                seen.push((said, batch.revision));
            }
        }
    }
    assert!(seen.len() >= 4, "temperatures and revisions come and change: {seen:?}");
}

#[test]
fn swaps_without_ticks_leave_nothing_behind() {
    let mut stream = stream();
    let (calibration, label) = full();
    stream.install(Arc::clone(&calibration), [1; 8]);
    ticks(&mut stream, 0..30);
    for _ in 0..1000 {
        let revision = Revision { counter: stream.next_counter(), digest: [3; 8] };
        stream.install_as(Arc::clone(&calibration), revision, label.clone());
        let at = At::Sequence(1_000_000);
        let change = Change {
            calibration: Arc::clone(&calibration),
            revision: stream.next_counter(),
            at,
            slew: Span::ZERO,
        };
        stream.schedule(change, label.clone());
    }
    assert_eq!(stream.revisions.len(), 3, "that of the waiting ticks, the one in force, the one to come");
    assert_eq!(batches(&mut stream).first().unwrap().revision, Revision { counter: 1, digest: [1; 8] });
    ticks(&mut stream, 30..31);
    let batch = batches(&mut stream).pop().unwrap();
    assert_eq!(batch.revision, Revision { counter: 2000, digest: [3; 8] });
    assert_eq!(stream.revisions.len(), 2);
}

#[test]
fn a_status_names_sensors_ranges_and_the_document() {
    let mut stream = stream();
    let before = status(&stream);
    assert_eq!((before.output, before.calibration, before.sensors.len()), (Output::PassThrough, None, 0));
    let (calibration, label) = full();
    let digest = label.digest;
    let revision = Revision { counter: 1, digest: digest.unwrap().head() };
    stream.install_as(calibration, revision, label);
    ticks(&mut stream, 0..450);
    batches(&mut stream);
    let status = status(&stream);
    assert_eq!(status.output, Output::Calibrated);
    let active = status.calibration.unwrap();
    // 2026-11-21T09:30:00+03:00, asked for on 2027-01-15T08:00:00Z.
    assert_eq!((active.revision, active.digest, active.source.as_str()), (revision, digest, "a test"));
    assert_eq!((active.created_unix_s, active.age_s), (Some(1_795_242_600), Some(4_757_400)));

    let names = |kind| -> Vec<_> {
        let sensors = status.sensors.iter().filter(|sensor| sensor.kind == kind);
        sensors.map(|sensor| (sensor.name.as_str(), sensor.ticks)).collect()
    };
    let gyros = ["x", "y", "z", "s"].map(|name| (name, 450));
    assert_eq!(names(SensorKind::Gyro), gyros);
    assert_eq!(status.sensors.len(), gyros.len() + names(SensorKind::Accel).len());
    let places: Vec<_> =
        status.channels.iter().map(|channel| (channel.name.as_str(), channel.place.is_some())).collect();
    assert_eq!(places, [("block", true), ("coil", true), ("accel", true), ("board", true)]);
    let block = status.channels.first().unwrap();
    assert_eq!(
        block.place,
        Place::of(block.temperature_deg_c.unwrap(), block.calibrated_range_deg_c.unwrap())
    );
    assert!(status.channels.iter().any(|channel| channel.place == Some(Place::Above)), "the board");
    assert!(
        status.applied.unwrap().angular_rate_rad_per_s.iter().all(|rate| rate.is_finite() && *rate != 0.0)
    );
    let drift: Vec<_> = status.drift.iter().map(|drift| (drift.gyro.as_str(), drift.updates)).collect();
    assert_eq!(drift, [("x", 0)]);
}

#[test]
fn a_self_test_reports_every_check_in_words() {
    let mut stream = stream();
    let (calibration, label) = full();
    let revision = Revision { counter: 5, digest: [0; 8] };
    stream.install_as(calibration, revision, label);
    ticks(&mut stream, 0..20);
    stream.command(&Command::Standby).unwrap();
    stream.command(&Command::SelfTest).unwrap();
    assert_eq!(status(&stream).state, WireState::SelfTest);
    let parts = Document::parse(FULL, None).unwrap().calibration.self_test().clone();
    let health = |time_ns, counter: f64| {
        let voltages = parts.voltages.iter().map(|v| WireReading { name: v.name, value: v.range_v[0] });
        let counters = parts.counters.iter().map(|c| WireReading { name: c.name, value: counter });
        encode(&HealthBatch {
            ticks: vec![HealthTick { time_ns, readings: voltages.chain(counters).collect() }],
        })
    };
    stream.receive(RawStream::Health, &health(1, 0.0).unwrap()).unwrap();
    stream.receive(RawStream::Health, &health(2, 1e6).unwrap()).unwrap();
    ticks(&mut stream, 20..2030);
    let report = status(&stream).self_test.unwrap();
    assert_eq!((report.ended_ns, report.length_s), (Some(end(2019).as_ns()), 10.0));
    let item =
        |name: &str| report.items.iter().find(|item| item.name == name).unwrap_or_else(|| panic!("{name}"));
    let calibration = item("calibration");
    assert_eq!((calibration.value, calibration.at_least, calibration.at_most), (Some(5.0), Some(1.0), None));
    let gyro = item("gyro x");
    assert_eq!(
        (gyro.at_least, gyro.at_most, gyro.unit_of_measure.as_str()),
        (Some(95.0), Some(100.0), "% alive")
    );
    assert!(gyro.passed);
    for voltage in &parts.voltages {
        assert!(item(&format!("voltage {}", voltage.name)).passed);
    }
    for counter in &parts.counters {
        assert!(!item(&format!("counter {}", counter.name)).passed, "it grew by a million");
    }
    assert!(!parts.voltages.is_empty() && !parts.counters.is_empty());
    assert!(!report.passed);
}

#[test]
fn a_pre_launch_calibration_shows_its_progress_and_its_end() {
    let mut stream = stream();
    let (calibration, label) = full();
    stream.install_as(calibration, Revision { counter: 1, digest: [0; 8] }, label);
    ticks(&mut stream, 0..20);
    let place = Site::new(55.0, 30.0, Some([0.0, 0.0])).unwrap();
    let settings = PreLaunchSettings { place: Some(place), ..PreLaunchSettings::default() };
    stream.command(&Command::Standby).unwrap();
    stream.command(&Command::PreLaunch(settings)).unwrap();
    ticks(&mut stream, 20..120);
    let running = status(&stream);
    let progress = running.pre_launch.unwrap();
    assert!((progress.elapsed_s - 0.5).abs() < 0.1 && progress.duration_s > 59.0, "{progress:?}");
    assert_eq!(
        progress.gyros.iter().map(|gyro| gyro.name.as_str()).collect::<Vec<_>>(),
        ["x", "y", "z", "s"]
    );
    assert_eq!(running.pre_launch_outcome, None);

    stream.command(&Command::Abort).unwrap();
    let ended = stream.unit().observation().unwrap().end_time.as_ns();
    let aborted = status(&stream);
    let outcome = aborted.pre_launch_outcome.unwrap();
    assert_eq!((outcome.verdict, outcome.ended_ns), (PreLaunchVerdict::Aborted, Some(ended)));
    assert_eq!(aborted.pre_launch, None);

    stream.command(&Command::PreLaunch(settings)).unwrap();
    ticks(&mut stream, 120..140);
    stream.end_pre_launch();
    let outcome = status(&stream).pre_launch_outcome.unwrap();
    assert!(
        matches!(&outcome.verdict, PreLaunchVerdict::Refused(reasons) if !reasons.is_empty()),
        "{outcome:?}"
    );
}

#[test]
fn a_refusal_names_the_gyro_as_the_document_does() {
    use isotherm_correction::prelaunch::Refusal;

    let (_, label) = full();
    let refusal = Refusal::TemperatureOutOfRange { gyro: 1, temperature_deg_c: 71.0 };
    insta::assert_snapshot!(reason(&refusal, &label));
    let moved = reason(&Refusal::Restarted, &label);
    assert_eq!(moved, Refusal::Restarted.to_string());
}

#[test]
fn references_are_counted_whatever_becomes_of_them() {
    let mut stream = stream();
    let (calibration, label) = full();
    stream.install_as(calibration, Revision { counter: 1, digest: [0; 8] }, label);
    ticks(&mut stream, 0..1000);
    let reference = |start_ns, end_ns| Reference {
        start_ns,
        end_ns,
        angular_rate_rad_per_s: [0.0; 3],
        sigma_rad_per_s: 1.0,
    };
    let good = encode(&reference(1_000_000_000, 3_000_000_000)).unwrap();
    stream.receive(Input::Reference, &good).unwrap();
    stream.receive(Input::Reference, &encode(&reference(0, 5)).unwrap()).unwrap();
    assert!(stream.receive(Input::Reference, good.split_last().unwrap().1).is_err());
    assert!(encode(&reference(5, 5)).is_err(), "it ends when it starts");
    ticks(&mut stream, 1000..1100);
    let status = status(&stream);
    let counted = ["references_received", "references_used", "references_too_short", "bad_frames"]
        .map(|name| status.counter(name));
    assert_eq!(counted, [2, 1, 1, 1]);
    let drift = status.drift.first().unwrap();
    assert_eq!((drift.updates, drift.last_update_ns), (1, Some(3_000_000_000)));
}

#[test]
fn a_restart_of_the_producer_changes_the_series() {
    let mut stream = stream();
    stream.install(full().0, [1; 8]);
    ticks(&mut stream, 0..30);
    for sequence in 0..30 {
        tick(&mut stream, 8, sequence);
    }
    // Written down in the middle, and read back.
    let mut stream = UnitStream::from_memory(&stream.memory()).unwrap();
    let of_frames: Vec<_> =
        batches(&mut stream).iter().map(|batch| (batch.series, batch.ticks.len())).collect();
    assert_eq!(of_frames, [(7, 30), (8, 30)]);
    let last = status(&stream).last_tick.unwrap();
    assert_eq!((last.series, last.sequence), (8, 29));
}

#[test]
fn a_unit_in_standby_says_so_and_the_first_output_of_a_revision_comes_later() {
    let mut stream = stream();
    stream.install(full().0, [1; 8]);
    stream.command(&Command::Standby).unwrap();
    ticks(&mut stream, 0..30);
    assert_eq!((status(&stream).state, stream.take_in_force()), (WireState::Standby, None));
    stream.command(&Command::Run { reversal: None }).unwrap();
    ticks(&mut stream, 30..31);
    let first = stream.take_in_force().unwrap();
    assert_eq!((first.revision.counter, first.sequence), (1, 30));
    assert_eq!(batches(&mut stream).first().unwrap().ticks.first().unwrap().missed, 30);
}

#[test]
fn a_document_that_is_none_is_refused_in_few_words() {
    let event = JournalEvent::Changed {
        revision: Revision { counter: 1, digest: [0; 8] },
        at: Schedule::NextTick,
        slew_ns: 0,
        document: Some("schema = 1\n".repeat(300)),
        overlay: None,
        source: "a test".to_owned(),
    };
    let words = stream().carry_out(&event).unwrap_err().to_string();
    assert!(words.ends_with(" more") && words.len() < 800 && !words.contains('\n'), "{words}");
}
