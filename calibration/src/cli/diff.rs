//! `isotherm-calibrate diff`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::Args;

use super::driver::close;
use super::files::PageArgs;
use crate::document::Written;
use crate::document::diff::series::Series;
use crate::error::Error;
use crate::limits::above_0;
use crate::report::Report;

/// Compare calibration documents in order of time, such as those before, between and after shock and vibration
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate diff before.toml after.toml --html shock.html\n  \
    isotherm-calibrate diff before.toml after.toml --axis-sigma 12\n  \
    isotherm-calibrate diff before.toml between.toml after.toml\n\n\
    Shows by how much each sensor's axis, bias and scale factor have changed at most; --all also where, and every entry that differs. The exit code is 0 whether they differ or not.")]
pub(super) struct DiffArgs {
    /// The earlier document
    #[arg(value_name = "A")]
    before: PathBuf,
    /// The later documents, in order of time
    #[arg(value_name = "B", required = true)]
    after: Vec<PathBuf>,
    /// Standard error of a direction cosine (″), for a document that states none
    #[arg(long, value_name = "ARCSEC", value_parser = above_0)]
    axis_sigma: Option<f64>,
    /// Print every change of two documents
    #[arg(long)]
    all: bool,
    #[command(flatten)]
    page: PageArgs,
}

impl DiffArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        let paths: Vec<&Path> = [&self.before].into_iter().chain(&self.after).map(PathBuf::as_path).collect();
        let files = self.page.files();
        files.check(&paths)?;
        let mut documents = paths.iter().map(|path| Written::read(path)).collect::<Result<Vec<_>, _>>()?;
        let names: BTreeSet<&str> = documents.iter().map(|document| document.name.as_str()).collect();
        if names.len() < documents.len() {
            // Of several folders: the folder tells them apart.
            for (document, path) in documents.iter_mut().zip(&paths) {
                document.name = path.display().to_string();
            }
        }
        let series = Series::of(&documents, self.axis_sigma)?;
        match series.steps.as_slice() {
            [only] if self.all || only.entries.is_empty() => close(&files, &only.sheet(), Report::whole_text),
            [only] => close(&files, &only.sheet(), |_| only.in_brief()),
            _ => close(&files, &series.sheet(), Report::whole_text),
        }
    }
}
