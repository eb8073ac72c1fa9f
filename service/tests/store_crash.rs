//! The state folder after a crash: a last line cut at every byte, a process killed in mid-write, a file that cannot grow.

#![expect(clippy::unwrap_used, reason = "a test may panic, its helpers included")]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::SystemTime;

use isotherm_protocol::control::Schedule;
use isotherm_protocol::history::{Acceptance, AuditEntry, AuditEvent, Source};
use isotherm_protocol::key::UnitId;
use isotherm_service::control::store::{Opened, Store, Torn};
use tempfile::TempDir;

/// Names the state folder to the process that [`writes_until_it_is_stopped`] is run in.
const FOLDER: &str = "ISOTHERM_TEST_STATE";
/// How often a process is killed.
const KILLS: usize = 20;

fn unit() -> UnitId {
    UnitId::new("ZLG-1").unwrap()
}

/// Stores a document and accepts it as the next revision; gives the number of the entry.
fn accept(store: &mut Store) -> Result<u64, isotherm_service::control::store::StoreError> {
    let revision = store.highest_revision(&unit()) + 1;
    let digest = store.put_document(format!("revision {revision}").as_bytes())?;
    let accepted = Acceptance {
        revision,
        digest,
        overlay: None,
        source: Source::Bus,
        base: None,
        changed: (0..revision % 7).map(|n| format!("gyro.sensor[{n}].bias: 1.0 -> 1.5")).collect(),
        schedule: Schedule::NextTick,
        slew_ms: 0,
    };
    store.append(SystemTime::now(), Some(&unit()), "ann", AuditEvent::Accepted(accepted))
}

fn numbers(store: &Store) -> Vec<u64> {
    store.history(None, 10_000).unwrap().iter().map(|entry| entry.number).collect()
}

/// Whether a folder holds `1…` in whole lines, and a complete document for each.
fn check_whole(store: &Store) -> u64 {
    let numbers = numbers(store);
    let last = numbers.len() as u64;
    assert!(numbers.iter().copied().eq(1..=last), "{numbers:?}");
    for set in store.good_sets(&unit()) {
        let document = store.document(&set.digest).unwrap().unwrap();
        assert_eq!(document, format!("revision {}", set.revision).as_bytes());
    }
    last
}

#[test]
fn a_last_line_cut_at_any_byte_costs_at_most_that_line() {
    let written = TempDir::new().unwrap();
    let (mut store, _) = Store::open(written.path()).unwrap();
    for _ in 0..3 {
        accept(&mut store).unwrap();
    }
    drop(store);
    let whole = fs::read(written.path().join("audit.jsonl")).unwrap();
    let last = whole[..whole.len() - 1].iter().rposition(|byte| *byte == b'\n').unwrap() + 1;

    for cut in last..=whole.len() {
        let audit = written.path().join("audit.jsonl");
        fs::write(&audit, &whole[..cut]).unwrap();
        let (mut store, opened) = Store::open(written.path()).unwrap();
        let entries = if cut + 1 >= whole.len() { 3 } else { 2 };
        let torn = match whole.len() - cut {
            0 => None,
            1 => Some(Torn::Completed),
            _ if cut == last => None,
            _ => {
                let to = written.path().join("audit.torn-1");
                assert_eq!(fs::read(&to).unwrap(), whole[last..cut], "nothing is lost silently");
                Some(Torn::Moved { to, bytes: (cut - last) as u64 })
            }
        };
        assert_eq!(opened, Opened { entries, torn, ..Opened::default() }, "cut at {cut}");
        assert_eq!(accept(&mut store).unwrap(), entries + 1, "cut at {cut}");
        drop(store);

        let (store, opened) = Store::open(written.path()).unwrap();
        assert_eq!(opened, Opened { entries: entries + 1, ..Opened::default() }, "cut at {cut}");
        assert_eq!(check_whole(&store), entries + 1);
        let _ = fs::remove_file(written.path().join("audit.torn-1"));
    }
}

#[test]
fn a_file_that_lost_its_power_with_zeros_at_its_end_goes_on() {
    let folder = TempDir::new().unwrap();
    let audit = folder.path().join("audit.jsonl");
    for round in 1..=3_u64 {
        let (mut store, _) = Store::open(folder.path()).unwrap();
        assert_eq!(accept(&mut store).unwrap(), round);
        drop(store);
        let mut bytes = fs::read(&audit).unwrap();
        bytes.extend(vec![0; 300_000]);
        fs::write(&audit, bytes).unwrap();
        let (store, opened) = Store::open(folder.path()).unwrap();
        let to = folder.path().join(format!("audit.torn-{round}"));
        assert_eq!(opened.torn, Some(Torn::Moved { to, bytes: 300_000 }));
        assert_eq!((opened.damaged, check_whole(&store)), (0, round));
    }
}

/// Not a test: what the others run as a process of its own, and kill.
#[test]
#[ignore = "run by the tests that kill it"]
fn writes_until_it_is_stopped() {
    let Some(folder) = std::env::var_os(FOLDER) else { return };
    let (mut store, _) = Store::open(Path::new(&folder)).unwrap();
    loop {
        match accept(&mut store) {
            Ok(number) => println!("\nwritten {number}"),
            Err(error) => {
                println!("\nfailed {error}");
                return;
            }
        }
    }
}

/// The program and arguments that run [`writes_until_it_is_stopped`].
fn writer() -> Vec<String> {
    let program = std::env::current_exe().unwrap().to_str().unwrap().to_owned();
    let arguments = ["--exact", "writes_until_it_is_stopped", "--ignored", "--nocapture", "--test-threads=1"];
    std::iter::once(program).chain(arguments.map(ToOwned::to_owned)).collect()
}

#[test]
fn a_process_killed_in_mid_write_leaves_whole_lines_and_every_entry_it_reported() {
    let folder = TempDir::new().unwrap();
    let writer = writer();
    let mut told = 0;
    for kill in 0..KILLS {
        let mut child = Command::new(&writer[0])
            .args(&writer[1..])
            .env(FOLDER, folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut reports = BufReader::new(child.stdout.take().unwrap())
            .lines()
            .map_while(Result::ok)
            .filter_map(|line| line.strip_prefix("written ").and_then(|number| number.parse::<u64>().ok()));
        // A different number of entries each time, so that the kill falls at different moments of the next one.
        told = reports.by_ref().nth(kill % 5).unwrap();
        child.kill().unwrap();
        told = reports.last().unwrap_or(told);
        assert!(!child.wait().unwrap().success());

        let (store, opened) = Store::open(folder.path()).unwrap();
        assert_eq!(opened.damaged, 0, "{opened:?}");
        let last = check_whole(&store);
        assert!(last == told || last == told + 1, "{told} were reported, {last} are there");
        assert_eq!(store.last_good(&unit()).unwrap().revision, last);
        let text = fs::read_to_string(folder.path().join("audit.jsonl")).unwrap();
        assert!(text.lines().all(|line| AuditEntry::is_whole(line.as_bytes())));
    }
    assert!(told >= KILLS as u64);
}

#[test]
fn a_file_that_cannot_grow_keeps_its_whole_lines_and_the_failure_is_told() {
    let folder = TempDir::new().unwrap();
    // 20 blocks of 512 or 1024 bytes, as the shell counts; the signal is ignored, so that the write fails halfway instead.
    let output = Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 20; exec \"$0\" \"$@\""])
        .args(writer())
        .env(FOLDER, folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    let failed = said.lines().find(|line| line.starts_with("failed ")).unwrap();
    assert!(failed.contains("os error 27") && failed.contains("audit.jsonl"), "{failed}");
    let told = said.lines().filter(|line| line.starts_with("written ")).count() as u64;
    assert!(told > 10, "{said}");

    let (mut store, opened) = Store::open(folder.path()).unwrap();
    assert_eq!(opened, Opened { entries: told, ..Opened::default() });
    assert_eq!(accept(&mut store).unwrap(), told + 1);
    assert_eq!(check_whole(&store), told + 1);
}
