//! Events that do not come.

use std::os::unix::fs::symlink;
use std::sync::atomic::{AtomicUsize, Ordering};

use notify::{Config, Error, ErrorKind, Event, RecommendedWatcher, Watcher as _};

use super::*;

/// Waits, change by change, until a source of events has been made this often.
fn made_at_least(made: &AtomicUsize, count: usize, scene: &Scene) {
    // Every change that is told was found by a look later than the last one.
    let turn = |turn: usize| {
        let text = format!("turn {turn} of {count}");
        scene.write("turn.toml", &text);
        scene.expect(&scene.changed("turn.toml", &text));
        made.load(Ordering::SeqCst) >= count
    };
    assert!((0..20).any(turn), "the source of events is made anew");
}

#[test]
fn a_change_that_nothing_shows_is_found_by_its_content() {
    // Another text at every reading, always of the same stamp.
    let source = Path::new("/proc/sys/kernel/random/uuid");
    if !source.exists() {
        eprintln!("skipped: {} does not exist", source.display());
        return;
    }
    let scene = Scene::new(By::Poll, &[]);
    symlink(source, scene.path("a.toml")).unwrap();
    let mut contents = Vec::new();
    while contents.len() < 3 {
        let FolderEvent::Changed { file, bytes } = scene.next() else { panic!("not a change") };
        assert_eq!(file, scene.path("a.toml"));
        assert!(!contents.contains(&bytes));
        contents.push(bytes);
    }
}

#[test]
fn where_no_watch_is_granted_the_poll_does_the_work_until_one_is() {
    static MADE: AtomicUsize = AtomicUsize::new(0);
    let scene = Scene::with(
        By::Both.settings(),
        |folder, signals| match MADE.fetch_add(1, Ordering::SeqCst) {
            0 | 1 => Err(Error::new(ErrorKind::MaxFilesWatch)),
            2 => Err(Error::io(std::io::Error::from_raw_os_error(24))),
            _ => events::listener(folder, signals),
        },
        |_| {},
    );
    let told: Vec<_> = std::iter::repeat_with(|| scene.next_of_all()).take(3).collect();
    let words = |event: &FolderEvent, words| matches!(event, FolderEvent::Deaf(Some(reason)) if reason.contains(words));
    assert!(words(&told[0], "max_user_watches") && words(&told[1], "max_user_instances"), "{told:?}");
    assert_eq!(told[2], FolderEvent::Deaf(None));
    made_at_least(&MADE, 4, &scene);
    let made = MADE.load(Ordering::SeqCst);
    scene.expect_nothing();
    assert_eq!(MADE.load(Ordering::SeqCst), made, "one that works is kept");
}

#[test]
fn the_source_of_events_follows_a_link_that_is_switched() {
    static MADE: AtomicUsize = AtomicUsize::new(0);
    let scene = Scene::with(
        By::Both.settings(),
        |folder, signals| {
            MADE.fetch_add(1, Ordering::SeqCst);
            events::listener(folder, signals)
        },
        |folder| {
            fs::remove_dir(folder).unwrap();
            for version in ["v1", "v2"] {
                fs::create_dir(folder.with_file_name(version)).unwrap();
            }
            symlink("v1", folder).unwrap();
        },
    );
    made_at_least(&MADE, 1, &scene);
    let beside = scene.folder.with_file_name("beside");
    symlink("v2", &beside).unwrap();
    fs::rename(&beside, &scene.folder).unwrap();
    made_at_least(&MADE, 2, &scene);
}

#[test]
fn a_source_of_events_that_died_is_replaced() {
    static MADE: AtomicUsize = AtomicUsize::new(0);
    let scene = Scene::with(
        By::Both.settings(),
        |folder, signals| match MADE.fetch_add(1, Ordering::SeqCst) {
            0 => {
                let die = |_: notify::Result<Event>| panic!("on purpose: the library's thread ends");
                RecommendedWatcher::new(die, Config::default())
            }
            _ => events::listener(folder, signals),
        },
        |_| {},
    );
    made_at_least(&MADE, 2, &scene);
    assert!(!scene.watcher.thread.is_finished());
    scene.expect_nothing();
}

#[test]
fn a_source_of_events_that_says_so_is_replaced() {
    static MADE: AtomicUsize = AtomicUsize::new(0);
    // No poll: only the word of the source can make it look.
    let scene = Scene::with(
        By::Events.settings(),
        |folder, signals| match MADE.fetch_add(1, Ordering::SeqCst) {
            0 => {
                let end = move |_: notify::Result<Event>| signals.give(|heard| heard.deaf = true);
                RecommendedWatcher::new(end, Config::default())
            }
            _ => events::listener(folder, signals),
        },
        |folder| fs::write(folder.join("a.toml"), "old").unwrap(),
    );
    scene.expect(&scene.changed("a.toml", "old"));
    scene.write("a.toml", "new");
    scene.expect(&scene.changed("a.toml", "new"));
    assert_eq!(MADE.load(Ordering::SeqCst), 2);
    scene.expect_nothing();
}
