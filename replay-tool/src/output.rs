//! Corrected ticks as a file: CSV, or the wire's frames. The form of both: [`isotherm_log::offline::rows`].

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use clap::ValueEnum;
use isotherm_log::file::{Partial, refuse_replacing};

pub use isotherm_log::offline::rows::{write_frame, write_header, write_tick};

use crate::error::Error;

/// How corrected ticks are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Format {
    /// One row per output.
    #[default]
    Csv,
    /// Frames as on the bus, each after its length.
    Wire,
}

/// A file that is being written, or standard output.
pub struct Output {
    /// Where bytes go.
    writer: BufWriter<Box<dyn Write>>,
    /// Name, for messages.
    name: String,
    /// A file that is not whole yet; `None` for standard output.
    partial: Option<Partial>,
}

impl std::fmt::Debug for Output {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Output").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Output {
    /// Creates a file, or takes standard output for `-`.
    ///
    /// # Errors
    /// [`Error::Log`] where it cannot be created, or is there already and may not be replaced.
    pub fn create(path: &Path, overwrite: bool) -> Result<Self, Error> {
        let mut partial = None;
        let writer: Box<dyn Write> = if path == Path::new("-") {
            Box::new(io::stdout())
        } else {
            refuse_replacing(path, overwrite)?;
            let writing = partial.insert(Partial::of(path)).writing();
            Box::new(File::create(writing).map_err(|source| Error::file(path, "create", source))?)
        };
        let name = path.display().to_string();
        Ok(Self { writer: BufWriter::with_capacity(1 << 16, writer), name, partial })
    }

    /// Writes whatever `write` does.
    ///
    /// # Errors
    /// [`Error::Log`] where it cannot be written.
    pub fn write(&mut self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Error> {
        let failed = |source| Error::file(Path::new(&self.name), "write", source);
        write(&mut self.writer).map_err(failed)
    }

    /// Writes out what is still here.
    ///
    /// # Errors
    /// [`Error::Log`] where it cannot be written.
    pub fn finish(mut self) -> Result<(), Error> {
        self.write(|writer| writer.flush())?;
        self.partial.map_or(Ok(()), |partial| Ok(partial.keep()?))
    }
}
