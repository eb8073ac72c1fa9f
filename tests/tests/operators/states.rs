//! The states of a unit (models §7) over the bus, with the simulated laser unit.

use std::time::{Duration, Instant};

use isotherm_bus::ProducerOptions;
use isotherm_correction::operation::State;
use isotherm_correction::sample::{ChannelName, TickFlags};
use isotherm_correction::units::AngularRate;
use isotherm_protocol::codec::encode;
use isotherm_protocol::control::{SwapOptions, SwapOutcome};
use isotherm_protocol::corrected::CorrectedTick;
use isotherm_protocol::document::Document;
use isotherm_protocol::history::{AuditEvent, Source};
use isotherm_protocol::key::{self, RawStream, UnitId};
use isotherm_protocol::overlay::Overlay;
use isotherm_protocol::raw::{HealthBatch, HealthReading, HealthTick};
use isotherm_protocol::status::{self, PreLaunchVerdict, SelfTestReport};
use isotherm_simulator::Scenario;
use isotherm_simulator::instrument::Gyros;
use isotherm_simulator::presets::zeeman_rest;
use isotherm_tests::bench::LIMIT;
use isotherm_tests::operator::audit;
use isotherm_tests::player::Player;
use serde_json::{Value, json};

use crate::documents::{BASE, BASE_UNIT};
use crate::stand::{Folders, Stand};

/// A report of a self-test is there after so long by any clock.
const SELF_TEST_LIMIT: Duration = Duration::from_secs(15);

/// The laser unit at rest, its mode reversed every half minute.
fn scenario(seed: u64) -> Scenario {
    let mut scenario = zeeman_rest(seed);
    if let Gyros::Zeeman(zeeman) = &mut scenario.instrument.gyros {
        zeeman.reversal.period_s = 30.0;
    }
    scenario
}

/// A service with the laser unit running under its document.
struct Scene {
    folders: Folders,
    stand: Stand,
    player: Player,
    played: u64,
}

impl Scene {
    async fn start(document: &str) -> Self {
        let folders = Folders::new();
        folders.put("unit.toml", document.as_bytes());
        let stand = Stand::start(folders.settings()).await;
        let options = ProducerOptions { batch_ticks: 20, match_timeout: LIMIT, ..ProducerOptions::default() };
        let player = Player::declare(stand.operator.session(), &scenario(3), options).await;
        let mut scene = Self { folders, stand, player, played: 0 };
        scene.play(100).await;
        scene
    }

    /// Plays whole batches and waits until the service has taken them in.
    async fn play(&mut self, ticks: u64) {
        assert_eq!(ticks % 20, 0, "whole batches");
        self.player.play(ticks).await;
        self.played += ticks;
        let (unit, deadline) = (UnitId::new(BASE_UNIT).unwrap(), Instant::now() + LIMIT);
        while self.stand.service.totals().unit(&unit).ticks_in < self.played {
            assert!(Instant::now() < deadline, "the service takes in what is played");
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    }

    async fn status(&self) -> status::Status {
        self.stand.operator.status(BASE_UNIT).await
    }

    /// Gives a command that is carried out.
    async fn command(&self, order: Value, state: State) {
        let reply = self.stand.operator.command(BASE_UNIT, order.clone()).await.unwrap();
        assert!(reply.accepted, "{order}: {reply:?}");
        assert_eq!(reply.state, state, "{order}");
        assert_eq!(self.status().await.state, state, "{order}");
    }

    /// Gives a command that is refused; the reason.
    async fn refused(&self, order: Value, state: State) -> String {
        let reply = self.stand.operator.command(BASE_UNIT, order.clone()).await.unwrap();
        assert!(!reply.accepted, "{order} in {state}: {reply:?}");
        assert_eq!(reply.state, state, "{order}");
        assert_eq!(reply.allowed, state.allowed(), "{order}");
        assert_eq!(self.status().await.state, state, "{order}");
        reply.reason.expect("a reason")
    }

    /// What has come out since the last look, until the last tick played.
    async fn received(&mut self) -> Vec<(u64, CorrectedTick)> {
        let mut ticks = Vec::new();
        while ticks.last().is_none_or(|(_, tick): &(u64, CorrectedTick)| tick.sequence + 1 < self.played) {
            let batch =
                tokio::time::timeout(LIMIT, self.stand.consumer.next()).await.expect("in time").unwrap();
            ticks.extend(batch.ticks.into_iter().map(|tick| (batch.revision.counter, tick)));
        }
        ticks
    }

    async fn until_report(&self) -> SelfTestReport {
        self.stand.operator.until(BASE_UNIT, |status| status.self_test.clone()).await
    }
}

/// Voltages and a counter as a producer reports them.
async fn report_health(scene: &Scene, volts: f64) {
    let status = scene.status().await;
    let reading = |name: &str, value| HealthReading { name: ChannelName::from(name).unwrap(), value };
    let tick = |counter: f64| HealthTick {
        time_ns: status.last_tick.map_or(0, |last| last.end_time_ns),
        readings: vec![
            reading("half-wave x", 48.0),
            reading("half-wave y", volts),
            reading("half-wave z", 48.0),
            reading("frame errors", counter),
        ],
    };
    let frame = encode(&HealthBatch { ticks: vec![tick(100.0), tick(102.0)] }).unwrap();
    let key = key::raw(&UnitId::new(BASE_UNIT).unwrap(), RawStream::Health);
    let before = scene.status().await.input_rates;
    scene.stand.operator.session().put(key, frame).await.unwrap();
    // What is asked for on a session comes behind what was put on it.
    let _ = (before, scene.status().await);
}

fn pre_launch(duration_s: f64) -> Value {
    json!({"command": "pre-launch", "latitude_deg": 55.75, "heading_deg": 30.0, "duration_s": duration_s, "by": "ann"})
}

#[tokio::test(flavor = "multi_thread")]
async fn a_self_test_has_its_report_in_time_with_ticks_and_without() {
    let mut scene = Scene::start(BASE).await;
    scene.command(json!({"command": "standby"}), State::Standby).await;
    for (volts, passed) in [(48.0, true), (60.0, false)] {
        scene.command(json!({"command": "self-test"}), State::SelfTest).await;
        report_health(&scene, volts).await;
        // Ten seconds and a little more.
        scene.play(2200).await;
        let report = scene.until_report().await;
        assert_eq!(report.passed, passed, "{report:#?}");
        let failed: Vec<_> = report.items.iter().filter(|item| !item.passed).collect();
        assert_eq!(failed.is_empty(), passed, "{failed:#?}");
        if let [item] = &*failed {
            assert_eq!((&*item.name, item.value), ("voltage half-wave y", Some(60.0)));
            assert_eq!((item.at_least, item.at_most, &*item.unit_of_measure), (Some(41.0), Some(55.0), "V"));
        }
        let names: Vec<_> = report.items.iter().map(|item| item.name.as_str()).collect();
        for name in [
            "calibration",
            "gyro x",
            "gyro y",
            "gyro z",
            "accelerometer z",
            "temperature gyro0",
            "counter frame errors",
        ] {
            assert!(names.contains(&name), "{name} in {names:?}");
        }
        assert_eq!(scene.status().await.state, State::Standby);
    }
    let begun = Instant::now();
    scene.command(json!({"command": "self-test"}), State::SelfTest).await;
    let report = scene.until_report().await;
    assert!(begun.elapsed() < SELF_TEST_LIMIT, "{:?}", begun.elapsed());
    let gyro = report.items.iter().find(|item| item.name == "gyro x").unwrap();
    assert!(!report.passed && !gyro.passed, "nothing came: {report:#?}");
    scene.stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_state_does_not_allow_is_refused_with_the_reason_and_what_it_allows() {
    let mut scene = Scene::start(BASE).await;
    let orders = || {
        [
            ("standby", json!({"command": "standby"})),
            ("self-test", json!({"command": "self-test"})),
            ("pre-launch", pre_launch(60.0)),
            ("abort", json!({"command": "abort"})),
            ("run", json!({"command": "run"})),
            ("rest", json!({"command": "rest", "latitude_deg": 55.75, "heading_deg": 30.0})),
            ("end-rest", json!({"command": "end-rest"})),
            ("rollback", json!({"command": "rollback"})),
        ]
    };
    let mut refusals = 0;
    let ways: [(State, &[Value]); 5] = [
        (State::RunningWithReversal, &[]),
        (State::RunningWithoutReversal, &[json!({"command": "run", "reversal": false})]),
        (State::Standby, &[json!({"command": "standby"})]),
        (State::SelfTest, &[json!({"command": "self-test"})]),
        (State::PreLaunchCalibration, &[json!({"command": "abort"}), pre_launch(60.0)]),
    ];
    for (state, way) in ways {
        for order in way {
            assert!(
                scene.stand.operator.command(BASE_UNIT, order.clone()).await.unwrap().accepted,
                "{order}"
            );
        }
        for (name, order) in orders().into_iter().filter(|(name, _)| !state.allowed().contains(name)) {
            let reason = scene.refused(order, state).await;
            assert!(reason.contains(name) && reason.contains(state.name()), "{reason}");
            assert!(state.allowed().iter().all(|allowed| reason.contains(allowed)), "{reason}");
            refusals += 1;
        }
    }
    assert_eq!(refusals, 3 + 3 + 1 + 6 + 6);
    scene.command(json!({"command": "abort"}), State::Standby).await;
    // What a state allows may yet be refused.
    scene.refused(json!({"command": "rollback"}), State::Standby).await;
    let reason = scene
        .refused(json!({"command": "pre-launch", "latitude_deg": 95.0, "heading_deg": 0.0}), State::Standby)
        .await;
    assert!(reason.contains("95"), "{reason}");
    scene.play(100).await;
    scene.stand.stop().await;
    let told = audit(&scene.folders.state).into_iter().filter(|entry| {
        matches!(&entry.event, AuditEvent::Command(command) if !command.accepted && command.reason.is_some())
    });
    assert_eq!(told.count(), refusals + 2, "every refusal is written down");
}

#[tokio::test(flavor = "multi_thread")]
async fn ticks_in_standby_are_held_back_and_announced_as_a_gap() {
    let mut scene = Scene::start(BASE).await;
    scene.play(100).await;
    assert_eq!(scene.received().await.len(), 200);
    scene.command(json!({"command": "standby"}), State::Standby).await;
    scene.play(300).await;
    assert!(scene.stand.consumer.try_next().is_none(), "nothing goes out");
    scene.command(json!({"command": "run"}), State::RunningWithReversal).await;
    scene.play(100).await;
    let ticks = scene.received().await;
    assert_eq!(ticks.len(), 100);
    let (_, first) = &ticks[0];
    assert_eq!((first.sequence, first.missed), (500, 300));
    assert!(first.flags.contains(TickFlags::GAP));
    assert!(ticks[1..].iter().all(|(_, tick)| tick.missed == 0));
    let account = scene.stand.consumer.continuity(&UnitId::new(BASE_UNIT).unwrap());
    assert!(account.is_whole() && account.announced_missing == 300, "{account:?}");
    scene.stand.stop().await;
}

/// Constants of the document that are wrong by a known amount (°/h): as they stand, how far off, gyro by gyro.
const STATIC: [(&str, f64); 3] = [("[0.41, ", -0.3), ("[-0.28, ", 0.2), ("[0.15, ", 0.25)];
const MAGNETIC: [(&str, f64); 3] = [("[2.3, ", 0.4), ("[-1.7, ", -0.35), ("[3.1, ", 0.15)];

/// The document with its constants off.
fn off() -> String {
    let mut text = BASE.to_owned();
    for (from, by) in STATIC.into_iter().chain(MAGNETIC) {
        assert!(text.contains(from), "{from}");
        let value: f64 = from[1..from.len() - 2].parse().unwrap();
        text = text.replacen(from, &format!("[{:?}, ", value + by), 1);
    }
    text
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pre_launch_calibration_finds_the_constants_and_a_rollback_gives_the_old_ones_back() {
    let base = off();
    let mut scene = Scene::start(&base).await;
    scene.command(json!({"command": "standby"}), State::Standby).await;
    scene.command(pre_launch(600.0), State::PreLaunchCalibration).await;
    scene.play(60_000).await;
    let progress = scene.stand.operator.until(BASE_UNIT, |status| status.pre_launch.clone()).await;
    assert!(
        (progress.elapsed_s - 300.0).abs() < 2.0 && (progress.duration_s - 600.0).abs() < 1e-9,
        "{progress:?}"
    );
    assert!(
        progress.gyros.iter().all(|gyro| gyro.modes.len() == 2 && gyro.sigma_rad_per_s.is_some()),
        "{progress:?}"
    );
    scene.play(61_000).await;
    let outcome = scene.stand.operator.until(BASE_UNIT, |status| {
        // Stored and put in force behind the tick that ends it.
        status
            .pre_launch_outcome
            .clone()
            .filter(|outcome| outcome.overlay.is_some() && status.swaps.accepted == 1)
    });
    let outcome = outcome.await;
    let PreLaunchVerdict::Accepted(gyros) = &outcome.verdict else { panic!("{outcome:#?}") };
    let deg_per_h = |rad_per_s: f64| AngularRate::from_rad_per_s(rad_per_s).as_deg_per_h();
    for ((gyro, (_, off)), (_, magnetic_off)) in gyros.iter().zip(STATIC).zip(MAGNETIC) {
        let found = [
            (off, gyro.static_bias_change_rad_per_s, gyro.static_bias_sigma_rad_per_s),
            (
                magnetic_off,
                gyro.magnetic_bias_change_rad_per_s.unwrap(),
                gyro.magnetic_bias_sigma_rad_per_s.unwrap(),
            ),
        ];
        for (off, change, sigma) in
            found.map(|(off, change, sigma)| (off, deg_per_h(change), deg_per_h(sigma)))
        {
            assert!(
                (change + off).abs() < 3.0 * sigma,
                "{}: off by {off}, changed by {change} ± {sigma} °/h",
                gyro.gyro
            );
            assert!(sigma < 0.05, "{}: ± {sigma} °/h", gyro.gyro);
        }
    }
    assert_eq!(gyros.len(), 3);

    // An overlay on the document as it was, in force under a new revision.
    let status = scene.status().await;
    let active = status.calibration.unwrap();
    assert_eq!((active.revision.counter, active.overlay, status.state), (2, outcome.overlay, State::Standby));
    let file = scene.folders.state.join("overlays").join(format!("{}.toml", outcome.overlay.unwrap()));
    let overlay = Overlay::parse(&std::fs::read_to_string(file).unwrap(), None).unwrap().overlay;
    let digest = isotherm_protocol::digest::Digest::of(base.as_bytes());
    assert_eq!(overlay.overlay_of, digest.to_string());
    let corrected = Document::parse(&scene.stand.operator.active(BASE_UNIT).await.unwrap(), None).unwrap();
    assert_eq!(corrected.document.unit, BASE_UNIT);

    scene.command(json!({"command": "run"}), State::RunningWithReversal).await;
    scene.play(100).await;
    assert!(
        scene.received().await[100..].iter().all(|(revision, _)| *revision == 2),
        "behind those before the standby"
    );
    let reply =
        scene.stand.operator.command(BASE_UNIT, json!({"command": "rollback", "by": "ann"})).await.unwrap();
    assert_eq!(reply.swap.unwrap().outcome, SwapOutcome::Accepted);
    assert_eq!(scene.stand.operator.active(BASE_UNIT).await.unwrap(), base, "the old document to the letter");
    scene.play(100).await;
    assert!(scene.received().await.iter().all(|(revision, _)| *revision == 3));
    scene.stand.stop().await;

    let sources: Vec<_> = audit(&scene.folders.state)
        .into_iter()
        .filter_map(|entry| match entry.event {
            AuditEvent::Accepted(accepted) => Some((entry.by, accepted.source)),
            _ => None,
        })
        .collect();
    assert!(matches!(&sources[0].1, Source::Start { .. }));
    assert_eq!(
        sources[1..],
        [("ann".to_owned(), Source::PreLaunch), ("ann".to_owned(), Source::Rollback { to: 1 })]
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pre_launch_calibration_that_is_given_up_changes_nothing() {
    let base = off();
    let mut scene = Scene::start(&base).await;
    for by_swap in [false, true] {
        scene.command(json!({"command": "standby"}), State::Standby).await;
        scene.command(pre_launch(600.0), State::PreLaunchCalibration).await;
        scene.play(20_000).await;
        if by_swap {
            // What is being determined is no longer what is in force.
            let document = base.replace("1.94", "1.9401");
            let reply = scene
                .stand
                .operator
                .swap(BASE_UNIT, document.as_bytes(), &SwapOptions::default())
                .await
                .unwrap();
            assert_eq!(reply.outcome, SwapOutcome::Accepted, "{:#?}", reply.problems);
        } else {
            scene.command(json!({"command": "abort"}), State::Standby).await;
            assert_eq!(scene.stand.operator.active(BASE_UNIT).await.unwrap(), base);
        }
        let status = scene.status().await;
        assert_eq!((status.state, status.pre_launch), (State::Standby, None));
        let outcome = status.pre_launch_outcome.unwrap();
        let expected = if by_swap {
            PreLaunchVerdict::Refused(vec!["given up: a swap of the calibration (revision 2)".to_owned()])
        } else {
            PreLaunchVerdict::Aborted
        };
        assert_eq!((outcome.verdict, outcome.overlay), (expected, None));
        assert_eq!(status.calibration.unwrap().revision.counter, 1 + u64::from(by_swap));
    }
    scene.command(json!({"command": "run"}), State::RunningWithReversal).await;
    scene.play(100).await;
    assert!(scene.received().await.last().is_some_and(|(revision, _)| *revision == 2));
    scene.stand.stop().await;
    assert!(std::fs::read_dir(scene.folders.state.join("overlays")).unwrap().next().is_none());
}
