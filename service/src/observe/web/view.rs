//! Units and services as JSON: the lines and words of `isotherm status`, as the console in the browser reads them.

use std::time::Instant;

use isotherm_protocol::key::UnitId;
use isotherm_protocol::pair::{PairReport, UnitRole};
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::Status;
use serde::Serialize;

use super::Web;
use isotherm_operator::page::{
    Lately, Level, Remark, Unit, applied, channel_in_view, knows_rates, name, range, said_of_pairs,
    state_word,
};
use isotherm_operator::status::unix_ms;
use isotherm_operator::{Fleet, worst_first};

/// All units, those that need somebody first.
#[derive(Debug, Serialize)]
struct Overview<'f> {
    /// This service's name for itself.
    instance: &'f str,
    /// Whether swaps, rollbacks and commands are taken here.
    write: bool,
    /// Options with which a command reaches this service.
    options: &'f str,
    now_unix_ms: i64,
    services: Vec<Service>,
    /// Who speaks for how many units, where there are two services, and what is wrong with that.
    pair: Vec<Columns>,
    units: Vec<Row>,
}

/// A service instance.
#[derive(Debug, Serialize)]
struct Service {
    /// Its name for people.
    name: String,
    gone: bool,
    #[serde(flatten)]
    status: ServiceStatus,
}

/// A line of a unit.
#[derive(Debug, Serialize)]
struct Row {
    unit: String,
    instance: String,
    level: Level,
    /// What is to be noticed, the gravest first.
    reasons: Vec<String>,
    state: &'static str,
    running: bool,
    /// Revision of the calibration in force; none without one.
    revision: Option<u64>,
    digest: Option<String>,
    temperature_deg_c: Option<f64>,
    temperature_rate_deg_c_per_s: Option<f64>,
    /// The range that the calibration was fitted over, of the channel whose temperature it is.
    calibrated_range_deg_c: Option<[f64; 2]>,
    /// Where all temperatures lie against theirs: inside, above, below, stale.
    range: &'static str,
    correction_deg_per_h: Option<f64>,
    correction_mg: Option<f64>,
    raw_ticks_per_s: Option<f64>,
    p99_ns: u64,
    /// Counted since the service started.
    #[serde(flatten)]
    counted: Lately,
}

impl Row {
    fn of(unit: &Unit<'_>) -> Self {
        let status = unit.status;
        let (channel, applied) = (channel_in_view(status), applied(status));
        Self {
            unit: status.unit.clone(),
            instance: status.instance.clone(),
            level: unit.level(),
            reasons: unit.remarks().into_iter().map(|remark| remark.words).collect(),
            state: state_word(status.state),
            running: status.state.is_running() && unit.gone.is_none(),
            revision: status.calibration.as_ref().map(|calibration| calibration.revision.counter),
            digest: status.calibration.as_ref().and_then(|it| it.digest).map(|digest| digest.to_string()),
            temperature_deg_c: channel.and_then(|channel| channel.temperature_deg_c),
            temperature_rate_deg_c_per_s: channel.and_then(|channel| channel.rate_deg_c_per_s),
            calibrated_range_deg_c: channel.and_then(|channel| channel.calibrated_range_deg_c),
            range: range(status).0,
            correction_deg_per_h: applied.map(|[rate, _]| rate),
            correction_mg: applied.map(|[_, force]| force),
            raw_ticks_per_s: knows_rates(status).then_some(status.input_rates.gyro_ticks_per_s),
            p99_ns: status.latency.p99_ns,
            counted: Lately::counted(status),
        }
    }
}

/// One unit, as each instance sees it that has it.
#[derive(Debug, Serialize)]
struct Sheet<'f> {
    now_unix_ms: i64,
    instances: Vec<Instance<'f>>,
    /// What each service of a pair does for it; empty where there is one service.
    pair: Vec<Half<'f>>,
}

/// What one service of a pair does for a unit.
#[derive(Debug, Serialize)]
struct Half<'f> {
    /// Whether it is this service.
    own: bool,
    name: &'f str,
    priority: u8,
    #[serde(flatten)]
    unit: &'f UnitRole,
}

/// One unit as one instance sees it.
#[derive(Debug, Serialize)]
struct Instance<'f> {
    /// Whether it is this service.
    own: bool,
    level: Level,
    remarks: Vec<Remark>,
    /// How long nobody has answered for it (s).
    gone_s: Option<u64>,
    /// Commands that its state takes now, by name.
    allowed: &'static [&'static str],
    status: &'f Status,
    /// Temperatures some time ago: age (s), and that of each channel (°C).
    past: Vec<Vec<f64>>,
}

/// A line in columns.
#[derive(Debug, Serialize)]
struct Columns {
    level: Level,
    columns: Vec<String>,
}

impl Web {
    /// All units and services.
    pub(super) fn units(&self) -> serde_json::Result<String> {
        let fleet = self.fleet();
        let (now, now_unix_ms) = (Instant::now(), unix_ms());
        let (services, gone) = fleet.services();
        let services = services.into_iter().map(|status| {
            let (name, gone) = (name(&fleet.pairs, &status.instance), gone.contains(&status.instance));
            // Their names and states are told in the lines of the units.
            Service { name, gone, status: ServiceStatus { units: Vec::new(), ..status } }
        });
        let pair = said_of_pairs(&fleet.pairs).into_iter().map(|(level, columns)| Columns { level, columns });
        serde_json::to_string(&Overview {
            instance: &self.instance,
            write: self.write,
            options: &self.options,
            now_unix_ms,
            services: services.collect(),
            pair: pair.collect(),
            units: worst_first(self.seen(&fleet, now, now_unix_ms)).iter().map(Row::of).collect(),
        })
    }

    /// Every unit that a service has; of its own no service is told when it forgets one.
    pub(super) fn seen<'f>(&self, fleet: &'f Fleet, now: Instant, now_unix_ms: i64) -> Vec<Unit<'f>> {
        let mut units = fleet.units(now, now_unix_ms);
        let is_here = |serial: &str| UnitId::new(serial).is_ok_and(|unit| self.intake.has(&unit));
        units.retain(|unit| unit.status.instance != self.instance || is_here(&unit.status.unit));
        units
    }

    /// One unit; `None` where nobody has it.
    pub(super) fn unit(&self, serial: &str) -> Option<serde_json::Result<String>> {
        let fleet = self.fleet();
        let (now, now_unix_ms) = (Instant::now(), unix_ms());
        let units = self.seen(&fleet, now, now_unix_ms);
        let of_serial = units.iter().filter(|unit| unit.status.unit == serial);
        let mut instances: Vec<_> = of_serial.map(|unit| self.instance(unit, now)).collect();
        // This service's first: its ticks can be watched.
        instances.sort_by_key(|instance| (!instance.own, instance.gone_s.is_some()));
        (!instances.is_empty()).then(|| {
            serde_json::to_string(&Sheet { now_unix_ms, instances, pair: self.pair(&fleet.pairs, serial) })
        })
    }

    fn pair<'f>(&self, reports: &'f [PairReport], serial: &str) -> Vec<Half<'f>> {
        if reports.len() < 2 {
            return Vec::new();
        }
        let half = |report: &'f PairReport| {
            let (own, member) = (report.member.instance == self.instance, &report.member);
            let unit = report.units.iter().find(|unit| unit.unit == serial)?;
            Some(Half { own, name: &member.name, priority: member.priority, unit })
        };
        reports.iter().filter_map(half).collect()
    }

    fn instance<'f>(&self, unit: &Unit<'f>, now: Instant) -> Instance<'f> {
        // Under another calibration there may have been other channels.
        let channels = || unit.status.channels.iter().map(|channel| channel.name);
        let same = unit.past.iter().filter(|of| of.channels.iter().map(|(name, ..)| *name).eq(channels()));
        let rounded = |value: f64| (value * 1e3).round() / 1e3;
        let past = same.map(|of| {
            let age_s = now.saturating_duration_since(of.at).as_secs_f64();
            let temperatures = of.channels.iter().map(|(_, temperature, _)| rounded(*temperature));
            std::iter::once(rounded(age_s)).chain(temperatures).collect()
        });
        Instance {
            own: unit.status.instance == self.instance,
            level: unit.level(),
            remarks: unit.remarks(),
            gone_s: unit.gone.map(|gone| gone.as_secs()),
            allowed: unit.status.state.allowed(),
            past: past.collect(),
            status: unit.status,
        }
    }
}
