use std::time::Duration;

use super::*;
use crate::control::watch::folder::look;

const MS: Duration = Duration::from_millis(1);

fn settings() -> FolderSettings {
    FolderSettings { settle: MS * 100, ..FolderSettings::default() }
}

/// What a look at a file of this length sees.
fn sight(length: usize) -> Sight {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), vec![b'x'; length]).unwrap();
    look(file.path())
}

fn content(digest: u8) -> Content {
    Content { bytes: vec![digest], digest: Digest([digest; 32]), steady: true }
}

/// When (ms after `start`) the next file has settled.
fn due_ms(states: &FileStates, start: Instant) -> Option<u128> {
    states.next_due().map(|due| (due - start).as_millis())
}

#[test]
fn a_file_settles_anew_with_every_change_that_a_look_sees() {
    let (start, file) = (Instant::now(), Path::new("a.toml"));
    let mut states = FileStates::new(settings(), BTreeMap::new());
    let (half, whole) = (sight(1), sight(2));
    states.see(start, file, half.clone());
    states.see(start + MS * 60, file, half);
    assert_eq!(due_ms(&states, start), Some(100), "a look that sees nothing new changes nothing");
    states.see(start + MS * 90, file, whole);
    assert_eq!(due_ms(&states, start), Some(190));
    assert!(states.due(start + MS * 189).is_empty());
    assert_eq!(states.due(start + MS * 190), [file]);
    let event = states.read(start + MS * 190, file, Ok(content(1)));
    assert!(matches!(&event, Some(FolderEvent::Changed { bytes, .. }) if *bytes == [1]), "{event:?}");
    assert_eq!(due_ms(&states, start), None);
}

#[test]
fn a_file_that_never_settles_is_read_after_twenty_settling_times() {
    let (start, file) = (Instant::now(), Path::new("a.toml"));
    let mut states = FileStates::new(settings(), BTreeMap::new());
    for step in 0..40_u32 {
        states.see(start + MS * 50 * step, file, sight(step as usize));
        assert!(states.due(start + MS * 50 * step).is_empty());
    }
    assert_eq!(due_ms(&states, start), Some(2000));
    let unsteady = |digest| Ok(Content { steady: false, ..content(digest) });
    assert_eq!(states.read(start + MS * 1999, file, unsteady(1)), None, "it is written while it is read");
    assert_eq!(due_ms(&states, start), Some(2000));
    assert!(states.read(start + MS * 2000, file, unsteady(2)).is_some());
    states.see(start + MS * 2050, file, sight(99));
    assert_eq!(due_ms(&states, start), Some(2150), "patience begins anew");
}

#[test]
fn a_file_that_is_written_while_it_is_read_settles_anew() {
    let (start, file) = (Instant::now(), Path::new("a.toml"));
    let mut states = FileStates::new(settings(), BTreeMap::new());
    states.see(start, file, sight(1));
    let unsteady = Content { steady: false, ..content(1) };
    assert_eq!(states.read(start + MS * 100, file, Ok(unsteady)), None);
    assert_eq!(due_ms(&states, start), Some(200));
}

#[test]
fn a_file_that_is_away_within_the_grace_time_was_never_gone() {
    let (start, file) = (Instant::now(), Path::new("a.toml"));
    let known = BTreeMap::from([(file.to_owned(), Some(Digest([1; 32])))]);
    let mut states = FileStates::new(settings(), known);
    states.see(start, file, sight(1));
    assert_eq!(states.read(start + MS * 100, file, Ok(content(1))), None, "the owner knows it");
    states.see(start + MS * 1000, file, Sight::Absent);
    assert_eq!(due_ms(&states, start), Some(1200));
    states.see(start + MS * 1199, file, sight(2));
    assert_eq!(due_ms(&states, start), Some(1299));
    assert_eq!(states.read(start + MS * 1299, file, Ok(content(1))), None, "it is back as it was");
    states.see(start + MS * 2000, file, Sight::Absent);
    assert_eq!(states.removed(file), Some(FolderEvent::Removed { file: file.to_owned() }));
    states.see(start + MS * 2001, file, sight(3));
    assert!(states.read(start + MS * 2101, file, Ok(content(1))).is_some(), "back after it was told as gone");
}

#[test]
fn what_was_never_told_is_not_told_as_removed() {
    let (start, file) = (Instant::now(), Path::new("a.toml"));
    let mut states = FileStates::new(settings(), BTreeMap::new());
    states.see(start, file, sight(1));
    states.see(start + MS, file, Sight::Absent);
    assert_eq!(states.removed(file), None);
    assert_eq!(states.files().count(), 0, "nothing is kept of it");
}

#[test]
fn each_reason_is_told_once_and_the_end_of_it_with_the_old_content_too() {
    let (start, file) = (Instant::now(), Path::new("a.toml"));
    let mut states = FileStates::new(settings(), BTreeMap::new());
    let mut tell = |reading: Result<Content, &str>| {
        states.see(start, file, sight(1));
        states.read(start, file, reading.map_err(ToOwned::to_owned)).is_some()
    };
    let told =
        [Ok(content(1)), Err("no"), Err("no"), Err("never"), Ok(content(1)), Ok(content(1))].map(&mut tell);
    assert_eq!(told, [true, true, false, true, true, false]);
}

#[test]
fn settled_files_are_compared_in_turn() {
    let start = Instant::now();
    let mut states = FileStates::new(settings(), BTreeMap::new());
    let names = ["a", "b", "c", "d", "e"];
    let seen = sight(1);
    for name in names {
        states.see(start, Path::new(name), seen.clone());
    }
    assert!(states.next_to_compare(2).is_empty(), "none has settled");
    for name in names {
        states.read(start, Path::new(name), Ok(content(1)));
    }
    let mut turn =
        || states.next_to_compare(2).into_iter().map(|file| file.display().to_string()).collect::<String>();
    assert_eq!([turn(), turn(), turn(), turn()], ["ab", "cd", "ea", "bc"]);
    states.see(start, Path::new("d"), Sight::Absent);
    assert_eq!(states.next_to_compare(9).len(), 4);
    let told = |reading| states.is_told(Path::new("a"), &reading);
    assert!(told(Ok(content(1))));
    assert!(!told(Ok(content(2))) && !told(Err("no".to_owned())));
    assert!(!told(Ok(Content { steady: false, ..content(1) })));
}
