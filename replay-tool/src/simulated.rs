//! Simulated logs: a scenario as a text log, with the mapping that reads it back to the bit.

use std::fmt::Write as _;
use std::io::{self, Write};

use isotherm_correction::sample::{
    AccelTick, ChannelName, GyroTick, LasingMode, OutputKind, TemperatureReading,
};
use isotherm_correction::units::Timestamp;
use isotherm_simulator::{Scenario, Simulation, Step};

use crate::error::Error;

/// What the columns of a simulated log are.
#[derive(Debug, Clone, PartialEq)]
pub struct Columns {
    /// What the gyros' readings stand for.
    gyro: OutputKind,
    /// Gyros.
    gyros: usize,
    /// What the accelerometers' readings stand for, and how many there are.
    accel: Option<(OutputKind, usize)>,
    /// The gyros have modes.
    mode: bool,
    /// The gyros report the slow meander's phase.
    meander: bool,
    /// The gyros have half-period counts.
    half_periods: bool,
    /// Temperature channels.
    channels: Vec<ChannelName>,
}

impl Columns {
    /// The columns that a scenario's ticks need.
    ///
    /// # Errors
    /// [`Error::Scenario`] with everything that is wrong with the scenario.
    pub fn of(scenario: &Scenario) -> Result<Self, Error> {
        let problems = |errors: isotherm_simulator::ScenarioErrors| {
            Error::Scenario(errors.0.iter().map(ToString::to_string).collect())
        };
        let first = Simulation::new(scenario).map_err(problems)?.next();
        let gyro = first.as_ref().map(|step| &step.gyro);
        let accel = first.as_ref().and_then(|step| step.accel.as_ref()).map(|accel| accel.readings.len());
        let channels = scenario.instrument.thermometers.channels.iter();
        Ok(Self {
            gyro: scenario.instrument.gyros.output_kind(),
            gyros: scenario.instrument.gyros.count(),
            accel: scenario.instrument.accel_output_kind().zip(accel),
            mode: gyro.is_some_and(|gyro| gyro.mode.is_some()),
            meander: gyro.is_some_and(|gyro| gyro.meander.is_some()),
            half_periods: gyro.is_some_and(|gyro| !gyro.half_periods.is_empty()),
            channels: channels.filter_map(|channel| ChannelName::from(&channel.name).ok()).collect(),
        })
    }

    /// Names of the columns.
    fn names(&self) -> Vec<String> {
        let mut names = vec!["end_time_ns".to_owned()];
        names.extend(self.channels.iter().map(|channel| format!("temperature_{channel}")));
        if let Some((_, count)) = self.accel {
            names.extend(["accel_sequence".into(), "accel_duration_ns".into()]);
            names.extend((1..=count).map(|number| format!("accel_{number}")));
        }
        names.extend(["gyro_sequence".into(), "gyro_duration_ns".into()]);
        if self.mode {
            names.extend(["mode".into(), "switch".into()]);
        }
        if self.meander {
            names.push("meander".into());
        }
        names.extend((1..=self.gyros).map(|number| format!("gyro_{number}")));
        if self.half_periods {
            names.extend(
                (1..=self.gyros).flat_map(|n| [format!("half_positive_{n}"), format!("half_negative_{n}")]),
            );
        }
        names
    }

    /// The mapping that reads the log back.
    #[must_use]
    pub fn mapping(&self) -> String {
        let mut text = String::from(
            "# Reads a log that `isotherm-replay simulate` wrote beside this file.\nversion = 1\n\n[[file]]\n\
             delimiter = \"comma\"\nheader = true\n\n[file.time]\ncolumn = \"end_time_ns\"\nunit = \"ns\"\n",
        );
        text.push_str(&section("gyro", "rad_per_s", self.gyro, self.gyros));
        if self.mode {
            text.push_str(
                "mode = { column = \"mode\", may_be_empty = true }\nswitch = { column = \"switch\" }\n",
            );
        }
        if self.meander {
            text.push_str("meander = { column = \"meander\", may_be_empty = true }\n");
        }
        if self.half_periods {
            text.push_str("half_periods = [\n");
            for n in 1..=self.gyros {
                let _ = writeln!(
                    text,
                    "    {{ positive = \"half_positive_{n}\", negative = \"half_negative_{n}\" }},"
                );
            }
            text.push_str("]\n");
        }
        if let Some((output, count)) = self.accel {
            text.push_str(&section("accel", "raw", output, count));
        }
        for channel in &self.channels {
            let (channel, column) = (quoted(channel), quoted(&format!("temperature_{channel}")));
            let _ = write!(
                text,
                "\n[[file.temperature]]\nchannel = {channel}\ncolumn = {column}\nunit = \"raw\"\nmay_be_empty = true\n"
            );
        }
        text
    }
}

/// The part of a mapping for sensors of one kind.
fn section(kind: &str, unit: &str, output: OutputKind, count: usize) -> String {
    let (output, unit) = match output {
        OutputKind::Counts => ("counts", "counts"),
        OutputKind::Mean => ("mean", unit),
    };
    let mut text = format!(
        "\n[file.{kind}]\noutput = \"{output}\"\nsequence_column = \"{kind}_sequence\"\n\
         duration_column = \"{kind}_duration_ns\"\nduration_unit = \"ns\"\nmay_be_empty = true\nsensors = [\n"
    );
    for number in 1..=count {
        let _ = writeln!(text, "    {{ column = \"{kind}_{number}\", unit = \"{unit}\" }},");
    }
    text.push_str("]\n");
    text
}

/// A text as TOML writes it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// Writes the rows of a simulated log.
#[derive(Debug)]
pub struct LogWriter {
    /// What the columns are.
    columns: Columns,
    /// Readings that have not been written yet, in time order.
    readings: Vec<TemperatureReading>,
}

impl LogWriter {
    /// Writes the header.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn new(columns: Columns, writer: &mut dyn Write) -> io::Result<Self> {
        let names = columns.names();
        let header: Vec<_> = names
            .iter()
            .map(|name| if name.contains([',', '"']) { csv_quoted(name) } else { name.clone() })
            .collect();
        writeln!(writer, "{}", header.join(","))?;
        Ok(Self { columns, readings: Vec::new() })
    }

    /// Writes the rows of one step.
    ///
    /// # Errors
    /// Those of the writer; [`io::ErrorKind::InvalidData`] for counts that are not whole.
    pub fn write(&mut self, step: &Step, writer: &mut dyn Write) -> io::Result<()> {
        self.readings.extend_from_slice(&step.temperatures);
        let end = step.gyro.end_time;
        // Readings of the same time share a row; those at the tick's end share the tick's.
        while let Some(time) = self.readings.first().map(|reading| reading.time).filter(|time| *time < end) {
            self.start_row(time, writer)?;
            self.end_row(None, None, writer)?;
        }
        self.start_row(end, writer)?;
        let accel = step.accel.as_ref();
        if let Some(accel) = accel.filter(|accel| accel.end_time != end) {
            let message = format!("accelerometer tick {} does not end with the gyro tick", accel.sequence);
            return Err(io::Error::new(io::ErrorKind::InvalidData, message));
        }
        self.end_row(accel, Some(&step.gyro), writer)
    }

    /// Writes the time and the temperatures that were read at it.
    fn start_row(&mut self, time: Timestamp, writer: &mut dyn Write) -> io::Result<()> {
        write!(writer, "{}", time.as_ns())?;
        for channel in &self.columns.channels {
            writer.write_all(b",")?;
            if let Some(reading) = self.readings.iter().find(|r| r.time == time && r.channel == *channel) {
                write!(writer, "{:?}", reading.raw)?;
            }
        }
        self.readings.retain(|reading| reading.time != time);
        Ok(())
    }

    /// Writes the ticks of a row.
    fn end_row(
        &self,
        accel: Option<&AccelTick>,
        gyro: Option<&GyroTick>,
        writer: &mut dyn Write,
    ) -> io::Result<()> {
        if let Some((output, count)) = self.columns.accel {
            match accel {
                Some(tick) => {
                    write!(writer, ",{},{}", tick.sequence, tick.duration.as_ns())?;
                    readings(output, &tick.readings, writer)?;
                }
                None => empty(count + 2, writer)?,
            }
        }
        let Some(tick) = gyro else {
            let states = 2 * usize::from(self.columns.mode) + usize::from(self.columns.meander);
            let halves = if self.columns.half_periods { 2 * self.columns.gyros } else { 0 };
            empty(2 + states + self.columns.gyros + halves, writer)?;
            return writeln!(writer);
        };
        write!(writer, ",{},{}", tick.sequence, tick.duration.as_ns())?;
        if self.columns.mode {
            write!(writer, ",{},{}", state(tick.mode), u8::from(tick.switch_command))?;
        }
        if self.columns.meander {
            write!(writer, ",{}", state(tick.meander))?;
        }
        readings(self.columns.gyro, &tick.readings, writer)?;
        if self.columns.half_periods {
            for half in &tick.half_periods {
                write!(writer, ",{},{}", half.positive, half.negative)?;
            }
        }
        writeln!(writer)
    }
}

/// Writes readings: counts as whole numbers, means in the shortest way that reads back to the bit.
fn readings(output: OutputKind, values: &[f64], writer: &mut dyn Write) -> io::Result<()> {
    for value in values {
        match output {
            OutputKind::Mean => write!(writer, ",{value:?}")?,
            OutputKind::Counts if value.fract() == 0.0 => write!(writer, ",{value:.0}")?,
            OutputKind::Counts => {
                let message = format!("count {value} is not whole: switch the scenario's quantisation on");
                return Err(io::Error::new(io::ErrorKind::InvalidData, message));
            }
        }
    }
    Ok(())
}

/// Writes empty cells.
fn empty(cells: usize, writer: &mut dyn Write) -> io::Result<()> {
    (0..cells).try_for_each(|_| writer.write_all(b","))
}

/// A state as a cell.
fn state(mode: Option<LasingMode>) -> &'static str {
    match mode {
        Some(LasingMode::Plus) => "1",
        Some(LasingMode::Minus) => "-1",
        None => "",
    }
}

/// A name in quotes.
fn csv_quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('"', "\"\""))
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
