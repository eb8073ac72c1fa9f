//! Who has lost the other instance does not say what that one may contradict.

use isotherm_protocol::journal::{Joiner, JournalEntry};

use super::*;

const TAKEOVER: Duration = Duration::from_millis(20);

fn ms(ms: u64) -> Duration {
    Duration::from_millis(ms)
}

fn lost(at: Instant) -> Standing {
    Standing { takeover: TAKEOVER, active: false, yields: false, alone_since: Some(at), deserted: true }
}

fn give(actor: &mut UnitActor, sequences: std::ops::Range<u64>, arrival: Instant) {
    for sequence in sequences {
        for (stream, frame) in frames(sequence) {
            actor.receive(stream, &frame, arrival);
        }
    }
}

/// A unit that has published thirty ticks, and lost the other instance 10 ms later.
fn deserted() -> (UnitActor, Sink, Instant) {
    let (sink, start) = (Sink::default(), Instant::now());
    let mut actor = actor(sink.outlet());
    give(&mut actor, 0..30, start);
    assert_eq!(sink.sequences(), (0..30).collect::<Vec<_>>());
    assert!(!actor.watch_speech(start + ms(10), &lost(start + ms(10))).spoke);
    (actor, sink, start)
}

#[test]
fn what_came_behind_a_hole_waits_until_the_other_instance_would_be_there() {
    let (mut actor, sink, start) = deserted();
    give(&mut actor, 40..80, start + ms(40));
    assert!(!actor.speaks());
    assert!(!actor.watch_speech(start + ms(1000), &lost(start + ms(10))).spoke);
    assert_eq!(sink.sequences(), (0..30).collect::<Vec<_>>(), "nothing that another may contradict");
    // Nobody is there: late is better than never.
    assert!(actor.watch_speech(start + ms(2000), &lost(start + ms(10))).spoke);
    assert_eq!(sink.sequences(), (0..30).chain(40..80).collect::<Vec<_>>());
}

#[test]
fn a_stream_without_a_hole_goes_on_at_once() {
    let (mut actor, sink, start) = deserted();
    give(&mut actor, 30..80, start + ms(90));
    assert!(actor.speaks());
    assert_eq!(sink.sequences(), (0..80).collect::<Vec<_>>());
}

#[test]
fn an_isolated_unit_listens_shortly_and_speaks_on_where_nothing_is_missing() {
    let (mut actor, sink, start) = deserted();
    let standing = lost(start + ms(10));
    actor.watch_speech(start + ms(1200), &standing);
    assert!(actor.speaks(), "swaps and commands are its own: it may be the only one");
    give(&mut actor, 30..40, start + ms(1300));
    assert_eq!((actor.speaks(), sink.sequences().len()), (false, 30));
    actor.watch_speech(start + ms(1300) + TAKEOVER * 3, &standing);
    assert_eq!((actor.speaks(), sink.sequences()), (true, (0..40).collect::<Vec<_>>()));
}

#[test]
fn an_isolated_unit_that_lacks_ticks_says_nothing_of_them() {
    let (mut actor, sink, start) = deserted();
    let standing = lost(start + ms(10));
    actor.watch_speech(start + ms(1200), &standing);
    give(&mut actor, 130..180, start + ms(1300));
    actor.watch_speech(start + ms(1500), &standing);
    assert_eq!((actor.speaks(), sink.sequences().len()), (false, 30));
}

#[test]
fn a_unit_that_has_just_yielded_and_lacks_nothing_speaks_again_where_the_other_is_silent() {
    for (ticks, stood_still, speaks) in [(30..40, false, true), (32..42, false, false), (30..40, true, false)]
    {
        let (mut actor, sink, start) = deserted();
        let standing = Standing { alone_since: None, deserted: false, ..lost(start) };
        actor.follow(start + ms(20), Footing::All);
        if stood_still {
            actor.lose_step();
        }
        give(&mut actor, ticks, start + ms(20));
        // By the clock of this machine: frames are kept with the time at which they were computed.
        let late = Instant::now() + TAKEOVER * 2;
        assert_eq!(actor.watch_speech(late, &standing).spoke, speaks);
        assert_eq!(sink.sequences().len(), if speaks { 40 } else { 30 });
    }
}

#[test]
fn of_two_that_speak_the_one_that_goes_before_goes_on() {
    for (yields, calibrated) in [(true, true), (true, false), (false, true), (false, false)] {
        let (mut other, heard, now) = deserted();
        give(&mut other, 30..40, now);
        let (mut actor, ..) = deserted();
        if calibrated {
            let text = include_str!("../../../../../config/calibration/ZLG-0001.toml");
            install(&mut actor, Arc::new(Document::parse(text, None).unwrap().calibration), [7; 8]);
            give(&mut actor, 30..40, now);
        }
        let standing =
            Standing { takeover: TAKEOVER, active: false, yields, alone_since: None, deserted: false };
        let batch = heard.0.lock().unwrap().last().cloned().unwrap();
        actor.hear(&encode(&batch).unwrap(), now, &standing);
        assert_eq!(actor.speaks(), !yields);
    }
}

#[test]
fn one_that_yields_to_an_instance_that_stands_by_says_nothing_in_its_place() {
    for (command, speaks) in [(None, true), (Some(Command::Standby), false)] {
        let (mut other, ..) = deserted();
        other.journal_to(Journal { instance: "other".into(), outlet: Arc::new(|_, _| Ok(())) });
        if let Some(command) = command {
            other.command(&command).unwrap();
        }
        let (mut actor, sink, start) = deserted();
        let standing = Standing { yields: true, alone_since: None, deserted: false, ..lost(start) };
        actor.hear_journal(other.memory("other"), start + ms(20), &standing);
        assert!(!actor.speaks());
        give(&mut actor, 30..40, start + ms(20));
        // By the clock of this machine: frames are kept with the time at which they were computed.
        let late = Instant::now() + TAKEOVER * 2;
        assert_eq!(
            (actor.watch_speech(late, &standing).spoke, sink.sequences().len() > 30),
            (speaks, speaks)
        );
    }
}

#[test]
fn a_unit_without_ticks_is_published_by_whoever_is_asked_by_the_instance_that_published_it() {
    for (asks, speaks) in [("other", true), ("third", false)] {
        let (mut other, ..) = deserted();
        other.journal_to(Journal { instance: "other".into(), outlet: Arc::new(|_, _| Ok(())) });
        let (mut actor, _, start) = deserted();
        let standing = Standing { yields: true, alone_since: None, deserted: false, ..lost(start) };
        actor.follow(start + ms(20), Footing::Nothing);
        actor.hear_journal(other.memory("other"), start + ms(20), &standing);
        let later = start + ms(5000);
        assert!(!actor.watch_speech(later, &standing).spoke, "it stands by");
        actor.is_asked_by(asks, later, &standing);
        assert_eq!(actor.speaks(), speaks);
    }
}

#[test]
fn of_two_that_ask_each_other_the_first_speaks() {
    for (yields, after, speaks) in [(false, 2000, true), (false, 1000, false), (true, 2000, false)] {
        let (mut actor, _, start) = deserted();
        let standing = Standing { yields, alone_since: None, deserted: false, ..lost(start) };
        actor.follow(start, Footing::Nothing);
        actor.is_asked_by("other", start + ms(after), &standing);
        assert_eq!(actor.speaks(), speaks);
    }
}

#[test]
fn what_the_other_was_ordered_holds_for_one_that_has_just_yielded_too() {
    let (mut actor, sink, start) = deserted();
    let standing = Standing { alone_since: None, deserted: false, ..lost(start) };
    actor.follow(start + ms(20), Footing::All);
    give(&mut actor, 30..35, start + ms(20));
    let command = Command::Standby;
    let event = JournalEvent::Commanded { command, accepted: true, words: String::new() };
    let (unit, instance) = (actor.id().to_string(), "other".to_owned());
    let entry = JournalEntry { unit, instance, number: 7, heard: actor.stream.heard(), event };
    actor.hear_journal(entry, start + ms(30), &standing);
    give(&mut actor, 35..40, start + ms(40));
    // By the clock of this machine: frames are kept with the time at which they were computed.
    assert!(actor.watch_speech(Instant::now() + TAKEOVER * 2, &standing).spoke);
    assert_eq!(sink.sequences(), (0..35).collect::<Vec<_>>());
}

/// One that was stopped for a moment takes orders before the memory comes that the other instance gave out meanwhile.
#[test]
fn what_was_ordered_here_holds_though_the_memory_of_the_other_instance_is_older() {
    for (commanded_there, told) in [
        (false, vec!["commanded", "changed", "commanded", "changed"]),
        (true, vec!["commanded", "changed", "changed"]),
    ] {
        let (mut other, ..) = deserted();
        other.journal_to(Journal { instance: "other".into(), outlet: Arc::new(|_, _| Ok(())) });
        let (mut actor, _, start) = deserted();
        let names = Arc::new(Mutex::new(Vec::new()));
        let (noting, joiner) = (Arc::clone(&names), Mutex::new(Joiner::new()));
        let outlet = Arc::new(move |_: &UnitId, frame: Vec<u8>| {
            let entry = joiner.lock().unwrap().join(decode(&frame)?)?;
            noting.lock().unwrap().extend(entry.map(|entry| entry.event.name()));
            Ok(())
        });
        actor.journal_to(Journal { instance: "this".into(), outlet });
        names.lock().unwrap().clear();
        actor.command(&Command::Standby).unwrap();
        actor.change(document(7));
        let standing = Standing { yields: true, alone_since: None, deserted: false, ..lost(start) };
        if commanded_there {
            let (unit, instance) = (actor.id().to_string(), "other".to_owned());
            let words = State::RunningWithoutReversal.to_string();
            let event =
                JournalEvent::Commanded { command: Command::Run { reversal: None }, accepted: true, words };
            let entry = JournalEntry { unit, instance, number: 0, heard: actor.stream.heard(), event };
            actor.hear_journal(entry, start + ms(20), &standing);
            names.lock().unwrap().retain(|name| *name != "commanded");
            names.lock().unwrap().insert(0, "commanded");
        }
        actor.hear_journal(other.memory("other"), start + ms(20), &standing);
        assert!(!actor.speaks());
        assert_eq!(actor.stream.unit().state() != State::Standby, commanded_there);
        assert_eq!(actor.highest_revision(), 7);
        assert_eq!(*names.lock().unwrap(), told);
    }
}

/// A change to a document with its text, from the next tick on.
fn document(counter: u64) -> Change {
    let next = Arc::new(Given::new(counter, compiled(None), &isotherm_protocol::history::Source::Bus));
    Change { next, at: Schedule::NextTick, slew: Span::ZERO }
}
