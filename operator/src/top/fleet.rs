//! Every unit and service that has been seen, and what has become of it.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::{Duration, Instant};

use isotherm_protocol::pair::PairReport;
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::{Output, Status};

use super::feed::News;
use crate::page::{Lately, Past, Unit};
use crate::status::clock_of;

/// How far growth of counters is looked back for.
const LATELY: Duration = Duration::from_secs(60);
/// For how long nothing goes out before that is a fault: longer than any pairing window.
const STUCK: Duration = Duration::from_secs(10);
/// Least time between two looks that are remembered.
const BETWEEN_LOOKS: Duration = Duration::from_millis(900);
/// Looks at temperatures that are remembered: some five minutes.
const MOST_PAST: usize = 300;
/// A unit of which no status came for so long is gone, whatever its token says; services publish at least once a minute.
const SILENT: Duration = Duration::from_secs(150);
/// Statuses that come so soon after a token was taken back had been sent before.
const IN_FLIGHT: Duration = Duration::from_secs(2);
/// Units that are gone are forgotten after this, so that the list does not grow for ever.
const FORGOTTEN: Duration = Duration::from_secs(24 * 3600);

/// Serial and instance: two services may have the same unit, though they should not.
pub(super) type Key = (String, String);

/// All that has been seen.
#[derive(Debug, Default)]
pub struct Fleet {
    units: BTreeMap<Key, Row>,
    services: BTreeMap<String, Instance>,
    /// Who speaks for which unit.
    pub pairs: Vec<PairReport>,
    /// Statuses that were not understood.
    pub(super) not_understood: u64,
}

#[derive(Debug)]
struct Row {
    status: Status,
    seen: Instant,
    gone: Option<Instant>,
    looks: VecDeque<Look>,
    past: Vec<Past>,
}

#[derive(Debug)]
struct Instance {
    status: ServiceStatus,
    gone: Option<Instant>,
    /// What its clock is ahead of ours (ms).
    ahead_ms: i64,
}

/// Counters at one time.
#[derive(Debug, Clone, Copy)]
struct Look {
    at: Instant,
    running: bool,
    ticks_in: u64,
    ticks_out: u64,
    counted: Lately,
}

impl Look {
    fn at(at: Instant, status: &Status) -> Self {
        Self {
            at,
            running: status.state.is_running() && status.output != Output::Held,
            ticks_in: status.counter("gyro_ticks_in"),
            ticks_out: status.counter("ticks_out"),
            counted: Lately::counted(status),
        }
    }
}

impl Fleet {
    /// Takes news that came `now`, which is `now_unix_ms` by the clock of this machine.
    pub fn take(&mut self, news: News, now: Instant, now_unix_ms: i64) {
        match news {
            News::Unit(status) => self.unit(*status, now),
            News::Service(status) => {
                let ahead_ms = clock_of(&status).saturating_sub(now_unix_ms);
                let instance = Instance { status: *status, gone: None, ahead_ms };
                self.services.insert(instance.status.instance.clone(), instance);
            }
            News::UnitAlive(serial, alive) => self.unit_alive(&serial, alive, now),
            News::ServiceAlive(instance, alive) => self.service_alive(&instance, alive, now),
            News::Pairs(reports) => self.pairs = reports,
            News::NotUnderstood => self.not_understood += 1,
        }
    }

    fn unit_alive(&mut self, serial: &str, alive: bool, now: Instant) {
        let services = &self.services;
        for ((_, instance), row) in self.units.iter_mut().filter(|((unit, _), _)| unit == serial) {
            // The token of a unit does not say whose it is: not that of an instance that is gone.
            let is_gone = !alive || services.get(instance).is_some_and(|service| service.gone.is_some());
            row.gone = is_gone.then(|| row.gone.unwrap_or(now));
        }
    }

    fn service_alive(&mut self, instance: &str, alive: bool, now: Instant) {
        let gone = |gone: Option<Instant>| if alive { None } else { Some(gone.unwrap_or(now)) };
        if let Some(service) = self.services.get_mut(instance) {
            service.gone = gone(service.gone);
        }
        // A service that comes back after a lost connection is the same, with the same units.
        for (_, row) in self.units.iter_mut().filter(|((_, of), _)| of == instance) {
            row.gone = gone(row.gone);
        }
    }

    fn unit(&mut self, status: Status, now: Instant) {
        let look = Look::at(now, &status);
        let channels = status.channels.iter().map(|channel| {
            let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
            (channel.name, number(channel.temperature_deg_c), number(channel.rate_deg_c_per_s))
        });
        let past = Past { at: now, channels: channels.collect() };
        let key = (status.unit.clone(), status.instance.clone());
        let row = self.units.entry(key).or_insert_with(|| Row {
            status: Status::default(),
            seen: now,
            gone: None,
            looks: VecDeque::new(),
            past: Vec::new(),
        });
        row.status = status;
        row.seen = now;
        row.gone = row.gone.filter(|gone| now.saturating_duration_since(*gone) < IN_FLIGHT);
        if row.looks.back().is_none_or(|last| now.saturating_duration_since(last.at) >= BETWEEN_LOOKS) {
            row.looks.push_back(look);
            row.past.push(past);
        }
        while row.looks.front().is_some_and(|first| now.saturating_duration_since(first.at) > LATELY) {
            row.looks.pop_front();
        }
        let surplus = row.past.len().saturating_sub(MOST_PAST);
        row.past.drain(..surplus);
    }

    /// Forgets what has been gone for a day, and what another instance has taken over.
    pub fn forget(&mut self, now: Instant) {
        let kept =
            |gone: Option<Instant>| gone.is_none_or(|gone| now.saturating_duration_since(gone) < FORGOTTEN);
        let there = self.units.iter().filter(|(_, row)| row.gone.is_none());
        let there: BTreeSet<String> = there.map(|((unit, _), _)| unit.clone()).collect();
        self.units.retain(|(unit, _), row| row.gone.is_none() || (kept(row.gone) && !there.contains(unit)));
        let has_units = |instance: &str| self.units.keys().any(|(_, of)| of == instance);
        let one_is_there = self.services.values().any(|service| service.gone.is_none());
        self.services.retain(|instance, service| {
            service.gone.is_none() || (kept(service.gone) && (has_units(instance) || !one_is_there))
        });
    }

    /// Every unit as it is `now`, by serial.
    #[must_use]
    pub fn units(&self, now: Instant, now_unix_ms: i64) -> Vec<Unit<'_>> {
        self.units.iter().map(|(key, row)| self.one(key, row, now, now_unix_ms)).collect()
    }

    fn one<'a>(&'a self, (_, instance): &Key, row: &'a Row, now: Instant, now_unix_ms: i64) -> Unit<'a> {
        let age = now.saturating_duration_since(row.seen);
        let gone = row.gone.map(|gone| now.saturating_duration_since(gone));
        let ahead_ms = self.services.get(instance).map_or(0, |service| service.ahead_ms);
        Unit {
            status: &row.status,
            age,
            gone: gone.or_else(|| (age > SILENT).then_some(age)),
            now_unix_ms: now_unix_ms.saturating_add(ahead_ms),
            lately: row.lately(now),
            past: &row.past,
        }
    }

    /// Every service instance, and the names of those that are gone.
    #[must_use]
    pub fn services(&self) -> (Vec<ServiceStatus>, Vec<String>) {
        let services = self.services.values().map(|service| service.status.clone()).collect();
        let gone = self.services.iter().filter(|(_, service)| service.gone.is_some());
        (services, gone.map(|(instance, _)| instance.clone()).collect())
    }

    /// The service instance of a unit.
    #[must_use]
    pub fn service_of(&self, status: &Status) -> Option<&ServiceStatus> {
        self.services.get(&status.instance).map(|service| &service.status)
    }
}

impl Row {
    /// What has changed over the last minute, or since it was first seen.
    fn lately(&self, now: Instant) -> Lately {
        let last = Look::at(now, &self.status);
        let Some(first) = self.looks.front() else { return Lately::default() };
        // From the last look that lies far enough back on, the unit must have run all the time.
        let far = |look: &&Look| now.saturating_duration_since(look.at) >= STUCK;
        let stuck = self.looks.iter().rfind(far).is_some_and(|far| {
            let since = self.looks.iter().filter(|look| look.at >= far.at);
            let ran = since.clone().all(|look| look.running) && last.running;
            ran && last.ticks_in > far.ticks_in && last.ticks_out == far.ticks_out
        });
        Lately { stuck, ..last.counted.since(&first.counted) }
    }
}
