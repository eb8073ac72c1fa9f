//! In the place of a file: what cannot be read, or never ends.

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;

use super::Scene;
use crate::documents::{BASE, BASE_UNIT};
use crate::stand::Folders;

/// Something in the place of a document.
pub(super) struct Odd {
    pub(super) name: &'static str,
    /// Part of what the service says of it.
    pub(super) says: &'static str,
    put: fn(&Path),
    /// Whether a document stands there before: a folder in any other place is no document and passed over.
    replaces: bool,
}

impl Odd {
    const fn new(name: &'static str, says: &'static str, put: fn(&Path)) -> Self {
        Self { name, says, put, replaces: false }
    }

    /// Whether a service that starts with it says so.
    pub(super) fn is_told_at_start(&self) -> bool {
        !self.replaces
    }

    /// Puts it into the folder.
    pub(super) fn make(&self, folders: &Folders) -> PathBuf {
        let file = folders.documents.join(format!("{}.toml", self.name.replace(' ', "-")));
        (self.put)(&file);
        file
    }

    /// Takes it away again.
    #[expect(clippy::unused_self, reason = "whoever was put in place is taken away again")]
    pub(super) fn remove(&self, file: &Path) {
        if file.symlink_metadata().unwrap().is_dir() { fs::remove_dir(file) } else { fs::remove_file(file) }
            .unwrap();
    }
}

pub(super) fn cases() -> Vec<Odd> {
    let mut cases = vec![
        Odd::new("a pipe", "it is a pipe or a device", |file| {
            assert!(Command::new("mkfifo").arg(file).status().unwrap().success());
        }),
        Odd::new("an endless device", "it is a pipe or a device", |file| symlink("/dev/zero", file).unwrap()),
        Odd::new("a silent device", "it is a pipe or a device", |file| symlink("/dev/null", file).unwrap()),
        Odd::new("a link to nothing", "", |file| symlink("nowhere", file).unwrap()),
        Odd::new("a link to itself", "symbolic link", |file| {
            symlink(file.file_name().unwrap(), file).unwrap();
        }),
        // A regular file by its looks, whose first byte cannot be read.
        Odd::new("a file with an error", "Input/output error", |file| {
            symlink("/proc/self/mem", file).unwrap();
        }),
        Odd {
            replaces: true,
            ..Odd::new("a folder", "it is a folder", |file| fs::create_dir(file).unwrap())
        },
    ];
    let denied = |file: &Path| {
        fs::write(file, BASE).unwrap();
        fs::set_permissions(file, PermissionsExt::from_mode(0o000)).unwrap();
    };
    let probe = tempfile::tempdir().unwrap();
    denied(&probe.path().join("probe"));
    if fs::read(probe.path().join("probe")).is_ok() {
        eprintln!("a file without permission is left out: this user may read every file");
    } else {
        cases.push(Odd::new("a file without permission", "Permission denied", denied));
    }
    cases
}

impl Scene {
    /// Has something refused in the place of a file.
    pub(super) async fn refuse_odd(&mut self, case: &Odd) {
        if case.replaces {
            let name = format!("{}.toml", case.name.replace(' ', "-"));
            let file = self.folders.put(&name, b"schema = 1");
            self.until_bad(&file, case.name).await;
            fs::remove_file(file).unwrap();
        }
        let file = case.make(&self.folders);
        let told = loop {
            let told = self.until_bad(&file, case.name).await;
            // What stood there before is told until it is found to have gone.
            if !told.contains("is missing") {
                break told;
            }
        };
        assert!(
            told.contains(case.says) && told.starts_with(file.to_str().unwrap()),
            "{}: {told}",
            case.name
        );
        self.goes_on(case.name).await;
        case.remove(&file);
    }

    /// Has two documents that name one unit refused, the one in force among them.
    pub(super) async fn refuse_rivals(&mut self) {
        let rival = self.folders.put("rival.toml", BASE.replace("1.94", "1.95").as_bytes());
        for (file, other) in
            [(rival.clone(), "good.toml"), (self.folders.documents.join("good.toml"), "rival.toml")]
        {
            let told = self.until_bad(&file, "a rival").await;
            let is_of_unit = told.split(": ").any(|part| part == "unit");
            assert!(is_of_unit && told.contains(BASE_UNIT) && told.contains(other), "{told}");
        }
        self.goes_on("a rival").await;
        fs::remove_file(rival).unwrap();
        self.stand.operator.until_service(|status| status.bad_documents.is_empty().then_some(())).await;
        self.goes_on("the end of a rival").await;
    }
}
