//! What the folder says for a unit, and when it says something new.

use isotherm_protocol::control::SwapOptions;
use isotherm_protocol::history::AuditEvent;

use super::folder::until_service;
use super::stand::{Folders, Stand, UNIT, assert_accepted, document};

/// A service with a document in `a.toml`, as revision 1, and another one by bus, as revision 2.
async fn swapped_by_bus(folders: &Folders) -> Stand {
    folders.put("a.toml", &document(UNIT, 1.0));
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 2.0), &SwapOptions::default()).await, 2);
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);
    stand
}

/// Everything that was put into the folder so far has been taken, or not.
async fn behind(stand: &Stand, folders: &Folders, marker: &str) {
    folders.put(&format!("{marker}.toml"), &document(marker, 1.0));
    stand.until_accepted(marker, 1).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_renamed_file_says_nothing_new_and_a_restart_makes_no_difference() {
    let folders = Folders::new();
    let mut stand = swapped_by_bus(&folders).await;
    let [a, b, c] = ["a.toml", "b.toml", "c.toml"].map(|name| folders.documents.join(name));
    std::fs::rename(&a, &b).unwrap();
    // Until the old name is told as removed the two are rivals, for a moment only: what is written down of it stays.
    stand
        .until(UNIT, |event| matches!(event, AuditEvent::Refused(refused) if refused.rival).then_some(()))
        .await;
    until_service(&stand, |status| status.bad_documents.is_empty()).await;
    behind(&stand, &folders, "ZLG-8").await;
    assert_eq!(stand.revisions(UNIT, 20).await, [2], "what came in over the bus stays in force");
    stand.stop().await;

    std::fs::rename(&b, &c).unwrap();
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [2], "over a restart too");
    // Away and back.
    std::fs::rename(&c, folders.documents.join("aside")).unwrap();
    behind(&stand, &folders, "ZLG-9").await;
    std::fs::rename(folders.documents.join("aside"), &c).unwrap();
    behind(&stand, &folders, "ZLG-10").await;
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);
    // It is followed under its new name.
    folders.put("c.toml", &document(UNIT, 3.0));
    stand.until_accepted(UNIT, 3).await;
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_left_of_two_rivals_says_nothing_new_where_it_was_there_before() {
    let folders = Folders::new();
    let mut stand = swapped_by_bus(&folders).await;
    let rival = folders.put("b.toml", &document(UNIT, 5.0));
    until_service(&stand, |status| status.bad_documents.len() == 2).await;
    std::fs::remove_file(&rival).unwrap();
    until_service(&stand, |status| status.bad_documents.is_empty()).await;
    behind(&stand, &folders, "ZLG-8").await;
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);
    let refused = |entries: &[isotherm_protocol::history::AuditEntry]| {
        let rivals = entries.iter().filter(|entry| matches!(&entry.event, AuditEvent::Refused(r) if r.rival));
        rivals.count()
    };
    assert_eq!(refused(&stand.history(UNIT).await), 2, "each of the two is written down once");

    // A rival that stays for a restart is written down once more only where it is a new one, and is a swap in the end.
    folders.put("b.toml", &document(UNIT, 5.0));
    until_service(&stand, |status| status.bad_documents.len() == 2).await;
    let before = refused(&stand.history(UNIT).await);
    stand.stop().await;
    let stand = Stand::start(folders.settings()).await;
    assert_eq!(refused(&stand.history(UNIT).await), before);
    stand.stop().await;
    std::fs::remove_file(folders.documents.join("a.toml")).unwrap();
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [3], "the folder says another document now");
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_text_that_is_put_back_is_a_swap_and_a_mistake_that_is_taken_back_is_none() {
    let folders = Folders::new();
    let (first, second) = (document(UNIT, 1.0), document(UNIT, 2.0));
    let file = folders.put("a.toml", &first);
    let mut stand = Stand::start(folders.settings()).await;
    for (revision, text) in [(2, &second), (3, &first), (4, &second), (5, &first)] {
        std::fs::write(&file, text).unwrap();
        stand.until_accepted(UNIT, revision).await;
    }
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 7.0), &SwapOptions::default()).await, 6);
    std::fs::write(&file, "schema = 1\nunit = \"ZLG-7\"\n").unwrap();
    until_service(&stand, |status| !status.bad_documents.is_empty()).await;
    std::fs::write(&file, &first).unwrap();
    until_service(&stand, |status| status.bad_documents.is_empty()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [6]);
    // One that came by bus first, and by the folder then, is what the folder says from then on.
    std::fs::write(&file, document(UNIT, 7.0)).unwrap();
    stand.until(UNIT, |event| matches!(event, AuditEvent::CarriedFile(_)).then_some(())).await;
    assert_accepted(&stand.swap(UNIT, &second, &SwapOptions::default()).await, 7);
    stand.stop().await;
    std::fs::rename(&file, folders.documents.join("z.toml")).unwrap();
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [7]);
    stand.stop().await;
}
