//! The command line.

use std::path::PathBuf;

use clap::{Parser, Subcommand};
use isotherm_cli::{Exit, failed_lines, json as as_json, parse, print, say, table, to_stdout};

use crate::chain::{self, ChainArgs};
use crate::error::Error;
use crate::instructions::{self, Figures};
use crate::kernel;
use crate::offline;
use crate::part::{self, Role};
use crate::rounds::rounds;

/// How fast Isotherm is, as ratios to named references
#[derive(Debug, Parser)]
#[command(name = "isotherm-bench", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Time per tick of every kernel, beside what an autopilot does per sample
    Kernel {
        /// Rounds; every kernel runs once in each
        #[arg(long, default_value_t = 101, value_parser = rounds())]
        rounds: usize,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Instructions per tick of every kernel, compared with the committed figures (needs valgrind)
    Instructions {
        /// The committed figures
        #[arg(long, default_value = "bench/instructions.json")]
        figures: PathBuf,
        /// Write the figures instead of comparing with them
        #[arg(long)]
        bless: bool,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Latency, throughput and loss through the service, beside a bare relay and a Python script
    Chain(ChainArgs),
    /// Ticks per second that `isotherm-replay correct` does on one core
    Offline {
        /// Rounds
        #[arg(long, default_value_t = 3, value_parser = rounds())]
        rounds: usize,
        /// One round of a short log: whether all works, not how fast
        #[arg(long)]
        quick: bool,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Play one part of a chain
    #[command(hide = true)]
    Part {
        /// Which
        role: Role,
        /// What is to be done
        plan: PathBuf,
    },
    /// Run one kernel once: what `instructions` counts
    #[command(hide = true)]
    Pass {
        /// Which one
        index: usize,
    },
}

fn run(command: Command) -> Result<String, Error> {
    match command {
        Command::Kernel { rounds, json } => {
            let rows = kernel::measure(rounds)?;
            if json {
                return Ok(as_json(&rows));
            }
            let head = ["kernel", "ns per tick", "quartiles", "of autopilot"];
            let rows = rows.into_iter().map(|row| {
                let [low, high] = row.quartiles_ns;
                let [ns, ratio] = [format!("{:.1}", row.ns_per_tick), format!("{:.2}×", row.ratio_to_peer)];
                [row.name, ns, format!("{low:.1}…{high:.1}"), ratio]
            });
            Ok(format!("{}\n", table(head, rows, 1..)))
        }
        Command::Instructions { figures: path, bless, json } => {
            let counted = instructions::count()?;
            let printed = if json {
                as_json(&counted)
            } else {
                let rows =
                    counted.per_tick.iter().map(|(name, figure)| [name.clone(), format!("{figure:.1}")]);
                format!("{}\n", table(["kernel", "instructions per tick"], rows, 1..))
            };
            if bless {
                counted.write(&path)?;
                return Ok(printed);
            }
            let committed = Figures::read(&path)?;
            if counted.is_comparable(&committed) {
                counted.compare(&committed, &path)?;
            } else {
                say(format_args!(
                    "isotherm-bench: {} holds for {} on {}, this is {} on {}: nothing was compared; write the figures anew with \
                     --bless where that is what the project is built with now",
                    path.display(),
                    committed.compiler,
                    committed.architecture,
                    counted.compiler,
                    counted.architecture
                ));
            }
            Ok(printed)
        }
        Command::Chain(args) => {
            let report = chain::measure(&args);
            let text = if args.json { as_json(&report) } else { chain::table(&report) };
            if report.failed.is_empty() {
                return Ok(text);
            }
            // The error says what counts.
            let _ = to_stdout(text.as_bytes());
            Err(Error::Failed(report.failed))
        }
        Command::Offline { rounds, quick, json } => {
            let offline = offline::measure(rounds, quick)?;
            if json {
                return Ok(as_json(&offline));
            }
            let rows =
                [("from a recording", offline.correct_per_s), ("not compressed", offline.uncompressed_per_s)];
            let rows = rows.map(|(name, per_s)| [name.to_owned(), format!("{per_s:.0}")]);
            Ok(format!("{}\n", table(["correct, one core", "ticks/s"], rows, 1..)))
        }
        Command::Part { role, plan } => part::run(role, &plan).map(|()| String::new()),
        Command::Pass { index } => instructions::pass(index).map(|()| String::new()),
    }
}

/// Runs the program.
#[must_use]
pub fn main() -> Exit {
    match run(parse::<Cli>().command) {
        Ok(text) => print(&text, Exit::Ok),
        Err(error) => failed_lines(&error, Exit::Failed),
    }
}
