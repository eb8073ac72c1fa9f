//! `isotherm-calibrate validate`.

use std::path::PathBuf;

use clap::Args;

use super::driver::{Done, Job, Task};
use super::files::PageArgs;
use super::place::PlaceArgs;
use super::runs::LogArgs;
use super::units::Logs;
use crate::error::Error;
use crate::limits::above_0;
use crate::validate::{JudgedLog, Wanted, validate};

/// Judge a calibration document on logs that it was not made from
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate validate FOG-0001.toml judging.mcap --html judgement.html\n  \
    isotherm-calibrate validate chamber-mems.toml chamber.tsv --mapping config/mappings/chamber-mems.toml\n  \
    isotherm-calibrate validate config/calibration fleet-1.mcap fleet-2.mcap --json\n\n\
    The unit is at rest in the logs. Before is nominal: the document without its temperature, bias and mode terms. Exit code 1 if the document makes an axis worse than nominal. With a folder of documents every unit of the logs is judged by its own document, with its own HTML file, FILE-SERIAL.html.")]
pub(super) struct ValidateArgs {
    /// The document, or a folder with the documents of several units
    #[arg(value_name = "DOC")]
    document: PathBuf,
    #[command(flatten)]
    log: LogArgs,
    /// Averaging windows (s) (default: 10, up to 100 in logs of an hour and more)
    #[arg(long, hide_short_help = true, value_name = "SECONDS", value_parser = above_0)]
    window: Option<f64>,
    #[command(flatten)]
    place: PlaceArgs,
    #[command(flatten)]
    page: PageArgs,
}

impl ValidateArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        let wanted = Wanted { window_s: self.window, place: self.place.known([1, 0])?.pop() };
        let logs = Logs::judging(&self.log, &self.document);
        let task = Task::new("Judgement of several units", self.page.files(), logs);
        task.run(|job| judged(job, wanted))
    }
}

/// A unit's runs with its document.
fn judged(job: &Job<'_>, wanted: Wanted) -> Result<Done, Error> {
    let work = job.work;
    let base = work.base()?;
    let logs = work.runs.iter().map(|run| JudgedLog::new(run.clone(), &base.document));
    let logs = logs.collect::<Result<Vec<_>, _>>()?;
    let mut report = validate(base, &logs, wanted)?;
    report.warnings.extend(work.told());
    Ok(Done { report, document: None })
}
