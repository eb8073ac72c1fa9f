//! `isotherm-replay recover`.

use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::{Bar, Exit, print};
use isotherm_log::file::is_being_written;
use isotherm_log::recording::RecordingOptions;
use isotherm_log::recording::recover::{Recovery, RecoveryReport};

use super::show;
use crate::error::Error;

/// Damaged places that the table names.
const SHOWN: usize = 5;

/// Copy the intact part of a damaged recording
#[derive(Debug, Args)]
#[command(after_help = "Example, a recording that was cut short:\n  \
    isotherm-replay record --out cut.mcap --no-service --duration 1\n  \
    truncate --size=-50 cut.mcap\n  \
    isotherm-replay recover cut.mcap --out whole.mcap\n\n\
    Copies chunks with a right checksum; reading goes on after a damaged one. The new file has a summary; calibration\n\
    documents are restored from the journal. The old file does not change.\n\
    Exit code 3: part of the file is lost; the summary says what.")]
pub(super) struct RecoverArgs {
    /// The recording
    #[arg(value_name = "FILE")]
    input: PathBuf,
    /// The new file
    #[arg(long, short, value_name = "FILE")]
    out: PathBuf,
    /// Compression of the new file
    #[arg(long, value_enum, default_value_t)]
    compression: super::record::Compression,
    /// Replace an existing file
    #[arg(long)]
    overwrite: bool,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub(super) fn run(args: &RecoverArgs) -> Result<Exit, Error> {
    let recovery = Recovery::open(&args.input)?;
    if is_being_written(&args.input) {
        let recording = args.input.display();
        show::warn(format_args!("{recording} is still being written: later messages are not recovered"));
    }
    let options = RecordingOptions {
        compress: args.compression.compresses(),
        overwrite: args.overwrite,
        ..RecordingOptions::default()
    };
    let mut bar = Bar::over_log(recovery.progress().watch());
    let recovered = recovery.run(&args.out, options, |report| {
        bar.step_saying(|| Some(format!("{} messages", report.messages)));
    });
    bar.finish();
    let report = recovered?;
    let text = if args.json { show::json(&report) } else { human(&report, &args.out) };
    Ok(print(&text, Exit::of_loss(report.lost_data())))
}

/// The summary as a table.
fn human(report: &RecoveryReport, output: &Path) -> String {
    let mut rows = vec![
        ("written to", output.display().to_string()),
        ("messages", report.messages.to_string()),
        ("of topics", report.topics.len().to_string()),
        ("in chunks", report.chunks.to_string()),
        ("attachments", report.attachments.to_string()),
        ("documents restored", report.documents_rebuilt.to_string()),
        ("messages known to be lost", report.missing.to_string()),
        ("messages of unknown topics", report.nameless.to_string()),
        ("damaged places skipped", report.damaged_places.to_string()),
        ("of bytes", format!("{} of {}", report.damaged_bytes, report.bytes)),
    ];
    let ended = if report.ended { "yes" } else { "no: what the recorder had in memory is lost too" };
    rows.push(("the file had its end", ended.to_owned()));
    let mut lines = Vec::new();
    for damage in report.damage.iter().take(SHOWN) {
        let (offset, length) = (damage.offset, damage.length);
        lines.push(format!("byte {offset}, {length} bytes skipped: {}\n", damage.words));
    }
    if report.damaged_places > SHOWN as u64 {
        lines.push(format!("and {} further places: see --json\n", report.damaged_places - SHOWN as u64));
    }
    for (key, topic) in report.topics.iter().filter(|(_, topic)| topic.missing > 0) {
        let all = topic.missing + topic.messages;
        lines.push(format!("{key}: {} of {all} messages are missing\n", topic.missing));
    }
    show::table(&rows) + &lines.concat()
}
