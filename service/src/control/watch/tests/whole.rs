//! The folder as a whole, and what is known of it before.

use std::collections::BTreeSet;
use std::os::unix::fs::symlink;

use super::*;

#[test]
fn five_hundred_files_are_told_each_once() {
    either_way(|by| {
        let scene = Scene::new(by, &[]);
        for text in ["old", "new"] {
            let mut expected = BTreeSet::new();
            for number in 0..500 {
                let (name, text) = (format!("a{number:03}.toml"), format!("{text} {number}"));
                scene.write(&name, &text);
                expected.insert((scene.path(&name), text.into_bytes()));
            }
            for _ in 0..500 {
                let FolderEvent::Changed { file, bytes } = scene.next() else { panic!("not a change") };
                assert!(expected.remove(&(file.clone(), bytes)), "{} told twice", file.display());
            }
        }
        scene.expect_nothing();
    });
}

#[test]
fn a_folder_that_is_away_removes_no_file() {
    either_way(|by| {
        let scene = Scene::new(by, &[("a.toml", "same"), ("b.toml", "old"), ("c.toml", "gone")]);
        fs::remove_dir_all(&scene.folder).unwrap();
        match scene.next() {
            FolderEvent::Away(Some(reason)) => assert!(reason.contains("os error 2)"), "{reason}"),
            other => panic!("{other:?}"),
        }
        fs::write(&scene.folder, "a file").unwrap();
        match scene.next() {
            FolderEvent::Away(Some(reason)) => assert!(reason.contains("os error 20)"), "{reason}"),
            other => panic!("{other:?}"),
        }
        fs::remove_file(&scene.folder).unwrap();
        let beside = scene.temporary.path().join("beside");
        fs::create_dir(&beside).unwrap();
        for (name, text) in [("a.toml", "same"), ("b.toml", "new"), ("z-first.toml", "first")] {
            fs::write(beside.join(name), text).unwrap();
        }
        fs::rename(&beside, &scene.folder).unwrap();
        scene.expect(&FolderEvent::Away(None));
        // Two files that have nothing to do with each other: a watcher that was held up tells them in either order.
        let (changed, removed) = (scene.changed("b.toml", "new"), scene.removed("c.toml"));
        let told = [scene.next(), scene.next()];
        assert!(told.contains(&changed) && told.contains(&removed), "{told:?}");
        scene.expect_nothing();
    });
}

#[test]
fn a_folder_replaced_within_the_grace_time_was_never_gone() {
    either_way(|by| {
        let scene = Scene::new(by, &[("a.toml", "same"), ("b.toml", "old")]);
        let (new, old) = (scene.temporary.path().join("new"), scene.temporary.path().join("old"));
        fs::create_dir(&new).unwrap();
        for (name, text) in [("a.toml", "same"), ("b.toml", "new"), ("z-first.toml", "first")] {
            fs::write(new.join(name), text).unwrap();
        }
        fs::rename(&scene.folder, &old).unwrap();
        fs::rename(&new, &scene.folder).unwrap();
        scene.expect(&scene.changed("b.toml", "new"));
        fs::write(old.join("a.toml"), "nobody looks here").unwrap();
        scene.expect_nothing();
    });
}

#[test]
fn a_folder_that_is_a_link_may_be_switched() {
    for by in [By::Poll, By::Both] {
        let scene = Scene::with(by.settings(), by.listener(), |folder| {
            fs::remove_dir(folder).unwrap();
            let home = folder.parent().unwrap();
            for (version, text) in [("v1", "old"), ("v2", "new")] {
                fs::create_dir(home.join(version)).unwrap();
                fs::write(home.join(version).join("a.toml"), text).unwrap();
                fs::write(home.join(version).join("b.toml"), "same").unwrap();
            }
            symlink("v1", folder).unwrap();
        });
        scene.expect(&scene.changed("a.toml", "old"));
        scene.expect(&scene.changed("b.toml", "same"));
        let beside = scene.temporary.path().join("beside");
        symlink("v2", &beside).unwrap();
        fs::rename(&beside, &scene.folder).unwrap();
        scene.expect(&scene.changed("a.toml", "new"));
        scene.expect_nothing();
    }
}

#[test]
fn a_folder_that_is_missing_at_the_start_is_watched_when_it_appears() {
    either_way(|by| {
        let scene = Scene::with(by.settings(), by.listener(), |folder| fs::remove_dir(folder).unwrap());
        assert!(matches!(scene.next(), FolderEvent::Away(Some(_))));
        fs::create_dir(&scene.folder).unwrap();
        scene.expect(&FolderEvent::Away(None));
        scene.write("a.toml", "text");
        scene.expect(&scene.changed("a.toml", "text"));
    });
}

#[test]
fn what_the_owner_knows_is_not_told_again() {
    either_way(|by| {
        let temporary = TempDir::new().unwrap();
        let path = |name: &str| temporary.path().join(name);
        let digest = |text: &str| Some(Digest::of(text.as_bytes()));
        for (name, text) in [("a.toml", "same"), ("b.toml", "new"), ("d.toml", "unknown")] {
            fs::write(path(name), text).unwrap();
        }
        for name in ["e.toml", "f.toml"] {
            symlink(".nowhere", path(name)).unwrap();
        }
        let known = BTreeMap::from([
            (path("a.toml"), digest("same")),
            (path("b.toml"), digest("old")),
            (path("c.toml"), digest("gone")),
            (path("e.toml"), None),
            (path("f.toml"), digest("readable")),
        ]);
        let (sink, told) = channel();
        let sink = move |event| match event {
            FolderEvent::Deaf(_) => {}
            event => sink.send(event).unwrap(),
        };
        let watcher =
            Watcher::start_with(temporary.path(), by.settings(), known, sink, by.listener()).unwrap();
        let next = || told.recv_timeout(Duration::from_secs(10)).unwrap();
        let change = |event| match event {
            FolderEvent::Changed { file, bytes } => (file, String::from_utf8(bytes).unwrap()),
            other => panic!("{other:?}"),
        };
        assert_eq!(change(next()), (path("b.toml"), "new".to_owned()));
        assert_eq!(change(next()), (path("d.toml"), "unknown".to_owned()));
        assert_eq!(next(), FolderEvent::Removed { file: path("c.toml") });
        assert!(matches!(next(), FolderEvent::Unreadable { file, .. } if file == path("f.toml")));
        fs::write(path(".nowhere"), "somewhere").unwrap();
        assert_eq!(change(next()), (path("e.toml"), "somewhere".to_owned()));
        assert_eq!(change(next()), (path("f.toml"), "somewhere".to_owned()));
        assert!(watcher.stop());
        assert!(told.try_recv().is_err());
    });
}

#[test]
fn the_files_that_count_are_listed_by_name() {
    let temporary = TempDir::new().unwrap();
    let path = |name: &str| temporary.path().join(name);
    for name in ["b.toml", "a.toml", ".c.toml", "d.txt", "e"] {
        fs::write(path(name), name).unwrap();
    }
    fs::create_dir(path("f.toml")).unwrap();
    for (name, target) in [
        ("g.toml", "f.toml"),
        ("h.toml", "nowhere"),
        ("i.toml", "i.toml"),
        ("j.toml", "/dev/zero"),
        ("k.toml", "d.txt"),
    ] {
        symlink(target, path(name)).unwrap();
    }
    let listed = files_in(temporary.path(), "toml").unwrap();
    assert_eq!(listed, ["a.toml", "b.toml", "h.toml", "i.toml", "j.toml", "k.toml"].map(path));
    let nowhere = files_in(&path("nowhere"), "toml");
    assert!(nowhere.is_err_and(|error| error.kind() == std::io::ErrorKind::NotFound));
}
