//! What must not be is told: other bits, two services that are no pair, two producers. And what an operator ordered holds, whoever
//! took the order.

use std::time::Duration;

use isotherm_bus::{SessionOptions, close, open};
use isotherm_protocol::codec;
use isotherm_protocol::control::{SwapOptions, SwapOutcome};
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::AuditEvent;
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::{Fault, State, Status};
use isotherm_tests::bench::LIMIT;
use isotherm_tests::judged::{Sink, Source};
use isotherm_tests::operator::audit;
use isotherm_tests::pair::{reports, until, until_compared, until_paired, until_speaks};
use isotherm_tests::process::Service;
use serde_json::json;

use super::stand::{Stand, configuration, scenario};
use crate::documents::base;

const UNIT: &str = "PAIR-00";

/// The faults of a kind that the services have.
async fn faults(stand: &Stand, kind: &str) -> Vec<Fault> {
    let replies = stand.session.get(key::ALL_SERVICE_STATUS).await.unwrap();
    let mut faults = Vec::new();
    while let Ok(reply) = replies.recv_async().await {
        let frame = reply.into_result().unwrap();
        let status: ServiceStatus = codec::decode(&frame.payload().to_bytes()).unwrap();
        faults.extend(status.faults.into_iter().filter(|fault| fault.kind == kind));
    }
    faults
}

async fn times_told(stand: &Stand, kind: &str) -> u64 {
    faults(stand, kind).await.iter().map(|fault| fault.count).sum()
}

/// What the services say under a kind of fault, waited for.
async fn told(stand: &Stand, kind: &str) -> String {
    let deadline = tokio::time::Instant::now() + LIMIT;
    loop {
        if let Some(fault) = faults(stand, kind).await.first() {
            return fault.first.clone();
        }
        assert!(tokio::time::Instant::now() < deadline, "{kind}");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_tick_with_other_bits_is_an_alarm_that_names_it() {
    let stand = Stand::start(1, &configuration("")).await;
    until_compared(&stand.session, 1, 50).await;
    // As another instance with broken memory would publish it: one bit of one tick.
    let (sender, mut heard) = tokio::sync::mpsc::unbounded_channel();
    let listening = stand.session.declare_subscriber(key::ALL_CORRECTED).callback(move |sample| {
        let _ = sender.send((sample.key_expr().clone(), sample.payload().to_bytes().into_owned()));
    });
    let listening = listening.await.unwrap();
    let (deadline, mut changed) = (tokio::time::Instant::now() + LIMIT, Vec::new());
    let words = loop {
        // On a busy machine one that comes after its time is compared with nothing: another one, then.
        while heard.try_recv().is_ok() {}
        let (topic, frame) = tokio::time::timeout(LIMIT, heard.recv()).await.unwrap().unwrap();
        let mut batch: CorrectedBatch = codec::decode(&frame).unwrap();
        let tick = &mut batch.ticks[0];
        if changed.contains(&tick.sequence) {
            continue;
        }
        changed.push(tick.sequence);
        tick.delta_angle[1] = f64::from_bits(tick.delta_angle[1].to_bits() ^ 1);
        stand.session.put(topic, codec::encode(&batch).unwrap()).await.unwrap();
        tokio::time::sleep(Duration::from_millis(100)).await;
        if let Some(fault) = faults(&stand, "instances_disagree").await.first() {
            break fault.first.clone();
        }
        assert!(tokio::time::Instant::now() < deadline, "{changed:?}");
    };
    drop(listening);
    for part in [format!("unit {UNIT}"), "delta_angle_rad".to_owned()] {
        assert!(words.contains(&part), "{part}: {words}");
    }
    assert!(
        changed.iter().any(|sequence| words.contains(&format!("sequence {sequence}:"))),
        "{changed:?}: {words}"
    );
    let standby = reports(&stand.session).await.into_iter().flat_map(|report| report.units);
    assert!(standby.map(|unit| unit.ticks_differing).sum::<u64>() > 0);
    // It takes the other's memory anew, and stands by again.
    until_paired(&stand.session, 1).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_that_is_none_of_the_pair_and_publishes_its_unit_is_an_alarm() {
    let stand = Stand::start(1, &configuration("")).await;
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("documents")).unwrap();
    std::fs::write(folder.path().join("documents/unit.toml"), base(UNIT)).unwrap();
    let connect = stand.pair.endpoints().map(|endpoint| format!("{endpoint:?}")).join(", ");
    let text = format!(
        "calibrations = \"documents\"\nunits = [\"PAIR-*\"]\n[zenoh]\nlisten = [\"tcp/127.0.0.1:0\"]\nconnect = [{connect}]\n"
    );
    std::fs::write(folder.path().join("service.toml"), text).unwrap();
    let stranger = tokio::task::block_in_place(|| {
        Service::start_in(folder.path(), &["--config", "service.toml", "--log-level", "error"])
    });
    // A unit without a calibration, and one that has been given one since.
    for calibrated in [false, true] {
        if calibrated {
            let reply =
                stand.operator.swap("PAIR-01", base("PAIR-01").as_bytes(), &SwapOptions::default()).await;
            assert_eq!(reply.unwrap().outcome, SwapOutcome::Accepted);
        }
        let connect = vec![stranger.locator.clone()].into_iter().chain(stand.pair.endpoints()).collect();
        let session = open(&SessionOptions { connect, ..SessionOptions::default() }).await.unwrap();
        let sink = Sink::declare(&session).await;
        let mut source = Source::declare(&session, scenario("PAIR-01", 9), &base("PAIR-01"), &sink).await;
        let before = times_told(&stand, "two_services").await;
        let deadline = tokio::time::Instant::now() + LIMIT;
        while times_told(&stand, "two_services").await == before {
            assert!(tokio::time::Instant::now() < deadline, "calibrated: {calibrated}");
            for _ in 0..100 {
                source.tick().await;
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        }
        close(session, LIMIT).await.unwrap();
        // Until nobody doubles any more: the next time is another alarm.
        tokio::time::sleep(Duration::from_millis(1500)).await;
    }
    let words = told(&stand, "two_services").await;
    assert!(words.contains("PAIR-01"), "{words}");
    drop(stranger);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_producer_of_a_unit_is_an_alarm() {
    let stand = Stand::start(1, &configuration("")).await;
    let session = stand.pair.session().await;
    let sink = Sink::declare(&session).await;
    let mut second = Source::declare(&session, scenario(UNIT, 99), &base(UNIT), &sink).await;
    for _ in 0..400 {
        second.tick().await;
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    let told = |status: &Status| status.faults.iter().any(|fault| fault.kind == "two_producers");
    stand.operator.until(UNIT, |status| told(status).then_some(())).await;
    close(session, LIMIT).await.unwrap();
}

/// Waits until an overlay lies in the state folders of these instances.
async fn until_kept(stand: &Stand, instances: &[usize], overlay: &str) {
    let name = format!("overlays/{}.toml", Digest::of(overlay.as_bytes()));
    let deadline = tokio::time::Instant::now() + LIMIT;
    while !instances.iter().all(|index| stand.pair.state(*index).join(&name).exists()) {
        assert!(tokio::time::Instant::now() < deadline, "{name}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_overlay_holds_when_the_instance_that_took_it_is_gone() {
    let mut stand = Stand::start(1, &configuration("")).await;
    until_compared(&stand.session, 1, 50).await;
    let speaking = stand.speaker().await;
    let of = Digest::of(base(UNIT).as_bytes());
    let overlay = format!(
        "schema = 1\noverlay_of = \"{of}\"\nunit = \"{UNIT}\"\n\n[[gyro]]\nname = \"x\"\n\
         static_bias_change_deg_per_h = 0.5\nstatic_bias_sigma_deg_per_h = 0.004\n"
    );
    let reply = stand.operator.swap(UNIT, overlay.as_bytes(), &SwapOptions::default()).await.unwrap();
    assert_eq!((reply.outcome, reply.revision), (SwapOutcome::Accepted, 2), "{reply:?}");
    let holds = |status: &Status| {
        let active = status.calibration.as_ref()?;
        (active.revision.counter == 2).then_some(active.overlay)?
    };
    assert_eq!(stand.operator.until(UNIT, holds).await, Digest::of(overlay.as_bytes()));
    until_kept(&stand, &[1 - speaking], &overlay).await;
    stand.pair.kill(speaking);
    until_speaks(&stand.session, 1 - speaking, 1).await;
    assert_eq!(stand.operator.until(UNIT, holds).await, Digest::of(overlay.as_bytes()));
    // Another overlay lies on the base, not on the sum.
    let second = overlay.replace("= 0.5", "= 0.25");
    let reply = stand.operator.swap(UNIT, second.as_bytes(), &SwapOptions::default()).await.unwrap();
    assert_eq!((reply.outcome, reply.revision), (SwapOutcome::Accepted, 3), "{reply:?}");
    // The one that comes back has them too, text and all.
    stand.restart(speaking);
    until_paired(&stand.session, 1).await;
    for text in [&overlay, &second] {
        until_kept(&stand, &[0, 1], text).await;
    }
    stand.judged = 0;
    stand.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_command_holds_when_the_instance_that_took_it_is_gone() {
    let mut stand = Stand::start(2, &configuration("")).await;
    until_compared(&stand.session, 2, 50).await;
    let (speaking, commanded) = (stand.speaker().await, "PAIR-01");
    let reply = stand.operator.command(commanded, json!({"command": "standby", "by": "ann"})).await.unwrap();
    assert!(reply.accepted, "{reply:?}");
    // The other has heard of it.
    until_paired(&stand.session, 2).await;
    let ordered = |index: usize| {
        let entries = audit(&stand.pair.state(index)).into_iter();
        let of_ann =
            entries.filter(|entry| entry.by == "ann" && matches!(entry.event, AuditEvent::Command(_)));
        of_ann.map(|entry| entry.unit).collect::<Vec<_>>()
    };
    let deadline = tokio::time::Instant::now() + LIMIT;
    while ordered(1 - speaking) != [Some(commanded.to_owned())] {
        assert!(tokio::time::Instant::now() < deadline, "{:?}", ordered(1 - speaking));
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    stand.pair.kill(speaking);
    until_speaks(&stand.session, 1 - speaking, 2).await;
    let held = |status: &Status| (status.state == State::Standby).then_some(());
    stand.operator.until(commanded, held).await;
    assert!(stand.operator.command(commanded, json!({"command": "run"})).await.unwrap().accepted);
    stand.operator.until(commanded, |status| (status.state != State::Standby).then_some(())).await;
    // The one that comes back learns it too.
    stand.restart(speaking);
    until(&stand.session, |reports| reports.len() == 2).await;
    until_paired(&stand.session, 2).await;

    // One that dies before its history is asked for: what the journal said is written down instead.
    let speaking = stand.speaker().await;
    let entries = stand.session.declare_subscriber(key::journal(&UnitId::new(commanded).unwrap()));
    let entries = entries.await.unwrap();
    assert!(stand.operator.command(commanded, json!({"command": "standby"})).await.unwrap().accepted);
    entries.recv_async().await.unwrap();
    stand.pair.kill(speaking);
    until_speaks(&stand.session, 1 - speaking, 2).await;
    stand.operator.until(commanded, held).await;
    let last = || {
        let entries = audit(&stand.pair.state(1 - speaking)).into_iter().rev();
        let mut of_unit = entries.filter(|entry| entry.unit.as_deref() == Some(commanded));
        of_unit.find_map(|entry| match entry.event {
            AuditEvent::Command(record) => Some(record.state_after),
            _ => None,
        })
    };
    let deadline = tokio::time::Instant::now() + LIMIT;
    while last().as_deref() != Some("standby") {
        assert!(tokio::time::Instant::now() < deadline, "{:?}", last());
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    stand.judged = 1;
    stand.end().await;
}
