//! The journal: who gives a stream the same frames and carries the entries out has the same stream, memory and all.

use isotherm_correction::earth::Place;
use isotherm_correction::prelaunch::PreLaunchSettings;
use isotherm_correction::unit::At;
use isotherm_protocol::journal::{Joiner, JournalEntry, JournalPart};
use isotherm_protocol::key::Input;

use super::*;

/// What a journal was given.
#[derive(Clone, Default)]
struct Tape(Arc<Mutex<(Joiner, Vec<JournalEntry>)>>);

impl Tape {
    fn journal(&self) -> Journal {
        let tape = Arc::clone(&self.0);
        let outlet = Arc::new(move |unit: &UnitId, frame: Vec<u8>| {
            let part: JournalPart = decode(&frame)?;
            assert_eq!(part.unit, unit.as_str());
            let mut tape = tape.lock().unwrap();
            let joined = tape.0.join(part)?;
            tape.1.extend(joined);
            Ok(())
        });
        Journal { instance: "a1".into(), outlet }
    }

    fn take(&self) -> Vec<JournalEntry> {
        std::mem::take(&mut self.0.lock().unwrap().1)
    }
}

/// An actor with a journal, and a stream that follows it.
struct Bench {
    actor: UnitActor,
    tape: Tape,
    follower: UnitStream,
    number: u64,
}

impl Bench {
    fn new() -> Self {
        let (mut actor, tape) = (actor(Sink::default().outlet()), Tape::default());
        let follower = UnitStream::new(actor.id().clone(), UnitSettings::default());
        actor.journal_to(tape.journal());
        let mut bench = Self { actor, tape, follower, number: 0 };
        assert_eq!(bench.follow(), ["began"]);
        bench
    }

    /// Carries out what the journal says, and compares; the events by name.
    fn follow(&mut self) -> Vec<&'static str> {
        let mut names = Vec::new();
        for entry in self.tape.take() {
            self.number += 1;
            assert_eq!((entry.number, &*entry.instance), (self.number, "a1"));
            assert_eq!(entry.heard, self.follower.heard());
            self.follower.carry_out(&entry.event).unwrap();
            names.push(entry.event.name());
        }
        self.same();
        names
    }

    fn frames(&mut self, frames: impl IntoIterator<Item = (RawStream, Vec<u8>)>) {
        for (stream, frame) in frames {
            self.actor.receive(stream, &frame, Instant::now());
            drop(self.follower.receive(stream, &frame));
        }
        self.same();
    }

    /// The actor alone is given frames.
    fn hear(&mut self, frames: impl IntoIterator<Item = (RawStream, Vec<u8>)>) {
        for (stream, frame) in frames {
            self.actor.receive(stream, &frame, Instant::now());
        }
    }

    /// The follower knows exactly what the actor's stream knows.
    fn same(&mut self) {
        self.follower.take_ready();
        while self.follower.take_in_force().is_some() {}
        assert!(self.follower.memory() == self.actor.stream.memory(), "another stream");
    }

    fn change(&mut self, at: Schedule, slew: Span) {
        let next = Given::new(
            self.actor.stream.next_counter(),
            compiled(Some(Digest([3; 32]))),
            &isotherm_protocol::history::Source::Rollback { to: 1 },
        );
        self.actor.change(Change { next: Arc::new(next), at, slew });
    }

    fn command(&mut self, command: &Command) {
        let _ = self.actor.command(command);
    }
}

/// Ticks of the example: four of each sensor.
fn example_frames(sequence: u64) -> [(RawStream, Vec<u8>); 2] {
    let end_time = Timestamp::from_ns(i64::try_from(sequence + 1).unwrap() * 5_000_000);
    let duration = Span::from_ms(5);
    let wobble = f64::from(u32::try_from(sequence % 5).unwrap());
    let readings: isotherm_correction::sample::Readings = [wobble, 2.0, -wobble, 1.0].into_iter().collect();
    let accel = AccelTick { sequence, end_time, duration, readings };
    let gyro = GyroTick { sequence, end_time, duration, readings, ..GyroTick::default() };
    [
        (RawStream::Accel, encode(&AccelBatch { output: OutputKind::Counts, ticks: vec![accel] }).unwrap()),
        (RawStream::Gyro, encode(&GyroBatch { output: OutputKind::Counts, ticks: vec![gyro] }).unwrap()),
    ]
}

fn pre_launch() -> Command {
    let place = Place::new(55.0, 30.0, Some([1.0, 2.0])).unwrap();
    Command::PreLaunch(PreLaunchSettings { place: Some(place), ..PreLaunchSettings::default() })
}

#[test]
fn a_stream_that_follows_the_journal_is_the_same_stream() {
    let mut bench = Bench::new();
    let start = Instant::now();
    bench.frames((0..30).flat_map(example_frames));
    bench.change(Schedule::NextTick, Span::ZERO);
    assert_eq!(bench.follow(), ["changed"]);
    bench.frames((30..60).flat_map(example_frames));
    bench.frames([(RawStream::Gyro, vec![9; 3]), (RawStream::Health, vec![1; 40])]);
    bench.change(Schedule::Sequence(75), Span::from_ms(40));
    bench.command(&Command::Standby);
    bench.command(&pre_launch());
    // Refused, and written down all the same.
    bench.command(&Command::SelfTest);
    assert_eq!(bench.follow(), ["changed", "commanded", "commanded", "commanded"]);
    bench.frames((60..70).flat_map(example_frames));
    // Its accelerometer tick never comes.
    let [_, alone] = example_frames(70);
    bench.frames([alone]);
    bench.actor.tend(start + Duration::from_secs(3600));
    assert_eq!(bench.follow(), ["flushed", "pre-launch ended"]);
    bench.frames((71..90).flat_map(example_frames));
    let [_, alone] = example_frames(90);
    bench.frames([alone]);
    bench.command(&Command::SelfTest);
    bench.actor.tend(Instant::now() + Duration::from_secs(3600));
    assert_eq!(bench.follow(), ["commanded", "flushed", "self-test expired"]);
    bench.command(&Command::Run { reversal: Some(false) });
    bench.actor.flush();
    assert_eq!(bench.follow(), ["commanded"], "nothing waited");
    bench.actor.end();
    assert_eq!(bench.follow(), ["ended"]);
    assert_eq!(bench.follower.heard()[Input::Raw(RawStream::Gyro).index()].frames, 92);
}

#[test]
fn after_an_alarm_the_journal_tells_what_the_unit_is_given_again() {
    let mut bench = Bench::new();
    bench.change(Schedule::NextTick, Span::ZERO);
    assert_eq!(bench.follow(), ["changed"]);
    bench.frames((0..40).flat_map(example_frames));
    bench.change(Schedule::Sequence(1000), Span::from_ms(5));
    bench.command(&Command::Standby);
    bench.follow();
    let heard = bench.follower.heard();
    bench.actor.reset("a test says so");
    assert_eq!(bench.follow(), ["began", "changed", "changed", "commanded"]);
    assert_eq!(bench.follower.heard(), heard, "the account of what was heard goes on");
    bench.frames((40..60).flat_map(example_frames));
    assert_eq!(bench.follower.unit().state(), State::Standby);
}

#[test]
fn whoever_comes_late_goes_on_from_the_memory() {
    let mut bench = Bench::new();
    bench.change(Schedule::NextTick, Span::ZERO);
    bench.follow();
    bench.frames((0..40).flat_map(example_frames));
    bench.change(Schedule::Sequence(50), Span::from_ms(20));
    bench.follow();
    let entry = bench.actor.memory("a1");
    assert_eq!((entry.number, entry.heard), (bench.number, bench.follower.heard()));
    let JournalEvent::Memory { memory, document, pending } = &entry.event else { panic!("{entry:?}") };
    assert_eq!((document.as_deref(), pending.as_deref()), (Some(EXAMPLE), Some(EXAMPLE)));
    let mut late = UnitStream::from_memory(memory).unwrap();
    let mut carried = UnitStream::new(UnitId::new("U-1").unwrap(), UnitSettings::default());
    carried.carry_out(&entry.event).unwrap();
    for (stream, frame) in (40..70).flat_map(example_frames) {
        bench.frames([(stream, frame.clone())]);
        for other in [&mut late, &mut carried] {
            other.receive(stream, &frame).unwrap();
            other.take_ready();
            while other.take_in_force().is_some() {}
        }
    }
    assert!(late.memory() == bench.follower.memory() && carried.memory() == late.memory());
    let mut other = UnitStream::new(UnitId::new("U-2").unwrap(), UnitSettings::default());
    assert!(other.carry_out(&entry.event).is_err(), "the memory of another unit");
}

#[test]
fn an_entry_that_cannot_be_published_is_counted() {
    let mut actor = actor(Sink::default().outlet());
    actor.journal_to(Journal { instance: "a1".into(), outlet: Arc::new(|_, _| Err("closed".into())) });
    actor.end();
    let counter = actor.status("a1").counters.into_iter().find(|c| c.name == "journal_entries_unpublished");
    assert_eq!(counter.map(|counter| counter.value), Some(2));
    assert_eq!(actor.totals().bad, 0, "no message was refused");
    assert_eq!(actor.memory("a1").number, 2, "whoever reads misses them");
}

#[test]
fn of_two_that_speak_each_does_what_the_other_was_ordered_once() {
    let (mut first, mut second) = (Bench::new(), Bench::new());
    let standing = Standing {
        takeover: Duration::from_millis(20),
        active: false,
        yields: false,
        alone_since: None,
        deserted: false,
    };
    for bench in [&mut first, &mut second] {
        bench.change(Schedule::NextTick, Span::ZERO);
        bench.hear((0..40).flat_map(example_frames));
        bench.tape.take();
    }
    first.change(Schedule::Sequence(50), Span::ZERO);
    first.command(&Command::Standby);
    let mut told = first.tape.take();
    let names = |entries: &[JournalEntry]| entries.iter().map(|it| it.event.name()).collect::<Vec<_>>();
    for teller in [true, false] {
        assert_eq!(names(&told), ["changed", "commanded"]);
        let hearer = if teller { &mut second } else { &mut first };
        for entry in told {
            hearer.actor.hear_journal(
                JournalEntry { instance: "b2".into(), ..entry },
                Instant::now(),
                &standing,
            );
        }
        told = hearer.tape.take();
    }
    assert_eq!(names(&told), [""; 0], "it is not told for ever");
    let unit = |bench: &Bench| (bench.actor.stream.unit().pending(), bench.actor.stream.unit().state());
    assert_eq!(unit(&second), unit(&first));
    assert_eq!(unit(&second), (Some((2, At::Sequence(50))), State::Standby));
}

#[test]
fn what_was_ordered_here_is_told_though_another_instance_speaks_by_now() {
    let mut bench = Bench::new();
    bench.actor.follow(Instant::now(), Footing::All);
    bench.change(Schedule::NextTick, Span::ZERO);
    assert_eq!(bench.tape.take().len(), 0, "as it appears");
    bench.hear((0..40).flat_map(example_frames));
    bench.change(Schedule::Sequence(50), Span::ZERO);
    bench.command(&Command::Standby);
    let told: Vec<_> = bench.tape.take().iter().map(|entry| entry.event.name()).collect();
    assert_eq!(told, ["changed", "commanded"]);
}

#[test]
fn what_an_instance_did_while_the_connection_was_lost_is_asked_for_when_it_comes_back() {
    for (comes, asks) in [("b2", true), ("c3", false)] {
        let (mut bench, other) = (Bench::new(), Bench::new());
        let standing = Standing {
            takeover: Duration::from_millis(20),
            active: false,
            yields: false,
            alone_since: None,
            deserted: false,
        };
        let now = Instant::now();
        bench.actor.follow(now, Footing::Nothing);
        assert!(bench.actor.watch_speech(now, &standing).memory);
        bench.actor.hear_journal(other.actor.memory("b2"), now, &standing);
        assert!(!bench.actor.watch_speech(now, &standing).memory);
        bench.actor.introduce(comes);
        assert_eq!(bench.actor.watch_speech(now, &standing).memory, asks, "{comes}");
    }
}
