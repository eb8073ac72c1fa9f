//! Entries as lines, texts within their bounds, times of day.

use std::time::{Duration, SystemTime};

use super::*;

fn accepted(revision: u64) -> Acceptance {
    Acceptance {
        revision,
        digest: Digest::of(b"document"),
        overlay: None,
        source: Source::Folder { path: "cal/zlg-1.toml".to_owned() },
        base: Some(Digest::of(b"before")),
        changed: vec!["gyro.sensor[0].static_bias.coefficients[0]: 1.0 -> 1.5".to_owned()],
        schedule: Schedule::Sequence(4_000),
        slew_ms: 2_000,
    }
}

fn entry(event: AuditEvent) -> AuditEntry {
    AuditEntry {
        number: 7,
        time: WallTime::from_unix_ms(1_795_248_000_123),
        unit: Some("ZLG-1".to_owned()),
        by: "ann".to_owned(),
        event,
    }
}

/// One of each kind, with extreme numbers where there are any.
fn each_kind() -> Vec<AuditEvent> {
    let set = GoodSet { in_force: true, ..GoodSet::new(&accepted(3), WallTime::default()) };
    vec![
        AuditEvent::Accepted(accepted(4)),
        AuditEvent::Accepted(Acceptance {
            overlay: Some(Digest::of(b"overlay")),
            base: None,
            source: Source::PreLaunch,
            schedule: Schedule::TimeNs(i64::MIN),
            changed: Vec::new(),
            slew_ms: 0,
            ..accepted(u64::MAX)
        }),
        AuditEvent::InForce(FirstTick {
            revision: 4,
            series: u64::MAX,
            first_sequence: u64::MAX,
            first_end_time_ns: i64::MIN,
        }),
        AuditEvent::Withdrawn(Withdrawal { revision: 4, why: Withdrawn::Superseded { by_revision: 5 } }),
        AuditEvent::Withdrawn(Withdrawal { revision: 5, why: Withdrawn::Cancelled }),
        AuditEvent::Refused(Refusal {
            source: Source::Bus,
            digest: Digest::of(b"bad"),
            problems: vec!["1:1: unit: is \"x\"".to_owned()],
            count: 3,
            rival: false,
        }),
        AuditEvent::Command(CommandRecord {
            command: "run".to_owned(),
            accepted: false,
            reason: Some("is testing itself".to_owned()),
            state_before: "self-test".to_owned(),
            state_after: "self-test".to_owned(),
            last_sequence: Some(9),
            order: Some(Order::Run { reversal: Some(true) }),
        }),
        AuditEvent::CarriedUnit(CarriedUnit { highest_revision: 9, sets: vec![set], intent: resting() }),
        AuditEvent::CarriedFile(CarriedFile {
            path: "a\"b\\c°.toml".to_owned(),
            digest: Digest::of(b"x"),
            refused: true,
        }),
    ]
}

#[test]
fn every_kind_of_entry_comes_back_from_its_line() {
    for event in each_kind() {
        let entry = entry(event);
        let line = entry.to_line().unwrap();
        assert!(line.ends_with("\"}\n") && line.matches('\n').count() == 1, "{line}");
        assert!(line.contains(&format!("\"event\":\"{}\"", entry.event.name())), "{line}");
        assert_eq!(AuditEntry::from_line(line.as_bytes()), Ok(entry.clone()), "{line}");
        assert_eq!(entry.clone().bounded(), entry, "nothing of ordinary length is cut");
    }
}

#[test]
fn a_line_is_what_the_documentation_says() {
    let line = entry(each_kind().swap_remove(3)).to_line().unwrap();
    let json = concat!(
        r#"{"number":7,"time":"2026-11-21T08:00:00.123Z","unit":"ZLG-1","by":"ann","event":"withdrawn","#,
        r#""revision":4,"why":"superseded","by_revision":5}"#
    );
    let crc = crc32fast::hash(json.as_bytes());
    assert_eq!(line, format!("{},\"crc\":\"{crc:08x}\"}}\n", json.strip_suffix('}').unwrap()));
}

#[test]
fn a_line_with_any_byte_changed_or_missing_is_no_entry() {
    let line = entry(each_kind().swap_remove(0)).to_line().unwrap().into_bytes();
    let whole = line.strip_suffix(b"\n").unwrap();
    for at in 0..whole.len() {
        let mut damaged = whole.to_vec();
        damaged[at] ^= 1;
        assert!(AuditEntry::from_line(&damaged).is_err(), "byte {at} turned over");
        assert!(AuditEntry::from_line(&whole[..at]).is_err(), "cut to {at} bytes");
        assert!(!AuditEntry::is_whole(&whole[..at]));
    }
    assert!(AuditEntry::is_whole(whole));
    assert!(AuditEntry::from_line(&vec![b'x'; MAX_LINE_BYTES + 1]).is_err());
}

#[test]
fn an_entry_of_a_newer_version_is_told_from_a_damaged_one_and_gives_its_number() {
    let json = r#"{"number":12,"time":"2030-01-01T00:00:00.000Z","event":"levitated","height_m":3}"#;
    let crc = crc32fast::hash(json.as_bytes());
    let line = format!("{},\"crc\":\"{crc:08x}\"}}", json.strip_suffix('}').unwrap());
    match AuditEntry::from_line(line.as_bytes()) {
        Err(LineError::Entry { number, words }) => {
            assert_eq!(number, Some(12));
            assert!(words.contains("levitated"), "{words}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn unknown_fields_of_a_newer_version_are_skipped() {
    let json = concat!(
        r#"{"number":1,"time":"2030-01-01T00:00:00Z","colour":"red","event":"withdrawn","revision":4,"#,
        r#""why":"cancelled"}"#
    );
    let crc = crc32fast::hash(json.as_bytes());
    let line = format!("{},\"crc\":\"{crc:08x}\"}}", json.strip_suffix('}').unwrap());
    let entry = AuditEntry::from_line(line.as_bytes()).unwrap();
    assert_eq!(entry.event, AuditEvent::Withdrawn(Withdrawal { revision: 4, why: Withdrawn::Cancelled }));
    assert_eq!((entry.unit, entry.by.as_str()), (None, ""));
}

#[test]
fn the_longest_entries_fit_in_a_line_and_carry_no_control_characters() {
    let long = || "\u{1b}[2J\n𝛺".repeat(5_000);
    let path = || Source::Folder { path: long() };
    let events = [
        AuditEvent::Accepted(Acceptance {
            changed: (0..1_000).map(|_| long()).collect(),
            source: path(),
            ..accepted(1)
        }),
        AuditEvent::Refused(Refusal {
            source: path(),
            digest: Digest::of(b"x"),
            problems: (0..1_000).map(|_| long()).collect(),
            count: 0,
            rival: true,
        }),
        AuditEvent::Command(CommandRecord {
            command: long(),
            accepted: true,
            reason: Some(long()),
            state_before: long(),
            state_after: long(),
            last_sequence: None,
            order: None,
        }),
        AuditEvent::CarriedUnit(CarriedUnit {
            highest_revision: 1,
            sets: (0..1_000)
                .map(|n| {
                    GoodSet::new(
                        &Acceptance { source: path(), ..accepted(n) },
                        WallTime::from_unix_ms(i64::MAX),
                    )
                })
                .collect(),
            intent: Intent::default(),
        }),
        AuditEvent::CarriedFile(CarriedFile { path: long(), digest: Digest::of(b"x"), refused: true }),
    ];
    for event in events {
        let entry = AuditEntry { unit: Some(long()), by: long(), ..entry(event) }.bounded();
        let line = entry.to_line().unwrap();
        assert!(line.len() < MAX_LINE_BYTES / 2, "{} has {} bytes", entry.event.name(), line.len());
        // What a reader of the JSON gets has none either.
        let read: serde_json::Value = serde_json::from_str(&line).unwrap();
        assert!(!read.to_string().replace("\\\\", "").contains('\\'), "{line}");
        assert_eq!(AuditEntry::from_line(line.as_bytes()), Ok(entry.clone()));
        match entry.event {
            AuditEvent::Accepted(accepted) => {
                assert_eq!(accepted.changed.len(), MAX_CHANGED + 1);
                assert_eq!(accepted.changed.last().unwrap(), "and 968 more");
            }
            AuditEvent::Refused(refused) => {
                assert_eq!((refused.problems.len(), refused.count), (MAX_PROBLEMS, 1_000));
            }
            AuditEvent::CarriedUnit(carried) => assert_eq!(carried.sets.last().unwrap().revision, 999),
            _ => {}
        }
    }
}

#[test]
fn digests_come_back_from_their_text_and_nothing_else_does() {
    let digest = Digest::of(b"abc");
    let text = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
    assert_eq!(digest.to_string(), text, "FIPS 180-4, one-block message");
    assert_eq!(text.parse(), Ok(digest));
    assert_eq!(text.to_uppercase().parse(), Ok(digest));
    assert_eq!(digest.head(), [0xba, 0x78, 0x16, 0xbf, 0x8f, 0x01, 0xcf, 0xea]);
    for wrong in ["", "ba78", &text[1..], &format!("{text}0"), &text.replace('b', "+"), &"°".repeat(32)] {
        assert!(wrong.parse::<Digest>().is_err(), "{wrong}");
    }
}

#[test]
fn times_of_day_are_written_in_utc_and_held_within_four_digit_years() {
    for (unix_ms, text) in [
        (0, "1970-01-01T00:00:00.000Z"),
        (951_782_400_001, "2000-02-29T00:00:00.001Z"),
        (1_795_248_000_123, "2026-11-21T08:00:00.123Z"),
        (-5, "1970-01-01T00:00:00.000Z"),
        (i64::MAX, "9999-12-31T23:59:59.999Z"),
    ] {
        let time = WallTime::from_unix_ms(unix_ms);
        assert_eq!(time.to_string(), text);
        assert_eq!(serde_json::from_str::<WallTime>(&format!("\"{text}\"")).unwrap(), time);
        assert_eq!(WallTime::from(time.system_time()), time);
    }
    let far = SystemTime::UNIX_EPOCH + Duration::from_secs(1 << 40);
    assert_eq!(WallTime::from(far).to_string(), "9999-12-31T23:59:59.999Z");
    assert!(serde_json::from_str::<WallTime>("\"yesterday\"").is_err());
}

#[test]
fn entries_in_words_say_what_an_operator_asks() {
    let words: String = each_kind().into_iter().map(|event| entry(event).to_string() + "\n").collect();
    insta::assert_snapshot!(words);
}

/// In standby, at rest at a place.
fn resting() -> Intent {
    let rest = PlaceOrder { latitude_deg: 55.7, heading_deg: 30.0, pitch_roll_deg: Some([0.1, -0.2]) };
    Intent { state: Some(Order::Standby), rest: Some(rest) }
}

#[test]
fn what_an_operator_wants_follows_from_the_commands_that_were_carried_out() {
    let record = |command: &str, order: Option<Order>, accepted| CommandRecord {
        command: command.to_owned(),
        accepted,
        reason: None,
        state_before: String::new(),
        state_after: String::new(),
        last_sequence: None,
        order,
    };
    let mut intent = Intent::default();
    let run = Order::Run { reversal: Some(false) };
    let wanted = resting();
    intent.note(&record("", Some(run.clone()), true));
    intent.note(&record("", Some(Order::Standby), false));
    assert_eq!(intent.orders().collect::<Vec<_>>(), [run], "what was refused was not done");
    intent.note(&record("standby", None, true));
    intent.note(&record("", wanted.rest.map(Order::Rest), true));
    intent.note(&record("", Some(Order::SelfTest), true));
    intent.note(&record("pre-launch ended", None, true));
    assert_eq!(intent, wanted);
    intent.note(&record("", Some(Order::EndRest), true));
    assert_eq!(intent.orders().collect::<Vec<_>>(), [Order::Standby]);
}

#[test]
fn what_is_not_understood_is_repeated_in_few_words_and_numbers_come_back_to_the_bit() {
    let record = CommandRecord {
        command: "rest".to_owned(),
        accepted: true,
        reason: None,
        state_before: "run".to_owned(),
        state_after: "run".to_owned(),
        last_sequence: None,
        order: resting().rest.map(|place| Order::Rest(PlaceOrder { heading_deg: -1.1e29, ..place })),
    };
    let rest = entry(AuditEvent::Command(record));
    let line = rest.to_line().unwrap();
    assert_eq!(AuditEntry::from_line(line.as_bytes()), Ok(rest), "{line}");
    let json = format!(r#"{{"number":12,"time":"2030-01-01T00:00:00.000Z","event":"{}"}}"#, "x".repeat(9000));
    let crc = crc32fast::hash(json.as_bytes());
    let line = format!("{},\"crc\":\"{crc:08x}\"}}", json.strip_suffix('}').unwrap());
    let words = AuditEntry::from_line(line.as_bytes()).unwrap_err().to_string();
    assert!(words.len() < 500, "{words}");
}
