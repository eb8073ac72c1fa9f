//! The state folder as operators find and break it: links, locks, permissions, damaged files.

#![expect(clippy::unwrap_used, reason = "a test may panic, its helpers included")]

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::time::SystemTime;

use isotherm_protocol::control::Schedule;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::{Acceptance, AuditEntry, AuditEvent, Source};
use isotherm_protocol::key::UnitId;
use isotherm_service::control::store::{Flaw, Loss, Store, StoreError};
use tempfile::TempDir;

fn unit() -> UnitId {
    UnitId::new("ZLG-1").unwrap()
}

/// Accepts revisions 1…`count`, each with a document of its own.
fn fill(store: &mut Store, count: u64) {
    for revision in 1..=count {
        let digest = store.put_document(format!("revision {revision}").as_bytes()).unwrap();
        let accepted = Acceptance {
            revision,
            digest,
            overlay: None,
            source: Source::Bus,
            base: None,
            changed: vec!["gyro.sensor[0].static_bias.coefficients[0]: 1.0 -> 1.5".to_owned()],
            schedule: Schedule::NextTick,
            slew_ms: 0,
        };
        store.append(SystemTime::now(), Some(&unit()), "ann", AuditEvent::Accepted(accepted)).unwrap();
    }
}

/// A folder that was filled and closed.
fn filled(count: u64) -> TempDir {
    let folder = TempDir::new().unwrap();
    let (mut store, opened) = Store::open(folder.path()).unwrap();
    assert_eq!(opened.warnings().count(), 0);
    fill(&mut store, count);
    folder
}

fn numbers(store: &Store) -> Vec<u64> {
    store.history(None, 1_000).unwrap().iter().map(|entry| entry.number).collect()
}

#[test]
fn what_was_written_is_there_after_a_restart() {
    let parent = TempDir::new().unwrap();
    let folder = parent.path().join("not/there/yet");
    let (mut store, _) = Store::open(&folder).unwrap();
    fill(&mut store, 3);
    let before = (store.history(None, 9).unwrap(), store.last_good(&unit()).cloned());
    drop(store);
    let (store, opened) = Store::open(&folder).unwrap();
    assert_eq!((opened.entries, opened.warnings().count()), (3, 0));
    assert_eq!((store.history(None, 9).unwrap(), store.last_good(&unit()).cloned()), before);
    let digest = before.1.unwrap().digest;
    assert_eq!(store.document(&digest).unwrap().unwrap(), b"revision 3");
    assert_eq!(store.folder(), Some(folder.as_path()));
    assert_eq!(store.history(Some(&UnitId::new("ZLG-10").unwrap()), 9).unwrap(), []);
    let newest: Vec<_> = store.history(Some(&unit()), 2).unwrap().iter().map(|e| e.number).collect();
    assert_eq!(newest, [2, 3]);
}

#[test]
fn a_second_instance_is_told_who_holds_the_folder_and_changes_nothing() {
    let folder = filled(2);
    let (mut first, _) = Store::open(folder.path()).unwrap();
    let audit = folder.path().join("audit.jsonl");
    let text = fs::read_to_string(&audit).unwrap();

    let held = Store::open(folder.path()).unwrap_err();
    let StoreError::Held { holder, .. } = &held else { panic!("{held}") };
    assert!(holder.contains(&std::process::id().to_string()), "{holder}");
    assert!(held.to_string().contains(&folder.path().display().to_string()), "{held}");

    // By another name it is the same folder.
    let link = folder.path().join("link");
    symlink(folder.path(), &link).unwrap();
    assert!(matches!(Store::open(&link), Err(StoreError::Held { .. })));

    assert_eq!(fs::read_to_string(&audit).unwrap(), text);
    let digest = first.put_document(b"revision 1").unwrap();
    assert_eq!(first.document(&digest).unwrap().unwrap(), b"revision 1");
    drop(first);
    let (second, _) = Store::open(&link).unwrap();
    assert_eq!(numbers(&second), [1, 2]);
}

#[test]
fn a_linked_state_folder_is_the_folder_it_leads_to() {
    let folder = filled(2);
    let elsewhere = TempDir::new().unwrap();
    let link = elsewhere.path().join("state");
    symlink(folder.path(), &link).unwrap();
    let (mut store, opened) = Store::open(&link).unwrap();
    assert_eq!(opened.entries, 2);
    store.put_document(b"by way of the link").unwrap();
    drop(store);
    assert!(folder.path().join(format!("documents/{}.toml", Digest::of(b"by way of the link"))).is_file());

    let dangling = elsewhere.path().join("dangling");
    symlink(elsewhere.path().join("nowhere"), &dangling).unwrap();
    let circle = elsewhere.path().join("circle");
    symlink(&circle, &circle).unwrap();
    for link in [dangling, circle] {
        let error = Store::open(&link).unwrap_err();
        assert!(matches!(error, StoreError::Folder { .. }), "{error}");
    }
}

#[test]
fn a_folder_that_cannot_be_used_is_named_with_what_to_do() {
    let parent = TempDir::new().unwrap();
    let file = parent.path().join("file");
    fs::write(&file, "").unwrap();
    // The kernel's own folders refuse every user, root included.
    for path in [file.as_path(), &file.join("below"), Path::new("/proc/isotherm-state")] {
        let words = Store::open(path).unwrap_err().to_string();
        assert!(words.contains(&path.display().to_string()) && words.contains("`state`"), "{words}");
    }
    let kernel = Path::new("/sys/kernel");
    if kernel.is_dir() {
        let error = Store::open(kernel).unwrap_err();
        assert!(matches!(error, StoreError::Write { .. } | StoreError::Folder { .. }), "{error}");
        assert!(error.to_string().contains("/sys/kernel"), "{error}");
    }
}

#[test]
fn a_damaged_line_in_the_middle_is_skipped_counted_and_told_with_its_number() {
    let long = vec![b'#'; 1 << 20];
    for damage in [&b"{}"[..], b"", b"\xff\x00\xfe", b"no JSON", &long] {
        let folder = filled(5);
        let audit = folder.path().join("audit.jsonl");
        let bytes = fs::read(&audit).unwrap();
        let mut lines: Vec<&[u8]> = bytes.split_inclusive(|byte| *byte == b'\n').collect();
        let damaged = [damage, b"\n"].concat();
        lines[2] = &damaged;
        let text = lines.concat();
        fs::write(&audit, &text).unwrap();

        let (mut store, opened) = Store::open(folder.path()).unwrap();
        assert_eq!((opened.entries, opened.damaged, &opened.torn), (4, 1, &None));
        let warnings: Vec<_> = opened.warnings().collect();
        assert_eq!(warnings.len(), 1);
        assert!(warnings[0].starts_with(&format!("{}:3: ", audit.display())), "{warnings:?}");
        assert_eq!(numbers(&store), [1, 2, 4, 5]);
        assert_eq!(store.last_good(&unit()).unwrap().revision, 5);
        assert_eq!(store.by_revision(&unit(), 3), None);
        fill(&mut store, 1);
        assert_eq!(numbers(&store), [1, 2, 4, 5, 6]);
        assert!(fs::read(&audit).unwrap().starts_with(&text), "what was there stays as it is");
    }
}

#[test]
fn numbers_are_not_given_twice_when_the_last_line_is_damaged() {
    let folder = filled(3);
    let audit = folder.path().join("audit.jsonl");
    let text = fs::read_to_string(&audit).unwrap();
    let edited = text.replacen("\"number\":3", "\"number\":1", 1);
    assert_ne!(edited, text);
    fs::write(&audit, edited).unwrap();
    let (mut store, opened) = Store::open(folder.path()).unwrap();
    assert_eq!(opened.damaged, 1);
    fill(&mut store, 1);
    assert_eq!(numbers(&store), [1, 2, 4]);
}

#[test]
fn entries_of_a_newer_version_are_left_alone_and_their_numbers_kept() {
    let folder = filled(1);
    let audit = folder.path().join("audit.jsonl");
    let newer = {
        let text = fs::read_to_string(&audit).unwrap();
        let entry = AuditEntry { number: 40, ..AuditEntry::from_line(text.as_bytes()).unwrap() };
        let line = entry.to_line().unwrap();
        let json = line.replacen("\"event\":\"accepted\"", "\"event\":\"levitated\"", 1);
        let json = json.rsplit_once(",\"crc\"").unwrap().0.to_owned() + "}";
        let crc = crc32(json.as_bytes());
        format!("{text}{},\"crc\":\"{crc:08x}\"}}\n", json.strip_suffix('}').unwrap())
    };
    fs::write(&audit, &newer).unwrap();
    let (mut store, opened) = Store::open(folder.path()).unwrap();
    assert_eq!(opened.damaged, 1);
    let [Flaw::Damage { words, .. }] = &*opened.flaws else { panic!("{opened:?}") };
    insta::assert_snapshot!(words);
    fill(&mut store, 1);
    assert_eq!(numbers(&store), [1, 41]);
}

#[test]
fn a_stored_document_that_was_changed_is_an_error_that_names_its_file() {
    let folder = filled(1);
    let (mut store, _) = Store::open(folder.path()).unwrap();
    let digest = store.last_good(&unit()).unwrap().digest;
    let file = folder.path().join(format!("documents/{digest}.toml"));
    for (damage, length) in [("revision 2", 10), ("", 0), (&"x".repeat(2 << 20), 2 << 20)] {
        fs::write(&file, damage).unwrap();
        assert_eq!(fs::metadata(&file).unwrap().len(), length);
        let error = store.document(&digest).unwrap_err();
        assert!(matches!(error, StoreError::Corrupt { .. }), "{error}");
        assert!(error.to_string().contains(&file.display().to_string()), "{error}");
        // Whoever brings it again mends it.
        assert_eq!(store.put_document(b"revision 1").unwrap(), digest);
        assert_eq!(store.document(&digest).unwrap().unwrap(), b"revision 1");
    }
    fs::remove_file(&file).unwrap();
    assert_eq!(store.document(&digest).unwrap(), None);
    fs::create_dir(&file).unwrap();
    assert!(matches!(store.document(&digest), Err(StoreError::Read { .. })));
}

#[test]
fn what_a_crash_left_half_written_is_cleared_away() {
    let folder = filled(1);
    for name in ["documents/.new-x.toml", "overlays/.new-y.toml", ".new-audit.jsonl"] {
        fs::write(folder.path().join(name), "half").unwrap();
    }
    let (_, opened) = Store::open(folder.path()).unwrap();
    assert_eq!(opened.warnings().count(), 0);
    let left = |name: &str| {
        let entries = fs::read_dir(folder.path().join(name)).unwrap();
        entries.filter(|entry| entry.as_ref().unwrap().file_name().to_string_lossy().starts_with('.')).count()
    };
    assert_eq!([left(""), left("documents"), left("overlays")], [0, 0, 0]);
}

/// CRC-32 as in zlib, bit by bit: a check that does not rest on the library that the code uses.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc: u32, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    })
}

/// The audit file's lines.
fn lines(folder: &Path) -> Vec<String> {
    let text = fs::read_to_string(folder.join("audit.jsonl")).unwrap();
    text.split_inclusive('\n').map(ToOwned::to_owned).collect()
}

#[test]
fn lines_that_are_missing_in_the_middle_are_told_with_their_numbers() {
    let folder = filled(6);
    let mut kept = lines(folder.path());
    kept.drain(2..4);
    fs::write(folder.path().join("audit.jsonl"), kept.concat()).unwrap();
    let (_, opened) = Store::open(folder.path()).unwrap();
    let [Flaw::Gap { line: 3, first: 3, last: 4, .. }] = &*opened.flaws else { panic!("{opened:?}") };
    assert_eq!((opened.entries, opened.damaged, opened.warnings().count()), (4, 0, 1));
    assert_eq!(opened.losses, []);
}

#[test]
fn lines_that_are_missing_at_the_end_are_counted_and_no_revision_is_given_twice() {
    // Whether the file with the highest revision is lost too: no file, or an empty one.
    for (torn, mark) in [(0, "whole"), (20, "whole"), (0, "missing"), (0, "")] {
        let folder = filled(7);
        let file = folder.path().join("revisions.json");
        match mark {
            "whole" => {}
            "missing" => fs::remove_file(file).unwrap(),
            damaged => fs::write(file, damaged).unwrap(),
        }
        let all = lines(folder.path());
        let rest = all[4][..torn].to_owned();
        fs::write(folder.path().join("audit.jsonl"), all[..4].concat() + &rest).unwrap();
        let (mut store, opened) = Store::open(folder.path()).unwrap();
        assert_eq!(opened.torn.is_some(), torn > 0);
        match &*opened.losses {
            [Loss::Cut { last: 4, written: 7, .. }] if mark == "whole" => {}
            [Loss::Cut { last: 4, written: 7, .. }, Loss::Unmarked { floor: 1004, .. }]
                if mark != "whole" => {}
            others => panic!("{others:?}"),
        }
        assert_eq!(store.last_good(&unit()).unwrap().revision, 4);
        assert!(store.highest_revision(&unit()) >= 7);
        fill(&mut store, 1);
        assert_eq!(numbers(&store), [1, 2, 3, 4, 8]);
        drop(store);
        let (_, opened) = Store::open(folder.path()).unwrap();
        assert!(matches!(*opened.flaws, [Flaw::Gap { .. }]), "from now on it is a gap");
        assert_eq!(opened.losses, [], "the file with the highest revision was written anew");
    }
}

#[test]
fn a_line_that_a_crash_cut_in_mid_write_is_no_loss() {
    let folder = filled(3);
    let mut text = lines(folder.path()).concat();
    text.push_str(&lines(folder.path())[2][..30]);
    fs::write(folder.path().join("audit.jsonl"), text).unwrap();
    let (store, opened) = Store::open(folder.path()).unwrap();
    assert!(opened.torn.is_some() && opened.losses.is_empty() && opened.flaws.is_empty(), "{opened:?}");
    assert_eq!(store.highest_revision(&unit()), 3);
}

#[test]
fn a_pipe_in_the_place_of_a_file_is_told_and_not_waited_for() {
    let mut told = String::new();
    for name in ["audit.jsonl", "audit-5.jsonl", "revisions.json", "last-entry"] {
        let folder = TempDir::new().unwrap();
        let pipe = folder.path().join(name);
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        match Store::open(folder.path()) {
            Err(error) => told += &error.to_string().replace(folder.path().to_str().unwrap(), "\nFOLDER"),
            Ok((mut store, _)) => fill(&mut store, 2),
        }
    }
    let folder = filled(1);
    let (store, _) = Store::open(folder.path()).unwrap();
    let digest = store.last_good(&unit()).unwrap().digest;
    let file = folder.path().join(format!("documents/{digest}.toml"));
    fs::remove_file(&file).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(&file).status().unwrap().success());
    assert!(matches!(store.document(&digest), Err(StoreError::Read { .. })));
}
