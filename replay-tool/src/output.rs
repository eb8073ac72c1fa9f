//! Corrected ticks as a file: CSV, or the wire's frames.
//!
//! The CSV has one row per output. Its header names the columns with their units; floating-point numbers have as many
//! digits as it takes to read the same bits back (at most 17); a cell of several sensors separates them by a space:
//!
//! | columns | meaning |
//! |---|---|
//! | `sequence` | number of the (last) raw gyro tick |
//! | `end_time_ns`, `duration_ns` | end and measured duration |
//! | `ticks`, `missed` | raw ticks in this output; raw ticks missing before it |
//! | `delta_angle_{x,y,z}_rad` | angle increments about the case axes |
//! | `delta_velocity_{x,y,z}_m_per_s` | velocity increments along them |
//! | `mode` | lasing mode: 1, -1, or empty |
//! | `flags`, `gyro_flags`, `accel_flags` | bits, as on the wire |
//! | `gyro_parity_rad_per_s`, `accel_parity_m_per_s2` | N − 3 residuals |
//! | `revision` | counter of the calibration; 0 while there is none |
//!
//! The wire format is one frame of `docs/wire.md` after the other, each behind its length: four bytes, little-endian.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use clap::ValueEnum;
use isotherm_correction::sample::{CorrectedTick, LasingMode, SensorFlags};

use crate::error::Error;

/// Names of the columns.
const HEADER: &str = "sequence,end_time_ns,duration_ns,ticks,missed,delta_angle_x_rad,delta_angle_y_rad,\
    delta_angle_z_rad,delta_velocity_x_m_per_s,delta_velocity_y_m_per_s,delta_velocity_z_m_per_s,mode,flags,\
    gyro_flags,accel_flags,gyro_parity_rad_per_s,accel_parity_m_per_s2,revision";

/// How corrected ticks are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Format {
    /// One row per output.
    #[default]
    Csv,
    /// The wire's frames, each behind its length.
    Wire,
}

/// A file that is being written, or standard output.
pub struct Output {
    /// Where bytes go.
    writer: BufWriter<Box<dyn Write>>,
    /// Name, for messages.
    name: String,
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
    /// [`Error::File`] where it cannot be created.
    pub fn create(path: &Path) -> Result<Self, Error> {
        let writer: Box<dyn Write> = match path.to_str() {
            Some("-") => Box::new(io::stdout()),
            _ => Box::new(File::create(path).map_err(|source| Error::file(path, "create", source))?),
        };
        Ok(Self { writer: BufWriter::with_capacity(1 << 16, writer), name: path.display().to_string() })
    }

    /// Writes whatever `write` does.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be written.
    pub fn write(&mut self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Error> {
        let failed = |source| Error::file(Path::new(&self.name), "write", source);
        write(&mut self.writer).map_err(failed)
    }

    /// Writes out what is still here.
    ///
    /// # Errors
    /// [`Error::File`] where it cannot be written.
    pub fn finish(mut self) -> Result<(), Error> {
        self.write(|writer| writer.flush())
    }
}

/// Writes the header line of the CSV.
///
/// # Errors
/// Those of the writer.
pub fn write_header(writer: &mut dyn Write) -> io::Result<()> {
    writeln!(writer, "{HEADER}")
}

/// Writes one output as a row of the CSV.
///
/// # Errors
/// Those of the writer.
pub fn write_tick(writer: &mut dyn Write, tick: &CorrectedTick) -> io::Result<()> {
    let (end, duration) = (tick.end_time.as_ns(), tick.duration.as_ns());
    write!(writer, "{},{end},{duration},{},{}", tick.sequence, tick.ticks, tick.missed)?;
    for delta in tick.delta_angle.iter().chain(&tick.delta_velocity) {
        write!(writer, ",{delta:?}")?;
    }
    let mode = match tick.mode {
        Some(LasingMode::Plus) => "1",
        Some(LasingMode::Minus) => "-1",
        None => "",
    };
    write!(writer, ",{mode},{}", tick.flags.bits())?;
    write_cell(writer, tick.gyro_flags.iter().map(SensorFlags::bits))?;
    write_cell(writer, tick.accel_flags.iter().map(SensorFlags::bits))?;
    write_cell(writer, tick.gyro_parity.iter())?;
    write_cell(writer, tick.accel_parity.iter())?;
    writeln!(writer, ",{}", tick.revision)
}

/// Writes a cell of several values.
fn write_cell(writer: &mut dyn Write, values: impl Iterator<Item = impl std::fmt::Debug>) -> io::Result<()> {
    let mut before = ',';
    let mut written = false;
    for value in values {
        write!(writer, "{before}{value:?}")?;
        (before, written) = (' ', true);
    }
    if written { Ok(()) } else { writer.write_all(b",") }
}

/// Writes a frame behind its length.
///
/// # Errors
/// Those of the writer.
pub fn write_frame(writer: &mut dyn Write, frame: &[u8]) -> io::Result<()> {
    let length = u32::try_from(frame.len()).map_err(io::Error::other)?;
    writer.write_all(&length.to_le_bytes())?;
    writer.write_all(frame)
}
