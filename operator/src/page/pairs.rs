//! Instances of a pair: who speaks for how many units, what the others do, and units that nobody takes.

use std::collections::BTreeMap;

use isotherm_cli::grouped;
use isotherm_document::few;
use isotherm_protocol::pair::{PairReport, Role, UnitRole};
use ratatui::text::{Line, Span};

use super::figure::{fit, of};
use super::{Level, tone};

/// Characters of an instance without a name that are shown: enough to tell two of them apart.
const INSTANCE: usize = 8;
/// Differences of an instance that are told.
const NAMED: usize = 8;

/// What an instance calls itself; where that is not known, the head of its id, as it does without a name.
#[must_use]
pub fn name(reports: &[PairReport], instance: &str) -> String {
    let known = reports.iter().find(|report| report.member.instance == instance);
    known.map_or_else(|| instance.chars().take(INSTANCE).collect(), |report| report.member.name.clone())
}

/// The lines of all instances; none of one alone that takes and publishes every unit.
#[must_use]
pub fn pairs(reports: &[PairReport], width: usize) -> Vec<Line<'static>> {
    let line = |(level, columns): (Level, Vec<String>)| {
        let (mark, style) = match level {
            Level::Fault => ("! ", tone::FAULT),
            Level::Warning => ("▲ ", tone::WARNING),
            _ => ("", tone::PLAIN),
        };
        Line::from(Span::styled(fit(&format!("{mark}{}", columns.join("  ")), width), style))
    };
    said(reports).into_iter().map(line).collect()
}

/// What there is to say of all instances, in columns, and how grave it is.
#[must_use]
pub fn said(reports: &[PairReport]) -> Vec<(Level, Vec<String>)> {
    let mut said = Vec::new();
    let listens = |report: &PairReport| report.units.iter().any(|unit| unit.role != Role::Speaking);
    if reports.len() > 1 || reports.iter().any(listens) {
        for report in reports {
            said.push((Level::Fine, instance(report, reports.len())));
            let differences = report.units.iter().filter_map(|unit| unit.last_difference.as_deref());
            said.extend(differences.take(NAMED).map(|difference| {
                (Level::Fault, vec![format!("{}: bits differ: {difference}", report.member.name)])
            }));
        }
        let mut speakers = BTreeMap::<&String, usize>::new();
        for unit in reports.iter().flat_map(|report| &report.units).filter(|it| it.role == Role::Speaking) {
            *speakers.entry(&unit.unit).or_default() += 1;
        }
        let twice = speakers.into_iter().filter(|(_, count)| *count > 1);
        let twice: Vec<String> = twice.map(|(unit, _)| unit.clone()).collect();
        if !twice.is_empty() {
            said.push((Level::Fault, vec![format!("two instances publish {}", few(&twice))]));
        }
    }
    let mut nobody: Vec<String> = reports.iter().flat_map(|report| report.passed_over.clone()).collect();
    nobody.retain(|serial| reports.iter().all(|report| report.role(serial).is_none()));
    nobody.sort_unstable();
    nobody.dedup();
    if !nobody.is_empty() {
        said.push((Level::Warning, vec![format!("no service takes {}", few(&nobody))]));
    }
    said
}

/// "north", "publishes 20 units, standby for 3, joining for 1", "standby", "priority 1", "takeovers 2", "40 000 ticks compared, 0 differ"; of
/// one alone also whose standby it is.
fn instance(report: &PairReport, of_how_many: usize) -> Vec<String> {
    let count = |role| report.units.iter().filter(|unit| unit.role == role).count();
    let sum = |number: fn(&UnitRole) -> u64| grouped(report.units.iter().map(number).sum());
    let member = &report.member;
    let silent = [Role::Standby, Role::Joining].into_iter().filter(|role| count(*role) > 0);
    let silent: Vec<_> = silent.map(|role| format!(", {} for {}", role.name(), count(role))).collect();
    let mut columns = vec![
        member.name.clone(),
        format!("publishes {}{}", of(count(Role::Speaking), "unit"), silent.concat()),
        member.mode.name().to_owned(),
        format!("priority {}", member.priority),
        format!("takeovers {}", sum(|unit| unit.takeovers)),
        format!(
            "{} ticks compared, {} differ",
            sum(|unit| unit.ticks_compared),
            sum(|unit| unit.ticks_differing)
        ),
    ];
    let elsewhere = report.elsewhere().filter(|_| of_how_many == 1);
    columns.extend(elsewhere.map(|elsewhere| format!("the other is {elsewhere}")));
    columns
}

/// Who does what for one unit: "north speaks, south standby"; nothing where there is one instance.
#[must_use]
pub(super) fn of_unit(reports: &[PairReport], serial: &str) -> Option<Line<'static>> {
    let roles: Vec<_> = reports
        .iter()
        .filter_map(|report| Some(format!("{} {}", report.member.name, report.role(serial)?.name())))
        .collect();
    (reports.len() > 1).then(|| Line::from(format!("instances  {}", roles.join(", "))))
}

#[cfg(test)]
mod tests {
    use super::super::tests::samples::instance as report;
    use super::*;

    fn text(reports: &[PairReport]) -> String {
        tone::text(&pairs(reports, 200), false)
    }

    #[test]
    fn who_speaks_is_seen_and_one_instance_alone_says_nothing() {
        assert_eq!(text(&[report("north", &[("A", Role::Speaking)])]), "");
        let pair = [
            report("north", &[("A", Role::Speaking), ("B", Role::Standby)]),
            report("south", &[("A", Role::Joining), ("B", Role::Speaking)]),
        ];
        let alone = text(&pair[1..]);
        insta::assert_snapshot!(format!("{}{}\n{alone}", text(&pair), of_unit(&pair, "A").unwrap()));
    }

    #[test]
    fn two_that_speak_and_units_of_nobody_are_told() {
        let mut pair = [
            report("north", &[("A", Role::Speaking)]),
            report("south", &[("A", Role::Speaking), ("B", Role::Speaking)]),
        ];
        pair[0].passed_over = ["B", "C"].map(str::to_owned).to_vec();
        pair[1].passed_over = vec!["C".to_owned()];
        insta::assert_snapshot!(text(&pair));
    }
}
