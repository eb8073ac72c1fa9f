//! Documents of the watched folder.

use std::time::Duration;

use isotherm_protocol::control::SwapOptions;
use isotherm_protocol::history::{AuditEvent, Source};
use isotherm_protocol::service_status::ServiceStatus;

use super::stand::{Folders, LIMIT, Stand, UNIT, assert_accepted, assert_refused, document};

/// Waits until the service's own status says something.
pub(crate) async fn until_service(stand: &Stand, said: impl Fn(&ServiceStatus) -> bool) -> ServiceStatus {
    let deadline = tokio::time::Instant::now() + LIMIT;
    loop {
        let replies = stand.session.get("isotherm/*/status").await.unwrap();
        let reply = tokio::time::timeout(LIMIT, replies.recv_async()).await.expect("in time").unwrap();
        let bytes = reply.into_result().unwrap().payload().to_bytes().into_owned();
        let status: ServiceStatus = isotherm_protocol::codec::decode(&bytes).unwrap();
        if said(&status) {
            return status;
        }
        assert!(tokio::time::Instant::now() < deadline, "not in time: {status:#?}");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_changed_file_is_a_swap_and_a_bad_one_is_not() {
    let folders = Folders::new();
    let file = folders.put("a.toml", &document(UNIT, 1.0));
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);

    std::fs::write(&file, document(UNIT, 2.0)).unwrap();
    stand.until_accepted(UNIT, 2).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);

    std::fs::write(&file, "schema = 1\nunit = \"ZLG-7\"\n").unwrap();
    let bad = until_service(&stand, |status| !status.bad_documents.is_empty()).await;
    assert!(bad.bad_documents[0].file.ends_with("a.toml") && bad.bad_documents[0].problems > 1, "{bad:#?}");
    let refused = stand
        .until(UNIT, |event| match event {
            AuditEvent::Refused(refused) => Some(refused.clone()),
            _ => None,
        })
        .await;
    assert!(matches!(refused.source, Source::Folder { .. }));
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);

    folders.put("a.toml", &document(UNIT, 3.0));
    stand.until_accepted(UNIT, 3).await;
    until_service(&stand, |status| status.bad_documents.is_empty()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [3]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn of_two_files_that_name_one_unit_none_is_taken_until_one_is_gone() {
    let folders = Folders::new();
    folders.put("a.toml", &document(UNIT, 1.0));
    let mut stand = Stand::start(folders.settings()).await;
    let rival = folders.put("b.toml", &document(UNIT, 2.0));
    let status = until_service(&stand, |status| status.bad_documents.len() == 2).await;
    assert!(status.bad_documents.iter().all(|bad| bad.problem.contains(UNIT)), "{status:#?}");
    assert_eq!(stand.revisions(UNIT, 20).await, [1], "what is in force stays in force");

    std::fs::remove_file(rival).unwrap();
    until_service(&stand, |status| status.bad_documents.is_empty()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1], "it is the document in force");
    folders.put("b.toml", &document(UNIT, 2.0));
    until_service(&stand, |status| status.bad_documents.len() == 2).await;
    std::fs::remove_file(folders.documents.join("a.toml")).unwrap();
    stand.until_accepted(UNIT, 2).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_removed_file_leaves_its_calibration_in_force() {
    let folders = Folders::new();
    let file = folders.put("a.toml", &document(UNIT, 1.0));
    let mut stand = Stand::start(folders.settings()).await;
    stand.revisions(UNIT, 20).await;
    std::fs::remove_file(file).unwrap();
    // The next change is told behind the removal.
    folders.put("b.toml", &document("ZLG-8", 1.0));
    stand.until_accepted("ZLG-8", 1).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bus_swap_holds_until_the_file_changes_again() {
    let folders = Folders::new();
    folders.put("a.toml", &document(UNIT, 1.0));
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 2.0), &SwapOptions::default()).await, 2);
    // Touched and moved back: its content is what it was.
    folders.put("a.toml", &document(UNIT, 1.0));
    folders.put("b.toml", &document("ZLG-8", 1.0));
    stand.until_accepted("ZLG-8", 1).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);
    folders.put("a.toml", &document(UNIT, 1.5));
    stand.until_accepted(UNIT, 3).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [3]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_beginning_of_a_document_is_refused_though_it_is_one_by_itself() {
    let folders = Folders::new();
    let whole = include_str!("../../../../config/calibration/MEMS-0001.toml");
    let whole = whole.replace("unit = \"MEMS-0001\"", &format!("unit = \"{UNIT}\""));
    let (torn, _) = whole.split_once("\n[accel]\n").unwrap();
    folders.put("a.toml", &whole);
    let stand = Stand::start(folders.settings()).await;
    stand.until_accepted(UNIT, 1).await;

    folders.put("a.toml", torn);
    let status = until_service(&stand, |status| !status.bad_documents.is_empty()).await;
    assert!(status.bad_documents[0].problem.contains("lacks [accel]"), "{status:#?}");
    let options = SwapOptions::default();
    assert_refused(&stand.swap(UNIT, torn, &options).await, &["[accel]", "--force"]);
    // The rest is written.
    folders.put("a.toml", &(whole.clone() + "# The rest.\n"));
    stand.until_accepted(UNIT, 2).await;
    let forced = SwapOptions { force: true, ..options };
    assert_accepted(&stand.swap(UNIT, torn, &forced).await, 3);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_document_that_could_not_be_written_down_is_tried_again() {
    let folders = Folders::new();
    folders.put("a.toml", &document(UNIT, 1.0));
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    // As a full disk would have it: the folder of the documents takes no more.
    let (shelf, aside) = (folders.state.join("documents"), folders.state.join("aside"));
    std::fs::rename(&shelf, &aside).unwrap();
    std::fs::write(&shelf, "in the way").unwrap();
    folders.put("a.toml", &document(UNIT, 2.0));
    let told = |status: &ServiceStatus| status.faults.iter().any(|fault| fault.kind == "unwritten_documents");
    let status = until_service(&stand, told).await;
    assert_eq!((status.bad_documents.len(), status.swaps_refused), (1, 1), "{status:#?}");
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);

    std::fs::remove_file(&shelf).unwrap();
    std::fs::rename(&aside, &shelf).unwrap();
    stand.until_accepted(UNIT, 2).await;
    let status = until_service(&stand, |status| !told(status)).await;
    assert_eq!((status.bad_documents.len(), status.swaps_refused), (0, 1), "{status:#?}");
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);
    stand.stop().await;
}
