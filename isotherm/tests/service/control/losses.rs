//! A state folder that is taken away, and an audit file that lost what it held.

use std::io::ErrorKind;
use std::path::Path;

use isotherm_protocol::control::SwapOptions;
use isotherm_protocol::service_status::ServiceStatus;

use super::folder::until_service;
use super::stand::{Folders, Stand, UNIT, assert_accepted, assert_refused, audit_file, document};

fn plain() -> SwapOptions {
    SwapOptions::default()
}

/// What the status says under a kind.
pub(crate) fn told<'s>(status: &'s ServiceStatus, kind: &str) -> Option<&'s str> {
    status.faults.iter().find(|fault| fault.kind == kind).map(|fault| fault.first.as_str())
}

/// Removes a folder into which the service may be writing: from its place at once, so that nobody meets half of it there.
fn remove(folder: &Path) {
    let gone = folder.with_file_name("gone");
    std::fs::rename(folder, &gone).unwrap();
    while let Err(error) = std::fs::remove_dir_all(&gone) {
        assert_eq!(error.kind(), ErrorKind::DirectoryNotEmpty, "{error}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_state_folder_that_is_removed_is_told_refuses_swaps_and_a_new_one_gets_all_that_holds() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &plain()).await, 1);
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 2.0), &plain()).await, 2);
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);

    remove(&folders.state);
    let status = until_service(&stand, |status| told(status, "state_folder").is_some()).await;
    let words = told(&status, "state_folder").unwrap();
    assert!(words.contains(folders.state.to_str().unwrap()), "{words}");
    let reply = stand.swap(UNIT, &document(UNIT, 3.0), &plain()).await;
    assert_refused(&reply, &[folders.state.to_str().unwrap()]);
    assert_eq!(stand.revisions(UNIT, 20).await, [2], "the stream does not notice");
    assert!(!folders.state.exists(), "a folder is not made where a disk may have been");

    std::fs::create_dir(&folders.state).unwrap();
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 4.0), &plain()).await, 3);
    until_service(&stand, |status| told(status, "state_folder").is_none()).await;
    stand.revisions(UNIT, 20).await;
    let reply = stand.command(UNIT, r#"{"command":"rollback"}"#).await;
    assert_accepted(&reply.swap.unwrap(), 4);
    stand.stop().await;
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [4]);
    assert_eq!(stand.active(UNIT).await.unwrap(), document(UNIT, 2.0), "what held was written down anew");

    // A copy in its place: a swap into the old one would never be seen again.
    let aside = folders.state.with_file_name("aside");
    std::fs::rename(&folders.state, &aside).unwrap();
    let copied = folders.state.with_file_name("copied");
    std::fs::create_dir(&copied).unwrap();
    std::fs::copy(audit_file(&aside), audit_file(&copied)).unwrap();
    std::fs::rename(&copied, &folders.state).unwrap();
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 5.0), &plain()).await, 5);
    let history = stand.history(UNIT).await;
    assert!(history.len() > 4, "the audit file of the copy is put aside and read: {history:#?}");
    stand.stop().await;
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [5]);

    // Away and back: nothing has happened.
    remove(&aside);
    std::fs::rename(&folders.state, &aside).unwrap();
    until_service(&stand, |status| told(status, "state_folder").is_some()).await;
    std::fs::rename(&aside, &folders.state).unwrap();
    until_service(&stand, |status| told(status, "state_folder").is_none()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 6.0), &plain()).await, 6);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_emptied_audit_file_is_told_and_no_revision_is_given_twice() {
    let folders = Folders::new();
    folders.put("a.toml", &document(UNIT, 1.0));
    let mut stand = Stand::start(folders.settings()).await;
    for (revision, bias) in [(2, 2.0), (3, 3.0)] {
        assert_accepted(&stand.swap(UNIT, &document(UNIT, bias), &plain()).await, revision);
    }
    stand.revisions(UNIT, 20).await;
    stand.stop().await;

    std::fs::write(audit_file(&folders.state), "").unwrap();
    let mut stand = Stand::start(folders.settings()).await;
    let status = until_service(&stand, |_| true).await;
    let words = told(&status, "audit_file").expect("told");
    let revisions = stand.revisions(UNIT, 20).await;
    assert!(revisions.len() == 1 && revisions[0] > 3, "{revisions:?}");
    assert!(words.contains(&format!(" {}", revisions[0])), "{words}");
    stand.stop().await;

    // It holds for units that come later, and over another restart.
    let stand = Stand::start(folders.settings()).await;
    assert_eq!(told(&until_service(&stand, |_| true).await, "audit_file"), None);
    let reply = stand.swap("ZLG-8", &document("ZLG-8", 1.0), &plain()).await;
    assert_accepted(&reply, revisions[0]);

    // While the service runs, too.
    std::fs::write(audit_file(&folders.state), "").unwrap();
    until_service(&stand, |status| told(status, "audit_file").is_some()).await;
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_damaged_acceptance_is_told_with_what_is_in_force_in_its_place() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    for (revision, bias) in [(1, 1.0), (2, 2.0), (3, 3.0)] {
        assert_accepted(&stand.swap(UNIT, &document(UNIT, bias), &plain()).await, revision);
        stand.revisions(UNIT, 20).await;
    }
    stand.stop().await;
    let audit = audit_file(&folders.state);
    let text = std::fs::read_to_string(&audit).unwrap();
    let newest = text.lines().rfind(|line| line.contains("\"event\":\"accepted\"")).unwrap();
    let damaged = newest.replacen("\"source\"", "\"sauce\"", 1);
    // Once with the entry of its first tick behind it, once as the last line of all.
    let kept = text.split_once(newest).unwrap().0.to_owned() + &damaged + "\n";
    for text in [text.replace(newest, &damaged), kept] {
        std::fs::write(&audit, &text).unwrap();
        // It is the audit file of another time: that its end is missing is another matter.
        std::fs::remove_file(folders.state.join("last-entry")).unwrap();
        let mut stand = Stand::start(folders.settings()).await;
        let status = until_service(&stand, |_| true).await;
        let words = told(&status, "audit_file").expect("told").to_owned();
        assert!([UNIT, "revision 3", "revision 2"].iter().all(|part| words.contains(part)), "{words}");
        assert_eq!(stand.revisions(UNIT, 20).await, [2]);
        assert_accepted(&stand.swap(UNIT, &document(UNIT, 3.0), &plain()).await, 4);
        until_service(&stand, |status| told(status, "audit_file").is_none()).await;
        stand.stop().await;
    }
}
