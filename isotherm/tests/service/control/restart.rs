//! What survives a restart, and what is done without a usable folder.

use std::os::unix::fs::symlink;

use isotherm_bus::open;
use isotherm_correction::unit::UnitSettings;
use isotherm_protocol::control::{Schedule, SwapOptions};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::{AuditEvent, Source};
use isotherm_protocol::status::State;
use isotherm_service::{ServiceError, Settings};

use super::folder::until_service;
use super::losses::told;
use super::stand::{Folders, Stand, UNIT, assert_accepted, assert_refused, audit_file, document, unit_id};

fn plain() -> SwapOptions {
    SwapOptions::default()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_last_good_set_and_its_revision_survive_a_restart() {
    let folders = Folders::new();
    folders.put("a.toml", &document(UNIT, 1.0));
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 2.0), &plain()).await, 2);
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);
    stand.stop().await;

    // The file has not changed since: what came in over the bus afterwards holds.
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);
    assert_eq!(stand.active(UNIT).await.unwrap(), document(UNIT, 2.0));
    stand.stop().await;

    // Now it has.
    folders.put("a.toml", &document(UNIT, 3.0));
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [3]);
    let source = stand
        .until(UNIT, |event| match event {
            AuditEvent::Accepted(accepted) if accepted.revision == 3 => Some(accepted.source.clone()),
            _ => None,
        })
        .await;
    assert!(matches!(source, Source::Start { .. }), "{source}");
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bad_or_missing_document_or_folder_leaves_the_last_good_set_in_force() {
    let folders = Folders::new();
    let file = folders.put("a.toml", &document(UNIT, 1.0));
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    stand.stop().await;

    folders.put("a.toml", "schema = 1\nunit = \"ZLG-7\"\n");
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    stand.stop().await;

    std::fs::remove_file(&file).unwrap();
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    stand.stop().await;

    std::fs::remove_dir(&folders.documents).unwrap();
    symlink(&folders.documents, &folders.documents).unwrap();
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    // It comes back.
    std::fs::remove_file(&folders.documents).unwrap();
    std::fs::create_dir(&folders.documents).unwrap();
    folders.put("a.toml", &document(UNIT, 5.0));
    stand.until_accepted(UNIT, 2).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_damaged_document_of_the_state_folder_is_told_and_the_one_before_taken() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &plain()).await, 1);
    let reply = stand.swap(UNIT, &document(UNIT, 2.0), &plain()).await;
    stand.revisions(UNIT, 20).await;
    stand.stop().await;
    let file = folders.state.join("documents").join(format!("{}.toml", reply.digest));
    std::fs::write(file, document(UNIT, 9.0)).unwrap();
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    let status = until_service(&stand, |status| told(status, "older_calibration").is_some()).await;
    let words = told(&status, "older_calibration").unwrap();
    let parts = [UNIT, "revision 2", &reply.digest, "older revision 1", "isotherm swap"];
    assert!(parts.iter().all(|part| words.contains(part)), "{words}");
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 3.0), &plain()).await, 3);
    until_service(&stand, |status| told(status, "older_calibration").is_none()).await;
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_damaged_document_of_the_state_folder_is_taken_from_the_folder_of_calibrations() {
    let folders = Folders::new();
    folders.put("a.toml", &document(UNIT, 1.0));
    let stand = Stand::start(folders.settings()).await;
    folders.put("a.toml", &document(UNIT, 2.0));
    stand.until_accepted(UNIT, 2).await;
    stand.stop().await;
    let kept = Digest::of(document(UNIT, 2.0).as_bytes());
    let kept = folders.state.join("documents").join(format!("{kept}.toml"));
    std::fs::remove_file(&kept).unwrap();
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [2], "under its old revision");
    assert_eq!(told(&until_service(&stand, |_| true).await, "older_calibration"), None);
    stand.stop().await;

    // It comes back to the folder of calibrations only later: as a swap, then.
    std::fs::write(&kept, "").unwrap();
    let file = folders.documents.join("a.toml");
    std::fs::remove_file(&file).unwrap();
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    folders.put("a.toml", &document(UNIT, 2.0));
    stand.until_accepted(UNIT, 3).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [3]);
    until_service(&stand, |status| told(status, "older_calibration").is_none()).await;
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_swap_that_waited_for_its_tick_goes_on_waiting() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &plain()).await, 1);
    stand.revisions(UNIT, 20).await;
    let later = SwapOptions { schedule: Schedule::Sequence(10), ..plain() };
    assert_accepted(&stand.swap("ZLG-8", &document("ZLG-8", 1.0), &plain()).await, 1);
    assert_accepted(&stand.swap("ZLG-8", &document("ZLG-8", 2.0), &later).await, 2);
    stand.stop().await;
    let mut stand = Stand::start(folders.settings()).await;
    let ticks = stand.run_unit("ZLG-8", 20).await;
    assert!(ticks.iter().all(|(revision, tick)| *revision == if tick.sequence < 10 { 1 } else { 2 }));
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn rollback_goes_back_and_is_a_revision_of_its_own() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    let refused = stand.command("ZLG-9", r#"{"command":"rollback"}"#).await;
    assert!(!refused.accepted && refused.reason.unwrap().contains("ZLG-9"));
    for (revision, bias) in [(1, 1.0), (2, 2.0), (3, 3.0)] {
        assert_accepted(&stand.swap(UNIT, &document(UNIT, bias), &plain()).await, revision);
    }
    stand.revisions(UNIT, 20).await;
    let reply = stand.command(UNIT, r#"{"command":"rollback","by":"ann"}"#).await;
    assert!(reply.accepted, "{reply:#?}");
    assert_accepted(&reply.swap.unwrap(), 4);
    assert_eq!(stand.active(UNIT).await.unwrap(), document(UNIT, 2.0));
    assert_eq!(stand.revisions(UNIT, 20).await, [4]);
    let reply = stand.command(UNIT, r#"{"command":"rollback","revision":1}"#).await;
    assert_accepted(&reply.swap.unwrap(), 5);
    assert_eq!(stand.active(UNIT).await.unwrap(), document(UNIT, 1.0));
    let reply = stand.command(UNIT, r#"{"command":"rollback","revision":77}"#).await;
    assert!(!reply.accepted && reply.reason.unwrap().contains("77"));
    let source = stand
        .until(UNIT, |event| match event {
            AuditEvent::Accepted(accepted) if accepted.revision == 4 => Some(accepted.source.clone()),
            _ => None,
        })
        .await;
    assert_eq!(source, Source::Rollback { to: 2 });
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn two_instances_cannot_share_a_state_folder() {
    let folders = Folders::new();
    let stand = Stand::start(folders.settings()).await;
    let settings = folders.settings();
    let session = open(&settings.zenoh.session).await.unwrap();
    let error = isotherm_service::start(settings, session).await.expect_err("refused");
    assert!(matches!(error, ServiceError::State(_)), "{error}");
    let words = error.to_string();
    assert!(words.contains(&format!("process {}", std::process::id())), "{words}");
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_swap_that_cannot_be_written_down_is_refused_and_changes_nothing() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &plain()).await, 1);
    stand.revisions(UNIT, 20).await;
    // As a full disk would have it: the folder of the documents takes no more.
    let (shelf, aside) = (folders.state.join("documents"), folders.state.join("aside"));
    std::fs::rename(&shelf, &aside).unwrap();
    std::fs::write(&shelf, "in the way").unwrap();
    let reply = stand.swap(UNIT, &document(UNIT, 2.0), &plain()).await;
    assert_refused(&reply, &["documents"]);
    assert_eq!(reply.revision, 1);
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    let status = until_service(&stand, |status| told(status, "state_folder").is_some()).await;
    assert!(told(&status, "state_folder").unwrap().contains("documents"), "{status:#?}");
    std::fs::remove_file(&shelf).unwrap();
    std::fs::rename(&aside, &shelf).unwrap();
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 2.0), &plain()).await, 2);
    until_service(&stand, |status| told(status, "state_folder").is_none()).await;

    // The audit file itself: replaced by a link that leads nowhere.
    let audit = audit_file(&folders.state);
    std::fs::remove_file(&audit).unwrap();
    symlink(&audit, &audit).unwrap();
    let reply = stand.swap(UNIT, &document(UNIT, 3.0), &plain()).await;
    assert_refused(&reply, &["audit"]);
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_state_folder_swaps_work_until_the_end() {
    let folders = Folders::new();
    let settings = Settings { state: None, ..folders.settings() };
    let mut stand = Stand::start(settings.clone()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &plain()).await, 1);
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 2.0), &plain()).await, 2);
    assert_eq!(stand.revisions(UNIT, 20).await, [2]);
    assert!(stand.command(UNIT, r#"{"command":"rollback"}"#).await.accepted);
    assert!(stand.history(UNIT).await.len() >= 4);
    stand.stop().await;
    let mut stand = Stand::start(settings).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [0]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_an_operator_wanted_of_a_unit_holds_after_a_restart() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    let drift = "drift = { sigma_deg_per_h = 0.0035, correlation_time_h = 9.0, trend_sigma_deg_per_h2 = 0.00012, \
                 trend_correlation_time_h = 48.0, initial_sigma_deg_per_h = 0.05, \
                 angle_random_walk_deg_per_sqrt_h = 0.006 }\n";
    let text = document(UNIT, 1.0).replace("name = \"x\"\n", &format!("name = \"x\"\n{drift}"));
    assert_accepted(&stand.swap(UNIT, &text, &plain()).await, 1);
    stand.revisions(UNIT, 20).await;
    stand.revisions("OTHER", 20).await;
    let rest = r#"{"command":"rest","latitude_deg":55,"heading_deg":30,"pitch_roll_deg":[0,0]}"#;
    for command in [rest, r#"{"command":"standby"}"#] {
        let reply = stand.command(UNIT, command).await;
        assert!(reply.accepted, "{reply:?}");
    }
    // The audit file alone has to say it: as after kill -9, nothing else is written at the end.
    stand.stop().await;

    let mut stand = Stand::start(folders.settings()).await;
    stand.send(UNIT, 20).await;
    assert_eq!(stand.revisions("OTHER", 20).await, [0]);
    while stand.service.totals().unit(&unit_id(UNIT)).ticks_in < 20 {
        tokio::task::yield_now().await;
    }
    assert_eq!(stand.status(UNIT).state, State::Standby);
    assert!(stand.command(UNIT, r#"{"command":"end-rest"}"#).await.accepted);
    assert!(stand.command(UNIT, r#"{"command":"run"}"#).await.accepted);
    stand.stop().await;

    let settings =
        Settings { unit: UnitSettings { in_standby: true, ..folders.settings().unit }, ..folders.settings() };
    let mut stand = Stand::start(settings).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1], "though units begin in standby");
    stand.stop().await;
}
