//! `isotherm-calibrate show`.

use std::path::PathBuf;

use clap::Args;

use super::page::PageArgs;
use super::print;
use crate::document::show::show;
use crate::document::written::Written;
use crate::error::Error;

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
    /// Print document and curves as one JSON object
    #[arg(long)]
    json: bool,
}

impl ShowArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        self.page.check(&[&self.document])?;
        let written = Written::read(&self.document)?;
        let name = self.document.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let shown = show(&name, &written)?;
        self.page.write(|| shown.sheet.to_html())?;
        let text = if self.json { format!("{}\n", shown.to_json()) } else { shown.sheet.to_text() };
        print(text.as_bytes())
    }
}
