use std::sync::Mutex;
use std::time::Duration;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::sample::{AccelTick, GyroTick, LasingMode, OutputKind, TemperatureReading};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec::{decode, encode};
use isotherm_protocol::corrected::{CorrectedBatch, Revision};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::document::Document;
use isotherm_protocol::raw::{AccelBatch, GyroBatch, TemperatureBatch};
use isotherm_protocol::stream::Label;

use super::*;
use crate::UnitTotals;
use crate::control::compressed::Compressed;
use crate::control::document::Document as Compiled;
use crate::control::revision::Revision as Given;

mod journal;
mod speech;

/// Frames of a tick: three gyros or three accelerometers, ticks of 5 ms.
fn frames(sequence: u64) -> [(RawStream, Vec<u8>); 2] {
    let end_time = Timestamp::from_ns(i64::try_from(sequence + 1).unwrap() * 5_000_000);
    let duration = Span::from_ms(5);
    let readings: isotherm_correction::sample::Readings = [1.0, 2.0, 3.0].into_iter().collect();
    let accel = AccelTick { sequence, end_time, duration, readings };
    let gyro = GyroTick { sequence, end_time, duration, readings, ..GyroTick::default() };
    [
        (RawStream::Accel, encode(&AccelBatch { output: OutputKind::Counts, ticks: vec![accel] }).unwrap()),
        (RawStream::Gyro, encode(&GyroBatch { output: OutputKind::Counts, ticks: vec![gyro] }).unwrap()),
    ]
}

/// What an outlet was given.
#[derive(Debug, Clone, Default)]
struct Sink(Arc<Mutex<Vec<CorrectedBatch>>>);

impl Sink {
    fn outlet(&self) -> Outlet {
        let taken = Arc::clone(&self.0);
        Box::new(move |frame| {
            taken.lock().unwrap().push(decode(&frame)?);
            Ok(())
        })
    }

    fn sequences(&self) -> Vec<u64> {
        self.0.lock().unwrap().iter().flat_map(|batch| batch.ticks.iter().map(|tick| tick.sequence)).collect()
    }
}

fn actor(outlet: Outlet) -> UnitActor {
    let tail_flush = Duration::from_millis(100);
    UnitActor::new(UnitId::new("U-1").unwrap(), UnitSettings::default(), tail_flush, outlet)
}

const EXAMPLE: &str = include_str!("../../../../config/calibration/example-full.toml");

fn example() -> (Arc<Calibration>, [u8; 8]) {
    let parsed = Document::parse(EXAMPLE, None).unwrap();
    (Arc::new(parsed.calibration), parsed.digest.head())
}

/// The example with its text, and an overlay or none.
fn compiled(overlay: Option<Digest>) -> Arc<Compiled> {
    let parsed = Document::parse(EXAMPLE, None).unwrap();
    let label = Label { overlay, ..Label::of(&parsed.document, parsed.digest, "") };
    Arc::new(Compiled::new(Arc::new(parsed.calibration), label, Compressed::new(EXAMPLE.as_bytes())))
}

/// Gives a unit a calibration from the next tick on, as the next revision.
fn install(actor: &mut UnitActor, calibration: Arc<Calibration>, digest: [u8; 8]) -> Revision {
    let revision = Revision { counter: actor.stream.next_counter(), digest };
    let next = Arc::new(Given::plain(revision, calibration));
    actor.change(Change { next, at: Schedule::NextTick, slew: Span::ZERO });
    revision
}

#[test]
fn each_tick_goes_out_with_the_frame_that_completes_it() {
    let sink = Sink::default();
    let mut actor = actor(sink.outlet());
    for sequence in 0..30 {
        for (stream, frame) in frames(sequence) {
            actor.receive(stream, &frame, Instant::now());
        }
        // The first tick waits out the pairing window of 50 ms: an earlier one may still be on its way.
        let out = if sequence < 10 { 0 } else { sequence + 1 };
        assert_eq!(sink.sequences(), (0..out).collect::<Vec<_>>());
    }
    let totals = actor.totals();
    assert_eq!((totals.ticks_in, totals.ticks_out, totals.bad, totals.unpublished), (30, 30, 0, 0));
    assert!(totals.added_latency_p50_ns > 0);
}

#[test]
fn a_bad_frame_is_counted_by_its_kind_and_changes_nothing_else() {
    let (clean, dirty) = (Sink::default(), Sink::default());
    let (mut first, mut second) = (actor(clean.outlet()), actor(dirty.outlet()));
    for (stream, frame) in (0..20).flat_map(frames) {
        first.receive(stream, &frame, Instant::now());
        second.receive(stream, &[0; 3], Instant::now());
        let mut flipped = frame.clone();
        flipped[5] ^= 1;
        second.receive(stream, &flipped, Instant::now());
        second.receive(RawStream::Temperature, &frame, Instant::now());
        second.receive(stream, &frame, Instant::now());
    }
    assert_eq!(*clean.0.lock().unwrap(), *dirty.0.lock().unwrap());
    let status = second.status("test");
    for (name, value) in
        [("bad_frames", 120), ("bad_frames_length", 40), ("bad_frames_checksum", 40), ("bad_frames_kind", 40)]
    {
        let counter = status.counters.iter().find(|counter| counter.name == name);
        assert_eq!(counter.map(|counter| counter.value), Some(value), "{name}");
    }
    assert_eq!(second.totals().bad, 120);
    assert_eq!(dirty.sequences().len(), 20);
    assert!(status.last_fault.is_some());
}

#[test]
fn a_channel_that_the_calibration_does_not_have_is_named_while_one_of_its_own_is_silent() {
    let mut actor = actor(Sink::default().outlet());
    let laser = Document::parse(include_str!("../../../../config/calibration/ZLG-0001.toml"), None).unwrap();
    install(&mut actor, Arc::new(laser.calibration), [1; 8]);
    let temperatures = |time_ms: i64, channels: &[&str]| {
        // In volts: 25 °C.
        let (time, raw) = (Timestamp::from_ns(time_ms * 1_000_000), 1.75);
        let reading = |name: &&str| TemperatureReading { channel: name.parse().unwrap(), time, raw };
        encode(&TemperatureBatch { readings: channels.iter().map(reading).collect() }).unwrap()
    };
    let mut feed = |from: i64, channels: &[&str]| {
        for sequence in from..from + 40 {
            actor.receive(RawStream::Temperature, &temperatures(sequence * 5, channels), Instant::now());
            for (stream, frame) in frames(u64::try_from(sequence).unwrap()) {
                actor.receive(stream, &frame, Instant::now());
            }
        }
        let faults = actor.status("test").faults;
        faults.into_iter().find(|fault| fault.kind == "unknown_temperature_channel")
    };
    let others = ["gyro1", "gyro2", "accel0", "accel1", "accel2", "board", "housing"];
    let with = |more: &[&'static str]| [&others, more].concat();
    assert_eq!(feed(0, &with(&["gyro0"])), None);
    // One more than the calibration asks for does no harm.
    assert_eq!(feed(40, &with(&["gyro0", "case"])), None);
    let fault = feed(4000, &with(&["Gyro0"])).expect("gyro0 is silent");
    let named = ["case, Gyro0", "gyro0"].iter().all(|names| fault.first.contains(names));
    assert!(named && fault.count >= 40, "{fault:?}");
    assert_eq!(feed(4040, &with(&["gyro0"])), None);
}

#[test]
fn readings_that_the_calibration_cannot_take_are_a_fault_with_its_reason() {
    let mut actor = actor(Sink::default().outlet());
    let mems = Document::parse(include_str!("../../../../config/calibration/MEMS-0001.toml"), None).unwrap();
    install(&mut actor, Arc::new(mems.calibration), [1; 8]);
    let mut look = |sequences: std::ops::Range<u64>| {
        for (stream, frame) in sequences.flat_map(frames) {
            actor.receive(stream, &frame, Instant::now());
        }
        actor.measure_rates(Instant::now());
        actor.status("test").faults.into_iter().find(|fault| fault.kind == "ticks_unfit")
    };
    assert_eq!(look(0..0), None);
    let fault = look(0..30).expect("counts where means belong");
    assert!(fault.count >= 30, "{fault:?}");
    insta::assert_snapshot!(fault.first);
    assert_eq!(look(0..0).map(|again| again.count), Some(fault.count));
    assert!(look(30..40).is_some_and(|more| more.count >= fault.count + 10));
}

#[test]
fn an_outlet_that_fails_costs_its_ticks_and_they_are_counted() {
    let mut actor = actor(Box::new(|_| Err("closed".into())));
    for (stream, frame) in (0..20).flat_map(frames) {
        actor.receive(stream, &frame, Instant::now());
    }
    assert_eq!((actor.totals().ticks_in, actor.totals().unpublished), (20, 20));
    assert_eq!(actor.status("test").last_fault.as_deref(), Some("corrected: closed"));
}

#[test]
fn what_waits_goes_out_when_the_stream_has_stopped_and_not_before() {
    let sink = Sink::default();
    let mut actor = actor(sink.outlet());
    let start = Instant::now();
    let [_, (stream, frame)] = frames(0);
    actor.receive(stream, &frame, start);
    actor.tend(start + Duration::from_millis(900));
    assert_eq!(sink.sequences(), [0; 0], "the accelerometer tick may still come");
    actor.tend(start + Duration::from_secs(1));
    assert_eq!(sink.sequences(), [0]);
}

#[test]
fn a_reset_keeps_the_calibration_its_revision_and_the_counts() {
    let sink = Sink::default();
    let mut actor = actor(sink.outlet());
    let (calibration, digest) = example();
    install(&mut actor, Arc::clone(&calibration), digest);
    let revision = install(&mut actor, calibration, digest);
    assert_eq!((revision.counter, revision.digest), (2, digest));
    for (stream, frame) in (0..3).flat_map(frames) {
        actor.receive(stream, &frame, Instant::now());
    }
    let before = actor.totals();
    actor.take_status_due();
    actor.reset("a test says so");
    assert!(actor.take_status_due());
    assert_eq!(actor.status("test").revision(), revision);
    assert_eq!(UnitTotals { alarms: 1, ..before }, actor.totals());
    for (stream, frame) in (3..5).flat_map(frames) {
        actor.receive(stream, &frame, Instant::now());
    }
    assert_eq!(actor.totals().ticks_in, before.ticks_in + 2);
}

#[test]
fn a_reset_keeps_a_change_that_waits_and_the_state() {
    let sink = Sink::default();
    let mut actor = actor(sink.outlet());
    let (calibration, digest) = example();
    install(&mut actor, Arc::clone(&calibration), digest);
    actor.command(&Command::Standby).unwrap();
    let revision = Revision { counter: 2, digest: [9; 8] };
    let label = Label { digest: Some(Digest([9; 32])), ..Label::default() };
    let document = Arc::new(Compiled::new(calibration, label, Compressed::new(b"")));
    let next = Arc::new(Given { number: revision, document, source: String::new() });
    actor.change(Change { next, at: Schedule::Sequence(70), slew: Span::ZERO });
    actor.reset("a test says so");
    assert_eq!(actor.waiting(), Some((2, Schedule::Sequence(70))));
    let pending = actor.stream.unit().pending().map(|(counter, _)| counter);
    assert_eq!(
        (actor.present().state, actor.stream.revision().counter, pending),
        (State::Standby, 1, Some(2))
    );
}

#[test]
fn a_revision_that_was_given_already_is_passed_over() {
    let sink = Sink::default();
    let mut actor = actor(sink.outlet());
    let (calibration, digest) = example();
    let revision = Revision { counter: 4, digest };
    let next = Arc::new(Given::plain(revision, calibration));
    let change = Change { next, at: Schedule::NextTick, slew: Span::ZERO };
    actor.change(change.clone());
    actor.take_status_due();
    assert_eq!(actor.change(change), None);
    assert!(!actor.take_status_due());
    assert_eq!(actor.stream.revision().counter, 4);
}

#[test]
fn a_frame_that_comes_twice_is_a_duplicate_and_other_ticks_of_the_same_numbers_are_a_second_producer() {
    let frame = |sequence, mode| {
        let [_, (stream, frame)] = frames(sequence);
        let mut batch: GyroBatch = decode(&frame).unwrap();
        batch.ticks[0].mode = mode;
        (stream, encode(&batch).unwrap())
    };
    for (mode, is_alarm) in [(None, false), (Some(LasingMode::Plus), true)] {
        let mut actor = actor(Sink::default().outlet());
        for sequence in 0..100 {
            // Late by three frames.
            for (sequence, mode) in [(Some(sequence), None), (u64::checked_sub(sequence, 3), mode)] {
                let Some((stream, frame)) = sequence.map(|sequence| frame(sequence, mode)) else { continue };
                actor.receive(stream, &frame, Instant::now());
            }
        }
        actor.measure_rates(Instant::now());
        let status = actor.status("test");
        let counted = status.counters.iter().find(|counter| counter.name == "gyro_duplicates");
        assert_eq!(counted.map(|counter| counter.value), Some(97));
        assert_eq!(status.faults.iter().any(|fault| fault.kind == "two_producers"), is_alarm, "{mode:?}");
    }
}
