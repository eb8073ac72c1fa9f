//! Writes that fail, full audit files, and what the entries add up to.

use std::io::{self, ErrorKind};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use isotherm_protocol::control::{Order, Schedule};
use isotherm_protocol::history::{
    Acceptance, CommandRecord, FirstTick, Refusal, Source, Withdrawal, Withdrawn,
};
use tempfile::TempDir;

use super::*;
use crate::control::store::log::Sink;

fn at(seconds: u64) -> SystemTime {
    SystemTime::UNIX_EPOCH + Duration::from_secs(1_795_248_000 + seconds)
}

fn unit(serial: &str) -> UnitId {
    UnitId::new(serial).unwrap()
}

/// Keeps a document and accepts it; gives its digest.
fn accept(store: &mut Store, serial: &str, revision: u64, text: &str, source: Source) -> Digest {
    let digest = store.put_document(text.as_bytes()).unwrap();
    store.append(at(revision), Some(&unit(serial)), "ann", accepted(revision, digest, source)).unwrap();
    digest
}

fn accepted(revision: u64, digest: Digest, source: Source) -> AuditEvent {
    AuditEvent::Accepted(Acceptance {
        revision,
        digest,
        overlay: None,
        source,
        base: None,
        changed: Vec::new(),
        schedule: Schedule::NextTick,
        slew_ms: 0,
    })
}

fn refused(path: &str, text: &str) -> AuditEvent {
    AuditEvent::Refused(Refusal {
        rival: false,
        source: Source::Folder { path: path.to_owned() },
        digest: Digest::of(text.as_bytes()),
        problems: vec!["1:1: bad".to_owned()],
        count: 1,
    })
}

fn command(words: &str) -> AuditEvent {
    AuditEvent::Command(CommandRecord {
        command: words.to_owned(),
        accepted: true,
        reason: None,
        state_before: "standby".to_owned(),
        state_after: "standby".to_owned(),
        last_sequence: None,
        order: None,
    })
}

/// What the audit file of a folder holds, line by line.
fn numbers(folder: &Path) -> Vec<u64> {
    let text = std::fs::read_to_string(folder.join("audit.jsonl")).unwrap();
    text.lines().map(|line| AuditEntry::from_line(line.as_bytes()).unwrap().number).collect()
}

/// A file on a disk with little room, and a switch for a disk that cannot even cut.
#[derive(Debug)]
struct SmallDisk {
    file: std::fs::File,
    room: Arc<AtomicU64>,
    cuts: Arc<AtomicU64>,
}

impl Sink for SmallDisk {
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        let room = usize::try_from(self.room.load(Ordering::Relaxed)).unwrap();
        let fits = bytes.len().min(room);
        io::Write::write_all(&mut self.file, &bytes[..fits])?;
        self.room.fetch_sub(fits as u64, Ordering::Relaxed);
        if fits < bytes.len() { Err(ErrorKind::StorageFull.into()) } else { Ok(()) }
    }

    fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    fn cut(&self, length: u64) -> io::Result<()> {
        if self.cuts.load(Ordering::Relaxed) == 0 {
            return Err(ErrorKind::StorageFull.into());
        }
        self.file.set_len(length)
    }
}

/// Puts a store's audit file on a small disk: its room in bytes, and how many cuts go well (0: none).
fn on_small_disk(store: &mut Store) -> (Arc<AtomicU64>, Arc<AtomicU64>) {
    let Journal::Folder { path, log, .. } = &mut store.journal else { unreachable!() };
    let (room, cuts) = (Arc::new(AtomicU64::new(u64::from(u32::MAX))), Arc::new(AtomicU64::new(1)));
    let file = std::fs::File::options().append(true).open(path.join("audit.jsonl")).unwrap();
    log.sink = Box::new(SmallDisk { file, room: Arc::clone(&room), cuts: Arc::clone(&cuts) });
    (room, cuts)
}

#[test]
fn a_full_disk_costs_the_entry_that_did_not_fit_and_nothing_else() {
    let line = {
        let mut store = Store::in_memory();
        store.append(at(0), None, "", command("run")).unwrap();
        store.history(None, 1).unwrap()[0].to_line().unwrap().len() as u64
    };
    for (room_bytes, can_cut) in
        (0..line).step_by(24).chain([line - 1]).flat_map(|room| [(room, true), (room, false)])
    {
        let folder = TempDir::new().unwrap();
        let (mut store, _) = Store::open(folder.path()).unwrap();
        let (room, cuts) = on_small_disk(&mut store);
        store.append(at(0), None, "", command("run")).unwrap();

        room.store(room_bytes, Ordering::Relaxed);
        cuts.store(can_cut.into(), Ordering::Relaxed);
        let error = store.append(at(1), None, "", command("standby")).unwrap_err();
        assert!(error.to_string().contains("audit.jsonl"), "{error}");
        if can_cut {
            assert_eq!(numbers(folder.path()), [1], "{room_bytes} bytes left");
        }

        room.store(1 << 20, Ordering::Relaxed);
        cuts.store(1, Ordering::Relaxed);
        assert_eq!(store.append(at(2), None, "", command("run")).unwrap(), 2);
        assert_eq!(numbers(folder.path()), [1, 2], "{room_bytes} bytes left");
        drop(store);
        let (_, opened) = Store::open(folder.path()).unwrap();
        assert_eq!(opened, Opened { entries: 2, ..Opened::default() });
    }
}

#[test]
fn a_full_audit_file_is_put_aside_and_what_holds_is_carried_over() {
    let folder = TempDir::new().unwrap();
    let (mut store, _) = Store::open(folder.path()).unwrap();
    store.full_bytes = 4_000;
    let (one, two) = (unit("ZLG-1"), unit("ZLG-2"));
    let second = accept(&mut store, "ZLG-2", 1, "two", Source::Folder { path: "two.toml".to_owned() });
    store.append(at(1), None, "", refused("bad.toml", "bad")).unwrap();
    for revision in 1..=60 {
        accept(&mut store, "ZLG-1", revision, &format!("one {revision}"), Source::Bus);
        assert_eq!(store.by_revision(&one, revision).unwrap().revision, revision);
    }
    // Withdrawn at the very end: the counter must not be given a second time.
    let why = Withdrawn::Cancelled;
    let withdrawn = AuditEvent::Withdrawn(Withdrawal { revision: 60, why });
    store.append(at(61), Some(&one), "", withdrawn).unwrap();

    let aside: Vec<_> = std::fs::read_dir(folder.path())
        .unwrap()
        .filter(|entry| entry.as_ref().unwrap().file_name().to_string_lossy().starts_with("audit-"))
        .collect();
    assert!(aside.len() > 2, "{aside:?}");
    for entry in aside {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let last = AuditEntry::from_line(text.lines().last().unwrap().as_bytes()).unwrap();
        assert_eq!(path.file_name().unwrap().to_string_lossy(), format!("audit-{}.jsonl", last.number));
    }

    let shown = store.history(Some(&one), 5).unwrap();
    let after = shown[shown.len() - 2].number;
    assert_eq!(store.history_after(after, Some(&one), 5).unwrap(), shown[shown.len() - 1..]);
    assert_eq!(store.history_after(u64::MAX, Some(&one), 5).unwrap(), []);
    // A copy of it has a number of its own.
    let copy = AuditEntry { number: 7_000, ..shown[0].clone() };
    assert!(store.has_written(&one, &copy).unwrap());
    let other = AuditEntry { by: "somebody else".to_owned(), ..copy };
    assert!(!store.has_written(&one, &other).unwrap());
    let names: Vec<_> = shown.iter().map(|entry| entry.event.name()).collect();
    assert_eq!(names, ["accepted", "accepted", "accepted", "accepted", "withdrawn"]);
    // In the second round none of it stands in the two files that are read any more, but for what was carried over.
    for round in 0..2 {
        drop(store);
        let opened;
        (store, opened) = Store::open(folder.path()).unwrap();
        store.full_bytes = 4_000;
        assert_eq!(opened.damaged, 0);
        assert_eq!(store.last_good(&one).unwrap().revision, 59);
        assert_eq!(store.previous(&one).unwrap().revision, 58);
        assert_eq!(store.highest_revision(&one), 60);
        assert_eq!(store.last_good(&two).unwrap().digest, second);
        assert_eq!(store.said_by_folder(&two), Some(second));
        assert_eq!(store.refused_in_folder("bad.toml"), Some(Digest::of(b"bad")));
        let expected = if round == 0 { &shown[..] } else { &[] };
        assert_eq!(store.history(Some(&one), 5).unwrap(), expected);
        for second in 0..60 {
            store.append(at(100 + second), Some(&two), "", command("run")).unwrap();
        }
    }
}

#[test]
fn the_numbers_of_entries_are_consecutive_over_all_files() {
    let folder = TempDir::new().unwrap();
    let (mut store, _) = Store::open(folder.path()).unwrap();
    store.full_bytes = 1_500;
    accept(&mut store, "ZLG-1", 1, "one", Source::Bus);
    for second in 0..50 {
        store.append(at(second), Some(&unit("ZLG-1")), "ann", command("run")).unwrap();
    }
    let files: Vec<_> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "jsonl"))
        .collect();
    let mut all: Vec<_> = files
        .iter()
        .flat_map(|path| {
            let text = std::fs::read_to_string(path).unwrap();
            text.lines()
                .map(|line| AuditEntry::from_line(line.as_bytes()).unwrap().number)
                .collect::<Vec<_>>()
        })
        .collect();
    all.sort_unstable();
    assert_eq!(all, (1..=all.len() as u64).collect::<Vec<_>>());
    assert!(files.len() > 3 && all.len() > 51, "{} files, {} entries", files.len(), all.len());
}

#[test]
fn a_crash_between_putting_aside_and_beginning_anew_loses_nothing() {
    let folder = TempDir::new().unwrap();
    let (mut store, _) = Store::open(folder.path()).unwrap();
    accept(&mut store, "ZLG-1", 1, "one", Source::Bus);
    let last = accept(&mut store, "ZLG-1", 2, "two", Source::Bus);
    drop(store);
    std::fs::rename(folder.path().join("audit.jsonl"), folder.path().join("audit-2.jsonl")).unwrap();
    std::fs::write(folder.path().join(".new-audit.jsonl"), "half of it").unwrap();

    let (mut store, opened) = Store::open(folder.path()).unwrap();
    assert_eq!(opened, Opened { entries: 2, ..Opened::default() });
    assert_eq!(store.last_good(&unit("ZLG-1")).unwrap().digest, last);
    assert!(!folder.path().join(".new-audit.jsonl").exists());
    assert_eq!(store.append(at(3), Some(&unit("ZLG-1")), "", command("run")).unwrap(), 4);
    assert_eq!(numbers(folder.path()), [3, 4], "the new file begins with what was carried over");
}

#[test]
fn an_audit_file_that_others_remove_or_change_is_begun_anew_with_all_that_holds() {
    let damages: [fn(&Path); 3] = [
        |path| std::fs::remove_file(path).unwrap(),
        |path| std::fs::write(path, "").unwrap(),
        |path| std::fs::write(path, "my notes\n").unwrap(),
    ];
    for damage in damages {
        let folder = TempDir::new().unwrap();
        let (mut store, _) = Store::open(folder.path()).unwrap();
        let digest = accept(&mut store, "ZLG-1", 1, "one", Source::Bus);
        assert_eq!(store.changed_by_others(), None);
        damage(&folder.path().join("audit.jsonl"));
        assert_eq!(store.append(at(2), Some(&unit("ZLG-1")), "", command("run")).unwrap(), 3);
        assert_eq!(numbers(folder.path()), [2, 3]);
        assert!(store.changed_by_others().is_some());
        drop(store);
        let (store, _) = Store::open(folder.path()).unwrap();
        assert_eq!(store.last_good(&unit("ZLG-1")).unwrap().digest, digest);
    }
}

#[test]
fn a_rollback_goes_back_and_a_second_one_further_back() {
    let mut store = Store::in_memory();
    let one = unit("ZLG-1");
    assert_eq!(store.previous(&one), None);
    for (revision, text) in [(1, "a"), (2, "b"), (3, "b"), (4, "c")] {
        accept(&mut store, "ZLG-1", revision, text, Source::Bus);
    }
    let roll_back = |store: &mut Store, revision: u64| {
        let to = store.previous(&one).unwrap().clone();
        let event = accepted(revision, to.digest, Source::Rollback { to: to.revision });
        store.append(at(revision), Some(&one), "ann", event).unwrap();
        store.document(&to.digest).unwrap().unwrap()
    };
    assert_eq!(roll_back(&mut store, 5), b"b");
    assert_eq!(roll_back(&mut store, 6), b"a");
    assert_eq!(store.previous(&one), None, "nothing is further back");
    accept(&mut store, "ZLG-1", 7, "d", Source::Bus);
    assert_eq!(roll_back(&mut store, 8), b"a");
    assert_eq!(store.last_good(&one).unwrap().revision, 8);
}

#[test]
fn a_withdrawn_revision_is_no_good_set_and_one_in_force_says_so() {
    let mut store = Store::in_memory();
    let one = unit("ZLG-1");
    accept(&mut store, "ZLG-1", 1, "a", Source::Bus);
    let first = FirstTick { revision: 1, series: 1, first_sequence: 40, first_end_time_ns: 9 };
    store.append(at(1), Some(&one), "", AuditEvent::InForce(first)).unwrap();
    accept(&mut store, "ZLG-1", 2, "b", Source::Bus);
    assert!(!store.last_good(&one).unwrap().in_force);
    let why = Withdrawn::Superseded { by_revision: 3 };
    let withdrawn = AuditEvent::Withdrawn(Withdrawal { revision: 2, why });
    store.append(at(2), Some(&one), "", withdrawn).unwrap();
    let last = store.last_good(&one).unwrap();
    assert!(last.in_force && last.revision == 1);
    assert_eq!((store.by_revision(&one, 2), store.highest_revision(&one)), (None, 2));
    assert_eq!(store.units().collect::<Vec<_>>(), [&one]);
    assert_eq!(store.last_good(&unit("ZLG-2")), None);
}

#[test]
fn what_is_not_stored_cannot_be_accepted() {
    let folder = TempDir::new().unwrap();
    for mut store in [Store::in_memory(), Store::open(folder.path()).unwrap().0] {
        let one = unit("ZLG-1");
        let digest = Digest::of(b"a");
        let event = accepted(1, digest, Source::Bus);
        let refused = store.append(at(1), Some(&one), "", event.clone());
        assert!(matches!(refused, Err(StoreError::NotStored { digest: named }) if named == digest));
        store.put_document(b"a").unwrap();
        assert_eq!(store.append(at(1), Some(&one), "", event.clone()).unwrap(), 1);

        let AuditEvent::Accepted(accepted) = event else { unreachable!() };
        let overlay = Some(Digest::of(b"overlay"));
        let event = AuditEvent::Accepted(Acceptance { revision: 2, overlay, ..accepted });
        assert!(store.append(at(2), Some(&one), "", event.clone()).is_err());
        store.put_overlay(b"overlay").unwrap();
        assert_eq!(store.append(at(2), Some(&one), "", event).unwrap(), 2);
        assert_eq!(store.previous(&one).unwrap().revision, 1, "the overlay makes the difference");
    }
}

#[test]
fn without_a_folder_memory_stays_bounded_and_the_newest_is_kept() {
    let mut store = Store::in_memory();
    let megabyte = |n: u8| vec![n; 1 << 20];
    for n in 0..80 {
        store.put_document(&megabyte(n)).unwrap();
    }
    assert_eq!(store.document(&Digest::of(&megabyte(0))).unwrap(), None);
    assert_eq!(store.document(&Digest::of(&megabyte(79))).unwrap(), Some(megabyte(79)));
    assert!(matches!(store.put_document(&vec![0; (1 << 20) + 1]), Err(StoreError::TooLong { .. })));
    for second in 0..2_000 {
        let of = if second % 2 == 0 { "ZLG-1" } else { "ZLG-2" };
        store.append(at(second), Some(&unit(of)), "", command("run")).unwrap();
    }
    assert_eq!(store.history(None, usize::MAX).unwrap().len(), 1_000);
    let numbers: Vec<_> =
        store.history(Some(&unit("ZLG-1")), 2).unwrap().iter().map(|entry| entry.number).collect();
    assert_eq!(numbers, [1_997, 1_999]);
    assert_eq!(store.folder(), None);
}

#[test]
fn what_is_forgotten_is_gone_and_its_numbers_are_not_given_again() {
    let folder = TempDir::new().unwrap();
    let (mut store, _) = Store::open(folder.path()).unwrap();
    let one = unit("ZLG-1");
    accept(&mut store, "ZLG-1", 4, "a", Source::Folder { path: "/a.toml".to_owned() });
    accept(&mut store, "ZLG-2", 1, "b", Source::Bus);
    let AuditEvent::Command(record) = command("forget") else { unreachable!() };
    let forget = AuditEvent::Command(CommandRecord { order: Some(Order::Forget), ..record });
    store.append(at(9), Some(&one), "ann", forget).unwrap();
    for _ in 0..2 {
        assert_eq!(store.units().collect::<Vec<_>>(), [&unit("ZLG-2")]);
        assert_eq!((store.last_good(&one), store.said_by_folder(&one)), (None, None));
        let is_file = |(_, event)| matches!(event, AuditEvent::CarriedFile(_));
        assert_eq!((store.index.carried().any(is_file), store.highest_revision(&one)), (false, 4));
        drop(store);
        store = Store::open(folder.path()).unwrap().0;
    }
}

#[test]
fn the_wish_of_an_operator_goes_over_to_a_new_audit_file() {
    let folder = TempDir::new().unwrap();
    let (mut store, _) = Store::open(folder.path()).unwrap();
    let one = unit("ZLG-1");
    store.append(at(1), Some(&one), "ann", command("standby")).unwrap();
    store.full_bytes = 1;
    store.append(at(2), Some(&unit("ZLG-2")), "ann", command("run")).unwrap();
    store.append(at(3), Some(&unit("ZLG-2")), "ann", command("run")).unwrap();
    drop(store);
    let (store, _) = Store::open(folder.path()).unwrap();
    assert_eq!(store.intent(&one).unwrap().orders().collect::<Vec<_>>(), [Order::Standby]);
}

#[test]
fn old_audit_files_and_documents_that_nothing_goes_back_to_are_removed() {
    let folder = TempDir::new().unwrap();
    let (mut store, _) = Store::open(folder.path()).unwrap();
    let one = unit("ZLG-1");
    let in_force = accept(&mut store, "ZLG-1", 1, "in force", Source::Bus);
    let [old, new] = ["old", "new"].map(|text| store.put_document(text.as_bytes()).unwrap());
    let day = Duration::from_secs(86_400);
    for (digest, days) in [(in_force, 200), (old, 91), (new, 89)] {
        let file = store.documents.file(&digest).unwrap();
        std::fs::File::options().write(true).open(file).unwrap().set_modified(at(0) - day * days).unwrap();
    }
    store.full_bytes = 1;
    for second in 0..40 {
        store.append(at(second), Some(&one), "", command("run")).unwrap();
    }
    let full_files = || log::full_files(folder.path()).unwrap();
    let newest = full_files().pop();
    let none = || std::iter::empty::<Vec<u8>>();
    assert!(full_files().len() > 20);
    assert!(!store.keep(at(0), none(), none()).unwrap());
    assert_eq!((full_files().len(), full_files().pop()), (16, newest));
    let kept = [in_force, old, new].map(|digest| store.document(&digest).unwrap().is_some());
    assert_eq!(kept, [true, false, true]);
    drop(store);
    let (store, opened) = Store::open(folder.path()).unwrap();
    assert_eq!((store.last_good(&one).unwrap().revision, opened.warnings().count()), (1, 0));
}

#[test]
fn a_folder_in_the_place_of_the_state_folder_knows_the_last_entry_too() {
    let place = TempDir::new().unwrap();
    let folder = place.path().join("state");
    let (mut store, _) = Store::open(&folder).unwrap();
    for serial in ["ZLG-1", "ZLG-2", "ZLG-3"] {
        accept(&mut store, serial, 1, "one", Source::Bus);
    }
    std::fs::rename(&folder, place.path().join("away")).unwrap();
    std::fs::create_dir(&folder).unwrap();
    assert!(store.keep(at(1), [b"one"], std::iter::empty::<Vec<u8>>()).unwrap());
    drop(store);
    assert_eq!(numbers(&folder), [4, 5, 6]);
    let text = std::fs::read_to_string(folder.join("audit.jsonl")).unwrap();
    std::fs::write(folder.join("audit.jsonl"), text.split_inclusive('\n').next().unwrap()).unwrap();
    let (_, opened) = Store::open(&folder).unwrap();
    assert!(matches!(*opened.losses, [Loss::Cut { last: 4, written: 6, .. }]), "{opened:?}");
}

/// What another instance says its stream was ordered is compared with it.
#[test]
fn the_last_command_of_a_stream_is_no_rollback_and_no_end_of_a_calibration() {
    let (mut store, one) = (Store::in_memory(), unit("ZLG-1"));
    assert!(store.last_command(&one).is_none());
    let rollback = CommandRecord {
        command: "rollback".to_owned(),
        accepted: true,
        reason: None,
        state_before: "standby".to_owned(),
        state_after: "standby".to_owned(),
        last_sequence: None,
        order: Some(Order::Rollback { revision: None, dry_run: false }),
    };
    let events = [command("run"), AuditEvent::Command(rollback), command("pre-launch ended")];
    for event in events {
        store.append(at(1), Some(&one), "", event).unwrap();
        assert_eq!(store.last_command(&one).unwrap().command, "run");
    }
    store.append(at(2), Some(&one), "", command("standby")).unwrap();
    assert_eq!(store.last_command(&one).unwrap().command, "standby");
}
