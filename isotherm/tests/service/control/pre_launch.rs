//! Pre-launch calibration: its result as an overlay, put in force or only kept, and taken back.

use std::time::Duration;

use isotherm_correction::operation::State;
use isotherm_correction::units::Span;
use isotherm_protocol::control::{SwapOptions, SwapOutcome};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::{AuditEvent, CommandRecord};
use isotherm_protocol::overlay::Overlay;
use isotherm_protocol::status::PreLaunchVerdict;
use isotherm_service::Settings;

use super::stand::{Folders, LIMIT, Stand, UNIT, assert_accepted, document, unit_id};

const EARTH_RAD_PER_S: f64 = 7.292_115e-5;

fn order(install: bool) -> String {
    let place = r#""latitude_deg":55,"heading_deg":0,"pitch_roll_deg":[0,0]"#;
    format!(r#"{{"command":"pre-launch","by":"ann",{place},"duration_s":60,"install":{install}}}"#)
}

/// A unit in standby whose counts are those of a bias of 80 °/h and more: as far as the limits go, that is allowed.
async fn stand(folders: &Folders) -> Stand {
    let mut settings = Settings { status_interval: Duration::from_millis(200), ..folders.settings() };
    settings.unit.in_standby = true;
    settings.pre_launch.limits.static_bias_change_rad_per_s = 1.0;
    settings.pre_launch.limits.time_per_mode = Span::from_s(30.0);
    let mut stand = Stand::start(settings).await;
    stand.noisy = true;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &SwapOptions::default()).await, 1);
    send(&mut stand, 2000).await;
    stand
}

/// Sends ticks and waits until they were received.
async fn send(stand: &mut Stand, ticks: u64) {
    let end = stand.send(UNIT, ticks).await + ticks;
    while stand.service.totals().unit(&unit_id(UNIT)).ticks_in < end {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

/// Waits for the `nth` pre-launch calibration to be written down as ended.
async fn ended(stand: &Stand, nth: usize) -> CommandRecord {
    let deadline = tokio::time::Instant::now() + LIMIT;
    loop {
        let history = stand.history(UNIT).await;
        let mut ended = history.into_iter().filter_map(|entry| match entry.event {
            AuditEvent::Command(record) if record.command == "pre-launch ended" => Some(record),
            _ => None,
        });
        if let Some(record) = ended.nth(nth) {
            return record;
        }
        assert!(tokio::time::Instant::now() < deadline, "not in time: {:#?}", stand.status(UNIT).pre_launch);
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

fn overlay_in(folders: &Folders, digest: Digest) -> (String, Overlay) {
    let text =
        std::fs::read_to_string(folders.state.join("overlays").join(format!("{digest}.toml"))).unwrap();
    let overlay = Overlay::parse(&text, None).unwrap().overlay;
    (text, overlay)
}

#[tokio::test(flavor = "multi_thread")]
async fn the_result_is_an_overlay_that_takes_the_bias_away_and_can_be_taken_back() {
    let folders = Folders::new();
    let mut stand = stand(&folders).await;
    let reply = stand.command(UNIT, &order(true)).await;
    assert!(reply.accepted, "{reply:#?}");
    assert_eq!(reply.state, State::PreLaunchCalibration);
    send(&mut stand, 6000).await;
    let progress = stand.status(UNIT).pre_launch.expect("progress");
    assert!((progress.elapsed_s - 30.0).abs() < 0.5, "{progress:#?}");
    send(&mut stand, 6500).await;
    let record = ended(&stand, 0).await;
    assert!(record.accepted, "{record:#?}");
    assert!(record.reason.unwrap().contains("revision 2"));
    assert_eq!(stand.status(UNIT).state, State::Standby);

    let status = stand.status(UNIT);
    let outcome = status.pre_launch_outcome.expect("an outcome");
    assert!(matches!(outcome.verdict, PreLaunchVerdict::Accepted(_)), "{outcome:#?}");
    assert_eq!(status.calibration.unwrap().overlay, outcome.overlay);
    let (_, overlay) = overlay_in(&folders, outcome.overlay.unwrap());
    assert_eq!(overlay.overlay_of, Digest::of(document(UNIT, 1.0).as_bytes()).to_string());
    assert_eq!(overlay.gyro.len(), 3);

    // What is left of the rate is the Earth's.
    stand.command(UNIT, r#"{"command":"run"}"#).await;
    let ticks = stand.run_unit(UNIT, 4000).await;
    let mean = |axis: usize| ticks.iter().map(|(_, tick)| tick.delta_angle[axis]).sum::<f64>() / 20.0;
    let (sin, cos) = 55.0_f64.to_radians().sin_cos();
    for (axis, expected) in [EARTH_RAD_PER_S * cos, 0.0, -EARTH_RAD_PER_S * sin].into_iter().enumerate() {
        let rate = mean(axis);
        assert!((rate - expected).abs() < 5e-6, "axis {axis}: {rate} rad/s, {expected} expected");
    }

    let reply = stand.command(UNIT, r#"{"command":"rollback"}"#).await;
    assert_accepted(&reply.swap.unwrap(), 3);
    assert_eq!(stand.active(UNIT).await.unwrap(), document(UNIT, 1.0));
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_result_that_is_only_kept_can_be_put_in_force_later_and_the_next_one_lies_on_the_document_too() {
    let folders = Folders::new();
    let mut stand = stand(&folders).await;
    stand.command(UNIT, &order(false)).await;
    send(&mut stand, 12_500).await;
    assert!(ended(&stand, 0).await.accepted);
    let kept = stand.status(UNIT).pre_launch_outcome.unwrap().overlay.unwrap();
    assert_eq!(stand.active(UNIT).await.unwrap(), document(UNIT, 1.0));

    let (text, first) = overlay_in(&folders, kept);
    assert_accepted(&stand.swap(UNIT, &text, &SwapOptions::default()).await, 2);
    assert_eq!(stand.swap(UNIT, &text, &SwapOptions::default()).await.outcome, SwapOutcome::Unchanged);
    stand.command(UNIT, &order(true)).await;
    send(&mut stand, 12_500).await;
    assert!(ended(&stand, 1).await.accepted);
    let second = stand.status(UNIT).pre_launch_outcome.unwrap().overlay.unwrap();
    let (_, second) = overlay_in(&folders, second);
    assert_eq!(second.overlay_of, first.overlay_of);
    for (first, second) in first.gyro.iter().zip(&second.gyro) {
        let [first, second] = [first, second].map(|gyro| gyro.static_bias_change_deg_per_h);
        assert!((first - second).abs() < 1.0, "{first} °/h, then {second} °/h in all");
    }
    stand.stop().await;

    // After a restart the overlay still lies on its document.
    let mut stand = Stand::start(folders.settings()).await;
    send(&mut stand, 10).await;
    assert_eq!(stand.swap(UNIT, &text, &SwapOptions::default()).await.outcome, SwapOutcome::Accepted);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_aborted_or_refused_one_changes_nothing() {
    let folders = Folders::new();
    let mut stand = stand(&folders).await;
    stand.command(UNIT, &order(true)).await;
    send(&mut stand, 3000).await;
    assert_eq!(stand.command(UNIT, r#"{"command":"abort"}"#).await.state, State::Standby);
    let outcome = stand.status(UNIT).pre_launch_outcome.unwrap();
    assert_eq!((outcome.verdict, outcome.overlay), (PreLaunchVerdict::Aborted, None));

    stand.command(UNIT, &order(true)).await;
    stand.temperature_deg_c = 55.0;
    send(&mut stand, 4000).await;
    let record = ended(&stand, 0).await;
    assert!(!record.accepted && record.reason.as_ref().unwrap().contains("gyro"), "{record:#?}");
    assert_eq!(stand.active(UNIT).await.unwrap(), document(UNIT, 1.0));
    assert_eq!(stand.status(UNIT).calibration.unwrap().revision.counter, 1);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_swap_gives_it_up_and_status_log_and_audit_file_say_so() {
    let folders = Folders::new();
    let mut stand = stand(&folders).await;
    let mut told = String::new();
    for (revision, by_rollback) in [(2, false), (3, true)] {
        assert!(stand.command(UNIT, &order(true)).await.accepted);
        send(&mut stand, 3000).await;
        let reply = if by_rollback {
            stand.command(UNIT, r#"{"command":"rollback"}"#).await.swap.expect("a rollback is a swap")
        } else {
            stand.swap(UNIT, &document(UNIT, 2.0), &SwapOptions::default()).await
        };
        assert_accepted(&reply, revision);
        told.extend(reply.warnings.into_iter().map(|warning| warning.message + "\n"));
        let reason = format!("given up: a swap of the calibration (revision {revision})");
        let status = stand.status(UNIT);
        assert_eq!(status.state, State::Standby);
        let outcome = status.pre_launch_outcome.unwrap();
        assert_eq!(outcome.verdict, PreLaunchVerdict::Refused(vec![reason.clone()]));
        let record = ended(&stand, usize::from(by_rollback)).await;
        assert_eq!((record.accepted, record.reason), (false, Some(reason)));
        assert_eq!(record.state_after, "standby");
    }
    // The next one is not taken for it.
    assert!(stand.command(UNIT, &order(true)).await.accepted);
    assert_eq!(stand.command(UNIT, r#"{"command":"abort"}"#).await.state, State::Standby);
    assert_eq!(stand.status(UNIT).pre_launch_outcome.unwrap().verdict, PreLaunchVerdict::Aborted);

    // A self-test begins anew, by a swap and by a rollback alike.
    assert!(stand.command(UNIT, r#"{"command":"self-test"}"#).await.accepted);
    send(&mut stand, 100).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 5.0), &SwapOptions::default()).await, 4);
    let reply = stand.command(UNIT, r#"{"command":"rollback"}"#).await;
    assert_eq!((reply.accepted, reply.state), (true, State::SelfTest), "{reply:#?}");
    assert_accepted(&reply.swap.unwrap(), 5);
    insta::assert_snapshot!(told);
    stand.stop().await;
}
