//! Saying what the service says nothing of: why nothing comes back, before patience ends, and what it does not use.

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use isotherm_bus::outlet::UnderWay;
use isotherm_bus::presence;
use isotherm_correction::sample::ChannelName;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::status::{Output, Status, UNKNOWN_CHANNEL};
use tokio::time::Instant;
use zenoh::Session;

use super::screen::Screen;
use super::{PlayReport, UnitReport};

/// Time between two looks.
const LOOK: Duration = Duration::from_millis(500);
/// So long nothing comes back before it is said.
const QUIET: Duration = Duration::from_secs(3);
/// How long the service may take to answer what it knows of the unit.
const ANSWER: Duration = Duration::from_secs(2);

/// What is under way of each unit; the player adds to it.
pub(super) type Shared = Arc<Mutex<Vec<Arc<UnderWay>>>>;

/// When a unit's last batch came back.
struct Since {
    batches: u64,
    seen: Instant,
    said: bool,
}

/// Looks now and then whether what is sent comes back, and says where it does not.
pub(super) async fn watch(session: &Session, shared: &Shared, screen: &Screen) -> Infallible {
    let mut since: BTreeMap<UnitId, Since> = BTreeMap::new();
    loop {
        tokio::time::sleep(LOOK).await;
        let units = shared.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let mut silent = Vec::new();
        for unit in &units {
            let (batches, ticks, now) = (unit.batches(), unit.ticks(), Instant::now());
            let since = since.entry(unit.unit().clone()).or_insert(Since { batches, seen: now, said: false });
            if batches != since.batches || ticks == 0 {
                (since.batches, since.seen) = (batches, now);
            } else if !since.said && now - since.seen >= QUIET {
                since.said = true;
                silent.push((unit.unit(), ticks));
            }
        }
        // One unit stands for the others that fell silent with it.
        if let Some((unit, ticks)) = silent.first() {
            let text = explained(session, unit, *ticks, QUIET).await;
            let others = match silent.len() - 1 {
                0 => String::new(),
                others => format!(" ({others} other units likewise)"),
            };
            screen.say(&(text + &others));
        }
    }
}

/// That nothing comes back of a unit, and why, as far as its status tells.
pub(super) async fn explained(session: &Session, unit: &UnitId, ticks: u64, waited: Duration) -> String {
    let status = presence::status(session, unit, ANSWER).await;
    words(unit, ticks, waited, status.as_ref())
}

/// Notes the temperature channels sent that a unit's calibration does not have; of copies the first stands for all.
pub(super) async fn note_unknown_channels(
    session: &Session,
    sent: &BTreeMap<UnitId, BTreeSet<ChannelName>>,
    report: &mut PlayReport,
) {
    for (of, channels) in sent {
        let is_sent =
            |unit: &&mut UnitReport| unit.of == of.as_str() && unit.counts.temperature_readings_sent > 0;
        let Some(unit) = report.units.iter_mut().find(is_sent) else { continue };
        let Ok(serial) = UnitId::new(&unit.unit) else { continue };
        let status = presence::status(session, &serial, ANSWER).await;
        let Some(status) = status.filter(|status| status.calibration.is_some()) else { continue };
        let unknown = channels.iter().filter(|name| status.channels.iter().all(|known| known.name != **name));
        unit.unknown_channels = unknown.map(ToString::to_string).collect();
    }
}

fn words(unit: &UnitId, ticks: u64, waited: Duration, status: Option<&Status>) -> String {
    let quiet =
        format!("{unit}: nothing has come back for {} s, {ticks} ticks are in flight", waited.as_secs());
    let Some(status) = status else {
        return format!("{quiet}; the service has no status of the unit: see isotherm status");
    };
    let state = status.state;
    if !state.is_running() {
        return format!(
            "{quiet}: the unit is in {state}, where nothing is published; run it with `isotherm command {unit} run`, or \
             play with --no-acknowledge"
        );
    }
    if status.output == Output::Held {
        return format!(
            "{quiet}: the unit has no calibration, and the service publishes nothing then (uncalibrated = \"hold\"); \
             give it one, or play with --no-acknowledge"
        );
    }
    // A temperature that is not used keeps no tick from coming back.
    let causes = status.faults.iter().filter(|fault| fault.kind != UNKNOWN_CHANNEL);
    match causes.max_by_key(|fault| fault.last_unix_ms) {
        Some(fault) => format!("{quiet}: {}", fault.first),
        None => {
            format!("{quiet}; see the service's log and the unit's status, or play with --no-acknowledge")
        }
    }
}

#[cfg(test)]
mod tests {
    use isotherm_protocol::status::{Fault, State};

    use super::*;

    #[test]
    fn the_words_fit_what_the_status_says() {
        let unit = UnitId::new("ZLG-0001").unwrap();
        let status = |state, output| Status { state, output, ..Status::default() };
        let running = State::RunningWithReversal;
        let refused = Fault {
            kind: String::new(),
            count: 1,
            first: "the producer sends counts".to_owned(),
            last_unix_ms: 0,
        };
        let unused = Fault {
            kind: UNKNOWN_CHANNEL.to_owned(),
            first: "readings of board arrive".to_owned(),
            last_unix_ms: 1,
            ..refused.clone()
        };
        let table = [
            None,
            Some(status(State::Standby, Output::Calibrated)),
            Some(status(State::SelfTest, Output::Calibrated)),
            Some(status(running, Output::Held)),
            Some(status(running, Output::Calibrated)),
            Some(Status { faults: vec![refused, unused], ..status(running, Output::Calibrated) }),
        ];
        insta::assert_snapshot!(table.map(|status| words(&unit, 300, QUIET, status.as_ref())).join("\n"));
    }
}
