//! `isotherm-calibrate merge`.

use std::path::{Path, PathBuf};

use clap::Args;

use super::output::date;
use super::page::writable;
use super::print;
use crate::error::Error;
use crate::merge::{Merged, Named, Take, merge};
use crate::written::Written;

/// Put parts of a calibration that different commands have made into one document
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    isotherm-calibrate merge nominal.toml thermal.toml positions.toml --out unit.toml\n  \
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
    #[arg(long, value_name = "DATE")]
    created: Option<String>,
    /// Print the origin of each section as one JSON object
    #[arg(long)]
    json: bool,
}

impl MergeArgs {
    /// Does what the command says.
    pub(super) fn run(&self) -> Result<(), Error> {
        let inputs: Vec<&Path> = self.part.iter().chain([&self.base]).map(PathBuf::as_path).collect();
        writable(&self.out, &inputs, self.overwrite)?;
        let base = named(&self.base)?;
        let parts = self.part.iter().map(|path| named(path)).collect::<Result<Vec<_>, _>>()?;
        let mut merged: Merged = merge(&base, &parts, &self.take)?;
        let mut document = merged.written.document.clone();
        document.created = Some(date(self.created.as_deref())?);
        merged.written = Written::of(&document)?;
        merged.written.save(&self.out, self.overwrite)?;
        let name = name_of(&self.out);
        let text =
            if self.json { format!("{}\n", merged.to_json(&name)) } else { merged.sheet(&name).to_text() };
        print(text.as_bytes())
    }
}

fn named(path: &Path) -> Result<Named, Error> {
    Ok(Named { name: name_of(path), written: Written::read(path)? })
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
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
