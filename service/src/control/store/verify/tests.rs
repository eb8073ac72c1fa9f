//! Audit files as they are found: whole, of before, full, damaged by a crash, damaged on purpose.

use std::fs;
use std::time::{Duration, SystemTime};

use isotherm_protocol::control::Schedule;
use isotherm_protocol::history::chain::Fault;
use isotherm_protocol::history::{Acceptance, AuditEvent, CommandRecord, Source};
use isotherm_protocol::key::UnitId;
use tempfile::TempDir;

use super::*;
use crate::control::store::Store;

fn run(store: &mut Store, count: usize) {
    for _ in 0..count {
        let record = CommandRecord {
            command: "run".to_owned(),
            accepted: true,
            reason: None,
            state_before: "standby".to_owned(),
            state_after: "running".to_owned(),
            last_sequence: None,
            order: None,
        };
        let time = SystemTime::UNIX_EPOCH + Duration::from_secs(1_795_248_000);
        let unit = UnitId::new("ZLG-1").unwrap();
        store.append(time, Some(&unit), "ann", AuditEvent::Command(record)).unwrap();
    }
}

/// A folder with this many entries, from a service that has stopped.
fn written(count: usize) -> TempDir {
    let folder = TempDir::new().unwrap();
    run(&mut Store::open(folder.path()).unwrap().0, count);
    folder
}

fn lines(folder: &TempDir) -> Vec<String> {
    let text = fs::read_to_string(folder.path().join(NAME)).unwrap();
    text.split_inclusive('\n').map(ToOwned::to_owned).collect()
}

fn write(folder: &TempDir, lines: &[String]) {
    fs::write(folder.path().join(NAME), lines.concat()).unwrap();
}

fn verified(folder: &TempDir) -> Verification {
    verify(folder.path(), None).unwrap()
}

/// Whether it says that the entries up to it are missing, from whichever on.
fn is_missing(broken: &Break) -> bool {
    let of = |first, last| broken.words == Fault::Missing { first, last }.to_string();
    broken.number.is_some_and(|number| (1..number).any(|first| of(first, number - 1)))
}

/// The line as a version wrote it that knew of no digests.
fn bare(line: &str) -> String {
    AuditEntry::from_line(line.as_bytes()).unwrap().to_line().unwrap()
}

#[test]
fn what_a_service_has_written_holds_over_restarts_and_full_files() {
    let folder = TempDir::new().unwrap();
    let mut numbers = Vec::new();
    for round in 0..4 {
        let (mut store, _) = Store::open(folder.path()).unwrap();
        store.full_bytes = 600;
        run(&mut store, 20);
        // While the service is there, too.
        let found = verified(&folder);
        assert!(found.holds && found.files > 1, "round {round}: {:?}", found.breaks);
        numbers.push(found.head.unwrap().number);
        assert_eq!((found.entries, found.first, found.begins), (numbers[round], Some(1), Some(1)));
    }
    assert!(numbers.is_sorted() && numbers[3] > 80, "{numbers:?}");
    // The oldest files are removed in time; what is there still holds, and says where it begins.
    drop(Store::open(folder.path()).unwrap().0.keep(SystemTime::UNIX_EPOCH, [[0; 0]; 0], [[0; 0]; 0]));
    let full = full_files(folder.path()).unwrap();
    let found = verified(&folder);
    assert!(full.len() == KEPT_FILES && found.holds && found.first > Some(1), "{found:?}");
    // One in the middle is missed, and at the beginning too: it is not age that removed one of fewer files than are kept.
    fs::remove_file(&full[2]).unwrap();
    let found = verified(&folder);
    assert!(found.breaks.len() == 2 && found.breaks.iter().all(is_missing), "{found:?}");
    assert!(found.breaks.iter().all(|gap| gap.line == 1), "{found:?}");
}

#[test]
fn a_file_of_before_is_read_and_its_end_is_where_the_chain_begins() {
    let folder = written(5);
    let old: Vec<_> = lines(&folder).iter().map(|line| bare(line)).collect();
    write(&folder, &old);
    let found = verified(&folder);
    assert!(found.holds && found.begins.is_none() && found.head.is_none(), "{found:?}");
    let (mut store, opened) = Store::open(folder.path()).unwrap();
    assert_eq!((opened.entries, opened.warnings().count(), opened.losses.len()), (5, 0, 0));
    run(&mut store, 3);
    assert!(lines(&folder).concat().starts_with(&old.concat()), "what was there stays as it is");
    let found = verified(&folder);
    assert!(found.holds, "{:?}", found.breaks);
    assert_eq!((found.entries, found.first, found.begins), (8, Some(1), Some(6)));
    // It covers the last line of before.
    let mut changed = lines(&folder);
    let entry = AuditEntry { by: "eve".to_owned(), ..AuditEntry::from_line(old[4].as_bytes()).unwrap() };
    changed[4] = entry.to_line().unwrap();
    write(&folder, &changed);
    assert_eq!(verify(folder.path(), None).unwrap().breaks[0].number, Some(6));
}

#[test]
fn every_break_is_told_with_file_line_entry_unit_and_what_to_do() {
    let whole = lines(&written(6));
    let mut told = String::new();
    let mut with = |change: &dyn Fn(&mut Vec<String>)| {
        let folder = written(6);
        let mut changed = whole.clone();
        change(&mut changed);
        write(&folder, &changed);
        let found = verified(&folder);
        assert!(!found.holds);
        let breaks: String = found.breaks.iter().map(|broken| broken.to_string() + "\n").collect();
        told += &breaks.replace(folder.path().to_str().unwrap(), "FOLDER");
        let places = found.breaks.into_iter().map(|broken| (broken.line, broken.number.unwrap()));
        places.collect::<Vec<_>>()
    };
    assert_eq!(with(&|lines| lines[2] = lines[2].replace("\"ann\"", "\"eve\"")), [(3, 3)]);
    assert_eq!(with(&|lines| drop(lines.remove(2))), [(3, 4)]);
    assert_eq!(with(&|lines| lines.swap(2, 3)), [(3, 4), (4, 3)]);
    assert_eq!(with(&|lines| lines.insert(3, bare(&lines[3]))), [(4, 4)]);
    assert_eq!(with(&|lines| lines.truncate(4)), [(4, 4)]);
    insta::assert_snapshot!(told);
}

#[test]
fn a_chain_made_anew_is_found_by_a_digest_that_was_noted() {
    let folder = written(4);
    let noted = verified(&folder).head.unwrap();
    assert_eq!(noted.number, 4);
    let forged = written(6);
    let (own, other) = (lines(&folder), lines(&forged));
    assert_eq!(own[..4], other[..4], "the same entries have the same digests");
    assert!(verify(forged.path(), Some(noted.digest)).unwrap().holds);
    // Somebody who knows how it is made writes the third entry otherwise, and everything behind it.
    let mut chain = isotherm_protocol::history::chain::Chain::default();
    let anew: Vec<_> = own
        .iter()
        .map(|line| {
            let mut entry = AuditEntry::from_line(line.as_bytes()).unwrap();
            if entry.number == 3 {
                entry.by = "eve".to_owned();
            }
            chain.line(&entry).unwrap()
        })
        .collect();
    write(&folder, &anew);
    assert!(verified(&folder).holds, "the chain alone cannot tell");
    let found = verify(folder.path(), Some(noted.digest)).unwrap();
    let [Break { words, .. }] = &*found.breaks else { panic!("{found:?}") };
    assert!(words.contains(&noted.digest.to_string()), "{words}");
}

#[test]
fn what_a_crash_leaves_is_no_break() {
    let folder = written(3);
    let whole = lines(&folder).concat();
    let mut torn = whole.clone();
    torn.push_str(&lines(&folder)[2][..40]);
    fs::write(folder.path().join(NAME), &torn).unwrap();
    assert!(verified(&folder).holds, "it is being written, or was");
    let (mut store, opened) = Store::open(folder.path()).unwrap();
    assert!(opened.torn.is_some());
    run(&mut store, 1);
    assert!(verified(&folder).holds);
    // The line feed alone is missing.
    fs::write(folder.path().join(NAME), lines(&folder).concat().trim_end()).unwrap();
    let found_before = verified(&folder);
    assert!(found_before.holds && found_before.entries == 4);
    drop(store);
    let (mut store, _) = Store::open(folder.path()).unwrap();
    run(&mut store, 1);
    assert!(verified(&folder).holds && verified(&folder).entries == 5);
}

#[test]
fn a_damaged_line_stays_the_only_break_however_long_the_service_goes_on() {
    for damaged in [1, 3] {
        let folder = written(4);
        let mut changed = lines(&folder);
        changed[damaged] = changed[damaged].replace("running", "runs");
        write(&folder, &changed);
        let (mut store, opened) = Store::open(folder.path()).unwrap();
        assert_eq!(opened.damaged, 1);
        run(&mut store, 3);
        let found = verified(&folder);
        let line = damaged as u64 + 1;
        assert_eq!(found.breaks.iter().map(|broken| broken.line).collect::<Vec<_>>(), [line], "{found:?}");
    }
}

#[test]
fn files_that_others_take_away_are_missed() {
    let folder = written(3);
    let (mut store, _) = Store::open(folder.path()).unwrap();
    fs::remove_file(folder.path().join(NAME)).unwrap();
    run(&mut store, 1);
    let found = verified(&folder);
    let [gap] = &*found.breaks else { panic!("{found:?}") };
    assert!(is_missing(gap) && found.first == Some(4), "{gap}");
    drop(store);
    // While no service runs: the number tells.
    fs::write(folder.path().join(NAME), "").unwrap();
    run(&mut Store::open(folder.path()).unwrap().0, 1);
    let found = verified(&folder);
    let [gap] = &*found.breaks else { panic!("{found:?}") };
    assert!(is_missing(gap), "{gap}");
}

#[test]
fn a_folder_without_an_audit_file_is_an_error_that_names_it() {
    let folder = TempDir::new().unwrap();
    for path in [folder.path().to_owned(), folder.path().join("not/there")] {
        let error = verify(&path, None).unwrap_err().to_string();
        assert!(error.contains(&path.display().to_string()), "{error}");
    }
}

#[test]
fn a_document_that_can_be_rolled_back_to_and_was_altered_or_removed_is_told() {
    let folder = TempDir::new().unwrap();
    let unit = UnitId::new("ZLG-1").unwrap();
    let (mut store, _) = Store::open(folder.path()).unwrap();
    let on = |base: &str| {
        let base = Digest::of(base.as_bytes());
        format!(
            "schema = 1\noverlay_of = \"{base}\"\nunit = \"ZLG-1\"\n[[gyro]]\nname = \"x\"\n\
                 static_bias_change_deg_per_h = 0.031\nstatic_bias_sigma_deg_per_h = 0.004\n"
        )
    };
    let overlays = [on("base"), "gone".to_owned()];
    store.put_document(b"base").unwrap();
    for revision in 1..=3 {
        let digest = store.put_document(format!("text {revision}").as_bytes()).unwrap();
        let accepted = Acceptance {
            revision,
            digest,
            overlay: (revision > 1).then(|| {
                let [below, other] = &overlays;
                store.put_overlay(if revision == 2 { below } else { other }.as_bytes()).unwrap()
            }),
            source: Source::Bus,
            base: None,
            changed: Vec::new(),
            schedule: Schedule::NextTick,
            slew_ms: 0,
        };
        store.append(SystemTime::UNIX_EPOCH, Some(&unit), "ann", AuditEvent::Accepted(accepted)).unwrap();
    }
    assert!(verified(&folder).holds);
    let file = |shelf: &str, text: &str| {
        folder.path().join(shelf).join(format!("{}.toml", Digest::of(text.as_bytes())))
    };
    let [overlay, base] = [file("overlays", "gone"), file("documents", "base")];
    for file in [&overlay, &base] {
        fs::remove_file(file).unwrap();
    }
    let altered = file("documents", "text 1");
    fs::write(&altered, "text 2").unwrap();
    let found = verified(&folder);
    assert!(!found.holds && found.broken == 0, "{found:?}");
    let lost: Vec<_> = found.lost.iter().map(|lost| (&lost.file, &*lost.unit, lost.revision)).collect();
    let mut expected = [(&altered, "ZLG-1", 1), (&base, "ZLG-1", 2), (&overlay, "ZLG-1", 3)];
    expected.sort_unstable();
    assert_eq!(lost, expected);
}
