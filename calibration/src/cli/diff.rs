//! `isotherm-calibrate diff`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::page::PageArgs;
use super::print;
use crate::diff::changes;
use crate::error::Error;
use crate::written::Written;

/// Compare two calibration documents, such as those before and after shock or vibration
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate diff before.toml after.toml --html shock.html\n  \
    isotherm-calibrate diff before.toml after.toml --axis-sigma 12\n\n\
    Axes in ″ beside their uncertainty, biases and scale factors over temperature, then every entry that differs. The exit code is 0 \
    whether they differ or not.")]
pub(super) struct DiffArgs {
    /// The earlier document
    #[arg(value_name = "A")]
    before: PathBuf,
    /// The later document
    #[arg(value_name = "B")]
    after: PathBuf,
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
        self.page.check(&[&self.before, &self.after])?;
        let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let names = [name(&self.before), name(&self.after)];
        // Of two folders: the folder tells them apart.
        let names = if names[0] == names[1] {
            [&self.before, &self.after].map(|path| path.display().to_string())
        } else {
            names
        };
        let (before, after) = (Written::read(&self.before)?, Written::read(&self.after)?);
        let changes = changes(names, [&before, &after], self.axis_sigma)?;
        self.page.write(|| changes.sheet().to_html())?;
        let text = if self.json { format!("{}\n", changes.to_json()) } else { changes.sheet().to_text() };
        print(text.as_bytes())
    }
}
