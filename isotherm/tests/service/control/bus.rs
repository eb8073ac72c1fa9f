//! Documents over the bus: queries and puts on `imu/{unit}/calibration`.

use std::time::Duration;

use isotherm_bus::{SessionOptions, locators, open};
use isotherm_protocol::control::{SwapOptions, SwapOutcome};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::{AuditEvent, Source};
use isotherm_protocol::key;
use zenoh::qos::CongestionControl;

use super::stand::{Folders, Stand, UNIT, assert_accepted, assert_refused, document, unit_id};

fn by_ann() -> SwapOptions {
    SwapOptions { by: "ann".to_owned(), ..SwapOptions::default() }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_document_over_the_bus_is_in_force_from_the_next_tick_and_written_down() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 40).await, [0], "no calibration yet");
    let text = document(UNIT, 1.0);
    let reply = stand.swap(UNIT, &text, &by_ann()).await;
    assert_accepted(&reply, 1);
    assert_eq!(reply.digest, Digest::of(text.as_bytes()).to_string());
    assert!(reply.difference.is_none(), "nothing to compare with");
    assert_eq!(stand.revisions(UNIT, 40).await, [1]);

    let reply = stand.swap(UNIT, &document(UNIT, 3.25), &by_ann()).await;
    assert_accepted(&reply, 2);
    let difference = reply.difference.unwrap();
    assert_eq!(difference.document.len(), 1, "{difference:#?}");
    assert_eq!(difference.document[0].key, "gyro.sensor[0].static_bias.coefficients_deg_per_h[0]");
    let bias = difference.correction.iter().find(|change| change.quantity == "gyro x bias").unwrap();
    assert!((bias.after - bias.before - 2.25).abs() < 1e-9, "{bias:?}");
    assert_eq!(difference.temperatures, ["body 25.00 °C"]);
    assert_eq!(stand.revisions(UNIT, 40).await, [2]);
    assert_eq!(stand.active(UNIT).await.unwrap(), document(UNIT, 3.25));

    let first = stand
        .until(UNIT, |event| match event {
            AuditEvent::InForce(first) if first.revision == 2 => Some(*first),
            _ => None,
        })
        .await;
    assert_eq!(first.first_sequence, 80);
    let history = stand.history(UNIT).await;
    let accepted: Vec<_> = history
        .iter()
        .filter_map(|entry| match &entry.event {
            AuditEvent::Accepted(accepted) => {
                Some((entry.by.as_str(), accepted.revision, accepted.source.clone()))
            }
            _ => None,
        })
        .collect();
    assert_eq!(accepted, [("ann", 1, Source::Bus), ("ann", 2, Source::Bus)]);
    let status = stand.status(UNIT);
    assert_eq!((status.swaps.accepted, status.swaps.refused), (2, 0));
    assert_eq!(status.calibration.unwrap().source, "bus");
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_put_is_taken_with_the_options_of_its_attachment() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    stand.revisions(UNIT, 10).await;
    let put = stand.session.put(key::calibration(&unit_id(UNIT)), document(UNIT, 1.0));
    put.attachment("by=bob").await.unwrap();
    stand.until_accepted(UNIT, 1).await;
    assert_eq!(stand.history(UNIT).await[0].by, "bob");
    assert_eq!(stand.revisions(UNIT, 10).await, [1]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_unit_that_has_not_appeared_is_given_its_calibration_when_it_does() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &by_ann()).await, 1);
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 2.0), &by_ann()).await, 2);
    assert_eq!(stand.revisions(UNIT, 40).await, [2]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_dry_run_says_what_would_happen_and_changes_nothing() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &by_ann()).await, 1);
    stand.revisions(UNIT, 10).await;
    let dry = SwapOptions { dry_run: true, ..by_ann() };
    let reply = stand.swap(UNIT, &document(UNIT, 2.0), &dry).await;
    assert_eq!((reply.outcome, reply.revision), (SwapOutcome::WouldBeAccepted, 1));
    let digests = [1.0, 2.0].map(|bias| Digest::of(document(UNIT, bias).as_bytes()).to_string());
    assert_eq!([reply.digest, reply.proposed.unwrap()], digests, "what is in force, and what would be");
    assert!(!reply.difference.unwrap().correction.is_empty());
    assert_refused(&stand.swap(UNIT, "schema = 1", &dry).await, &["gyro"]);
    assert_eq!(stand.revisions(UNIT, 10).await, [1]);
    assert_eq!(stand.status(UNIT).swaps.refused, 0, "nobody is to be woken by a dry run");
    let entries = stand.history(UNIT).await;
    assert!(!entries.iter().any(|entry| matches!(entry.event, AuditEvent::Refused(_))), "{entries:#?}");
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn identical_text_changes_nothing() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    let text = document(UNIT, 1.0);
    assert_accepted(&stand.swap(UNIT, &text, &by_ann()).await, 1);
    let reply = stand.swap(UNIT, &text, &by_ann()).await;
    assert_eq!((reply.outcome, reply.revision), (SwapOutcome::Unchanged, 1));
    assert_eq!(stand.revisions(UNIT, 10).await, [1]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_document_for_another_serial_is_refused_unless_asked_for_explicitly() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    stand.revisions(UNIT, 10).await;
    let text = document("ZLG-8", 1.0);
    let force = SwapOptions { force: true, ..by_ann() };
    for options in [by_ann(), force] {
        let reply = stand.swap(UNIT, &text, &options).await;
        assert_refused(&reply, &[":2:8: unit: ", "ZLG-8", "ZLG-7", "any_serial"]);
    }
    let reply = stand.swap(UNIT, &text, &SwapOptions { any_serial: true, ..by_ann() }).await;
    assert_accepted(&reply, 1);
    assert!(reply.warnings.iter().any(|warning| warning.key == "unit"), "{:#?}", reply.warnings);
    assert_eq!(stand.revisions(UNIT, 10).await, [1]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bad_document_is_refused_with_every_problem_and_the_old_one_goes_on() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &by_ann()).await, 1);
    stand.revisions(UNIT, 10).await;
    let bad = document(UNIT, 2.0)
        .replace("increment_weight_arcsec_per_count = 0.1", "increment_weight_arcsec_per_count = nan")
        .replace("assumed_deg_c = 25.0", "assumed_deg_c = 25.0\ncolour = 1");
    for _ in 0..3 {
        let reply = stand.swap(UNIT, &bad, &by_ann()).await;
        assert_refused(&reply, &["imu/ZLG-7/calibration:7:1: temperature.colour: "]);
        assert_refused(&reply, &["gyro.sensor[2].increment_weight_arcsec_per_count: "]);
        assert_eq!((reply.problems.len(), reply.revision), (4, 1));
    }
    for bytes in ["\u{0}\u{1}", "", &"#".repeat((1 << 20) + 1)] {
        assert_eq!(stand.swap(UNIT, bytes, &by_ann()).await.outcome, SwapOutcome::Refused);
    }
    assert_eq!(stand.revisions(UNIT, 10).await, [1]);
    let history = stand.history(UNIT).await;
    let digest = Digest::of(bad.as_bytes());
    let refused =
        history.iter().filter(|entry| matches!(&entry.event, AuditEvent::Refused(r) if r.digest == digest));
    assert_eq!(refused.count(), 1, "the same again is counted only");
    let status = stand.status(UNIT);
    assert_eq!(status.swaps.refused, 6);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_cannot_be_understood_is_answered_with_the_reason() {
    let folders = Folders::new();
    let stand = Stand::start(folders.settings()).await;
    let error = stand.try_swap(UNIT, &document(UNIT, 1.0), "colour=red").await.unwrap_err();
    assert!(error.contains("colour"), "{error}");
    let unknown = stand.active(UNIT).await.unwrap_err();
    let unseen = stand.try_command(UNIT, "{\"command\":\"run\"}").await.unwrap_err();
    assert!(unknown.contains(UNIT) && unseen.contains(UNIT) && unknown != unseen, "{unknown}; {unseen}");
    let error = stand.try_command(UNIT, "{}").await.unwrap_err();
    assert!(error.contains("command"), "{error}");
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_wrong_serial_is_told_with_everything_else_that_is_wrong() {
    let folders = Folders::new();
    let stand = Stand::start(folders.settings()).await;
    let bad = document("ZLG-8", 1.0).replace("assumed_deg_c = 25.0", "assumed_deg_c = \"warm\"");
    let reply = stand.swap(UNIT, &bad, &by_ann()).await;
    assert_refused(&reply, &[":2:8: unit: ", "ZLG-8", "any_serial"]);
    assert_refused(&reply, &["temperature.assumed_deg_c"]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_flood_of_broken_documents_for_one_unit_makes_no_other_wait() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    for serial in [UNIT, "OTHER"] {
        assert_accepted(&stand.swap(serial, &document(serial, 1.0), &by_ann()).await, 1);
    }
    stand.revisions("OTHER", 10).await;
    // A million errors each.
    let broken = "=\n".repeat(1 << 19);
    let connect = locators(stand.service.session());
    let vandal = open(&SessionOptions { connect, ..SessionOptions::default() }).await.unwrap();
    let flood = tokio::spawn({
        async move {
            for n in 0..300 {
                let serial = if n % 2 == 0 { UNIT.to_owned() } else { format!("INVENTED-{n}") };
                let put = vandal.put(format!("imu/{serial}/calibration"), broken.clone());
                put.congestion_control(CongestionControl::Block).await.unwrap();
            }
        }
    });
    for revision in 2..12 {
        let bias = f64::from(u32::try_from(revision).unwrap());
        let start = std::time::Instant::now();
        assert_accepted(&stand.swap("OTHER", &document("OTHER", bias), &by_ann()).await, revision);
        assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
    }
    flood.await.unwrap();
    assert_eq!(stand.revisions("OTHER", 10).await, [11]);
    stand.stop().await;
}
