//! `history`: what was done to a unit, by whom, when, from where; and whether the audit file still says what was written.

use std::path::PathBuf;

use clap::Args;
use isotherm_cli::{Exit, print};
use isotherm_protocol::control::Schedule;
use isotherm_protocol::digest::Digest;
use isotherm_protocol::history::{Acceptance, AuditEntry, AuditEvent, Source};
use isotherm_protocol::key::{self, UnitId};

use super::client::{Client, ClientArgs};
use super::page::{self, of, short};
use super::status::{or_none, terminal_columns};
use super::{ConsoleError, show};

/// Most entries that are asked for.
const MOST_ENTRIES: u32 = 10_000;

/// Width of the table where no terminal limits it.
const WIDTH: usize = 100;
/// Columns that the table needs beside the names of who and of what it came from, and the fewest that such a name gets.
const WITHOUT_NAMES: usize = 72;
const SHORTEST_NAME: usize = 4;
/// What stands before a line of what changed.
const INDENT: &str = "        ";

/// Arguments of `history`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  isotherm history ZLG-0001
  isotherm history ZLG-0001 --all --limit 100
  isotherm history ZLG-0001 --json | jq '.[0]'
  isotherm history --verify /var/lib/isotherm")]
pub struct HistoryArgs {
    /// Serial of the unit
    #[arg(required_unless_present = "verify", value_parser = UnitId::new)]
    pub unit: Option<UnitId>,
    /// Verify the chain of the audit files in this state folder, without a service
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["unit", "limit", "all"])]
    pub verify: Option<PathBuf>,
    /// Digest printed by an earlier `--verify`: its entry must still exist
    #[arg(long, value_name = "DIGEST", requires = "verify")]
    pub noted: Option<Digest>,
    /// Number of entries, newest first
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_ENTRIES)))]
    pub limit: u32,
    /// Show refusals, commands and first ticks too, not only calibrations
    #[arg(long)]
    pub all: bool,
    /// Print the entries as JSON on stdout
    #[arg(long)]
    pub json: bool,
    /// How to reach the service
    #[command(flatten)]
    pub client: ClientArgs,
}

/// Prints a unit's history.
pub(super) async fn run(args: &HistoryArgs) -> Result<Exit, ConsoleError> {
    // Without one the command line verifies a folder.
    let Some(unit) = &args.unit else { return Ok(Exit::Usage) };
    let client = Client::open(&args.client).await?;
    // Calibrations stand among the other entries, how far apart nobody knows.
    let parameters = format!("limit={}", if args.all { args.limit } else { MOST_ENTRIES });
    let mut entries: Vec<AuditEntry> = client.json(&key::history(unit), &parameters, None).await?;
    if entries.is_empty() {
        let (statuses, instances) = (client.statuses().await?, or_none(client.pairs().await)?);
        if !statuses.iter().any(|status| status.unit == unit.as_str()) {
            return Err(ConsoleError::unlisted(unit.as_str(), client.tried(), &statuses, &instances));
        }
    }
    client.close().await;
    entries.sort_by_key(|entry| std::cmp::Reverse(entry.number));
    entries.retain(|entry| args.all || is_of_calibrations(&entry.event));
    entries.truncate(args.limit as usize);
    let text = if args.json {
        isotherm_cli::json(&entries)
    } else if entries.is_empty() {
        format!("{unit}: nothing has been done to it\n")
    } else {
        table(&entries, terminal_columns().unwrap_or(WIDTH))
    };
    Ok(print(&text, Exit::Ok))
}

/// Whether it says which calibration holds: one that never came in force is not to be taken for one that did.
fn is_of_calibrations(event: &AuditEvent) -> bool {
    matches!(event, AuditEvent::Accepted(_) | AuditEvent::Withdrawn(_))
}

/// The entries, each with a line of its own for what changed, in so many columns; the JSON has them whole.
fn table(entries: &[AuditEntry], columns: usize) -> String {
    let header = ["no.", "time (UTC)", "what", "rev", "digest", "by", "from"];
    let (rows, changes): (Vec<_>, Vec<_>) = entries.iter().map(|entry| row(entry, columns)).unzip();
    let table = show::table(header, rows, header.len()).to_string();
    // The header and the line under it change nothing.
    let changes = [const { String::new() }; 2].into_iter().chain(changes);
    let mut text = String::new();
    for (line, changes) in table.lines().zip(changes) {
        text.extend([line.trim_end(), "\n"]);
        if !changes.is_empty() {
            text.extend([INDENT, &page::fit(&changes, columns.saturating_sub(INDENT.len())), "\n"]);
        }
    }
    text
}

/// One line of the table in so many columns, and what changed.
fn row(entry: &AuditEntry, columns: usize) -> (Vec<String>, String) {
    let AuditEntry { number, time, by, event, .. } = entry;
    let (revision, document, changes) = match event {
        AuditEvent::Accepted(accepted) => {
            (Some(accepted.revision), Some((&accepted.digest, &accepted.source)), effect(accepted))
        }
        AuditEvent::InForce(first) => {
            (Some(first.revision), None, format!("from tick {} on", first.first_sequence))
        }
        AuditEvent::Withdrawn(withdrawal) => (Some(withdrawal.revision), None, event.to_string()),
        AuditEvent::Refused(refused) => {
            let problems = of(usize::try_from(refused.count).unwrap_or(usize::MAX), "problem");
            let first = refused.problems.first().map_or("", String::as_str);
            (None, Some((&refused.digest, &refused.source)), format!("{problems}: {first}"))
        }
        AuditEvent::Command(command) => {
            let became = command.reason.as_deref().unwrap_or(&command.state_after);
            let verdict = if command.accepted { " →" } else { " refused:" };
            (None, None, format!("{}{verdict} {became}", command.command))
        }
        _ => (None, None, event.to_string()),
    };
    let revision = revision.map_or_else(String::new, |revision| revision.to_string());
    let (digest, from) = document.map(|(digest, from)| (short(digest), source(from))).unwrap_or_default();
    // To the second; the JSON has the rest.
    let time: String = time.to_string().replace('T', " ").chars().take(19).collect();
    let longest = (columns.saturating_sub(WITHOUT_NAMES) / 2).max(SHORTEST_NAME);
    let cut = |text: &str| page::fit(text, longest);
    let cells =
        vec![number.to_string(), time, event.name().to_owned(), revision, digest, cut(by), cut(&from)];
    (cells, changes)
}

/// When it took effect and what changed, short.
fn effect(Acceptance { base, changed, schedule, slew_ms, .. }: &Acceptance) -> String {
    let mut words = match changed.as_slice() {
        [] if base.is_none() => "first document".to_owned(),
        [] => "no entry changed".to_owned(),
        [one] => one.clone(),
        [first, rest @ ..] => format!("{first}, and {} more", rest.len()),
    };
    #[expect(clippy::cast_precision_loss, reason = "at most an hour")]
    let seconds = *slew_ms as f64 / 1000.0;
    if *schedule != Schedule::NextTick || *slew_ms > 0 {
        words = format!("{words} ({})", page::schedule(*schedule, seconds));
    }
    words
}

/// Where a calibration came from, in words.
fn source(source: &Source) -> String {
    match source {
        Source::Folder { path } | Source::Start { path } => {
            path.rsplit('/').next().unwrap_or(path).to_owned()
        }
        Source::Bus => "bus".to_owned(),
        Source::Rollback { to } => format!("rollback to {to}"),
        Source::PreLaunch => "pre-launch".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_fits_its_columns() {
        let accepted = |number: u64, path: &str, changed: &str| -> AuditEntry {
            let json = serde_json::json!({
                "number": number, "time": "2026-11-21T13:40:26.082Z", "unit": "ZLG-0001", "by": "operator-of-the-night-shift",
                "event": "accepted", "revision": number, "digest": "ef".repeat(32), "source": { "from": "start", "path": path },
                "changed": [changed], "schedule": { "sequence": 1_000_000_000_u64 }, "slew_ms": 2500,
            });
            serde_json::from_value(json).unwrap()
        };
        let change = "gyro.sensor[0].static_bias.coefficients_deg_per_h[0]: 0.45 -> 0.41 (-0.04, -8.889 %)";
        let withdrawn = serde_json::json!({
            "number": 12_346, "time": "2026-11-21T13:41:00Z", "unit": "ZLG-0001", "event": "withdrawn",
            "revision": 12_345, "why": "superseded", "by_revision": 12_347,
        });
        let mut entries = vec![
            serde_json::from_value(withdrawn).unwrap(),
            accepted(12_345, "/home/ann/bench/units/ZLG-0001.toml", change),
            accepted(1, "/u.toml", "x"),
        ];
        assert!(entries.iter().all(|entry| is_of_calibrations(&entry.event)));
        let refused = serde_json::json!({
            "number": 7, "time": "2026-11-21T13:41:00Z", "unit": "ZLG-0001", "event": "command", "command": "self-test",
            "accepted": false, "reason": "self-test is not possible in running: standby first", "state_before": "running",
            "state_after": "running",
        });
        entries.push(serde_json::from_value(refused).unwrap());
        for base in [Some(Digest([7; 32])), None] {
            let mut same = accepted(1, "/u.toml", "x");
            let AuditEvent::Accepted(acceptance) = &mut same.event else { unreachable!() };
            (acceptance.base, acceptance.changed) = (base, Vec::new());
            entries.push(same);
        }
        let texts = [80, WIDTH, 160].map(|columns| {
            let text = table(&entries, columns);
            assert!(text.lines().all(|line| line.chars().count() <= columns), "{text}");
            text
        });
        assert!(texts[2].contains("operator-of-the-night-shift"), "{}", texts[2]);
        insta::assert_snapshot!(texts[1]);
    }
}
