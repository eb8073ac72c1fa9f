//! Where the corrected ticks of a log's units go.

use std::collections::BTreeSet;
use std::fs::create_dir_all;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use isotherm_log::file::{self, Partial};
use isotherm_log::offline::rows::write_header;
use isotherm_log::offline::{Form, Made};
use isotherm_log::recording::{Documents, Metadata, RecordingOptions, RecordingWriter};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::key::UnitId;

use super::CorrectArgs;
use crate::cli::{check_outputs, show};
use crate::error::Error;

/// How corrected ticks are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum Format {
    /// One row per output.
    #[default]
    Csv,
    /// Frames as on the bus, each after its length.
    Wire,
}

/// Whether the ticks go into a recording, by the output's name.
pub(super) fn is_recording(out: &Path) -> bool {
    out.extension().is_some_and(|extension| extension == "mcap")
}

/// What is written to.
pub(super) enum Sink {
    /// Nothing.
    None,
    /// A file for each unit, by its place.
    Files(Vec<file::Sink>),
    /// A recording.
    Recording { writer: Box<RecordingWriter>, partial: Partial, attached: BTreeSet<Digest>, received_ns: u64 },
}

impl Sink {
    /// Opens it.
    ///
    /// # Errors
    /// [`Error::Usage`] where several units do not fit, [`Error::Log`] where it cannot be created or replaced.
    pub(super) fn open(args: &CorrectArgs, units: &[UnitId]) -> Result<Self, Error> {
        let CorrectArgs { out: Some(out), format, overwrite, .. } = args else { return Ok(Self::None) };
        let mut inputs = args.log.inputs();
        inputs.extend(args.calibration.iter().cloned());
        let inputs = inputs.iter().map(PathBuf::as_path);
        if is_recording(out) {
            if format.is_some() {
                return Err(Error::Usage("--format is for files other than FILE.mcap".to_owned()));
            }
            check_outputs([out.as_path()], inputs, *overwrite)?;
            let partial = Partial::of(out);
            let options = RecordingOptions { json: true, overwrite: true, ..RecordingOptions::default() };
            let writer = Box::new(RecordingWriter::create(partial.writing(), options)?);
            return Ok(Self::Recording { writer, partial, attached: BTreeSet::new(), received_ns: 0 });
        }
        let format = format.unwrap_or_default();
        let folder = out.is_dir() || out.as_os_str().to_string_lossy().ends_with('/');
        let paths: Vec<PathBuf> = match units {
            _ if folder => {
                create_dir_all(out).map_err(|source| Error::file(out, "create the folder", source))?;
                let extension = if format == Format::Csv { "csv" } else { "wire" };
                units.iter().map(|unit| out.join(format!("{unit}.{extension}"))).collect()
            }
            [_] => vec![out.to_owned()],
            _ => {
                return Err(Error::Usage(format!(
                    "the log is of {} units: --out must be a folder ({}/) or FILE.mcap, or --unit must name one of them",
                    units.len(),
                    out.display()
                )));
            }
        };
        let is_stdout = |path: &Path| path == Path::new("-");
        let outputs = paths.iter().map(PathBuf::as_path).filter(|path| !is_stdout(path));
        check_outputs(outputs, inputs, *overwrite)?;
        let mut files = Vec::new();
        for path in paths {
            let mut file = if is_stdout(&path) { file::Sink::stdout() } else { file::Sink::create(&path)? };
            if format == Format::Csv {
                file.write(|writer| write_header(writer))?;
            }
            files.push(file);
        }
        Ok(Self::Files(files))
    }

    /// What has to be made of the ticks.
    pub(super) fn form(&self, format: Option<Format>) -> Form {
        match self {
            Self::None => Form::Sums,
            Self::Files(_) if format == Some(Format::Wire) => Form::Wire,
            Self::Files(_) => Form::Csv,
            Self::Recording { .. } => Form::Messages,
        }
    }

    /// Puts a document beside the ticks, once.
    pub(super) fn document(&mut self, bytes: Vec<u8>) -> Result<(), isotherm_log::error::Error> {
        if let Self::Recording { writer, attached, received_ns, .. } = self
            && attached.insert(Digest::of(&bytes))
        {
            writer.attach(&Documents::attachment(bytes, *received_ns))?;
        }
        Ok(())
    }

    /// Writes what was made of a block.
    pub(super) fn write(&mut self, made: Made) -> Result<(), isotherm_log::error::Error> {
        match self {
            Self::None => Ok(()),
            Self::Files(files) => made.into_iter().try_for_each(|(place, output)| {
                let file = files.get_mut(place);
                file.map_or(Ok(()), |file| file.write(|writer| writer.write_all(&output.bytes)))
            }),
            Self::Recording { writer, received_ns, .. } => {
                let (mut messages, mut documents) = (Vec::new(), Vec::new());
                for (_, output) in made {
                    messages.extend(output.messages);
                    documents.extend(output.documents);
                }
                // Each unit's own are in order already.
                messages.sort_by_key(|message| message.received_ns);
                for message in &messages {
                    *received_ns = message.received_ns.max(*received_ns);
                    writer.write(message)?;
                }
                documents.into_iter().try_for_each(|(_, text)| self.document(text.into_bytes()))
            }
        }
    }

    /// Writes out what is still here; a recording says of itself what it was made of.
    pub(super) fn finish(self, inputs: &[PathBuf]) -> Result<(), Error> {
        match self {
            Self::None => Ok(()),
            Self::Files(files) => files.into_iter().try_for_each(|file| Ok(file.finish()?.keep()?)),
            Self::Recording { mut writer, partial, .. } => {
                let values = [
                    ("made_by", concat!("isotherm-replay correct ", env!("CARGO_PKG_VERSION")).to_owned()),
                    ("made_of", show::names(inputs)),
                ];
                writer.metadata(&Metadata::of(values))?;
                writer.finish()?;
                Ok(partial.keep()?)
            }
        }
    }
}
