//! `status`: how units and services are, once.

use std::io::IsTerminal;
use std::time::SystemTime;

use clap::Args;
use isotherm_cli::{Exit, print};
use isotherm_protocol::key::UnitId;
use isotherm_protocol::pair::PairReport;
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::Status;
use ratatui::text::Line;
use serde::Serialize;

use super::ConsoleError;
use super::client::{Client, ClientArgs};
use super::page::{self, Unit, tone};

/// Width of a unit's page where no terminal limits it.
const PAGE_COLUMNS: usize = 100;
/// Width of a table where no terminal limits it: nothing is left out.
const TABLE_COLUMNS: usize = 1000;

/// Arguments of `status`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  isotherm status
  isotherm status ZLG-0001
  isotherm status ZLG-0001 ZLG-0002 --json

One line per unit, or everything about one unit. On a narrow terminal the least important columns are left out.
Columns:
  ●  running    ○  not running    ▲  warning    !  fault now
  state    \"running ±\" with, \"running\" without reversal of the lasing mode
  rev      revision of the calibration in force; cal. age: time since its document was made
  °C       temperature and its rate, of the first channel that is stale or outside its range, else of the first
  range    all temperatures against the calibrated range
  °/h, mg  size of the present correction
  Hz       raw gyro ticks received per second
  gaps, dup, late, bad
           gaps announced, duplicates, late ticks and readings, frames refused, since the service started
  p99      latency added by the service, 99th percentile")]
pub struct StatusArgs {
    /// Serials: one shows everything about it (default: all units)
    #[arg(value_name = "UNIT", value_parser = UnitId::new)]
    pub units: Vec<UnitId>,
    /// Print services and units as JSON on stdout
    #[arg(long)]
    pub json: bool,
    /// Width in columns (default: that of the terminal)
    #[arg(long, value_name = "COLUMNS", value_parser = clap::value_parser!(u16).range(20..))]
    pub width: Option<u16>,
    /// How to reach the service
    #[command(flatten)]
    pub client: ClientArgs,
}

/// What is printed as JSON.
#[derive(Debug, Serialize)]
pub struct Report {
    /// The service instances.
    pub services: Vec<ServiceStatus>,
    /// The units.
    pub units: Vec<Status>,
    /// What each instance does for which unit.
    pub instances: Vec<PairReport>,
}

impl Report {
    /// As the command prints it.
    #[must_use]
    pub fn to_json(&self) -> String {
        isotherm_cli::json(self)
    }
}

/// Prints how units and services are.
pub(super) async fn run(args: &StatusArgs) -> Result<Exit, ConsoleError> {
    let client = Client::open(&args.client).await?;
    let (units, services, instances) = tokio::join!(client.statuses(), client.services(), client.pairs());
    let tried = client.tried().to_owned();
    client.close().await;
    let units = units?;
    // Without units and services there is nothing to show: why no service answers.
    let services = if units.is_empty() { services? } else { or_none(services)? };
    let mut report = Report { units, services, instances: or_none(instances)? };
    select(&mut report, &args.units, &tried)?;
    if args.json {
        return Ok(print(&report.to_json(), Exit::Ok));
    }
    let columns = args.width.map(usize::from).or_else(terminal_columns);
    let lines = match (args.units.as_slice(), report.units.as_slice()) {
        ([_], [_, ..]) => pages(&report, columns.unwrap_or(PAGE_COLUMNS)),
        _ => table(&report, columns.unwrap_or(TABLE_COLUMNS)),
    };
    Ok(print(&tone::text(&lines, has_colours()), Exit::Ok))
}

/// Services before 0.1.0 tell nothing of themselves.
pub(super) fn or_none<T>(answers: Result<Vec<T>, ConsoleError>) -> Result<Vec<T>, ConsoleError> {
    match answers {
        Err(ConsoleError::NoAnswer { .. } | ConsoleError::NotAllowed { .. }) => Ok(Vec::new()),
        other => other,
    }
}

/// Keeps the units that were asked for, and their services.
fn select(report: &mut Report, units: &[UnitId], tried: &str) -> Result<(), ConsoleError> {
    if units.is_empty() {
        return Ok(());
    }
    let known = |unit: &&UnitId| report.units.iter().any(|status| status.unit == unit.as_str());
    if let Some(unknown) = units.iter().find(|unit| !known(unit)) {
        return Err(ConsoleError::unlisted(unknown.as_str(), tried, &report.units, &report.instances));
    }
    report.units.retain(|status| units.iter().any(|unit| status.unit == unit.as_str()));
    report.services.retain(|service| report.units.iter().any(|status| status.instance == service.instance));
    Ok(())
}

/// The present time by the clock of this machine (ms since 1970-01-01 UTC).
#[must_use]
pub fn unix_ms() -> i64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_millis()).unwrap_or(i64::MAX)
}

/// The time by a service's own clock when it made its status (ms since 1970-01-01 UTC).
#[expect(
    clippy::cast_possible_truncation,
    reason = "milliseconds of a process's life; float-to-int saturates"
)]
pub(super) fn clock_of(service: &ServiceStatus) -> i64 {
    service.started_unix_ms.saturating_add((service.uptime_s * 1e3) as i64)
}

/// A unit of the report, by the clock of its service.
fn unit<'a>(report: &'a Report, status: &'a Status) -> (Unit<'a>, Option<&'a ServiceStatus>) {
    let service = report.services.iter().find(|service| service.instance == status.instance);
    (Unit::now(status, service.map_or_else(unix_ms, clock_of)), service)
}

fn table(report: &Report, columns: usize) -> Vec<Line<'static>> {
    let units: Vec<Unit<'_>> = report.units.iter().map(|status| unit(report, status).0).collect();
    page::overview((&report.services, &[]), &report.instances, &units, columns)
}

/// The page of a unit; two instances that have it, one more than should, give a page each.
fn pages(report: &Report, columns: usize) -> Vec<Line<'static>> {
    let mut lines = Vec::new();
    for status in &report.units {
        if !lines.is_empty() {
            lines.push(Line::default());
        }
        let (unit, service) = unit(report, status);
        lines.extend(page::sheet(&unit, service, &report.instances, columns));
    }
    lines
}

/// Columns of the terminal; `None` where stdout is none.
pub(super) fn terminal_columns() -> Option<usize> {
    let size = std::io::stdout().is_terminal().then(ratatui::crossterm::terminal::size)?;
    size.ok().map(|(columns, _)| usize::from(columns)).filter(|columns| *columns > 0)
}

/// Whether colours are seen and wanted: <https://no-color.org>.
fn has_colours() -> bool {
    let unwanted = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    is_terminal() && !unwanted
}

/// Whether standard output is a terminal that understands more than text.
pub(super) fn is_terminal() -> bool {
    std::io::stdout().is_terminal() && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

#[cfg(test)]
mod tests {
    use isotherm_protocol::pair::Role;

    use super::page::tests::samples;
    use super::*;

    #[test]
    fn units_are_chosen_with_their_services_and_an_unknown_one_is_named() {
        let units = samples::fleet(8);
        let other = ServiceStatus { instance: "other".to_owned(), ..ServiceStatus::default() };
        let services = vec![samples::service(&units), other];
        let instances =
            ["ZLG-0002", "ZLG-0004"].map(|unit| samples::instance("south", &[(unit, Role::Standby)]));
        let alone = PairReport { others: Vec::new(), ..instances[0].clone() };
        let mut report = Report { services, units, instances: vec![alone, instances[1].clone()] };
        let serial = |serial: &str| [UnitId::new(serial).unwrap()];
        let refused = |report: &mut Report, unit| {
            let error = select(report, &serial(unit), "here").unwrap_err().to_string();
            report.units.retain(|status| !["ZLG-0002", "ZLG-0004"].contains(&&*status.unit));
            error
        };
        // The second of them its service has, the third another one.
        insta::assert_snapshot!(
            ["ZLG-9999", "ZLG-0002", "ZLG-0004"].map(|unit| refused(&mut report, unit)).join("\n")
        );
        select(&mut report, &serial("ZLG-0003"), "here").unwrap();
        assert_eq!((report.units.len(), report.services.len()), (1, 1));
        assert_eq!(report.units[0].unit, "ZLG-0003");
    }

    #[test]
    fn faults_are_dated_by_the_clock_of_the_service() {
        let units = vec![samples::faulty("ZLG-0005")];
        let services = vec![samples::service(&units)];
        let report = Report { services, units, instances: Vec::new() };
        insta::assert_snapshot!(tone::text(&table(&report, TABLE_COLUMNS), false));
    }
}
