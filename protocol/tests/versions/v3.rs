//! The third generation, byte by byte: the journal.
//!
//! If a test here fails, do not change the test: the change to the messages, or to the core's types that an entry is written
//! with, makes recordings in the field unreadable. Make a new version instead (`protocol/src/version.rs` has the policy) and
//! leave this file as it is. It may be deleted only when `min` of the journal is raised beyond 1.

use isotherm_correction::earth::Place;
use isotherm_correction::navigation::NavigationStep;
use isotherm_correction::operation::Command;
use isotherm_correction::prelaunch::{PreLaunchLimits, PreLaunchSettings};
use isotherm_correction::rest::RestLimits;
use isotherm_correction::unit::{Uncalibrated, UnitSettings};
use isotherm_correction::units::Span;
use isotherm_protocol::codec::{decode, encode};
use isotherm_protocol::control::Schedule;
use isotherm_protocol::corrected::Revision;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::journal::{Joiner, JournalEntry, JournalEvent, JournalPart, split};
use isotherm_protocol::stream::Heard;

use super::bytes;

mod frames;

use frames::ENTRIES;
pub(super) use frames::FRAMES;

fn entry(number: u64, event: JournalEvent) -> JournalEntry {
    let heard = |frames, crc| Heard { frames, crc };
    let heard = [heard(1000, 0x0102_0304), heard(999, 0xffff_ffff), heard(10, 1), heard(0, 0), heard(1, 127)];
    JournalEntry { unit: "ZLG-0042".to_owned(), instance: "d36a8f01".to_owned(), number, heard, event }
}

fn commanded(command: Command, accepted: bool, words: &str) -> JournalEvent {
    JournalEvent::Commanded { command, accepted, words: words.to_owned() }
}

/// Numbers that no conversion of units of measure has touched.
fn pre_launch() -> PreLaunchSettings {
    PreLaunchSettings {
        duration: Span::from_ms(600_000),
        place: Some(Place::new(0.0, 0.0, Some([0.0, 0.0])).expect("a place")),
        limits: PreLaunchLimits {
            static_bias_change_rad_per_s: 1.0,
            magnetic_bias_change_rad_per_s: 2.0,
            mode_imbalance: 0.25,
            time_per_mode: Span::from_ms(60_000),
            good_share: 0.5,
            rest: RestLimits {
                turn_rad: 3.0,
                switch_turn_rad: 4.0,
                slow_turn_rad: 5.0,
                rate_rad_per_s: 6.0,
                push_m_per_s: 7.0,
                force_change_m_per_s2: 8.0,
                shake_m_per_s2: 9.0,
                sigmas: 10.0,
                turn_ceiling_rad: 11.0,
                push_ceiling_m_per_s: 12.0,
            },
        },
    }
}

/// Every kind of entry, by name.
fn entries() -> Vec<(&'static str, JournalEntry)> {
    let settings = UnitSettings {
        pairing_window: Span::from_ms(50),
        temperature_delay: Span::from_ms(20),
        uncalibrated: Uncalibrated::Hold,
        in_standby: true,
        subtract_drift: false,
        reference_delay: Span::from_ms(1000),
        navigation: NavigationStep::new(4, true).expect("a step"),
    };
    let digest = Digest([0xaa; 32]);
    let changed = JournalEvent::Changed {
        revision: Revision { counter: 3, digest: [1, 2, 3, 4, 5, 6, 7, 8] },
        at: Schedule::Sequence(2000),
        slew_ns: 2_500_000_000,
        document: Some("schema = 1\n".to_owned()),
        overlay: Some(digest),
        source: "bus".to_owned(),
    };
    let plain = JournalEvent::Changed {
        revision: Revision { counter: 4, digest: [0; 8] },
        at: Schedule::TimeNs(-5),
        slew_ns: 0,
        document: None,
        overlay: None,
        source: String::new(),
    };
    let memory = JournalEvent::Memory {
        memory: vec![1, 0x80, 0xff],
        document: Some("a = 1".to_owned()),
        pending: None,
    };
    let levelled = Place::new(0.0, 0.0, None).expect("a place");
    let events = vec![
        ("began", JournalEvent::Began { settings, highest_revision: 2 }),
        ("memory", memory),
        ("changed", changed),
        ("changed-plain", plain),
        ("standby", commanded(Command::Standby, true, "standby")),
        ("self-test", commanded(Command::SelfTest, true, "self-test")),
        ("pre-launch", commanded(Command::PreLaunch(pre_launch()), true, "pre-launch calibration")),
        ("abort", commanded(Command::Abort, false, "not possible")),
        ("run", commanded(Command::Run { reversal: Some(true) }, true, "running with mode reversal")),
        ("rest", commanded(Command::Rest(levelled), true, "standby")),
        ("end-rest", commanded(Command::EndRest, true, "standby")),
        ("flushed", JournalEvent::Flushed),
        ("self-test-expired", JournalEvent::SelfTestExpired),
        ("pre-launch-ended", JournalEvent::PreLaunchEnded),
        ("ended", JournalEvent::Ended),
    ];
    (1..).zip(events).map(|(number, (name, event))| (name, entry(number, event))).collect()
}

#[test]
fn entries_are_read_and_written_as_they_always_were() {
    let entries = entries();
    let names: Vec<_> = ENTRIES.iter().map(|(name, _)| *name).collect();
    assert_eq!(entries.iter().map(|(name, _)| *name).collect::<Vec<_>>(), names);
    for ((name, entry), (_, hex)) in entries.iter().zip(ENTRIES) {
        let frozen = bytes(hex);
        let [part] = split(entry).try_into().expect("one part");
        assert_eq!(part.bytes, frozen, "{name} is written");
        assert_eq!(Joiner::new().join(part), Ok(Some(entry.clone())), "{name} is read");
    }
}

#[test]
fn parts_are_read_and_written_as_they_always_were() {
    let whole = split(&entry(3, JournalEvent::Flushed)).remove(0);
    let share =
        JournalPart { number: 300, part: 1, parts: 3, bytes: vec![0, 127, 128, 255], ..whole.clone() };
    for ((name, hex), part) in FRAMES.iter().zip([whole, share]) {
        let frozen = bytes(hex);
        assert_eq!(encode(&part).expect("a part"), frozen, "{name} is written");
        assert_eq!(decode(&frozen), Ok(part), "{name} is read");
    }
}
