//! What is looked at: one look at every unit, and at what the service knows of itself.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use isotherm_protocol::pair::UnitRole;
use isotherm_protocol::service_status::{ServiceStatus, UnitSummary};
use isotherm_protocol::status::{Fault, Output, State, Status};
use serde::Serialize;

use super::health::{HeldBack, Kind, Reason, STOPPING, Seen, Watch};
use crate::config::Settings;
use crate::control::{ControlStatus, OLDER, STATE_FOLDER, UNWRITTEN};
use crate::observe::subscribers::Subscribers;
use crate::pair::Pair;
use crate::receive::fault::of_kind;
use crate::receive::intake::Intake;
use crate::receive::pulse::{Pulse, Stuck};
use crate::receive::unit::{UnitActor, pairing_window};
use isotherm_cli::stderr::dropped_lines;

/// Where a look is taken from.
#[derive(Debug)]
pub(crate) struct Source {
    intake: Arc<Intake>,
    pair: Arc<Pair>,
    control_status: Arc<ControlStatus>,
    instance: String,
    started: Instant,
    held_back: HeldBack,
    pulse: Option<Arc<Pulse>>,
    subscribers: Arc<Subscribers>,
}

/// One look at everything.
#[derive(Debug, Default)]
pub(super) struct Look {
    /// The service's name for itself.
    pub(super) instance: String,
    /// Time since its start (s).
    pub(super) uptime_s: f64,
    /// Whether nothing speaks against its health.
    pub(super) healthy: bool,
    /// Instances for the same units, this one included.
    pub(super) instances: u64,
    /// Faults that belong to no unit.
    pub(super) faults: Vec<Fault>,
    /// Log lines dropped so far.
    pub(super) log_lines_dropped: u64,
    /// Receipts of subscribers that came late.
    pub(super) late_receipts: u64,
    /// What the swap manager has posted.
    pub(super) posted: Arc<ServiceStatus>,
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
        Self {
            instance: "starting".to_owned(),
            uptime_s: uptime.as_secs_f64(),
            instances: 1,
            log_lines_dropped: dropped_lines(),
            ..Self::default()
        }
    }
}

impl Verdict {
    /// That of a service of which no unit was looked at.
    pub(super) fn new(uptime: Duration, reasons: Vec<Reason>) -> Self {
        Self {
            status: if reasons.is_empty() { "ok" } else { "unhealthy" },
            reasons,
            instance: String::new(),
            version: env!("CARGO_PKG_VERSION"),
            uptime_s: uptime.as_secs_f64(),
            units: Vec::new(),
        }
    }

    /// Whether nothing speaks against the service's health.
    pub(super) fn is_healthy(&self) -> bool {
        self.reasons.is_empty()
    }
}

impl Source {
    /// A service whose units are in `intake`, among others.
    pub(crate) fn new(
        settings: &Settings,
        (intake, pair): (Arc<Intake>, Arc<Pair>),
        control_status: Arc<ControlStatus>,
    ) -> Self {
        let instance = pair.me().instance.clone();
        Self {
            intake,
            pair,
            control_status,
            instance,
            started: Instant::now(),
            held_back: HeldBack {
                ticks: settings.unit.navigation.ticks().into(),
                window: pairing_window(&settings.unit),
            },
            pulse: None,
            subscribers: Arc::default(),
        }
    }

    /// The same, of a service whose receive path is felt, and that asks for receipts.
    pub(crate) fn at_work(self, pulse: Arc<Pulse>, subscribers: Arc<Subscribers>) -> Self {
        Self { pulse: Some(pulse), subscribers, ..self }
    }

    /// Whether the receive path is alive, as far as it is felt.
    pub(super) fn receives(&self) -> Result<(), Stuck> {
        self.pulse.as_ref().map_or(Ok(()), Pulse::look)
    }

    /// Looks at the units for stalls and alarms.
    pub(super) fn watch_units(&self, watch: &mut Watch) {
        let units = self.intake.each_unit(|actor| Some((actor.id().clone(), seen(actor)?)));
        let units: BTreeMap<_, _> = units.into_iter().flatten().collect();
        let now = Instant::now();
        for (unit, seen) in &units {
            watch.see(now, unit.as_str(), *seen);
        }
        watch.keep(|unit| units.contains_key(unit));
    }

    /// Looks at everything.
    pub(super) fn look(&self, watch: &mut Watch, stopping: bool) -> Look {
        let units = self.intake.each_unit(|actor| {
            (seen(actor), (actor.status(&self.instance), actor.role()), actor.latency_sum_ns())
        });
        let now = Instant::now();
        let units = units.into_iter().map(|(seen, (status, role), latency_sum_ns)| {
            if let Some(seen) = seen {
                watch.see(now, &status.unit, seen);
            }
            let stalled = watch.stall(now, &status.unit, self.held_back).is_some();
            UnitLook { status, role, latency_sum_ns, stalled }
        });
        let units = units.collect();
        Look {
            instance: self.instance.clone(),
            uptime_s: self.started.elapsed().as_secs_f64(),
            healthy: self.reasons(now, watch, stopping).is_empty(),
            instances: self.pair.others().len() as u64 + 1,
            faults: self.intake.faults(),
            log_lines_dropped: dropped_lines(),
            late_receipts: self.subscribers.fault().map_or(0, |fault| fault.count),
            posted: self.control_status.read(),
            units,
        }
    }

    /// Judges the service's health.
    pub(super) fn judge(&self, watch: &mut Watch, stopping: bool) -> Verdict {
        self.watch_units(watch);
        let units = self.intake.each_unit(|actor| actor.summary());
        let reasons = self.reasons(Instant::now(), watch, stopping);
        Verdict { instance: self.instance.clone(), units, ..Verdict::new(self.started.elapsed(), reasons) }
    }

    /// What speaks against the service's health.
    fn reasons(&self, now: Instant, watch: &mut Watch, stopping: bool) -> Vec<Reason> {
        let of_service = |kind, words: &str| Reason { kind, unit: None, words: words.to_owned() };
        let stopping = stopping.then(|| of_service(Kind::Stopping, STOPPING));
        let posted = self.control_status.read();
        let standing = [
            (STATE_FOLDER, Kind::StateFolder),
            (UNWRITTEN, Kind::UnwrittenDocument),
            (OLDER, Kind::OlderCalibration),
        ];
        let standing = standing
            .into_iter()
            .filter_map(|(told, kind)| Some(of_service(kind, &of_kind(&posted.faults, told)?.first)));
        stopping.into_iter().chain(standing).chain(watch.reasons(now, self.held_back)).collect()
    }
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
