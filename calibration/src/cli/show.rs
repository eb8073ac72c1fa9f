//! `isotherm-calibrate show`.

use std::path::PathBuf;

use clap::Args;

use super::driver::close;
use super::files::PageArgs;
use crate::document::Written;
use crate::document::show::show;
use crate::error::Error;
use crate::report::Report;

/// Show a calibration document in words, as tables and as curves
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate show config/calibration/FOG-0001.toml\n  \
    isotherm-calibrate show unit.toml --html unit.html")]
pub(super) struct ShowArgs {
    /// The document (TOML)
    #[arg(value_name = "DOC")]
    document: PathBuf,
    #[command(flatten)]
    page: PageArgs,
}

impl ShowArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        let files = self.page.files();
        files.check(&[&self.document])?;
        close(&files, &show(&Written::read(&self.document)?)?, Report::whole_text)
    }
}
