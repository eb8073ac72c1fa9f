//! Services that take some units only.

use isotherm_bus::inquiry::ask_all;
use isotherm_bus::{SessionOptions, locators, open};
use isotherm_protocol::codec::decode;
use isotherm_protocol::control::{SwapOptions, SwapOutcome, SwapReply};
use isotherm_protocol::key;
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_service::Settings;
use zenoh::Session;
use zenoh::query::{ConsolidationMode, QueryTarget, Reply};

use super::stand::{Folders, LIMIT, Stand, UNIT, assert_accepted, document, unit_id};

const OTHER: &str = "MEMS-1";

fn taking(folders: &Folders, group: &str) -> Settings {
    Settings { units: vec![format!("{group}-*")], ..folders.settings() }
}

async fn asked_to_swap(session: &Session, unit: &str, parameters: &str) -> Vec<Reply> {
    let selector = format!("{}?{parameters}", key::calibration(&unit_id(unit)));
    let get = session.get(selector).payload(document(unit, 1.0)).target(QueryTarget::All);
    let replies = get.consolidation(ConsolidationMode::None).timeout(LIMIT).await.unwrap();
    let mut all = Vec::new();
    while let Ok(reply) = replies.recv_async().await {
        all.push(reply);
    }
    all
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_for_a_unit_that_is_not_taken_is_refused_and_the_unit_not_awaited() {
    let folders = Folders::new();
    folders.put("other.toml", &document(OTHER, 1.0));
    let stand = Stand::start(taking(&folders, "ZLG")).await;
    let refused = [
        stand.try_swap(OTHER, &document(OTHER, 2.0), "").await.map(drop),
        stand.try_swap(OTHER, &document(OTHER, 2.0), "dry_run=true").await.map(drop),
        stand.try_command(OTHER, r#"{"command":"rollback"}"#).await.map(drop),
        stand.try_command(OTHER, r#"{"command":"standby"}"#).await.map(drop),
        stand.active(OTHER).await.map(drop),
    ];
    for words in refused.map(Result::unwrap_err) {
        assert!(words.contains(OTHER) && words.contains("ZLG-*"), "{words}");
    }
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &SwapOptions::default()).await, 1);
    // The swap manager posts its status after it has answered.
    let deadline = tokio::time::Instant::now() + LIMIT;
    let status = loop {
        let (replies, _) = ask_all(&stand.session, key::ALL_SERVICE_STATUS, LIMIT).await.unwrap();
        let frame = replies[0].result().unwrap().payload().to_bytes();
        let status: ServiceStatus = decode(&frame).unwrap();
        if status.swaps_accepted == 1 {
            break status;
        }
        assert!(tokio::time::Instant::now() < deadline, "{status:?}");
    };
    assert_eq!(status.store.unwrap().audit_entries, 1, "of the unit that is taken");
    let awaited = status.faults.iter().find(|fault| fault.kind == "awaited_units").unwrap();
    assert_eq!(awaited.count, 1, "{awaited:?}");
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn of_two_services_the_one_that_takes_the_unit_answers_alone() {
    let folders = [Folders::new(), Folders::new()];
    let zlg = Stand::start(taking(&folders[0], "ZLG")).await;
    let mut settings = taking(&folders[1], "MEMS");
    settings.zenoh.session.connect = locators(zlg.service.session());
    let mems = Stand::start(settings).await;
    let connect = [&zlg, &mems].iter().flat_map(|stand| locators(stand.service.session())).collect();
    let session = open(&SessionOptions { connect, ..SessionOptions::default() }).await.unwrap();
    // Until each of the two knows of the other, and the asker of both.
    let deadline = tokio::time::Instant::now() + LIMIT;
    for unit in [UNIT, OTHER] {
        while !matches!(&*asked_to_swap(&session, unit, "dry_run=true").await, [reply] if reply.result().is_ok())
        {
            assert!(tokio::time::Instant::now() < deadline, "{unit}");
        }
        let replies = asked_to_swap(&session, unit, "").await;
        assert_eq!(replies.len(), 1, "{replies:?}");
        let json = replies[0].result().unwrap().payload().to_bytes();
        let reply: SwapReply = serde_json::from_slice(&json).unwrap();
        assert_eq!((reply.outcome, reply.revision), (SwapOutcome::Accepted, 1));
        let (histories, _) = ask_all(&session, &key::history(&unit_id(unit)), LIMIT).await.unwrap();
        assert_eq!(histories.len(), 1, "{unit}");
    }
    // What nobody takes is told by whoever knows what the other takes.
    while asked_to_swap(&session, "FOG-1", "").await.iter().all(|reply| reply.result().is_ok()) {
        assert!(tokio::time::Instant::now() < deadline);
    }
    mems.stop().await;
    zlg.stop().await;
}
