//! Following a pre-launch calibration to its outcome.

use std::time::Duration;

use isotherm_cli::{Bar, Exit, print, say};
use isotherm_protocol::control::CommandOrder;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::status::{
    ConstantsChange, PreLaunchOutcome, PreLaunchProgress, PreLaunchVerdict, State, Status,
};
use tokio::time::{Instant, timeout_at};

use crate::client::Client;
use crate::follow::Follow;
use crate::page::{deg_per_h, short};
use crate::{ConsoleError, show};

/// Without a status for so long the unit, or the service, is gone.
const SILENCE: Duration = Duration::from_secs(15);

/// After so long a status can no longer be one from before the command.
const AT_ONCE: Duration = Duration::from_secs(3);

/// Shows how far it is and prints what came of it; SIGINT aborts it, a second one leaves it to itself.
pub(super) async fn follow(
    mut follow: Follow,
    client: &Client,
    unit: &UnitId,
    abort: &CommandOrder,
    json: bool,
) -> Result<Exit, ConsoleError> {
    let bar = Bar::over_seconds();
    let before = follow.first.as_ref().and_then(|status| status.pre_launch_outcome.clone());
    let (mut seen, mut interrupted) = (false, false);
    let begun = Instant::now();
    let outcome = loop {
        let deadline = Instant::now() + SILENCE;
        tokio::select! {
            status = timeout_at(deadline, follow.next()) => {
                let Ok(Some(status)) = status else {
                    bar.finish();
                    let words = format!("{unit} has been silent for {} s; the calibration may still be running", SILENCE.as_secs());
                    return Err(ConsoleError::TimedOut(words));
                };
                if let Some(progress) = &status.pre_launch {
                    draw(&bar, progress);
                }
                // One that is refused at once, for the same reason as the one before, looks like no other.
                seen |= begun.elapsed() > AT_ONCE;
                if let Some(outcome) = ended(&status, &mut seen, before.as_ref()) {
                    break outcome;
                }
            }
            _ = tokio::signal::ctrl_c() => {
                if interrupted {
                    bar.finish();
                    return Err(ConsoleError::Interrupted);
                }
                interrupted = true;
                bar.beside(|| say("Aborting; interrupt again to stop waiting."));
                super::give(client, unit, abort).await?;
            }
        }
    };
    bar.finish();
    let exit = if matches!(outcome.verdict, PreLaunchVerdict::Accepted(_)) { Exit::Ok } else { Exit::Failed };
    let text = if json { isotherm_cli::json(&outcome) } else { words(unit, &outcome) + "\n" };
    Ok(print(&text, exit))
}

/// The outcome, once there is one of this calibration.
fn ended(status: &Status, seen: &mut bool, before: Option<&PreLaunchOutcome>) -> Option<PreLaunchOutcome> {
    *seen |= status.state == State::PreLaunchCalibration;
    let outcome = status.pre_launch_outcome.as_ref()?;
    let new = *seen || Some(outcome) != before;
    (new && status.state != State::PreLaunchCalibration).then(|| outcome.clone())
}

/// Draws how far it is, and how sure it would be already.
fn draw(bar: &Bar, progress: &PreLaunchProgress) {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "seconds of a calibration")]
    let seconds = |s: f64| s.round() as u64;
    bar.seconds(seconds(progress.elapsed_s), seconds(progress.duration_s));
    let gyro = |gyro: &isotherm_protocol::status::PreLaunchGyro| {
        let sigma = gyro.sigma_rad_per_s.map_or("…".to_owned(), |sigma| format!("{:.4}", deg_per_h(sigma)));
        format!("{} ±{sigma}", gyro.name)
    };
    let gyros: Vec<_> = progress.gyros.iter().map(gyro).collect();
    bar.say(format!("{} °/h", gyros.join("  ")));
}

/// The outcome in words, its verdict in the first line.
fn words(unit: &UnitId, outcome: &PreLaunchOutcome) -> String {
    let next = super::in_standby(unit);
    match &outcome.verdict {
        PreLaunchVerdict::Accepted(changes) => {
            let overlay = outcome.overlay.map(|digest| format!(", overlay {}", short(&digest)));
            let overlay = overlay.unwrap_or_default();
            let header = ["gyro", "C0 change °/h", "± °/h", "B0 change °/h", "± °/h", "Earth rate °/h"];
            let table = show::table(header, changes.iter().map(row).collect(), 1);
            format!("{unit}: pre-launch calibration accepted{overlay}\n{table}\n{next}")
        }
        PreLaunchVerdict::Refused(reasons) => {
            for reason in reasons {
                say(format_args!("isotherm: {reason}"));
            }
            format!("{unit}: pre-launch calibration refused; nothing has changed\n{next}")
        }
        PreLaunchVerdict::Aborted => {
            format!("{unit}: pre-launch calibration aborted; the constants are as before\n{next}")
        }
    }
}

fn row(change: &ConstantsChange) -> Vec<String> {
    let optional =
        |value: Option<f64>| value.map_or("—".to_owned(), |value| format!("{:+.5}", deg_per_h(value)));
    vec![
        change.gyro.clone(),
        format!("{:+.5}", deg_per_h(change.static_bias_change_rad_per_s)),
        format!("{:.5}", deg_per_h(change.static_bias_sigma_rad_per_s)),
        optional(change.magnetic_bias_change_rad_per_s),
        change.magnetic_bias_sigma_rad_per_s.map_or("—".to_owned(), |s| format!("{:.5}", deg_per_h(s))),
        format!("{:+.4}", deg_per_h(change.earth_rate_rad_per_s)),
    ]
}
