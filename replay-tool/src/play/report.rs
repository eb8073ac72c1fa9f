//! What playing came to.

use std::collections::BTreeSet;
use std::ops::Add;

use isotherm_bus::outlet::Account;
use isotherm_protocol::pair::PairReport;
use serde::Serialize;

use super::playlist::Load;
use crate::pace::Lateness;

/// What was sent of a unit.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Counts {
    /// Messages sent, those that were sent before among them.
    pub(crate) messages_sent: u64,
    /// Messages sent that the service cannot read; the log has them so.
    pub(crate) messages_unreadable: u64,
    /// Messages that were not sent, by `--loss`.
    pub(crate) messages_withheld: u64,
    /// Messages that were sent a second time, by `--duplicate`.
    pub(crate) messages_sent_again: u64,
    /// Messages that were sent behind later ones, by `--reorder`.
    pub(crate) messages_held_back: u64,
    /// Gyro ticks in the messages sent.
    pub(crate) ticks_in_messages: u64,
    /// Gyro ticks that were not sent, by `--loss`.
    pub(crate) ticks_withheld: u64,
    /// Accelerometer ticks sent.
    pub(crate) accel_ticks_sent: u64,
    /// Temperature readings sent.
    pub(crate) temperature_readings_sent: u64,
    /// Health readings sent: times at which there were some.
    pub(crate) health_readings_sent: u64,
    /// Rate references sent.
    pub(crate) references_sent: u64,
}

impl Counts {
    /// Notes a message that went out.
    pub(super) fn note(&mut self, load: Load, again: bool, held_back: bool) {
        self.messages_sent += 1;
        self.messages_sent_again += u64::from(again);
        self.messages_held_back += u64::from(held_back);
        match load {
            Load::Gyro(ticks) => self.ticks_in_messages += ticks.count,
            Load::Accel(ticks) => self.accel_ticks_sent += ticks,
            Load::Temperature(readings) => self.temperature_readings_sent += readings,
            Load::Health(times) => self.health_readings_sent += times,
            Load::Reference => self.references_sent += 1,
            Load::Unreadable => self.messages_unreadable += 1,
        }
    }
}

/// What became of gyro ticks, of a unit or of all; everything is `None` without acknowledgement.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[expect(clippy::struct_field_names, reason = "they are the names of the JSON")]
pub(crate) struct Returned {
    /// Gyro ticks between the first and the last of a run that were never sent, because the log does not have them, or
    /// because they were passed over or withheld: the service announces them as missing.
    pub(crate) ticks_not_sent: Option<u64>,
    /// Gyro ticks that came back corrected, each counted once.
    pub(crate) ticks_acknowledged: Option<u64>,
    /// Gyro ticks that the service announced as missing.
    pub(crate) ticks_announced_missing: Option<u64>,
    /// Gyro ticks that came back as they were, because the service has no calibration for the unit.
    pub(crate) ticks_uncalibrated: Option<u64>,
    /// Gyro ticks sent behind later ones, too late to come back.
    pub(crate) ticks_late: Option<u64>,
    /// Gyro ticks sent in their order that did not come back.
    pub(crate) ticks_lost: Option<u64>,
    /// Gyro ticks under way when playing was stopped.
    pub(crate) ticks_under_way: Option<u64>,
    /// Gyro ticks that came back more than once.
    pub(crate) ticks_duplicated: Option<u64>,
}

impl From<&Account> for Returned {
    fn from(account: &Account) -> Self {
        Self {
            ticks_not_sent: Some(account.ticks_not_sent),
            ticks_acknowledged: Some(account.ticks_back),
            ticks_announced_missing: Some(account.ticks_announced_missing),
            ticks_uncalibrated: Some(account.ticks_uncalibrated),
            ticks_late: Some(account.ticks_late),
            ticks_lost: Some(account.ticks_lost),
            ticks_under_way: Some(account.ticks_under_way),
            ticks_duplicated: Some(account.ticks_duplicated),
        }
    }
}

impl Add for Returned {
    type Output = Self;

    /// The sums of what is known.
    fn add(self, other: Self) -> Self {
        let sum = |of: fn(&Self) -> Option<u64>| {
            [of(&self), of(&other)].into_iter().flatten().reduce(u64::saturating_add)
        };
        Self {
            ticks_not_sent: sum(|ticks| ticks.ticks_not_sent),
            ticks_acknowledged: sum(|ticks| ticks.ticks_acknowledged),
            ticks_announced_missing: sum(|ticks| ticks.ticks_announced_missing),
            ticks_uncalibrated: sum(|ticks| ticks.ticks_uncalibrated),
            ticks_late: sum(|ticks| ticks.ticks_late),
            ticks_lost: sum(|ticks| ticks.ticks_lost),
            ticks_under_way: sum(|ticks| ticks.ticks_under_way),
            ticks_duplicated: sum(|ticks| ticks.ticks_duplicated),
        }
    }
}

/// What was sent of a unit, and what became of it. What comes back is `None` without acknowledgement.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct UnitReport {
    /// Its serial on the bus.
    pub(crate) unit: String,
    /// Its serial in the log.
    pub(crate) of: String,
    /// What was sent.
    #[serde(flatten)]
    pub(crate) counts: Counts,
    /// Gyro ticks sent, each counted once.
    pub(crate) ticks_sent: u64,
    /// What became of them.
    #[serde(flatten)]
    pub(crate) returned: Returned,
    /// Runs sent: series, or what began anew in one.
    pub(crate) runs: Option<u64>,
    /// Times that the unit's corrected stream began anew.
    pub(crate) restarts: Option<u64>,
    /// Corrected ticks of a series that was not sent here: somebody else plays the unit.
    pub(crate) ticks_of_others: Option<u64>,
    /// Pairs and single services that have the unit, of which there is to be one; looked for where ticks came twice.
    pub(crate) services: Option<u64>,
    /// Temperature channels sent that the unit's calibration does not have.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) unknown_channels: Vec<String>,
}

impl UnitReport {
    pub(super) fn new(unit: &str, of: &str, counts: Counts, account: Option<Account>) -> Self {
        let told = |of: fn(&Account) -> u64| account.as_ref().map(of);
        Self {
            unit: unit.to_owned(),
            of: of.to_owned(),
            counts,
            ticks_sent: account.map_or(counts.ticks_in_messages, |account| account.ticks_sent),
            returned: account.as_ref().map(Returned::from).unwrap_or_default(),
            runs: told(|account| account.runs),
            restarts: told(|account| account.restarts),
            ticks_of_others: told(|account| account.ticks_of_others),
            services: None,
            unknown_channels: Vec::new(),
        }
    }

    /// Notes how many pairs and single services have the unit.
    pub(super) fn note_services(&mut self, reports: &[PairReport]) {
        let having = reports.iter().filter(|report| report.role(&self.unit).is_some());
        let groups: BTreeSet<_> = having.map(|report| &report.member.group).collect();
        self.services = Some(groups.len() as u64);
    }

    /// Whether ticks came back more than once: the instances of a pair may send a tick twice.
    pub(super) fn is_doubled(&self) -> bool {
        self.returned.ticks_duplicated.is_some_and(|ticks| ticks > 0)
    }

    /// What did not come back by the end counts as lost.
    pub(super) fn give_up(&mut self) {
        let Returned { ticks_lost, ticks_under_way, .. } = &mut self.returned;
        if let (Some(lost), Some(under_way)) = (ticks_lost, ticks_under_way) {
            *lost += std::mem::take(under_way);
        }
    }

    /// Whether what came back is not what was sent: somebody else plays the unit, or services answer that are no pair.
    #[must_use]
    pub(crate) fn is_mixed(&self) -> bool {
        self.ticks_of_others.is_some_and(|ticks| ticks > 0)
            || (self.is_doubled() && self.services.is_some_and(|services| services > 1))
    }
}

/// What playing came to: the sums over the units, and the units.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub(crate) struct PlayReport {
    /// Messages sent.
    pub(crate) messages_sent: u64,
    /// Gyro ticks sent, each counted once.
    pub(crate) ticks_sent: u64,
    /// Accelerometer ticks sent.
    pub(crate) accel_ticks_sent: u64,
    /// Temperature readings sent.
    pub(crate) temperature_readings_sent: u64,
    /// What became of the gyro ticks.
    #[serde(flatten)]
    pub(crate) returned: Returned,
    /// Times that the log was played, the last one perhaps not to its end.
    pub(crate) passes: u64,
    /// Times that somebody went to another place in it.
    pub(crate) seeks: u64,
    /// Time of the log that was played (s).
    pub(crate) log_s: f64,
    /// Time that it took (s).
    pub(crate) elapsed_s: f64,
    /// Time that playing was paused (s), part of the former.
    pub(crate) paused_s: f64,
    /// How many times as fast as recorded, pauses left out.
    pub(crate) actual_speed: f64,
    /// How late messages went out.
    pub(crate) lateness: Lateness,
    /// Playing ended before the log did: by a signal, or by an error.
    pub(crate) stopped: bool,
    /// The units, in the order in which the log names them.
    pub(crate) units: Vec<UnitReport>,
}

impl PlayReport {
    /// The sums over units.
    pub(super) fn of(units: Vec<UnitReport>) -> Self {
        let sum = |of: fn(&UnitReport) -> u64| units.iter().map(of).sum();
        Self {
            messages_sent: sum(|unit| unit.counts.messages_sent),
            ticks_sent: sum(|unit| unit.ticks_sent),
            accel_ticks_sent: sum(|unit| unit.counts.accel_ticks_sent),
            temperature_readings_sent: sum(|unit| unit.counts.temperature_readings_sent),
            returned: units.iter().map(|unit| unit.returned).fold(Returned::default(), Add::add),
            units,
            ..Self::default()
        }
    }

    /// Whether a tick that was sent in its order did not come back.
    #[must_use]
    pub(crate) fn lost_data(&self) -> bool {
        self.returned.ticks_lost.is_some_and(|lost| lost > 0)
    }
}

#[cfg(test)]
mod tests {
    use isotherm_protocol::pair::{Member, Mode, Role, UnitRole};

    use super::*;

    #[test]
    fn what_a_pair_sends_twice_is_no_other_player() {
        let report = |group: &str| {
            let (instance, name, group) = (String::new(), String::new(), group.to_owned());
            let member =
                Member { instance, name, mode: Mode::Active, priority: 0, started_unix_ms: 0, group };
            let (unit, last_difference) = ("U".to_owned(), None);
            let role = Role::Speaking;
            let unit =
                UnitRole { unit, role, ticks_compared: 0, ticks_differing: 0, takeovers: 0, last_difference };
            let (takes, passed_over, others, addresses) = Default::default();
            PairReport { member, takes, units: vec![unit], passed_over, others, addresses }
        };
        for (groups, duplicated, of_others, is_mixed) in [
            ("a", 0, 0, false),
            ("a", 0, 1, true),
            ("a", 500, 0, false),
            ("aa", 500, 0, false),
            ("aa", 500, 1, true),
            ("ab", 0, 0, false),
            ("ab", 500, 0, true),
        ] {
            let reports: Vec<_> = groups.chars().map(|group| report(&group.to_string())).collect();
            let returned = Returned { ticks_duplicated: Some(duplicated), ..Returned::default() };
            let ticks_of_others = Some(of_others);
            let mut unit =
                UnitReport { unit: "U".to_owned(), ticks_of_others, returned, ..UnitReport::default() };
            unit.note_services(&reports);
            assert_eq!(unit.is_mixed(), is_mixed, "{groups}, {duplicated}, {of_others}");
        }
    }
}
