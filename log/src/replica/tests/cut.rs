//! Recordings that end in the middle.

use isotherm_correction::units::Span;

use super::session::{DOCUMENT, Session};
use super::*;
use crate::diff::Account;
use crate::offline::{Basis, Form, RunOptions, UnitPlan, UnitReport, correct};
use crate::part::{LogFiles, Part};
use crate::recording::{RecordingOptions, RecordingWriter};

/// What `correct` makes of these messages as a file.
fn corrected(messages: &[Message]) -> Account {
    corrected_to(messages, None).published.unwrap()
}

/// Likewise of a part that ends so long after the beginning.
fn corrected_to(messages: &[Message], end: Option<Span>) -> UnitReport {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mcap");
    let mut writer = RecordingWriter::create(&path, RecordingOptions::default()).unwrap();
    for message in messages {
        writer.write(message).unwrap();
    }
    writer.finish().unwrap();
    let (part, files) = (Part { end, ..Part::default() }, LogFiles::Recordings(vec![path.clone()]));
    let outlines = scan(&[path], files.end_ns(&part).unwrap()).unwrap();
    let plan = |(id, outline): (UnitId, UnitOutline)| {
        let basis = Basis::Journal { outline: outline.journal, changes: Changes::default() };
        UnitPlan { id, basis, compare: true }
    };
    let plans = outlines.units.into_iter().map(plan).collect();
    let options = RunOptions { threads: 1, form: Form::Sums, from_ns: 0 };
    let (mut units, _) = correct(&files, &part, plans, options, &mut |_, _| Ok(())).unwrap();
    units.remove(0)
}

fn count(messages: &[Message], is: impl Fn(&Topic) -> bool) -> u64 {
    messages.iter().filter(|message| is(&message.topic)).count() as u64
}

#[test]
fn the_unfinished_tail_of_a_cut_recording_is_told_and_is_no_difference() {
    for (raw_later_ns, restarts) in
        [(25_000_000, false), (25_000_000, true), (0, false), (-25_000_000, false)]
    {
        let mut session = Session { raw_later_ns, ..Session::new() };
        session.ticks(300);
        if restarts {
            session.sequence = 0;
        }
        session.ticks(300);
        let whole = session.recording();
        let mut tails = 0;
        for cut in (whole.len() / 3..whole.len()).step_by(53) {
            let messages = &whole[..cut];
            let account = corrected(messages);
            let published: u64 = messages
                .iter()
                .filter(|message| matches!(message.topic, Topic::Corrected(_)))
                .map(|message| codec::decode::<CorrectedBatch>(&message.frame).unwrap().ticks.len() as u64)
                .sum();
            assert_eq!((account.different, account.missing()), (0, 0), "{cut}: {account:#?}");
            assert!(account.agrees() && account.first.is_none(), "{cut}: {account:#?}");
            assert_eq!(account.ticks + account.unfinished, published, "{cut}: {account:#?}");
            assert_eq!(account.unfinished, account.only_b.behind, "{cut}: {account:#?}");
            tails += account.unfinished;
        }
        assert_eq!(tails > 0, raw_later_ns > 0, "{raw_later_ns}: {tails}");
    }
}

#[test]
fn a_part_of_a_whole_recording_lacks_nothing_of_its_journal() {
    let mut session = Session::new();
    for _ in 0..4 {
        session.ticks(100);
        session.memory();
        session.swap(DOCUMENT, Schedule::NextTick, 0);
    }
    let whole = session.recording();
    for end_ms in [500, 1500, 2995, 3005, 9000] {
        let report = corrected_to(&whole, Some(Span::from_ms(end_ms)));
        let account = report.published.unwrap();
        assert_eq!(report.replica.notices, [], "{end_ms}");
        assert!(account.agrees() && account.ticks >= u64::from(end_ms.min(3900)) / 10 - 10, "{account:#?}");
    }
}

#[test]
fn what_is_missing_before_the_end_of_the_raw_ticks_counts() {
    let mut session = Session::new();
    session.ticks(300);
    let mut messages = session.recording();
    // An accelerometer that fell silent, whose last frame came with the last gyro tick.
    let is_accel = |topic: &Topic| matches!(topic, Topic::Raw(_, RawStream::Accel));
    let all = count(&messages, is_accel);
    let mut number = 0;
    messages.retain(|message| {
        number += u64::from(is_accel(&message.topic));
        !is_accel(&message.topic) || number < 290 || number == all
    });
    let account = corrected(&messages);
    assert_eq!(account.unfinished, 0, "{account:#?}");
    assert!(!account.agrees() && account.different + account.missing() > 0, "{account:#?}");
}
