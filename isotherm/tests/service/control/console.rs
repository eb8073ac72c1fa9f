//! The operator's commands against a running service: who asked, and what is said of stored documents.

use std::process::Output;

use isotherm_bus::locators;
use isotherm_protocol::history::AuditEvent;

use super::stand::{Folders, Stand, UNIT, document};

/// Runs `isotherm` with nothing in its environment, as cron would.
async fn isotherm(stand: &Stand, arguments: &[&str]) -> Output {
    let connect = locators(stand.service.session()).join(",");
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_isotherm"));
    command.env_clear().args(arguments).args(["--connect", &connect]);
    tokio::task::spawn_blocking(move || command.output()).await.unwrap().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn whoever_asks_without_a_session_is_known_by_the_name_of_the_system() {
    let folders = Folders::new();
    let stand = Stand::start(folders.settings()).await;
    let file = folders.documents.with_file_name("new.toml");
    std::fs::write(&file, document(UNIT, 1.0)).unwrap();
    let output = isotherm(&stand, &["swap", UNIT, file.to_str().unwrap(), "--yes"]).await;
    assert!(output.status.success(), "{output:?}");
    let id = std::process::Command::new("id").args(["-un"]).output().unwrap();
    let name = String::from_utf8(id.stdout).unwrap().trim().to_owned();
    let history = stand.history(UNIT).await;
    let accepted = history.iter().find(|entry| matches!(entry.event, AuditEvent::Accepted(_))).unwrap();
    let expected = if name.is_empty() { "uid ".to_owned() } else { name };
    assert!(accepted.by.starts_with(&expected), "{expected:?}: {accepted:?}");

    // A swap that is refused is told once, and leaves its trace.
    std::fs::write(&file, document("ANOTHER-1", 2.0)).unwrap();
    let output = isotherm(&stand, &["swap", UNIT, file.to_str().unwrap(), "--yes"]).await;
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!((output.status.code(), stderr.matches("any_serial").count()), (Some(78), 1), "{stderr}");
    let history = stand.history(UNIT).await;
    assert!(history.iter().any(|entry| matches!(entry.event, AuditEvent::Refused(_))), "{history:?}");
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rollback_says_what_there_is_to_go_back_to_and_names_the_stored_file() {
    let folders = Folders::new();
    let stand = Stand::start(folders.settings()).await;
    for bias in [1.0, 2.0] {
        stand.swap(UNIT, &document(UNIT, bias), &isotherm_protocol::control::SwapOptions::default()).await;
    }
    let output = isotherm(&stand, &["rollback", UNIT, "--yes"]).await;
    assert!(output.status.success(), "{output:?}");
    let output = isotherm(&stand, &["rollback", UNIT, "--yes"]).await;
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(78), "{stderr}");
    insta::assert_snapshot!(stderr);

    // What is wrong with a stored document is said of its file.
    let second = stand.history(UNIT).await.into_iter().find_map(|entry| match entry.event {
        AuditEvent::Accepted(accepted) if accepted.revision == 2 => Some(accepted.digest),
        _ => None,
    });
    let stored = folders.state.join("documents").join(format!("{}.toml", second.unwrap()));
    std::fs::write(&stored, "changed").unwrap();
    let output = isotherm(&stand, &["rollback", UNIT, "--to", "2", "--yes"]).await;
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(stderr.matches(stored.to_str().unwrap()).count() == 1, "{stderr}");
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_history_of_a_unit_that_nobody_knows_is_an_error() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    stand.revisions(UNIT, 10).await;
    let output = isotherm(&stand, &["history", "NOPE"]).await;
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!((output.status.code(), stderr.contains("NOPE")), (Some(1), true), "{stderr}");
    let output = isotherm(&stand, &["history", UNIT]).await;
    assert_eq!(output.status.code(), Some(0), "it has appeared: {output:?}");
    stand.stop().await;
}
