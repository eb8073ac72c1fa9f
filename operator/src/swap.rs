//! `swap` and `rollback`: look at the difference, then put it in force.

use std::io::{BufRead, IsTerminal, Write};
use std::path::PathBuf;

use clap::Args;
use isotherm_cli::{Exit, failed, print, say, say_lines, say_warning};
use isotherm_protocol::control::{CommandOrder, Order, Schedule, SwapOptions, SwapOutcome, SwapReply};
use isotherm_protocol::key::{self, UnitId};

use super::ConsoleError;
use super::client::{self, Client, ClientArgs};
use super::command::give;
use super::follow::Follow;
use super::page::{of, schedule, short};
use super::show;

/// Arguments of `swap`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  isotherm swap ZLG-0001 new.toml
  isotherm swap ZLG-0001 new.toml --yes --slew 2 --by ann
  isotherm swap ZLG-0001 new.toml --dry-run --json

First prints the difference from the document in force: every entry that changes, and the effect on the correction at the
unit's present temperatures. Exit codes: 0 in force or scheduled, 78 refused, 1 not answered or not confirmed.")]
pub struct SwapArgs {
    /// Serial of the unit
    #[arg(value_parser = UnitId::new)]
    pub unit: UnitId,
    /// Calibration document or overlay (TOML); - for standard input
    pub file: PathBuf,
    /// First tick, by sequence number (default: the next tick)
    #[arg(long, value_name = "SEQUENCE", conflicts_with = "at_time_ns")]
    pub at_sequence: Option<u64>,
    /// First tick, by its end time (ns on the producer's clock) (default: the next tick)
    #[arg(long, value_name = "NS", allow_negative_numbers = true)]
    pub at_time_ns: Option<i64>,
    /// Duration of the change (s, 0…3600) (default: as configured)
    #[arg(long, value_name = "SECONDS")]
    pub slew: Option<f64>,
    /// Accept a document for another serial
    #[arg(long)]
    pub any_serial: bool,
    /// Accept it despite age, temperature range, schema version or size of the jump
    #[arg(long)]
    pub force: bool,
    /// What is asked before, and how it is said
    #[command(flatten)]
    pub consent: Consent,
    /// How to reach the service
    #[command(flatten)]
    pub client: ClientArgs,
}

/// Arguments of `rollback`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  isotherm rollback ZLG-0001
  isotherm rollback ZLG-0001 --to 3 --yes")]
pub struct RollbackArgs {
    /// Serial of the unit
    #[arg(value_parser = UnitId::new)]
    pub unit: UnitId,
    /// Revision to go back to (default: the previous one; `isotherm history` lists them)
    #[arg(long, value_name = "REVISION")]
    pub to: Option<u64>,
    /// What is asked before, and how it is said
    #[command(flatten)]
    pub consent: Consent,
    /// How to reach the service
    #[command(flatten)]
    pub client: ClientArgs,
}

/// What is asked before a change, and how it is said.
#[derive(Debug, Clone, Args)]
pub struct Consent {
    /// Do not ask for confirmation
    #[arg(long, conflicts_with = "dry_run")]
    pub yes: bool,
    /// Show only what would happen
    #[arg(long)]
    pub dry_run: bool,
    /// Your name for the audit file (default: user name)
    #[arg(long, value_name = "NAME")]
    pub by: Option<String>,
    /// Print the service's answer as JSON on stdout; the difference goes to stderr
    #[arg(long)]
    pub json: bool,
}

/// What is to become of a unit's calibration.
enum Wish {
    /// This text.
    Document { text: Vec<u8>, options: SwapOptions },
    /// An earlier one.
    Rollback { revision: Option<u64>, by: String },
}

impl Wish {
    /// Asks for it, or only what would happen.
    async fn ask(&self, client: &Client, unit: &UnitId, dry_run: bool) -> Result<SwapReply, ConsoleError> {
        match self {
            Self::Document { text, options } => {
                let options = SwapOptions { dry_run, ..options.clone() };
                client.json(&client.order(key::calibration(unit)), &options.to_parameters(), Some(text)).await
            }
            Self::Rollback { revision, by } => {
                let order = Order::Rollback { revision: *revision, dry_run };
                let reply = give(client, unit, &CommandOrder { by: by.clone(), order }).await?;
                let reason = reply.reason.unwrap_or_else(|| "refused without a reason".to_owned());
                reply.swap.ok_or(ConsoleError::Refused(reason))
            }
        }
    }
}

/// Swaps a unit's calibration.
pub(super) async fn run(args: &SwapArgs) -> Result<Exit, ConsoleError> {
    let schedule = match (args.at_sequence, args.at_time_ns) {
        (Some(sequence), _) => Schedule::Sequence(sequence),
        (None, Some(time_ns)) => Schedule::TimeNs(time_ns),
        (None, None) => Schedule::NextTick,
    };
    let options = SwapOptions {
        by: client::by(args.consent.by.as_deref()),
        dry_run: args.consent.dry_run,
        schedule,
        slew_s: args.slew,
        any_serial: args.any_serial,
        force: args.force,
    };
    if let Err(error) = SwapOptions::parse(&options.to_parameters()) {
        return Ok(failed(error, Exit::Usage));
    }
    let wish = Wish::Document { text: client::read(&args.file)?, options };
    let name = args.file.display().to_string();
    change(&args.unit, &wish, Some(&name), &args.consent, &args.client).await
}

/// Goes back to an earlier calibration.
pub(super) async fn rollback(args: &RollbackArgs) -> Result<Exit, ConsoleError> {
    let wish = Wish::Rollback { revision: args.to, by: client::by(args.consent.by.as_deref()) };
    // The service names the file that it keeps the document in.
    change(&args.unit, &wish, None, &args.consent, &args.client).await
}

/// Shows what would change, asks, has it changed, and waits until it is.
async fn change(
    unit: &UnitId,
    wish: &Wish,
    name: Option<&str>,
    consent: &Consent,
    client: &ClientArgs,
) -> Result<Exit, ConsoleError> {
    let client = Client::open(client).await?;
    let preview = wish.ask(&client, unit, true).await?;
    let key = key::calibration(unit);
    let sent = name.map(|name| (key.as_str(), name));
    tell(&preview, sent);
    // An order that will be refused is given too, where nobody needs to be asked: history and alerts know of it.
    let is_refused = preview.outcome == SwapOutcome::Refused;
    let is_wanted = preview.outcome == SwapOutcome::WouldBeAccepted || is_refused && consent.yes;
    if consent.dry_run || !is_wanted {
        return Ok(result(&preview, consent.json));
    }
    if !consent.yes {
        confirm(unit, &preview)?;
    }
    // Before the order is given, so that its effect cannot come before the watch begins.
    let mut follow = Follow::start(&client, unit).await?;
    let reply = wish.ask(&client, unit, false).await?;
    if reply.outcome == SwapOutcome::Accepted {
        say(wait(&mut follow, &reply, client.timeout).await);
    } else if !is_refused {
        tell(&reply, sent);
    }
    client.close().await;
    Ok(result(&reply, consent.json))
}

/// Says on stderr what a reply holds beside its outcome: what is to be done last, where it is read.
fn tell(reply: &SwapReply, sent: Option<(&str, &str)>) {
    if let Some(difference) = &reply.difference
        && reply.outcome != SwapOutcome::Unchanged
    {
        say_lines(show::difference(difference));
    }
    for problem in &reply.problems {
        say(show::problem(problem, sent));
    }
    for warning in &reply.warnings {
        say_warning(show::problem(warning, sent));
    }
}

/// Prints the outcome and gives its exit code.
fn result(reply: &SwapReply, json: bool) -> Exit {
    let exit = if reply.outcome == SwapOutcome::Refused { Exit::BadConfiguration } else { Exit::Ok };
    if json {
        return print(&isotherm_cli::json(reply), exit);
    }
    // A service before 0.1.0 says the proposed digest in the place of the one in force.
    let digest = short(reply.proposed.as_ref().unwrap_or(&reply.digest));
    let line = match reply.outcome {
        SwapOutcome::Refused => {
            let problems = of(reply.problems.len(), "problem");
            let stays = match reply.revision {
                0 => "the unit has no calibration".to_owned(),
                revision => format!("revision {revision} stays in force"),
            };
            format!("{}: refused with {problems}; {stays}\n", reply.unit)
        }
        SwapOutcome::Unchanged => {
            format!("{}: unchanged: revision {} ({digest}) is this document\n", reply.unit, reply.revision)
        }
        SwapOutcome::WouldBeAccepted => {
            format!("{}: would be accepted ({digest}) and replace revision {}\n", reply.unit, reply.revision)
        }
        SwapOutcome::Accepted => format!(
            "{}: accepted as revision {} ({digest}), {}\n",
            reply.unit,
            reply.revision,
            schedule(reply.schedule, reply.slew_s)
        ),
    };
    print(&line, exit)
}

/// Asks whether to go on.
fn confirm(unit: &UnitId, preview: &SwapReply) -> Result<(), ConsoleError> {
    if !std::io::stdin().is_terminal() {
        return Err(ConsoleError::Unasked);
    }
    let mut stderr = std::io::stderr();
    // Where the question cannot be written, nobody has read it.
    let question = match preview.revision {
        0 => format!("Give {unit} its first calibration?"),
        revision => format!("Replace revision {revision} of {unit}?"),
    };
    write!(stderr, "{question} [y/N] ").and_then(|()| stderr.flush()).map_err(ConsoleError::Terminal)?;
    let mut answer = String::new();
    std::io::stdin().lock().read_line(&mut answer).map_err(ConsoleError::Terminal)?;
    if matches!(answer.trim().to_lowercase().as_str(), "y" | "yes") {
        Ok(())
    } else {
        Err(ConsoleError::Declined)
    }
}

/// Waits until the unit says that the revision is in force, or that it waits for its tick; in words.
async fn wait(follow: &mut Follow, reply: &SwapReply, timeout: std::time::Duration) -> String {
    let (revision, is_known) = (reply.revision, follow.first.is_some());
    let seen = follow.until(timeout, |status| {
        if status.revision().counter >= revision {
            return Some(format!("revision {} is in force", status.revision().counter));
        }
        let pending = status.pending.as_ref().filter(|pending| pending.revision.counter == revision)?;
        Some(format!("revision {revision} waits: {}", schedule(pending.schedule, pending.slew_s)))
    });
    seen.await.unwrap_or_else(|| {
        if is_known {
            return format!(
                "{} has sent no status since: isotherm status shows when revision {revision} is in force",
                reply.unit
            );
        }
        format!("{} has not appeared yet: revision {revision} is in force from its first tick on", reply.unit)
    })
}
