//! What happens to one file.

use std::fs::File;
use std::io::Write;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::time::SystemTime;

use isotherm_protocol::document::MAX_DOCUMENT_BYTES;

use super::*;

#[test]
fn a_file_written_in_place_is_one_change() {
    either_way(|by| {
        let scene = Scene::new(by, &[("a.toml", "old")]);
        scene.write("a.toml", "new");
        scene.expect(&scene.changed("a.toml", "new"));
        scene.expect_nothing();
    });
}

#[test]
fn a_file_renamed_over_another_is_one_change() {
    either_way(|by| {
        let scene = Scene::new(by, &[("a.toml", "old")]);
        scene.write(".a.toml.tmp", "new");
        fs::rename(scene.path(".a.toml.tmp"), scene.path("a.toml")).unwrap();
        scene.expect(&scene.changed("a.toml", "new"));
        scene.expect_nothing();
    });
}

#[test]
fn a_file_deleted_and_written_anew_is_one_change() {
    either_way(|by| {
        let scene = Scene::new(by, &[("a.toml", "old"), ("b.toml", "same")]);
        for (name, text) in [("a.toml", "new"), ("b.toml", "same")] {
            fs::remove_file(scene.path(name)).unwrap();
            scene.write(name, text);
        }
        scene.expect(&scene.changed("a.toml", "new"));
        scene.expect_nothing();
    });
}

#[test]
fn a_file_written_in_two_goes_is_one_change() {
    either_way(|by| {
        let scene = Scene::new(by, &[("a.toml", "old")]);
        let mut file = File::create(scene.path("a.toml")).unwrap();
        file.write_all(b"first half, ").unwrap();
        file.write_all(b"second half").unwrap();
        scene.expect(&scene.changed("a.toml", "first half, second half"));
        scene.expect_nothing();
    });
}

#[test]
fn a_file_that_stays_half_written_is_told_and_told_again_when_it_is_whole() {
    either_way(|by| {
        let scene = Scene::new(by, &[]);
        let mut file = File::create(scene.path("a.toml")).unwrap();
        file.write_all(b"half").unwrap();
        scene.expect(&scene.changed("a.toml", "half"));
        file.write_all(b" and half").unwrap();
        scene.expect(&scene.changed("a.toml", "half and half"));
    });
}

#[test]
fn a_touch_is_no_change() {
    either_way(|by| {
        let scene = Scene::new(by, &[("a.toml", "old")]);
        let file = File::options().append(true).open(scene.path("a.toml")).unwrap();
        file.set_modified(SystemTime::now() + Duration::from_secs(60)).unwrap();
        scene.expect_nothing();
        scene.write("a.toml", "old");
        scene.expect_nothing();
    });
}

#[test]
fn a_change_that_hides_its_time_is_told() {
    either_way(|by| {
        let scene = Scene::new(by, &[("a.toml", "old")]);
        let before = scene.path("a.toml").metadata().unwrap().modified().unwrap();
        let mut file = File::options().write(true).open(scene.path("a.toml")).unwrap();
        file.write_all(b"new").unwrap();
        file.set_modified(before).unwrap();
        scene.expect(&scene.changed("a.toml", "new"));
    });
}

#[test]
fn a_removed_file_is_told_and_so_is_its_return() {
    either_way(|by| {
        let scene = Scene::new(by, &[("a.toml", "old")]);
        fs::remove_file(scene.path("a.toml")).unwrap();
        scene.expect(&scene.removed("a.toml"));
        scene.write("a.toml", "old");
        scene.expect(&scene.changed("a.toml", "old"));
    });
}

#[test]
fn a_renamed_file_appears_before_it_disappears() {
    either_way(|by| {
        let scene = Scene::new(by, &[("a.toml", "text")]);
        fs::rename(scene.path("a.toml"), scene.path("b.toml")).unwrap();
        scene.expect(&scene.changed("b.toml", "text"));
        scene.expect(&scene.removed("a.toml"));
        fs::rename(scene.path("b.toml"), scene.path("b.toml.bak")).unwrap();
        scene.expect(&scene.removed("b.toml"));
    });
}

#[test]
fn what_the_service_does_not_read_is_not_told() {
    either_way(|by| {
        let scene = Scene::new(by, &[]);
        for name in [".hidden.toml", "a.toml~", "a.txt", "toml", ".toml"] {
            scene.write(name, "text");
        }
        for folder in ["sub", "sub.toml"] {
            fs::create_dir(scene.path(folder)).unwrap();
            fs::write(scene.path(folder).join("a.toml"), "text").unwrap();
        }
        scene.expect_nothing();
    });
}

#[test]
fn a_file_without_permission_is_unreadable_until_it_has_it() {
    either_way(|by| {
        let scene = Scene::new(by, &[("a.toml", "old")]);
        let permit =
            |mode| fs::set_permissions(scene.path("a.toml"), PermissionsExt::from_mode(mode)).unwrap();
        permit(0o000);
        if File::open(scene.path("a.toml")).is_ok() {
            eprintln!("skipped: this user may read every file");
            return;
        }
        scene.expect_unreadable("a.toml", "Permission denied");
        scene.expect_nothing();
        permit(0o600);
        scene.expect(&scene.changed("a.toml", "old"));
    });
}

#[test]
fn a_loop_of_links_is_unreadable() {
    either_way(|by| {
        let scene = Scene::new(by, &[]);
        symlink("b.toml", scene.path("a.toml")).unwrap();
        symlink("a.toml", scene.path("b.toml")).unwrap();
        scene.expect_unreadable("a.toml", "symbolic links");
        scene.expect_unreadable("b.toml", "symbolic links");
        scene.expect_nothing();
        fs::remove_file(scene.path("b.toml")).unwrap();
        scene.write("b.toml", "text");
        scene.expect(&scene.changed("a.toml", "text"));
        scene.expect(&scene.changed("b.toml", "text"));
    });
}

#[test]
fn a_link_to_nothing_is_unreadable_until_there_is_something() {
    either_way(|by| {
        let scene = Scene::new(by, &[]);
        symlink(".target", scene.path("a.toml")).unwrap();
        scene.expect_unreadable("a.toml", "a link to a file that does not exist");
        scene.write(".target", "text");
        scene.expect(&scene.changed("a.toml", "text"));
        fs::remove_file(scene.path("a.toml")).unwrap();
        scene.expect(&scene.removed("a.toml"));
    });
}

#[test]
fn a_folder_or_a_pipe_in_the_place_of_a_file_is_unreadable() {
    either_way(|by| {
        let scene = Scene::new(by, &[("a.toml", "old")]);
        fs::remove_file(scene.path("a.toml")).unwrap();
        fs::create_dir(scene.path("a.toml")).unwrap();
        scene.expect_unreadable("a.toml", "it is a folder");
        fs::remove_dir(scene.path("a.toml")).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(scene.path("a.toml")).status().unwrap().success());
        scene.expect_unreadable("a.toml", "it is a pipe or a device");
        fs::remove_file(scene.path("a.toml")).unwrap();
        scene.expect(&scene.removed("a.toml"));
    });
}

#[test]
fn a_huge_file_is_told_with_one_byte_too_many() {
    either_way(|by| {
        let scene = Scene::new(by, &[]);
        let mut file = File::create(scene.path("a.toml")).unwrap();
        file.write_all(&vec![b'#'; 3 * MAX_DOCUMENT_BYTES]).unwrap();
        let FolderEvent::Changed { bytes, .. } = scene.next() else { panic!("not a change") };
        assert_eq!(bytes.len(), MAX_DOCUMENT_BYTES + 1);
        file.write_all(b"behind the cut").unwrap();
        scene.expect_nothing();
    });
}

#[test]
fn a_link_switched_beside_the_files_changes_them_all() {
    either_way(|by| {
        // As Kubernetes mounts a set of files: every one leads through `..data`, which is renamed over.
        let scene = Scene::new(by, &[]);
        for (version, text) in [("..v1", "old"), ("..v2", "new")] {
            fs::create_dir(scene.path(version)).unwrap();
            for name in ["a.toml", "b.toml"] {
                fs::write(scene.path(version).join(name), text).unwrap();
            }
        }
        symlink("..v1", scene.path("..data")).unwrap();
        for name in ["a.toml", "b.toml"] {
            symlink(Path::new("..data").join(name), scene.path(name)).unwrap();
        }
        for name in ["a.toml", "b.toml"] {
            scene.expect(&scene.changed(name, "old"));
        }
        symlink("..v2", scene.path("..data_tmp")).unwrap();
        fs::rename(scene.path("..data_tmp"), scene.path("..data")).unwrap();
        fs::remove_dir_all(scene.path("..v1")).unwrap();
        for name in ["a.toml", "b.toml"] {
            scene.expect(&scene.changed(name, "new"));
        }
        scene.expect_nothing();
    });
}
