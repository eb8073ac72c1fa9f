//! What a start says of documents that it does not take, and of what it puts in force again.

use isotherm_bus::open;
use isotherm_protocol::control::{SwapOptions, SwapOutcome};
use isotherm_protocol::history::AuditEvent;
use isotherm_protocol::signature::{Existing, PrivateKey, sign};
use isotherm_service::{ServiceError, Settings, start};

use super::folder::until_service;
use super::stand::{Folders, LIMIT, Stand, UNIT, assert_accepted, document};

/// Refusals that were written down.
async fn refusals(stand: &Stand) -> usize {
    let history = stand.history(UNIT).await;
    history.iter().filter(|entry| matches!(entry.event, AuditEvent::Refused(_))).count()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bad_document_is_told_at_every_start_and_a_strict_one_is_refused() {
    let folders = Folders::new();
    folders.put("a.toml", &document(UNIT, 1.0));
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    folders.put("a.toml", "schema = 1\nunit = \"ZLG-7\"\n");
    until_service(&stand, |status| status.bad_documents.len() == 1).await;
    stand.stop().await;

    for _ in 0..2 {
        let mut stand = Stand::start(folders.settings()).await;
        let status = until_service(&stand, |_| true).await;
        assert!(status.bad_documents.len() == 1 && status.bad_documents[0].problems > 1, "{status:#?}");
        assert_eq!(stand.revisions(UNIT, 20).await, [1], "the last good set is in force");
        assert_eq!(refusals(&stand).await, 1, "it is written down once");
        stand.stop().await;
        let strict = Settings { strict_start: true, ..folders.settings() };
        let session = open(&strict.zenoh.session).await.unwrap();
        let error = start(strict, session).await.expect_err("refused");
        assert!(matches!(error, ServiceError::BadCalibrations { count: 1 }), "{error}");
        assert_eq!(error.exit() as u8, 78);
    }
    folders.put("a.toml", &document(UNIT, 1.0));
    let strict = Settings { strict_start: true, ..folders.settings() };
    let mut stand = Stand::start(strict).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_was_refused_for_the_temperature_is_not_taken_by_a_restart_that_forgot_it() {
    let folders = Folders::new();
    folders.put("a.toml", &document(UNIT, 1.0));
    let mut settings = folders.settings();
    settings.swap.outside_range = isotherm_service::config::Severity::Refuse;
    let mut stand = Stand::start(settings.clone()).await;
    stand.temperature_deg_c = 55.0;
    stand.revisions(UNIT, 2000).await;
    folders.put("a.toml", &document(UNIT, 2.0));
    let status = until_service(&stand, |status| !status.bad_documents.is_empty()).await;
    assert!(status.bad_documents[0].problem.contains("body"), "{status:#?}");
    stand.stop().await;
    let mut stand = Stand::start(settings).await;
    let status = until_service(&stand, |status| !status.bad_documents.is_empty()).await;
    assert!(status.bad_documents[0].problem.contains("isotherm swap"), "{status:#?}");
    assert_eq!(stand.revisions(UNIT, 20).await, [1]);
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 2.0), &SwapOptions::default()).await, 2);
    stand.stop().await;
    let stand = Stand::start(folders.settings()).await;
    assert_eq!(until_service(&stand, |_| true).await.bad_documents, []);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_last_good_set_that_nobody_signed_stays_in_force_and_is_told_until_a_signed_one_is() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &SwapOptions::default()).await, 1);
    stand.revisions(UNIT, 20).await;
    stand.stop().await;

    let keys = tempfile::tempdir().unwrap();
    let key = PrivateKey::from_seed(&[7; 32]);
    std::fs::write(keys.path().join("bench.pub"), key.public().to_pem().unwrap()).unwrap();
    let mut settings = folders.settings();
    settings.swap.require_signature = true;
    settings.swap.trusted_keys = Some(keys.path().to_owned());
    let mut stand = Stand::start(settings.clone()).await;
    assert_eq!(stand.revisions(UNIT, 20).await, [1], "a unit does not lose its calibration");
    let told = |status: &isotherm_protocol::service_status::ServiceStatus| {
        status.faults.iter().any(|fault| fault.kind == "untrusted_calibration" && fault.first.contains(UNIT))
    };
    until_service(&stand, told).await;
    stand.until(UNIT, |event| matches!(event, AuditEvent::InForce(_)).then_some(())).await;
    let deadline = tokio::time::Instant::now() + LIMIT;
    let fault = loop {
        let faults = stand.status(UNIT).faults;
        if let Some(fault) = faults.into_iter().find(|fault| fault.kind == "untrusted_calibration") {
            break fault.first;
        }
        assert!(tokio::time::Instant::now() < deadline, "the unit's own status tells it");
        tokio::time::sleep(std::time::Duration::from_millis(5)).await;
    };
    assert!(fault.contains("isotherm swap"), "{fault}");

    let signed = sign(&document(UNIT, 1.0), &key, Existing::Refuse).unwrap();
    assert_accepted(&stand.swap(UNIT, &signed, &SwapOptions::default()).await, 2);
    until_service(&stand, |status| !told(status)).await;
    assert!(stand.status(UNIT).faults.is_empty());
    stand.stop().await;

    // The key is taken away, and given back: the same document again is enough then.
    std::fs::rename(keys.path().join("bench.pub"), keys.path().join("bench")).unwrap();
    let stand = Stand::start(settings).await;
    until_service(&stand, told).await;
    std::fs::rename(keys.path().join("bench"), keys.path().join("bench.pub")).unwrap();
    let reply = stand.swap(UNIT, &signed, &SwapOptions::default()).await;
    assert_eq!(reply.outcome, SwapOutcome::Unchanged);
    until_service(&stand, |status| !told(status)).await;
    stand.stop().await;
}
