//! A stream follows another one: frames at once, entries late, and the same bits in the end.

use isotherm_correction::operation::{Command, State};
use isotherm_correction::sample::{ChannelName, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::units::{Span, Timestamp};

use super::*;
use crate::codec;
use crate::raw::{GyroBatch, TemperatureBatch};

const TICK_NS: u64 = 5_000_000;

fn id() -> UnitId {
    UnitId::new("U-1").unwrap()
}

fn frame(sequence: u64) -> Vec<u8> {
    let tick = GyroTick {
        sequence,
        end_time: Timestamp::from_ns(i64::try_from(sequence * TICK_NS).unwrap()),
        duration: Span::from_ms(5),
        readings: [1, 2, 3]
            .map(|reading| f64::from(u32::try_from(sequence).unwrap() + reading))
            .into_iter()
            .collect(),
        ..GyroTick::default()
    };
    codec::encode(&GyroBatch { output: OutputKind::Counts, ticks: vec![tick] }).unwrap()
}

/// The service that is followed.
struct Leader {
    stream: UnitStream,
    number: u64,
    out: Vec<Vec<u8>>,
}

impl Leader {
    fn new() -> Self {
        Self { stream: UnitStream::new(id(), UnitSettings::default()), number: 0, out: Vec::new() }
    }

    fn take(&mut self, sequence: u64) {
        self.stream.receive(GYRO, &frame(sequence)).unwrap();
        take_frames(&mut self.stream, &mut self.out);
    }

    fn entry(&self, event: JournalEvent) -> JournalEntry {
        let (unit, instance) = (id().to_string(), "leader".to_owned());
        JournalEntry { unit, instance, number: self.number, heard: self.stream.heard(), event }
    }

    fn command(&mut self, command: &Command) -> JournalEntry {
        let accepted = self.stream.command(command).is_ok();
        take_frames(&mut self.stream, &mut self.out);
        self.number += 1;
        self.entry(JournalEvent::Commanded { command: command.clone(), accepted, words: String::new() })
    }

    fn memory(&self) -> JournalEntry {
        self.entry(JournalEvent::Memory { memory: self.stream.memory(), document: None, pending: None })
    }
}

fn take_frames(stream: &mut UnitStream, into: &mut Vec<Vec<u8>>) {
    let mut frame = Vec::new();
    while stream.next_frame(&mut frame).is_some() {
        into.push(std::mem::take(&mut frame));
    }
}

/// The service that follows.
struct Standby {
    stream: UnitStream,
    follower: Follower,
    now_ns: u64,
}

impl Standby {
    fn new() -> Self {
        Self {
            stream: UnitStream::new(id(), UnitSettings::default()),
            follower: Follower::new(id(), Default::default()),
            now_ns: 1,
        }
    }

    fn take(&mut self, sequence: u64) {
        self.now_ns += TICK_NS;
        let frame = frame(sequence);
        self.follower.frame(GYRO, self.now_ns, &frame);
        self.stream.receive(GYRO, &frame).unwrap();
        take_frames(&mut self.stream, &mut Vec::new());
        assert!(!self.go_on());
    }

    /// Whether the memory must be asked for anew.
    fn go_on(&mut self) -> bool {
        let (rebuilt, stuck) = self.follower.advance(&self.stream, 0, self.now_ns);
        if let Some(rebuilt) = rebuilt {
            assert!(rebuilt.exact);
            self.stream = rebuilt.stream;
        }
        stuck
    }

    fn entry(&mut self, entry: JournalEntry) -> bool {
        self.follower.entry(entry, self.now_ns) && !self.go_on()
    }
}

/// A leader and a standby that has joined in the middle.
fn joined() -> (Leader, Standby) {
    let (mut leader, mut standby) = (Leader::new(), Standby::new());
    for sequence in 0..500 {
        leader.take(sequence);
        if sequence >= 300 {
            standby.take(sequence);
        }
        if sequence == 400 {
            assert!(standby.entry(leader.memory()));
        }
    }
    assert!(standby.follower.has_joined());
    assert_eq!(standby.stream.memory(), leader.stream.memory());
    (leader, standby)
}

#[test]
fn whoever_joins_by_a_memory_is_the_same_to_the_bit_from_there_on() {
    let (mut leader, mut standby) = joined();
    for sequence in 500..2000 {
        leader.take(sequence);
        standby.take(sequence);
    }
    assert_eq!(standby.stream.memory(), leader.stream.memory());
}

#[test]
fn an_entry_that_comes_late_takes_effect_at_its_place() {
    let (mut leader, mut standby) = joined();
    let mut late = Vec::new();
    for sequence in 500..3000 {
        if sequence % 150 == 7 {
            late.push((sequence + sequence % 41, leader.command(&Command::Standby)));
        } else if sequence % 150 == 60 {
            late.push((sequence + sequence % 41, leader.command(&Command::Run { reversal: None })));
        }
        leader.take(sequence);
        standby.take(sequence);
        while late.first().is_some_and(|(at, _)| *at <= sequence) {
            assert!(standby.entry(late.remove(0).1));
        }
    }
    for (_, entry) in late {
        assert!(standby.entry(entry));
    }
    assert_eq!(standby.stream.memory(), leader.stream.memory());
}

#[test]
fn an_entry_counts_once_whatever_another_instance_says_under_its_number() {
    let (mut leader, mut standby) = (Leader::new(), Standby::new());
    for sequence in 0..10 {
        leader.take(sequence);
        standby.take(sequence);
    }
    let memory = leader.memory();
    let order = leader.command(&Command::Standby);
    let other = JournalEntry { instance: "other".to_owned(), ..order.clone() };
    assert_eq!([order.clone(), other, order].map(|entry| standby.entry(entry)), [true, true, false]);
    assert!(standby.entry(memory));
    for sequence in 10..20 {
        leader.take(sequence);
        standby.take(sequence);
    }
    assert!(standby.follower.has_joined());
    assert_eq!(standby.stream.memory(), leader.stream.memory());
}

#[test]
fn an_entry_that_comes_before_its_frames_waits_for_them() {
    let (mut leader, mut standby) = joined();
    for sequence in 500..600 {
        leader.take(sequence);
    }
    assert!(standby.entry(leader.command(&Command::Standby)));
    assert!(standby.follower.is_waiting());
    for sequence in 600..650 {
        leader.take(sequence);
    }
    for sequence in 500..650 {
        standby.take(sequence);
    }
    assert!(!standby.follower.is_waiting());
    assert_eq!(standby.stream.memory(), leader.stream.memory());
}

#[test]
fn a_frame_that_was_lost_is_found_out_with_the_next_entry() {
    let (mut leader, mut standby) = joined();
    for sequence in 500..600 {
        leader.take(sequence);
        if sequence != 550 {
            standby.take(sequence);
        }
    }
    standby.entry(leader.command(&Command::Standby));
    assert!(standby.follower.is_waiting(), "its frames may still come");
    standby.now_ns += 2 * LONGEST_WAIT_NS;
    assert!(standby.go_on(), "the memory is to be asked for anew");
    assert!(!standby.follower.has_joined());
    assert!(standby.entry(leader.memory()));
}

#[test]
fn an_order_that_waits_for_lost_frames_holds_when_the_leader_is_gone() {
    for joins in [true, false] {
        let (mut leader, mut standby) = joined();
        if !joins {
            standby.follower.lose();
        }
        for sequence in 500..600 {
            leader.take(sequence);
            if sequence != 550 {
                standby.take(sequence);
            }
        }
        standby.entry(leader.command(&Command::Standby));
        assert_ne!(standby.stream.unit().state(), State::Standby);
        let Standby { mut stream, follower, .. } = standby;
        if let Some(rebuilt) = follower.finish(&mut stream) {
            stream = rebuilt.stream;
        }
        assert_eq!(stream.unit().state(), State::Standby, "{joins}");
    }
}

/// A thermometer is read every few seconds: what was heard before the following began is not waited for.
#[test]
fn whoever_has_heard_what_the_memory_has_joins_at_once() {
    let reading = TemperatureReading {
        channel: ChannelName::from("gyro").unwrap(),
        time: Timestamp::from_ns(0),
        raw: 20.0,
    };
    let thermal = codec::encode(&TemperatureBatch { readings: vec![reading] }).unwrap();
    let temperature = Input::Raw(RawStream::Temperature);
    for (has_heard, joins) in [(true, true), (false, false)] {
        let (mut leader, mut standby) = (Leader::new(), Standby::new());
        leader.stream.receive(temperature, &thermal).unwrap();
        if has_heard {
            standby.stream.receive(temperature, &thermal).unwrap();
        }
        for sequence in 0..5 {
            leader.take(sequence);
            standby.take(sequence);
        }
        standby.follower = Follower::new(id(), standby.stream.heard());
        for sequence in 5..10 {
            leader.take(sequence);
            standby.take(sequence);
        }
        let memory = leader.memory();
        standby.take(10);
        leader.take(10);
        assert!(standby.entry(memory));
        standby.take(11);
        leader.take(11);
        assert_eq!(standby.follower.has_joined(), joins);
        if joins {
            assert_eq!(standby.stream.memory(), leader.stream.memory());
        }
    }
}
