//! A hundred crashes amid swaps and pre-launch calibrations, and some amid the start after them: what was accepted is whole,
//! and holds after the restart.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use isotherm_bus::{Consumer, ProducerOptions, SessionOptions, close, open, presence};
use isotherm_protocol::control::SwapOptions;
use isotherm_protocol::corrected::Revision;
use isotherm_protocol::document::Document;
use isotherm_protocol::history::{Acceptance, AuditEntry, AuditEvent, Source};
use isotherm_protocol::overlay::Overlay;
use isotherm_simulator::Scenario;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::presets::zeeman_rest;
use isotherm_tests::bench::LIMIT;
use isotherm_tests::dice::Dice;
use isotherm_tests::operator::{Operator, audit, kept};
use isotherm_tests::player::Player;
use isotherm_tests::process::{Service, program};
use serde_json::json;
use tokio::task::JoinHandle;

use crate::documents::{base, invalid, valid};
use crate::stand::Folders;

const CRASHES: u64 = 100;
/// The longest that a service is left to work before it crashes (ms).
const LONGEST_WORK_MS: u64 = 700;
/// After one in so many crashes the start crashes too.
const CRASHES_BEFORE_ONE_AT_START: u64 = 5;
/// The longest that such a start is given (ms): most have read state and folder by then.
const LONGEST_START_MS: u64 = 150;
/// Ticks of 20 ms for a calibration of 160 s: two of each mode, however it lies.
const TICKS_TO_CALIBRATE: u64 = 8100;

/// Its document changes all the time.
const SWAPPED: &str = "KILL-1";
/// It is calibrated before launch, again and again.
const CALIBRATED: &str = "KILL-2";

/// A unit at rest, with ticks of 20 ms, that changes its mode so often that a short calibration sees enough of both.
fn scenario(unit: &str, seed: u64) -> Scenario {
    // Longer than any life of the service.
    let long = Scenario { duration_s: 100_000.0, ..zeeman_rest(seed) };
    let mut scenario = Scenario { unit: unit.to_owned(), tick_ns: 20_000_000, ..long };
    if let Gyros::Zeeman(zeeman) = &mut scenario.instrument.gyros {
        zeeman.reversal.period_s = 40.0;
    }
    scenario
}

fn configuration(folders: &Folders) -> String {
    let file = folders.beside("service.toml");
    let text = "calibrations = \"documents\"\nstate = \"state\"\ncongestion = \"block\"\n\
                [folder]\nsettle_ms = 10\npoll_s = 1\n[pre_launch]\nduration_s = 160\n";
    std::fs::write(&file, text).unwrap();
    file.to_str().unwrap().to_owned()
}

/// Sessions around one life of the service.
struct Life {
    service: Service,
    operator: Operator,
    consumer: Consumer,
}

impl Life {
    async fn begin(configuration: &str) -> Self {
        let configuration = configuration.to_owned();
        let starting = tokio::task::spawn_blocking(move || {
            Service::start(&["--log-level", "off", "--config", &configuration])
        });
        let service = starting.await.unwrap();
        let options = SessionOptions { connect: vec![service.locator.clone()], ..SessionOptions::default() };
        let session = open(&options).await.unwrap();
        let consumer = Consumer::declare(&session, None).await.unwrap();
        presence::wait_for_service(&session, LIMIT).await.unwrap();
        Self { service, operator: Operator::new(session), consumer }
    }

    /// Has a unit give something out, and compares its revision with what was accepted last.
    async fn check(&mut self, unit: &str, seed: u64, state: &Path) -> Player {
        let options = ProducerOptions { batch_ticks: 10, match_timeout: LIMIT, ..ProducerOptions::default() };
        let mut player = Player::declare(self.operator.session(), &scenario(unit, seed), options).await;
        player.play(30).await;
        // It may have been in standby, for a pre-launch calibration: what an operator wanted last holds after a crash.
        self.operator.command(unit, json!({"command": "run"})).await.unwrap();
        player.play(30).await;
        let batch = loop {
            let batch =
                tokio::time::timeout(LIMIT, self.consumer.next()).await.expect("the unit runs").unwrap();
            if batch.unit == unit {
                break batch;
            }
        };
        let entries = audit(state);
        let accepted = last_accepted(&entries, unit);
        let expected = Revision { counter: accepted.revision, digest: accepted.digest.head() };
        assert_eq!(batch.revision, expected, "{unit} runs with what was accepted last");
        let text = kept(state, &accepted.digest);
        let parsed = Document::parse(&text, None).expect("what was accepted is valid");
        assert_eq!(parsed.document.unit, unit);
        if let Some(overlay) = accepted.overlay {
            let file = state.join("overlays").join(format!("{overlay}.toml"));
            let text = std::fs::read_to_string(&file).expect("the overlay is kept too");
            assert_eq!(Overlay::parse(&text, None).expect("a whole overlay").digest, overlay);
        }
        player
    }

    /// The crash.
    async fn end(self, work: [JoinHandle<()>; 2]) {
        let Self { service, operator, consumer } = self;
        service.kill();
        for task in work {
            task.abort();
            // A task that was not stopped by this has failed.
            if let Err(error) = task.await
                && error.is_panic()
            {
                std::panic::resume_unwind(error.into_panic());
            }
        }
        drop(consumer);
        close(operator.session().clone(), LIMIT).await.unwrap();
    }
}

fn last_accepted<'e>(entries: &'e [AuditEntry], unit: &str) -> &'e Acceptance {
    let of_unit = entries.iter().rev().filter(|entry| entry.unit.as_deref() == Some(unit));
    let mut accepted = of_unit.filter_map(|entry| match &entry.event {
        AuditEvent::Accepted(accepted) => Some(accepted),
        AuditEvent::Withdrawn(_) => panic!("every swap here is one to the next tick"),
        _ => None,
    });
    accepted.next().expect("the unit has a document")
}

/// Swaps of every kind, one after the other, for as long as somebody answers.
async fn swap_along(operator: Operator, documents: std::path::PathBuf, mut player: Player, mut dice: Dice) {
    let file = documents.join(format!("{SWAPPED}.toml"));
    let options = SwapOptions::default();
    loop {
        player.play(20).await;
        let good = valid(SWAPPED, &mut dice).into_bytes();
        let bad = invalid(SWAPPED, &mut dice);
        let answered = match dice.below(8) {
            0 | 1 => operator.swap(SWAPPED, &good, &options).await.is_ok(),
            2 => operator.swap(SWAPPED, &bad, &options).await.is_ok(),
            3 => {
                operator.put(SWAPPED, &good, &options).await;
                true
            }
            4 => operator.command(SWAPPED, json!({"command": "rollback"})).await.is_ok(),
            5 => {
                std::fs::write(&file, bad).unwrap();
                true
            }
            6 => {
                // In two goes, with a pause that is longer than the service waits.
                std::fs::write(&file, &good[..good.len() / 2]).unwrap();
                tokio::time::sleep(Duration::from_millis(dice.below(30))).await;
                std::fs::write(&file, &good).unwrap();
                true
            }
            _ => {
                std::fs::write(documents.join("partial"), &good).unwrap();
                std::fs::rename(documents.join("partial"), &file).unwrap();
                true
            }
        };
        if !answered {
            return;
        }
    }
}

/// One pre-launch calibration after the other, for as long as somebody answers.
async fn calibrate(operator: Operator, mut player: Player, mut dice: Dice) {
    let pre_launch = json!({"command": "pre-launch", "latitude_deg": 55.75, "heading_deg": 30.0, "pitch_roll_deg": [0.0, 0.0]});
    loop {
        if dice.below(3) == 0 {
            let document = valid(CALIBRATED, &mut dice);
            if operator.swap(CALIBRATED, document.as_bytes(), &SwapOptions::default()).await.is_err() {
                return;
            }
        }
        for order in [json!({"command": "standby"}), pre_launch.clone()] {
            if operator.command(CALIBRATED, order).await.is_err() {
                return;
            }
        }
        player.play(TICKS_TO_CALIBRATE).await;
        if operator.command(CALIBRATED, json!({"command": "run"})).await.is_err() {
            return;
        }
        player.play(50).await;
    }
}

/// Starts a service that does not come far.
async fn crash_at_start(configuration: &str, dice: &mut Dice) {
    let mut child = Command::new(program("isotherm"))
        .args(["serve", "--listen", "tcp/127.0.0.1:0", "--config", configuration])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    // The moment of the crash, not a wait for anything.
    tokio::time::sleep(Duration::from_millis(dice.below(LONGEST_START_MS))).await;
    child.kill().unwrap();
    child.wait().unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn after_a_crash_at_any_moment_every_unit_runs_with_a_whole_valid_set() {
    let folders = Folders::new();
    let configuration = configuration(&folders);
    for unit in [SWAPPED, CALIBRATED] {
        folders.put(&format!("{unit}.toml"), base(unit).as_bytes());
    }
    let mut dice = Dice::new(9);
    for crash in 0..CRASHES {
        if crash % CRASHES_BEFORE_ONE_AT_START == 1 {
            crash_at_start(&configuration, &mut dice).await;
        }
        let mut life = Life::begin(&configuration).await;
        let swapped = life.check(SWAPPED, crash, &folders.state).await;
        let calibrated = life.check(CALIBRATED, crash, &folders.state).await;
        let (operator, documents) = (life.operator.clone(), folders.documents.clone());
        let work = [
            tokio::spawn(swap_along(operator.clone(), documents, swapped, Dice::new(dice.number()))),
            tokio::spawn(calibrate(operator, calibrated, Dice::new(dice.number()))),
        ];
        tokio::time::sleep(Duration::from_millis(dice.below(LONGEST_WORK_MS))).await;
        life.end(work).await;
    }
    let mut life = Life::begin(&configuration).await;
    for unit in [SWAPPED, CALIBRATED] {
        life.check(unit, CRASHES, &folders.state).await;
    }
    let (status, totals) = tokio::task::spawn_blocking(move || life.service.stop()).await.unwrap();
    assert_eq!(status.code(), Some(0), "{totals}");

    // The crashes fell into what they were meant to fall into.
    let entries = audit(&folders.state);
    let accepted: Vec<_> = entries
        .iter()
        .filter_map(|entry| match &entry.event {
            AuditEvent::Accepted(accepted) => Some(accepted),
            _ => None,
        })
        .collect();
    let from = |is: fn(&Source) -> bool| accepted.iter().filter(|accepted| is(&accepted.source)).count();
    let ways = [
        from(|source| matches!(source, Source::Bus)),
        from(|source| matches!(source, Source::Folder { .. })),
        from(|source| matches!(source, Source::Start { .. })),
        from(|source| matches!(source, Source::Rollback { .. })),
        from(|source| matches!(source, Source::PreLaunch)),
    ];
    println!("accepted by bus, folder, start, rollback, pre-launch: {ways:?}, {} entries", entries.len());
    assert!(ways.iter().all(|count| *count >= 5), "{ways:?}");
}
