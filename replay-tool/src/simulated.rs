//! Simulated logs: a scenario as a text log, with the mapping that reads it back to the bit.

use std::io::{self, Write};

use isotherm_correction::sample::{ChannelName, OutputKind, TemperatureReading};
use isotherm_correction::units::Timestamp;
use isotherm_log::streams::contents::{Shape, UnitContents};
use isotherm_log::streams::raw_text::RawColumns;
use isotherm_log::streams::rows::Row;
use isotherm_simulator::{Scenario, Simulation, Step};

use crate::error::Error;

/// Writes the rows of a simulated log.
#[derive(Debug)]
pub struct LogWriter {
    columns: RawColumns,
    /// What the gyros' readings stand for.
    gyro: OutputKind,
    /// What the accelerometers' readings stand for.
    accel: OutputKind,
    /// Readings that have not been written yet, in time order.
    readings: Vec<TemperatureReading>,
}

impl LogWriter {
    /// With the columns that a scenario's ticks need.
    ///
    /// # Errors
    /// [`Error::Scenario`] with everything that is wrong with the scenario.
    pub fn of(scenario: &Scenario) -> Result<Self, Error> {
        let problems = |errors: isotherm_simulator::ScenarioErrors| {
            Error::Scenario(errors.0.iter().map(ToString::to_string).collect())
        };
        let instrument = &scenario.instrument;
        let gyro = instrument.gyros.output_kind();
        let accel = instrument.accel_output_kind().unwrap_or(OutputKind::Mean);
        let channels = instrument.thermometers.channels.iter();
        let mut contents = UnitContents {
            channels: channels.filter_map(|channel| ChannelName::from(&channel.name).ok()).collect(),
            ..UnitContents::default()
        };
        if let Some(step) = Simulation::new(scenario).map_err(problems)?.next() {
            let tick = &step.gyro;
            contents.gyro.insert(Shape::of(gyro, &tick.readings, !tick.half_periods.is_empty()), 1);
            contents
                .accel
                .extend(step.accel.as_ref().map(|tick| (Shape::of(accel, &tick.readings, false), 1)));
            (contents.mode, contents.meander) = (tick.mode.is_some(), tick.meander.is_some());
        }
        let columns = RawColumns::of(&scenario.unit, &contents);
        Ok(Self { columns, gyro, accel, readings: Vec::new() })
    }

    /// The mapping that reads the log back.
    #[must_use]
    pub fn mapping(&self) -> String {
        self.columns.mapping()
    }

    /// Writes the header.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write_header(&self, writer: &mut dyn Write) -> io::Result<()> {
        self.columns.write_header(writer)
    }

    /// Writes the rows of one step.
    ///
    /// # Errors
    /// Those of the writer; [`io::ErrorKind::InvalidData`] for counts that are not whole.
    pub fn write(&mut self, step: &Step, writer: &mut dyn Write) -> io::Result<()> {
        let Self { columns, gyro, accel, .. } = self;
        let (gyro, accel) = (*gyro, *accel);
        self.readings.extend_from_slice(&step.temperatures);
        let end = step.gyro.end_time;
        if let Some(accel) = step.accel.as_ref().filter(|accel| accel.end_time != end) {
            let words = format!("accelerometer tick {} does not end with the gyro tick", accel.sequence);
            return Err(io::Error::new(io::ErrorKind::InvalidData, words));
        }
        are_whole(gyro, &step.gyro.readings)?;
        step.accel.as_ref().map_or(Ok(()), |tick| are_whole(accel, &tick.readings))?;
        // Readings of the same time share a row; those at the tick's end share the tick's.
        while let Some(time) = self.readings.first().map(|reading| reading.time).filter(|time| *time < end) {
            let temperatures = take(&mut self.readings, time);
            columns.write_row(&Row { time_ns: time.as_ns(), temperatures, ..Row::default() }, writer)?;
        }
        let row = Row {
            time_ns: end.as_ns(),
            temperatures: take(&mut self.readings, end),
            accel: step.accel.clone().map(|tick| (accel, tick)),
            gyro: Some((gyro, step.gyro.clone())),
        };
        columns.write_row(&row, writer).map(drop)
    }
}

/// Takes the readings of a time.
fn take(readings: &mut Vec<TemperatureReading>, time: Timestamp) -> Vec<TemperatureReading> {
    let (taken, left) = readings.drain(..).partition(|reading| reading.time == time);
    *readings = left;
    taken
}

/// Refuses counts that are not whole.
fn are_whole(output: OutputKind, values: &[f64]) -> io::Result<()> {
    let broken = values.iter().find(|value| output == OutputKind::Counts && value.fract() != 0.0);
    broken.map_or(Ok(()), |value| {
        let words = format!("count {value} is not whole: enable quantisation in the scenario");
        Err(io::Error::new(io::ErrorKind::InvalidData, words))
    })
}

/// Writes the header of the truth beside a log.
///
/// # Errors
/// Those of the writer.
pub fn write_truth_header(gyros: usize, writer: &mut dyn Write) -> io::Result<()> {
    write!(writer, "sequence,end_time_ns,delta_angle_x_rad,delta_angle_y_rad,delta_angle_z_rad,")?;
    write!(writer, "delta_velocity_x_m_per_s,delta_velocity_y_m_per_s,delta_velocity_z_m_per_s,")?;
    write!(writer, "chamber_deg_c,housing_deg_c,board_deg_c,lost")?;
    (1..=gyros).try_for_each(|number| write!(writer, ",gyro_{number}_drift_rad_per_s"))?;
    writeln!(writer)
}

/// Writes the truth of one step.
///
/// # Errors
/// Those of the writer.
pub fn write_truth(step: &Step, writer: &mut dyn Write) -> io::Result<()> {
    let truth = &step.truth;
    write!(writer, "{},{}", step.gyro.sequence, step.gyro.end_time.as_ns())?;
    for value in truth.delta_angle.iter().chain(&truth.delta_velocity) {
        write!(writer, ",{value:?}")?;
    }
    write!(writer, ",{:?},{:?},{:?}", truth.chamber_deg_c, truth.housing_deg_c, truth.board_deg_c)?;
    write!(writer, ",{}", u8::from(truth.lost))?;
    truth.gyro_drift_rad_per_s.iter().try_for_each(|drift| write!(writer, ",{drift:?}"))?;
    writeln!(writer)
}
