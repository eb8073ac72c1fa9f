//! `isotherm-calibrate merge`.

use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_protocol::document::Created;

use super::driver::close;
use super::files::Files;
use super::output::{a_date, date};
use crate::document::merge::{Merged, Take, merge};
use crate::document::{Written, name_of};
use crate::error::Error;
use crate::report::Report;

/// Put parts of a calibration that different commands have made into one document
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate merge nominal.toml positions.toml rates.toml --out unit.toml\n  \
    isotherm-calibrate merge nominal.toml a.toml b.toml --take gyro.sensor.x=b.toml --out unit.toml\n\n\
    Each part is compared with BASE, the document that the fits started from; its differences are taken. If two parts state a key differently, the key is reported, and nothing is written until --take decides.")]
pub(super) struct MergeArgs {
    /// The document that the parts were made from
    #[arg(value_name = "BASE")]
    base: PathBuf,
    /// Documents with a part of the calibration each
    #[arg(required = true, value_name = "PART")]
    part: Vec<PathBuf>,
    /// The new document
    #[arg(long, short, value_name = "NEW")]
    out: PathBuf,
    /// Take a key, and all keys that begin with it, from this document; repeatable, the last one decides
    #[arg(long, value_name = "KEY=DOC", value_parser = choice)]
    take: Vec<Take>,
    /// Replace an existing file
    #[arg(long)]
    overwrite: bool,
    /// Date of the new document (YYYY-MM-DD; default: today, UTC)
    #[arg(long, hide_short_help = true, value_name = "DATE", value_parser = a_date)]
    created: Option<Created>,
    /// Print the origin of each section as one JSON object
    #[arg(long)]
    json: bool,
}

impl MergeArgs {
    pub(super) fn run(&self) -> Result<(), Error> {
        let inputs: Vec<&Path> = self.part.iter().chain([&self.base]).map(PathBuf::as_path).collect();
        let files = Files { out: Some(&self.out), html: None, overwrite: self.overwrite, json: self.json };
        files.check(&inputs)?;
        let base = Written::read(&self.base)?;
        let parts = self.part.iter().map(|path| Written::read(path)).collect::<Result<Vec<_>, _>>()?;
        let mut merged: Merged = merge(&base, &parts, &self.take)?;
        let mut document = merged.written.document.clone();
        document.created = Some(date(self.created)?);
        merged.written = Written::of(&document)?;
        merged.written.save(&self.out, self.overwrite)?;
        let name = name_of(&self.out);
        close(&files, &merged.sheet(&name), Report::whole_text)
    }
}

/// Reads KEY=DOC.
fn choice(text: &str) -> Result<Take, String> {
    match text.split_once('=') {
        Some((key, from)) if !key.is_empty() && !from.is_empty() => {
            Ok(Take { key: key.to_owned(), from: name_of(Path::new(from)) })
        }
        _ => Err("must be a key and a document, such as gyro.sensor.x=thermal.toml".into()),
    }
}
