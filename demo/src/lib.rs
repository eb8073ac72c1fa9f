//! The demo: three simulated units, the service and a subscriber, in one process over real Zenoh sessions on loopback.
//!
//! Every unit has a session of its own, as has the subscriber; no router is needed. The units' time runs faster than
//! the clock: hours in the chamber pass in half a minute. Nothing that the service does depends on that, because every
//! message carries its own time.

mod error;
mod fleet;
mod plots;
mod produce;
mod score;
mod stage;
mod summary;
mod switch;
mod watch;
mod windows;

use std::fs::OpenOptions;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use isotherm_bus::BoxFuture;
use isotherm_cli::{Exit, failed, print};
use tokio::sync::mpsc::unbounded_channel;
use tokio::task::JoinSet;

pub use error::DemoError;
use fleet::Member;
use produce::{Pace, produce};
use stage::Stage;
use summary::{Summary, UnitSummary};
use watch::{Watched, watch};

/// How long closing a session may take.
const CLOSE_LIMIT: Duration = Duration::from_secs(2);

/// Options of the demo.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  isotherm demo
  isotherm demo --seconds 10 --report /tmp/demo.html
  isotherm demo --json --no-report | jq '.units[] | [.unit, .corrected_rms_deg_per_h]'

Exit codes: 0 every tick came back once, 3 a tick was lost, 1 the demo failed.")]
pub struct DemoArgs {
    /// Duration (s); the units' event time is compressed to fit
    #[arg(long, value_name = "N", default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..=3600))]
    pub seconds: u32,
    /// Seed of all noise: the same seed gives the same ticks
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    pub seed: u64,
    /// Print one JSON object instead of the table
    #[arg(long)]
    pub json: bool,
    /// Report to write
    #[arg(long, value_name = "FILE", default_value = "isotherm-demo.html")]
    pub report: PathBuf,
    /// Write no report
    #[arg(long, conflicts_with = "report")]
    pub no_report: bool,
}

/// Runs the demo and prints what came of it; [`Exit::DataLoss`] where a tick was lost.
#[must_use]
pub fn run(args: DemoArgs) -> BoxFuture<'static, Exit> {
    Box::pin(async move { show(args).await.unwrap_or_else(|error| failed(error, Exit::Failed)) })
}

async fn show(args: DemoArgs) -> Result<Exit, DemoError> {
    let begin = Instant::now();
    let report = (!args.no_report).then(|| std::path::absolute(&args.report).unwrap_or(args.report));
    let write = |path: &Path, source| DemoError::Write { path: path.to_owned(), source };
    if let Some(path) = &report {
        // Tried now: nobody wants to learn after half a minute that the folder does not exist.
        let is_new = !path.exists();
        OpenOptions::new().create(true).append(true).open(path).map_err(|source| write(path, source))?;
        if is_new {
            std::fs::remove_file(path).map_err(|source| write(path, source))?;
        }
    }
    let fleet = fleet::fleet(args.seed)?;
    let (units, watched) = play(&fleet, f64::from(args.seconds)).await?;
    let summary = Summary { units, report, seconds: begin.elapsed().as_secs_f64(), seed: args.seed };
    if let Some(path) = &summary.report {
        let html = plots::page(&summary, &fleet, &watched);
        std::fs::write(path, html).map_err(|source| write(path, source))?;
    }
    let exit = if summary.units.iter().all(UnitSummary::is_whole) { Exit::Ok } else { Exit::DataLoss };
    Ok(print(&(text(&summary, args.json) + "\n"), exit))
}

/// Plays all units at once, each within `seconds`, and gives the figures and the curves of each.
async fn play(fleet: &[Member], seconds: f64) -> Result<(Vec<UnitSummary>, Vec<Watched>), DemoError> {
    let mut stage = Stage::open(fleet).await?;
    let paces: Vec<Pace> = fleet.iter().map(|member| Pace::new(member, seconds)).collect();

    let (announce, feed) = unbounded_channel();
    let mut producers = JoinSet::new();
    for (unit, (member, pace)) in fleet.iter().zip(&paces).enumerate() {
        let announce = announce.clone();
        // The receiver is gone where the subscriber has ended early; then there is nobody to tell.
        let tell = move |batch| drop(announce.send((unit, batch)));
        producers.spawn(produce(member.clone(), *pace, stage.connect(), tell));
    }
    drop(announce);
    let (watched, produced) = tokio::join!(watch(&mut stage.consumer, fleet, feed), all(producers));
    produced?;
    let latencies = stage.added_latencies(fleet).await?;
    stage.close().await?;

    let units = fleet.iter().zip(&paces).zip(watched.iter().zip(latencies));
    let units =
        units.map(|((member, pace), (watched, latency))| UnitSummary::new(member, *pace, watched, latency));
    Ok((units.collect(), watched))
}

/// Waits for all producers; the first that fails stops the others.
async fn all(mut producers: JoinSet<Result<(), DemoError>>) -> Result<(), DemoError> {
    while let Some(ended) = producers.join_next().await {
        ended.map_err(DemoError::Task)??;
    }
    Ok(())
}

/// The figures as they are printed.
fn text(summary: &Summary, json: bool) -> String {
    if json {
        // A plain structure of numbers and texts, which always serialises.
        return serde_json::to_string(summary).unwrap_or_default();
    }
    let report =
        summary.report.as_ref().map_or_else(String::new, |path| format!("\nreport: {}", path.display()));
    format!(
        "{}\nraw: nominal scale factor and input axes only. rms over the three axes, peak to peak of the worst one.{report}",
        summary.table()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(flavor = "multi_thread")]
    async fn every_tick_of_every_unit_comes_back_and_correction_helps() {
        let begin = Instant::now();
        let mut fleet = fleet::fleet(7).unwrap();
        for member in &mut fleet {
            member.scenario.duration_s = 600.0;
            member.ticks = 600_000_000_000 / member.scenario.tick_ns.unsigned_abs();
        }
        let (units, watched) = play(&fleet, 1.0).await.unwrap();
        for (unit, member) in units.iter().zip(&fleet) {
            assert!(unit.is_whole(), "{unit:?}");
            assert_eq!((unit.ticks_in, unit.ticks_out), (member.ticks, member.ticks), "{unit:?}");
            // Ten minutes on, the fibre-optic unit's chamber has not begun to move.
            let drifts = member.kind.name != "fibre-optic";
            assert!(!drifts || unit.corrected_rms_deg_per_h < 0.2 * unit.raw_rms_deg_per_h, "{unit:?}");
            assert!(
                unit.added_latency_p50_us > 0.0 && unit.end_to_end_p50_us > unit.added_latency_p50_us,
                "{unit:?}"
            );
        }
        let switch = watched[0].scored.switch.as_ref().unwrap();
        assert!(switch.ticks.iter().any(|tick| tick.interpolated));

        let mut summary = Summary { units, report: None, seconds: begin.elapsed().as_secs_f64(), seed: 7 };
        let html = plots::page(&summary, &fleet, &watched);
        assert_eq!(html.matches("<figure class=\"chart\"").count(), 4);
        let json = serde_json::to_value(&summary).unwrap();
        assert_eq!(json["units"][2]["unit"], "MEMS-0001");
        assert_eq!(json["units"][1]["gaps"], 0);
        assert!(json["units"][0]["raw_peak_to_peak_deg_per_h"].is_f64());
        // On a busy machine.
        for unit in &mut summary.units {
            (unit.end_to_end_p50_us, unit.end_to_end_p99_us) = (25_166.0, 134_218.0);
        }
        let table = summary.table();
        assert!(table.lines().all(|line| line.chars().count() <= 80), "{table}");
    }
}
