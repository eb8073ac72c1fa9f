//! How watching ends.

use std::sync::mpsc::sync_channel;

use super::*;

#[test]
fn stopping_ends_the_thread_at_once() {
    either_way(|by| {
        let Scene { watcher, told, .. } = Scene::new(by, &[("a.toml", "old")]);
        assert!(!watcher.thread.is_finished());
        assert!(watcher.stop());
        // The sink is gone with the thread.
        assert_eq!(told.recv(), Err(std::sync::mpsc::RecvError));
    });
}

#[test]
fn dropping_ends_the_thread() {
    let Scene { watcher, told, .. } = Scene::new(By::Events, &[]);
    drop(watcher);
    assert_eq!(told.recv(), Err(std::sync::mpsc::RecvError));
}

#[test]
fn a_thread_that_is_held_is_left_behind_within_its_limit() {
    let temporary = TempDir::new().unwrap();
    fs::write(temporary.path().join("a.toml"), "text").unwrap();
    let (told, called) = channel();
    // Nobody takes what goes in here, until it is dropped.
    let (hold, taker) = sync_channel::<()>(0);
    let sink = move |_| {
        told.send(()).unwrap();
        let _ = hold.send(());
    };
    let settings = By::Events.settings();
    let watcher = Watcher::start(temporary.path(), settings, BTreeMap::new(), sink).unwrap();
    called.recv_timeout(Duration::from_secs(10)).unwrap();
    let start = Instant::now();
    assert!(!watcher.stop());
    assert!(start.elapsed() < STOP_LIMIT * 2, "{:?}", start.elapsed());
    drop(taker);
    assert_eq!(called.recv(), Err(std::sync::mpsc::RecvError), "let go, it ends");
}

#[test]
fn a_sink_that_panics_ends_the_watching_and_nothing_else() {
    let temporary = TempDir::new().unwrap();
    fs::write(temporary.path().join("a.toml"), "text").unwrap();
    let settings = By::Events.settings();
    let watcher =
        Watcher::start(temporary.path(), settings, BTreeMap::new(), |_| panic!("on purpose")).unwrap();
    let limit = Instant::now() + Duration::from_secs(10);
    while !watcher.thread.is_finished() {
        assert!(Instant::now() < limit);
        std::thread::yield_now();
    }
    assert!(watcher.stop());
}
