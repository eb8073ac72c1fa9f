//! Commands over the bus: states, refusals, what is written down.

use isotherm_correction::operation::State;
use isotherm_operator::client::Client;
use isotherm_protocol::control::SwapOptions;
use isotherm_protocol::history::{AuditEvent, CommandRecord};
use isotherm_service::Settings;

use super::stand::{Folders, LIMIT, Stand, UNIT, assert_accepted, document};

#[tokio::test(flavor = "multi_thread")]
async fn commands_move_a_unit_from_state_to_state_and_are_written_down() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &SwapOptions::default()).await, 1);
    stand.revisions(UNIT, 20).await;

    let reply = stand.command(UNIT, r#"{"command":"standby","by":"ann"}"#).await;
    assert!(reply.accepted);
    assert_eq!(reply.state, State::Standby);
    assert!(reply.allowed.contains(&"pre-launch".to_owned()));
    stand.send(UNIT, 20).await;
    let reply = stand.command(UNIT, r#"{"command":"run","reversal":true}"#).await;
    assert!(!reply.accepted && reply.reason.unwrap().contains("mode_reversal"));
    assert_eq!(reply.state, State::Standby);
    let reply = stand.command(UNIT, r#"{"command":"run"}"#).await;
    assert_eq!(reply.state, State::RunningWithoutReversal);
    let reply = stand.command(UNIT, r#"{"command":"self-test"}"#).await;
    assert!(!reply.accepted && reply.allowed.iter().take(2).eq(["run", "standby"]), "{reply:?}");
    let reply = stand.command(UNIT, r#"{"command":"rest","latitude_deg":95,"heading_deg":0}"#).await;
    assert!(!reply.accepted && reply.reason.unwrap().contains("95°"));

    // The ticks that were held back are announced by the first that goes out.
    let out = stand.run_unit(UNIT, 20).await;
    assert_eq!(out.iter().map(|(_, tick)| tick.missed).sum::<u64>() + out.len() as u64, 40);
    let records: Vec<CommandRecord> = stand
        .history(UNIT)
        .await
        .into_iter()
        .filter_map(|entry| {
            let AuditEvent::Command(record) = entry.event else { return None };
            Some(record)
        })
        .collect();
    let told: Vec<_> = records.iter().map(|record| (record.command.as_str(), record.accepted)).collect();
    assert_eq!(
        told,
        [
            ("standby", true),
            ("run with mode reversal", false),
            ("run", true),
            ("self-test", false),
            ("rest at latitude 95°, heading 0°, levelled", false)
        ]
    );
    assert_eq!(
        (records[0].state_before.as_str(), records[0].last_sequence),
        ("running without mode reversal", Some(19))
    );
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_unit_may_begin_in_standby_and_a_self_test_has_its_report() {
    let folders = Folders::new();
    let mut settings = folders.settings();
    settings.unit.in_standby = true;
    let mut stand = Stand::start(settings).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &SwapOptions::default()).await, 1);
    stand.send(UNIT, 20).await;
    while stand.service.totals().unit(&super::stand::unit_id(UNIT)).ticks_in < 20 {
        tokio::task::yield_now().await;
    }
    let reply = stand.command(UNIT, r#"{"command":"self-test"}"#).await;
    assert_eq!(reply.state, State::SelfTest);
    // Ten seconds of event time.
    stand.send(UNIT, 2100).await;
    let report = loop {
        if let Some(report) = stand.status(UNIT).self_test {
            break report;
        }
        tokio::task::yield_now().await;
    };
    assert!(report.items.iter().any(|item| item.name == "gyro x"), "{report:#?}");
    assert!(report.items.iter().any(|item| item.name == "calibration" && item.passed), "{report:#?}");
    assert_eq!(stand.command(UNIT, r#"{"command":"abort"}"#).await.state, State::Standby);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_self_test_without_ticks_is_ended_by_the_clock() {
    let folders = Folders::new();
    let settings = Settings { state: None, ..folders.settings() };
    let mut stand = Stand::start(settings).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &SwapOptions::default()).await, 1);
    stand.revisions(UNIT, 20).await;
    stand.command(UNIT, r#"{"command":"standby"}"#).await;
    let started = std::time::Instant::now();
    assert_eq!(stand.command(UNIT, r#"{"command":"self-test"}"#).await.state, State::SelfTest);
    while stand.status(UNIT).self_test.is_none() {
        assert!(started.elapsed().as_secs() < 15, "a report within 15 s");
        tokio::time::sleep(std::time::Duration::from_millis(50)).await;
    }
    assert!(!stand.status(UNIT).self_test.unwrap().passed, "no gyro was alive");
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_unit_that_sends_no_more_can_be_forgotten() {
    let folders = Folders::new();
    let file = folders.put("a.toml", &document(UNIT, 1.0));
    let stand = Stand::start(folders.settings()).await;
    let forget = r#"{"command":"forget","by":"ann"}"#;
    let error = stand.try_command("NOPE", forget).await.unwrap_err();
    assert!(error.contains("NOPE"), "{error}");
    let reply = stand.command(UNIT, forget).await;
    assert!(!reply.accepted && reply.reason.unwrap().contains("a.toml"));
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.5), &SwapOptions::default()).await, 2);
    folders.put("a.toml", &document(UNIT, 1.0).replace("schema", "scheme"));
    while Client::on(stand.session.clone(), LIMIT).services().await.unwrap()[0].bad_documents.is_empty() {}
    let reply = stand.command(UNIT, forget).await;
    assert!(!reply.accepted && reply.reason.unwrap().contains("a.toml"), "a bad file names it, too");
    std::fs::remove_file(file).unwrap();
    let deadline = tokio::time::Instant::now() + LIMIT;
    while !stand.command(UNIT, forget).await.accepted {
        assert!(tokio::time::Instant::now() < deadline);
    }
    assert!(stand.active(UNIT).await.is_err());
    let services = Client::on(stand.session.clone(), LIMIT).services().await.unwrap();
    assert_eq!(services[0].swaps_accepted, 1, "counters do not fall");
    stand.stop().await;

    let mut stand = Stand::start(folders.settings()).await;
    assert_eq!(stand.revisions(UNIT, 10).await, [0], "it does not come back with a restart");
    let reply = stand.command(UNIT, forget).await;
    assert!(!reply.accepted);
    insta::assert_snapshot!(reply.reason.unwrap());
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 2.0), &SwapOptions::default()).await, 3);
    stand.stop().await;
}
