//! `isotherm-calibrate diff`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::Args;

use super::page::PageArgs;
use super::print;
use crate::diff::series::Series;
use crate::error::Error;
use crate::written::Written;

/// Compare calibration documents in order of time, such as those before, between and after shock and vibration
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate diff before.toml after.toml --html shock.html\n  \
    isotherm-calibrate diff before.toml after.toml --axis-sigma 12\n  \
    isotherm-calibrate diff before.toml between.toml after.toml\n\n\
    Shows axes in ″ with their uncertainty, biases and scale factors over temperature, then every entry that differs. The exit code is 0 whether they differ or not.")]
pub(super) struct DiffArgs {
    /// The earlier document
    #[arg(value_name = "A")]
    before: PathBuf,
    /// The later documents, in order of time
    #[arg(value_name = "B", required = true)]
    after: Vec<PathBuf>,
    /// Standard error of a direction cosine (″), for a document that states none
    #[arg(long, value_name = "ARCSEC")]
    axis_sigma: Option<f64>,
    #[command(flatten)]
    page: PageArgs,
    /// Print everything as one JSON object
    #[arg(long)]
    json: bool,
}

impl DiffArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        if let Some(sigma) = self.axis_sigma.filter(|sigma| !(sigma.is_finite() && *sigma > 0.0)) {
            return Err(Error::Usage(format!("--axis-sigma is {sigma}, must be a number of ″ above 0")));
        }
        let paths: Vec<&Path> = [&self.before].into_iter().chain(&self.after).map(PathBuf::as_path).collect();
        self.page.check(&paths)?;
        let name = |path: &&Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        // Of several folders: the folder tells them apart.
        let mut names: Vec<String> = paths.iter().map(name).collect();
        if names.iter().collect::<BTreeSet<_>>().len() < names.len() {
            names = paths.iter().map(|path| path.display().to_string()).collect();
        }
        let read = |(name, path): (String, &&Path)| Ok::<_, Error>((name, Written::read(path)?));
        let documents = names.into_iter().zip(&paths).map(read).collect::<Result<Vec<_>, _>>()?;
        let series = Series::of(&documents, self.axis_sigma)?;
        let (sheet, json) = match series.steps.as_slice() {
            [only] => (only.sheet(), only.to_json()),
            _ => (series.sheet(), series.to_json()),
        };
        self.page.write(|| sheet.to_html())?;
        let text = if self.json { format!("{json}\n") } else { sheet.to_text() };
        print(text.as_bytes())
    }
}
