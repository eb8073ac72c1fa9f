//! What is looked at: one look at every unit, and at what the service knows of itself.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use isotherm_protocol::pair::UnitRole;
use isotherm_protocol::service_status::{ServiceStatus, UnitSummary};
use isotherm_protocol::status::{Output, State, Status};
use serde::Serialize;

use super::health::{Kind, Reason, STOPPING, Seen, Watch};
use crate::control::{OLDER, STATE_FOLDER, UNWRITTEN};
use crate::observe::instance::{Instance, lost_log_lines};
use crate::receive::fault::of_kind;
use crate::receive::pulse::{Pulse, Stuck};
use crate::receive::unit::UnitActor;

/// Where a look is taken from.
#[derive(Debug)]
pub(crate) struct Source {
    instance: Arc<Instance>,
    pulse: Arc<Pulse>,
}

/// One look at everything.
#[derive(Debug)]
pub(super) struct Look {
    /// What the service says of itself.
    pub(super) service: ServiceStatus,
    /// Whether nothing speaks against its health.
    pub(super) healthy: bool,
    /// Instances for the same units, this one included.
    pub(super) instances: u64,
    /// The units, in the order of their serials.
    pub(super) units: Vec<UnitLook>,
}

/// One unit in it.
#[derive(Debug)]
pub(super) struct UnitLook {
    /// What it says of itself.
    pub(super) status: Status,
    /// What this instance does for it.
    pub(super) role: UnitRole,
    /// Sum of the latencies that its histogram counts (ns).
    pub(super) latency_sum_ns: u64,
    /// Whether raw ticks come and no corrected ones go out.
    pub(super) stalled: bool,
}

/// The verdict on the service's health.
#[derive(Debug, Serialize)]
pub(super) struct Verdict {
    /// "ok", or "unhealthy".
    pub(super) status: &'static str,
    /// What speaks against its health.
    pub(super) reasons: Vec<Reason>,
    /// The service's name for itself; empty before it is at work.
    pub(super) instance: String,
    /// Its version.
    pub(super) version: &'static str,
    /// Time since its start (s).
    pub(super) uptime_s: f64,
    /// The units, in the order of their serials.
    pub(super) units: Vec<UnitSummary>,
}

impl Look {
    /// That of a service which is not at work yet.
    pub(super) fn starting(uptime: Duration) -> Self {
        let service = ServiceStatus {
            instance: "starting".to_owned(),
            uptime_s: uptime.as_secs_f64(),
            faults: lost_log_lines().into_iter().collect(),
            ..ServiceStatus::default()
        };
        Self { service, healthy: false, instances: 1, units: Vec::new() }
    }

    /// How often a fault of a kind occurred that belongs to no unit.
    pub(super) fn count(&self, kind: &str) -> u64 {
        of_kind(&self.service.faults, kind).map_or(0, |fault| fault.count)
    }
}

impl Verdict {
    /// What is said of a service, and what speaks against its health.
    pub(super) fn new(service: ServiceStatus, reasons: Vec<Reason>) -> Self {
        let ServiceStatus { instance, uptime_s, units, .. } = service;
        let status = if reasons.is_empty() { "ok" } else { "unhealthy" };
        Self { status, reasons, instance, version: env!("CARGO_PKG_VERSION"), uptime_s, units }
    }

    /// Whether nothing speaks against the service's health.
    pub(super) fn is_healthy(&self) -> bool {
        self.reasons.is_empty()
    }
}

impl Source {
    /// A service, and its receive path.
    pub(crate) fn new(instance: Arc<Instance>, pulse: Arc<Pulse>) -> Self {
        Self { instance, pulse }
    }

    /// Whether the receive path is alive.
    pub(super) fn receives(&self) -> Result<(), Stuck> {
        self.pulse.look()
    }

    /// Looks at the units for stalls and alarms.
    pub(super) fn watch_units(&self, watch: &mut Watch) {
        let units = self.instance.intake.each_unit(|actor| Some((actor.id().clone(), seen(actor)?)));
        let units: BTreeMap<_, _> = units.into_iter().flatten().collect();
        let now = Instant::now();
        for (unit, seen) in &units {
            watch.see(now, unit.as_str(), *seen);
        }
        watch.keep(|unit| units.contains_key(unit));
    }

    /// Looks at everything.
    pub(super) fn look(&self, watch: &mut Watch, stopping: bool) -> Look {
        let instance = &self.instance;
        let units = instance.intake.each_unit(|actor| {
            (seen(actor), (actor.status(instance.id()), actor.role()), actor.latency_sum_ns())
        });
        let now = Instant::now();
        let units = units.into_iter().map(|(seen, (status, role), latency_sum_ns)| {
            if let Some(seen) = seen {
                watch.see(now, &status.unit, seen);
            }
            let stalled = watch.stall(now, &status.unit).is_some();
            UnitLook { status, role, latency_sum_ns, stalled }
        });
        let (units, service) = (units.collect(), instance.status());
        Look {
            healthy: reasons(&service, now, watch, stopping).is_empty(),
            service,
            instances: instance.pair.others().len() as u64 + 1,
            units,
        }
    }

    /// Judges the service's health.
    pub(super) fn judge(&self, watch: &mut Watch, stopping: bool) -> Verdict {
        self.watch_units(watch);
        let service = self.instance.status();
        let reasons = reasons(&service, Instant::now(), watch, stopping);
        // All of them: the status has no more than a message may have.
        let units = self.instance.intake.each_unit(|actor| actor.summary());
        Verdict { units, ..Verdict::new(service, reasons) }
    }
}

/// What speaks against the service's health.
fn reasons(service: &ServiceStatus, now: Instant, watch: &Watch, stopping: bool) -> Vec<Reason> {
    let of_service = |kind, words: &str| Reason { kind, unit: None, words: words.to_owned() };
    let stopping = stopping.then(|| of_service(Kind::Stopping, STOPPING));
    let standing = [
        (STATE_FOLDER, Kind::StateFolder),
        (UNWRITTEN, Kind::UnwrittenDocument),
        (OLDER, Kind::OlderCalibration),
    ];
    let standing = standing
        .into_iter()
        .filter_map(|(told, kind)| Some(of_service(kind, &of_kind(&service.faults, told)?.first)));
    stopping.into_iter().chain(standing).chain(watch.reasons(now)).collect()
}

/// What the watch is told of a unit; nothing of one without a calibration: anybody can make such a unit appear.
fn seen(actor: &UnitActor) -> Option<Seen> {
    let (state, output) = actor.doing();
    if output != Output::Calibrated {
        return None;
    }
    let totals = actor.totals();
    let runs = matches!(state, State::RunningWithReversal | State::RunningWithoutReversal);
    Some(Seen {
        came: totals.ticks_in + totals.bad,
        went: totals.ticks_out.saturating_sub(totals.unpublished),
        alarms: totals.alarms,
        runs,
    })
}
