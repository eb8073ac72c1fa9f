//! `isotherm-calibrate show`.

use std::path::PathBuf;

use clap::Args;
use isotherm_log::file::refuse_overwriting;

use super::print;
use crate::error::Error;
use crate::show::show;
use crate::written::{Written, write_file};

/// Show a calibration document in words, as tables and as curves
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate show config/calibration/FOG-0001.toml\n  \
    isotherm-calibrate show unit.toml --html unit.html")]
pub(super) struct ShowArgs {
    /// The document (TOML)
    #[arg(value_name = "DOC")]
    document: PathBuf,
    /// Write it with its curves as one HTML file
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Print document and curves as one JSON object
    #[arg(long)]
    json: bool,
}

impl ShowArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        if let Some(html) = &self.html {
            refuse_overwriting(html, &[&self.document])?;
        }
        let written = Written::read(&self.document)?;
        let name = self.document.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let shown = show(&name, &written)?;
        if let Some(html) = &self.html {
            write_file(html, shown.sheet.to_html().as_bytes(), true)?;
        }
        let text = if self.json { format!("{}\n", shown.to_json()) } else { shown.sheet.to_text() };
        print(text.as_bytes())
    }
}
