//! Diagnostics of every unit, once a second.

use std::sync::Arc;
use std::time::Duration;

use isotherm_log::ros2::{Header, Time, time};
use isotherm_protocol::digest::Digits;
use isotherm_protocol::status::{Output, State};
use tokio::time::MissedTickBehavior;
use zenoh::Session;

use super::account::{Look, Unit};
use super::publishing::{Outlet, now_ns};
use crate::interface::{DiagnosticArray, DiagnosticStatus, KeyValue, Level};
use crate::mapping::UnitMapping;
use crate::totals::UnitTotals;

/// How often.
const INTERVAL: Duration = Duration::from_secs(1);
/// Age from which a status says that its service is gone; one comes every second.
const SILENT: Duration = Duration::from_secs(4);
/// Jitter beyond so many times what the mapping states is worth a look.
const FACTOR: f64 = 3.0;

/// Publishes them until the task is ended.
pub(super) async fn publish(units: Vec<Arc<Unit>>, ros: Session, mut outlet: Outlet) {
    let mut interval = tokio::time::interval(INTERVAL);
    interval.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut before: Vec<UnitTotals> = units.iter().map(|unit| unit.totals()).collect();
    let mut alone = false;
    loop {
        interval.tick().await;
        alone = tell_alone(&ros, alone).await;
        let looks: Vec<Look> = units.iter().map(|unit| unit.look()).collect();
        let status = units.iter().zip(&looks).zip(&before);
        let status = status.map(|((unit, look), before)| describe(&unit.mapping, look, before)).collect();
        let stamp = time(now_ns()).unwrap_or(Time { sec: 0, nanosec: 0 });
        let header = Header { stamp, frame_id: String::new() };
        // Where it cannot be published, nobody can be told.
        let _ = outlet.put(&DiagnosticArray { header, status }).await;
        before = looks.into_iter().map(|look| look.totals).collect();
    }
}

/// Says when there is nobody to speak with, and when there is again.
async fn tell_alone(ros: &Session, was: bool) -> bool {
    let info = ros.info();
    let alone = info.routers_zid().await.next().is_none() && info.peers_zid().await.next().is_none();
    if alone && !was {
        tracing::warn!(
            "no router or node of ROS 2 is connected; waiting (--connect HOST:PORT, or --listen to be the router)"
        );
    } else if was && !alone {
        tracing::info!("connected with ROS 2");
    }
    alone
}

/// Everything that is worth saying of a unit.
pub(super) fn describe(mapping: &UnitMapping, look: &Look, before: &UnitTotals) -> DiagnosticStatus {
    let (level, message) = judge(mapping, look, before);
    DiagnosticStatus {
        level,
        name: format!("isotherm: {}", mapping.unit),
        message,
        hardware_id: mapping.unit.to_string(),
        values: values(mapping, look),
    }
}

/// The worst of what is the matter; all of it in words.
fn judge(mapping: &UnitMapping, look: &Look, before: &UnitTotals) -> (Level, String) {
    let Look { totals, status, jitter_s, last_refusal } = look;
    let mut found: Vec<(Level, String)> = Vec::new();
    let status = status.as_ref().filter(|(_, age)| *age < SILENT).map(|(status, _)| status);
    let since = |count: fn(&UnitTotals) -> u64| count(totals).saturating_sub(count(before));
    let refused = since(UnitTotals::all_refused);
    if totals.imu_in == before.imu_in {
        found.push((Level::Stale, format!("no raw messages on {}", mapping.raw)));
    } else if status.is_none() {
        found.push((Level::Error, "no service has the unit: check that one runs, and --service".to_owned()));
    }
    if refused > 0 {
        let last = last_refusal.as_ref().map_or_else(String::new, |last| format!(", the last on {last}"));
        found.push((Level::Error, format!("{refused} messages refused{last}")));
    }
    if since(UnitTotals::all_lost) > 0 {
        found.push((Level::Error, "ticks lost between service and ROS 2".to_owned()));
    }
    if let Some(status) = status {
        match (status.state, status.output) {
            (State::Standby | State::SelfTest | State::PreLaunchCalibration, _) => {}
            (_, Output::Calibrated) => {
                let stale = status.channels.iter().filter(|channel| channel.stale);
                let stale: Vec<_> = stale.map(|channel| channel.name.as_str()).collect();
                if !stale.is_empty() {
                    found.push((Level::Warn, format!("no temperature from {}", stale.join(", "))));
                }
            }
            _ => found.push((Level::Error, "no calibration: nothing is published".to_owned())),
        }
    }
    let gaps = since(|totals| totals.gaps);
    if gaps > 0 {
        found.push((Level::Warn, format!("{gaps} gaps, {} ticks missing", since(|totals| totals.missing))));
    }
    if let Some((jitter, stated)) = jitter_s.zip(mapping.time.uncertainty_s())
        && jitter > FACTOR * stated
    {
        let words = format!("stamps jitter by {:.0} us, stated are {:.0} us", jitter * 1e6, stated * 1e6);
        found.push((Level::Warn, words));
    }
    match found.iter().map(|(level, _)| *level).max() {
        None => (Level::Ok, status.map_or("running", |status| status.state.name()).to_owned()),
        Some(level) => (level, found.into_iter().map(|(_, words)| words).collect::<Vec<_>>().join("; ")),
    }
}

fn values(mapping: &UnitMapping, look: &Look) -> Vec<KeyValue> {
    let mut values = Vec::new();
    let mut say = |key: &str, value: String| values.push(KeyValue { key: key.to_owned(), value });
    let Look { totals, status, jitter_s, .. } = look;
    if let Some((status, _)) = status {
        say("state", status.state.name().to_owned());
        if let Some(calibration) = &status.calibration {
            say("calibration revision", calibration.revision.counter.to_string());
            say("calibration digest", Digits(&calibration.revision.digest).to_string());
        }
        for channel in &status.channels {
            if let Some(temperature) = channel.temperature_deg_c {
                say(&format!("temperature {} (deg C)", channel.name), format!("{temperature:.3}"));
            }
        }
        for drift in &status.drift {
            say(&format!("drift {} sigma (rad/s)", drift.gyro), format!("{:.3e}", drift.sigma_rad_per_s));
        }
        say("service latency p99 (us)", (status.latency.p99_ns / 1000).to_string());
    }
    let stated =
        |uncertainty: Option<f64>| uncertainty.map_or("not stated".to_owned(), |s| format!("{:.1}", s * 1e6));
    say("stamp uncertainty, stated (us)", stated(mapping.time.uncertainty_s()));
    if let Some(jitter) = jitter_s {
        say("stamp jitter, last second (us)", format!("{:.1}", jitter * 1e6));
    }
    for (key, count) in [
        ("imu in", totals.imu_in),
        ("temperature in", totals.temperature_in),
        ("imu out", totals.imu_out),
        ("gaps", totals.gaps),
        ("ticks missing", totals.missing),
        ("ticks announced missing by the service", totals.announced_missing),
        ("ticks uncalibrated", totals.uncalibrated),
        ("ticks lost", totals.all_lost()),
        ("runs", totals.runs),
    ] {
        say(key, count.to_string());
    }
    for (kind, count) in &totals.refused {
        say(&format!("refused {kind}"), count.to_string());
    }
    values
}
