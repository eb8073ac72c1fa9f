//! What a replica makes of recordings: whole, from the middle, with losses on either side.

mod cut;
mod session;
mod silent;

use isotherm_protocol::key::RawStream;

use super::*;
use session::{DOCUMENT, Session, Way, kinds, lively, other, replay};

#[test]
fn a_recording_from_the_beginning_gives_what_was_published_to_the_bit() {
    for raw_later_ns in [0, 25_000_000, -25_000_000, 400_000_000, -400_000_000] {
        let mut session = Session { raw_later_ns, ..Session::new() };
        lively(&mut session);
        let (account, report) = replay(&session.recording(), Changes::default());
        assert_eq!(kinds(&report), Vec::<&str>::new(), "{raw_later_ns}: {report:#?}");
        assert!(account.agrees() && account.ticks > 1000, "{raw_later_ns}: {account:#?}");
        assert_eq!((report.memories_equal, report.frames_before), (2, 0), "{raw_later_ns}");
        assert_eq!(account.only_b.all() + account.only_a.all(), 0);
    }
}

#[test]
fn what_went_fast_is_made_again_too() {
    for raw_later_ns in [0, 100_000_000, -100_000_000] {
        let mut session = Session { raw_later_ns, speed: 200, ..Session::new() };
        session.ticks(30_000);
        session.swap(&other("91.0"), Schedule::NextTick, 0);
        session.ticks(10_000);
        session.memory();
        lively(&mut session);
        let (account, report) = replay(&session.recording(), Changes::default());
        assert_eq!(kinds(&report), Vec::<&str>::new(), "{raw_later_ns}: {report:#?}");
        assert!(account.is_identical() && report.memories_equal == 3, "{raw_later_ns}: {account:#?}");
    }
}

#[test]
fn a_recording_from_the_middle_does_so_too() {
    for raw_later_ns in [0, 25_000_000, -25_000_000] {
        let mut session = Session { raw_later_ns, ..Session::new() };
        session.ticks(777);
        session.recorder_comes();
        lively(&mut session);
        let (account, report) = replay(&session.recording(), Changes::default());
        assert_eq!(kinds(&report), Vec::<&str>::new(), "{raw_later_ns}: {report:#?}");
        assert!(account.agrees() && account.ticks > 1000, "{raw_later_ns}: {account:#?}");
        assert_eq!(report.memories_equal, 2, "{raw_later_ns}");
        assert!(report.frames_before > 0, "what the memory had heard is dropped");
    }
}

#[test]
fn a_doubled_frame_between_whose_copies_a_memory_was_made_is_no_difference() {
    let temperature = |message: &Message| matches!(message.topic, Topic::Raw(_, RawStream::Temperature));
    for service_hears_both_before in [false, true] {
        let mut session = Session::new();
        session.ticks(800);
        session.recorded.clear();
        session.ticks(1);
        let at = session.recorded.iter().position(temperature).unwrap();
        let copy = session.recorded[at].clone();
        if service_hears_both_before {
            session.service.receive(RawStream::Temperature, &copy.frame).unwrap();
            session.memory();
            // The copy is longer on its way to the recorder.
            session.recorded.push(Message { received_ns: session.now_ns + 1_000_000, ..copy });
        } else {
            session.memory();
            session.service.receive(RawStream::Temperature, &copy.frame).unwrap();
            session.recorded.insert(at + 1, copy);
        }
        lively(&mut session);
        let (account, report) = replay(&session.recording(), Changes::default());
        assert!(account.agrees() && account.ticks > 1000, "{service_hears_both_before}: {account:#?}");
        // A copy that the service heard behind the memory is given once that is known: all that differs is how late it came.
        let told = if service_hears_both_before { &[][..] } else { &["other memory"] };
        assert_eq!(kinds(&report), told, "{service_hears_both_before}: {report:#?}");
        for notice in &report.notices {
            let Notice::OtherMemory { words, .. } = notice else { unreachable!() };
            assert_eq!(words, "temperature_late 8 here, 0 there");
        }
        // A frame that the service did not hear and that is no copy is told.
        let mut more = session.recording();
        let at = more.iter().rposition(temperature).unwrap();
        let frame = more[at].clone();
        more.insert(at, Message { frame: [&frame.frame[..], &[0]].concat(), ..frame });
        assert!(kinds(&replay(&more, Changes::default()).1).contains(&"not heard"));
    }
}

#[test]
fn a_memory_that_is_lost_the_first_file_of_a_row_is_enough_and_so_is_the_second() {
    let mut session = Session::new();
    session.ticks(400);
    session.memory();
    let cut = session.recorded.len() - 1;
    session.ticks(400);
    session.act(JournalEvent::Ended);
    let recording = session.recording();
    let (account, report) = replay(&recording, Changes::default());
    assert!(account.agrees() && report.is_exact() && report.memories_equal == 1, "{report:?}");
    let (account, report) = replay(&recording[cut..], Changes::default());
    assert!(account.agrees() && report.is_exact() && account.ticks == 400, "{report:?} {account:?}");
}

#[test]
fn a_recorder_that_hears_the_producer_only_after_it_asked_begins_with_the_next_memory() {
    let mut session = Session::new();
    session.ticks(300);
    session.recorded.clear();
    session.memory();
    session.way = |_, _| Way::Service;
    session.ticks(20);
    session.way = |_, _| Way::Both;
    session.ticks(200);
    session.memory();
    lively(&mut session);
    let (account, report) = replay(&session.recording(), Changes::default());
    assert_eq!(kinds(&report), Vec::<&str>::new(), "{report:#?}");
    assert!(account.agrees() && account.only_b.before >= 219, "{account:#?}");
}

#[test]
fn a_memory_that_has_heard_more_than_a_recorder_got_before_its_end_is_no_loss() {
    let mut session = Session::new();
    session.ticks(300);
    session.memory();
    session.ticks(300);
    let (before, heard) = (session.recorded.len(), session.recording());
    // On their way when the recorder ends, and what is made of them too; the answer is faster.
    session.ticks(20);
    session.recorded.truncate(before);
    session.memory();
    assert!(session.recorded.len() > before, "the memory is in the recording");
    let (account, report) = replay(&session.recording(), Changes::default());
    assert_eq!(kinds(&report), Vec::<&str>::new(), "{report:#?}");
    assert!(account.agrees() && report.memories_equal == 1, "{account:#?} {report:#?}");
    assert_eq!(account.ticks, replay(&heard, Changes::default()).0.ticks);
    // A frame lost before the last one is a loss all the same.
    let mut session = Session::new();
    session.way = |input, sequence| match (input, sequence) {
        (Input::Raw(RawStream::Gyro), 250..253) => Way::Service,
        _ => Way::Both,
    };
    session.ticks(300);
    session.memory();
    let (_, report) = replay(&session.recording(), Changes::default());
    assert_eq!(kinds(&report), ["not recorded", "other memory"], "{report:#?}");
}

#[test]
fn what_the_recorder_lost_is_said_and_the_memory_puts_it_right() {
    let lost: fn(Input, u64) -> Way = |input, sequence| match (input, sequence) {
        (Input::Raw(RawStream::Gyro), 250..253) => Way::Service,
        _ => Way::Both,
    };
    for raw_later_ns in [0, 25_000_000] {
        let mut session = Session { way: lost, raw_later_ns, ..Session::new() };
        session.ticks(300);
        session.swap(&other("91.0"), Schedule::NextTick, 0);
        session.ticks(300);
        session.memory();
        session.ticks(300);
        session.memory();
        let (account, report) = replay(&session.recording(), Changes::default());
        let lost = Notice::NotRecorded { input: Input::Raw(RawStream::Gyro), frames: 3, entry: 3 };
        assert_eq!(report.notices.first(), Some(&lost), "{report:#?}");
        assert_eq!(kinds(&report), ["not recorded", "other memory"], "{report:#?}");
        assert_eq!(report.memories_equal, 1, "behind the first, everything is right again");
        assert!(!account.agrees() && account.only_b.between == 3, "{account:#?}");
        // Of those that were published, all but the lost and the one that says so are made again.
        assert_eq!(account.first.as_ref().map(|first| first.sequence), Some(250), "{account:#?}");
        assert!(account.different <= 1, "{account:#?}");
    }
}

#[test]
fn what_the_service_did_not_hear_is_said() {
    let mut session = Session::new();
    session.way = |input, sequence| match (input, sequence) {
        (Input::Raw(RawStream::Temperature), 100) | (Input::Raw(RawStream::Accel), 200..205) => Way::Recorder,
        _ => Way::Both,
    };
    session.ticks(300);
    session.swap(&other("91.0"), Schedule::NextTick, 0);
    session.ticks(100);
    let (account, report) = replay(&session.recording(), Changes::default());
    let not_heard = |input, frames| Notice::NotHeard { input: Input::Raw(input), frames, entry: 3 };
    let expected = [not_heard(RawStream::Accel, 5), not_heard(RawStream::Temperature, 1)];
    assert_eq!(report.notices.len(), 2, "{report:#?}");
    assert!(expected.iter().all(|notice| report.notices.contains(notice)), "{report:#?}");
    assert!(!account.agrees());
    // The swap came at its tick all the same.
    assert_eq!(account.only_a.all() + account.only_b.all(), 0, "{account:#?}");
}

#[test]
fn entries_that_are_missing_are_said_to_be() {
    let mut session = Session::new();
    session.ticks(100);
    let from = session.recorded.len();
    session.swap(&other("91.0"), Schedule::NextTick, 0);
    session.recorded.drain(from..);
    session.ticks(100);
    session.swap(&other("92.0"), Schedule::NextTick, 0);
    session.ticks(100);
    let (account, report) = replay(&session.recording(), Changes::default());
    assert_eq!(report.notices, [Notice::EntriesMissing { from: 3, to: 3 }]);
    assert_eq!(account.different, 100, "the swap that is missing, and no more");
}

#[test]
fn a_service_that_comes_again_begins_where_it_was_given_its_first_frame() {
    let mut session = Session::new();
    session.ticks(1000);
    // Killed; the producer goes on.
    session.way = |_, _| Way::Recorder;
    session.ticks(1500);
    session.way = |_, _| Way::Both;
    session.service = UnitStream::new(session.id(), UnitSettings::default());
    (session.instance, session.number) = ("two", 0);
    let began = session.recorded.len();
    session.begin();
    session.ticks(500);
    session.act(JournalEvent::Ended);
    // The entry comes right behind the first frame.
    session.recorded[began..]
        .iter_mut()
        .filter(|message| matches!(message.topic, Topic::Journal(_)))
        .take(2)
        .for_each(|message| message.received_ns += 1000);
    let (account, report) = replay(&session.recording(), Changes::default());
    assert_eq!(kinds(&report), Vec::<&str>::new(), "{report:#?}");
    assert_eq!((account.ticks, account.different, account.only_b.all()), (1500, 0, 0), "{account:#?}");
    assert_eq!(account.only_a.between, 1500, "of what the first service may have heard, nobody knows");
}

#[test]
fn a_service_that_was_not_there_before_is_not_given_what_came_before() {
    let mut session = Session::new();
    session.recorded.clear();
    session.way = |_, _| Way::Recorder;
    session.ticks(1500);
    session.way = |_, _| Way::Both;
    session.service = UnitStream::new(session.id(), UnitSettings::default());
    session.number = 0;
    let began = session.recorded.len();
    session.begin();
    session.ticks(500);
    session.act(JournalEvent::Ended);
    session.recorded[began..]
        .iter_mut()
        .filter(|message| matches!(message.topic, Topic::Journal(_)))
        .take(2)
        .for_each(|message| message.received_ns += 1000);
    let (account, report) = replay(&session.recording(), Changes::default());
    assert!(account.is_identical() && account.ticks == 500, "{account:#?}");
    assert!(report.is_exact() && report.frames_before >= 3000, "{report:#?}");
}

#[test]
fn another_calibration_takes_the_place_of_the_first_and_swaps_can_be_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("other.toml");
    std::fs::write(&path, other("91.0")).unwrap();
    let calibration = Some(crate::offline::load_calibration(&path).unwrap());
    let session = |first: &str, ticks: u64, swap: bool| {
        let mut session = Session::new();
        session.recorded.clear();
        session.service = UnitStream::new(session.id(), UnitSettings::default());
        session.number = 0;
        session.act(JournalEvent::Began { settings: UnitSettings::default(), highest_revision: 0 });
        session.swap(first, Schedule::NextTick, 0);
        session.ticks(ticks);
        if swap {
            session.swap(&other("95.0"), Schedule::NextTick, 0);
        }
        session.ticks(200);
        session
    };
    let with_swap = session(&other("91.0"), 100, true).recording();
    let replaced = Changes { calibration: calibration.clone(), ignore_swaps: false };
    let (account, _) = replay(&with_swap, replaced.clone());
    assert!(account.is_identical(), "the same document in its own place changes nothing: {account:#?}");
    let original = session(DOCUMENT, 100, true).recording();
    let (account, _) = replay(&original, replaced);
    let first = account.first.as_ref().unwrap();
    assert_eq!((account.different, first.sequence), (100, 0), "the swap stays");
    let (account, _) = replay(&original, Changes { calibration: None, ignore_swaps: true });
    assert_eq!((account.different, account.first.unwrap().sequence), (200, 100), "the swap is left out");
    let (account, _) = replay(&original, Changes { calibration, ignore_swaps: true });
    assert_eq!(account.different, 300);
}
