//! A service and a recorder beside it, and what a replica makes of what was recorded.

use isotherm_correction::operation::Command;
use isotherm_correction::sample::{
    AccelTick, ChannelName, GyroTick, OutputKind, Readings, TemperatureReading,
};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec::encode;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::journal::{JournalEvent, split};
use isotherm_protocol::key::RawStream;
use isotherm_protocol::raw::{AccelBatch, GyroBatch, TemperatureBatch};

use super::super::*;
use crate::diff::{Account, Comparison, DiffOptions, LogTick, Side, ticks_of};
use crate::offline::unit_id;

pub(super) const DOCUMENT: &str = include_str!("../../../../config/calibration/MEMS-0001.toml");
const TICK_NS: u64 = 10_000_000;

/// What becomes of a frame on its way.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Way {
    Both,
    Service,
    Recorder,
    Twice,
}

/// A unit in a service, and a recorder.
pub(super) struct Session {
    pub(super) service: UnitStream,
    pub(super) instance: &'static str,
    pub(super) number: u64,
    pub(super) now_ns: u64,
    pub(super) sequence: u64,
    /// How much later raw frames are recorded than entries and corrected frames (ns).
    pub(super) raw_later_ns: i64,
    /// How many times as fast as the ticks' own time it goes.
    pub(super) speed: u64,
    pub(super) recorded: Vec<Message>,
    pub(super) way: fn(Input, u64) -> Way,
}

impl Session {
    pub(super) fn new() -> Self {
        let mut session = Self {
            service: UnitStream::new(unit_id("MEMS-0001").unwrap(), UnitSettings::default()),
            instance: "one",
            number: 0,
            now_ns: 1_800_000_000_000_000_000,
            sequence: 0,
            raw_later_ns: 0,
            speed: 1,
            recorded: Vec::new(),
            way: |_, _| Way::Both,
        };
        session.begin();
        session
    }

    pub(super) fn begin(&mut self) {
        self.act(JournalEvent::Began { settings: UnitSettings::default(), highest_revision: 0 });
        self.swap(DOCUMENT, Schedule::NextTick, 0);
    }

    fn record(&mut self, topic: Topic, frame: Vec<u8>, later_ns: i64) {
        let received_ns = self.now_ns.saturating_add_signed(later_ns);
        self.recorded.push(Message { topic, received_ns, frame });
    }

    pub(super) fn id(&self) -> UnitId {
        self.service.id().clone()
    }

    /// Does something beside the frames, and tells of it.
    pub(super) fn act(&mut self, event: JournalEvent) {
        let heard = self.service.heard();
        self.service.carry_out(&event).unwrap();
        self.number += 1;
        self.tell(heard, event);
        self.publish();
    }

    fn tell(&mut self, heard: [isotherm_protocol::stream::Heard; 5], event: JournalEvent) {
        let (unit, instance) = (self.id().to_string(), self.instance.to_owned());
        let entry = JournalEntry { unit, instance, number: self.number, heard, event };
        for part in split(&entry) {
            self.record(Topic::Journal(self.id()), encode(&part).unwrap(), 0);
        }
    }

    /// Answers a recorder that asks.
    pub(super) fn memory(&mut self) {
        let event = JournalEvent::Memory { memory: self.service.memory(), document: None, pending: None };
        self.tell(self.service.heard(), event);
    }

    pub(super) fn swap(&mut self, document: &str, at: Schedule, slew_ns: i64) {
        let digest = Digest::of(document.as_bytes()).head();
        let revision = Revision { counter: self.service.next_counter(), digest };
        let document = Some(document.to_owned());
        self.act(JournalEvent::Changed {
            revision,
            at,
            slew_ns,
            document,
            overlay: None,
            source: "test".into(),
        });
    }

    fn publish(&mut self) {
        let mut frame = Vec::new();
        while self.service.next_frame(&mut frame).is_some() {
            self.record(Topic::Corrected(self.id()), frame.clone(), 0);
        }
        while self.service.take_in_force().is_some() {}
    }

    fn frame(&mut self, stream: RawStream, frame: &[u8]) {
        let way = (self.way)(Input::Raw(stream), self.sequence);
        let (hears, records) = match way {
            Way::Both => (1, 1),
            Way::Service => (1, 0),
            Way::Recorder => (0, 1),
            Way::Twice => (2, 2),
        };
        for _ in 0..records {
            self.record(Topic::Raw(self.id(), stream), frame.to_vec(), self.raw_later_ns);
        }
        for _ in 0..hears {
            self.service.receive(stream, frame).unwrap();
        }
        self.publish();
    }

    /// The next ticks, with a temperature every half second.
    pub(super) fn ticks(&mut self, count: u64) {
        for _ in 0..count {
            let sequence = self.sequence;
            let end_time = Timestamp::from_ns(i64::try_from((sequence + 1) * TICK_NS).unwrap());
            let (output, duration) = (OutputKind::Mean, Span::from_ns(TICK_NS.cast_signed()));
            let wobble = |scale: f64| -> Readings {
                (0..3)
                    .map(|axis| scale * f64::from(u32::try_from((sequence * 7919 + axis) % 97).unwrap()))
                    .collect()
            };
            if sequence.is_multiple_of(50) {
                let names = ["gyro0", "gyro1", "gyro2", "accel0", "accel1", "accel2", "board", "housing"];
                let reading = |(name, n): (&str, u32)| TemperatureReading {
                    channel: ChannelName::from(name).unwrap(),
                    time: end_time,
                    raw: 30.0 + 0.001 * f64::from(u32::try_from(sequence).unwrap()) + f64::from(n),
                };
                let batch = TemperatureBatch { readings: names.into_iter().zip(0..).map(reading).collect() };
                self.frame(RawStream::Temperature, &encode(&batch).unwrap());
            }
            let tick = AccelTick { sequence, end_time, duration, readings: wobble(0.01) };
            self.frame(RawStream::Accel, &encode(&AccelBatch { output, ticks: vec![tick] }).unwrap());
            let readings = wobble(1e-4);
            let tick = GyroTick { sequence, end_time, duration, readings, series: 1, ..GyroTick::default() };
            let batch = GyroBatch { output, ticks: vec![tick] };
            self.frame(RawStream::Gyro, &encode(&batch).unwrap());
            self.sequence += 1;
            self.now_ns += TICK_NS / self.speed;
        }
    }

    /// Forgets what was recorded so far, and asks for the memory, as a recorder that comes later.
    pub(super) fn recorder_comes(&mut self) {
        self.recorded.clear();
        self.ticks(3);
        self.memory();
    }

    fn flush(&mut self) {
        assert!(self.service.is_waiting());
        self.act(JournalEvent::Flushed);
    }

    /// What was recorded, in the order of reception.
    pub(super) fn recording(&self) -> Vec<Message> {
        let mut recorded = self.recorded.clone();
        recorded.sort_by_key(|message| message.received_ns);
        recorded
    }
}

/// The document with another constant of its first gyro.
pub(super) fn other(constant: &str) -> String {
    let text = DOCUMENT.replacen(
        "coefficients_deg_per_h = [90.0,",
        &format!("coefficients_deg_per_h = [{constant},"),
        1,
    );
    assert_ne!(text, DOCUMENT);
    text
}

fn outline(recording: &[Message]) -> Outline {
    let mut joiner = Joiner::new();
    let journal = recording.iter().filter(|message| matches!(message.topic, Topic::Journal(_)));
    let entries = journal
        .filter_map(|message| Some((join(&mut joiner, &message.frame).unwrap()?, message.received_ns)));
    Outline::new(entries.map(|(entry, received_ns)| Mark::of(&entry, received_ns)).collect())
}

/// Makes the unit again, and compares with what was published.
pub(super) fn replay(recording: &[Message], changes: Changes) -> (Account, ReplicaReport) {
    let mut replica = Replica::new(unit_id("MEMS-0001").unwrap(), outline(recording), changes);
    let mut comparison = Comparison::new(DiffOptions::default(), false);
    let mut made = Vec::new();
    for message in recording.iter().cloned().map(Some).chain([None]) {
        match message {
            Some(message) => {
                if let Topic::Corrected(_) = &message.topic {
                    let ticks = ticks_of(codec::decode(&message.frame).unwrap()).unwrap();
                    ticks.ticks.into_iter().for_each(|tick| comparison.push(Side::B, tick));
                }
                replica.take(message);
            }
            None => replica.finish(),
        }
        while replica.step(&mut |stream| made.extend(stream.take_ready())).is_some() {
            made.extend(replica.stream_mut().map(UnitStream::take_ready).unwrap_or_default());
        }
        for tick in made.drain(..) {
            comparison.push(Side::A, LogTick { tick, ..LogTick::default() });
        }
    }
    let report = replica.report().clone();
    (comparison.finish(), report)
}

pub(super) fn kinds(report: &ReplicaReport) -> Vec<&'static str> {
    report.notices.iter().map(Notice::kind).collect()
}

/// A session with something of everything.
pub(super) fn lively(session: &mut Session) {
    session.ticks(300);
    session.swap(&other("91.0"), Schedule::NextTick, 0);
    session.ticks(120);
    session.swap(&other("89.0"), Schedule::Sequence(session.sequence + 40), 0);
    session.swap(&other("88.5"), Schedule::Sequence(session.sequence + 30), 500_000_000);
    session.ticks(200);
    let command = |command| JournalEvent::Commanded { command, accepted: true, words: String::new() };
    session.act(command(Command::Standby));
    session.ticks(20);
    session.act(command(Command::Run { reversal: None }));
    session.ticks(150);
    session.way = |input, sequence| match (input, sequence % 10) {
        (Input::Raw(RawStream::Gyro), 3) | (Input::Raw(RawStream::Accel), 7) => Way::Twice,
        _ => Way::Both,
    };
    session.ticks(200);
    session.way = |_, _| Way::Both;
    // A tick that waits for its accelerometer, in a stream that has stopped.
    session.way = |input, _| if input == Input::Raw(RawStream::Accel) { Way::Recorder } else { Way::Both };
    session.recorded_only_gyro();
    session.flush();
    session.way = |_, _| Way::Both;
    session.memory();
    session.ticks(100);
    session.memory();
    session.act(JournalEvent::Ended);
}

impl Session {
    /// One tick whose accelerometer tick neither service nor recorder gets.
    fn recorded_only_gyro(&mut self) {
        let before = self.recorded.len();
        self.ticks(1);
        let mut number = 0;
        self.recorded.retain(|message| {
            number += 1;
            number <= before || !matches!(message.topic, Topic::Raw(_, RawStream::Accel))
        });
    }
}
