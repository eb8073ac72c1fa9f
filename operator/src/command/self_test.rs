//! Following a self-test to its report.

use std::time::Duration;

use isotherm_cli::{Exit, print};
use isotherm_protocol::control::CommandReply;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::status::{SelfTestItem, SelfTestReport, State};

use crate::client::Client;
use crate::follow::Follow;
use crate::page::of;
use crate::{ConsoleError, show};

/// The service ends a self-test after 14 s at the latest.
const LONGEST: Duration = Duration::from_secs(20);

/// Waits for the report of the test that has begun, and prints it.
pub(super) async fn follow(
    mut follow: Follow,
    client: &Client,
    unit: &UnitId,
    begun: &CommandReply,
    json: bool,
) -> Result<Exit, ConsoleError> {
    let report = if begun.state == State::SelfTest {
        let before = follow.first.as_ref().and_then(|status| status.self_test.clone());
        let mut seen = false;
        let ended = follow.until(LONGEST, |status| {
            seen |= status.state == State::SelfTest;
            let new = seen || status.self_test != before;
            status.self_test.clone().filter(|_| new && status.state != State::SelfTest)
        });
        ended.await
    } else {
        // Without a calibration it is over at once.
        client.status(unit).await?.and_then(|status| status.self_test)
    };
    let report = report.ok_or_else(|| {
        ConsoleError::TimedOut(format!("{unit} has given no report within {} s", LONGEST.as_secs()))
    })?;
    let exit = if report.passed { Exit::Ok } else { Exit::Failed };
    let text = if json { isotherm_cli::json(&report) } else { words(unit, &report) + "\n" };
    Ok(print(&text, exit))
}

/// The report as a table, its verdict in the first line.
fn words(unit: &UnitId, report: &SelfTestReport) -> String {
    let failed = report.items.iter().filter(|item| !item.passed).count();
    let verdict = if report.passed {
        "passed".to_owned()
    } else {
        format!("failed: {} of {}", failed, of(report.items.len(), "check"))
    };
    let rows = report.items.iter().map(row).collect();
    let table = show::table(["check", "value", "at least", "at most", "unit", "verdict"], rows, 1);
    format!("{unit}: self-test {verdict}\n{table}\n{}", super::in_standby(unit))
}

fn row(item: &SelfTestItem) -> Vec<String> {
    let number = |value: Option<f64>| value.map_or("—".to_owned(), |value| format!("{value:.3}"));
    vec![
        item.name.clone(),
        item.value.map_or("nothing came".to_owned(), |value| format!("{value:.3}")),
        number(item.at_least),
        number(item.at_most),
        item.unit_of_measure.clone(),
        if item.passed { "good" } else { "FAILED" }.to_owned(),
    ]
}
