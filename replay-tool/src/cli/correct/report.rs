//! What correcting a recording came to.

use std::fmt::{Display, Write as _};

use isotherm_cli::Exit;
use isotherm_log::diff::Account;
use isotherm_log::offline::UnitReport;
use isotherm_log::source::LogReport;
use serde::Serialize;

use super::{CorrectArgs, print_summary};
use crate::cli::diff::first_difference;
use crate::cli::show;

/// Says what the units came to, and how that went.
pub(super) fn print(args: &CorrectArgs, units: &[UnitReport], log: &LogReport) -> Exit {
    let report = Report::new(units, log);
    report.warn();
    let text = if args.json { show::json(&report) } else { report.human() };
    print_summary(args, &text, Exit::of_loss(report.lost_data()))
}

/// Everything that the summary says.
#[derive(Debug, Serialize)]
struct Report<'r> {
    units: &'r [UnitReport],
    log: &'r LogReport,
    /// Whether every unit's ticks are those that the service published, to the bit; left out where none were compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    identical: Option<bool>,
    /// Published ticks at the end of which the recording has no raw ticks: they were not compared.
    unfinished: u64,
}

impl<'r> Report<'r> {
    fn new(units: &'r [UnitReport], log: &'r LogReport) -> Self {
        let mut report = Self { units, log, identical: None, unfinished: 0 };
        report.identical = report.compared().next().is_some().then(|| report.compared().all(Account::agrees));
        report.unfinished = report.compared().map(|account| account.unfinished).sum();
        report
    }

    fn compared(&self) -> impl Iterator<Item = &'r Account> + use<'r> {
        self.units.iter().filter_map(|unit| unit.published.as_ref())
    }

    fn lost_data(&self) -> bool {
        self.log.lost_data() || self.units.iter().any(UnitReport::lost_data)
    }

    /// Says on stderr what is not as it should be.
    fn warn(&self) {
        if let LogReport::Recording(report) = self.log {
            report.cut_short.iter().for_each(show::warn);
        }
        for unit in self.units {
            let (replica, warn) = (&unit.replica, |words: &dyn Display| {
                show::warn(format_args!("unit {}: {words}", unit.unit));
            });
            replica.notices.iter().for_each(|notice| warn(notice));
            if replica.further_notices > 0 {
                warn(&format_args!("{} more of these", replica.further_notices));
            }
            unit.troubles.iter().for_each(|trouble| warn(trouble));
            unit.summary.doubts().iter().for_each(|doubt| warn(doubt));
        }
    }

    fn human(&self) -> String {
        let head =
            ["unit", "ticks", "gaps", "missing", "duration (s)", "mean rate (°/h)", "journal", "published"];
        let row = |unit: &UnitReport| {
            let summary = &unit.summary;
            let rate = summary.mean_rate_deg_per_h.map(|rate| format!("{rate:.4}")).join("  ");
            [
                unit.unit.to_string(),
                summary.ticks.to_string(),
                summary.gaps.to_string(),
                summary.missed_ticks.to_string(),
                format!("{:.3}", summary.duration_s),
                rate,
                journal(unit),
                published(unit),
            ]
        };
        let mut text = show::grid(head, self.units.iter().map(row), 1..6);
        for unit in self.units {
            let first = unit.published.as_ref().filter(|_| !agrees_where_recorded(unit));
            if let Some(first) = first.and_then(|account| account.first.as_ref()) {
                let _ = writeln!(text, "\nunit {}: the first difference", unit.unit);
                text += &first_difference(first, ["corrected", "published"]);
            }
        }
        text + &self.verdict()
    }

    /// Whether what was published is reproduced; nothing where nothing was compared.
    fn verdict(&self) -> String {
        match self.identical {
            Some(true) if self.unfinished > 0 => {
                "identical as far as the recording has raw ticks: every other tick that the service published is reproduced to the bit\n".to_owned()
            }
            Some(true) => "identical: every tick that the service published is reproduced to the bit\n".to_owned(),
            Some(false) if self.units.iter().all(agrees_where_recorded) => {
                let unrecorded: u64 = self.compared().map(Account::unrecorded).sum();
                format!(
                    "incomplete: {unrecorded} ticks are not in the recording (dropped on the way to the recorder: congestion = \"block\" \
                     keeps them); every other is reproduced to the bit\n"
                )
            }
            Some(false) => "different: not every tick that the service published is reproduced\n".to_owned(),
            None => String::new(),
        }
    }
}

/// Whether every published tick that the recording has is reproduced, and only the recorder can have missed others: a service that
/// did not run would have heard less than it.
fn agrees_where_recorded(unit: &UnitReport) -> bool {
    let agrees =
        |account: &Account| account.agrees() || (account.unrecorded() > 0 && unit.replica.is_exact());
    unit.published.as_ref().is_none_or(agrees)
}

/// What became of the journal, in a few words.
fn journal(unit: &UnitReport) -> String {
    let replica = &unit.replica;
    if !unit.by_journal {
        return "not followed".to_owned();
    }
    let memories = match replica.memories_equal {
        0 => String::new(),
        1 => ", 1 memory equal".to_owned(),
        count => format!(", {count} memories equal"),
    };
    let notices = replica.notices.len() as u64 + replica.further_notices;
    let notices = if notices > 0 { format!(", {notices} warnings") } else { String::new() };
    format!("{} entries{memories}{notices}", replica.entries)
}

/// How the ticks compare with what was published, in a few words.
fn published(unit: &UnitReport) -> String {
    let Some(account) = &unit.published else { return "not compared".to_owned() };
    let tail = match account.unfinished {
        0 => String::new(),
        ticks => format!(", {ticks} at the end without raw ticks"),
    };
    if account.agrees() {
        return format!("{} identical{tail}", account.ticks);
    }
    if agrees_where_recorded(unit) {
        return format!("{} identical, {} not recorded{tail}", account.ticks, account.unrecorded());
    }
    let missing = account.missing();
    format!("{} of {} differ, {missing} in one alone{tail}", account.different, account.ticks)
}

#[cfg(test)]
mod tests {
    use isotherm_log::diff::Only;
    use isotherm_log::text::ReadReport;

    use super::*;

    #[test]
    fn what_only_the_recorder_missed_is_not_said_to_be_different() {
        let only_a = Only { between: 244, ..Only::default() };
        let account = Account { ticks: 4756, only_a, ..Account::default() };
        let unit = UnitReport {
            unit: isotherm_protocol::key::UnitId::new("A-1").unwrap(),
            by_journal: true,
            summary: isotherm_log::offline::sums::Summary::default(),
            counters: std::collections::BTreeMap::new(),
            troubles: Vec::new(),
            replica: isotherm_log::replica::ReplicaReport::default(),
            published: Some(account),
        };
        let log = LogReport::Text(ReadReport::default());
        insta::assert_snapshot!(
            published(&unit) + "\n" + &Report::new(std::slice::from_ref(&unit), &log).verdict()
        );
    }
}
