//! Corrected ticks as rows of a CSV, and frames behind their lengths: written and read back.
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
//! | `angle_sigma_rad`, `velocity_sigma_m_per_s` | standard errors by cause (noise, restoration, calibration, clamping) and axis: 12 numbers, NaN where unknown, or empty |
//!
//! The wire format is one frame of `docs/wire.md` after the other, each behind its length: four bytes, little-endian.

use std::fmt::Debug;
use std::io::{self, Write};
use std::str::FromStr;

use arrayvec::ArrayVec;
use isotherm_correction::sample::{CorrectedTick, LasingMode, SensorFlags, TickFlags};
use isotherm_correction::sigma::{Causes, Sigma};
use isotherm_correction::units::{Span, Timestamp};

/// Names of the columns.
pub const HEADER: &str = "sequence,end_time_ns,duration_ns,ticks,missed,delta_angle_x_rad,delta_angle_y_rad,\
    delta_angle_z_rad,delta_velocity_x_m_per_s,delta_velocity_y_m_per_s,delta_velocity_z_m_per_s,mode,flags,\
    gyro_flags,accel_flags,gyro_parity_rad_per_s,accel_parity_m_per_s2,revision,angle_sigma_rad,\
    velocity_sigma_m_per_s";
/// The columns that every header begins with: files of before there were standard errors have no more.
pub const FIRST_COLUMNS: &str =
    match HEADER.split_at_checked(HEADER.len() - ",angle_sigma_rad,velocity_sigma_m_per_s".len()) {
        Some((first, _)) => first,
        None => HEADER,
    };

/// Writes the header line of the CSV.
///
/// # Errors
/// Those of the writer.
pub fn write_header(writer: &mut dyn Write) -> io::Result<()> {
    writeln!(writer, "{HEADER}")
}

/// A lasing mode as a cell.
pub(crate) fn mode_cell(mode: Option<LasingMode>) -> &'static str {
    match mode {
        Some(LasingMode::Plus) => "1",
        Some(LasingMode::Minus) => "-1",
        None => "",
    }
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
    write!(writer, ",{},{}", mode_cell(tick.mode), tick.flags.bits())?;
    write_cell(writer, tick.gyro_flags.iter().map(SensorFlags::bits))?;
    write_cell(writer, tick.accel_flags.iter().map(SensorFlags::bits))?;
    write_cell(writer, tick.gyro_parity.iter())?;
    write_cell(writer, tick.accel_parity.iter())?;
    write!(writer, ",{}", tick.revision)?;
    let sigma = tick.sigma.as_deref();
    for causes in [sigma.map(|sigma| sigma.angle), sigma.map(|sigma| sigma.velocity)] {
        let all = causes.map(|causes| causes.all());
        write_cell(writer, all.iter().flatten().flatten())?;
    }
    writeln!(writer)
}

/// Writes a cell of several values.
fn write_cell(writer: &mut dyn Write, values: impl Iterator<Item = impl Debug>) -> io::Result<()> {
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

/// Reads a row of the CSV back, to the bit.
///
/// # Errors
/// Which column cannot be read and what stands there.
pub fn read_tick(row: &str) -> Result<CorrectedTick, String> {
    let mut cells = Cells { cells: row.split(','), names: HEADER.split(',') };
    let mut tick = CorrectedTick {
        sequence: cells.value()?,
        end_time: Timestamp::from_ns(cells.value()?),
        duration: Span::from_ns(cells.value()?),
        ticks: cells.value()?,
        missed: cells.value()?,
        ..CorrectedTick::default()
    };
    for delta in tick.delta_angle.iter_mut().chain(&mut tick.delta_velocity) {
        *delta = cells.value()?;
    }
    let (column, mode) = cells.cell()?;
    tick.mode = match mode {
        "" => None,
        "1" => Some(LasingMode::Plus),
        "-1" => Some(LasingMode::Minus),
        other => return Err(format!("column {column} has {other:?}, must be 1, -1 or empty")),
    };
    tick.flags = TickFlags::from_bits_retain(cells.value()?);
    cells.values(|bits| tick.gyro_flags.try_push(SensorFlags::from_bits_retain(bits)).is_ok())?;
    cells.values(|bits| tick.accel_flags.try_push(SensorFlags::from_bits_retain(bits)).is_ok())?;
    cells.values(|residual| tick.gyro_parity.try_push(residual).is_ok())?;
    cells.values(|residual| tick.accel_parity.try_push(residual).is_ok())?;
    tick.revision = cells.value()?;
    tick.sigma = cells.sigma()?;
    match cells.cells.next() {
        Some(extra) => Err(format!("there is {extra:?} after the last column")),
        None => Ok(tick),
    }
}

/// Cells of a row beside the names of their columns.
struct Cells<'r> {
    cells: std::str::Split<'r, char>,
    names: std::str::Split<'static, char>,
}

impl<'r> Cells<'r> {
    fn cell(&mut self) -> Result<(&'static str, &'r str), String> {
        let column = self.names.next().unwrap_or_default();
        let cell = self.cells.next().ok_or_else(|| format!("column {column} is missing"))?;
        Ok((column, cell))
    }

    fn value<T: FromStr>(&mut self) -> Result<T, String> {
        let (column, cell) = self.cell()?;
        cell.parse().map_err(|_| format!("column {column} has {cell:?}, which cannot be read"))
    }

    /// Standard errors; none in rows without, or of a file written before there were any.
    fn sigma(&mut self) -> Result<Option<Box<Sigma>>, String> {
        if self.cells.clone().next().is_none() {
            return Ok(None);
        }
        let (angle, velocity) = (self.causes()?, self.causes()?);
        Ok(angle.zip(velocity).map(|(angle, velocity)| Box::new(Sigma { angle, velocity })))
    }

    fn causes(&mut self) -> Result<Option<Causes>, String> {
        let mut all = ArrayVec::<f64, 12>::new();
        let column = self.names.clone().next().unwrap_or_default();
        self.values(|sigma| all.try_push(sigma).is_ok())?;
        match all.as_chunks() {
            ([], []) => Ok(None),
            (&[noise, restoration, calibration, clamping], []) => {
                Ok(Some(Causes { noise, restoration, calibration, clamping }))
            }
            _ => Err(format!("column {column} has {} numbers, must be 12 or none", all.len())),
        }
    }

    fn values<T: FromStr>(&mut self, mut push: impl FnMut(T) -> bool) -> Result<(), String> {
        let (column, cell) = self.cell()?;
        for text in cell.split(' ').filter(|text| !text.is_empty()) {
            let value =
                text.parse().map_err(|_| format!("column {column} has {text:?}, which cannot be read"))?;
            if !push(value) {
                return Err(format!("column {column} has too many values: {cell:?}"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use isotherm_correction::sample::Sensors;

    use super::*;

    const CAUSES: Causes = Causes {
        noise: [1e-9, 0.1 + 0.2, 5e-324],
        restoration: [0.0; 3],
        calibration: [1.0, 2.0, 3.0],
        clamping: [0.5; 3],
    };

    #[test]
    fn a_row_reads_back_to_the_bit() {
        let tick = CorrectedTick {
            sequence: u64::MAX,
            end_time: Timestamp::from_ns(-5),
            duration: Span::from_ns(5_000_001),
            ticks: 2,
            missed: 7,
            delta_angle: [0.1 + 0.2, -0.0, 5e-324],
            delta_velocity: [f64::MAX, -1.0 / 3.0, 0.0],
            mode: Some(LasingMode::Minus),
            flags: TickFlags::GAP | TickFlags::WARM_UP,
            gyro_flags: [SensorFlags::VALID, SensorFlags::empty()].into_iter().collect(),
            accel_flags: Sensors::new(),
            gyro_parity: [1e-9, -2.5].into_iter().collect(),
            accel_parity: [].into_iter().collect(),
            revision: 3,
            series: 0,
            sigma: Some(Box::new(Sigma { angle: CAUSES, velocity: Causes::default() })),
        };
        let mut row = Vec::new();
        write_tick(&mut row, &tick).unwrap();
        let row = String::from_utf8(row).unwrap();
        let back = read_tick(row.trim_end()).unwrap();
        assert_eq!(back, tick);
        assert!(back.delta_angle[1].is_sign_negative());
        let bad = [
            "x,1",
            "1,2,3",
            &row.replace("-1,", "2,"),
            &format!("{},9", row.trim_end()),
            &row.replace("0.5 0.5 0.5", "0.5"),
        ];
        insta::assert_snapshot!(bad.map(|row| read_tick(row.trim_end()).unwrap_err()).join("\n"));
    }
}
