//! Transport security and access control as shipped, run: who may not do a thing changes nothing by trying.

mod certificates;

use std::path::Path;
use std::process::Output;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use isotherm_bus::{ProducerOptions, close, presence};
use isotherm_correction::sample::OutputKind;
use isotherm_protocol::codec;
use isotherm_protocol::control::{SwapOptions, SwapOutcome};
use isotherm_protocol::history::AuditEvent;
use isotherm_protocol::key::{self, RawStream, UnitId};
use isotherm_protocol::raw::GyroBatch;
use isotherm_protocol::status::Status;
use isotherm_simulator::Scenario;
use isotherm_simulator::presets::zeeman_rest;
use isotherm_tests::bench::LIMIT;
use isotherm_tests::data::root;
use isotherm_tests::operator::{Operator, audit};
use isotherm_tests::player::Player;
use isotherm_tests::process::{Service, run, run_well};
use isotherm_tests::streams;
use zenoh::Session;
use zenoh::query::{Query, Queryable};

use crate::documents::{BASE, BASE_UNIT, base};
use crate::stand::{Folders, Stand};
use certificates::Authority;

/// How long somebody who is not heard waits for an answer.
const TRIAL: Duration = Duration::from_millis(500);
/// How often a program is run whose link breaks.
const TRIES: usize = 5;
/// Ticks that the instrument sends.
const TICKS: u64 = 200;

fn id(unit: &str) -> UnitId {
    UnitId::new(unit).unwrap()
}

/// A document for the unit, other than the one of the folder.
fn other() -> String {
    BASE.replacen("0.41", "0.44", 1)
}

/// What the service answers to an order; nothing where nobody hears it.
async fn order(session: &Session, key: &str, payload: &str) -> Vec<Result<String, String>> {
    let replies = session.get(key).payload(payload).timeout(TRIAL).await.unwrap();
    let mut answers = Vec::new();
    while let Ok(reply) = replies.recv_async().await {
        let answer = reply.into_result();
        let text = |bytes: &zenoh::bytes::ZBytes| String::from_utf8_lossy(&bytes.to_bytes()).into_owned();
        answers.push(answer.map(|it| text(it.payload())).map_err(|error| text(error.payload())));
    }
    // The asker's own session says so.
    answers.retain(|answer| answer != &Err("Timeout".to_owned()));
    answers
}

/// Swaps, puts and commands on every key that somebody could think of.
async fn try_orders(session: &Session, askers: &[&str]) {
    let unit = id(BASE_UNIT);
    let (swap, command) = (key::calibration(&unit), key::command(&unit));
    let named = |order: &str| askers.iter().map(|name| format!("{order}/{name}")).collect::<Vec<_>>();
    let standby = r#"{"command":"standby","by":"eve"}"#;
    let swaps = [vec![swap.clone()], named(&swap)].concat().into_iter().map(|key| (key, other()));
    let commands = [vec![command.clone()], named(&command)].concat().into_iter();
    for (key, payload) in swaps.chain(commands.map(|key| (key, standby.to_owned()))) {
        assert_eq!(order(session, &key, &payload).await, [], "{key}");
        session.put(key, payload).await.unwrap();
    }
}

/// Gyro ticks that would be taken, had they come.
fn frame() -> Vec<u8> {
    let ticks = (TICKS + 1..TICKS + 11).map(|tick| streams::gyro(tick, &[1.0, 2.0, 3.0])).collect();
    codec::encode(&GyroBatch { output: OutputKind::Counts, ticks }).unwrap()
}

/// A receipt that is never given, and how often it was asked for.
async fn withhold(session: &Session) -> (Queryable<()>, Arc<Mutex<Vec<Query>>>) {
    let asked = Arc::new(Mutex::new(Vec::new()));
    let held = Arc::clone(&asked);
    let key = key::receipt(&session.zid().to_string());
    let queryable = session.declare_queryable(key).callback(move |query| held.lock().unwrap().push(query));
    (queryable.await.unwrap(), asked)
}

/// `isotherm`, as somebody with this configuration runs it.
fn isotherm(config: &Path, arguments: &[&str]) -> Output {
    let arguments = [arguments, &["--zenoh-config", config.to_str().unwrap(), "--timeout", "2"]].concat();
    // Zenoh's TLS links break where both ends speak at once (zenoh#2557): asked again, as the program says.
    let broke = |output: &Output| String::from_utf8_lossy(&output.stderr).contains("did not answer");
    let mut outputs = std::iter::repeat_with(|| run("isotherm", &arguments)).take(TRIES);
    outputs.find(|output| !broke(output)).expect("an answer that no broken link took")
}

/// That it failed, with these words on stderr.
fn refused(output: &Output, words: &[&str]) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(words.iter().all(|words| stderr.contains(words)) && stderr.lines().count() == 1, "{stderr}");
}

/// The service as shipped, but for its folders and its port, with an authority that it trusts.
struct Shipped {
    folder: tempfile::TempDir,
    authority: Authority,
    service: Service,
}

impl Shipped {
    async fn start() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("units")).unwrap();
        std::fs::write(folder.path().join("units/unit.toml"), BASE).unwrap();
        std::fs::write(folder.path().join("other.toml"), other()).unwrap();
        let shipped = root().join("config/zenoh/access-control.json5");
        let settings = format!(
            "calibrations = \"units\"\nstate = \"state\"\n[zenoh]\nconfig = {:?}\nlisten = [\"tls/127.0.0.1:0\"]\n\
             certified_names = true\n",
            shipped.display().to_string()
        );
        std::fs::write(folder.path().join("service.toml"), settings).unwrap();
        let authority = Authority::new(folder.path());
        for name in ["service", "operator", "viewer", "recorder", BASE_UNIT, "stranger"] {
            authority.make(name);
        }
        let home = folder.path().to_owned();
        let start = move || Service::start_in(&home, &["--config", "service.toml"]);
        let service = tokio::task::spawn_blocking(start).await.unwrap();
        assert!(service.locator.starts_with("tls/127.0.0.1:"), "{}", service.locator);
        Self { folder, authority, service }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    async fn session(&self, name: &str) -> Session {
        self.authority.session(name, &self.service.locator).await
    }

    /// What the programs say to who may not, in a sentence.
    fn refuse_programs(&self) {
        let at = &self.service.locator;
        let at_viewer = self.authority.client(Some("viewer"), at);
        let other = self.path("other.toml");
        let swap = ["swap", BASE_UNIT, &other, "--yes"];
        let why = ["access control", "certificate of viewer", "imu/ZLG-0001/calibration/viewer"];
        refused(&isotherm(&at_viewer, &swap), &why);
        let command = ["command", BASE_UNIT, "standby"];
        refused(&isotherm(&at_viewer, &command), &["access control", "certificate of viewer"]);
        let status = isotherm(&at_viewer, &["status", BASE_UNIT]);
        let shown = String::from_utf8_lossy(&status.stdout);
        assert!(status.status.success() && shown.contains(BASE_UNIT), "{status:?}");
        // Of another authority, which itself trusts the service.
        let elsewhere = tempfile::tempdir().unwrap();
        let foreign = Authority::new(elsewhere.path());
        foreign.make("operator");
        let trusted = elsewhere.path().join("certificates/ca.pem");
        std::fs::copy(self.path("certificates/ca.pem"), trusted).unwrap();
        for config in [self.authority.client(None, at), foreign.client(Some("operator"), at)] {
            refused(&isotherm(&config, &swap), &["cannot reach a service", "certificate"]);
        }
    }

    /// What the status shows to who may ask for it before any unit has appeared, and to an instrument, which may not.
    fn show_services(&self) {
        let status = |name| isotherm(&self.authority.client(Some(name), &self.service.locator), &["status"]);
        for name in ["recorder", "viewer"] {
            assert!(status(name).status.success(), "{name}");
        }
        refused(&status(BASE_UNIT), &["access control", "certificate of ZLG-0001", "isotherm/*/status"]);
    }

    /// What the operator's programs order.
    fn order_by_programs(&self) {
        let at_operator = self.authority.client(Some("operator"), &self.service.locator);
        let other = self.path("other.toml");
        // Whatever is stated.
        for order in [
            &["swap", BASE_UNIT, &other, "--yes", "--by", "eve"][..],
            &["command", BASE_UNIT, "standby", "--by", "eve"],
        ] {
            let output = isotherm(&at_operator, order);
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        }
    }

    /// Stops it, and has it wait for the receipts of those alone who may give them.
    async fn stop(self, operator: &Session, others: [&Session; 2]) {
        let held = [withhold(others[0]).await, withhold(others[1]).await];
        let given = Arc::new(Mutex::new(0));
        let count = Arc::clone(&given);
        let receipt = operator.declare_queryable(key::receipt(&operator.zid().to_string()));
        let receipt = receipt.callback(move |_| *count.lock().unwrap() += 1).await.unwrap();
        for session in [others[0], operator] {
            presence::wait_for_service(session, LIMIT).await.unwrap();
        }
        let service = self.service;
        let (status, totals) = tokio::task::spawn_blocking(move || service.stop()).await.unwrap();
        assert_eq!(status.code(), Some(0), "{totals}");
        assert!(*given.lock().unwrap() > 0, "the operator's receipt was asked for");
        assert!(held.iter().all(|(_, asked)| asked.lock().unwrap().is_empty()), "nobody else's was");
        drop((receipt, held));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_shipped_access_control_refuses_what_a_certificate_may_not_do() {
    let shipped = Shipped::start().await;
    shipped.show_services();
    // The instrument publishes its own unit, and the operator sees it.
    let instrument = shipped.session(BASE_UNIT).await;
    let operator = Operator::new(shipped.session("operator").await);
    presence::wait_for_service(operator.session(), LIMIT).await.unwrap();
    let scenario = Scenario { unit: BASE_UNIT.to_owned(), ..zeeman_rest(7) };
    let options = ProducerOptions { max_in_flight: None, ..ProducerOptions::default() };
    let mut player = Player::declare(&instrument, &scenario, options).await;
    player.play(TICKS).await;
    player.flush().await;
    let heard = async || {
        let all = |status: &Status| (status.counter("gyro_ticks_in") == TICKS).then_some(status.state);
        operator.until(BASE_UNIT, all).await
    };
    let running = heard().await;

    // Nobody else gives orders, not under another's name either; the operator not under any but its own.
    let (viewer, stranger) = (shipped.session("viewer").await, shipped.session("stranger").await);
    let names = ["operator", "viewer", "*"];
    tokio::join!(
        try_orders(&viewer, &names),
        try_orders(&stranger, &names),
        try_orders(&instrument, &names),
        try_orders(operator.session(), &names[1..]),
    );
    // Nobody else publishes raw ticks, the instrument those of no other unit.
    for session in [&viewer, &stranger, operator.session()] {
        session.put(key::raw(&id(BASE_UNIT), RawStream::Gyro), frame()).await.unwrap();
    }
    for session in [&viewer, &stranger, operator.session(), &instrument] {
        session.put(key::raw(&id("ZLG-0002"), RawStream::Gyro), frame()).await.unwrap();
    }
    // What each of them may ask travels behind all that.
    for session in [&viewer, operator.session(), &instrument] {
        presence::wait_for_service(session, LIMIT).await.unwrap();
    }
    shipped.refuse_programs();
    assert_eq!(heard().await, running, "nothing has changed");

    shipped.order_by_programs();
    assert_ne!(heard().await, running);
    assert_eq!(operator.service().await.units.len(), 1, "no other unit has appeared");
    let entries = audit(&shipped.folder.path().join("state"));
    let orders = entries.iter().filter(|entry| !matches!(entry.event, AuditEvent::InForce(_)));
    let mut orders: Vec<_> = orders.map(|entry| (entry.event.name(), entry.by.as_str())).collect();
    orders.dedup();
    // What was refused has not even come in.
    assert_eq!(orders, [("accepted", ""), ("accepted", "CN=operator"), ("command", "CN=operator")]);
    run_well("isotherm", &["history", "--verify", &shipped.path("state")]);

    shipped.stop(operator.session(), [&viewer, &stranger]).await;
    for session in [viewer, stranger, instrument, operator.session().clone()] {
        close(session, LIMIT).await.unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn names_are_those_of_certificates_only_where_the_service_is_told_so() {
    for certified in [false, true] {
        let folders = Folders::new();
        folders.put("unit.toml", base("ZLG-7").as_bytes());
        let mut settings = folders.settings();
        settings.zenoh.certified_names = certified;
        let stand = Stand::start(settings).await;
        let (session, unit) = (stand.operator.session(), id("ZLG-7"));
        let text = base("ZLG-7").replacen("0.41", "0.44", 1);
        let plain = stand.operator.swap("ZLG-7", text.as_bytes(), &SwapOptions::default()).await;
        let key = key::by(&key::command(&unit), "ann").unwrap();
        let named = order(session, &key, r#"{"command":"rollback","by":"eve"}"#).await;
        assert!(
            matches!(&*named, [Ok(reply)] if reply.contains("\"accepted\":true")) == !certified,
            "{named:?}"
        );
        let forged = SwapOptions { by: "CN=ann".to_owned(), ..SwapOptions::default() };
        let forged = stand.operator.swap("ZLG-7", text.as_bytes(), &forged).await;
        if certified {
            let words = plain.unwrap_err();
            assert!(
                words.contains("imu/ZLG-7/calibration/NAME") && words.contains("certified_names"),
                "{words}"
            );
            let document = key::by(&key::calibration(&unit), "ann").unwrap();
            let swapped = order(session, &document, &text).await;
            assert!(
                matches!(&*swapped, [Ok(reply)] if reply.contains("\"outcome\":\"accepted\"")),
                "{swapped:?}"
            );
            let read = session.get(&document).await.unwrap().recv_async().await.unwrap();
            assert_eq!(read.into_result().unwrap().payload().to_bytes(), text.as_bytes());
        } else {
            assert_eq!(plain.unwrap().outcome, SwapOutcome::Accepted);
            let key = key::by(&key::command(&unit), "CN=ann").unwrap();
            let forged = order(session, &key, r#"{"command":"rollback"}"#).await;
            assert!(matches!(&*forged, [Err(words)] if words.contains("CN=ann")), "{forged:?}");
        }
        assert!(forged.unwrap_err().contains("CN="), "a name that no certificate has said");
        let entries = audit(&folders.state);
        let by: Vec<_> = entries.iter().map(|entry| entry.by.as_str()).filter(|by| !by.is_empty()).collect();
        let expected: &[&str] = if certified { &["CN=ann", "CN=ann"] } else { &["ann", "ann"] };
        assert_eq!(by, expected, "{entries:#?}");
        stand.stop().await;
    }
}
